"""Loops over shortest curves of bounded curvature."""
