"""Lifelong fleets: plan a window, drive it, give tasks to robots that have arrived, plan the next (RHCR).

J. Li, A. Tinka, S. Kiesel, J. W. Durham, T. K. S. Kumar, S. Koenig, "Lifelong multi-agent path finding in large-scale
warehouses", AAAI 2021; PIBT without an end: Okumura et al., AIJ 310, 2022, section 5.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.fleet import lacam as lacam_kernels
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.grid import Grid
from lampyris.planning.fleet.distance_tables import FleetTables, tables_of
from lampyris.planning.fleet.lacam import LacamSearch
from lampyris.planning.fleet.pibt import PibtRun
from lampyris.sim.fleet.detours import nearest_free
from lampyris.sim.fleet.task_queue import TaskQueue
from lampyris.typing import Cell

PLANNERS = ("pibt", "lacam")
WINDOWS = {"pibt": 1, "lacam": 5}
"""Ticks driven before planning again, by planner."""
_CONFIGURATIONS = 20_000
"""Configurations that ``lacam`` tries for a window."""


@dataclass(slots=True, eq=False)
class Counts:
    """How often was planned, and how often PIBT had to help out."""

    windows: int = 0
    fallbacks: int = 0


class LifelongRun:
    """Robots that go on and on.

    Parameters
    ----------
    grid : the map.
    starts : of the robots.
    queue : their tasks.
    planner, window, seed : of each window: a name of PLANNERS, ticks driven, seed.
    faults : robot and tick at which it stops permanently.
    """

    def __init__(
        self, grid: Grid, starts: Sequence[Cell], queue: TaskQueue, planner: str, window: int, seed: int,
        faults: Sequence[tuple[int, int]],
    ) -> None:  # fmt: skip
        self._grid, self._queue, self._planner, self._window, self._seed = grid, queue, planner, window, seed
        self._faults = sorted(faults, key=lambda one: one[1])
        self.places: list[Cell] = list(starts)
        self.xy = [np.array(starts, dtype=np.int32)]
        self.counts = Counts()
        self._gone: list[int] = []
        self._rebuild()

    @property
    def tick(self) -> int:
        """The last tick driven."""
        return len(self.xy) - 1

    def go_on(self, most: int) -> None:
        """Plan and drive one window, to tick ``most`` at the farthest."""
        while self._faults and self._faults[0][1] <= self.tick:
            self._fail(self._faults.pop(0)[0])
        if not self._active:
            self.xy.append(self.xy[-1])
            return
        queue, active = self._queue, self._active
        for i in active:
            while queue.visit(i, self.places[i], self.tick):
                pass
        queue.assign(self.tick, self.places, active, self._reach)
        # A task whose first stop is where the robot stands.
        for i in active:
            while queue.visit(i, self.places[i], self.tick):
                pass
        until = min(most, self.tick + self._window)
        if self._faults:
            until = max(self.tick + 1, min(until, self._faults[0][1]))
        self.counts.windows += 1
        for cells in self._planned(until - self.tick):
            row = self.xy[-1].copy()
            row[active] = cells
            self.xy.append(row)
            for i in active:
                self.places[i] = (int(row[i, 0]), int(row[i, 1]))
                queue.visit(i, self.places[i], self.tick)

    def _planned(self, ticks: int) -> NDArray[np.int32]:
        """The cells of the active robots at the next ticks, int32 (ticks, robots, 2)."""
        places = self._tables.graph.places
        if self._planner == "lacam":
            self._head_for(self._apart())
            search = LacamSearch(self._tables, True, 1, self._seed)
            ending = search.go_on(_CONFIGURATIONS)
            if ending == lacam_kernels.IMPROVED and search.best is not None:
                track = search.best[1 : ticks + 1]
                if len(track) < ticks:
                    last = search.best[-1]
                    track = np.concatenate((track, np.tile(last, (ticks - len(track), 1))))
                self._tables.starts[:] = track[-1]
                return places[track]
            self.counts.fallbacks += 1
            self._pibt = PibtRun(self._tables, True, self._seed + self.tick)
        else:
            goals = [self._queue.goal(i) for i in self._active]
            self._head_for(
                [
                    self.places[i] if goal is None else goal
                    for i, goal in zip(self._active, goals, strict=True)
                ]
            )
        run = self._pibt
        begin = run.tick
        run.solved = False
        run.go_on(begin + ticks)
        track = run.track[begin + 1 :]
        if len(track) < ticks:
            track = np.concatenate((track, np.tile(run.track[-1], (ticks - len(track), 1))))
        if self._planner == "lacam":
            self._tables.starts[:] = track[-1]
        return places[track]

    def _apart(self) -> list[Cell]:
        """Goals of the active robots, no two the same: who is nearest has a goal that several want, others go near it."""
        wanted = {i: self._queue.goal(i) for i in self._active}
        order = sorted(
            self._active,
            key=lambda i: (
                wanted[i] is None,
                0 if wanted[i] is None else _steps(self.places[i], wanted[i]),
                i,
            ),
        )
        taken: dict[Cell, int] = {}
        for i in order:
            goal = wanted[i]
            if goal is not None:
                taken.setdefault(goal, i)
        mine = {i: goal for goal, i in taken.items()}
        goals: list[Cell] = [(-1, -1)] * len(self.places)
        for i, goal in mine.items():
            goals[i] = goal
        rest = {i: self.places[i] for i in order if i not in mine}
        held = set(taken)
        for i, place in rest.items():
            aim = wanted[i] if wanted[i] is not None else place
            assert aim is not None
            found = nearest_free(self._blocked, aim, held)
            held.add(found)
            goals[i] = found
        return [goals[i] for i in self._active]

    def _head_for(self, goals: list[Cell]) -> None:
        """Have the tables lead to these goals: the rows of those that changed are worked out again."""
        tables = self._tables
        numbers = tables.graph.numbers(tuple(goals))
        changed = np.flatnonzero(numbers != tables.goals)
        cells = tables.graph.cells
        rows = tables.table.reshape(-1, cells)
        known: dict[int, int] = {}
        todo = []
        for k in changed.tolist():
            if int(numbers[k]) not in known:
                known[int(numbers[k])] = k
                todo.append(k)
        if todo:
            # Starts are not used for rows; they only have to differ.
            spots = tables.graph.places[: len(todo)].tolist()
            agents = [Agent(tuple(spot), goals[k]) for spot, k in zip(spots, todo, strict=True)]
            made = tables_of(Fleet(self._walled, agents)).table.reshape(-1, cells)
            rows[todo] = made
        for k in changed.tolist():
            rows[k] = rows[known[int(numbers[k])]]
        tables.goals[:] = numbers
        here = tables.graph.numbers(tuple(self.places[i] for i in self._active))
        tables.distance[:] = rows[np.arange(len(goals)), here]

    def _fail(self, robot: int) -> None:
        """A robot becomes a wall."""
        self._queue.fail(robot)
        self._gone.append(robot)
        self._rebuild()
        for i in self._active:
            goal = self._queue.goal(i)
            if goal is not None and not self._reach(self.places[i], goal):
                self._queue.fail(i)

    def _rebuild(self) -> None:
        """The tables of the robots that are left, on the map with those that have stopped."""
        blocked = np.array(self._grid.blocked)
        for k in self._gone:
            blocked[self.places[k][1], self.places[k][0]] = True
        self._blocked = blocked
        self._walled = replace(self._grid, blocked=blocked)
        from scipy import ndimage  # bits: labels, whole numbers

        self._labels = ndimage.label(~blocked)[0]
        self._active = [i for i in range(len(self.places)) if i not in self._gone]
        if not self._active:
            return
        here = [self.places[i] for i in self._active]
        self._tables: FleetTables = tables_of(Fleet(self._walled, [Agent(cell, cell) for cell in here]))
        self._pibt = PibtRun(self._tables, True, self._seed)

    def _reach(self, a: Cell, b: Cell) -> bool:
        label = self._labels[b[1], b[0]]
        return bool(label != 0 and label == self._labels[a[1], a[0]])


def _steps(a: Cell, b: Cell | None) -> int:
    return 0 if b is None else abs(a[0] - b[0]) + abs(a[1] - b[1])


def drive_on(run: LifelongRun, ticks: int, progress: Callable[[int, int], None] | None) -> None:
    """Drive to a tick, window by window."""
    while run.tick < ticks:
        run.go_on(ticks)
        if progress is not None:
            progress(run.tick, ticks)
