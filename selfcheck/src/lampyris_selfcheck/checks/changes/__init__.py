"""Checks of repair and of replanning on maps that change."""
