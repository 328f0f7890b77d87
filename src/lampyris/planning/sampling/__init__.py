"""Planners that sample: RRT, RRT-Connect, RRT*, Informed RRT*, BIT*."""
