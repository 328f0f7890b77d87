"""Cost-to-go over the projected graph: what no path of the lattice undercuts."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice import low_field as kernel
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.projection import projection_of
from lampyris.typing import Cell

_ROOM = 1 << 14
BEYOND = 3
"""How much farther than the start costs are settled, in costs of the costliest displacement."""


class LowField:
    """Costs from cells to the nearest of some goals, settled as far as they are asked for.

    Parameters
    ----------
    lattice_map : the map.
    goals : indices of cells.

    Attributes
    ----------
    by : int16 (cells,): where a cost is settled, the primitive that leads on; -1 at the goals.
    settled : cells that were given their cost, again after a repair included.
    """

    def __init__(self, lattice_map: LatticeMap, goals: Iterable[int]) -> None:
        self._map = lattice_map
        self._projection = projection_of(lattice_map.lattice)
        self.goals = tuple(sorted(set(goals)))
        self.settled = 0
        self._costs = np.full(lattice_map.walls.size, -1, dtype=np.int64)
        self.by = np.full(lattice_map.walls.size, -1, dtype=np.int16)
        self._inside = np.pad(np.ones(lattice_map.grid.blocked.shape, np.bool_), lattice_map.border).ravel()
        self._heads = np.empty(self._projection.costliest // self._projection.span + 3, dtype=np.int32)
        self._count = np.zeros(7, dtype=np.int64)
        self._known: NDArray[np.int64] | None = None
        self._empty()
        self._begin(0, np.array(self.goals, dtype=np.int32))
        self._costs[list(self.goals)] = 0

    def _empty(self) -> None:
        """Lists without entries."""
        self._heads[:] = -1
        self._cell = np.zeros(_ROOM, dtype=np.int32)
        self._member = np.zeros(_ROOM, dtype=np.int32)
        self._next = np.arange(1, _ROOM + 1, dtype=np.int32)

    def _begin(self, at: int, fresh: NDArray[np.int32]) -> None:
        """Have a list's cells expanded next."""
        self._fresh = np.zeros(max(_ROOM, len(fresh)), dtype=np.int32)
        self._fresh[: len(fresh)] = fresh
        self._count[[kernel.LIST, kernel.FRESH, kernel.NEXT]] = at, len(fresh), 0
        self._count[[kernel.UNUSED, kernel.WAITING]] = 0, 0
        self._ended = False

    def costs(self, starts: Iterable[int]) -> NDArray[np.int64]:
        """A cost from each cell that no path to any goal undercuts; int64 (cells,), negative where none leads.

        Exact for cells nearer than the starts and somewhat farther ones, a lower bound for others.

        Parameters
        ----------
        starts : indices of cells.
        """
        asked = np.array(sorted(set(starts)), dtype=np.int64)
        if self._known is not None and (self._ended or self._reaches(asked)):
            return self._known
        self._settle(asked)
        unknown = -1 if self._ended else (int(self._count[kernel.LIST]) + 1) * self._projection.span
        self._known = np.where(self._costs >= 0, self._costs, np.where(self._inside, unknown, -1))
        return self._known

    def path(self, start: int) -> tuple[list[int], list[int]]:
        """The cheapest chain of displacements from a cell of known cost: its cells but the last, and its primitives."""
        cells, primitives = [], []
        while self.by[start] >= 0:
            primitive = int(self.by[start])
            cells.append(start)
            primitives.append(primitive)
            start += int(self._map.offsets[primitive])
        return cells, primitives

    def _reaches(self, starts: NDArray[np.int64]) -> bool:
        return bool((self._costs[starts] >= 0).all())

    def _settle(self, starts: NDArray[np.int64]) -> None:
        lattice, projection, lattice_map = self._map.lattice, self._projection, self._map
        before = int(self._count[kernel.SETTLED])
        while True:
            outcome = kernel.settle(
                lattice_map.walls, lattice_map.clear, lattice.inscribed - 1e-6, lattice_map.offsets, lattice.cost,
                lattice.reach, lattice.sweep_first, lattice_map.swept, projection.member, projection.member_group,
                projection.group_first, starts, projection.span,
                BEYOND * projection.costliest, self._costs, self.by, self._heads, self._cell, self._member, self._next,
                self._fresh, self._count,
            )  # fmt: skip
            if outcome != kernel.FULL:
                break
            n = len(self._cell)
            self._cell, self._member = (
                np.concatenate((a, np.zeros_like(a))) for a in (self._cell, self._member)
            )
            self._fresh = np.concatenate((self._fresh, np.zeros(n, np.int32)))
            # The chain of unused entries ends where the new ones begin.
            self._next = np.concatenate((self._next, np.arange(n + 1, 2 * n + 1, dtype=np.int32)))
        self._ended = outcome == kernel.EMPTY
        self.settled += int(self._count[kernel.SETTLED]) - before

    def repaired(self, lattice_map: LatticeMap, changed: Iterable[Cell]) -> bool:
        """Take over a map in which cells have become blocked or free; False: nothing known is left to keep.

        A cell's cost depends on cheaper cells alone. What is cheaper than every cell from which a motion may touch
        a changed one keeps its cost; all else is settled again when it is asked for.
        """
        projection, side = self._projection, lattice_map.border
        costs = self._costs.reshape(-1, lattice_map.stride)
        unknown = (int(self._count[kernel.LIST]) + 1) * projection.span
        least = unknown
        for x, y in changed:
            # Where a motion begins, and where it ends, is never farther from a cell that it touches.
            near = costs[max(0, y - side) : y + 3 * side + 1, max(0, x - side) : x + 3 * side + 1]
            known = near[near >= 0]
            if len(known):
                least = min(least, int(known.min()))
        at = least // projection.span
        if at < 1:
            return False
        self._map, self._known = lattice_map, None
        flat = self._costs
        lost = flat >= at * projection.span
        flat[lost] = -1
        self.by[lost] = -1
        self._empty()
        rim = np.flatnonzero(flat >= max(at * projection.span - projection.costliest, 0))
        # They are expanded again: their displacements lead to the cells that have lost their cost.
        self._begin(at - 1, rim.astype(np.int32))
        return True
