"""What sessions of planners of poses have in common: the robot, the map, and what changes between two calls."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Generic, TypeVar

import numpy as np

from lampyris.model.change import Change
from lampyris.model.path import Pose
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase
from lampyris.planning.edits import edited
from lampyris.planning.graph.expanded import most_poses
from lampyris.planning.lattice.poses import difference, distance
from lampyris.planning.session_limits import limited
from lampyris.typing import Cell, Cells

M = TypeVar("M")
"""The memory of searches on one map."""
EXACT = 1e-6
"""Cells, and radians, by which a path that is driven may begin beside the robot's pose."""
NEAR = 1e-3
"""Cells, and radians, by which an end may miss the pose that was asked for without a note."""


class PoseSession(SessionBase, Generic[M]):
    """Remembers the map, the robot, the heuristic of the goal and the memory of the last search.

    Parameters
    ----------
    name : the planner's.
    scene : what to plan in.
    """

    def __init__(self, name: str, scene: Scene) -> None:
        self._name, self._scene = name, scene
        self._pose: Pose | None = scene.start_pose
        self._robot = scene.start
        self._time_s = 0.0
        self._under_walls: dict[Cell, int] = {}
        self._search: M | None = None
        self._heuristic: tuple[object, np.ndarray] | None = None

    @abstractmethod
    def _new_search(self, obstacles: Iterable[Cell] = ()) -> M:
        """The memory of a search on the map as it is now, with obstacles."""

    @abstractmethod
    def _answer(self, search: M, budget: Budget | None) -> Plan:
        """Search from where the robot is to the goal."""

    def _noted(self, search: M) -> list[Cells] | None:
        """Have a search record the cells of the poses that it expands, first come first; None: it cannot."""
        return None

    def expansion_order(self) -> Cells | None:
        """See :class:`lampyris.planning.graph.expanded.Recordable`: the cells of the poses, from where the robot is now."""
        search = self._new_search()
        parts = self._noted(search)
        if parts is None:
            return None
        # The compiled search says first whether the plain one would take too long.
        most = most_poses(self._name)
        counted = self._answer(self._new_search(), Budget(expansions=most + 1))
        if counted.status is Status.LIMIT or counted.expansions > most:
            return None
        self._answer(search, None)
        return np.concatenate((np.zeros((0, 2), dtype=np.int32), *parts))

    def _judged_by(self) -> Mapping[str, float]:
        """Attributes by which the referee judges an answer of the planner."""
        return {}

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`."""
        self._search, self._heuristic = None, None
        return self._name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """Poses from where the robot is to the goal.

        The path begins at ``change.pose``, or at the planner's pose nearest to it. A change that moves the robot to a
        cell gives no heading: any heading will do there.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        change = change or Change()
        scene = edited(self._scene, change, self._under_walls)
        if scene is not self._scene:
            self._forget_map()
            self._scene = scene
        self._time_s = change.time_s
        if change.robot is not None:
            self._robot, self._pose = change.robot, None
        if change.pose is not None:
            self._robot, self._pose = scene.grid.to_cell(*change.pose[:2]), change.pose
        ends = (self._robot, scene.goal)  # covered now, free again later
        obstacles = frozenset(filter(scene.grid.contains, change.obstacles.difference(ends)))
        self._search = self._search_among(obstacles)
        try:
            plan = self._answer(self._search, budget)
        finally:
            if obstacles:
                self._forget_map()
        if plan.status is Status.NO_PATH and obstacles:
            free = self._new_search()
            if self._answer(free, None).status is Status.FOUND:
                plan = Plan(Status.HEMMED_IN, self._name, expansions=plan.expansions)
        return plan if plan.pose_path is not None else replace(plan, attributes=self._judged_by())

    def _forget_map(self) -> None:
        """The map is no longer what the search has."""
        self._search, self._heuristic = None, None

    def _search_among(self, obstacles: frozenset[Cell]) -> M:
        """The memory of searches on the map with obstacles: the last one's, where it will do."""
        if obstacles or self._search is None:
            self._forget_map()
            return self._new_search(obstacles)
        return self._search

    def _note(self, what: str, pose: np.ndarray, which: str) -> str:
        """A note where an end of the path is not the pose that was asked for, but ``which``."""
        asked = self._pose if what == "start" else self._scene.goal_pose
        if asked is None:
            return ""
        away = distance((float(pose[0]), float(pose[1])), asked[:2])
        turned = abs(difference(float(pose[2]), asked[2]))
        if away < NEAR * self._scene.grid.resolution and turned < NEAR:
            return ""
        return f"the {what} of the path is {which}, {round(away, 6):.3g} m and {math.degrees(turned):.3g} degrees away"
