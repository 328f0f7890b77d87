"""A base for planners that are one search: the planner contract around a single method.

A planner derived from :class:`SearchPlanner` writes ``search``; map edits, blocked ends, moving obstacles, budgets,
cancellation and the exact cost of the path are handled here. A planner that reuses earlier searches writes a
session of its own instead (:class:`lampyris.planning.base.SessionBase`).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from lampyris._core import cancellation
from lampyris.model.change import Change
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.moves import Moves
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase, Traits
from lampyris.planning.edits import edited
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.session_limits import limited
from lampyris.typing import BoolGrid, ByteGrid, Cell


class _BudgetUsed(Exception):
    """The search has expanded as many cells as its budget allows."""


@dataclass(slots=True)
class Problem:
    """One search: where the robot may be, and from where to where.

    Parameters
    ----------
    free : cells that the robot's centre may enter, inflated by its radius, without moving obstacles; bool
        (height, width).
    moves : the steps and their exact integer costs.
    start, goal : cells (x, y), both free.
    terrain : values 0 to 252 of each cell, uint8 (height, width), or None.
    rng : the generator for every draw.
    limit : greatest number of expansions, or None.
    expansions : cells expanded so far.
    """

    free: BoolGrid
    moves: Moves
    start: Cell
    goal: Cell
    terrain: ByteGrid | None
    rng: np.random.Generator
    limit: int | None = None
    expansions: int = field(default=0, init=False)

    def count(self, expansions: int = 1) -> None:
        """Count expansions; the search ends here, with the status ``limit``, where the budget allows no more."""
        cancellation.checkpoint()
        if self.limit is not None and self.expansions + expansions > self.limit:
            self.expansions = self.limit
            raise _BudgetUsed
        self.expansions += expansions

    def expand(self, cell: Cell) -> Iterator[tuple[Cell, int]]:
        """Count one expansion, and give each cell that one step leads to, with the exact cost of that step.

        Over terrain a step costs its length times (63 + the value of the cell entered), in 63rds.
        """
        self.count()
        for (dx, dy), cost in zip(self.moves.offsets, self.moves.costs, strict=True):
            x, y = to = (cell[0] + dx, cell[1] + dy)
            if all(self._is_free(one) for one in (to, *self._passed(cell, dx, dy))):
                weight = self.moves.scale if self.terrain is None else TERRAIN_UNIT + int(self.terrain[y, x])
                yield to, cost // self.moves.scale * weight

    def path(self, parents: Mapping[Cell, Cell]) -> list[Cell]:
        """The cells from the start to the goal, given the cell from which each was reached."""
        cells = [self.goal]
        while cells[-1] != self.start:
            cells.append(parents[cells[-1]])
        return cells[::-1]

    def _is_free(self, cell: Cell) -> bool:
        (x, y), (height, width) = cell, self.free.shape
        return 0 <= x < width and 0 <= y < height and bool(self.free[y, x])

    def _passed(self, cell: Cell, dx: int, dy: int) -> list[Cell]:
        """Cells between the ends of a step that have to be free: those that its segment touches."""
        (x, y), sx, sy = cell, (dx > 0) - (dx < 0), (dy > 0) - (dy < 0)
        if dx == 0 or dy == 0 or (self.moves.corner_cutting and abs(dx) == abs(dy)):
            return []
        if abs(dx) == abs(dy):
            return [(x + sx, y), (x, y + sy)]
        straight = (x + sx, y) if abs(dx) > abs(dy) else (x, y + sy)
        return [(x + sx, y + sy), straight]


class SearchPlanner:
    """What a planner derives from that searches the whole map at each call: it writes :meth:`search`.

    The subclass is a frozen dataclass; its fields are the planner's settings. ``name``, ``traits``,
    ``summary`` and ``source`` are class variables, as :class:`lampyris.planning.base.Planner` says.
    CONTRIBUTING.md has an example.
    """

    name: ClassVar[str]
    traits: ClassVar[Traits]
    summary: ClassVar[str]
    source: ClassVar[str]

    def search(self, problem: Problem) -> list[Cell] | None:
        """The cells of a path from ``problem.start`` to ``problem.goal``, both included; None: there is none.

        Count what is expanded (``problem.expand`` or ``problem.count``); draw from ``problem.rng`` only.
        """
        raise NotImplementedError(f"{type(self).__name__}.search")

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> SearchSession:
        """Start a session; there is no per-iteration record."""
        return SearchSession(self, scene, rng)


class SearchSession(SessionBase):
    """A session that remembers the map and the robot, and runs a new search at every call."""

    def __init__(self, planner: SearchPlanner, scene: Scene, rng: np.random.Generator) -> None:
        self._planner, self._scene, self._robot, self._rng = planner, scene, scene.start, rng
        self._under_walls: dict[Cell, int] = {}

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`: nothing is kept between calls."""
        return self._planner.name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """A path from where the robot is to the goal. Obstacles are blocked for this call, but for the robot's
        own cell and the goal.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        change, name = change or Change(), self._planner.name
        self._scene = scene = edited(self._scene, change, self._under_walls)
        self._robot = robot = change.robot or self._robot
        static = free_space(scene)
        for (x, y), status in ((robot, Status.START_OCCUPIED), (scene.goal, Status.GOAL_OCCUPIED)):
            if not static[y, x]:
                return Plan(status, name)
        free = static.copy()
        for x, y in filter(scene.grid.contains, change.obstacles.difference((robot, scene.goal))):
            free[y, x] = False
        limit = None if budget is None else budget.expansions
        plan = self._search(free, limit)
        if plan.status is Status.NO_PATH and self._search(static, None):
            return Plan(Status.HEMMED_IN, name, expansions=plan.expansions)
        return plan

    def _search(self, free: BoolGrid, limit: int | None) -> Plan:
        scene, name, moves = self._scene, self._planner.name, moves_for(self._scene)
        problem = Problem(free, moves, self._robot, scene.goal, scene.grid.terrain, self._rng, limit)
        try:
            cells = self._planner.search(problem)
        except _BudgetUsed:
            return Plan(Status.LIMIT, name, expansions=problem.expansions)
        if cells is None:
            return Plan(Status.NO_PATH, name, expansions=problem.expansions)
        path = path_of(np.array(cells), moves, scene.grid.terrain)
        return Plan(Status.FOUND, name, path, iterations=1, expansions=problem.expansions)
