"""The planner pose-rrt-connect: RRT-Connect over poses of a footprint, by exact curves."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core import cancellation
from lampyris._core.cancellation import Cancelled
from lampyris._core.settings import check_settings, flag, number, under_name, whole
from lampyris.errors import SceneError
from lampyris.kernels.curves.many import shortest
from lampyris.model.grid import frozen
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget, Traits
from lampyris.planning.hybrid.map import HybridMap
from lampyris.planning.hybrid.motions import HybridShape
from lampyris.planning.lattice.lattice_planner import outline
from lampyris.planning.lattice.poses import path_along, to_cells
from lampyris.planning.lattice.session import PoseSession
from lampyris.planning.lattice.shortcut import ShortcutShape, shortened
from lampyris.planning.sampling import settings
from lampyris.planning.sampling.pose_trees import (
    CellPose,
    PoseTask,
    PoseTrees,
    base_cells,
    plain_distance,
    separated,
)
from lampyris.typing import Cell, Floats

END_ERROR = 1e-3
"""Cells by which rounding may move the ends of a path."""
YAWS = 16
"""Yaws that are tried at an end where any will do."""
PROVE = 500
"""Samples without a path after which it is looked up whether walls separate the ends."""
BATCH = 250
"""Samples of one call of the kernel."""
_SEPARATED = "No path: walls separate the start from the goal, however the robot is driven."
_ATTRIBUTES = ("reverse_cost", "turn_cost")


@dataclass(frozen=True, slots=True)
class PoseRrtConnect:
    """RRT-Connect over poses: two trees of exact curves, from the start and from the goal, that grow towards each other.

    Curves are those of hybrid A*: Reeds and Shepp, or Dubins, for a car; turn, straight line, turn for a differential drive;
    straight lines to any side and turns in place for an omnidirectional one. If there is a path with room to spare,
    the probability that it is found tends to 1 with the number of samples; its length has no guarantee. With
    ``rounds`` new trees are grown that are kept to what costs less than the best path so far.

    Parameters
    ----------
    samples : greatest number of samples in all rounds.
    rounds : greatest number of pairs of trees; 1: the first path is returned.
    step : length of a curve by which the trees grow.
    reverse_cost : cost of a metre in reverse, in metres ahead.
    reverse : whether it may drive in reverse.
    turn_cost : a radian turned in place costs as much as so many metres ahead.
    shortcut : whether the path is made shorter by exact curves between its poses.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    samples: int = settings.samples_of_first_path()
    rounds: int = whole(1, 1, 1_000_000)
    step: float | None = number(None, 1.0, 1e4, unit="cells", none="a tenth of the map's diagonal, 8 to 64")
    reverse_cost: float = number(1.0, 1.0, 100.0)
    reverse: bool = flag(True)
    turn_cost: float = number(0.5, 1e-3, 100.0, unit="m/rad")
    shortcut: bool = flag(True)

    name: ClassVar[str] = "pose-rrt-connect"
    traits: ClassVar[Traits] = Traits(optimal=False, stochastic=True, plans_headings=True)
    summary: ClassVar[str] = "RRT-Connect for a footprint: two random trees of exact curves."
    source: ClassVar[str] = (
        "Kuffner, LaValle 2000; Reeds, Shepp 1990; Dubins 1957; collision check, shorter steps, rounds kept to a cost and "
        "shortcuts are ours."
    )

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))

    def begins_anywhere(self, scene: Scene) -> bool:
        """Whether paths in a scene begin at exactly the pose that is asked for: always."""
        return True

    def judged_by(self, resolution: float) -> dict[str, float]:
        """Attributes of a plan by which the referee judges its poses."""
        return {**{name: getattr(self, name) for name in _ATTRIBUTES}, "end_error": END_ERROR * resolution}

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> PoseRrtSession:
        """Start a session; with ``record`` its plans hold the cost after each round, and the last trees."""
        return PoseRrtSession(self, scene, rng, record=record)


