"""Two laws to compare with: one safe speed for the whole path, and the fastest that physics allows."""

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
from lampyris.motion.cap_values import Cap
from lampyris.motion.geometry.acceleration_switches import with_switches
from lampyris.motion.geometry.sampled_path import SampledPath, places, sample_path
from lampyris.motion.laws.physical import STATIC, PhysicalLaw, ground_of, turning_cap
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

    creep: float = number(CREEP, 1e-6, 1.0, title="share of speed always left")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "constant."))


@dataclass(frozen=True, slots=True)
class Optimum:
    """Settings of the time optimum: there are none."""


def constant_profile(
    route: Path | SampledPath,
    scene: Scene,
    law: Constant,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """One speed for the whole path, the greatest that our law's caps of the map and the robot all allow.

    Speeding up at the start and braking at the end and where the robot must stop are as quick as they may be.
    What moves says nothing here, nor does ``previous``.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE``, ``START_SPEED``, ``PATH_OUTSIDE``.
    """
    g = ground_of(route, scene, PhysicalLaw(creep=law.creep))
    found = [cap for row in STATIC for cap in row(g)]
    least = min(found, key=lambda cap: float(cap.v.min()))
    one = Cap(least.cause, np.full(len(g.samples), least.v.min()))
    return _profile("constant", route, g.samples, scene, [one], found, v0, on_infeasible)


def optimum_profile(
    route: Path | SampledPath,
    scene: Scene,
    law: Optimum,
    *,
    obstacles: Iterable[Cell] | NDArray[Any] = (),
    obstacle_states: ObstacleStates | None = None,
    v0: float = 0.0,
    previous: Cell | None = None,
    on_infeasible: OnInfeasible = "raise",
) -> Profile:
    """The quickest drive of the path that the robot's limits allow: top speed, bends, acceleration, braking.

    Walls, zones and whatever moves say nothing here: no law that keeps the robot's limits is quicker. On a
    sampled path the profile has the sampled path's nodes and those where its acceleration changes within an edge; without
    a limit on jerk it is the optimum of the curve, not of a grid. On a path of cells it has a node a cell.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE``, ``START_SPEED``.
    """
    made = optimum_at_nodes(route, scene, v0, on_infeasible)
    if not isinstance(route, SampledPath) or route.curve is None or scene.robot.jerk_max is not None:
        return made
    finer = with_switches(route, made.v, scene.robot)
    return made if len(finer) == len(route) else optimum_at_nodes(finer, scene, v0, on_infeasible)


def optimum_at_nodes(
    route: Path | SampledPath, scene: Scene, v0: float = 0.0, on_infeasible: OnInfeasible = "raise"
) -> Profile:
    """The optimum whose acceleration changes at the nodes of the path alone; its speeds there are exact.

    Raises
    ------
    SettingError : ``PROFILE_INFEASIBLE``, ``START_SPEED``.
    """
    samples = route if isinstance(route, SampledPath) else sample_path(route, scene.grid.resolution)
    found = [Cap("limit", caps.limit(len(samples), scene.robot.v_max))]
    if samples.curve is not None or samples.curvature.any():
        found.append(Cap("curvature", caps.curvature(samples.curvature, a_lat_max=scene.robot.a_lat_max)))
    found += turning_cap(samples, scene)
    return _profile("optimum", route, samples, scene, found, found, v0, on_infeasible)


def _profile(
    name: str,
    route: Path | SampledPath,
    samples: SampledPath,
    scene: Scene,
    found: Sequence[Cap],
    faint: Sequence[Cap],
    v0: float,
    on_infeasible: OnInfeasible,
) -> Profile:
    robot, s = scene.robot, samples.s
    made = feasible_profile(
        s,
        found,
        a_max=robot.a_max,
        d_max=robot.d_max,
        v0=v0,
        on_infeasible=on_infeasible,
        stop=samples.stop,
        jerk_max=robot.jerk_max,
    )
    caps_ = tuple((cap.cause, cap.v) for cap in faint)
    return Profile(name, s, made.v, made.a, made.t, made.cause, "m/s", made.cause_index, caps_, places(route))
