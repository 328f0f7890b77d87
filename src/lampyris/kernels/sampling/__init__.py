"""Loops of planners that sample."""
