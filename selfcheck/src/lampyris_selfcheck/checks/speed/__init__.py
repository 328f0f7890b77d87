"""Checks of speed profiles."""
