"""A map as a lattice search reads it: with a border, its clearance, and the cells that sweeps cover."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.cancellation import checkpoint
from lampyris.kernels.lattice.goal_field import flood
from lampyris.kernels.lattice.sweep import sweep
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import Pose
from lampyris.model.robot import Polygon, circumscribed_radius
from lampyris.planning.field.frame import AHEAD, SCRATCH
from lampyris.planning.field.layers import clearance
from lampyris.planning.field.solve import solve
from lampyris.planning.lattice.goal_field import GoalField
from lampyris.planning.lattice.lattice import UNIT, StateLattice
from lampyris.planning.lattice.terrain import tracks_of
from lampyris.typing import Cell, Cells, Floats

STEPS = replace(MOVES["octile"], corner_cutting=True)
"""Steps of the heuristic: a base between two walls that share a corner is stopped by its footprint, not here."""
_LEAST = 1e-3
"""Clearance, in cells, that no blocked cell has."""
_ROUNDING = 1e-6
_NEVER = 1 << 62
"""More than any cost in the heuristic."""
_PART = 1 << 14
"""Cells whose heuristic is worked out at a time."""
_CHUNK = 1 << 20
"""Cells under footprints that are looked at together."""


class ClearanceMap:
    """The map of one grid with obstacles and a border.

    Parameters
    ----------
    grid : the map.
    border : cells on each side.
    obstacles : cells that are blocked besides.

    Attributes
    ----------
    stride : cells of a row with its border.
    room : float64 (height, width): clearance of the grid's cells, in cells.
    walls : uint8 (cells,): 1 where a cell with border is blocked; the border is not.
    clear : float32 (cells,): clearance in cells; 0 in the border, where the base must not be.
    """

    def __init__(self, grid: Grid, border: int, obstacles: Iterable[Cell] = ()) -> None:
        self.grid, self.border = grid, border
        blocked = grid.blocked.copy()
        for x, y in obstacles:
            blocked[y, x] = True
        self.room = clearance(replace(grid, blocked=blocked, terrain=None, unknown=None)) / grid.resolution
        self.stride = grid.width + 2 * border
        self.walls: NDArray[np.uint8] = np.pad(blocked, border).astype(np.uint8).ravel()
        self.clear = np.pad(self.room, border).astype(np.float32).ravel()

    def index(self, cell: Cell) -> int:
        """The index of a cell of the map."""
        return (cell[1] + self.border) * self.stride + cell[0] + self.border

    def cell(self, index: int) -> Cell:
        """The cell of an index; it may lie in the border."""
        y, x = divmod(index, self.stride)
        return x - self.border, y - self.border

    def cells(self, indices: NDArray[np.int64]) -> Cells:
        """The cells of some indices, int32 (n, 2); they may lie in the border."""
        y, x = np.divmod(indices, self.stride)
        return np.stack((x - self.border, y - self.border), axis=-1).astype(np.int32)

    def stands_free(self, footprint: Polygon, pose: Pose) -> bool:
        """Whether a footprint touches no wall, and the base is on the map.

        Parameters
        ----------
        footprint : vertices (x ahead, y to the left), cells; the border is 3 cells wider than it reaches.
        pose : x, y (cells, y down) and yaw (from x to y).
        """
        (x, y, yaw), grid = pose, self.grid
        if not (-0.5 < x < grid.width - 0.5 and -0.5 < y < grid.height - 0.5):
            return False
        reach = math.ceil(circumscribed_radius(footprint)) + 2
        side = 2 * reach + 1
        column, row = math.floor(x + 0.5), math.floor(y + 0.5)
        touched = np.zeros(side * side, dtype=np.uint8)
        px, py = (np.array(one) for one in zip(*footprint, strict=True))
        cos, sin = elementary.direction(yaw)
        at = (np.array([one]) for one in (x - column + reach, y - row + reach, cos, sin))
        sweep(px, -py, *at, 0.0, touched, side, side)
        rows = self.walls.reshape(-1, self.stride)[
            row + self.border - reach :, column + self.border - reach :
        ]
        return not (touched.reshape(side, side) & rows[:side, :side]).any()


def cost_to_any(free: NDArray[np.bool_], goals: Iterable[Cell]) -> Floats:
    """A lower bound on the octile cost from each cell to the nearest of some goals; infinite where none is reached.

    Of goals that walls do not separate the farthest counts as reached.
    """
    best: Floats = np.full(free.shape, np.inf)
    left = list(goals)
    while left:
        cost = solve(free, STEPS, left[0]).cost
        reached = [(x, y) for x, y in left if math.isfinite(cost[y, x])]
        near = max((cost[y, x] for x, y in reached), default=0.0)
        best = np.minimum(best, np.maximum(cost - near, 0.0))
        done = {*reached, left[0]}
        left = [cell for cell in left if cell not in done]
    return best


class LatticeMap(ClearanceMap):
    """The map of one grid with obstacles, and the cells of a lattice's sweeps in it.

    Parameters
    ----------
    grid : the map.
    lattice : whose sweeps are checked in it.
    obstacles : cells that are blocked besides.
    cost_penalty : what terrain of the highest value adds to the cost of a length, as a multiple of it.

    Attributes
    ----------
    offsets, swept, stands : the lattice's cells as differences of indices.
    price, price_first, price_cell, price_weight : terrain, and what it adds to each primitive; empty if nothing.
    """

    def __init__(
        self, grid: Grid, lattice: StateLattice, obstacles: Iterable[Cell] = (), cost_penalty: float = 0.0
    ) -> None:
        super().__init__(grid, lattice.border, obstacles)
        self.lattice = lattice
        self.offsets = self._flat(lattice.cell)
        self.swept = self._flat(lattice.sweep).astype(np.int32)
        self.discs = self._flat(lattice.disc).astype(np.int32)
        self.stands = self._flat(lattice.stand)
        self.price: NDArray[np.uint8] = np.zeros(0, np.uint8)
        self.price_first, self.price_cell = np.zeros(1, np.int32), np.zeros(0, np.int32)
        self.price_weight = np.zeros(0, np.int64)
        if grid.terrain is not None and cost_penalty > 0:
            tracks = tracks_of(lattice)
            self.price = np.pad(grid.terrain, self.border).ravel()
            self.price_first, self.price_cell = tracks.first, self._flat(tracks.cell).astype(np.int32)
            self.price_weight = tracks.weights(cost_penalty)
        self._low = self.room >= max(lattice.low_clearance - _ROUNDING, _LEAST)

    def _flat(self, cells: NDArray[np.integer]) -> NDArray[np.int64]:
        flat: NDArray[np.int64] = cells[:, 1].astype(np.int64) * self.stride + cells[:, 0]
        return flat

    def cost(self, index: int, primitive: int) -> int:
        """The cost of a primitive that begins at the cell of an index, in units of the lattice."""
        cost = int(self.lattice.cost[primitive])
        if len(self.price):
            part = slice(*self.price_first[primitive : primitive + 2])
            cost += int((self.price_weight[part] * self.price[index + self.price_cell[part]]).sum())
        return cost

    def cost_of(self, indices: list[int], primitives: list[int]) -> int:
        """The cost of primitives, each of which begins at the cell of an index, in units of the lattice."""
        if len(self.price):
            costs = [self.cost(index, k) for index, k in zip(indices, primitives, strict=True)]
        else:
            costs = self.lattice.cost[primitives].tolist() if primitives else []
        return int(np.array(costs, dtype=np.int64).sum())

    def is_free(self, cell: Cell, heading: int) -> bool:
        """Whether the footprint at the centre of a cell of the map touches no wall."""
        if not self.grid.contains(cell):
            return False
        first, last = self.lattice.stand_first[heading : heading + 2]
        return not self.walls[self.index(cell) + self.stands[first:last]].any()

    def free_states(self, cells: list[Cell], headings: Iterable[int]) -> list[tuple[Cell, int]]:
        """Of the cells and headings those where the footprint touches no wall."""
        index = np.array([self.index(cell) for cell in cells], dtype=np.int64)
        found: list[tuple[Cell, int]] = []
        for heading in headings:
            checkpoint()
            first, last = self.lattice.stand_first[heading : heading + 2]
            free = np.ones(len(index), dtype=np.bool_)
            each = max(1, _CHUNK // max(last - first, 1))
            for k in range(0, len(index), each):
                covered = index[k : k + each, None] + self.stands[first:last]
                free[k : k + each] = ~self.walls[covered].any(axis=1)
            found += [(cells[k], heading) for k in np.flatnonzero(free).tolist()]
        return sorted(found)

    def heuristic(self, goals: tuple[Cell, ...], field: GoalField | None = None) -> NDArray[np.int64]:
        """A cost from each cell that no path to any of the goals undercuts; int64 (cells,), negative where none leads.

        Terrain only adds to the cost of a path, and is left out.

        The octile cost-to-go over cells with room for the inscribed disc, times the least cost of a primitive for
        the octile cost of the cells that its base passes through (:attr:`StateLattice.scale`).

        Parameters
        ----------
        goals : one or more.
        field : of an earlier map with the same goal, to be repaired; for one goal.
        """
        if field is None or len(goals) != 1:
            return self.flooded(tuple(self.index(cell) for cell in goals))
        best = field.cost(self._low, STEPS, goals[0])
        units = np.full((best.shape[0] + 2 * self.border, self.stride), -1, dtype=np.int64)
        inside = units[self.border : -self.border, self.border : -self.border]
        rows = max(1, _PART // best.shape[1])
        for y in range(0, len(best), rows):  # so few that what is in between stays in the processor's cache
            part = best[y : y + rows]
            known = np.isfinite(part)
            scaled = np.where(known, part, 0.0)
            scaled *= self.lattice.scale * UNIT
            np.floor(scaled, out=scaled)
            np.copyto(inside[y : y + rows], scaled, where=known, casting="unsafe")
        return units.ravel()

    def flooded(self, goals: tuple[int, ...], start: int = -1, reach: float = -1.0) -> NDArray[np.int64]:
        """The heuristic of some goals, from scratch; see :meth:`heuristic`.

        Parameters
        ----------
        goals : indices of cells.
        start, reach : index of a cell; octile cost, in cells, above which chains from there to a goal do not matter: the cells
            that only those lead through are left out (-1). A negative reach: no cell is.
        """
        bench = self._low.size + 1
        (order,) = SCRATCH.take((2 * bench + AHEAD, np.uint32))
        units = np.empty(self.walls.size, dtype=np.int64)
        straight, diagonal = self.steps
        flood(
            self._low.view(np.uint8).ravel(), units, order, bench, self.stride, self.border,
            np.array(goals, dtype=np.int64), start, -1 if reach < 0 else int(reach * straight), straight, diagonal, _NEVER,
        )  # fmt: skip
        return units

    @property
    def steps(self) -> tuple[int, int]:
        """What a straight and a diagonal step cost in the heuristic, in whole units of the lattice, rounded down."""
        unit = self.lattice.scale * UNIT
        return math.floor(unit), math.floor(unit * math.sqrt(2.0))
