"""The lattice planner: states (cell, heading), motion primitives, a bound on every path."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core import cancellation, elementary
from lampyris._core.cancellation import Cancelled
from lampyris._core.limits import demand_states
from lampyris._core.settings import flag, number
from lampyris.errors import FileError, SceneError, SettingError, shown
from lampyris.io.primitives.load import load_primitives
from lampyris.kernels.lattice.search import EXHAUSTED, LIMIT
from lampyris.model.lattice.motion_primitives import MotionPrimitives
from lampyris.model.moves import MOVES
from lampyris.model.path import Pose, PosePath, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Polygon, Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Traits
from lampyris.planning.lattice.ends.joined_end import (
    AT_STATES,
    Ends,
    JoinedEnd,
    heuristic_of,
    joined_end,
)
from lampyris.planning.lattice.ends.query import Query
from lampyris.planning.lattice.goal_field import GoalField
from lampyris.planning.lattice.guided.guided_search import MANY_GOALS, GuidedSearch, is_focused, is_guided
from lampyris.planning.lattice.lattice import UNIT, LatticeShape, StateLattice, lattice_of
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.poses import (
    difference,
    distance,
    headings_near,
    path_along,
    pose_path_of,
    segments_of,
    states_near,
    to_cells,
)
from lampyris.planning.lattice.search import Found, LatticeSearch
from lampyris.planning.lattice.session import EXACT, NEAR, PoseSession
from lampyris.planning.lattice.settings import LatticeSettings
from lampyris.planning.lattice.shortcut import LEAST_SAVING, ShortcutShape, shortened
from lampyris.typing import Cell, Cells, Floats

DISC_VERTICES = 16
"""A disc is swept as the regular polygon of so many vertices around it."""

_NO_PATH = "No path: no sequence of the lattice's motions takes this robot from the start to the goal."

State = tuple[Cell, int]


@dataclass(frozen=True, slots=True)
class LatticePlanner(LatticeSettings):
    """Weighted A* over a state lattice of cells and headings, for robots with a shape.

    Parameters
    ----------
    anytime : after the first path search with smaller weights, until the budget is used or the path is the best.
    primitives : file of motion primitives to drive in place of ours, with its own headings: Nav2's JSON or SBPL's
        ``.mprim`` (:func:`lampyris.load_primitives`, whose result is taken too).
    cost_penalty : ground of the highest terrain value, 252, costs so many times its length more; 4 is what planners
        on cells pay, 0 ignores terrain.
    shortcut : whether the path may leave the lattice along exact curves: it then begins and ends at exactly the poses asked
        for, and pieces of it are replaced by curves that cost less. Not on terrain that costs, and not with ``primitives``.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    anytime: bool = flag(False, title="go on improving")
    cost_penalty: float = number(4.0, 0.0, 100.0, title="cost of terrain")
    primitives: str | MotionPrimitives | None = None
    shortcut: bool = flag(True, title="shortcuts")

    name: ClassVar[str] = "lattice"
    files: ClassVar[tuple[str, ...]] = ("primitives",)
    """Settings that are names of files: in scenarios relative to the scenario's folder."""
    traits: ClassVar[Traits] = Traits(optimal=False, plans_headings=True)
    summary: ClassVar[str] = "State lattice: poses for a robot with a shape, with a bound on the cost."
    source: ClassVar[str] = (
        "Pivtoraiko, Knepper, Kelly 2009; Likhachev, Gordon, Thrun 2003 (ARA*); primitives and heuristic are ours."
    )

    def __post_init__(self) -> None:
        LatticeSettings.__post_init__(self)
        given: Any = self.primitives
        if isinstance(given, os.PathLike):
            object.__setattr__(self, "primitives", os.fspath(given))
        elif not (given is None or isinstance(given, MotionPrimitives) or (isinstance(given, str) and given)):
            raise SettingError.of(
                "PRIMITIVES",
                "primitives",
                shown(given),
                where=self.name,
                allowed="a file, or MotionPrimitives",
            )

    @property
    def promised_bound(self) -> float:
        """A path that is found costs at most so many times its lower bound."""
        return self.weight

    def begins_anywhere(self, scene: Scene) -> bool:
        """Whether paths in a scene begin at exactly the pose that is asked for, where a curve to the lattice is free."""
        priced = scene.grid.terrain is not None and self.cost_penalty > 0
        return self.shortcut and self.primitives is None and not priced

    def judged_by(self, resolution: float) -> dict[str, float]:
        """See :class:`lampyris.planning.lattice.settings.LatticeSettings`."""
        sampled = {} if self.primitives is None else {"sampled": 1.0}
        return {**LatticeSettings.judged_by(self, resolution), "cost_penalty": self.cost_penalty, **sampled}

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> LatticeSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        return LatticeSession(self, scene, self.cost_penalty, self.primitives, shortcut=self.shortcut)


