"""Compiled loops over flat arrays. They import NumPy and :mod:`._jit`, nothing else of ours.

A kernel is a function: arrays in, arrays out, one loop; randomness arrives as numbers.
"""
