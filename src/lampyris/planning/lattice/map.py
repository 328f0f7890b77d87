"""A map as a lattice search reads it: with a border, its clearance, and the cells that sweeps cover."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.planning.field.layers import clearance
from lampyris.planning.field.solve import solve
from lampyris.planning.lattice.goal_field import GoalField
from lampyris.planning.lattice.lattice import UNIT, StateLattice
from lampyris.typing import Cell

_STEPS = replace(MOVES["octile"], corner_cutting=True)
"""Steps of the heuristic: a base between two walls that share a corner is stopped by its footprint, not here."""
_LEAST = 1e-3
"""Clearance, in cells, that no blocked cell has."""
_ROUNDING = 1e-6


class LatticeMap:
    """The map of one grid with obstacles.

    Parameters
    ----------
    grid : the map.
    lattice : whose sweeps are checked in it.
    obstacles : cells that are blocked besides.

    Attributes
    ----------
    stride : cells of a row with its border.
    walls : uint8 (cells,): 1 where a cell with border is blocked; the border is not.
    clear : float32 (cells,): clearance in cells; 0 in the border, where the base must not be.
    offsets, swept, stands : the lattice's cells as differences of indices.
    """

    def __init__(self, grid: Grid, lattice: StateLattice, obstacles: Iterable[Cell] = ()) -> None:
        self.grid, self.lattice = grid, lattice
        self.border = lattice.border
        blocked = grid.blocked.copy()
        for x, y in obstacles:
            blocked[y, x] = True
        cells = clearance(replace(grid, blocked=blocked, terrain=None, unknown=None)) / grid.resolution
        self.stride = grid.width + 2 * self.border
        self.walls: NDArray[np.uint8] = np.pad(blocked, self.border).astype(np.uint8).ravel()
        self.clear = np.pad(cells, self.border).astype(np.float32).ravel()
        self.offsets = self._flat(lattice.cell)
        self.swept = self._flat(lattice.sweep).astype(np.int32)
        self.stands = self._flat(lattice.stand)
        self._low = cells >= max(lattice.low_clearance - _ROUNDING, _LEAST)

    def _flat(self, cells: NDArray[np.integer]) -> NDArray[np.int64]:
        flat: NDArray[np.int64] = cells[:, 1].astype(np.int64) * self.stride + cells[:, 0]
        return flat

    def index(self, cell: Cell) -> int:
        """The index of a cell of the map."""
        return (cell[1] + self.border) * self.stride + cell[0] + self.border

    def cell(self, index: int) -> Cell:
        """The cell of an index; it may lie in the border."""
        y, x = divmod(index, self.stride)
        return x - self.border, y - self.border

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
            for offset in self.stands[first:last].tolist():
                free &= self.walls[index + offset] == 0
            found += [(cells[k], heading) for k in np.flatnonzero(free).tolist()]
        return sorted(found)

    def heuristic(self, goals: tuple[Cell, ...], field: GoalField | None = None) -> NDArray[np.int64]:
        """A cost from each cell that no path to any of the goals undercuts; int64 (cells,), negative where none leads.

        The octile cost-to-go over cells with room for the inscribed disc, times the least cost of a primitive for
        the octile cost of the cells that its base passes through (:attr:`StateLattice.scale`). Of goals that walls do
        not separate the farthest counts as reached.

        Parameters
        ----------
        goals : one or more.
        field : of an earlier map with the same goal, to be repaired; for one goal.
        """
        best = np.full(self.grid.blocked.shape, np.inf)
        left = list(goals)
        while left:
            if field is not None and len(goals) == 1:
                cost = field.cost(self._low, _STEPS, left[0])
            else:
                cost = solve(self._low, _STEPS, left[0]).cost
            reached = [(x, y) for x, y in left if math.isfinite(cost[y, x])]
            near = max((cost[y, x] for x, y in reached), default=0.0)
            best = np.minimum(best, np.maximum(cost - near, 0.0))
            done = {*reached, left[0]}
            left = [cell for cell in left if cell not in done]
        known = np.isfinite(best)
        units = np.floor(np.where(known, best, 0.0) * (self.lattice.scale * UNIT))
        inside = np.where(known, units, -1).astype(np.int64)
        return np.pad(inside, self.border, constant_values=-1).ravel()
