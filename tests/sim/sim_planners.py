"""Planners for tests of the simulator: a breadth-first one, and scripted ones that do as they are told."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar

import numpy as np

from lampyris.model.grid import Grid
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Traits


def found(cells, scene, **more):
    return Plan(
        Status.FOUND, "test", path_of(np.array(cells, dtype=np.int32), scene.moves), iterations=1, **more
    )


@dataclass(frozen=True)
class Breadth:
    """Breadth-first search by single steps, obstacles as walls. It knows nothing of the robot's radius."""

    name: ClassVar[str] = "test-breadth"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = "for tests"
    source: ClassVar[str] = "for tests"

    def open(self, scene: Scene, rng: Any, *, record: bool = False) -> Any:
        return _BreadthSession(scene)


@dataclass
class _BreadthSession:
    scene: Scene

    def walls(self, change):
        """The map as it is now."""
        if change is not None and (change.blocked or change.freed):
            walls = self.scene.grid.blocked.copy()
            for cells, wall in ((change.freed, False), (change.blocked, True)):
                for x, y in cells:
                    walls[y, x] = wall
            self.scene = replace(self.scene, grid=replace(self.scene.grid, blocked=walls), edits=())
        return self.scene.grid.blocked

    def plan(self, change=None, budget=None):
        blocked, s = self.walls(change), self.scene
        start = s.start if change is None or change.robot is None else change.robot
        shut = frozenset() if change is None else change.obstacles
        if blocked[start[1], start[0]]:
            return Plan(Status.START_OCCUPIED, "test")
        if blocked[s.goal[1], s.goal[0]]:
            return Plan(Status.GOAL_OCCUPIED, "test")

        def free(x, y):
            return s.grid.contains((x, y)) and not blocked[y, x] and (x, y) not in shut

        came = {start: start}
        line = deque([start])
        while line and s.goal not in came:
            x, y = line.popleft()
            for dx, dy in ((0, -1), (-1, 0), (1, 0), (0, 1), (-1, -1), (1, -1), (-1, 1), (1, 1)):
                to = (x + dx, y + dy)
                if to in came or not free(*to) or (dx, dy) not in s.moves.offsets:
                    continue
                if dx and dy and not s.moves.corner_cutting and not (free(x + dx, y) and free(x, y + dy)):
                    continue
                came[to] = (x, y)
                line.append(to)
        if s.goal not in came:
            return Plan(Status.HEMMED_IN if shut else Status.NO_PATH, "test")
        way = [s.goal]
        while way[-1] != start:
            way.append(came[way[-1]])
        return found(way[::-1], s)


@dataclass(frozen=True)
class Scripted:
    """Answers from a list, the last for ever; each a function of (scene, change). Keeps what it was told."""

    answers: tuple[Any, ...]
    told: list[Any] = field(default_factory=list)
    drawn: list[float] = field(default_factory=list)
    name: ClassVar[str] = "test-scripted"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = "for tests"
    source: ClassVar[str] = "for tests"

    def open(self, scene: Scene, rng: Any, *, record: bool = False) -> Any:
        self.drawn.append(float(rng.random()))
        return _ScriptedSession(self, scene)


@dataclass
class _ScriptedSession:
    planner: Scripted
    scene: Scene

    def plan(self, change=None, budget=None):
        p = self.planner
        p.told.append(change)
        return p.answers[min(len(p.told), len(p.answers)) - 1](self.scene, change)


def drive(cells, **more):
    """Answers with the rest of a fixed way from where the robot is, whatever stands on it."""

    def answer(scene, change):
        return found(cells[cells.index(change.robot) :], scene, **more)

    return answer


def fail(status=Status.HEMMED_IN):
    return lambda scene, change: Plan(status, "test")


def grid_of(*rows: str) -> Grid:
    """A grid from rows of text: # is a wall."""
    return Grid(np.array([[c == "#" for c in row] for row in rows]))


def row(y, a, b):
    """The cells of row y from column a to column b."""
    return [(x, y) for x in range(a, b + 1)]
