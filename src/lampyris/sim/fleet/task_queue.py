"""Which robot has which task: those that are free get the oldest that is released."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from lampyris.model.fleet.lifelong import FleetTask
from lampyris.typing import Cell, Cells

Reach = Callable[[Cell, Cell], bool]
"""Whether there is a path from one cell to another."""


@dataclass(slots=True, eq=False)
class TaskQueue:
    """Tasks that are given, or drawn as needed where ``region`` is.

    Parameters
    ----------
    tasks : given, in any order.
    robots : how many.
    region : cells (x, y) that stops of random tasks are drawn from; None: only the given ones.
    rng : of these draws.
    """

    tasks: list[FleetTask]
    robots: int
    region: Cells | None
    rng: np.random.Generator
    robot: list[int] = field(init=False)
    assigned: list[int] = field(init=False)
    done: list[int] = field(init=False)
    stops: list[list[int]] = field(init=False)
    has: list[int] = field(init=False)
    _waiting: deque[int] = field(init=False)
    _own: list[deque[int]] = field(init=False)
    _next: int = field(init=False, default=0)

    def __post_init__(self) -> None:
        self.tasks = sorted(self.tasks, key=lambda one: one.release)
        k = len(self.tasks)
        self.robot, self.assigned, self.done = [-1] * k, [-1] * k, [-1] * k
        self.stops = [[] for _ in range(k)]
        self.has = [-1] * self.robots
        self._waiting = deque()
        self._own = [deque() for _ in range(self.robots)]

    def goal(self, robot: int) -> Cell | None:
        """Where a robot has to go now; None: it has no task."""
        k = self.has[robot]
        return None if k < 0 else self.tasks[k].stops[len(self.stops[k])]

    def visit(self, robot: int, cell: Cell, tick: int) -> bool:
        """Note that a robot is on a cell at a tick; whether that was its stop."""
        k = self.has[robot]
        if k < 0 or self.tasks[k].stops[len(self.stops[k])] != cell:
            return False
        self.stops[k].append(tick)
        if len(self.stops[k]) == len(self.tasks[k].stops):
            self.done[k] = tick
            self.has[robot] = -1
        return True

    def fail(self, robot: int) -> None:
        """A robot stops permanently: another one begins its task from the start."""
        k = self.has[robot]
        if k >= 0:
            self.has[robot] = -1
            self.robot[k] = self.assigned[k] = -1
            self.stops[k] = []
            if self.tasks[k].robot is None:
                self._waiting.appendleft(k)

    def assign(self, tick: int, places: Sequence[Cell], free: Sequence[int], reach: Reach) -> None:
        """Give tasks to robots without one: first their own, then the oldest of all to the nearest robot.

        Parameters
        ----------
        tick : now.
        places : the cell of every robot.
        free : the robots that have not failed.
        reach : which cells can be reached from which.
        """
        while self._next < len(self.tasks) and self.tasks[self._next].release <= tick:
            own = self.tasks[self._next].robot
            (self._waiting if own is None else self._own[own]).append(self._next)
            self._next += 1
        idle = [i for i in free if self.has[i] < 0]
        for i in list(idle):
            if self._own[i] and reach(places[i], self.tasks[self._own[i][0]].stops[0]):
                self._give(self._own[i].popleft(), i, tick)
                idle.remove(i)
        left: deque[int] = deque()
        while self._waiting and idle:
            k = self._waiting.popleft()
            x, y = self.tasks[k].stops[0]
            able = [i for i in idle if all(reach(places[i], stop) for stop in self.tasks[k].stops)]
            if not able:
                left.append(k)
                continue
            i = min(able, key=lambda i: (abs(places[i][0] - x) + abs(places[i][1] - y), i))
            self._give(k, i, tick)
            idle.remove(i)
        self._waiting = left + self._waiting
        if self.region is not None:
            for i in idle:
                self._draw(i, tick, places[i], reach)

    def _draw(self, robot: int, tick: int, place: Cell, reach: Reach) -> None:
        """A random task for a robot: any cell that it can reach, other than its own."""
        assert self.region is not None
        for _ in range(100):
            x, y = self.region[int(self.rng.integers(len(self.region)))].tolist()
            if (x, y) != place and reach(place, (x, y)):
                self.tasks.append(FleetTask(((x, y),), tick))
                self.robot.append(-1)
                self.assigned.append(-1)
                self.done.append(-1)
                self.stops.append([])
                self._next = len(self.tasks)
                self._give(len(self.tasks) - 1, robot, tick)
                return

    def _give(self, task: int, robot: int, tick: int) -> None:
        self.has[robot], self.robot[task], self.assigned[task] = task, robot, tick
