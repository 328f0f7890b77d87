"""Kernels of controllers that steer."""
