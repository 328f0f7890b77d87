"""Measures and records of fleets."""
