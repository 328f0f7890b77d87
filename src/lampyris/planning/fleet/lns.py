"""Large neighbourhood search: the first plan of LaCAM*, then a few robots planned again at a time."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import Cancelled
from lampyris._core.limits import MEMORY
from lampyris._core.settings import check_settings, flag, under_name, whole
from lampyris.kernels.fleet import lns as kernels
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.planning.fleet.base import BOTH, FOUR, FleetTraits, Progress
from lampyris.planning.fleet.distance_tables import MIB, FleetTables, tables_of
from lampyris.planning.fleet.lacam import Lacam, is_timed
from lampyris.planning.fleet.pibt import is_stopped
from lampyris.planning.fleet.tracks import arrivals, paths_of
from lampyris.planning.fleet.work import generator

CHUNK = 200
"""Neighbourhoods between two calls of ``progress``, at most."""
STATES = 1 << 16
"""Cells and ticks that the search of one path may make."""


@dataclass(frozen=True, slots=True)
class Lns:
    """Large neighbourhood search: a plan of ``lacam``, whose paths are then planned again a few at a time.

    The paths of a late robot and of robots that block it are removed and planned again, one after another, among all
    others; the new paths are kept if their total cost is not greater. It is complete, as ``lacam`` is; plans become
    cheaper until the budget is used, much faster than by ``lacam`` alone for many robots. The makespan never grows.

    Parameters
    ----------
    neighbourhood : greatest number of robots that are planned again together.
    rounds : number of neighbourhoods without a budget.
    swap : as for :class:`lampyris.planning.fleet.pibt.Pibt`.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    neighbourhood: int = whole(16, 1, 1000, unit="robots")
    rounds: int = whole(2000, 1, 1_000_000_000)
    swap: bool = flag(True)

    name: ClassVar[str] = "lns"
    traits: ClassVar[FleetTraits] = FleetTraits(moves=BOTH, complete=True, anytime=True, stochastic=True)
    summary: ClassVar[str] = "LNS: a plan of lacam, made much cheaper until the budget is used."
    source: ClassVar[str] = (
        "Li, Chen, Harabor, Stuckey, Koenig, IJCAI 2021; SIPP: Phillips, Likhachev 2011; the first plan as lacam's. Ours: "
        "searches that weigh distances more at random, stacks of equal estimates, neighbourhoods of random size."
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
        """See :class:`lampyris.planning.fleet.base.FleetPlanner`; an iteration is one of ``lacam`` or a neighbourhood."""
        first = Lacam(swap=self.swap, improve=False)
        tables = tables_of(fleet, moves)
        found = first.plan_on(tables, seed, iterations, progress)
        found = replace(found, planner=self.name)
        if not found:
            return found
        rounds = self.rounds if iterations is None else iterations - found.iterations
        if iterations is None and is_timed():
            rounds = 2**60
        search = NeighbourhoodSearch.of(tables, found, self.neighbourhood, seed)
        if search is None:
            detail = (
                f"All robots reach their goals; no memory was left to improve the plan ({MEMORY.variable})."
            )
            return replace(found, detail=detail)
        detail = ""
        try:
            while search.rounds < rounds and search.go_on(min(rounds, search.rounds + CHUNK)):
                if progress is not None:
                    progress(found.iterations + search.rounds, search.cost)
        except Cancelled:
            if is_stopped():
                raise
            detail = "All robots reach their goals; stopped improving at the time limit."
        later = ((found.iterations + done, cost) for done, cost in search.improvements)
        return replace(
            found, paths=search.paths, iterations=found.iterations + search.rounds,
            expansions=found.expansions + search.states, improvements=(*found.improvements, *later), detail=detail,
        )  # fmt: skip


class NeighbourhoodSearch:
    """One search, which can be continued.

    Parameters
    ----------
    tables : the fleet.
    track : int32, (ticks + 1, robots); cells of a plan without conflicts.
    size : robots of a neighbourhood at most.
    seed : of the draws.
    """

    def __init__(self, tables: FleetTables, track: NDArray[np.int32], size: int, seed: int) -> None:
        self._tables, self._size, self._span = tables, size, len(track)
        robots, cells, span = track.shape[1], tables.graph.cells, len(track)
        kind = np.int16 if robots < np.iinfo(np.int16).max else np.int32
        self._held = np.full(span * cells, -1, dtype=kind)
        self._held.reshape(cells, span)[track, np.arange(span)[:, None]] = np.arange(robots)
        words = span // 64 + 1
        taken = np.ones((cells, 64 * words), dtype=np.bool_)
        taken[:, :span] = np.not_equal(self._held.reshape(cells, span), -1)
        self._busy = np.packbits(taken, axis=1, bitorder="little").view("<u8").astype(np.uint64).ravel()
        self._path = np.ascontiguousarray(track.T).ravel()
        self._length = arrivals(track, tables.goals).astype(np.int32)
        self._trial = np.empty(size * span, dtype=np.int32)
        self._arrival, self._member = np.empty(size, dtype=np.int32), np.empty(size, dtype=np.int32)
        self._chosen = np.zeros(robots, dtype=np.uint8)
        self._states = tuple(np.empty(STATES, dtype=np.int32) for _ in range(5))
        self._bucket = np.empty(2 * span + 2, dtype=np.int32)
        self._mark = np.zeros(2 * STATES, dtype=np.int64)
        self._marked = np.zeros(2 * STATES, dtype=np.int32)
        self._random = np.array([int(generator(seed).integers(1, 2**32))], dtype=np.int64)
        self._count = np.array([0, int(self._length.sum(dtype=np.int64)), 0, 0], dtype=np.int64)
        self._fell = np.zeros(2 * CHUNK, dtype=np.int64)
        self.improvements: list[tuple[int, int]] = []
        """Rounds after which the plan cost less, and the sum of costs then."""

    @classmethod
    def of(cls, tables: FleetTables, plan: FleetPlan, size: int, seed: int) -> NeighbourhoodSearch | None:
        """The search that begins with a plan; None if it would take more memory than is allowed."""
        span, robots = (plan.makespan or 0) + 1, len(plan.paths)
        needed = span * (tables.graph.cells * 4 + robots * 8)
        if tables.mebibytes + needed // MIB > MEMORY.allowed:
            return None
        ticks = np.arange(span)
        cells = np.stack([path[np.minimum(ticks, len(path) - 1)] for path in plan.paths], axis=1)
        return cls(tables, tables.graph.number[cells[..., 1], cells[..., 0]], size, seed)

    @property
    def rounds(self) -> int:
        """How many neighbourhoods were planned again."""
        return int(self._count[kernels.ROUNDS])

    @property
    def cost(self) -> int:
        """The sum of costs."""
        return int(self._count[kernels.COST])

    @property
    def states(self) -> int:
        """Cells and ticks that were looked at."""
        return int(self._count[kernels.STATES])

    @property
    def paths(self) -> tuple[NDArray[np.int32], ...]:
        """Each robot's cells (x, y)."""
        track = self._path.reshape(-1, self._span).T
        return paths_of(track, self._tables.goals, self._tables.graph.places)

    def go_on(self, most: int) -> bool:
        """Go on to round ``most``; whether the plan may still become cheaper."""
        t = self._tables
        full = True
        while full and self.rounds < most:
            try:
                kernels.improve(
                    t.graph.edge, t.graph.degree, t.table, t.goals, t.distance, self._held, self._busy, self._path,
                    self._length, self._span, self._trial, self._arrival, self._member, self._chosen, *self._states,
                    self._bucket, self._mark, self._marked, self._random, self._fell, self._count, self._size, most,
                )  # fmt: skip
            finally:
                many = int(self._count[kernels.FALLS])
                self.improvements += [
                    (done, cost) for done, cost in self._fell[: 2 * many].reshape(-1, 2).tolist()
                ]
                self._count[kernels.FALLS] = 0
            full = 2 * many == len(self._fell)
        return self.rounds >= most
