"""Loops over states with a heading."""
