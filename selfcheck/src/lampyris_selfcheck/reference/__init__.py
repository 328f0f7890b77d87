"""Slow references: plain Python from definitions alone, sharing no code with what they judge."""
