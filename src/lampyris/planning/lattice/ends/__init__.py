"""Ends of paths at poses that are no states of the lattice."""
