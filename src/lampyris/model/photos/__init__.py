"""Photographs that became maps."""
