"""Planners of poses on a state lattice: cells and headings, joined by motion primitives."""
