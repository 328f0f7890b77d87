"""LaCAM*: complete search over configurations, improved until the budget is used."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled
from lampyris._core.limits import MEMORY
from lampyris._core.settings import check_settings, flag, under_name, whole
from lampyris.kernels.fleet import lacam as kernels
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.plan import Status
from lampyris.planning.fleet.base import BOTH, FOUR, FleetTraits, Progress
from lampyris.planning.fleet.distance_tables import MIB, FleetTables, tables_of
from lampyris.planning.fleet.pibt import grown, is_stopped, unreachable
from lampyris.planning.fleet.tracks import arrivals, paths_of
from lampyris.planning.fleet.work import StepWork, generator

CHUNK = 2000
"""Iterations between two calls of ``progress``."""
BUCKETS = 1 << 15
"""Heads of the hash table of configurations."""
FIRST_NODES = 64
UNBOUNDED = 2**62
_GROWING = ("_config", "_waited", "_order", "_node", "_low", "_link", "_opened")


@dataclass(frozen=True, slots=True)
class Lacam:
    """LaCAM*: a depth-first search over the cells of all robots at once, with PIBT for successors.

    It is complete: a fleet that has a plan is solved, given time and memory, and ``no-path`` is reported only after all
    reachable configurations were tried. With a budget, plans become cheaper until it is used; without
    one the first plan is returned. The search minimises the number of ticks that robots are not at rest on their goals
    ("sum of loss"); of the plans found, the one with the least sum of costs is kept.

    Parameters
    ----------
    swap : as for :class:`lampyris.planning.fleet.pibt.Pibt`.
    improve : continue after the first plan until the budget is used, if there is one.
    samples : configurations drawn for each step, with different random tie-breaks; the cheapest is taken. More samples make plans
        cheaper and each step proportionally slower.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    swap: bool = flag(True)
    improve: bool = flag(True)
    samples: int = whole(1, 1, 1000)

    name: ClassVar[str] = "lacam"
    traits: ClassVar[FleetTraits] = FleetTraits(moves=BOTH, complete=True, anytime=True, stochastic=True)
    summary: ClassVar[str] = "LaCAM*: complete; a first plan at once, cheaper ones until the budget is used."
    source: ClassVar[str] = (
        "Okumura, AAAI 2023, IJCAI 2023, AAMAS 2024; hindrance: arXiv 2505.12623. Ours: the flat arrays, the tie-breaks' "
        "generator, the choice among plans by sum of costs."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def plan(
        self,
        fleet: Fleet,
        seed: int,
        iterations: int | None = None,
        progress: Progress | None = None,
        moves: str = FOUR,
    ) -> FleetPlan:
        """See :class:`lampyris.planning.fleet.base.FleetPlanner`; an iteration is a configuration that is tried."""
        return self.plan_on(tables_of(fleet, moves), seed, iterations, progress)

    def plan_on(
        self, tables: FleetTables, seed: int, iterations: int | None = None, progress: Progress | None = None
    ) -> FleetPlan:
        """The same from the tables of the fleet."""
        if tables.cut_off is not None:
            return unreachable(self.name, tables.cut_off, seed)
        search = LacamSearch(tables, self.swap, self.samples, seed)
        detail, status = "", Status.FOUND
        # Without a budget of any kind nothing would end the improvement.
        endless = iterations is None and not is_timed()
        try:
            detail = self._searched(
                search, endless, UNBOUNDED if iterations is None else iterations, progress
            )
        except Cancelled:
            if is_stopped():
                raise
            detail = (
                ""
                if search.best is None
                else "All robots reach their goals; stopped improving at the time limit."
            )
        if search.best is None:
            status = Status.NO_PATH if search.exhausted else Status.LIMIT
            paths = search.nearest()
        else:
            paths = paths_of(search.best, tables.goals, tables.graph.places)
        return FleetPlan(
            status, self.name, paths, tables.distance, search.iterations, search.nodes,
            tuple(search.improvements), seed, detail=detail,
        )  # fmt: skip

    def _searched(self, search: LacamSearch, endless: bool, most: int, progress: Progress | None) -> str:
        """Search to the end; why it ended, where the status does not say so."""
        while True:
            ending = search.go_on(min(most, search.iterations + CHUNK))
            if progress is not None:
                progress(search.iterations, search.cost)
            if ending == kernels.IMPROVED and (endless or not self.improve):
                return ""
            if ending == kernels.EXHAUSTED:
                return "" if search.best is None else "All robots reach their goals; the search is exhausted."
            if ending == kernels.FULL:
                room = f"the search's {MEMORY.allowed:,} MiB ({MEMORY.variable}) are used"
                return (
                    f"Stopped: {room}." if search.best is None else f"All robots reach their goals; {room}."
                )
            if search.iterations >= most and ending == kernels.LIMIT:
                return (
                    ""
                    if search.best is None
                    else "All robots reach their goals; stopped improving at the budget."
                )


class LacamSearch:
    """One search, which can be continued; its memory grows as it is needed, up to the limit.

    Parameters
    ----------
    tables : the fleet.
    swap, samples : see :class:`Lacam`.
    seed : of the tie-breaks.
    """

    def __init__(self, tables: FleetTables, swap: bool, samples: int, seed: int) -> None:
        self._tables, self._swap, self._samples = tables, swap, samples
        robots = len(tables.goals)
        self._work = StepWork(tables, generator(seed))
        self._state = np.zeros(kernels.STATE_WIDTH, dtype=np.int64)
        self._state[kernels.GOAL] = -1
        self._state[kernels.BEST] = UNBOUNDED
        self._config, self._waited, self._order = (
            np.empty(FIRST_NODES * robots, dtype=np.int32) for _ in range(3)
        )
        self._node = np.empty(FIRST_NODES * kernels.NODE_WIDTH, dtype=np.int64)
        self._low = np.empty(8 * FIRST_NODES * kernels.LOW_WIDTH, dtype=np.int32)
        self._link = np.empty(2 * FIRST_NODES * kernels.LINK_WIDTH, dtype=np.int32)
        self._opened = np.empty(4 * FIRST_NODES, dtype=np.int32)
        self._queue = np.empty(FIRST_NODES + 1, dtype=np.int32)
        self._bucket = np.full(BUCKETS, -1, dtype=np.int32)
        self.best: NDArray[np.int32] | None = None
        """int32, (ticks + 1, robots); the cells of the best plan so far."""
        self.cost: int | None = None
        """Its sum of costs."""
        self.improvements: list[tuple[int, int]] = []
        self.exhausted = False
        """Whether everything was searched."""

    @property
    def iterations(self) -> int:
        """How many configurations were tried."""
        return int(self._state[kernels.ITERATIONS])

    @property
    def nodes(self) -> int:
        """How many configurations are known."""
        return int(self._state[kernels.NODES])

    @property
    def loss(self) -> int | None:
        """The sum of loss of the plan that the search has come to: ticks of robots that do not rest on their goals."""
        node = int(self._state[kernels.GOAL])
        if node < 0:
            return None
        track = self._track_to(node)
        away = track != self._tables.goals
        return int(np.count_nonzero(away[1:] | away[:-1]))

    def go_on(self, most: int) -> int:
        """Search until the plan became better, or to iteration ``most``; the ending, FULL if memory is used up."""
        t, g, w = self._tables, self._tables.graph, self._work
        while True:
            ending = int(
                kernels.search(
                    g.edge, g.degree, g.passing, t.table, t.goals, t.distance, self._config, self._waited, self._order,
                    self._node, self._low, self._link, self._opened, self._bucket, self._queue, w.now, w.following,
                    w.best, *w.rest, self._state, self._swap, self._samples, most,
                )
            )  # fmt: skip
            if ending == kernels.FULL and self._grow():
                continue
            if ending == kernels.IMPROVED:
                self._keep()
            self.exhausted = self.exhausted or ending == kernels.EXHAUSTED
            return ending

    def _keep(self) -> None:
        """Keep the plan that leads to the goal if its sum of costs is the least so far."""
        track = self._track_to(int(self._state[kernels.GOAL]))
        cost = int(arrivals(track, self._tables.goals).sum())
        if self.cost is None or cost < self.cost:
            self.best, self.cost = track, cost
            self.improvements.append((self.iterations, cost))

    def _track_to(self, node: int) -> NDArray[np.int32]:
        """The configurations from the starts to a node, int32 (ticks + 1, robots)."""
        parents = self._node[kernels.PARENT : self.nodes * kernels.NODE_WIDTH : kernels.NODE_WIDTH].tolist()
        chain = []
        while node >= 0:
            chain.append(node)
            node = parents[node]
        robots = len(self._tables.goals)
        used = self._config[: self.nodes * robots].reshape(-1, robots)
        return used[np.array(chain[::-1], dtype=np.int64)]

    def nearest(self) -> tuple[NDArray[np.int32], ...]:
        """Paths to the configuration with the least sum of distances: how far it came without a plan."""
        if not self.nodes:
            return ()
        rows = self._node[: self.nodes * kernels.NODE_WIDTH].reshape(-1, kernels.NODE_WIDTH)
        track = self._track_to(int(rows[:, kernels.TO_GO].argmin()))
        return paths_of(track, self._tables.goals, self._tables.graph.places)

    def _grow(self) -> bool:
        """Make room where there is none; whether the limit allows it."""
        robots, state = len(self._tables.goals), self._state
        arrays = [
            name
            for name, full in (
                ("_config", (self.nodes + 1) * robots > len(self._config)),
                ("_low", (state[kernels.LOWS] + 10) * kernels.LOW_WIDTH > len(self._low)),
                ("_link", (state[kernels.LINK_COUNT] + 1) * kernels.LINK_WIDTH > len(self._link)),
                ("_opened", state[kernels.OPEN] + state[kernels.NODES] + 2 > len(self._opened)),
            )
            if full
        ]
        if "_config" in arrays:
            arrays += ["_waited", "_order", "_node"]
        more = self._bytes(arrays)
        if self._tables.mebibytes + (self._bytes(_GROWING) + more) // MIB > MEMORY.allowed:
            return False
        for name in arrays:
            setattr(self, name, grown(getattr(self, name)))
        if "_config" in arrays:
            self._queue = np.empty(len(self._node) // kernels.NODE_WIDTH + 1, dtype=np.int32)
        return True

    def _bytes(self, arrays: Iterable[str]) -> int:
        total = 0
        for name in arrays:
            total += int(getattr(self, name).nbytes)
        return total


def is_timed() -> bool:
    """Whether the call has a time limit."""
    scope = cancellation.watch()
    return scope is not None and scope.deadline < math.inf
