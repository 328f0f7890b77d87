"""The rounds of planning with adaptive dimensionality among obstacles with known tracks.

Planning: the earliest arrival where only cells in spheres have headings and intervals of time; elsewhere the robot may be
in a cell at any time and turn there at will, among walls alone. Tracking: a path of poses and times in a tunnel around it.
A. Vemula, K. Muelling, J. Oh, "Path planning in dynamic environments with adaptive dimensionality", SoCS 2016; spheres
that hold for all times, intervals in place of sampled times and the test that ends it are ours.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice import timed_search as kernel
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.field import LowField
from lampyris.planning.lattice.pad.hybrid import State
from lampyris.planning.lattice.pad.order import put_in_order
from lampyris.planning.lattice.pad.places import costly_places
from lampyris.planning.lattice.pad.projection import projection_of
from lampyris.planning.lattice.pad.regions import Spheres, Tunnel
from lampyris.planning.lattice.pad.rounds import AGAIN, FEW, GREEDY, Round
from lampyris.planning.lattice.search import Found
from lampyris.planning.lattice.timed.search import IntervalSearch, Regions, TimedFound
from lampyris.typing import Cell

ROUNDING = 1e-9
"""Share of an arrival that is rounding."""


class TimedRounds:
    """One call of the planner.

    Parameters
    ----------
    search : finds arrivals on the map.
    lattice_map : the map.
    field, costs : the projected graph, and its costs.
    starts, goals : states.
    weight : the arrival may be so many times the earliest.
    spheres : to begin with; they grow.
    tunnel : half width, cells.
    limit : greatest number of expansions of all rounds together; None: none.

    Attributes
    ----------
    records : what each round did.
    expansions : of all rounds.
    best : the best path so far.
    lower_bound : ticks before which no path of the lattice arrives.
    """

    def __init__(
        self, search: IntervalSearch, lattice_map: LatticeMap, field: LowField, costs: NDArray[np.int64],
        starts: list[State], goals: list[State], weight: float, spheres: Spheres, tunnel: float, limit: int | None,
    ) -> None:  # fmt: skip
        self._search, self._map, self._field, self._costs = search, lattice_map, field, costs
        self._starts, self._goals, self._weight = starts, goals, weight
        self._spheres, self._width, self._limit = spheres, tunnel, limit
        projection = projection_of(lattice_map.lattice)
        cells = lattice_map.walls.size
        self._regions = Regions(np.zeros(cells, dtype=np.uint8), projection.member, projection.group_first)
        self._everywhere = Regions.everywhere(cells)
        self._low_heading = len(lattice_map.lattice.angles)
        self._order = np.zeros(cells * (self._low_heading + 1), dtype=np.int64)
        self._masked = np.full(cells, -1, dtype=np.int64)
        self.records: list[Round] = []
        self.expansions = 0
        self.best: TimedFound | None = None
        self._tracked: TimedFound | None = None
        self._tunnel: Tunnel | None = None
        # No path arrives before the projected graph's, which knows walls alone.
        self.lower_bound = search.tick * min(int(costs[cell]) for cell, _ in starts)
        self._planning = self._low = self._tracking = 0

    @property
    def tick(self) -> float:
        """Ticks of one unit of the lattice."""
        return self._search.tick

    def run(self) -> int:
        """Search until the path is good enough, there is none, or the budget is used; one of the kernel's outcomes."""
        while True:
            outcome = self._round()
            if outcome != AGAIN:
                return outcome

    @property
    def _target(self) -> float:
        """Ticks at which a path may arrive by what is proven so far."""
        return self._weight * self.lower_bound * (1 + ROUNDING)

    def enough(self) -> bool:
        """Whether the best path arrives as early as is wanted."""
        return self.best is not None and self.best.arrivals[-1] <= self._target

    def _left(self) -> int | None:
        if self._limit is None:
            return None
        return max(self._limit - self.expansions - self._planning - self._tracking, 0)

    def _round(self) -> int:
        """A planning phase and a tracking phase; ``AGAIN``: another round is needed."""
        planned = self._plan()
        path = planned.path
        if self.enough() or path is None:
            self._note(planned, None)
            return kernel.FOUND if self.enough() else planned.outcome
        states = (*path.states, path.last)
        if all(heading != self._low_heading for _, heading in states):
            self._keep(planned)
            self._note(planned, None)
            return kernel.FOUND
        old = self._tunnel
        known = self._tracked if old is not None and all(cell in old for cell, _ in states) else None
        tunnel = Tunnel(
            [self._map.cell(cell) for cell, _ in states], self._width, self._map, self._spheres.all
        )
        self._tunnel = tunnel
        tracked = self._track(tunnel, known is not None)
        self._note(planned, tracked)
        if self.enough():
            return kernel.FOUND
        if self._left() == 0:
            return kernel.LIMIT
        place = -1
        if tracked.path is None:
            if known is None:
                reached = tracked.reached[np.isin(tracked.reached, tunnel.cells)]
                place = int(tunnel.place_of(reached).max(initial=0)) if len(reached) else 0
            else:
                tracked = known
        self._tracked = tracked if tracked.path is not None else None
        for cell in self._places(planned, tracked, place, tunnel):
            self._spheres.add_or_grow(cell)
        return AGAIN

    def _plan(self) -> TimedFound:
        """The planning phase.

        Once a path is known, only what could refute that it is good enough is looked for. Without spheres the graph is the
        projected one, whose cheapest path is known.
        """
        if not self._spheres.all:
            return self._plan_among_walls()
        self._spheres.mark(self._regions.inside, self._map)
        most = -1.0 if self.best is None else self.best.arrivals[-1] / self._weight * (1 - ROUNDING)
        planned = self._search.find(
            self._costs, self._starts, self._goals, 1.0, self._left(), regions=self._regions, most=most
        )
        self._planning, self._low = planned.expansions, planned.low
        if planned.path is not None:
            self.lower_bound = max(self.lower_bound, planned.lower_bound)
        elif planned.outcome == kernel.EXHAUSTED and most >= 0.0:
            self.lower_bound = max(self.lower_bound, most)
        return planned

    def _plan_among_walls(self) -> TimedFound:
        """The cheapest path of the projected graph."""
        _, cell = min((int(self._costs[cell]), cell) for cell, _ in self._starts if self._costs[cell] >= 0)
        cells, primitives = self._field.path(cell)
        cells.append(cells[-1] + int(self._map.offsets[primitives[-1]]) if cells else cell)
        states = [(cell, self._low_heading) for cell in cells]
        prices = self._map.lattice.cost[primitives] if primitives else np.zeros(0, dtype=np.int64)
        arrivals = self._search.tick * np.concatenate(([0], np.cumsum(prices)))
        cost = int(prices.sum())
        path = Found(tuple(states[:-1]), tuple(primitives), states[-1], cost, cost)
        return TimedFound(
            kernel.FOUND,
            0,
            0,
            path,
            tuple(arrivals[:-1].tolist()),
            tuple(arrivals.tolist()),
            float(arrivals[-1]),
        )

    def _track(self, tunnel: Tunnel, seen: bool) -> TimedFound:
        """The tracking phase: first for a path that arrives as early as is wanted, which a greedy search finds soonest.

        If there is none in the tunnel, for any, to see where it is late; but not where that has been ``seen``.
        """
        goals = [one for one in self._goals if one[0] in tunnel]
        starts = [one for one in self._starts if one[0] in tunnel]
        found = TimedFound(kernel.EXHAUSTED, 0)
        if not goals or not starts:
            return found
        self._masked[tunnel.cells] = self._costs[tunnel.cells]
        put_in_order(self._order, tunnel, goals, self._map, self._field, self._masked)
        some = FEW * len(tunnel.path) + 100
        tries: list[tuple[float, float, int | None]] = [(weight, self._target, some) for weight in GREEDY]
        for weight, most, limit in tries if seen else (*tries, (self._weight, -1.0, None)):
            left = self._left()
            least = min((one for one in (left, limit) if one is not None), default=None)
            found = self._search.find(
                self._masked,
                starts,
                goals,
                weight,
                least,
                regions=self._everywhere,
                most=most,
                order=self._order,
            )
            self._tracking += found.expansions
            if found.path is not None or self._left() == 0:
                break
        self._masked[tunnel.cells] = -1
        if found.path is not None:
            self._keep(found)
        return found

    def _keep(self, found: TimedFound) -> None:
        if self.best is None or found.arrivals[-1] < self.best.arrivals[-1]:
            self.best = found

    def _note(self, planned: TimedFound, tracked: TimedFound | None) -> None:
        low, high, tracking = self._low, self._planning - self._low, self._tracking
        self.expansions += self._planning + self._tracking
        self._planning = self._low = self._tracking = 0
        spheres, found = tuple(self._spheres.all), None if tracked is None else tracked.path
        bound = math.floor(self.lower_bound / self._search.tick)
        self.records.append(Round(spheres, planned.path, found, self._width, bound, low, high, tracking))

    def _places(self, planned: TimedFound, tracked: TimedFound, place: int, tunnel: Tunnel) -> list[Cell]:
        """Where headings and times are wanted: where tracking went no farther, or is later than was planned."""
        path = tracked.path
        if path is None:
            return [tunnel.path[place]]
        return costly_places(
            np.array(tunnel.path),
            np.array(planned.arrivals),
            np.array([self._map.cell(cell) for cell, _ in (*path.states, path.last)]),
            np.array(tracked.arrivals),
            self._spheres.radius,
            tracked.arrivals[-1] / self._weight - self.lower_bound,
        )
