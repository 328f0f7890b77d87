"""The session of a graph search: the planner contract around one search."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np

from lampyris.kernels import loading
from lampyris.kernels.graph.search import LIMIT
from lampyris.model.change import Change
from lampyris.model.moves import Moves
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase
from lampyris.planning.edits import edited
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.graph.grid_graph import GridSearch, SearchResult
from lampyris.planning.graph.no_path_reason import why_not
from lampyris.planning.graph.terrain_graph import TerrainSearch, search_of
from lampyris.planning.session_limits import limited
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells


class PathSearch(Protocol):
    """A search over one map, asked as often as one likes."""

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if this search is not made for it."""
        ...

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """A path between two free cells while some cells (of the map) are closed."""
        ...


@runtime_checkable
class OrderedSearch(Protocol):
    """A search that can say in which order it expands cells."""

    def order(self, start: Cell, goal: Cell) -> Cells | None:
        """The cells expanded between two free cells, first come first, int32 (n, 2); None: it would take too long."""
        ...


Maker = Callable[[BoolGrid, ByteGrid | None, Moves], PathSearch]
"""Makes the search for a free space, its terrain (or None) and the moves on it."""


class GraphSession(SessionBase):
    """A session that runs a new search at every call and remembers the map and where the robot was.

    Parameters
    ----------
    scene : what to plan in.
    name : the planner's name.
    make : makes the search.
    optimal : whether a path of that search is a cheapest one.
    """

    def __init__(self, scene: Scene, name: str, make: Maker, *, optimal: bool = True) -> None:
        self._scene = scene
        self._name = name
        self._make = make
        self._optimal = optimal
        self._robot = scene.start
        self._under_walls: dict[Cell, int] = {}
        self._search: PathSearch | None = None
        self._see()
        self._search = make(self._free, scene.grid.terrain, self._moves)

    @property
    def search(self) -> PathSearch:
        """What it searches with."""
        if self._search is None:
            self._see()
            self._search = self._make(self._free, self._scene.grid.terrain, self._moves)
        return self._search

    @property
    def free(self) -> BoolGrid:
        """Where the robot may be, moving obstacles left out; bool (height, width)."""
        return self._free

    def expansion_order(self) -> Cells | None:
        """See :class:`lampyris.planning.graph.expanded.Recordable`."""
        search, ends = self.search, (self._robot, self._scene.goal)
        if not isinstance(search, OrderedSearch):
            return None
        if not all(self._free[y, x] for x, y in ends):
            return np.zeros((0, 2), dtype=np.int32)
        return search.order(*ends)

    def _see(self) -> None:
        self._moves = moves_for(self._scene)
        self._free = free_space(self._scene)

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`. Kernels that stop leave all as it was before."""
        if anywhere:
            self._search = None
        return self._name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """The path from where the robot is to the goal.

        Obstacles count as blocked for this call, save on the robot's own cell and on the goal: it is
        covered now and will be free again. What is counted as expanded includes, on failure, the search
        that tells walls from obstacles and the size of the two regions; all of it together keeps within the
        budget.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        began = loading.wall()
        change = change or Change()
        self._take(change)
        timing: dict[str, float] = {}
        made = self._answer(change, None if budget is None else budget.expansions, timing)
        timing["search_s"] = loading.wall() - began - timing.get("pack_s", 0.0)
        return made if made.timing is timing else replace(made, timing=timing)

    def _take(self, change: Change) -> None:
        scene = edited(self._scene, change, self._under_walls)
        if change.robot is not None:
            self._robot = (int(change.robot[0]), int(change.robot[1]))
        if scene is not self._scene:
            self._scene = scene
            made, self._search = self._search, None
            if made is not None:
                self._see()
                if made.take(self._free, scene.grid.terrain):
                    self._search = made

    def _answer(self, change: Change, budget: int | None, timing: dict[str, float]) -> Plan:
        start, goal, search = self._robot, self._scene.goal, self.search
        if not self._free[start[1], start[0]]:
            return Plan(Status.START_OCCUPIED, self._name)
        if not self._free[goal[1], goal[0]]:
            return Plan(Status.GOAL_OCCUPIED, self._name)
        contains = self._scene.grid.contains
        closed = sorted(c for c in change.obstacles if c not in (start, goal) and contains(c))
        answer = search.find_path(start, goal, budget, closed)
        if answer.pack_s is not None:
            timing["pack_s"] = answer.pack_s
        if answer.cells is not None:
            path = path_of(answer.cells, self._moves, self._scene.grid.terrain)
            return Plan(
                Status.FOUND,
                self._name,
                path,
                iterations=1,
                expansions=answer.expansions,
                optimal_exact=path.exact if self._optimal and not change.obstacles else None,
                waypoints=answer.waypoints,
                map_model=answer.model,
                timing=timing,
            )
        if answer.ending == LIMIT:
            return Plan(Status.LIMIT, self._name, iterations=1, expansions=answer.expansions)
        if isinstance(search, GridSearch | TerrainSearch):
            finder, here = search, None if closed else answer.expansions
        else:
            # What it expands are not the cells of one region: jump points, or cells around either end.
            finder, here = search_of(self._free, self._scene.grid.terrain, self._moves), None
        spent = answer.expansions
        return why_not(self._name, finder, start, goal, spent=spent, budget=budget, here=here)
