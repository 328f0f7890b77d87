"""Our law: a table of caps in SI units, the robot's limits, and room enough to stop.

Each rule is a row: it looks at the sampled path and tells caps; rows are in the order in which ties are decided.
The speed laws of the dissertation's related work are rows that are off unless asked for.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris._core.defaults import CREEP
from lampyris._core.settings import check_settings, flag, number, under_code
from lampyris.errors import SettingError
from lampyris.kernels.motion.nearest_wall import nearest_squares
from lampyris.model.grid import frozen
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion import caps
from lampyris.motion.cap_values import Around, Cap
from lampyris.motion.geometry.sampled_path import SampledCellPath, SampledPath, places, sample_path
from lampyris.motion.geometry.shape_clearance import distance_along, turn_rate
from lampyris.motion.laws.rings import as_cells
from lampyris.motion.profile import OnInfeasible, feasible_profile
from lampyris.motion.safety.blind_areas import BlindArea, blind_cap
from lampyris.motion.safety.danger_cloud import CloudModel, cloud_cap
from lampyris.motion.safety.moving_obstacles import MovingObstacles, moving_cap
from lampyris.motion.safety.surroundings import cells_distance, reach_of, room, zone_limits
from lampyris.motion.safety.three_speed import ThreeSpeed, three_speed_cap
from lampyris.motion.safety.uncertainty import Uncertainty, uncertainty_cap
from lampyris.motion.settings import checked_kind
from lampyris.typing import BoolGrid, Cell, Floats

_FAR = 2**62
"""Squared half cells where nothing is within reach."""


@dataclass(frozen=True, slots=True)
class Approach:
    """Settings of the approach to the goal, see :func:`lampyris.motion.caps.approach`.

    Parameters
    ----------
    distance : metres before the goal where the robot begins to slow down.
    speed : m/s, never less than this for the goal's sake, unless the robot's v_max is.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    distance: float = number(1.0, 1e-6, 1e6, unit="m")
    speed: float = number(0.05, 1e-6, 1e6, unit="m/s")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "physical.approach."))


RULES: Mapping[str, type] = MappingProxyType(
    {
        "approach": Approach,
        "uncertainty": Uncertainty,
        "blind": BlindArea,
        "three_speed": ThreeSpeed,
        "cloud": CloudModel,
        "moving": MovingObstacles,
    }
)
"""Rules that have settings of their own."""


@dataclass(frozen=True, slots=True)
class PhysicalLaw:
    """Settings of our law and its variants; the limits themselves are the robot's.

    Parameters
    ----------
    creep : share of the robot's v_max that no clearance takes away, 0 < creep <= 1. A path is planned
        through free cells, so a robot in a tight place must go on; at a tenth of its top speed it stops
        within a hundredth of the distance it needs from top speed (5 mm for the default robot).
    curvature, clearance, zones : whether the rule is on.
    approach, uncertainty, blind, three_speed, cloud : settings of the rule; None: it is off.
    moving : how moving obstacles are considered, where the law is given any.
    name : of the law these are the settings of; what the profile says.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    creep: float = number(CREEP, 1e-6, 1.0, title="share of speed always left")
    curvature: bool = flag(True)
    clearance: bool = flag(True)
    zones: bool = flag(True)
    approach: Approach | None = None
    uncertainty: Uncertainty | None = None
    blind: BlindArea | None = None
    three_speed: ThreeSpeed | None = None
    cloud: CloudModel | None = None
    moving: MovingObstacles = field(default_factory=MovingObstacles)
    name: str = field(default="physical", kw_only=True)

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "physical."))
        for name, kind in RULES.items():
            checked_kind(f"physical.{name}", getattr(self, name), kind, none=name != "moving")


class CapContext(NamedTuple):
    """What a rule looks at.

    Parameters
    ----------
    samples, scene, law, around : see there.
    cells : int64 (n, 2), where the path is a path of cells: there, bounds hold at the nodes alone.
    """

    samples: SampledPath
    scene: Scene
    law: PhysicalLaw
    around: Around
    cells: NDArray[np.int64] | None

    @property
    def enough(self) -> float:
        """Metres from the centre at which no surface slows the robot any more."""
        return _enough(self.scene)

    @property
    def rings(self) -> int:
        """The same as whole rings of cells around a cell."""
        return rings_felt(self.scene)

    def stopping(self, distance: Floats) -> Floats:
        """The clearance cap for so many metres to a surface."""
        robot = self.scene.robot
        creep = self.law.creep * robot.v_max
        return caps.clearance(distance, radius=robot.radius, d_max=robot.d_max, creep=creep)


def _enough(scene: Scene) -> float:
    robot = scene.robot
    return robot.v_max * robot.v_max / (2.0 * robot.d_max) + robot.radius


def rings_felt(scene: Scene) -> int:
    """Whole rings of cells around a cell beyond which no surface slows the robot."""
    grid = scene.grid
    reach = min(_enough(scene) / grid.resolution, float(max(grid.blocked.shape)))
    return max(0, math.ceil(reach + 0.5) - 1)


Rule: TypeAlias = Callable[[CapContext], list[Cap]]
"""One row of the law."""


def _limit(g: CapContext) -> list[Cap]:
    return [Cap("limit", caps.limit(len(g.samples), g.scene.robot.v_max))]


def _curvature(g: CapContext) -> list[Cap]:
    turns = g.samples.curve is not None or bool(g.samples.curvature.any())
    if not g.law.curvature or not turns:
        return []
    return [Cap("curvature", caps.curvature(g.samples.curvature, a_lat_max=g.scene.robot.a_lat_max))]


def turning_cap(samples: SampledPath, scene: Scene) -> list[Cap]:
    """The robot's yaw rate on a curve of poses, if it has a limit."""
    rate, most = turn_rate(samples), scene.robot.yaw_rate_max
    return [] if rate is None or most is None else [Cap("yaw rate", caps.yaw_rate(rate, yaw_rate_max=most))]


