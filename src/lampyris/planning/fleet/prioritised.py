"""Prioritised planning: one robot after another by SIPP, earlier robots as known tracks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import Cancelled, checkpoint
from lampyris._core.settings import check_settings, under_name, whole
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.moves import MOVES
from lampyris.model.plan import Status
from lampyris.planning.fleet.base import FleetTraits, Progress
from lampyris.planning.fleet.distance_tables import tables_of
from lampyris.planning.fleet.pibt import is_stopped, unreachable
from lampyris.planning.fleet.work import generator
from lampyris.planning.spacetime.prediction import Forbidden
from lampyris.planning.spacetime.search import TimedSearch
from lampyris.typing import Cell, Cells

_Ints = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class PrioritisedSipp:
    """Prioritised planning: each robot takes the earliest arrival that the robots before it leave.

    Robots with long ways plan first. Where one finds no path, all is planned again with that robot first, or in a random
    order if it has been first before. It is incomplete: there are fleets that it never solves in any order, and many
    dense ones that it does not in practice. Its plans are often cheaper than those of PIBT.

    Parameters
    ----------
    restarts : orders that are tried after the first.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    restarts: int = whole(10, 0, 100_000)

    name: ClassVar[str] = "prioritised-sipp"
    traits: ClassVar[FleetTraits] = FleetTraits(stochastic=True)
    summary: ClassVar[str] = (
        "Prioritised SIPP: one robot after another, earlier ones as known tracks; incomplete."
    )
    source: ClassVar[str] = (
        "Erdmann, Lozano-Perez 1987; Silver 2005; SIPP: Phillips, Likhachev 2011. Ours: the restarts."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def plan(
        self, fleet: Fleet, seed: int, iterations: int | None = None, progress: Progress | None = None
    ) -> FleetPlan:
        """See :class:`lampyris.planning.fleet.base.FleetPlanner`; an iteration is the search of one robot."""
        tables = tables_of(fleet)
        if tables.cut_off is not None:
            return unreachable(self.name, tables.cut_off, seed)
        rng = generator(seed)
        robots = len(fleet.robots)
        order = np.argsort(-tables.distance, kind="stable")
        searches, expansions, most_planned = 0, 0, 0
        status = Status.ITERATION_LIMIT
        promoted: set[int] = set()
        try:
            for _ in range(self.restarts + 1):
                planned = _Planned(fleet)
                for k in order.tolist():
                    if iterations is not None and searches >= iterations:
                        status = Status.LIMIT
                        break
                    searches += 1
                    expansions += planned.add(k)
                    if k not in planned.paths:
                        rest = order[order != k]
                        if k in promoted:
                            promoted.clear()
                            rest = rng.permutation(rest)
                        promoted.add(k)
                        order = np.concatenate(([k], rest))
                        break
                    if progress is not None:
                        progress(searches, None)
                most_planned = max(most_planned, len(planned.paths))
                if len(planned.paths) == robots:
                    paths = tuple(planned.paths[k] for k in range(robots))
                    costs = sum(len(path) - 1 for path in paths)
                    return FleetPlan(
                        Status.FOUND, self.name, paths, tables.distance, searches, expansions,
                        ((searches, costs),), seed,
                    )  # fmt: skip
                if status is Status.LIMIT:
                    break
        except Cancelled:
            if is_stopped():
                raise
            status = Status.LIMIT
        detail = (
            f"No plan in the orders that were tried: at most {most_planned} of {robots} robots found a path. "
            "This planner is incomplete; lacam is not."
        )
        return FleetPlan(
            status, self.name, (), tables.distance, searches, expansions, seed=seed, detail=detail
        )


class _Planned:
    """The robots that have their paths, as what they forbid to those that come after."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._free = ~fleet.grid.blocked
        self._width = fleet.grid.width
        self._at: list[_Ints] = []
        self._steps: list[_Ints] = []
        self._forever: list[tuple[int, int]] = []
        self._last_visit: dict[int, int] = {}
        self.paths: dict[int, Cells] = {}
        """The robots planned so far, by index; int32 (ticks + 1, 2) each."""

    def add(self, k: int) -> int:
        """Plan robot ``k``; it is in :attr:`paths` if a path was found. How many states were expanded."""
        checkpoint()
        one = self._fleet.robots[k]
        flat = one.goal[1] * self._width + one.goal[0]
        if one.start == one.goal and self._last_visit.get(flat, -1) >= 0:
            return 0  # the search ends where it begins: this robot has to plan before those that pass it
        search = TimedSearch(self._free, MOVES["four-connected"], one.goal, None)
        found = search.by_intervals(search.timetable(self._forbidden(one.goal)), one.start, 0, None)
        if found.cells is not None and found.ticks is not None:
            self._keep(k, _every_tick(found.cells, found.ticks))
        return found.expansions

    def _forbidden(self, goal: Cell) -> Forbidden:
        """What the planned robots forbid; the goal until its last visitor has left, as the robot is to stay there."""
        flat = goal[1] * self._width + goal[0]
        last = self._last_visit.get(flat, -1)
        kept = np.stack((np.full(last + 1, flat), np.arange(last + 1)), axis=1).astype(np.int64)
        at = np.concatenate((*self._at, kept))
        steps = np.concatenate((np.zeros((0, 4), dtype=np.int64), *self._steps))
        forever = np.array(self._forever, dtype=np.int64).reshape(-1, 2)
        still = max((int(rows[:, 1].max()) for rows in (at, steps, forever) if len(rows)), default=0)
        return Forbidden(at, steps, forever, still, endless=False)

    def _keep(self, k: int, path: Cells) -> None:
        self.paths[k] = path
        cells = path.astype(np.int64)
        flat = cells[:, 1] * self._width + cells[:, 0]
        ticks = np.arange(len(cells), dtype=np.int64)
        self._at.append(np.stack((flat, ticks), axis=1))
        self._forever.append((int(flat[-1]), int(ticks[-1])))
        for cell, tick in zip(flat.tolist(), ticks.tolist(), strict=True):
            self._last_visit[cell] = max(tick, self._last_visit.get(cell, -1))
        hops = np.diff(cells, axis=0)
        moved = np.flatnonzero(hops.any(axis=1))
        # Who stands where the robot comes to must not come to where it was, in the same tick.
        self._steps.append(
            np.stack((flat[moved + 1], ticks[moved + 1], -hops[moved, 0], -hops[moved, 1]), axis=1)
        )


def _every_tick(cells: Cells, ticks: _Ints) -> Cells:
    """A cell for every tick, from cells and the ticks at which they are entered."""
    stays = np.diff(np.append(ticks, ticks[-1] + 1))
    return np.repeat(cells, stays, axis=0)
