"""Two laws to compare with: one safe speed for the whole way, and the fastest that physics allows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.defaults import CREEP
from lampyris._core.settings import check_settings, number, under_code
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.path import Path
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.motion import caps
from lampyris.motion.cap import Cap
from lampyris.motion.geometry.acceleration_switches import with_switches
from lampyris.motion.geometry.sampled_path import SampledPath, course_of_path, places
from lampyris.motion.laws.physical import STATIC, PhysicalLaw, ground_of
from lampyris.motion.profile import OnInfeasible, feasible_profile
from lampyris.typing import Cell


@dataclass(frozen=True, slots=True)
class Constant:
    """Settings of the constant safe speed.

    Parameters
    ----------
    creep : as for :class:`lampyris.motion.laws.physical.PhysicalLaw`.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    creep: float = number(CREEP, 1e-6, 1.0)

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "constant."))


@dataclass(frozen=True, slots=True)
class Optimum:
    """Settings of the time optimum: there are none."""


def constant_profile(
    way: Path | SampledPath,
    scene: Scene,
    law: Constant,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    movers: ObstacleStates | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """One speed for the whole way, the greatest that our law's caps of the map and the robot all allow.

    Speeding up at the start and braking at the end and where the robot must stop are as quick as they may be.
    What moves says nothing here, nor does ``previous``.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE``, ``START_SPEED``, ``PATH_OUTSIDE``.
    """
    g = ground_of(way, scene, PhysicalLaw(creep=law.creep))
    found = [cap for row in STATIC for cap in row(g)]
    least = min(found, key=lambda cap: float(cap.v.min()))
    one = Cap(least.cause, np.full(len(g.course), least.v.min()))
    return _profile("constant", way, g.course, scene, [one], found, v0, on_infeasible)


def optimum_profile(
    way: Path | SampledPath,
    scene: Scene,
    law: Optimum,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    movers: ObstacleStates | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """The quickest drive of the way that the robot's limits allow: top speed, bends, acceleration, braking.

    Walls, zones and whatever moves say nothing here: no law that keeps the robot's limits is quicker. On a
    course the profile has the course's nodes and those where its acceleration changes within an edge; without
    a limit on jerk it is the optimum of the curve, not of a grid. On a path of cells it has a node a cell.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE``, ``START_SPEED``.
    """
    made = optimum_at_nodes(way, scene, v0, on_infeasible)
    if not isinstance(way, SampledPath) or way.curve is None or scene.robot.jerk_max is not None:
        return made
    finer = with_switches(way, made.v, scene.robot)
    return made if len(finer) == len(way) else optimum_at_nodes(finer, scene, v0, on_infeasible)


def optimum_at_nodes(
    way: Path | SampledPath, scene: Scene, v0: float = 0.0, on_infeasible: OnInfeasible = "raise"
) -> Profile:
    """The optimum whose acceleration changes at the nodes of the way alone; its speeds there are exact.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE``, ``START_SPEED``.
    """
    course = way if isinstance(way, SampledPath) else course_of_path(way, scene.grid.resolution)
    found = [Cap("limit", caps.limit(len(course), scene.robot.v_max))]
    if course.curve is not None or course.curvature.any():
        found.append(Cap("curvature", caps.curvature(course.curvature, a_lat_max=scene.robot.a_lat_max)))
    return _profile("optimum", way, course, scene, found, found, v0, on_infeasible)


def _profile(
    name: str,
    way: Path | SampledPath,
    course: SampledPath,
    scene: Scene,
    found: Sequence[Cap],
    faint: Sequence[Cap],
    v0: float,
    on_infeasible: OnInfeasible,
) -> Profile:
    robot, s = scene.robot, course.s
    made = feasible_profile(
        s,
        found,
        a_max=robot.a_max,
        d_max=robot.d_max,
        v0=v0,
        on_infeasible=on_infeasible,
        stop=course.stop,
        jerk_max=robot.jerk_max,
    )
    caps_ = tuple((cap.cause, cap.v) for cap in faint)
    return Profile(name, s, made.v, made.a, made.t, made.cause, "m/s", made.cause_index, caps_, places(way))