def _turning(g: CapContext) -> list[Cap]:
    return turning_cap(g.samples, g.scene)


def _clearance(g: CapContext) -> list[Cap]:
    if not g.law.clearance:
        return []
    if g.cells is None:
        reach = reach_of(g.samples, g.enough)
        near = room(g.samples, distance_along(g.samples, g.scene.grid, reach), reach)
        return [Cap("clearance", g.stopping(near))]
    squared = wall_squares(g.cells, g.scene.grid.blocked, g.rings)
    return [] if squared is None else [Cap("clearance", g.stopping(_metres(squared, g.scene)))]


def _zones(g: CapContext) -> list[Cap]:
    if not g.law.zones or g.scene.zones is None:
        return []
    return [Cap("zone", zone_limits(g.samples, g.scene.zones))]


def _obstacles(g: CapContext) -> list[Cap]:
    if len(g.around.cells) == 0:
        return []
    if g.cells is None:
        reach = reach_of(g.samples, g.enough)
        near = cells_distance(g.samples.xy, g.around.cells, g.samples.resolution, reach)
        return [] if near is None else [Cap("obstacle", g.stopping(room(g.samples, near, reach)))]
    squared = obstacle_squares(g.cells, g.around.cells, g.rings)
    return [] if squared is None else [Cap("obstacle", g.stopping(_metres(squared, g.scene)))]


def _moving(g: CapContext) -> list[Cap]:
    if g.around.obstacle_states is None:
        return []
    return list(moving_cap(g.samples, g.scene, g.law.moving, g.around))


def _approach(g: CapContext) -> list[Cap]:
    rule = g.law.approach
    if rule is None:
        return []
    s, v_max = g.samples.s, g.scene.robot.v_max
    # The rule's speed falls along the path: what holds at the next node holds on the edge.
    left = np.append(s[-1] - s[1:], 0.0)
    v = caps.approach(left, v_max=v_max, distance=rule.distance, v_app=min(rule.speed, v_max))
    return [Cap("approach", v)]


def _guest(name: str, build: Callable[[SampledPath, Scene, Any, Around], list[Cap]]) -> Rule:
    """A rule with settings of its own, off where it has none."""

    def row(g: CapContext) -> list[Cap]:
        settings = getattr(g.law, name)
        return [] if settings is None else list(build(g.samples, g.scene, settings, g.around))

    return row


_uncertainty, _blind = _guest("uncertainty", uncertainty_cap), _guest("blind", blind_cap)
TABLE: tuple[Rule, ...] = (
    _limit,
    _curvature,
    _turning,
    _clearance,
    _zones,
    _uncertainty,
    _blind,
    _obstacles,
    _moving,
    _guest("three_speed", three_speed_cap),
    _guest("cloud", cloud_cap),
    _approach,
)
"""The rules, in the order in which ties are decided."""

STATIC: tuple[Rule, ...] = (_limit, _curvature, _turning, _clearance, _zones, _uncertainty, _blind)
"""Those that neither what moves nor the goal changes: the map's and the robot's."""


def ground_of(
    route: Path | SampledPath,
    scene: Scene,
    law: PhysicalLaw,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    obstacle_states: ObstacleStates | None = None,
) -> CapContext:
    """What the rules look at, from a path of cells or a sampled path."""
    around = Around(as_cells(obstacles), obstacle_states)
    if isinstance(route, SampledPath):
        cells = route.cells if isinstance(route, SampledCellPath) else None
        return CapContext(route, scene, law, around, cells)
    samples = sample_path(route, scene.grid.resolution)
    return CapContext(samples, scene, law, around, route.cells.astype(np.int64))


