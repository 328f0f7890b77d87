"""The planning phase: a search over poses inside regions and over cells outside them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice import hybrid as kernel
from lampyris.planning.lattice.guided.lower_bound import Goal
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.projection import projection_of
from lampyris.planning.lattice.search import LatticeSearch

State = tuple[int, int]
"""Index of a cell, and heading."""


NO_ORDER = np.zeros(1, dtype=np.int64)


class RegionalHeadingSearch(LatticeSearch):
    """The memory of searches whose states have a heading inside regions only.

    Parameters
    ----------
    lattice_map : the map.

    Attributes
    ----------
    inside : uint8 (cells,): 1 in a region; to be set before :meth:`begin`.
    goal : what is known of the headings at the goal, for bounds; None: nothing.
    order : int64 (states,): added to the heuristic for the order in which states are expanded, not for bounds.
    most : paths that cost more are not looked for; negative: all are.
    """

    def __init__(self, lattice_map: LatticeMap) -> None:
        super().__init__(lattice_map)
        self._projection = projection_of(lattice_map.lattice)
        self.inside: NDArray[np.uint8] = np.zeros(lattice_map.walls.size, dtype=np.uint8)
        self.most = -1
        self.order: NDArray[np.int64] = NO_ORDER
        self.goal: Goal | None = None

    def _states_of_a_cell(self) -> int:
        return self.lattice_map.lattice.shape.headings + 1

    def begin(
        self,
        heuristic: NDArray[np.int64],
        starts: list[State],
        goals: list[State],
        start_costs: list[int] | None = None,
        goal_costs: list[int] | None = None,
    ) -> None:
        """See :meth:`LatticeSearch.begin`; a state outside all regions stands for its cell."""
        begun, ended = ([self._seen(one) for one in states] for states in (starts, goals))
        super().begin(heuristic, begun, ended, start_costs, goal_costs)
        if 0 <= self.most < self._best[0]:
            self._best[:] = -1  # a start is a goal, at too high a cost

    def _seen(self, state: State) -> State:
        return state if self.inside[state[0]] else (state[0], self._stride - 1)

    @property
    def low(self) -> int:
        """What stands for the heading of a cell without one."""
        return self._stride - 1

    def is_low(self, state: State) -> bool:
        """Whether a state is a cell without a heading."""
        return state[1] == self.low

    @property
    def low_expansions(self) -> int:
        """Cells expanded without a heading, a part of :attr:`expansions`."""
        return int(self._count[kernel.LOW])

    def _before(self, state: int, primitive: int) -> int:
        before = super()._before(state, primitive)
        cell = before // self._stride
        return before if self.inside[cell] else cell * self._stride + self._stride - 1

    def _run_kernel(self, weight: float, limit: int) -> int:
        lattice, lattice_map, projection = self.lattice_map.lattice, self.lattice_map, self._projection
        goal = self.goal
        table, half, cell, entry = (
            (NO_ORDER, -1, 0, 0)
            if goal is None
            else (goal.with_cells, goal.half, goal.cell, max(goal.entry, 0))
        )
        return self._called(
            kernel.search, self._round, (
                lattice_map.walls, lattice_map.clear, self._heuristic, self._stride - 1, lattice.first,
                lattice_map.offsets, lattice.turned, lattice.cost, lattice.reach, lattice.inscribed - 1e-6,
                lattice.sweep_first, lattice_map.swept, self.inside, projection.member, projection.group_first,
                self.most, self.order, lattice_map.stride, table, half, cell, entry,
                self._goals, self._ends, self._near, weight, limit, self._run, self._mark, self._parent, self._closed,
                self._round, self._keys, self._states, self._aside, self._count, self._best,
            )
        )  # fmt: skip
