"""The rounds of planning with adaptive dimensionality: plan with few headings, track with all, add headings.

K. Gochev, B. Cohen, J. Butzke, A. Safonova, M. Likhachev, "Path planning with adaptive dimensionality", SoCS 2011.
The test that ends it is ours: a path counts when it costs at most the weight times a lower bound that has been
proven, the greatest of all rounds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice import search as kernel
from lampyris.model.plan import PlanningRound
from lampyris.planning.lattice.ends.query import Query
from lampyris.planning.lattice.guided.lower_bound import (
    Goal,
    both_ends_bound,
    goal_of,
    lower_bounds,
)
from lampyris.planning.lattice.guided.open_space import FAR, open_space_of
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.around_goal import MANY, with_walls
from lampyris.planning.lattice.pad.field import LowField
from lampyris.planning.lattice.pad.hybrid import NO_ORDER, RegionalHeadingSearch, State
from lampyris.planning.lattice.pad.order import put_in_order
from lampyris.planning.lattice.pad.places import costly_places
from lampyris.planning.lattice.pad.regions import Sphere, Spheres, Tunnel
from lampyris.planning.lattice.search import Found
from lampyris.typing import Cell

GREEDY = (3.0, 1.2)
"""Weights of searches for a path that need only cost as little as is wanted; they are given up soon."""
FEW = 4
"""Expansions of such a search for each state of the planned path."""
MANY_STARTS = 64
"""Start states up to which the lower bound of both ends is worked out."""
WANTED = 2.0
"""How many times the excess cost that is to be proven the places of new spheres account for: a sphere proves a part of it."""
AGAIN = -1
"""Outcome of a round after which another is needed."""


@dataclass(frozen=True, slots=True)
class Round:
    """What one round did.

    Parameters
    ----------
    spheres : those of its planning phase; none where it tracked an old tunnel without planning.
    planned, tracked : the paths of its two phases; None: not searched, or none found.
    tunnel : half width, cells.
    lower_bound : the best so far, in units of the lattice.
    low, high, tracking : expansions: cells and poses of the planning phase, poses of the tracking phase.
    """

    spheres: tuple[Sphere, ...]
    planned: Found | None
    tracked: Found | None
    tunnel: float
    lower_bound: int
    low: int
    high: int
    tracking: int


def recorded(one: Round, lattice_map: LatticeMap) -> PlanningRound:
    """What a round did, in cells and metres."""
    to_m = lattice_map.grid.resolution / UNIT

    def cells(found: Found | None) -> tuple[Cell, ...]:
        return () if found is None else tuple(lattice_map.cell(k) for k, _ in (*found.states, found.last))

    return PlanningRound(
        tuple((sphere.cell, sphere.radius) for sphere in one.spheres), cells(one.planned), cells(one.tracked),
        one.tunnel, None if one.planned is None else one.planned.cost * to_m,
        None if one.tracked is None else one.tracked.cost * to_m, one.lower_bound * to_m, one.low, one.high, one.tracking,
    )  # fmt: skip


class PadSearch(RegionalHeadingSearch):
    """The memory of the planner on one map: its own is that of the tracking phase, in which all cells have headings.

    Parameters
    ----------
    lattice_map : the map.

    Attributes
    ----------
    hybrid : the planning phase's.
    field : costs of the projected graph, None: none asked for yet.
    ordered_for : the tunnel whose states are in order for the goals and costs at hand.
    """

    def __init__(self, lattice_map: LatticeMap) -> None:
        super().__init__(lattice_map)
        self.inside[:] = 1
        self.hybrid = RegionalHeadingSearch(lattice_map)
        self.field: LowField | None = None
        self.ordered_for: Tunnel | None = None
        self._known: tuple[NDArray[np.int64], list[State], Goal | None] | None = None
        self._walled: Goal | None = None
        self._order = np.zeros(len(self._mark), dtype=np.int64)
        self._masked = np.full(lattice_map.walls.size, -1, dtype=np.int64)

    def track(
        self,
        tunnel: Tunnel,
        costs: NDArray[np.int64],
        query: Query,
        weight: float,
        most: int,
        limit: int | None,
    ) -> tuple[Found | None, int]:
        """Poses within a tunnel that cost at most ``most`` (negative: any), and the kernel's outcome.

        What is quick to reach the goal, its heading included, is expanded first; no lower bound comes of that.
        """
        known = query.ending_at([k for k, one in enumerate(query.goals) if one[0] in tunnel])
        if not known.goals:
            return None, kernel.EXHAUSTED
        self._masked[tunnel.cells] = costs[tunnel.cells]
        if self.ordered_for is not tunnel:
            put_in_order(
                self._order, tunnel, query.goals, self.lattice_map, self.field, self._masked, self.goal
            )
            self.ordered_for = tunnel
        self.order = self._order
        try:
            self.most = most
            self.begin(self._masked, known.starts, known.goals, known.start_costs, known.goal_costs)
            outcome = self.improve(weight, limit)
            return self.result(), outcome
        finally:
            self._masked[tunnel.cells] = -1
            self.order = NO_ORDER

    def take_over(self, lattice_map: LatticeMap, changed: list[Cell]) -> None:
        """Continue with a map in which cells have become blocked or free."""
        self.lattice_map = self.hybrid.lattice_map = lattice_map
        if self.field is not None and not self.field.repaired(lattice_map, changed):
            self.field = None

    def goal_among(self, costs: NDArray[np.int64], query: Query) -> Goal | None:
        """What is known of the headings at the goal; None of several goal cells, or with primitives of a file."""
        lattice = self.lattice_map.lattice
        is_one = query.ends.goal is not None or len({cell for cell, _ in query.goals}) == 1
        if not is_one or lattice.shape.primitives is not None:
            return None
        if self._known is None or self._known[0] is not costs or self._known[1] != query.goals:
            open_space = open_space_of(lattice, FAR)
            goal = goal_of(query.goals, open_space, self.lattice_map, costs, query.goal_costs)
            self._known = costs, query.goals, goal
        return self._known[2]

    def look_around_goal(self, costs: NDArray[np.int64], goal: Goal, limit: int) -> tuple[Goal, int]:
        """The goal with the walls around it, and the states expanded for that; once for a goal.

        Parameters
        ----------
        costs, goal : those of :meth:`goal_among`, and its result.
        limit : greatest number of expansions.
        """
        assert self._known is not None
        if self._walled is goal:
            return goal, 0
        self._walled, expanded = with_walls(goal, self.lattice_map, costs, limit, self.expanded)
        self._known = *self._known[:2], self._walled
        return self._walled, expanded

    def farthest(self, tunnel: Tunnel) -> int:
        """The greatest place of a tunnel at which any state was reached."""
        states = tunnel.cells[:, None] * self._stride + np.arange(self._stride)
        reached = ((self._mark[states] >> kernel.SHIFT) == self._run).any(axis=1)
        return int(tunnel.place[reached].max(initial=0))


class Rounds:
    """One call of the planner.

    Parameters
    ----------
    search : the memory.
    costs : of the projected graph, see :meth:`LowField.costs`; below those of the curves at a joined goal.
    query : with starts and goals that the costs are known at.
    weight : the path may cost so many times the least.
    spheres : to begin with; they grow.
    tunnel : half width, cells.
    limit : greatest number of expansions of all rounds together; None: none.

    Attributes
    ----------
    records : what each round did.
    expansions : of all rounds.
    tunnel : the last one.
    """

    def __init__(
        self, search: PadSearch, costs: NDArray[np.int64], query: Query, weight: float, spheres: Spheres, tunnel: float,
        limit: int | None,
    ) -> None:  # fmt: skip
        self._search, self._costs = search, costs
        search.ordered_for = None
        self._query = query
        self._weight, self._spheres, self._width, self._limit = weight, spheres, tunnel, limit
        self.records: list[Round] = []
        self.expansions = 0
        self.tunnel: Tunnel | None = None
        self._best: Found | None = None
        self._tracked: Found | None = None
        # No path costs less than the projected graph's, nor than turning at both ends does.
        self._projected, self._nearest = min(
            (int(costs[cell]) + more, cell)
            for (cell, _), more in zip(query.starts, query.start_costs, strict=True)
        )
        self._lower_bound = self._projected
        self._planning = self._low = self._tracking = 0
        self._take_goal(search.goal_among(costs, query))

    def _take_goal(self, goal: Goal | None) -> None:
        """Have both phases know the headings of the goal, and the lower bound of both ends."""
        search = self._search
        search.goal = search.hybrid.goal = goal
        search.ordered_for = None
        query = self._query
        if goal is not None and len(query.starts) <= MANY_STARTS:
            open_space = open_space_of(search.lattice_map.lattice, FAR)
            wanted = (query.starts, query.start_costs, goal, open_space, search.lattice_map, self._costs)
            self._lower_bound = max(
                self._lower_bound, int(lower_bounds(*wanted).min()), both_ends_bound(*wanted)
            )

    def _look_around_goal(self) -> bool:
        """Take the walls around the goal into account; whether there was anything to learn."""
        search, left = self._search, self._left()
        goal = search.goal
        if goal is None or left == 0:
            return False
        walled, expanded = search.look_around_goal(self._costs, goal, MANY if left is None else left)
        self._planning += expanded
        if walled is goal:
            return False
        self._take_goal(walled)
        return True

    def run(self, old: Tunnel | None = None) -> int:
        """Search until the path is good enough, there is none, or the budget is used; one of the kernel's outcomes.

        Parameters
        ----------
        old : the tunnel of an earlier plan, tried first.
        """
        if old is not None:
            self._tracked, _, outcome = self._track(old)
            self._note((), None, self._tracked)
            if self.enough() or outcome == kernel.LIMIT:
                return kernel.FOUND if self.enough() else outcome
        while True:
            outcome = self._round()
            if outcome != AGAIN:
                return outcome

    def result(self) -> Found | None:
        """The best path with the best lower bound of all rounds."""
        if self._best is None:
            return None
        return replace(self._best, lower_bound=min(self._lower_bound, self._best.cost))

    @property
    def _target(self) -> int:
        """What a path may cost by what is proven so far."""
        return math.floor(self._weight * self._lower_bound * (1 + 2e-12))

    def enough(self) -> bool:
        """Whether the best path costs as little as is wanted."""
        return self._best is not None and self._best.cost <= self._target

    def _left(self) -> int | None:
        if self._limit is None:
            return None
        return max(self._limit - self.expansions - self._planning - self._tracking, 0)

    def _round(self) -> int:
        """A planning phase and a tracking phase; ``AGAIN``: another round is needed."""
        hybrid, lattice_map = self._search.hybrid, self._search.lattice_map
        spheres = tuple(self._spheres.all)
        planned, outcome = self._plan()
        if self.enough() or planned is None or outcome == kernel.LIMIT:
            self._note(spheres, planned, None)
            return kernel.FOUND if self.enough() else outcome
        states = (*planned.states, planned.last)
        if not any(map(hybrid.is_low, states)):
            self._keep(planned)
            self._note(spheres, planned, None)
            return kernel.FOUND
        known = (
            self._tracked
            if self.tunnel is not None and all(cell in self.tunnel for cell, _ in states)
            else None
        )
        tunnel = Tunnel([lattice_map.cell(cell) for cell, _ in states], self._width, lattice_map, spheres)
        tracked, place, outcome = self._track(tunnel, known is not None)
        self._note(spheres, planned, tracked)
        self._tracked = tracked = tracked or known
        if self.enough():
            return kernel.FOUND
        if outcome == kernel.LIMIT:
            return outcome
        for cell in self._places(planned, tracked, place, tunnel):
            self._spheres.add_or_grow(cell)
        return AGAIN

    def _plan(self) -> tuple[Found | None, int]:
        """The planning phase.

        Once a path is known, only what could refute that it is good enough is looked for: a path of the hybrid graph
        that costs less than its cost through the weight. If there is none, that is a lower bound. Without spheres the
        graph is the projected one, whose cheapest path is known.
        """
        search = self._search
        hybrid, field = search.hybrid, search.field
        if not self._spheres.all and field is not None:
            cell = self._nearest
            cells, primitives = field.path(cell)
            cells.append(cells[-1] + int(search.lattice_map.offsets[primitives[-1]]) if cells else cell)
            states = [(cell, hybrid.low) for cell in cells]
            cost = self._projected
            return Found(tuple(states[:-1]), tuple(primitives), states[-1], cost, cost), kernel.FOUND
        hybrid.most = (
            -1 if self._best is None else math.ceil(self._best.cost / self._weight * (1 - 1e-12)) - 1
        )
        if self._best is not None:
            self._hold_ends(hybrid.most)
        self._spheres.mark(hybrid.inside, search.lattice_map)
        query = self._query
        hybrid.begin(self._costs, query.starts, query.goals, query.start_costs, query.goal_costs)
        outcome = hybrid.improve(1.0, self._left())
        self._planning += hybrid.expansions
        self._low += hybrid.low_expansions
        found = hybrid.result()
        if found is not None:
            # With weight 1 nothing that waits leads to a cheaper path of the lattice, to the last unit.
            proven = found.cost if outcome == kernel.FOUND else found.lower_bound
            self._lower_bound = max(self._lower_bound, proven)
        elif outcome == kernel.EXHAUSTED and hybrid.most >= 0:
            self._lower_bound = max(self._lower_bound, hybrid.most + 1)
        return found, outcome

    def _hold_ends(self, most: int) -> None:
        """Have spheres at the ends, as large as what a path of cost ``most`` may cost more than the projected one.

        What there is to refute are paths that turn round at less cost; they do so within this distance.
        """
        search = self._search
        cell = self._nearest
        radius = (most - self._projected) / UNIT
        if radius > 0:
            self._spheres.hold(search.lattice_map.cell(cell), radius)
        if search.goal is not None:
            self._spheres.hold(search.lattice_map.cell(search.goal.cell), search.goal.half)

    def _track(self, tunnel: Tunnel, seen: bool = False) -> tuple[Found | None, int, int]:
        """The tracking phase: ``(path, place, outcome)``; without a path, ``place`` is how far it came.

        First for a path that costs as little as is wanted, which a greedy search finds soonest; again once the walls around
        the goal are known. If there is none in the tunnel, for any, to see where it costs more; but not where that has been
        ``seen``.
        """
        search, self.tunnel = self._search, tunnel
        wanted = (tunnel, self._costs, self._query)
        some = FEW * len(tunnel.path) + 100
        found: Found | None = None
        outcome = kernel.LIMIT
        tries: list[tuple[float, int | None]] = [(weight, some) for weight in GREEDY]
        if not seen:
            tries.append((self._weight, None))
        while tries:
            weight, limit = tries.pop(0)
            left = self._left()
            least = min((one for one in (left, limit) if one is not None), default=None)
            found, outcome = search.track(*wanted, weight, -1 if limit is None else self._target, least)
            self._tracking += search.expansions
            if found is not None or self._left() == 0:
                break
            if self._look_around_goal():
                tries[:0] = [(one, some) for one in GREEDY]
        if found is None:
            outcome = kernel.LIMIT if self._left() == 0 else kernel.EXHAUSTED
            return None, search.farthest(tunnel), outcome
        self._keep(found)
        return found, -1, outcome

    def _keep(self, found: Found) -> None:
        if self._best is None or found.cost < self._best.cost:
            self._best = found

    def _note(self, spheres: tuple[Sphere, ...], planned: Found | None, tracked: Found | None) -> None:
        low, high, tracking = self._low, self._planning - self._low, self._tracking
        self.expansions += self._planning + self._tracking
        self._planning = self._low = self._tracking = 0
        self.records.append(
            Round(spheres, planned, tracked, self._width, self._lower_bound, low, high, tracking)
        )

    def _places(self, planned: Found, tracked: Found | None, place: int, tunnel: Tunnel) -> list[Cell]:
        """Where headings are wanted: where tracking went no farther, or costs more than was planned."""
        if tracked is None:
            return [tunnel.path[place]]
        lattice_map = self._search.lattice_map
        price = lattice_map.lattice.cost
        return costly_places(
            np.array(tunnel.path),
            np.concatenate(([0], np.cumsum(price[list(planned.primitives)]))),
            np.array([lattice_map.cell(cell) for cell, _ in (*tracked.states, tracked.last)]),
            np.concatenate(([0], np.cumsum(price[list(tracked.primitives)]))),
            self._spheres.radius * UNIT,
            WANTED * (tracked.cost / self._weight - self._lower_bound),
        )
