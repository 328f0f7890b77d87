"""The session of an incremental search: the planner contract around one search that is never started again."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from lampyris._core.values import completed
from lampyris.kernels import loading
from lampyris.model.change import Change
from lampyris.model.moves import Moves
from lampyris.model.path import Path, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase
from lampyris.planning.field.layers import moves_for
from lampyris.planning.graph.grid_graph import GridSearch
from lampyris.planning.graph.no_path_reason import why_not
from lampyris.planning.incremental.search import LIMIT, IncrementalSearch, SearchMap
from lampyris.planning.living_map import LivingMap
from lampyris.planning.session_limits import limited
from lampyris.typing import Cell, Cells

Make = Callable[[SearchMap], IncrementalSearch]
"""From a map to a search over it that knows nothing yet."""


class IncrementalSession(SessionBase):
    """A session whose search goes on from what it knew before every Change.

    Moving obstacles are cells blocked for one call, save on the robot's own cell and on the goal: what
    differs from the call before is an edit like any other. The path is read off by the local parent rule, so
    all four planners drive the same way, and that of the field.

    Memory: some 45 bytes a cell, from the first moment on.

    Parameters
    ----------
    scene : what to plan in.
    name : the planner's name.
    make : the search.
    informed : whether it is led by the metric of the open plane.
    """

    def __init__(self, scene: Scene, name: str, make: Make, *, informed: bool) -> None:
        self._scene = scene
        self._name = name
        self._make = make
        self._informed = informed
        self._robot = scene.start
        self._map = LivingMap(scene)
        self._covered: frozenset[Cell] = frozenset()
        self._begin(moves_for(scene))

    def _begin(self, moves: Moves) -> None:
        """Start a search over the map as it is."""
        self._moves = moves
        ends = (self._scene.goal, self._robot)
        self._search = self._make(
            SearchMap(self._map.free, self._map.terrain, moves, *ends, informed=self._informed)
        )
        self._torn = False

    def expansion_order(self) -> Cells | None:
        """See :class:`lampyris.planning.graph.expanded.Recordable`: of a search that knows nothing yet."""
        ends = (self._robot, self._scene.goal)
        if not all(self._map.free[y, x] for x, y in ends):
            return np.zeros((0, 2), dtype=np.int32)
        fresh = SearchMap(
            self._map.free, self._map.terrain, self._moves, ends[1], ends[0], informed=self._informed
        )
        return self._make(fresh).order()

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`. A search that was stopped goes on from there."""
        self._torn = self._torn or anywhere
        return self._name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """The cheapest path from where the robot is to the goal; see
        :meth:`lampyris.planning.base.Session.plan`.

        What is counted as expanded is what this call expanded, which is little where little changed; on
        failure, also the searches that tell walls from obstacles and the size of the two regions. After
        ``limit`` the next call continues where this one stopped.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        SettingError : a terrain value out of its range.
        """
        began = loading.wall()
        change = Change() if change is None else change
        self._take(change)
        made = self._answer(bool(change.obstacles), None if budget is None else budget.expansions)
        return completed(made, timing={"search_s": loading.wall() - began})

    def _take(self, change: Change) -> None:
        """Hand on to the search where the robot is and which cells are other than before."""
        altered = self._map.take(change)
        torn, self._torn = self._torn, True  # until this is over
        moved = change.robot is not None and change.robot != self._robot
        if change.robot is not None:
            self._robot = (int(change.robot[0]), int(change.robot[1]))
        unit = self._map.terrain is not None and self._moves.scale == 1
        if torn or unit:
            # A call was stopped in here; or the first terrain on this map: every cost has another unit now.
            self._covered = frozenset()
            altered = []
            self._begin(self._moves.weighed() if unit else self._moves)
            self._torn = True
        elif moved:
            self._search.move(self._robot)
        height, width = self._map.free.shape
        outside = [c for c in change.obstacles if not (0 <= c[0] < width and 0 <= c[1] < height)]
        covered = frozenset(change.obstacles).difference(outside, (self._robot, self._scene.goal))
        cells = sorted(covered ^ self._covered)
        if altered:
            cells = list(dict.fromkeys(altered + cells))
        new, self._covered = not (altered or self._covered), covered
        if cells:
            x, y = np.array(cells, dtype=np.int32).T
            free, terrain = self._map.free[y, x].view(np.uint8), self._map.terrain
            if new:
                free[:] = 0
            elif covered:
                free[[c in covered for c in cells]] = 0
            weights = np.zeros(len(cells), np.uint8) if terrain is None else terrain[y, x]
            self._search.edit(self._search.ground.indices(x, y), free, weights)
        self._torn = False

    def _answer(self, among_obstacles: bool, budget: int | None) -> Plan:
        (x, y), (u, v) = self._robot, self._scene.goal
        if not self._map.free[y, x]:
            return Plan(Status.START_OCCUPIED, self._name)
        if not self._map.free[v, u]:
            return Plan(Status.GOAL_OCCUPIED, self._name)
        ending, spent = self._search.run(budget)
        if ending == LIMIT:
            return Plan(Status.LIMIT, self._name, iterations=1, expansions=spent)
        cells = self._search.ground.extract_path(self._search.cost)
        if not len(cells):
            # Which cells hang together is the same whatever they weigh.
            finder = GridSearch(self._map.free, self._moves.plain(), informed=False)
            return why_not(self._name, finder, self._robot, (u, v), spent=spent, budget=budget, here=None)
        path = self._path(cells)
        return Plan(
            Status.FOUND,
            self._name,
            path,
            iterations=1,
            expansions=spent,
            optimal_exact=None if among_obstacles else path.exact,
        )

    def _path(self, cells: Cells) -> Path:
        """The path, in the costs of the map: in 63rds only where some cell has terrain now."""
        if self._map.has_terrain:
            return path_of(cells, self._moves, self._map.terrain)
        return path_of(cells, self._moves.plain())
