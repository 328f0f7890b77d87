"""Moving obstacles of a simulation: placed, driven and kept apart."""
