"""Geometry of the referee, measured by other means than the product's own."""
