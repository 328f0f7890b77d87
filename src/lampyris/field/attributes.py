"""Attributes: what a cell costs besides distance, for planners that are asked to mind more than length.

The dissertation suggests them as future work: obstacle density, terrain, traffic. Each is a number from 0 to
252 a cell, as terrain is (:class:`lampyris.model.grid.Grid`), and they are added up: so any field and any
search that knows terrain knows them all. The scales are ours.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lampyris.halting import uninterrupted
from lampyris.model.grid import MAX_TERRAIN, Grid, frozen
from lampyris.typing import BoolGrid, ByteGrid, Cell, FloatGrid

EIGHT = tuple((dx, dy) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy)
Ints = NDArray[np.int64]


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


def wall_distance(free: BoolGrid, most: int) -> Ints:
    """Chebyshev distance of each cell to the nearest one that is not free; int (height, width).

    At most ``most``; 0 where a cell is not free, 1 beside a wall. The edge of the map is not a wall.
    """
    with uninterrupted():
        from scipy.ndimage import distance_transform_cdt  # bits: whole numbers

    if free.all():
        return np.full(free.shape, most, dtype=np.int64)
    distance: Ints = distance_transform_cdt(free, metric="chessboard").astype(np.int64)
    return np.minimum(distance, most, out=distance)


def kept_away(free: BoolGrid, margin: int, but: tuple[Cell, ...]) -> BoolGrid:
    """Free cells without those within ``margin`` cells (Chebyshev) of one that is not free; read-only.

    A cell of ``but`` that is nearer to a wall can be left: by the cells whose distance to walls grows with
    each step from it, and by one path within ``margin + 1`` cells to where the margin is kept, on which the
    least distance is missing in all. If there is no such path only the cell itself is open.
    The edge of the map is not a wall.
    """
    distance = wall_distance(free, margin + 1)
    kept = distance > margin
    out = kept.copy()
    for cell in but:
        for x, y in _way_out(distance, margin, cell):
            out[y, x] = True
    return frozen(out)


def _way_out(distance: Ints, margin: int, cell: Cell) -> Iterator[Cell]:
    """Cells that are open for leaving a cell near walls, see :func:`kept_away`."""
    height, width = distance.shape
    reach = margin + 1
    x0, y0 = max(cell[0] - reach, 0), max(cell[1] - reach, 0)
    x1, y1 = min(cell[0] + reach + 1, width), min(cell[1] + reach + 1, height)
    near = distance[y0:y1, x0:x1]
    at = (cell[0] - x0, cell[1] - y0)
    if near[at[1], at[0]] > margin or near[at[1], at[0]] == 0:
        return
    yield cell
    path = _roomiest(near.tolist(), margin, at)
    if not path:
        return
    for x, y in path:
        yield x + x0, y + y0
    ys, xs = np.mgrid[: near.shape[0], : near.shape[1]]
    steps = np.maximum(np.abs(xs - at[0]), np.abs(ys - at[1]))
    growing = (near > 0) & (near >= near[at[1], at[0]] + steps)
    for y, x in np.argwhere(growing).tolist():
        yield x + x0, y + y0


def _roomiest(distance: list[list[int]], margin: int, at: Cell) -> list[Cell]:
    """The path from a cell to one that keeps the margin on which the least is missing in all; empty: none.

    A diagonal step passes between two free cells, and they belong to the path, too: it can be driven by
    every set of moves.
    """
    height, width = len(distance), len(distance[0])
    parent: dict[Cell, Cell | None] = {}
    heap: list[tuple[int, int, Cell, Cell | None]] = [(0, 0, at, None)]
    while heap:
        missing, steps, here, came = heapq.heappop(heap)
        if here in parent:
            continue
        parent[here] = came
        x, y = here
        if distance[y][x] > margin:
            path = [here]
            while came is not None:
                path += [(came[0], here[1]), (here[0], came[1]), came]
                here, came = came, parent[came]
            return path
        for dx, dy in EIGHT:
            a, b = x + dx, y + dy
            if not (0 <= a < width and 0 <= b < height):
                continue
            if not (distance[b][a] and distance[b][x] and distance[y][a]):
                continue
            less, length = margin + 1 - distance[b][a], 3 if dx and dy else 2
            heapq.heappush(heap, (missing + less, steps + length, (a, b), here))
    return []