def physical_profile(
    route: Path | SampledPath,
    scene: Scene,
    law: PhysicalLaw,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """A profile in metres and seconds: v in m/s, a in m/s2, t in s; docs/speed/README.md has the equations.

    On a sampled path every rule holds at and between the nodes. On a path of cells the clearance and the moving
    obstacles' cells are those of the nodes alone, corners have no curvature, and no stops; what drives there
    goes from cell to cell, tick by tick. (Sampled by
    :func:`lampyris.motion.geometry.sampled_path.sample_with_corners` it has both.) A node that a cell of an
    obstacle covers has no clearance and is passed at creep speed: avoiding it is the planner's task, not the
    profile's. The edge of the map is not a wall.

    ``previous`` says nothing here.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE`` (unless ``on_infeasible`` is ``brake``), ``PROFILE_BLOCKED``,
        ``START_SPEED``, ``PATH_OUTSIDE``.
    """
    g = ground_of(route, scene, law, obstacles, obstacle_states)
    found = [cap for row in TABLE for cap in row(g)]
    robot, samples = scene.robot, g.samples
    made = feasible_profile(
        samples.s,
        found,
        a_max=robot.a_max,
        d_max=robot.d_max,
        v0=v0,
        on_infeasible=on_infeasible,
        stop=samples.stop,
        jerk_max=robot.jerk_max,
    )
    return Profile(
        law.name,
        samples.s,
        made.v,
        made.a,
        made.t,
        made.cause,
        "m/s",
        made.cause_index,
        tuple((cap.cause, cap.v) for cap in found),
        places(route),
    )


def map_clearance_cap(cells: NDArray[np.int64], scene: Scene, law: PhysicalLaw) -> Floats | None:
    """The clearance cap at the centres of cells, m/s, (n,), as on a path of cells; None: no wall slows the robot.

    Parameters
    ----------
    cells : int64 (n, 2), of the map, in any order.
    """
    nowhere = SampledPath(
        np.zeros(1),
        np.zeros((1, 2)),
        np.zeros((1, 2)),
        np.zeros(1),
        np.zeros(1, dtype=np.bool_),
        scene.grid.resolution,
    )
    g = CapContext(nowhere, scene, law, Around(), cells)
    squared = wall_squares(cells, scene.grid.blocked, g.rings)
    return None if squared is None else g.stopping(_metres(squared, scene))


def _metres(squared: NDArray[np.int64], scene: Scene) -> Floats:
    """Metres from squared half cells."""
    return np.where(squared == _FAR, np.inf, np.sqrt(squared) * (0.5 * scene.grid.resolution))


def wall_squares(cells: NDArray[np.int64], blocked: BoolGrid, rings: int) -> NDArray[np.int64] | None:
    """Squared half cells from each centre to the nearest blocked square within so many rings.

    None where the whole surroundings of the path hold none.

    Raises
    ------
    SettingError : ``PATH_OUTSIDE``: a cell outside the map.
    """
    x, y = cells[:, 0], cells[:, 1]
    x0, y0, x1, y1 = int(x.min()), int(y.min()), int(x.max()), int(y.max())
    height, width = blocked.shape
    if x0 < 0 or y0 < 0 or x1 >= width or y1 >= height:
        raise SettingError(
            "PATH_OUTSIDE",
            f"cells from ({x0}, {y0}) to ({x1}, {y1})",
            where="path",
            allowed=f"cells of the map, {width} x {height}",
        )
    # Only the piece of the map around the path: the kernel's plain form turns its arrays into lists.
    x0, y0 = max(x0 - rings, 0), max(y0 - rings, 0)
    piece = frozen(np.ascontiguousarray(blocked[y0 : y1 + rings + 1, x0 : x1 + rings + 1]))
    if not piece.any():
        return None
    squared = np.full(len(cells), _FAR, dtype=np.int64)
    xs, ys = x - x0, y - y0
    if rings == 0:
        squared[piece[ys, xs]] = 0
    else:
        nearest_squares(piece.ravel(), piece.shape[1], piece.shape[0], xs, ys, rings, squared)
    return squared


def obstacle_squares(
    cells: NDArray[np.int64], occupied: NDArray[np.int64], rings: int
) -> NDArray[np.int64] | None:
    """The same to the nearest of ``occupied``, int64 (m, 2); None if none is that near to the path's box."""
    x, y = cells[:, 0], cells[:, 1]
    bx, by = occupied[:, 0], occupied[:, 1]
    near = (bx >= x.min() - rings) & (bx <= x.max() + rings)
    near &= (by >= y.min() - rings) & (by <= y.max() + rings)
    bx, by = bx[near], by[near]
    if len(bx) == 0:
        return None
    squared = np.empty(len(cells), dtype=np.int64)
    # Blocks keep the table small however long the path and however many the obstacles. Obstacles lie along the
    # first axis: the minimum over them then runs over whole rows.
    block = max(1, 1_000_000 // len(bx))
    for k in range(0, len(cells), block):
        gx = np.maximum(2 * np.abs(bx[:, None] - x[k : k + block]) - 1, 0)
        gy = np.maximum(2 * np.abs(by[:, None] - y[k : k + block]) - 1, 0)
        squared[k : k + block] = (gx * gx + gy * gy).min(axis=0)
    return squared
