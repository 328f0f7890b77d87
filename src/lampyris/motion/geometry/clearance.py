"""Clearance: how far points of a drivable path are from the walls."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris.errors import SettingError, shown
from lampyris.kernels.motion.wall_distance import nearest_walls
from lampyris.model.grid import Grid
from lampyris.typing import BoolGrid, Floats, Points

_BOX = 65_536
"""Cells around a run of points above which it is cut in two: packing the map must not outweigh asking it."""
_FEW = 32
"""Points that are not cut any more."""


def wall_distance(xy: Points, grid: Grid, reach: float) -> Floats:
    """Distance from each point to the nearest square of a blocked cell, metres, (n,); infinity beyond reach.

    Exact (to rounding) wherever the point lies, and 0 within a blocked square. The edge of the map is not a
    wall.

    Parameters
    ----------
    xy : float64 (n, 2), cells; finite.
    grid : the map.
    reach : how far to look, metres, >= 0; infinity: everywhere.

    Raises
    ------
    SettingError : ``PATH_POINTS``: not of that shape, or not finite; ``REACH``.
    """
    points = np.asarray(xy, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise SettingError("PATH_POINTS", f"an array of shape {points.shape}", allowed="finite, (n, 2)")
    if not (isinstance(reach, int | float) and reach >= 0.0):
        raise SettingError("REACH", shown(reach), allowed="metres, 0 or more")
    far = reach / grid.resolution
    # The kernel tells what is nearer than it was given; a wall at the very reach is still within it.
    squared = np.full(len(points), np.nextafter(far * far, np.inf))
    _ask(points[:, 0], points[:, 1], grid.blocked, far, squared)
    near = squared <= far * far if far < np.inf else squared < np.inf
    return np.where(near, np.sqrt(np.where(near, squared, 0.0)) * grid.resolution, np.inf)


def _ask(x: Floats, y: Floats, blocked: BoolGrid, far: float, squared: Floats) -> None:
    """Fill in the squared distances of a run of points, packing only the map around them."""
    if len(x) == 0:
        return
    height, width = blocked.shape
    x0, x1 = _span(x, far, width)
    y0, y1 = _span(y, far, height)
    if (x1 - x0) * (y1 - y0) > _BOX and len(x) > _FEW:
        half = len(x) // 2
        _ask(x[:half], y[:half], blocked, far, squared[:half])
        _ask(x[half:], y[half:], blocked, far, squared[half:])
        return
    if x0 >= x1 or y0 >= y1:
        return
    words = _packed(blocked[y0:y1, x0:x1])
    if words.any():
        stride = words.shape[1]
        bands = np.bitwise_or.reduceat(words, index_array(np.arange(0, len(words), 8)), axis=0)
        nearest_walls(words.ravel(), bands.ravel(), stride, x1 - x0, y1 - y0, x - x0, y - y0, squared)


def _span(x: Floats, far: float, size: int) -> tuple[int, int]:
    """The columns (or rows) that lie within reach of any of the points."""
    least, most = float(x.min()) - far - 1.0, float(x.max()) + far + 1.0
    return math.floor(min(max(least, 0.0), size)), math.ceil(min(max(most + 1.0, 0.0), size))


def _packed(blocked: BoolGrid) -> NDArray[np.uint64]:
    """Rows of 64-bit words, the lowest bit leftmost."""
    octets = np.packbits(blocked, axis=1, bitorder="little")
    wide = np.zeros((len(octets), -(-octets.shape[1] // 8) * 8), dtype=np.uint8)
    wide[:, : octets.shape[1]] = octets
    return wide.view("<u8").astype(np.uint64, copy=False)