def lattice_for(
    scene: Scene, settings: LatticeSettings, primitives: str | MotionPrimitives | None = None
) -> StateLattice:
    """The lattice of a scene's robot on the cells of its map, of our primitives or those that are given.

    Raises
    ------
    FileError : primitives for another resolution, or that the robot cannot drive.
    """
    cell = scene.grid.resolution
    given = load_primitives(primitives) if isinstance(primitives, str) else primitives
    if given is not None and abs(given.resolution - cell) > 1e-6 * cell:
        raise FileError(
            "PRIMITIVE_RESOLUTION",
            f"primitives for cells of {given.resolution:.9g} m, on a map of {cell:.9g} m",
            where=given.name or "primitives",
            allowed="the resolution of the map",
            todo="make them for this map: lampyris primitives --resolution",
        )
    return lattice_of(
        LatticeShape(
            footprint=tuple((x / cell, y / cell) for x, y in outline(scene)),
            drive=scene.robot.drive,
            turn_radius=scene.robot.turn_radius / cell,
            headings=settings.headings if given is None else len(given.headings),
            reverse_cost=settings.reverse_cost if settings.reverse else math.inf,
            turn_cost=settings.turn_cost / cell,
            primitives=given,
        )
    )


def outline(scene: Scene) -> Polygon:
    """The robot's footprint, or a polygon around its disc; metres."""
    return outline_of_robot(scene.robot, scene.grid.resolution)


def outline_of_robot(robot: Robot, resolution: float) -> Polygon:
    """See :func:`outline`; a point counts as a disc of a thousandth of a cell."""
    if robot.footprint is not None:
        return robot.footprint
    inner, _ = elementary.direction(math.pi / DISC_VERTICES)
    radius = max(robot.radius, 1e-3 * resolution) / inner
    turns = np.arange(DISC_VERTICES) * (2 * math.pi / DISC_VERTICES)
    vertices = radius * np.column_stack((elementary.cos(turns), elementary.sin(turns)))
    return tuple((x, y) for x, y in vertices.tolist())


def _occupied(end: str) -> str:
    return f"The footprint touches a wall at every pose of the lattice near the {end}."


