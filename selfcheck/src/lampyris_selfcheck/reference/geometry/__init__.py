"""Straight lines and polygons, from their definitions."""
