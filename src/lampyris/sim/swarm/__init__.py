"""Swarms of robots that look for sources, simulated."""
