"""Nouns of a race of planners."""
