"""Prioritised planning: one robot after another by SIPP, earlier robots as known tracks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris._core.cancellation import Cancelled, checkpoint
from lampyris._core.settings import check_settings, under_name, whole
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Status
from lampyris.planning.field.layers import free_cells
from lampyris.planning.fleet.base import BOTH, FOUR, FleetTraits, Progress
from lampyris.planning.fleet.distance_tables import FleetTables, by_size, tables_of
from lampyris.planning.fleet.pibt import is_stopped, unreachable
from lampyris.planning.fleet.separation import cells_kept, cells_passed, steps_barred
from lampyris.planning.fleet.work import generator
from lampyris.planning.spacetime.prediction import Forbidden
from lampyris.planning.spacetime.search import TimedSearch
from lampyris.typing import BoolGrid, Cell, Cells

_Ints = NDArray[np.int64]
TRIES = 100
"""Searches of one robot, each with more steps barred."""
BARRED = 64
"""Ticks for which a step beside a robot that stays is barred at once."""


@dataclass(frozen=True, slots=True)
class PrioritisedSipp:
    """Prioritised planning: robots plan one after another, each with the earliest arrival among those before it.

    Robots with long paths plan first. If a robot finds no path, all plan again with that robot first, or in a random
    order if it has been first before. It is incomplete: some fleets cannot be solved in any order, and many
    dense ones are not solved in practice. Its plans are often cheaper than those of PIBT.

    Robots may be discs of any size: two are kept apart by the closest approach of their steps, and from walls by their radii.
    Where one passes another that waits beside its diagonal step, the other must not come there in that tick either.

    Parameters
    ----------
    restarts : orders that are tried after the first.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    restarts: int = whole(10, 0, 100_000)

    name: ClassVar[str] = "prioritised-sipp"
    traits: ClassVar[FleetTraits] = FleetTraits(moves=BOTH, stochastic=True, sizes=True)
    summary: ClassVar[str] = (
        "Prioritised SIPP: one robot after another, earlier ones as known tracks; incomplete."
    )
    source: ClassVar[str] = (
        "Erdmann, Lozano-Perez 1987; Silver 2005; SIPP: Phillips, Likhachev 2011. Ours: the restarts."
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
        """See :class:`lampyris.planning.fleet.base.FleetPlanner`; an iteration is the search of one robot."""
        tables = tables_of(fleet, moves)
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
                planned = _Planned(fleet, tables, moves)
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

    def __init__(self, fleet: Fleet, tables: FleetTables, moves: str) -> None:
        self._fleet, self._moves = fleet, moves
        self._radii = tables.radii.tolist()
        self._free: dict[int, BoolGrid] = {}
        self._kind: dict[int, int] = {}
        for kind, (radius, members) in enumerate(by_size(fleet)):
            self._free[kind] = free_cells(fleet.grid, radius)
            self._kind |= dict.fromkeys(members.tolist(), kind)
        self._laid: dict[float, _Laid] = {}
        self.paths: dict[int, Cells] = {}
        """The robots planned so far, by index; int32 (ticks + 1, 2) each."""

    def add(self, k: int) -> int:
        """Plan robot ``k``; it is in :attr:`paths` if a path was found. How many states were expanded."""
        checkpoint()
        one = self._fleet.robots[k]
        laid = self._laid.setdefault(self._radii[k], _Laid(self._fleet.grid, self._moves))
        for j in list(self.paths)[laid.count :]:
            laid.add(self.paths[j], self._radii[j] + self._radii[k])
        if one.start == one.goal and laid.last_visit(one.goal) >= 0:
            return 0  # the search ends where it begins: this robot has to plan before those that pass it
        search = TimedSearch(self._free[self._kind[k]], MOVES[self._moves], one.goal, None)
        expansions = 0
        for _ in range(TRIES):
            found = search.by_intervals(search.timetable(laid.forbidden(one.goal)), one.start, 0, None)
            expansions += found.expansions
            if found.cells is None or found.ticks is None:
                break
            path = _every_tick(found.cells, found.ticks)
            if not laid.bar_passing(path):
                self.paths[k] = path
                break
        return expansions


class _Laid:
    """What paths forbid robots of one size."""

    def __init__(self, grid: Grid, moves: str) -> None:
        self._width, self._height, self._moves = grid.width, grid.height, moves
        self._at: list[_Ints] = []
        self._steps: list[_Ints] = []
        self._forever: list[_Ints] = []
        self._last_visit = np.full(grid.blocked.size, -1, dtype=np.int64)
        self._resting: list[tuple[_Ints, int, _Ints]] = []  # cell, since, steps that pass too near
        self.count = 0
        """Paths that were added."""

    def add(self, path: Cells, distance: float) -> None:
        """Add the path of a robot to which this distance is kept, in cells."""
        self.count += 1
        cells = path.astype(np.int64)
        ticks = np.arange(len(cells), dtype=np.int64)
        hops = np.diff(cells, axis=0)
        kept = cells_kept(distance)
        self._note(cells, ticks, kept)
        self._forever.append(self._flat(cells[-1] + kept, np.full(len(kept), ticks[-1])))
        passing = steps_barred(distance, 0, 0, self._moves)
        if len(passing):
            self._resting.append((cells[-1], int(ticks[-1]), passing))
        for dx, dy in np.unique(hops, axis=0).tolist():
            t = np.flatnonzero((hops[:, 0] == dx) & (hops[:, 1] == dy))
            # Who waits where the robot passes is forbidden the tick of its arrival.
            self._note(cells[t], ticks[t + 1], cells_passed(distance, dx, dy))
            barred = steps_barred(distance, dx, dy, self._moves)
            n = len(barred)
            out = (cells[t][:, None, :] + barred[None, :, :2]).reshape(-1, 2)
            rows = self._flat(out, np.repeat(ticks[t + 1], n), np.tile(barred[:, 2:], (len(t), 1)))
            self._steps.append(rows)

    def bar_passing(self, path: Cells) -> bool:
        """Bar the steps by which a path passes too near a robot that stays at its goal; whether there are any.

        Only diagonal steps can, where their ends are far enough. They would be barred forever, so it is done as they come up.
        """
        cells = path.astype(np.int64)
        broken = []
        for cell, since, passing in self._resting:
            known = {tuple(row) for row in passing.tolist()}
            near = np.flatnonzero((np.abs(cells[:-1] - cell) <= np.abs(passing).max()).all(axis=1))
            for t in near[near >= since].tolist():
                row = (*(cells[t] - cell).tolist(), *(cells[t + 1] - cells[t]).tolist())
                if row in known:
                    ticks = np.arange(t + 1, t + 1 + BARRED, dtype=np.int64)
                    flat = np.full(BARRED, cells[t, 1] * self._width + cells[t, 0])
                    step = [np.full(BARRED, d) for d in row[2:]]
                    broken.append(np.column_stack((flat, ticks, *step)))
        self._steps += broken
        return bool(broken)

    def _note(self, cells: _Ints, ticks: _Ints, offsets: _Ints) -> None:
        if not len(offsets):
            return
        out = (cells[:, None, :] + offsets[None, :, :]).reshape(-1, 2)
        rows = self._flat(out, np.repeat(ticks, len(offsets)))
        self._at.append(rows)
        np.maximum.at(self._last_visit, rows[:, 0], rows[:, 1])

    def _flat(self, cells: _Ints, *columns: _Ints) -> _Ints:
        """Rows of cells that are on the map, as numbers, and their columns."""
        x, y = cells[:, 0], cells[:, 1]
        inside = (x >= 0) & (x < self._width) & (y >= 0) & (y < self._height)
        rows: _Ints = np.column_stack((y * self._width + x, *columns))[inside]
        return rows

    def last_visit(self, cell: Cell) -> int:
        """The last tick at which a robot must not be on a cell, of those that are not forever; -1: none."""
        return int(self._last_visit[cell[1] * self._width + cell[0]])

    def forbidden(self, goal: Cell) -> Forbidden:
        """All of it; the goal until its last visitor has left, as the robot is to stay there."""
        last = self.last_visit(goal)
        flat = goal[1] * self._width + goal[0]
        kept = np.stack((np.full(last + 1, flat), np.arange(last + 1)), axis=1).astype(np.int64)
        at = np.concatenate((*self._at, kept))
        steps = np.concatenate((np.zeros((0, 4), dtype=np.int64), *self._steps))
        forever = np.concatenate((np.zeros((0, 2), dtype=np.int64), *self._forever))
        still = max((int(rows[:, 1].max()) for rows in (at, steps, forever) if len(rows)), default=0)
        return Forbidden(at, steps, forever, still)


def _every_tick(cells: Cells, ticks: _Ints) -> Cells:
    """A cell for every tick, from cells and the ticks at which they are entered."""
    stays = np.diff(np.append(ticks, ticks[-1] + 1))
    return np.repeat(cells, index_array(stays), axis=0)
