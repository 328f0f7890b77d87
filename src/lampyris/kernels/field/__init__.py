"""Kernels of the cost-to-go field: wavefronts, descent, repair, gates, clearance."""
