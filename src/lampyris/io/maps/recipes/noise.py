"""Smooth noise in whole numbers, so that no machine's rounding can move a cell."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Whole = NDArray[np.int32]

BITS = 8
ONE = 1 << BITS
"""One, in the fixed-point weights."""


def smooth(lattice: Whole, width: int, height: int, pitch: int) -> Whole:
    """Values spread smoothly between the points of a lattice, times ONE squared; int32 (height, width).

    Parameters
    ----------
    lattice : int32, at least (height // pitch + 2, width // pitch + 2): a point every ``pitch`` cells. No
        value may exceed 2^14, or the products would not fit.
    """
    at, weight = _weights(width, pitch)
    wide = _between(lattice[:, at], lattice[:, at + 1], weight)
    at, weight = _weights(height, pitch)
    return _between(wide[at], wide[at + 1], weight[:, None])


def _between(a: Whole, b: Whole, weight: Whole) -> Whole:
    """From a (weight 0) to b (weight ONE), times ONE."""
    return np.asarray(a * (ONE - weight) + b * weight, dtype=np.int32)


def _weights(length: int, pitch: int) -> tuple[Whole, Whole]:
    """For each of so many cells: the lattice point before it, and the weight of the next (0 to ONE)."""
    cell = np.arange(length, dtype=np.int64)
    t = cell % pitch
    weight = t * t * (3 * pitch - 2 * t) * ONE // pitch**3
    return (cell // pitch).astype(np.int32), weight.astype(np.int32)
