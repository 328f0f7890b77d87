"""What a session of a swarm planner knows: the scene as it is now, where the robot is, and solved grounds."""

from __future__ import annotations

import math
from dataclasses import replace

from lampyris.model.change import Change
from lampyris.model.path import Path, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.edits import edited
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.graph.grid_graph import check_cells
from lampyris.planning.swarm.search_space import SearchSpace
from lampyris.typing import Cell, Cells

KEPT = 4
"""Grounds a session remembers besides the bare one: the same gates are met by every preview."""

NONE: frozenset[Cell] = frozenset()


class Memory:
    """A session's memory, and the parts of an answer that do not depend on the planner.

    Parameters
    ----------
    scene : what to plan in.
    name : the planner's name.

    Attributes
    ----------
    scene, robot : as they are now.
    occupied : cells under moving obstacles in this call, save the robot's own and the goal: what covers the
        goal now will have gone.
    spent : expansions of this call: cells settled in fields that were solved, steps and neighbours looked at.
    most : the budget of this call; infinity if there is none.
    """

    def __init__(self, scene: Scene, name: str) -> None:
        self.scene = scene
        self.name = name
        self.robot: Cell = scene.start
        self._under_walls: dict[Cell, int] = {}
        self.occupied = NONE
        self.spent = 0
        self.most = math.inf
        self._see()

    def _see(self) -> None:
        self._seen = False
        check_cells(self.scene.grid.blocked.size)
        self._moves = moves_for(self.scene)
        self._free = free_space(self.scene)
        self._grounds: dict[frozenset[Cell], SearchSpace] = {}
        self._seen = True

    def drop(self, anywhere: bool) -> str:
        """Let go of what a stopped call left half done; the planner's name."""
        self._seen = self._seen and not anywhere
        return self.name

    def begin(self, change: Change, budget: Budget | None) -> Plan | None:
        """Take in what is new; an answer at once if an end is occupied.

        Raises
        ------
        SceneError : the robot, or a cell said to have changed, is outside the map.
        """
        scene = edited(self.scene, change, self._under_walls)
        if change.robot is not None:
            self.robot = (int(change.robot[0]), int(change.robot[1]))
        if scene is not self.scene or not self._seen:
            self.scene = scene
            self._see()
        ends, contains = (self.robot, scene.goal), scene.grid.contains
        self.occupied = frozenset(c for c in change.obstacles if c not in ends and contains(c))
        self.spent = 0
        self.most = math.inf if budget is None or budget.expansions is None else budget.expansions
        for cell, status in zip(ends, (Status.START_OCCUPIED, Status.GOAL_OCCUPIED), strict=True):
            if not self._free[cell[1], cell[0]]:
                return Plan(status, self.name)
        return None

    @property
    def over(self) -> bool:
        """Whether the budget is exceeded."""
        return self.spent > self.most

    def ground(self, closed: frozenset[Cell] = NONE, *, counted: bool = True) -> SearchSpace:
        """The ground with these cells closed: one that is remembered, or solved now."""
        known = self._grounds.pop(closed, None)
        if known is None:
            known = SearchSpace(self.scene, self._moves, self._free, closed)
            if counted:
                self.spent += known.expansions
        self._grounds[closed] = known  # last used, last in line
        while len(self._grounds) > KEPT + 1:
            self._grounds.pop(next(key for key in self._grounds if key))
        return known

    def cut_off(self) -> Plan:
        """Why the exact field has no path: moving obstacles, or walls."""
        status, detail = Status.NO_PATH, ""
        if self.occupied:
            static = self.ground()
            if static.exact[self.robot[1], self.robot[0]] >= 0:
                status = Status.HEMMED_IN
                detail = "No path for now: walls leave a path, moving obstacles close it."
        return self.failed(Status.LIMIT) if self.over else self.failed(status, detail=detail)

    def failed(self, status: Status, *, iterations: int = 0, detail: str = "") -> Plan:
        """A plan without a path."""
        return Plan(status, self.name, iterations=iterations, expansions=self.spent, detail=detail)

    def found(self, cells: Cells, *, iterations: int, commit: int | None = None, detail: str = "") -> Plan:
        """A plan with its path, measured on the bare ground: gates open, nobody in the way.

        A ground that is solved for the measure alone is not counted.
        """
        path: Path = path_of(cells, self._moves, self.scene.grid.terrain)
        bare = self.ground(counted=False)
        to_go = bare.to_go[bare.flat(cells)]
        return replace(
            self.failed(Status.NO_PATH, iterations=iterations, detail=detail),
            status=Status.FOUND,
            path=path,
            commit=commit,
            optimal_exact=int(to_go[0]),
            sum_cost_to_go=math.fsum(self._moves.values(to_go).tolist()),
        )
