"""Checks of multi-robot planning and of robot swarms."""
