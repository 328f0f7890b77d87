"""Kernels of motion: speeds, curves, sight, collision times."""
