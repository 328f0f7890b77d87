"""Loops of multi-robot planning: distance tables, PIBT, LaCAM*."""
