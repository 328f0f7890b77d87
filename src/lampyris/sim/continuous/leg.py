"""Legs: from a plan to a path that can be driven, with the ceiling of speeds along it.

A robot that asks again stands somewhere between cells. It tells its planner the nearest cell that it can get
to in a straight line, and drives from where it really is.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris._core.defaults import Smooth
from lampyris.errors import SettingError
from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.drive import PlannedTimes
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion.geometry.acceleration_switches import with_switches
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.geometry.smoothing import drawn, wanted_of
from lampyris.motion.laws.bounds import optimum_at_nodes
from lampyris.motion.laws.node_refinement import refined
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.traffic.adversary import line_is_clear, square_distances
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris.sim.world.trajectory import CurveLookup
from lampyris.typing import BoolGrid, Cell, Floats, Points

_Ints: TypeAlias = NDArray[np.int64]
Ceiling: TypeAlias = Callable[[SampledPath], Profile | None]
"""What makes the static ceiling of a sampled path; None: the robot's own limits are all there is."""


@dataclass(frozen=True, slots=True, eq=False)
class Leg:
    """One path from where the robot stands to the goal.

    Attributes
    ----------
    route, samples : the path, and nodes along it.
    profile : the law's ceiling.
    nodes, squares : distance and squared speed of that ceiling at each node.
    limits : squared speed of the robot's own limits: v_max, bends, stops, the goal.
    seconds : how long the robot's own limits would need.
    timetable : when the plan wants the robot to be where; None: as soon as it can.
    """

    route: CurveLookup
    samples: SampledPath
    profile: Profile
    nodes: Floats
    squares: Floats
    limits: Floats
    seconds: float
    timetable: PlannedTimes | None = None

    @property
    def nowhere(self) -> bool:
        """Whether it has no length."""
        return self.route.length == 0.0


def leg_of(curve: Curve, scene: Scene, ceiling: Ceiling, spacing: float) -> Leg:
    """A leg along a curve, with nodes no farther apart than ``spacing`` metres."""
    samples = refined(sample_curve(curve, spacing), scene)
    route = PoseLookup(curve) if isinstance(curve, PoseCurve) else CurveLookup(curve)
    if len(samples) < 2:
        zero = np.zeros(1)
        still = Profile("", zero, zero, zero, zero, ("start",), "m/s")
        return Leg(route, samples, still, zero, zero, zero, 0.0)
    own = optimum_at_nodes(samples, scene)
    seconds = _seconds(samples, scene, own)
    made = ceiling(samples)
    profile = own if made is None else made
    squares = np.ascontiguousarray(np.minimum(profile.v * profile.v, own.v * own.v))
    nodes = np.ascontiguousarray(samples.s)
    return Leg(route, samples, profile, nodes, squares, own.v * own.v, seconds)


def _seconds(samples: SampledPath, scene: Scene, own: Profile) -> float:
    """What the optimum of the curve takes, whose acceleration changes between nodes, too."""
    if scene.robot.jerk_max is not None:
        return float(own.t[-1])
    return float(optimum_at_nodes(with_switches(samples, own.v, scene.robot), scene).t[-1])


def standing(scene: Scene, xy: tuple[float, float]) -> Curve:
    """A path of no length, for a robot that has nowhere to go."""
    return Curve(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), np.zeros(0), xy, scene.grid.resolution)


def comfort(
    scene: Scene, message: ObstacleMessage | None, xy: tuple[float, float], reaction: float
) -> Floats | None:
    """How far a path should pass each obstacle near ``xy``, so that the robot need not crawl there; (m,).

    At so many metres it may drive at three tenths of its top speed: in ``T + 0.3 v_max / d_max`` seconds it
    stands, and so far does the obstacle come. 0 for obstacles that are four times as far away: they will be
    elsewhere. None if nobody is near.
    """
    if message is None or not len(message.xy) or not np.isfinite(message.xy).all():
        return None
    robot = scene.robot
    wide: Floats = message.top_speed * (reaction + 0.3 * robot.v_max / robot.d_max)
    away = (message.xy - xy) * scene.grid.resolution
    gap = np.sqrt((away * away).sum(axis=1)) - message.radius - robot.radius
    wide = np.where(gap < 4.0 * wide, wide, 0.0)
    return wide if wide.any() else None


