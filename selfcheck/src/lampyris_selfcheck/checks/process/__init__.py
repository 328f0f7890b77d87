"""Checks of whole processes: deadlines, determinism, seeded defects, order of tests."""