@dataclass(slots=True)
class PoseRun:
    """What a call has done so far.

    Parameters
    ----------
    least : no path costs less, cells.
    total : expansions at most, samples and others.
    limit : of the budget; None: there is none.
    """

    least: float
    total: int
    limit: int | None = None
    best: tuple[CellPose, Floats] | None = None
    most: float = math.inf
    spent: int = 0
    trace: list[float] = field(default_factory=list)
    edges: Floats | None = None
    proven: bool = False
    separated: bool = False
    detail: str = ""

    def charge(self, expansions: int) -> None:
        """Count expansions of another search: they are taken from the budget, not from the samples of the settings."""
        self.spent += expansions
        self.total += expansions
        if self.limit is not None:
            self.total = min(self.total, self.limit)

    @property
    def is_open(self) -> bool:
        """Whether samples are left and a shorter path is possible."""
        return self.spent < self.total and self.most > self.least * (1 + 1e-9)


class PoseRrtSession(PoseSession[HybridMap]):
    """Remembers the map and the robot; the trees of each call are new.

    Parameters
    ----------
    settings : the planner.
    scene : what to plan in.
    rng : 32 bits of it for each round are the key of its draws.
    record : see :meth:`PoseRrtConnect.open`.
    """

    def __init__(
        self, settings: PoseRrtConnect, scene: Scene, rng: np.random.Generator, *, record: bool
    ) -> None:
        super().__init__(settings.name, scene)
        self._settings, self._rng, self._record = settings, rng, record
        cell = scene.grid.resolution
        self._shape = HybridShape(
            footprint=tuple((x / cell, y / cell) for x, y in outline(scene)),
            drive=scene.robot.drive,
            turn_radius=scene.robot.turn_radius / cell,
            headings=YAWS,
            motion_length=1.5,
            reverse_cost=settings.reverse_cost if settings.reverse else math.inf,
            turn_cost=settings.turn_cost / cell,
            switch_cost=0.0,
        )
        self._cells: np.ndarray | None = None

    def _judged_by(self) -> dict[str, float]:
        """See :class:`PoseSession`."""
        return self._settings.judged_by(self._scene.grid.resolution)

    def _new_search(self, obstacles: Iterable[Cell] = ()) -> HybridMap:
        """The map as it is now."""
        self._cells = None
        return HybridMap(self._scene.grid, self._shape, obstacles)

    def _poses(self, hybrid_map: HybridMap, pose: CellPose, any_yaw: bool) -> tuple[CellPose, ...]:
        """The poses at an end where the robot stands."""
        x, y, yaw = pose
        turns = [yaw + k * (2 * math.pi / YAWS) for k in range(YAWS if any_yaw else 1)]
        return tuple((x, y, turn) for turn in turns if hybrid_map.stands(x, y, turn))

    def _answer(self, search: HybridMap, budget: Budget | None) -> Plan:
        grid, name, settings = self._scene.grid, self._name, self._settings
        if not grid.contains(self._robot):
            raise SceneError("CHANGE_OUTSIDE", f"cell {self._robot} is outside the map", where="change.robot")
        ends = []
        for pose, cell, status, what in (
            (self._pose, self._robot, Status.START_OCCUPIED, "start"),
            (self._scene.goal_pose, self._scene.goal, Status.GOAL_OCCUPIED, "goal"),
        ):
            place = (
                (float(cell[0]), float(cell[1]), grid.origin[2]) if pose is None else to_cells(grid, *pose)
            )
            standing = self._poses(search, place, pose is None)
            if not standing:
                return Plan(status, name, detail=f"The footprint touches a wall at the {what}.")
            ends.append(standing)
        starts, goals = ends
        diagonal = math.sqrt(float(grid.width * grid.width + grid.height * grid.height))
        step = min(max(0.1 * diagonal, 8.0), 64.0) if settings.step is None else settings.step
        shape = self._shape
        task = PoseTask(
            search, starts, goals, step, shape.reverse_cost if shape.backward else 0.0, shape.turn_cost
        )
        return self._rounds(task, None if budget is None else budget.expansions)

    def _rounds(self, task: PoseTask, limit: int | None) -> Plan:
        """Grow trees, round after round, and keep the best path."""
        settings, name = self._settings, self._name
        total = settings.samples if limit is None else min(limit, settings.samples)
        run = PoseRun(self._least(task), total, limit)
        if self._cells is None:
            self._cells = base_cells(task.hybrid_map)
        try:
            self._grow(task, run, self._cells)
        except Cancelled:
            scope = cancellation.watch()
            if run.best is None or scope is None or any(stop.is_set for stop in scope.stops):
                raise
            run.detail = "Stopped improving at the time limit."
        if run.best is None:
            if run.separated:
                return Plan(Status.NO_PATH, name, expansions=run.spent, detail=_SEPARATED)
            if limit is not None and run.total == limit:
                return Plan(Status.LIMIT, name, iterations=len(run.trace), expansions=run.spent)
            detail = f"No path was found with {settings.samples} samples; there may be one."
            return Plan(
                Status.ITERATION_LIMIT, name, iterations=len(run.trace), expansions=run.spent, detail=detail
            )
        cell = self._scene.grid.resolution
        more: dict[str, Any] = {}
        if self._record:
            more = {"best_by_iteration": tuple(run.trace), "tree": run.edges}
        arm = self._scene.robot.radius / cell
        first, segments = run.best
        gears = np.sign(segments[:, 0]).astype(np.int8)
        least = min(run.least, run.most)
        path, cells = path_along(first, segments, gears, run.most, least, self._scene.grid, arm)
        terrain = "" if self._scene.grid.terrain is None else "terrain is ignored by planners that sample"
        return Plan(
            Status.FOUND, name, path_of(cells, MOVES["octile"], None), iterations=len(run.trace), expansions=run.spent,
            detail=run.detail, pose_path=path, notes=(terrain,) if terrain else (), attributes=settings.judged_by(cell), **more,
        )  # fmt: skip

    def _grow(self, task: PoseTask, run: PoseRun, cells: NDArray[np.int32]) -> None:
        """Grow pairs of trees, each kept to what costs less than the best path so far."""
        while len(run.trace) < self._settings.rounds and run.is_open:
            self._grow_pair(task, run, cells)

    def _grow_pair(self, task: PoseTask, run: PoseRun, cells: NDArray[np.int32]) -> None:
        """Grow two trees until they meet or the samples are used."""
        key = int(self._rng.integers(2**32))
        trees = PoseTrees(task, cells, key, run.total - run.spent, run.most)
        begun, met = run.spent, False
        while not met and run.spent < run.total:
            met = trees.run(min(BATCH, run.total - run.spent))
            run.spent = begun + trees.taken
            if not met and run.best is None and not run.proven and run.spent >= min(PROVE, run.total):
                run.proven = True
                if self._separated(task):
                    run.separated, run.total = True, run.spent
                    return
        if met:
            self._keep(task, run, *trees.path())
        run.trace.append(run.most)
        if self._record:
            run.edges = trees.edges()

    def _keep(self, task: PoseTask, run: PoseRun, first: CellPose, segments: Floats) -> None:
        """Keep a path with its shortcuts if it costs less than the best one."""
        first, segments, cost = self._shortened(task, first, segments)
        if cost < run.most:
            run.best, run.most = (first, segments), cost

    def _separated(self, task: PoseTask) -> bool:
        ends = [
            (math.floor(pose[0] + 0.5), math.floor(pose[1] + 0.5)) for pose in (task.starts[0], task.goals[0])
        ]
        return separated(task.hybrid_map, ends[0], ends[1])

    def _least(self, task: PoseTask) -> float:
        """No path of this robot costs less, in cells: the straight line, and for a car the shortest curve."""
        start, goal, radius = task.starts[0], task.goals[0], self._shape.radius
        plain = plain_distance(start, goal)
        if self._shape.drive != "ackermann" or len(task.starts) > 1 or len(task.goals) > 1:
            return plain * (1 - 1e-12)
        if self._pose is None or self._scene.goal_pose is None:
            return plain * (1 - 1e-12)
        length = np.zeros(1)
        room = (np.zeros(5), np.zeros(5, dtype=np.int64))
        shortest(frozen(np.array(start)), frozen(np.array(goal)), radius, self._shape.backward, length, *room)
        return max(plain, float(length[0]) * radius) * (1 - 1e-9)

    def _prices(self, task: PoseTask) -> ShortcutShape:
        """The robot and what its segments cost."""
        shape = self._shape
        return ShortcutShape(shape.footprint, shape.drive, shape.radius, task.reverse, task.turn_cost)

    def _shortened(self, task: PoseTask, first: CellPose, segments: Floats) -> tuple[CellPose, Floats, float]:
        """The path with shortcuts, and what it costs, in cells."""
        robot = self._prices(task)
        if self._settings.shortcut and len(segments):
            try:
                segments = shortened(np.array(first), segments, robot, task.hybrid_map)
            except Cancelled:
                scope = cancellation.watch()
                if scope is None or any(stop.is_set for stop in scope.stops):
                    raise
        return first, segments, math.fsum(robot.costs(segments).tolist())
