"""Checks of paths, fields and the referee on maps that do not change."""
