"""Simulation tick by tick on the grid."""
