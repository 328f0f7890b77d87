"""Safest fast speed under uncertainty: what fits a narrow place, and what leaves time to look.

The two criteria are those of Miura, Negishi and Shirai (Robotics and Autonomous Systems 54, 2006, 110-117).
Their formulas could not be found: those here are ours, derived in docs/speed/uncertainty.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lampyris._core.defaults import CREEP
from lampyris._core.settings import check_settings, number, under_code, whole
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.motion import caps
from lampyris.motion.cap_values import Around, Cap
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.motion.geometry.shape_clearance import distance_along
from lampyris.motion.safety.surroundings import reach_of, room


@dataclass(frozen=True, slots=True)
class Uncertainty:
    """Settings of the uncertainty caps.

    Parameters
    ----------
    sigma_0 : metres, standard deviation of the position across the path while standing: map and localisation.
    sigma_v : seconds: what each m/s adds to it, such as the time between two fixes times the drift a metre.
    k : standard deviations that must fit between the robot and the nearest surface.
    observations : how often a place must be seen before it counts as free.
    period : seconds between two observations.
    creep : share of the robot's v_max that no uncertainty takes away.

    Raises
    ------
    SettingError : ``LAW_SETTING``.
    """

    sigma_0: float = number(0.02, 0.0, 1e3, unit="m", title="position error at rest")
    sigma_v: float = number(0.05, 1e-6, 1e3, unit="s", title="position error with speed")
    k: float = number(3.0, 1e-3, 1e3, title="standard deviations kept")
    observations: int = whole(5, 1, 1_000_000)
    period: float = number(0.1, 1e-6, 1e3, unit="s")
    creep: float = number(CREEP, 1e-6, 1.0, title="share of speed always left")

    def __post_init__(self) -> None:
        check_settings(self, under_code("LAW_SETTING", "physical.uncertainty."))


def uncertainty_cap(samples: SampledPath, scene: Scene, settings: Uncertainty, around: Around) -> list[Cap]:
    """Caps ``uncertainty`` (room for k standard deviations) and ``undecided`` (time for enough looks).

    The nearest surface, and the nearest cell that the map knows nothing of, are measured on the sampled path, and
    hold between its nodes. A map without unknown cells has no undecided region. ``around`` says nothing here:
    what moves has caps of its own.
    """
    robot, one = scene.robot, settings
    creep = one.creep * robot.v_max
    enough = robot.radius + one.k * (one.sigma_0 + one.sigma_v * robot.v_max)
    reach = reach_of(samples, enough)
    free = room(samples, distance_along(samples, scene.grid, reach), reach) - robot.radius
    speed = caps.narrow(free, sigma_0=one.sigma_0, sigma_v=one.sigma_v, k=one.k, creep=creep)
    found = [Cap("uncertainty", speed)]
    unknown = scene.grid.unknown
    if unknown is not None and unknown.any():
        seen = Grid(unknown, resolution=scene.grid.resolution)
        reach = reach_of(samples, robot.radius + one.observations * one.period * robot.v_max)
        ahead = np.maximum(room(samples, distance_along(samples, seen, reach), reach) - robot.radius, 0.0)
        found.append(
            Cap(
                "undecided",
                caps.undecided(ahead, observations=one.observations, period=one.period, creep=creep),
            )
        )
    return found
