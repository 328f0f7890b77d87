"""The geometry of motion: curves, string pulling, smoothing, clearance along a path."""
