"""Attributes: what a cell costs besides distance, for planners that are asked to consider more than length.

The dissertation suggests them as future work: obstacle density, terrain, traffic. Each is a number from 0 to
252 a cell, as terrain is (:class:`lampyris.model.grid.Grid`), and they are added up: so any field and any
search that knows terrain knows them all. The scales are ours.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import uninterrupted
from lampyris.model.grid import MAX_TERRAIN, Grid, frozen
from lampyris.planning.field.layers import free_cells
from lampyris.typing import BoolGrid, ByteGrid, Cell, FloatGrid

_EIGHT = tuple((dx, dy) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy)
_Ints = NDArray[np.int64]


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
    grid: Grid,
    *,
    obstacle_density_weight: float,
    window: int,
    heat: FloatGrid | None = None,
    traffic_density_weight: float = 0.0,
) -> ByteGrid | None:
    """Terrain with other attributes added: uint8 (height, width), 0 to 252, or None if it is 0 everywhere.

    Parameters
    ----------
    grid : walls and terrain.
    obstacle_density_weight : what a cell is worth whose whole window is blocked, in times plain ground (1: it costs twice).
    window : how far the density of walls is looked at, in cells.
    heat : how often obstacles have been seen on each cell of late, 0 to 1, or None.
    traffic_density_weight : what a cell of heat 1 is worth, as ``obstacle_density_weight``.
    """
    values = _added(grid, obstacle_density_weight, window, heat, traffic_density_weight)
    np.minimum(values, MAX_TERRAIN, out=values)
    return frozen(values.astype(np.uint8)) if values.any() else None


def cut_off(
    grid: Grid,
    *,
    obstacle_density_weight: float,
    window: int,
    heat: FloatGrid | None = None,
    traffic_density_weight: float = 0.0,
) -> int:
    """How many cells cost less after :func:`blend` than their attributes add up to: the most there is."""
    return int(
        np.count_nonzero(
            _added(grid, obstacle_density_weight, window, heat, traffic_density_weight) > MAX_TERRAIN
        )
    )


def _added(
    grid: Grid,
    obstacle_density_weight: float,
    window: int,
    heat: FloatGrid | None,
    traffic_density_weight: float,
) -> NDArray[np.int64]:
    """Terrain and attributes of each cell, whatever they add up to; 0 where it is blocked."""
    total = np.zeros(grid.blocked.shape, dtype=np.float64)
    if obstacle_density_weight > 0:
        total += 63.0 * obstacle_density_weight * density(grid.blocked, window)
    if heat is not None and traffic_density_weight > 0:
        total += 63.0 * traffic_density_weight * heat
    values = np.floor(total + 0.5).astype(np.int64)
    if grid.terrain is not None:
        values += grid.terrain
    values[grid.blocked] = 0
    return values


def kept_away(grid: Grid, radius: float, margin: int, ends: tuple[Cell, ...]) -> BoolGrid:
    """Cells for the robot's centre if cells within a margin of walls count as walls; bool, read-only.

    An end of the path inside the margin gets an exit: the cells whose clearance rises by one a step away from
    it, and one least-cost path out of the margin, where a cell costs as many cells of clearance as it lacks.
    The path is searched as far as the margin and the robot reach, and one cell more. Without one the end has
    no exit, and a smaller margin must be tried. The edge of the map is not a wall.

    Parameters
    ----------
    radius : of the robot, metres.
    margin : cells, Chebyshev distance; 1 or more.
    ends : start and goal.
    """
    clearance = _chebyshev_clearance(grid.blocked, margin + 1)
    walkable = free_cells(grid, radius)
    kept = free_cells(replace(grid, blocked=clearance <= margin, terrain=None, unknown=None), radius)
    out = kept.copy()
    reach = margin + math.ceil(radius / grid.resolution) + 1
    for x, y in ends:
        if kept[y, x] or not walkable[y, x]:
            continue
        rows, columns = slice(max(y - reach, 0), y + reach + 1), slice(max(x - reach, 0), x + reach + 1)
        lacking = np.where(walkable, margin + 1 - np.minimum(clearance, margin), 0)[rows, columns]
        at = (x - columns.start, y - rows.start)
        out[y, x] = True
        path = _exit_path(lacking.tolist(), kept[rows, columns].tolist(), at)
        if path:
            ys, xs = np.mgrid[: lacking.shape[0], : lacking.shape[1]]
            steps = np.maximum(np.abs(xs - at[0]), np.abs(ys - at[1]))
            rising = walkable[rows, columns] & (clearance[rows, columns] >= clearance[y, x] + steps)
            out[rows, columns] |= rising
            for a, b in path:
                out[rows, columns][b, a] = True
    return frozen(out)


def _chebyshev_clearance(blocked: BoolGrid, most: int) -> _Ints:
    """Chebyshev distance of each cell to the nearest blocked one, at most ``most``; int (height, width)."""
    with uninterrupted():
        from scipy.ndimage import distance_transform_cdt  # bits: whole numbers in, whole numbers out

    if not blocked.any():
        return np.full(blocked.shape, most, dtype=np.int64)
    distance: _Ints = distance_transform_cdt(~blocked, metric="chessboard").astype(np.int64)
    return np.minimum(distance, most, out=distance)


def _exit_path(lacking: list[list[int]], kept: list[list[bool]], at: Cell) -> list[Cell]:
    """Cells of the least-cost path from a cell to one that is kept; empty: there is none.

    A diagonal step passes between two free cells, which belong to the path but are not counted in its cost:
    it can be driven with every set of moves. Of equal costs the shorter path is taken.

    Parameters
    ----------
    lacking : cost of each cell; 0 where the robot cannot stand.
    """
    height, width = len(lacking), len(lacking[0])
    parent: dict[Cell, Cell | None] = {}
    heap: list[tuple[int, int, Cell, Cell | None]] = [(0, 0, at, None)]
    while heap:
        cost, length, here, came = heapq.heappop(heap)
        if here in parent:
            continue
        parent[here] = came
        x, y = here
        if kept[y][x]:
            path = [here]
            while came is not None:
                path += [(came[0], here[1]), (here[0], came[1]), came]
                here, came = came, parent[came]
            return path
        for dx, dy in _EIGHT:
            a, b = x + dx, y + dy
            if not (0 <= a < width and 0 <= b < height):
                continue
            if not (lacking[b][a] and lacking[b][x] and lacking[y][a]):
                continue
            step = 3 if dx and dy else 2
            heapq.heappush(heap, (cost + lacking[b][a], length + step, (a, b), here))
    return []
