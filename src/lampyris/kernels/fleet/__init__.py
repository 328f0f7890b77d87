"""Loops of multi-robot planning: distance tables, PIBT, LaCAM*, large neighbourhood search, conflict-based search."""