def closed_cells(
    scene: Scene, message: ObstacleMessage | None, more: Floats | None = None
) -> frozenset[Cell]:
    """Every cell at whose centre the robot would touch an obstacle as reported, or come nearer than ``more``."""
    return _cells_within(scene, message, scene.robot.radius, more)


def _cells_within(
    scene: Scene, message: ObstacleMessage | None, reach: float, more: Floats | None = None
) -> frozenset[Cell]:
    """The cells whose centres are nearer than so many metres to an obstacle's rim, and those it is on."""
    grid, cells = scene.grid, set()
    if message is None:
        return frozenset()
    wide = message.radius + reach if more is None else message.radius + reach + more
    for (x, y), metres in zip(message.xy.tolist(), wide.tolist(), strict=True):
        if not (math.isfinite(x) and math.isfinite(y)):
            continue
        far = metres / grid.resolution
        own = (math.floor(x + 0.5), math.floor(y + 0.5))
        if grid.contains(own):
            cells.add(own)
        cx, cy = _window(
            grid, math.ceil(x - far), math.floor(x + far), math.ceil(y - far), math.floor(y + far)
        )
        near = (cx - x) * (cx - x) + (cy - y) * (cy - y) < far * far - 1e-9
        cells.update(_named(near, cx, cy))
    return frozenset(cells)


def squares_near(
    scene: Scene, message: ObstacleMessage | None, more: Floats | None = None
) -> frozenset[Cell]:
    """Every cell whose square an obstacle as reported overlaps, or comes nearer to than ``more`` metres, (m,)."""
    if message is None:
        return frozenset()
    finite = np.isfinite(message.xy).all(axis=1)
    radius = message.radius if more is None else message.radius + more
    return frozenset(_overlapped(scene, message.xy[finite], radius[finite]))


def covered_cells(scene: Scene, message: ObstacleMessage) -> list[Cell]:
    """Cells whose squares obstacles overlap where they are said to be, in order of the obstacles."""
    return _overlapped(scene, message.xy, message.radius)


def _overlapped(scene: Scene, xy: Points, radii: Floats) -> list[Cell]:
    """Cells whose squares discs overlap, in order of the discs."""
    found: dict[Cell, None] = {}
    resolution = scene.grid.resolution
    for (x, y), radius in zip(xy.tolist(), radii.tolist(), strict=True):
        reach = radius / resolution - 1e-9
        left, right = math.floor(x - reach + 0.5), math.floor(x + reach + 0.5)
        cx, cy = _window(scene.grid, left, right, math.floor(y - reach + 0.5), math.floor(y + reach + 0.5))
        gx, gy = np.maximum(np.abs(cx - x) - 0.5, 0.0), np.maximum(np.abs(cy - y) - 0.5, 0.0)
        found.update(dict.fromkeys(_named(gx * gx + gy * gy < reach * reach, cx, cy)))
    return list(found)


def _window(grid: Grid, left: int, right: int, top: int, bottom: int) -> tuple[_Ints, _Ints]:
    """Columns (1, w) and rows (h, 1) from one to the other that the grid has.

    Cut before anything is asked of a cell: an obstacle may be said to reach 1e9 cells.
    """
    return (
        np.arange(max(left, 0), min(right, grid.width - 1) + 1)[np.newaxis, :],
        np.arange(max(top, 0), min(bottom, grid.height - 1) + 1)[:, np.newaxis],
    )


def _named(chosen: BoolGrid, cx: _Ints, cy: _Ints) -> Iterator[Cell]:
    """The chosen cells of a window, row by row."""
    rows, columns = np.nonzero(chosen)
    return zip(cx[0, columns].tolist(), cy[rows, 0].tolist(), strict=True)