class LatticeSession(PoseSession[LatticeSearch]):
    """Remembers the map, the robot, the heuristic of the goal and the states of the last search.

    Parameters
    ----------
    settings : the planner.
    scene : what to plan in.
    """

    def __init__(
        self,
        settings: LatticeSettings,
        scene: Scene,
        cost_penalty: float = 0.0,
        primitives: str | MotionPrimitives | None = None,
        *,
        shortcut: bool = False,
    ) -> None:
        super().__init__(settings.name, scene)
        self._settings, self._cost_penalty, self._shortcut = settings, cost_penalty, shortcut
        self._lattice = lattice_for(scene, settings, primitives)
        self._goal_end: tuple[LatticeMap, JoinedEnd | None] | None = None
        self._field = GoalField()
        self._spare: tuple[object, NDArray[np.int64]] | None = None

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`."""
        self._field = GoalField()
        return PoseSession.drop(self, anywhere)

    def _answer(self, search: LatticeSearch, budget: Budget | None) -> Plan:
        limit = None if budget is None else budget.expansions
        first: Plan | None = None
        spent = 0
        # Curves that are free lead to few of the states: the nearest ones may be in another part of the lattice.
        try:
            for ends in self._joined_ends(search.lattice_map).and_without():
                plan = self._between(search, ends, limit)
                spent += plan.expansions
                if plan or plan.status is Status.LIMIT:
                    return replace(plan, expansions=spent)
                first = plan if first is None else first
                limit = None if limit is None else max(limit - plan.expansions, 0)
        finally:
            self._spare = None
        assert first is not None
        return replace(first, expansions=spent)

    def _between(self, search: LatticeSearch, ends: Ends, limit: int | None) -> Plan:
        """The answer between poses that are joined to the lattice, or else the states nearest to them."""
        name, lattice_map = self._settings.name, search.lattice_map
        starts = [] if ends.start is not None else self.starts(lattice_map)
        if not starts and ends.start is None:
            return Plan(Status.START_OCCUPIED, name, detail=_occupied("start"))
        goals = [] if ends.goal is not None else self.goals(lattice_map)
        if not goals and ends.goal is None:
            return Plan(Status.GOAL_OCCUPIED, name, detail=_occupied("goal"))
        begun, ended = ([(lattice_map.index(cell), h) for cell, h in states] for states in (starts, goals))
        return self._searched(search, Query.between(begun, ended, ends), limit)

    def _joined_ends(self, lattice_map: LatticeMap) -> Ends:
        """The poses at both ends that are no states of the lattice, joined to it."""
        if not self._leaves_lattice(lattice_map):
            return AT_STATES
        grid, robot = self._scene.grid, self.curves()
        start = goal = None
        if self._pose is not None and grid.contains(self._robot) and self._is_beside(self._pose, EXACT):
            start = joined_end(to_cells(grid, *self._pose), robot, lattice_map)
        asked = self._scene.goal_pose
        if asked is not None and self._is_beside(asked, NEAR) and not self._within(lattice_map, asked):
            if self._goal_end is None or self._goal_end[0] is not lattice_map:
                self._goal_end = (
                    lattice_map,
                    joined_end(to_cells(grid, *asked), robot, lattice_map, into=True),
                )
            goal = self._goal_end[1]
        return Ends(start, goal)

    def _leaves_lattice(self, lattice_map: LatticeMap) -> bool:
        """Whether paths may leave the lattice along exact curves."""
        return self._shortcut and not len(lattice_map.price) and self._lattice.shape.primitives is None

    def _is_beside(self, pose: Pose, near: float) -> bool:
        """Whether a pose is at least so far from every state of the lattice, cells and radians."""
        turns, grid = self._lattice.angles, self._scene.grid
        x, y = grid.frame.to_points(pose[0], pose[1]).tolist()
        yaw = pose[2] - grid.origin[2]
        turned = abs(difference(turns[headings_near(turns, yaw)[0]], yaw))
        return turned >= near or distance((x, y), (math.floor(x + 0.5), math.floor(y + 0.5))) >= near

    def stand(self, cell: Cell, pose: Pose | None) -> None:
        """Put the robot on a cell, in a pose if it is known."""
        self._robot, self._pose = cell, pose

    def search_among(self, obstacles: Iterable[Cell]) -> LatticeSearch:
        """The memory of searches on the map with obstacles."""
        return self._new_search(obstacles)

    def found_segments(
        self, search: LatticeSearch, limit: int | None
    ) -> tuple[tuple[Pose, Floats] | None, int]:
        """A path without shortcuts, its first pose and its segments as of :func:`segments_of`, None if none was found; and the
        expansions."""
        lattice_map = search.lattice_map
        starts, goals = (
            [(lattice_map.index(cell), h) for cell, h in states]
            for states in (self.starts(lattice_map), self.goals(lattice_map))
        )
        if not starts or not goals:
            return None, 0
        answer = self._search_states(search, Query.between(starts, goals), limit)
        if isinstance(answer, Plan):
            return None, answer.expansions
        return segments_of(answer[0], lattice_map), search.expansions

    def _searched(self, search: LatticeSearch, query: Query, limit: int | None) -> Plan:
        """The answer between states that are free."""
        answer = self._search_states(search, query, limit)
        return answer if isinstance(answer, Plan) else self._plan_of(*answer, search=search, ends=query.ends)

    def _search_states(
        self, search: LatticeSearch, query: Query, limit: int | None
    ) -> tuple[Found, str] | Plan:
        """A path between states that are free, and what is said of it; or the answer that there is none."""
        assert isinstance(self._settings, LatticePlanner)
        tried = 0
        if isinstance(search, GuidedSearch) and self._is_focused(search, query):
            focused = search.field_for(query)
            if focused is not None and (known := query.known_in(focused.heuristic)).goals:
                answer = self._search_in(search, focused.heuristic, known, limit, focused.most)
                if answer is not None:
                    return answer
                tried = search.expansions
                limit = None if limit is None else max(limit - tried, 0)
        heuristic, query = self._known_goals(search, query)
        if not query.goals:
            return Plan(Status.NO_PATH, self._settings.name, expansions=tried, detail=_NO_PATH)
        answer = self._search_in(search, heuristic, query, limit)
        assert answer is not None
        search.charge(tried)
        return replace(answer, expansions=answer.expansions + tried) if isinstance(answer, Plan) else answer

    def _search_in(
        self,
        search: LatticeSearch,
        heuristic: NDArray[np.int64],
        query: Query,
        limit: int | None,
        most: int | None = None,
    ) -> tuple[Found, str] | Plan | None:
        """See :meth:`_search_states`; None: what paths through cells that the heuristic leaves out cost is too little to
        say, ``most`` or more."""
        weight, tried = self._settings.weight, 0
        if isinstance(search, GuidedSearch) and self._is_guided(search, query):
            quick, tried = search.first_try(heuristic, query, weight, limit, most)
            if quick is not None:
                return quick, ""
        search.begin(heuristic, query.starts, query.goals, query.start_costs, query.goal_costs)
        search.charge(tried)
        answer = self._improve(search, limit)
        if most is None or (isinstance(answer, Plan) and answer.status is Status.LIMIT):
            return answer
        if isinstance(answer, Plan):
            return None
        found, detail = answer
        if most >= found.lower_bound:
            return answer
        return (replace(found, lower_bound=most), detail) if found.cost <= weight * most else None

    def _is_focused(self, search: GuidedSearch, query: Query) -> bool:
        """Whether the heuristic is made only where paths may lead: unless it is there, or can be repaired, for the whole map."""
        assert isinstance(self._settings, LatticePlanner)
        lattice_map, kept = search.lattice_map, (self._heuristic, self._spare)
        return (
            not self._settings.anytime
            and is_focused(lattice_map, self._settings.weight)
            and all(one is None or one[0] != query.goal_key for one in kept)
            and not any(self._field.is_of(lattice_map.cell(cell)) for cell in query.field_cells)
        )

    def _improve(self, search: LatticeSearch, limit: int | None) -> tuple[Found, str] | Plan:
        """The path of a search that has begun, and what is said of it; or the answer that there is none."""
        assert isinstance(self._settings, LatticePlanner)
        outcome = search.improve(self._settings.weight, limit)
        found = search.result()
        if found is None:
            return self._none_found(outcome, search.expansions)
        detail = ""
        if self._settings.anytime:
            found, detail = self._improved(search, found, limit)
        return found, detail

    def _is_guided(self, search: LatticeSearch, query: Query) -> bool:
        """Whether a first try is made: see :func:`is_guided`; from one pose, to one pose or to states not too many."""
        assert isinstance(self._settings, LatticePlanner)
        return (
            not self._settings.anytime
            and (query.ends.start is not None or len(query.starts) == 1)
            and len(query.goals) <= MANY_GOALS
            and is_guided(search.lattice_map, self._settings.weight)
        )

    def _known_goals(self, search: LatticeSearch, query: Query) -> tuple[NDArray[np.int64], Query]:
        """The heuristic, which is made where it is not there, and the query with those of its goals that it is known at."""
        lattice_map, goal, key = search.lattice_map, query.ends.goal, query.goal_key
        if self._spare is not None and self._spare[0] == key:
            self._heuristic, self._spare = self._spare, self._heuristic
        if self._heuristic is None or self._heuristic[0] != key:
            # A fall-back from a joined goal to a state and back again needs both.
            self._spare = self._heuristic
            if goal is None:
                cells = tuple(dict.fromkeys(lattice_map.cell(cell) for cell, _ in query.goals))
                self._heuristic = key, lattice_map.heuristic(cells, self._field)
            else:
                self._heuristic = key, heuristic_of(goal, lattice_map, self._field)
        heuristic = self._heuristic[1]
        return heuristic, query.known_in(heuristic)

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

    def _plan_of(self, found: Found, detail: str, search: LatticeSearch, ends: Ends = AT_STATES) -> Plan:
        scene = self._scene
        arm = scene.robot.radius / scene.grid.resolution
        path, cells, is_shorter = self._driven(found, search.lattice_map, arm, ends, shorten=not detail)
        beside = tuple(
            self._note(what, path.poses[k], "the nearest pose of the lattice")
            for what, k in (("start", 0), ("goal", -1))
        )
        ignored = scene.grid.terrain is not None and self._cost_penalty == 0
        terrain = "terrain is ignored" if ignored else ""
        notes = tuple(filter(None, (*beside, terrain)))
        attributes = self._settings.judged_by(scene.grid.resolution)
        if is_shorter:
            attributes["lattice_cost"] = found.cost / UNIT * scene.grid.resolution
        if (
            self._leaves_lattice(search.lattice_map)
            and not beside[0]
            and self._ends_well(path, bool(beside[1]))
        ):
            attributes["end_error"] = NEAR * scene.grid.resolution
        return Plan(
            Status.FOUND, self._settings.name, path_of(cells, MOVES["octile"], None), iterations=1,
            expansions=search.expansions, detail=detail, pose_path=path, notes=notes,
            attributes=attributes,
        )  # fmt: skip

    def _ends_well(self, path: PosePath, beside: bool) -> bool:
        """Whether a path ends at the goal, or ``beside`` it but within the tolerances."""
        asked, grid, settings = self._scene.goal_pose, self._scene.grid, self._settings
        if not beside or asked is None:
            return True
        x, y, yaw = path.poses[-1].tolist()
        return distance((x, y), asked[:2]) <= settings.goal_tolerance + 0.5 * NEAR * grid.resolution and abs(
            difference(yaw, asked[2])
        ) <= max(settings.goal_yaw_tolerance, NEAR)

    def _driven(
        self, found: Found, lattice_map: LatticeMap, arm: float, ends: Ends, *, shorten: bool
    ) -> tuple[PosePath, Cells, bool]:
        """The path with its ends and shortcuts, the cells that its base passes through, and whether shortcuts made it shorter.

        The lower bound, which holds in the lattice and along the curves to it alone, is at most the cost.
        """
        shorten = (
            shorten and self._leaves_lattice(lattice_map) and (bool(found.primitives) or ends != AT_STATES)
        )
        if not shorten and ends == AT_STATES:
            return *pose_path_of(found, lattice_map, arm), False
        robot = self.curves()
        first, segments = ends.around(found, *segments_of(found, lattice_map))
        if shorten:
            shorter = self._shortened(first, segments, robot, lattice_map)
            cost = math.fsum(robot.costs(shorter).tolist())
            shorten = cost < found.cost / UNIT - LEAST_SAVING
        if shorten:
            segments = shorter
        elif ends == AT_STATES:
            return *pose_path_of(found, lattice_map, arm), False
        else:
            cost = math.fsum(robot.costs(segments).tolist())
        gears = np.sign(segments[:, 0]).astype(np.int8)
        least = found.lower_bound / UNIT
        return *path_along(first, segments, gears, cost, least, lattice_map.grid, arm), shorten

    def _shortened(
        self, first: Pose, segments: Floats, robot: ShortcutShape, lattice_map: LatticeMap
    ) -> Floats:
        """The segments with shortcuts, or as they are where the time is out."""
        try:
            return shortened(np.array(first), segments, robot, lattice_map)
        except Cancelled:
            scope = cancellation.watch()
            if scope is None or any(stop.is_set for stop in scope.stops):
                raise
            return segments

    def curves(self) -> ShortcutShape:
        """The robot and its prices, as exact curves have them."""
        shape = self._lattice.shape
        return ShortcutShape(
            shape.footprint,
            shape.drive,
            max(shape.turn_radius, 1.0),
            shape.reverse_cost if self._settings.reverse and shape.drive != "omnidirectional" else 0.0,
            shape.turn_cost,
        )

    @property
    def lattice_map(self) -> LatticeMap:
        """The map as it is now, without moving obstacles."""
        if self._search is None:
            self._search = self._new_search()
        return self._search.lattice_map

    def _judged_by(self) -> dict[str, float]:
        """See :class:`PoseSession`."""
        return self._settings.judged_by(self._scene.grid.resolution)

    def _new_search(self, obstacles: Iterable[Cell] = ()) -> LatticeSearch:
        """The memory of a search on the map as it is now.

        Raises
        ------
        LimitError : ``MEMORY``.
        """
        grid, lattice = self._scene.grid, self._lattice
        demand_states(grid.height, grid.width, lattice.border, len(lattice.angles), self._settings.name)
        return GuidedSearch(LatticeMap(grid, lattice, obstacles, self._cost_penalty))

    def _noted(self, search: LatticeSearch) -> list[Cells]:
        noted: list[Cells] = []
        search.expanded = noted
        return noted

    def starts(self, lattice_map: LatticeMap) -> list[State]:
        """The states that count as the robot's: the nearest that is free, or all headings where none is known."""
        turns, grid = self._lattice.angles, self._scene.grid
        if not grid.contains(self._robot):
            raise SceneError("CHANGE_OUTSIDE", f"cell {self._robot} is outside the map", where="change.robot")
        if self._pose is None:
            states = [(self._robot, k) for k in range(len(turns))]
            return [one for one in states if lattice_map.is_free(*one)]
        states = [one for one in states_near(grid, turns, self._pose) if lattice_map.is_free(*one)]
        return states[:1]

    def goals(self, lattice_map: LatticeMap) -> list[State]:
        """The states that count as the goal: all within the tolerances, or the nearest that is free."""
        turns, scene = self._lattice.angles, self._scene
        pose = scene.goal_pose
        headings = list(range(len(turns)))
        if pose is None:
            return lattice_map.free_states([scene.goal], headings)
        yaw = pose[2] - scene.grid.origin[2]
        near = self._headings_within(yaw) or headings_near(turns, yaw)[:1]
        states = lattice_map.free_states(self._cells_within(pose), near)
        if states:
            return states
        around = [one for one in states_near(scene.grid, turns, pose) if lattice_map.is_free(*one)]
        return around[:1]

    def _within(self, lattice_map: LatticeMap, pose: Pose) -> bool:
        """Whether a state within the tolerances of the goal is free."""
        near = self._headings_within(pose[2] - self._scene.grid.origin[2])
        return bool(lattice_map.free_states(self._cells_within(pose), near))

    def _headings_within(self, yaw: float) -> list[int]:
        """Headings within the tolerance of a yaw in the frame of the cells."""
        most = self._settings.goal_yaw_tolerance
        return [k for k, turn in enumerate(self._lattice.angles) if abs(difference(turn, yaw)) <= most]

    def _cells_within(self, pose: Pose) -> list[Cell]:
        """Cells whose centres are within the tolerance of the goal."""
        grid = self._scene.grid
        x, y = grid.frame.to_points(pose[0], pose[1]).tolist()
        reach = self._settings.goal_tolerance / grid.resolution
        return [
            (cx, cy)
            for cx in range(max(0, math.ceil(x - reach)), min(grid.width - 1, math.floor(x + reach)) + 1)
            for cy in range(max(0, math.ceil(y - reach)), min(grid.height - 1, math.floor(y + reach)) + 1)
            if distance((cx, cy), (x, y)) <= reach
        ]
