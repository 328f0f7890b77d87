"""Graph search on the grid: A*, Dijkstra, JPS, bidirectional and any-angle search."""
