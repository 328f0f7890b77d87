"""The planner hybrid-astar: continuous poses, exact curves to the goal, a bound on every path."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import demand_states
from lampyris._core.settings import check_settings, flag, number, under_name, whole
from lampyris.errors import SceneError
from lampyris.kernels.curves.many import shortest
from lampyris.kernels.hybrid.search import LIMIT
from lampyris.model.grid import frozen
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Traits
from lampyris.planning.hybrid.map import HybridMap
from lampyris.planning.hybrid.motions import HybridShape
from lampyris.planning.hybrid.poses import pose_path_of, to_cells
from lampyris.planning.hybrid.search import HybridPath, HybridSearch, Pose, PoseQuery
from lampyris.planning.lattice.lattice_planner import outline
from lampyris.planning.lattice.poses import difference
from lampyris.planning.lattice.session import PoseSession
from lampyris.typing import Cell, Cells, Floats

_NO_PATH = (
    "No path: none of the motions at this resolution takes this robot from the start to the goal; "
    "more headings, a finer map or another planner may find one."
)
_SEPARATED = "No path: walls separate the start from the goal, however the robot is driven."
_ATTRIBUTES = ("goal_tolerance", "goal_yaw_tolerance", "reverse_cost", "turn_cost", "switch_cost")
"""Settings by which the referee judges a path."""
END_ERROR = 1e-3
"""Cells by which rounding may move the ends of a path."""


@dataclass(frozen=True, slots=True)
class HybridAStar:
    """Hybrid A*: weighted A* over continuous poses, with exact shortest curves to the goal.

    Parameters
    ----------
    weight : of the heuristic: 1 searches most thoroughly. It is no bound on the cost; the plan has one.
    headings : bins of the yaw; one pose is kept for each cell and bin.
    motion_length : length of a straight motion, and least length of an arc.
    reverse_cost : a metre in reverse costs as much as so many ahead.
    reverse : whether it may drive in reverse: Reeds-Shepp curves, else Dubins curves.
    turn_cost : a radian turned in place costs as much as so many metres ahead.
    switch_cost : a change between driving ahead and in reverse costs as much as so many metres ahead.
    analytic : whether exact shortest curves to the goal are tried; without them the path ends within a cell of it.
    goal_tolerance : distance from the goal at which it counts as reached.
    goal_yaw_tolerance : angle from the yaw of the goal at which it counts as reached, within the goal_tolerance.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    weight: float = number(1.5, 1.0, 1e3, title="weight of the heuristic")
    headings: int = whole(72, 16, 360, title="bins of the yaw")
    motion_length: float = number(1.5, 1.42, 1e3, unit="cells")
    reverse_cost: float = number(2.0, 1.0, 100.0)
    reverse: bool = flag(True)
    turn_cost: float = number(0.5, 1e-3, 100.0, unit="m/rad")
    switch_cost: float = number(1.0, 0.0, 1e3, unit="m")
    analytic: bool = flag(True, title="exact curves to the goal")
    goal_tolerance: float = number(0.0, 0.0, 1e3, unit="m")
    goal_yaw_tolerance: float = number(0.0, 0.0, math.pi, unit="rad")

    name: ClassVar[str] = "hybrid-astar"
    traits: ClassVar[Traits] = Traits(optimal=False, plans_headings=True)
    summary: ClassVar[str] = "Hybrid A*: smooth poses from exactly the start to exactly the goal."
    source: ClassVar[str] = (
        "Dolgov, Thrun, Montemerlo, Diebel 2010; Reeds, Shepp 1990; Dubins 1957; collision check and bound are ours."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def judged_by(self, resolution: float) -> dict[str, float]:
        """Attributes of a plan by which the referee judges its poses: what settings and the resolution alone decide."""
        attributes = {name: getattr(self, name) for name in _ATTRIBUTES}
        return {**attributes, "end_error": (END_ERROR if self.analytic else 1.0) * resolution}

    def proven_bound(self, scene: Scene) -> float:
        """The lower bound that a plan of the scene states, metres: of walls and curves alone, without a search; 0 if an
        end is occupied, infinity if there is no path."""
        return HybridSession(self, scene).proven_bound()

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> HybridSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return HybridSession(self, scene)


def shape_for(scene: Scene, settings: HybridAStar) -> HybridShape:
    """The shape of a scene's robot on the cells of its map."""
    cell = scene.grid.resolution
    return HybridShape(
        footprint=tuple((x / cell, y / cell) for x, y in outline(scene)),
        drive=scene.robot.drive,
        turn_radius=scene.robot.turn_radius / cell,
        headings=settings.headings,
        motion_length=settings.motion_length,
        reverse_cost=settings.reverse_cost if settings.reverse else math.inf,
        turn_cost=settings.turn_cost / cell,
        switch_cost=settings.switch_cost / cell,
    )


def _occupied(end: str) -> str:
    return f"The footprint touches a wall at the {end}."


class HybridSession(PoseSession[HybridSearch]):
    """Remembers the map, the robot, the cost-to-go of the goal and the memory of the last search.

    Parameters
    ----------
    settings : the planner.
    scene : what to plan in.
    """

    def __init__(self, settings: HybridAStar, scene: Scene) -> None:
        super().__init__(settings.name, scene)
        self._settings = settings
        self._shape = shape_for(scene, settings)

    def _new_search(self, obstacles: Iterable[Cell] = ()) -> HybridSearch:
        """The memory of a search on the map as it is now.

        Raises
        ------
        LimitError : ``MEMORY``.
        """
        grid, shape = self._scene.grid, self._shape
        demand_states(grid.height, grid.width, math.ceil(shape.outer) + 3, shape.headings, self._name)
        return HybridSearch(HybridMap(grid, shape, obstacles))

    def _noted(self, search: HybridSearch) -> list[Cells]:
        noted: list[Cells] = []
        search.expanded = noted
        return noted

    def _start(self) -> Pose:
        """Where the robot is; any yaw, if none is known.

        Raises
        ------
        SceneError : it is off the map.
        """
        grid = self._scene.grid
        if not grid.contains(self._robot):
            raise SceneError("CHANGE_OUTSIDE", f"cell {self._robot} is outside the map", where="change.robot")
        if self._pose is None:
            return (*map(float, self._robot), grid.origin[2])  # type: ignore[return-value]
        return to_cells(grid, *self._pose)

    def _goal(self) -> Pose:
        pose = self._scene.goal_pose
        if pose is None:
            return (*map(float, self._scene.goal), 0.0)  # type: ignore[return-value]
        return to_cells(self._scene.grid, *pose)

    def _standing(self, hybrid_map: HybridMap, pose: Pose, any_yaw: bool) -> tuple[int, ...]:
        """Headings, as numbers of bins from the yaw of a pose, in which the robot stands there."""
        bins = self._shape.headings
        wide = 2 * math.pi / bins
        headings = range(bins) if any_yaw else (0,)
        return tuple(k for k in headings if hybrid_map.stands(pose[0], pose[1], pose[2] + k * wide))

    def _answer(self, search: HybridSearch, budget: Budget | None) -> Plan:
        name = self._name
        asked = self._asked(search.hybrid_map)
        if isinstance(asked, Plan):
            return asked
        question, field, least = asked
        outcome = search.run(question, field, None if budget is None else budget.expansions)
        found = search.result()
        if found is None:
            status = Status.LIMIT if outcome == LIMIT else Status.NO_PATH
            detail = _NO_PATH if status is Status.NO_PATH else ""
            return Plan(status, name, expansions=search.expansions, detail=detail)
        return self._plan_of(found, search, least)

    def proven_bound(self) -> float:
        """See :meth:`HybridAStar.proven_bound`."""
        asked = self._asked(self._new_search().hybrid_map)
        if isinstance(asked, Plan):
            return math.inf if asked.status is Status.NO_PATH else 0.0
        return asked[2] * self._scene.grid.resolution

    def _asked(self, hybrid_map: HybridMap) -> tuple[PoseQuery, NDArray[np.float32], float] | Plan:
        """What is searched for, the estimate that guides the search, and a lower bound on the cost in cells.

        A plan without a path where no search is needed to know that there is none.
        """
        settings, name = self._settings, self._name
        cell = self._scene.grid.resolution
        start, goal = self._start(), self._goal()
        headings = self._standing(hybrid_map, start, self._pose is None)
        if not headings:
            return Plan(Status.START_OCCUPIED, name, detail=_occupied("start"))
        any_yaw = self._scene.goal_pose is None
        free = bool(self._standing(hybrid_map, goal, any_yaw))
        reach = settings.goal_tolerance / cell
        if not free and reach == 0.0:
            return Plan(Status.GOAL_OCCUPIED, name, detail=_occupied("goal"))
        if not settings.analytic:
            reach = max(reach, 1.0)
        corners, off = hybrid_map.corners_near(goal[0], goal[1], reach)
        if not corners:
            return Plan(Status.GOAL_OCCUPIED, name, detail=_occupied("goal"))
        cost, field = self._cost_to_go(hybrid_map, tuple(corners), off)
        least = hybrid_map.least(cost, start[0], start[1], off)
        if math.isinf(least):
            return Plan(Status.NO_PATH, name, detail=_SEPARATED)
        yaw_reach = settings.goal_yaw_tolerance
        if not settings.analytic:
            yaw_reach = max(yaw_reach, 2 * math.pi / settings.headings)
        question = PoseQuery(
            start[:2], start[2], headings, goal, any_yaw, reach if reach > 0 else -1.0, yaw_reach,
            settings.analytic and free, settings.weight,
        )  # fmt: skip
        return question, field, max(least, self._least(question))

    def _cost_to_go(
        self, hybrid_map: HybridMap, corners: tuple[Cell, ...], off: float
    ) -> tuple[Floats, np.ndarray]:
        """The cost-to-go of the corners of cells, and its estimate for each cell; kept for the next call."""
        if self._heuristic is None or self._heuristic[0] != corners:
            cost = hybrid_map.cost_to_go(corners)
            self._kept = cost
            self._heuristic = (corners, hybrid_map.estimate(cost, off))
        return self._kept, self._heuristic[1]

    def _least(self, question: PoseQuery) -> float:
        """What any path of this robot costs at least without walls, in cells.

        A car's shortest curve, if both ends are exact; else the turn that is needed, on arcs or in place.
        """
        radius = self._scene.robot.turn_radius / self._scene.grid.resolution
        if radius <= 0 or question.any_yaw or self._pose is None:
            return 0.0
        if question.reach < 0 and self._shape.drive == "ackermann":
            length = np.zeros(1)
            start, goal = frozen(np.array([*question.place, question.yaw])), frozen(np.array(question.goal))
            room = (np.zeros(5), np.zeros(5, dtype=np.int64))
            shortest(start, goal, radius, self._shape.backward, length, *room)
            return float(length[0]) * radius * (1 - 1e-9)
        turn = abs(difference(question.goal[2], question.yaw)) - max(question.yaw_reach, 0.0)
        price = radius if self._shape.drive == "ackermann" else min(radius, self._shape.turn_cost)
        return max(turn, 0.0) * price * (1 - 1e-9)

    def _plan_of(self, found: HybridPath, search: HybridSearch, least: float) -> Plan:
        grid = self._scene.grid
        path, cells = pose_path_of(found, least, grid, self._scene.robot.radius / grid.resolution)
        note = "" if found.exact else self._note("goal", path.poses[-1], "a pose within the tolerances")
        terrain = "" if grid.terrain is None else "terrain is ignored by planners of poses"
        return Plan(
            Status.FOUND, self._name, path_of(cells, MOVES["octile"], None), iterations=1,
            expansions=search.expansions, pose_path=path, notes=tuple(filter(None, (note, terrain))),
            attributes=self._settings.judged_by(grid.resolution),
        )  # fmt: skip
