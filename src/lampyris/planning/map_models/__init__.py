"""Planners on models of the map: visibility graph, ridges of clearance, quadtree."""
