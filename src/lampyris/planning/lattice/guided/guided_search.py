"""A first try of the planner ``lattice`` for drives that cannot turn in place: any path within the bound, soon found.

The field of the goal knows no headings, so that a search by it expands thousands of states where the robot first has to turn
round. Here the order knows them, and the bound comes from a lower bound that is known before the search.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.kernels.lattice.greedy import greedy
from lampyris.kernels.lattice.search import FULL
from lampyris.planning.lattice.ends.query import Query
from lampyris.planning.lattice.guided.focused_field import FACTOR, FocusedField, focused_field
from lampyris.planning.lattice.guided.lower_bound import Goal, goal_of, lower_bounds
from lampyris.planning.lattice.guided.open_space import NEVER, REACH, open_space_of
from lampyris.planning.lattice.lattice import StateLattice
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.poses import headings_near
from lampyris.planning.lattice.search import Found, LatticeSearch

LOOK = 8
"""Cells of descent of the field that give the direction at a cell."""
ORDER = 2.0
"""Weight of the estimate in the order."""
MANY = 200_000
"""States of a map below which the tables take longer than they save."""
LEAST = 1.25
"""Weight below which it hardly ever finds a path."""
CELLS = 1 << 16
"""Cells of a map below which its whole field is made at once."""
MANY_GOALS = 128
"""Goal states above which the table to all of them takes longer than it saves."""
FEW = 300
FEW_A_MOTION = 72
"""Expansions after which it is given up, and so many more for each of the longest motions that the path has room for."""


@lru_cache(8)
def around(lattice: StateLattice, reach: int = REACH) -> NDArray[np.int64]:
    """What it costs more to depart in the direction of a heading with another one; int64 (headings, headings + 1).

    The last column is for no direction.
    """
    n, open_space = lattice.shape.headings, open_space_of(lattice, reach)
    half = open_space.half
    more = np.zeros((n, n + 1), dtype=np.int64)
    for k, one in enumerate(lattice.primitives):
        if one.start != one.end or one.length == 0 or lattice.cost[k] != _ahead(lattice, one.start):
            continue
        x, y = lattice.cell[k].tolist()
        steps = half // max(abs(x), abs(y))
        costs = open_space.cost[:, half + steps * y, half + steps * x, one.start]
        more[:, one.start] = costs - steps * lattice.cost[k]
    return np.minimum(more, NEVER)


def _ahead(lattice: StateLattice, heading: int) -> int:
    """Cost of the straight motion ahead."""
    return min(
        int(lattice.cost[k])
        for k, one in enumerate(lattice.primitives)
        if one.start == one.end == heading and one.length > 0
    )


@lru_cache(8)
def sectors(turns: tuple[float, ...]) -> NDArray[np.int8]:
    """The heading of each displacement (row down, column) of at most ``LOOK``; the number of headings for none."""
    side = range(-LOOK, LOOK + 1)
    return np.array(
        [
            len(turns) if x == y == 0 else headings_near(turns, float(elementary.atan2(-y, x)))[0]
            for y in side
            for x in side
        ],
        dtype=np.int8,
    )


@dataclass(frozen=True, slots=True, eq=False)
class Outlook:
    """What the order of one map and one goal needs.

    Parameters
    ----------
    heuristic : int64 (cells,), see :meth:`LatticeMap.heuristic`.
    goal : the goal states.
    toward : int8 (cells,): directions that were worked out so far.
    """

    heuristic: NDArray[np.int64]
    goal: Goal
    toward: NDArray[np.int8]


def is_focused(lattice_map: LatticeMap, weight: float) -> bool:
    """Whether it pays to make the field where paths may lead first: on a large map of plain ground, where a search is short."""
    return weight >= LEAST and lattice_map.walls.size >= CELLS and not len(lattice_map.price)


def is_guided(lattice_map: LatticeMap, weight: float) -> bool:
    """Whether a first try pays: for a drive that cannot turn in place, on a large map of plain ground, with room in the bound."""
    shape = lattice_map.lattice.shape
    states = lattice_map.walls.size * shape.headings
    return (
        weight >= LEAST
        and states >= MANY
        and shape.drive == "ackermann"
        and shape.primitives is None
        and not len(lattice_map.price)
    )


class GuidedSearch(LatticeSearch):
    """A lattice search that can first try for any path within its bound.

    Parameters
    ----------
    lattice_map : the map.
    """

    def __init__(self, lattice_map: LatticeMap) -> None:
        super().__init__(lattice_map)
        self._outlook: Outlook | None = None
        self._focused: tuple[object, FocusedField | None] | None = None

    def field_for(self, query: Query) -> FocusedField | None:
        """The field of a query's goal for its starts: the one at hand, where it reaches far enough; None: the map's is needed."""
        if self._focused is not None and self._focused[0] == query.goal_key:
            focused = self._focused[1]
            if focused is None:
                return None
            known = int(focused.heuristic[query.starts[0][0]])
            seen = focused.seen_from(query.starts, query.start_costs, self.lattice_map)
            if seen.most is None or (known >= 0 and seen.most >= FACTOR * known):
                return seen
        focused = focused_field(self.lattice_map, query.starts[0][0], query.field_cells, query.ends.goal)
        self._focused = query.goal_key, focused
        return focused and focused.seen_from(query.starts, query.start_costs, self.lattice_map)

    def first_try(
        self,
        heuristic: NDArray[np.int64],
        query: Query,
        weight: float,
        limit: int | None,
        most: int | None = None,
    ) -> tuple[Found | None, int]:
        """A path of at most ``weight`` times a lower bound, if it is found soon; and the expansions.

        Parameters
        ----------
        query : with goals that the heuristic is known at.
        limit : greatest number of expansions.
        most : paths through cells that the heuristic leaves out cost more; see :class:`FocusedField`.
        """
        lattice_map, lattice = self.lattice_map, self.lattice_map.lattice
        open_space = open_space_of(lattice)
        outlook = self._outlook
        if outlook is None or outlook.heuristic is not heuristic or outlook.goal.states != query.goals:
            goal = goal_of(query.goals, open_space, lattice_map, heuristic, query.goal_costs)
            if goal is None:
                return None, 0
            self._outlook = outlook = Outlook(heuristic, goal, np.zeros(len(heuristic), dtype=np.int8))
        query = query.starting_at([k for k, (cell, _) in enumerate(query.starts) if heuristic[cell] >= 0])
        if not query.starts:
            return None, 0
        bounds = lower_bounds(
            query.starts, query.start_costs, outlook.goal, open_space, lattice_map, heuristic
        )
        bound = int(bounds.min()) if most is None else min(int(bounds.min()), most)
        self.begin(heuristic, query.starts, query.goals, query.start_costs, query.goal_costs)
        self._sort_starts(query, bounds)
        if not 0 <= self._best[0] <= math.floor(weight * bound):
            self._best[:] = -1
            few = self._few(heuristic, query.starts[0][0])
            while self._try(outlook, bound, weight, few if limit is None else min(limit, few)) == FULL:
                self._enlarge()
        if self._best[0] < 0:
            return None, self.expansions
        states, primitives, last = self._followed()
        cost = int(self._best[0])
        return Found(tuple(states), tuple(primitives), last, cost, min(bound, cost)), self.expansions

    def _few(self, heuristic: NDArray[np.int64], start: int) -> int:
        """Expansions after which the first try from a cell is given up."""
        cost = self.lattice_map.lattice.cost
        return FEW + FEW_A_MOTION * int(heuristic[start]) // int(cost[cost < NEVER].max())

    def _sort_starts(self, query: Query, bounds: NDArray[np.int64]) -> None:
        """Have the starts wait in the order of their keys, by their lower bounds."""
        costs = np.array(query.start_costs, dtype=np.int64)
        keys = costs + (ORDER * (bounds - costs)).astype(np.int64)
        order = np.argsort(keys, kind="stable")  # a sorted array is a heap
        states = np.array([cell * self._stride + heading for cell, heading in query.starts])
        self._keys[: len(order)], self._states[: len(order)] = keys[order], states[order]

    def _try(self, outlook: Outlook, bound: int, weight: float, limit: int) -> int:
        lattice_map, lattice = self.lattice_map, self.lattice_map.lattice
        return self._called(
            greedy, 1, (
                lattice_map.walls, lattice_map.clear, self._heuristic, self._stride, lattice.first, lattice_map.offsets,
                lattice.turned, lattice.cost, lattice.reach, lattice.inscribed - 1e-6, lattice.sweep_first,
                lattice_map.swept, lattice.disc_first, lattice_map.discs, lattice.disc_radius,
                self._goals, self._ends, ORDER, math.floor(weight * bound), limit, self._run, self._mark,
                self._parent, self._closed, self._keys, self._states, self._count, self._best, lattice_map.stride, LOOK,
                sectors(lattice.angles), outlook.toward, around(lattice).ravel(), outlook.goal.table.ravel(),
                (outlook.goal.table.shape[0] - 1) // 2, outlook.goal.cell,
            )
        )  # fmt: skip
