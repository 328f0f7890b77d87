"""Kernels of AD-GSO: the walk, and whole simulations of it."""
