"""Rounds of a lattice search: weighted A*, and ARA*, which lowers the weight and keeps what it knows."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels._jit import Kernel, compiled_only
from lampyris.kernels.lattice import search as kernel
from lampyris.planning.graph.expanded import run_noting
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.state_memory import memory_for
from lampyris.typing import Cells

_ROOM = 1 << 16
FEW = 2000
"""Expansions after which a search goes on in compiled form, if it began in the plain one: 60 to 300 ms."""


@dataclass(frozen=True, slots=True)
class Found:
    """A path of the lattice.

    Parameters
    ----------
    states : cell index and heading where each primitive begins.
    primitives : the primitives, in order.
    last : cell index and heading at the end.
    cost, lower_bound : in units of the lattice.
    """

    states: tuple[tuple[int, int], ...]
    primitives: tuple[int, ...]
    last: tuple[int, int]
    cost: int
    lower_bound: int


class LatticeSearch:
    """The memory of searches on one map: cost, parent and round of every state.

    Parameters
    ----------
    lattice_map : the map.

    Attributes
    ----------
    expanded : the cells of the states that are expanded, first come first, a part for each call of a kernel; None: they are
        not recorded. Kernels run in their plain form where they are.
    """

    def __init__(self, lattice_map: LatticeMap) -> None:
        self.lattice_map = lattice_map
        self.expanded: list[Cells] | None = None
        self._stride = self._states_of_a_cell()
        self._memory = memory_for(self, lattice_map.walls.size * self._stride)
        self._mark, self._parent, self._closed = self._memory.mark, self._memory.parent, self._memory.closed
        self._keys = np.zeros(_ROOM, dtype=np.int64)
        self._states = np.zeros(_ROOM, dtype=np.int32)
        self._aside = np.zeros(_ROOM, dtype=np.int32)
        self._count = np.zeros(6, dtype=np.int64)
        self._best = np.full(2, -1, dtype=np.int64)
        starts = (one.start for one in lattice_map.lattice.primitives)
        offsets: list[int] = lattice_map.offsets.tolist()
        self._back: list[int] = [
            start - offset * self._stride for start, offset in zip(starts, offsets, strict=True)
        ]

    @property
    def expansions(self) -> int:
        """States expanded in this search so far."""
        return int(self._count[kernel.EXPANDED])

    def begin(
        self,
        heuristic: NDArray[np.int64],
        starts: list[tuple[int, int]],
        goals: list[tuple[int, int]],
        start_costs: list[int] | None = None,
        goal_costs: list[int] | None = None,
    ) -> None:
        """A new search from any of the starts to any of the goals, pairs of cell index and heading.

        Parameters
        ----------
        heuristic : of a goal state at most what it costs to get from there to the goal.
        start_costs, goal_costs : what it costs to get to each start, and from each goal state to the goal; by default nothing.
        """
        self._memory.run += 1
        if self._memory.run >> (62 - kernel.SHIFT):
            self._mark[:], self._memory.run = 0, 1
        self._run = self._memory.run
        self._round = 0
        self._weight, self._complete = math.inf, False
        self._heuristic = heuristic
        self._start_costs = self._least(starts, start_costs)
        self._goal_costs = self._least(goals, goal_costs)
        self._goals = np.array(sorted(self._goal_costs), dtype=np.int64)
        self._ends = np.array([self._goal_costs[state] for state in self._goals.tolist()], dtype=np.int64)
        self._near = int(max(heuristic[cell] for cell, _ in goals))
        self._count[:] = 0
        self._best[:] = -1
        waiting = sorted(state for state in self._start_costs if heuristic[state // self._stride] >= 0)
        for state in waiting:
            cost = self._start_costs[state]
            self._mark[state] = (self._run << kernel.SHIFT) + cost
            self._closed[state] = 0
            self._parent[state] = -1
            if state in self._goal_costs:
                cost += self._goal_costs[state]
                if self._best[0] < 0 or cost < self._best[0]:
                    self._best[:] = cost, state
        while waiting and len(waiting) > len(self._keys) - 128:
            self._enlarge()
        self._states[: len(waiting)] = waiting
        self._count[kernel.WAITING] = len(waiting)

    def _least(self, states: list[tuple[int, int]], costs: list[int] | None) -> dict[int, int]:
        """The least cost that is given for each state."""
        least: dict[int, int] = {}
        for (cell, heading), cost in zip(states, costs or [0] * len(states), strict=True):
            state = cell * self._stride + heading
            least[state] = min(cost, least.get(state, cost))
        return least

    def charge(self, expansions: int) -> None:
        """Count states that were expanded for the same query before :meth:`begin`."""
        self._count[kernel.EXPANDED] += expansions

    def _states_of_a_cell(self) -> int:
        return len(self.lattice_map.lattice.angles)

    def improve(self, weight: float, limit: int | None) -> int:
        """Search with a weight until the path found costs at most ``weight`` times the least; one of the kernel's outcomes."""
        self._round += 1
        self._weight, self._complete = weight, False
        self._rekey(weight)
        while True:
            # How much there is to expand is not known beforehand: the plain form begins, if it may, and does not go on for long.
            few = self.expansions + FEW
            if limit is not None and limit <= few:
                outcome = self._run_kernel(weight, limit)
            else:
                outcome = self._run_kernel(weight, few)
                if outcome == kernel.LIMIT:
                    with compiled_only():
                        outcome = self._run_kernel(weight, -1 if limit is None else limit)
            if outcome != kernel.FULL:
                self._complete = outcome == kernel.FOUND
                return outcome
            self._enlarge()

    def _enlarge(self) -> None:
        """Twice the room for what waits."""
        for name in ("_keys", "_states", "_aside"):
            held = getattr(self, name)
            setattr(self, name, np.concatenate((held, np.zeros_like(held))))

    def _run_kernel(self, weight: float, limit: int) -> int:
        lattice, lattice_map = self.lattice_map.lattice, self.lattice_map
        return self._called(
            kernel.search, self._round, (
                lattice_map.walls, lattice_map.clear, self._heuristic, self._stride, lattice.first, lattice_map.offsets,
                lattice.turned, lattice.cost, lattice.reach, lattice.inscribed - 1e-6, lattice.sweep_first,
                lattice_map.swept, lattice.disc_first, lattice_map.discs, lattice.disc_radius,
                self._goals, self._ends, self._near, weight, limit, self._run, self._mark, self._parent,
                self._closed, self._round, self._keys, self._states, self._aside, self._count, self._best,
                lattice_map.price, lattice_map.price_first, lattice_map.price_cell, lattice_map.price_weight,
            )
        )  # fmt: skip

    def _called(self, kernel: Kernel, closed: int, args: tuple[Any, ...]) -> int:
        """A kernel's outcome; the states that it marks ``closed`` are recorded where that is asked for."""
        if self.expanded is None:
            return int(kernel(*args))
        outcome, states = run_noting(kernel, args, self._closed, closed)
        self.expanded.append(self.lattice_map.cells(states // self._stride))
        return int(outcome)

    def _before(self, state: int, primitive: int) -> int:
        """The state from which a primitive led to another."""
        return state - state % self._stride + self._back[primitive]

    def _open(self) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """States that wait or were set aside, some more than once, with their costs and heuristics."""
        waiting, aside = int(self._count[kernel.WAITING]), int(self._count[kernel.INCONSISTENT])
        states = self._states[:waiting].astype(np.int64)
        states = states[self._closed[states] != self._round]
        states = np.concatenate((states, self._aside[:aside].astype(np.int64)))
        costs = self._mark[states] - (self._run << kernel.SHIFT)
        return states, costs, self._heuristic[states // self._stride]

    def _rekey(self, weight: float) -> None:
        """Order what waits by its key under a weight; states set aside wait again."""
        states, costs, heuristics = self._open()
        states, once = np.unique(states, return_index=True)
        costs, heuristics = costs[once], heuristics[once]
        keys = costs + (weight * heuristics).astype(np.int64)
        order = np.argsort(keys, kind="stable")  # a sorted array is a heap
        self._closed[states] = 0
        while len(states) > len(self._keys) - 128:
            self._enlarge()
        self._keys[: len(states)] = keys[order]
        self._states[: len(states)] = states[order]
        self._count[kernel.WAITING] = len(states)
        self._count[kernel.INCONSISTENT] = 0

    def result(self) -> Found | None:
        """The best path so far with its lower bound; None: there is none."""
        if self._best[0] < 0:
            return None
        states, primitives, last = self._followed()
        first, end = (cell * self._stride + h for cell, h in (states[0] if states else last, last))
        cost = self.lattice_map.cost_of([cell for cell, _ in states], primitives)
        cost += self._start_costs.get(first, 0) + self._goal_costs.get(end, 0)
        _, costs, heuristics = self._open()
        # A path goes through a state that waits: it costs no less than that state's cost and heuristic together. And
        # with a consistent heuristic no search finds a path of more than its weight times the least cost.
        bound = int((costs + heuristics).min()) if len(costs) else cost
        if self._complete:
            bound = max(bound, math.floor(cost / self._weight * (1 - 1e-9)))
        return Found(tuple(states), tuple(primitives), last, cost, min(bound, cost))

    def _followed(self) -> tuple[list[tuple[int, int]], list[int], tuple[int, int]]:
        """The states and primitives of the path to the best goal state, and that state."""
        state = int(self._best[1])
        last = divmod(state, self._stride)
        states, primitives = [], []
        while (primitive := int(self._parent[state])) >= 0:
            state = self._before(state, primitive)
            primitives.append(primitive)
            states.append(divmod(state, self._stride))
        return states[::-1], primitives[::-1], last
