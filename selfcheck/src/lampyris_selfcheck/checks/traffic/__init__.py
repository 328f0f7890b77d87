"""Checks among moving obstacles: planners, simulations, drives, monitors."""
