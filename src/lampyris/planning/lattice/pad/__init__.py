"""Planning with adaptive dimensionality: cells almost everywhere, poses where it takes them."""
