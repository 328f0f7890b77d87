"""Timing: the fastest motion along a path among obstacles whose tracks are known."""
