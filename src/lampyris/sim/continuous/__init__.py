"""Simulation in continuous time: the robot between cells, with real accelerations."""
