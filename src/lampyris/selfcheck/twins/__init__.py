"""Slow reference twins: plain Python from definitions alone, sharing no code with what they judge."""
