"""Values of state lattices."""
