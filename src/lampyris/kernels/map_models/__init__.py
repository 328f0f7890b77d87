"""Loops over models of maps: visibility graph, skeleton, quadtree."""
