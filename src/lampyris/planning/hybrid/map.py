"""A map as hybrid A* reads it, and how far the base must drive at least."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from lampyris.model.grid import Grid
from lampyris.planning.hybrid.motions import HybridShape
from lampyris.planning.lattice.map import ClearanceMap, cost_to_any
from lampyris.planning.lattice.poses import distance
from lampyris.typing import Cell, Floats

SCALE = 0.9238795325112867
"""cos(pi / 8): no straight line is shorter than so many times its octile length."""
_DIAGONAL = math.sqrt(0.5)
_ROUNDING = 1e-6
_THICK = 1.21
"""Inscribed radius, in cells, from which on every wall is at least three cells thick for the base."""

Vertex = tuple[int, int]


class HybridMap(ClearanceMap):
    """The map of one grid with obstacles, for one robot.

    Parameters
    ----------
    grid : the map.
    shape : the robot.
    obstacles : cells that are blocked besides.
    """

    def __init__(self, grid: Grid, shape: HybridShape, obstacles: Iterable[Cell] = ()) -> None:
        super().__init__(grid, math.ceil(shape.outer) + 3, obstacles)
        self.shape = shape
        # The base is nowhere nearer to a wall than the inscribed radius, and within half a diagonal of a cell's centre.
        self.low: NDArray[np.bool_] = self.room >= max(shape.inner - _DIAGONAL - _ROUNDING, 1e-3)

    def stands(self, x: float, y: float, yaw: float) -> bool:
        """Whether the footprint at a pose (cells, y down) touches no wall, and the base is on the map."""
        return self.stands_free(self.shape.footprint, (x, y, yaw))

    def cost_to_go(self, goals: Iterable[Vertex]) -> Floats:
        """A cost from each corner of a cell to the nearest of some corners; float64 (height + 1, width + 1).

        The base's path is no shorter than the shortest curve through the cells where it can be. That curve is
        straight between corners of cells, and from corner to corner along a straight line there is a chain of steps along
        edges and diagonals of the cells that the line crosses, which is as long as the octile distance. So
        :data:`SCALE` times the octile cost is a lower bound.
        """
        low = np.pad(self.low, 1)
        if self.shape.inner >= _THICK:
            corners = low[1:, 1:] | low[1:, :-1] | low[:-1, 1:] | low[:-1, :-1]
            return cost_to_any(corners, goals) * SCALE
        # Through a wall of one cell the corners of its two sides would touch: edges and cells are nodes, too.
        height, width = self.low.shape
        fine = np.zeros((2 * height + 1, 2 * width + 1), dtype=np.bool_)
        fine[1::2, 1::2] = self.low
        fine[1::2, ::2] = low[1:-1, 1:] | low[1:-1, :-1]
        fine[::2, 1::2] = low[1:, 1:-1] | low[:-1, 1:-1]
        fine[::2, ::2] = low[1:, 1:] | low[1:, :-1] | low[:-1, 1:] | low[:-1, :-1]
        return cost_to_any(fine, [(2 * x, 2 * y) for x, y in goals])[::2, ::2] * (SCALE / 2)

    def corners_near(self, x: float, y: float, reach: float) -> tuple[list[Vertex], float]:
        """Corners that a goal at a point, or within ``reach`` of it, is near to: ``(corners, distance)``.

        Every pose of the base there is within ``distance`` of one of the corners.
        """
        if reach <= 0.0:
            near = sorted(self._corners(x, y), key=lambda v: (distance((v[0] - 0.5, v[1] - 0.5), (x, y)), v))
            return near[:1], distance((near[0][0] - 0.5, near[0][1] - 0.5), (x, y)) if near else 0.0
        wide = reach + _DIAGONAL
        low = np.pad(self.low, 1)
        free = low[1:, 1:] | low[1:, :-1] | low[:-1, 1:] | low[:-1, :-1]
        rows, columns = np.nonzero(free)
        dx, dy = columns - 0.5 - x, rows - 0.5 - y
        inside = dx * dx + dy * dy <= wide * wide
        return [
            (cx, cy) for cx, cy in zip(columns[inside].tolist(), rows[inside].tolist(), strict=True)
        ], _DIAGONAL

    def _corners(self, x: float, y: float) -> list[Vertex]:
        """Corners of the cell of a point, if the base can be there."""
        column, row = math.floor(x + 0.5), math.floor(y + 0.5)
        if not (0 <= column < self.grid.width and 0 <= row < self.grid.height and self.low[row, column]):
            return []
        return [(column + i, row + j) for j in (0, 1) for i in (0, 1)]

    def least(self, cost: Floats, x: float, y: float, off: float) -> float:
        """No path of the base from a point to the goals of a cost-to-go is shorter; infinite: there is none."""
        corners = self._corners(x, y)
        found = [cost[j, i] - distance((i - 0.5, j - 0.5), (x, y)) for i, j in corners]
        return max(float(max(found, default=math.inf)) - off - 1e-9, 0.0)

    def estimate(self, cost: Floats, off: float) -> NDArray[np.float32]:
        """The cost-to-go of each cell of the padded map; float32 (cells,), negative where the base must not be."""
        middle = (cost[1:, 1:] + cost[1:, :-1] + cost[:-1, 1:] + cost[:-1, :-1]) / 4
        known = self.low & np.isfinite(middle)
        inside = np.where(known, np.maximum(np.where(known, middle, 0.0) - off, 0.0), -1.0)
        return np.pad(inside, self.border, constant_values=-1.0).astype(np.float32).ravel()
