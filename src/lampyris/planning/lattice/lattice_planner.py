"""The lattice planner: states (cell, heading), motion primitives, a bound on every path."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from lampyris._core import cancellation, elementary
from lampyris._core.cancellation import Cancelled
from lampyris._core.limits import demand_states
from lampyris._core.settings import flag
from lampyris.errors import SceneError
from lampyris.kernels.lattice.search import EXHAUSTED, LIMIT
from lampyris.model.change import Change
from lampyris.model.moves import MOVES
from lampyris.model.path import Pose, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Polygon
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, SessionBase, Traits
from lampyris.planning.edits import edited
from lampyris.planning.lattice.goal_field import GoalField
from lampyris.planning.lattice.lattice import LatticeShape, StateLattice, lattice_of
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.poses import difference, distance, headings_near, pose_path_of, states_near
from lampyris.planning.lattice.primitives import angles
from lampyris.planning.lattice.search import Found, LatticeSearch
from lampyris.planning.lattice.settings import LatticeSettings
from lampyris.planning.session_limits import limited
from lampyris.typing import Cell

DISC_VERTICES = 16
"""A disc is swept as the regular polygon of so many vertices around it."""

_NO_PATH = "No path: no sequence of the lattice's motions takes this robot from the start to the goal."
_ATTRIBUTES = ("goal_tolerance", "goal_yaw_tolerance", "reverse_cost", "turn_cost")
"""Settings by which the referee judges a path."""

State = tuple[Cell, int]


@dataclass(frozen=True, slots=True)
class LatticePlanner(LatticeSettings):
    """Weighted A* over a state lattice of cells and headings, for robots with a shape.

    Parameters
    ----------
    anytime : after the first path search with smaller weights, until the budget is used or the path is the best.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    anytime: bool = flag(False)

    name: ClassVar[str] = "lattice"
    traits: ClassVar[Traits] = Traits(optimal=False, plans_headings=True)
    summary: ClassVar[str] = "State lattice: poses for a robot with a shape, with a bound on the cost."
    source: ClassVar[str] = (
        "Pivtoraiko, Knepper, Kelly 2009; Likhachev, Gordon, Thrun 2003 (ARA*); primitives and heuristic are ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> LatticeSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return LatticeSession(self, scene)


def lattice_for(scene: Scene, settings: LatticeSettings) -> StateLattice:
    """The lattice of a scene's robot on the cells of its map."""
    cell = scene.grid.resolution
    return lattice_of(
        LatticeShape(
            footprint=tuple((x / cell, y / cell) for x, y in outline(scene)),
            drive=scene.robot.drive,
            turn_radius=scene.robot.turn_radius / cell,
            headings=settings.headings,
            reverse_cost=settings.reverse_cost if settings.reverse else math.inf,
            turn_cost=settings.turn_cost / cell,
        )
    )


def outline(scene: Scene) -> Polygon:
    """The robot's footprint, or a polygon around its disc; metres."""
    robot = scene.robot
    if robot.footprint is not None:
        return robot.footprint
    inner, _ = elementary.direction(math.pi / DISC_VERTICES)
    radius = max(robot.radius, 1e-3 * scene.grid.resolution) / inner
    turns = np.arange(DISC_VERTICES) * (2 * math.pi / DISC_VERTICES)
    vertices = radius * np.column_stack((elementary.cos(turns), elementary.sin(turns)))
    return tuple((x, y) for x, y in vertices.tolist())


def _occupied(end: str) -> str:
    return f"The footprint touches a wall at every pose of the lattice near the {end}."


class LatticeSession(SessionBase):
    """Remembers the map, the robot, the heuristic of the goal and the states of the last search.

    Parameters
    ----------
    settings : the planner.
    scene : what to plan in.
    """

    def __init__(self, settings: LatticeSettings, scene: Scene) -> None:
        self._settings, self._scene = settings, scene
        self._pose: Pose | None = scene.start_pose
        self._robot = scene.start
        self._under_walls: dict[Cell, int] = {}
        self._lattice = lattice_for(scene, settings)
        self._search: LatticeSearch | None = None
        self._heuristic: tuple[object, np.ndarray] | None = None
        self._field = GoalField()

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`."""
        self._forget_map()
        self._field = GoalField()
        return self._settings.name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """Poses from where the robot is to the goal.

        A change that moves the robot to a cell gives no heading: any heading will do there.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map.
        """
        change = change or Change()
        scene = edited(self._scene, change, self._under_walls)
        if scene is not self._scene:
            self._forget_map()
            self._scene = scene
        if change.robot is not None:
            self._robot, self._pose = change.robot, None
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
                return Plan(Status.HEMMED_IN, self._settings.name, expansions=plan.expansions)
        return plan

    def _forget_map(self) -> None:
        """The map is no longer what the search has; the goal's field can be repaired."""
        self._search, self._heuristic = None, None

    def _search_among(self, obstacles: frozenset[Cell]) -> LatticeSearch:
        """A search on the map with obstacles, the last one's memory where it will do."""
        if obstacles or self._search is None:
            self._forget_map()
            return self._new_search(obstacles)
        return self._search

    def _answer(self, search: LatticeSearch, budget: Budget | None) -> Plan:
        name, lattice_map = self._settings.name, search.lattice_map
        starts = self.starts(lattice_map)
        if not starts:
            return Plan(Status.START_OCCUPIED, name, detail=_occupied("start"))
        goals = self.goals(lattice_map)
        if not goals:
            return Plan(Status.GOAL_OCCUPIED, name, detail=_occupied("goal"))
        return self._searched(search, starts, goals, None if budget is None else budget.expansions)

    def _searched(
        self, search: LatticeSearch, starts: list[State], goals: list[State], limit: int | None
    ) -> Plan:
        """The answer between states that are free."""
        assert isinstance(self._settings, LatticePlanner)
        name, lattice_map = self._settings.name, search.lattice_map
        goal_cells = frozenset(cell for cell, _ in goals)
        if self._heuristic is None or self._heuristic[0] != goal_cells:
            self._heuristic = (
                goal_cells,
                lattice_map.heuristic(tuple(dict.fromkeys(cell for cell, _ in goals)), self._field),
            )
        heuristic = self._heuristic[1]
        known = [(lattice_map.index(cell), h) for cell, h in goals if heuristic[lattice_map.index(cell)] >= 0]
        if not known:
            return Plan(Status.NO_PATH, name, detail=_NO_PATH)
        search.begin(heuristic, [(lattice_map.index(cell), h) for cell, h in starts], known)
        outcome = search.improve(self._settings.weight, limit)
        found = search.result()
        if found is None:
            return self._none_found(outcome, search.expansions)
        detail = ""
        if self._settings.anytime:
            found, detail = self._improved(search, found, limit)
        return self._plan_of(found, search, detail)

    def _none_found(self, outcome: int, expansions: int) -> Plan:
        """The answer where a search found no path."""
        status = {EXHAUSTED: Status.NO_PATH, LIMIT: Status.LIMIT}[outcome]
        detail = _NO_PATH if status is Status.NO_PATH else ""
        return Plan(status, self._settings.name, expansions=expansions, detail=detail)

    def _improved(self, search: LatticeSearch, found: Found, limit: int | None) -> tuple[Found, str]:
        """Lower the weight until the path is the best, or time or expansions are used; what was found last."""
        weight = self._settings.weight
        try:
            while found.cost > found.lower_bound and weight > 1.0:
                weight = max(1.0, 1.0 + (weight - 1.0) / 2 - 1e-3)
                outcome = search.improve(weight, limit)
                better = search.result()
                assert better is not None
                bound = max(found.lower_bound, better.lower_bound)
                found = better if better.cost < found.cost else found
                found = Found(found.states, found.primitives, found.last, found.cost, min(bound, found.cost))
                if outcome == LIMIT:
                    return found, "Stopped improving at the budget."
        except Cancelled:
            scope = cancellation.watch()
            if scope is None or any(stop.is_set for stop in scope.stops):
                raise
            self.drop(True)
            return found, "Stopped improving at the time limit."
        return found, ""

    def _plan_of(self, found: Found, search: LatticeSearch, detail: str) -> Plan:
        scene = self._scene
        path, cells = pose_path_of(found, search.lattice_map, scene.robot.radius / scene.grid.resolution)
        ends = (self._note("start", path.poses[0]), self._note("goal", path.poses[-1]))
        terrain = "" if scene.grid.terrain is None else "terrain is ignored by planners of poses"
        notes = tuple(filter(None, (*ends, terrain)))
        return Plan(
            Status.FOUND, self._settings.name, path_of(cells, MOVES["octile"], None), iterations=1,
            expansions=search.expansions, detail=detail, pose_path=path, notes=notes,
            attributes={name: getattr(self._settings, name) for name in _ATTRIBUTES},
        )  # fmt: skip

    def _note(self, what: str, pose: np.ndarray) -> str:
        """A note where an end of the path is not the pose that was asked for."""
        asked = self._pose if what == "start" else self._scene.goal_pose
        if asked is None:
            return ""
        away = distance((float(pose[0]), float(pose[1])), asked[:2])
        turned = abs(difference(float(pose[2]), asked[2]))
        if away < 1e-9 and turned < 1e-9:
            return ""
        return (
            f"the {what} of the path is the nearest pose of the lattice, {away:.3g} m and "
            f"{math.degrees(turned):.3g} degrees away"
        )

    @property
    def lattice_map(self) -> LatticeMap:
        """The map as it is now, without moving obstacles."""
        if self._search is None:
            self._search = self._new_search()
        return self._search.lattice_map

    def _new_search(self, obstacles: Iterable[Cell] = ()) -> LatticeSearch:
        """The memory of a search on the map as it is now.

        Raises
        ------
        LimitError : ``MEMORY``.
        """
        grid, lattice = self._scene.grid, self._lattice
        demand_states(grid.height, grid.width, lattice.border, lattice.shape.headings, self._settings.name)
        return LatticeSearch(LatticeMap(grid, lattice, obstacles))

    def starts(self, lattice_map: LatticeMap) -> list[State]:
        """The states that count as the robot's: the nearest that is free, or all headings where none is known."""
        n, grid = self._settings.headings, self._scene.grid
        if not grid.contains(self._robot):
            raise SceneError("CHANGE_OUTSIDE", f"cell {self._robot} is outside the map", where="change.robot")
        if self._pose is None:
            states = [(self._robot, k) for k in range(n)]
            return [one for one in states if lattice_map.is_free(*one)]
        states = [one for one in states_near(grid, n, self._pose) if lattice_map.is_free(*one)]
        return states[:1]

    def goals(self, lattice_map: LatticeMap) -> list[State]:
        """The states that count as the goal: all within the tolerances, or the nearest that is free."""
        n, scene = self._settings.headings, self._scene
        pose = scene.goal_pose
        x, y = scene.goal if pose is None else scene.grid.frame.to_points(pose[0], pose[1]).tolist()
        reach = self._settings.goal_tolerance / scene.grid.resolution
        width, height = scene.grid.width, scene.grid.height
        headings = list(range(n))
        if pose is not None:
            yaw = pose[2] - scene.grid.origin[2]
            most = self._settings.goal_yaw_tolerance
            headings = [k for k in headings if abs(difference(angles(n)[k], yaw)) <= most] or headings_near(
                n, yaw
            )[:1]
        cells = [
            (cx, cy)
            for cx in range(max(0, math.ceil(x - reach)), min(width - 1, math.floor(x + reach)) + 1)
            for cy in range(max(0, math.ceil(y - reach)), min(height - 1, math.floor(y + reach)) + 1)
            if distance((cx, cy), (x, y)) <= reach
        ]
        states = lattice_map.free_states(cells, headings)
        if states or pose is None:
            return states
        near = [one for one in states_near(scene.grid, n, pose) if lattice_map.is_free(*one)]
        return near[:1]
