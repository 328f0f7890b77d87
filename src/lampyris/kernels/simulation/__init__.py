"""Kernels of simulations in ticks."""
