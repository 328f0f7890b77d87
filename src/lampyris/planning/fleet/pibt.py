"""PIBT: every robot decides its next cell by priority, tick by tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled
from lampyris._core.settings import check_settings, flag, under_name, whole
from lampyris.errors import plural
from lampyris.kernels.fleet import discs
from lampyris.kernels.fleet import pibt as kernels
from lampyris.model.fleet.fleet import FORGIVEN, Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.plan import Status
from lampyris.planning.fleet.base import BOTH, FOUR, FleetTraits, Progress
from lampyris.planning.fleet.distance_tables import FleetTables, tables_of
from lampyris.planning.fleet.tracks import arrivals, paths_of
from lampyris.planning.fleet.work import StepWork, generator

CHUNK = 1000
"""Ticks between two calls of ``progress``."""


@dataclass(frozen=True, slots=True)
class Pibt:
    """Priority inheritance with backtracking: the next cell of every robot, tick by tick.

    No robot ever collides, and a tick takes microseconds a robot. Where neighbouring free cells always lie on a common
    cycle, each robot reaches its goal in finitely many ticks (with ``swap=False``: robots that swap may go away from
    their goals), though not all need stand on theirs at once; such a plan ends as ``iteration-limit``. That is proved for
    four-connected moves of robots in single cells. With octile moves, where crossing steps are forbidden, and for discs larger
    than their cells, which push all robots that block them, the only guarantee is that there is no collision.

    Parameters
    ----------
    swap : whether two robots that meet where they cannot pass change places (the swap rule): in dead ends and narrow
        aisles many fleets are not solved without it.
    ticks : ticks after which it gives up.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    swap: bool = flag(True)
    ticks: int = whole(10_000, 1, 1_000_000, unit="ticks")

    name: ClassVar[str] = "pibt"
    traits: ClassVar[FleetTraits] = FleetTraits(moves=BOTH, reaches=True, stochastic=True, sizes=True)
    summary: ClassVar[str] = (
        "PIBT: priorities tick by tick; quickest, may never have all robots on their goals at once."
    )
    source: ClassVar[str] = (
        "Okumura, Machida, Defago, Tamura, AIJ 310, 2022; swap rule: Okumura, IJCAI 2023; hindrance: arXiv 2505.12623."
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
        """See :class:`lampyris.planning.fleet.base.FleetPlanner`; an iteration is a tick."""
        tables = tables_of(fleet, moves)
        if tables.cut_off is not None:
            return unreachable(self.name, tables.cut_off, seed)
        run = PibtRun(tables, self.swap, seed)
        most = self.ticks if iterations is None else min(self.ticks, iterations)
        limited = False
        try:
            while not run.solved and run.tick < most:
                run.go_on(min(most, run.tick + CHUNK))
                if progress is not None:
                    progress(run.tick, None)
        except Cancelled:
            if is_stopped():
                raise
            limited = True
        track = run.track
        home = int(np.count_nonzero(track[-1] == tables.goals))
        detail = ""
        improvements: tuple[tuple[int, int], ...] = ((run.tick, int(arrivals(track, tables.goals).sum())),)
        status = Status.FOUND
        if not run.solved:
            status = Status.LIMIT if limited else Status.ITERATION_LIMIT
            visited, improvements = int(np.count_nonzero(run.visited >= 0)), ()
            detail = (
                f"Stopped after {run.tick} ticks: {home} of {plural(len(fleet.robots), 'robot')} stand on their goals, "
                f"{visited} have been there."
            )
        return FleetPlan(
            status, self.name, paths_of(track, tables.goals, tables.graph.places), tables.distance, run.tick,
            run.tick, improvements, seed, detail=detail,
        )  # fmt: skip


class PibtRun:
    """Steps of PIBT that can be continued.

    Parameters
    ----------
    tables : the fleet.
    swap : whether the swap rule applies; it does not among discs larger than their cells.
    seed : of the tie-breaks.
    """

    def __init__(self, tables: FleetTables, swap: bool, seed: int) -> None:
        self._tables = tables
        self._swap = swap
        robots = len(tables.goals)
        self._work = StepWork(tables, generator(seed))
        self._discs = None if tables.is_small else _DiscWork(tables)
        self._order = np.argsort(-tables.distance, kind="stable").astype(np.int32)
        self._waited = (tables.distance > 0).astype(np.int32)
        self._track = np.empty(64 * robots, dtype=np.int32)
        self._track[:robots] = tables.starts
        self._tick = np.zeros(1, dtype=np.int64)
        self.visited = np.full(robots, -1, dtype=np.int32)
        """int32, (robots,); the first tick at which each robot was on its goal, or -1."""
        self.solved = False
        """Whether all are on their goals."""

    @property
    def tick(self) -> int:
        """The last tick."""
        return int(self._tick[0])

    @property
    def track(self) -> np.ndarray[tuple[int, int], np.dtype[np.int32]]:
        """int32, (ticks + 1, robots); the number of each robot's cell."""
        robots = len(self._tables.goals)
        return self._track[: (self.tick + 1) * robots].reshape(-1, robots)

    def go_on(self, most: int) -> None:
        """Go on until all robots are on their goals, or to tick ``most``."""
        t, w, d = self._tables, self._work, self._discs
        while True:
            if d is None:
                ending = kernels.run(
                    t.graph.edge, t.graph.degree, t.graph.passing, t.table, t.goals, t.distance, self._order, self._waited, w.now,
                    w.following, *w.rest, self._swap, self._track, self.visited, self._tick, most,
                )  # fmt: skip
            else:
                ending = discs.run(
                    t.graph.edge, t.graph.degree, d.xy, t.table, t.never, t.goals, t.distance, d.kind, d.need, d.far,
                    d.width, d.height, self._order, self._waited, w.now, w.following, d.occupied, w.choice, d.many,
                    w.key, w.turn, d.mark, d.decided, w.stack, w.random, self._track, self.visited, self._tick, most,
                )  # fmt: skip
            if ending != kernels.FULL:
                self.solved = bool(ending == kernels.SOLVED)
                return
            self._track = grown(self._track)


class _DiscWork:
    """Arrays of :func:`lampyris.kernels.fleet.discs.run` beyond those of single cells."""

    def __init__(self, tables: FleetTables) -> None:
        robots = len(tables.goals)
        self.height, self.width = tables.graph.number.shape
        self.xy = np.ascontiguousarray(tables.graph.places.ravel())
        sizes, kind = np.unique(tables.radii, return_inverse=True)
        self.kind = kind.astype(np.int32)
        distance = sizes[:, None] + sizes[None, :]
        self.need = np.ascontiguousarray((distance * distance * (1.0 - FORGIVEN)).ravel())
        # Both may come nearer by a step in the tick, along both axes.
        self.far = (np.floor(distance.max(axis=1)) + 3).astype(np.int32)
        self.occupied = np.full(self.width * self.height, -1, dtype=np.int32)
        self.many, self.mark, self.decided = (np.zeros(robots, dtype=np.int32) for _ in range(3))


def grown(array: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
    """A copy with twice the room."""
    made = np.empty(2 * len(array), dtype=array.dtype)
    made[: len(array)] = array
    return made


def unreachable(planner: str, robot: int, seed: int) -> FleetPlan:
    """The answer where a robot has no path even on the bare map."""
    return FleetPlan(
        Status.NO_PATH, planner, seed=seed, detail=f"No plan: walls separate robot {robot} from its goal."
    )


def is_stopped() -> bool:
    """Whether the call was cancelled by someone, as opposed to its time having run out."""
    scope = cancellation.watch()
    return scope is None or any(stop.is_set for stop in scope.stops)
