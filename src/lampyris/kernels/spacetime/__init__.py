"""Kernels of search in space and time."""
