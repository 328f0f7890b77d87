"""The session of a graph search: the planner contract around one search."""

from __future__ import annotations

import time
from dataclasses import replace

from lampyris.field.layers import free_space, moves_for
from lampyris.kernels.search import LIMIT
from lampyris.model.change import Change
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planners._graph import GridSearch
from lampyris.planners._terrain_graph import TerrainSearch, search_of
from lampyris.planners._why_not import why_not
from lampyris.planners.base import Budget
from lampyris.planners.edits import edited


class GraphSession:
    """A session that searches anew at every call and remembers the map and where the robot was.

    Parameters
    ----------
    scene : what to plan in.
    name : the planner's name.
    informed : whether the search is led by a heuristic.
    """

    def __init__(self, scene: Scene, name: str, *, informed: bool) -> None:
        self._scene = scene
        self._name = name
        self._informed = informed
        self._moves = moves_for(scene)
        self._robot = scene.start
        self._free = free_space(scene)
        self._search = search_of(self._free, scene.grid.terrain, self._moves, informed=informed)

    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """The cheapest way from where the robot is to the goal.

        Obstacles count as blocked for this call, save on the robot's own cell and on the goal: it is
        covered now and will be free again. What is counted as expanded includes, on failure, the search
        that tells walls from obstacles and the size of the two regions; all of it together keeps within the
        budget.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        began = time.perf_counter()
        change = change or Change()
        self._take(change)
        made = self._answer(change, None if budget is None else budget.expansions)
        return replace(made, timing={"search_s": time.perf_counter() - began})

    def _take(self, change: Change) -> None:
        scene = edited(self._scene, change)
        if change.robot is not None:
            self._robot = (int(change.robot[0]), int(change.robot[1]))
        if scene is not self._scene:
            self._scene = scene
            self._moves = moves_for(scene)
            self._free = free_space(scene)
            terrain = scene.grid.terrain
            if terrain is None and isinstance(self._search, GridSearch):
                self._search.set_free(self._free)
            elif terrain is not None and isinstance(self._search, TerrainSearch):
                self._search.set_ground(self._free, terrain)
            else:
                self._search = search_of(self._free, terrain, self._moves, informed=self._informed)

    def _answer(self, change: Change, budget: int | None) -> Plan:
        start, goal = self._robot, self._scene.goal
        if not self._free[start[1], start[0]]:
            return Plan(Status.START_OCCUPIED, self._name)
        if not self._free[goal[1], goal[0]]:
            return Plan(Status.GOAL_OCCUPIED, self._name)
        contains = self._scene.grid.contains
        closed = sorted(c for c in change.obstacles if c not in (start, goal) and contains(c))
        answer = self._search.way(start, goal, budget, closed)
        if answer.cells is not None:
            path = path_of(answer.cells, self._moves, self._scene.grid.terrain)
            return Plan(
                Status.FOUND,
                self._name,
                path,
                iterations=1,
                expansions=answer.expansions,
                optimal_exact=None if change.obstacles else path.exact,
            )
        if answer.ending == LIMIT:
            return Plan(Status.LIMIT, self._name, iterations=1, expansions=answer.expansions)
        return why_not(
            self._name,
            self._search,
            start,
            goal,
            spent=answer.expansions,
            budget=budget,
            here=None if closed else answer.expansions,
        )
