"""Kernels of graph search: A*, Dijkstra, JPS, bidirectional and any-angle search."""
