"""Scenario files: their schema, and the nouns that are built from them."""
