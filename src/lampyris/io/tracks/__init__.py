"""Tracks and states of obstacles from files."""
