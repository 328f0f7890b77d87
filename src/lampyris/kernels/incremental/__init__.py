"""Kernels of incremental search."""