def nearest_cell(scene: Scene, free: BoolGrid, xy: tuple[float, float], shut: Iterable[Cell]) -> Cell:
    """The nearest cell to which the robot can go straight from ``xy`` and stand; one that is not shut if any.

    Where there is none at all, the cell it is on.
    """
    x, y = xy
    own = (math.floor(x + 0.5), math.floor(y + 0.5))
    shut = set(shut)
    found: list[tuple[bool, float, Cell]] = []
    for cy in range(own[1] - 2, own[1] + 3):
        for cx in range(own[0] - 2, own[0] + 3):
            if scene.grid.contains((cx, cy)) and free[cy, cx]:
                squared = (cx - x) * (cx - x) + (cy - y) * (cy - y)
                found.append(((cx, cy) in shut and (cx, cy) != own, squared, (cx, cy)))
    radius = scene.robot.radius / scene.grid.resolution
    for _, _, cell in sorted(found):
        if line_is_clear(scene.grid.blocked, xy, (float(cell[0]), float(cell[1])), radius):
            return cell
    return own


def points_of(plan: Plan, xy: tuple[float, float]) -> Points:
    """The corners of a plan's path, begun where the robot is."""
    assert plan.path is not None
    cells = plan.path.cells if plan.waypoints is None else plan.waypoints
    points = cells.astype(np.float64)
    if (points[0] == xy).all():
        return points
    return np.concatenate((np.array([xy]), points))


def curve_from(
    plan: Plan,
    scene: Scene,
    xy: tuple[float, float],
    message: ObstacleMessage | None,
    smooth: Smooth,
    blocked: Sequence[Cell] = (),
    more: Floats | None = None,
) -> Curve:
    """The curve of a plan, begun where the robot is; it keeps off the cells of obstacles, and of ``more``.

    Without the obstacles a shortcut would lead right through the one that the plan goes round. Cells that the
    robot would touch on the plan's own lines are left out: a curve may come as near to walls as those lines
    do, and obstacles must be no leave to come near to real ones.

    Raises
    ------
    SettingError : see :func:`lampyris.motion.geometry.curve.curve_of`.
    """
    points, grid = points_of(plan, xy), scene.grid
    if len(points) < 2:
        return standing(scene, (float(points[0, 0]), float(points[0, 1])))
    cells = [c for c in sorted(_cells_within(scene, message, 0.0, more)) if not grid.blocked[c[1], c[0]]]
    wanted = wanted_of(plan, grid.resolution)
    taken = [*blocked, *_off(points, cells, scene.robot.radius / grid.resolution)]
    if taken:
        shut = grid.blocked.copy()
        for cx, cy in taken:
            shut[cy, cx] = True
        try:
            return drawn(points, replace(grid, blocked=shut), scene.robot, smooth, wanted)[0]
        except SettingError:
            pass
    return drawn(points, grid, scene.robot, smooth, wanted)[0]


def _off(points: Points, cells: list[Cell], radius: float) -> list[Cell]:
    """Those cells whose squares are at least ``radius`` cells from every line between two points."""
    if not cells:
        return []
    xy = np.array(cells, dtype=np.float64)
    least = np.full(len(cells), np.inf)
    for a, b in pairwise(points.tolist()):
        reach = radius + 1.0
        near = np.abs(xy[:, 0] - 0.5 * (a[0] + b[0])) < 0.5 * abs(a[0] - b[0]) + reach
        near &= np.abs(xy[:, 1] - 0.5 * (a[1] + b[1])) < 0.5 * abs(a[1] - b[1]) + reach
        if near.any():
            squared = square_distances((a[0], a[1]), (b[0], b[1]), xy[near, 0], xy[near, 1])
            least[near] = np.minimum(least[near], squared)
    return [c for c, d in zip(cells, least.tolist(), strict=True) if d > radius * radius]
