"""Whether two cells are connected: by SciPy once it is imported, else by array operations over whole fronts."""

from __future__ import annotations

import sys

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint, uninterrupted
from lampyris.kernels.loading import loading

FRONTS = 4
"""Fronts that are followed, in rows and columns of the map, before SciPy is imported, which takes as long as 3,000 fronts: in
mazes there are far more fronts, of a few cells each."""


def are_connected(free: NDArray[np.uint8], stride: int, a: int, b: int, *, corners: bool) -> bool:
    """Whether single steps through free cells lead from one flat cell to another.

    Parameters
    ----------
    free : uint8 (n,), 1 where a cell is free; blocked around.
    stride : cells in a row.
    a, b : flat free cells.
    corners : whether cells that share a corner alone are connected, too.
    """
    if "scipy.ndimage" not in sys.modules:
        known = _by_fronts(free, stride, a, b, corners)
        if known is not None:
            return known
    with uninterrupted(), loading():  # its first import is not counted as planning
        from scipy import ndimage  # bits: labels, whole numbers

    labels, _ = ndimage.label(free.reshape(-1, stride), np.ones((3, 3)) if corners else None)
    at = labels.ravel()
    return bool(at[a] == at[b])


def _by_fronts(free: NDArray[np.uint8], stride: int, a: int, b: int, corners: bool) -> bool | None:
    """The same by a breadth-first search with array operations; None where it has too many fronts."""
    left = free.astype(np.bool_)
    number = np.zeros(free.size, dtype=np.int32)
    across = (1, -1, stride, -stride)
    steps = np.array((*across, *(v + h for v in (stride, -stride) for h in (1, -1))) if corners else across)
    front = np.array([a])
    left[a] = False
    for k in range(FRONTS * (stride + free.size // stride)):
        if not front.size or not left[b]:
            return not left[b]
        if k % 256 == 0:
            checkpoint()
        near = (front[:, np.newaxis] + steps).ravel()
        near = near[left[near]]
        left[near] = False
        # Each cell once: the last of those that came to it.
        order = np.arange(near.size, dtype=np.int32)
        number[near] = order
        front = near[number[near] == order]
    return None
