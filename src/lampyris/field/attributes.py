"""Attributes: what a cell costs besides distance, for planners that are asked to mind more than length.

The dissertation suggests them as future work: obstacle density, terrain, traffic. Each is a number from 0 to
252 a cell, as terrain is (:class:`lampyris.model.grid.Grid`), and they are added up: so any field and any
search that knows terrain knows them all. The scales are ours.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import MAX_TERRAIN, Grid, frozen
from lampyris.typing import BoolGrid, ByteGrid, Cell, FloatGrid


def density(blocked: BoolGrid, window: int) -> FloatGrid:
    """Share of blocked cells in the square of ``2 window + 1`` cells around each; float64, (height, width).

    Cells outside the map are not blocked, and count in no share.
    """
    sums = _box_sums(blocked.astype(np.int64), window)
    cells = _box_sums(np.ones(blocked.shape, dtype=np.int64), window)
    share: FloatGrid = sums / cells
    return share


def _box_sums(values: np.ndarray, window: int) -> np.ndarray:
    """Sums over squares cut off at the edge, from one table of running sums."""
    height, width = values.shape
    table = np.zeros((height + 1, width + 1), dtype=np.int64)
    table[1:, 1:] = values.cumsum(axis=0).cumsum(axis=1)
    top = np.maximum(np.arange(height) - window, 0)
    bottom = np.minimum(np.arange(height) + window + 1, height)
    left = np.maximum(np.arange(width) - window, 0)
    right = np.minimum(np.arange(width) + window + 1, width)
    a, b = table[bottom], table[top]
    return a[:, right] - a[:, left] - b[:, right] + b[:, left]


def blend(
    grid: Grid, *, crowding: float, window: int, heat: FloatGrid | None = None, warmth: float = 0.0
) -> ByteGrid | None:
    """Terrain with other attributes added: uint8 (height, width), 0 to 252, or None if it is 0 everywhere.

    Parameters
    ----------
    grid : walls and terrain.
    crowding : what a cell is worth whose whole window is blocked, in times plain ground (1: it costs twice).
    window : how far the density of walls is looked at, in cells.
    heat : how often obstacles have been seen on each cell of late, 0 to 1, or None.
    warmth : what a cell of heat 1 is worth, as ``crowding``.
    """
    values = _added(grid, crowding, window, heat, warmth)
    np.minimum(values, MAX_TERRAIN, out=values)
    return frozen(values.astype(np.uint8)) if values.any() else None


def cut_off(
    grid: Grid, *, crowding: float, window: int, heat: FloatGrid | None = None, warmth: float = 0.0
) -> int:
    """How many cells cost less after :func:`blend` than their attributes add up to: the most there is."""
    return int(np.count_nonzero(_added(grid, crowding, window, heat, warmth) > MAX_TERRAIN))


def _added(
    grid: Grid, crowding: float, window: int, heat: FloatGrid | None, warmth: float
) -> NDArray[np.int64]:
    """Terrain and attributes of each cell, whatever they add up to; 0 where it is blocked."""
    total = np.zeros(grid.blocked.shape, dtype=np.float64)
    if crowding > 0:
        total += 63.0 * crowding * density(grid.blocked, window)
    if heat is not None and warmth > 0:
        total += 63.0 * warmth * heat
    values = np.floor(total + 0.5).astype(np.int64)
    if grid.terrain is not None:
        values += grid.terrain
    values[grid.blocked] = 0
    return values


def kept_away(free: BoolGrid, margin: int, but: tuple[Cell, ...]) -> BoolGrid:
    """Free cells without those within ``margin`` cells (Chebyshev) of one that is not free; read-only.

    Around each cell of ``but`` as many stay as they are, so that a robot can leave a place beside a wall.
    The edge of the map is not a wall.
    """
    shut = _box_sums((~free).astype(np.int64), margin) > 0
    for x, y in but:
        shut[max(y - margin, 0) : y + margin + 1, max(x - margin, 0) : x + margin + 1] = False
    return frozen(free & ~shut)
