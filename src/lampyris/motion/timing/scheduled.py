"""The schedule of a plan as a robot can drive it: real accelerations, the waits where they are needed."""

from __future__ import annotations

import numpy as np

from lampyris._core import elementary
from lampyris.errors import SettingError
from lampyris.model.path import Path
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.motion.geometry.sampled_path import SampledPath, corners_of_path, sample_path
from lampyris.motion.laws.physical import PhysicalLaw, physical_profile
from lampyris.motion.timing.obstacle_tracks import tracks_from_recorded
from lampyris.motion.timing.path_time import through_tracks
from lampyris.motion.timing.profile_on_nodes import with_nodes

_PARTS = 4
"""Edges to a step of the path: speeds between nodes follow their caps so closely."""


def scheduled_profile(
    plan: Plan, scene: Scene, tick_seconds: float, *, law: PhysicalLaw | None = None
) -> Profile:
    """The fastest profile along a plan's path among the scene's recorded obstacles, moving tick by tick.

    A plan's schedule says at which tick to be on which cell; a robot of limited acceleration is later. This
    asks again when to drive along the path, so its waits may be elsewhere than the schedule's, and where the
    robot is too slow for a gap there may be no path at all. It starts at the schedule's first tick, or at tick
    0. Obstacles whose tracks are not recorded are not looked at.

    Parameters
    ----------
    plan : one with a path, such as of ``sipp`` or ``space-time-astar``.
    tick_seconds : how long a tick takes, seconds.
    law : settings of the static caps; None: the defaults.

    Returns
    -------
    A profile whose t begins at 0. ``cause_index`` of ``wait`` and ``moving obstacle`` is the number of the obstacle
    in ``scene.traffic``.

    Raises
    ------
    SettingError : ``NO_PATH``, ``TICK``, ``PROFILE_BLOCKED``, and what ``through_tracks`` names.
    """
    if plan.path is None:
        raise SettingError("NO_PATH", plan.sentence, where="plan", allowed="a plan with a path")
    tracks = tracks_from_recorded(scene.traffic, tick_seconds, scene.grid.resolution)
    samples = divided(plan.path, scene.grid.resolution, scene.robot)
    still = physical_profile(samples, scene, PhysicalLaw() if law is None else law)
    v_cap = np.min([v for _, v in still.caps], axis=0)
    begin = 0 if plan.schedule is None else int(plan.schedule[0])
    made = through_tracks(samples, v_cap, scene.robot, tracks, t0=begin * tick_seconds, law=still.law)
    made = with_nodes(made, still, samples, scene.robot.a_max)
    number = np.array([k for k, one in enumerate(scene.traffic) if isinstance(one, Recorded)], dtype=np.int64)
    whose = np.isin(made.cause, ("wait", "moving obstacle")) & (made.cause_index >= 0)
    cause_index = made.cause_index.copy()
    cause_index[whose] = number[cause_index[whose]]
    return Profile(
        made.law, made.s, made.v, made.a, made.t, made.cause, made.units, cause_index, made.caps, made.xy
    )


def divided(path: Path, resolution: float, robot: Robot) -> SampledPath:
    """A path of cells as a sampled path whose every step is divided evenly; its corners have their curvature.

    Where a corner is tighter than the robot's turning circle, or the path turns back on itself, it is a stop.
    """
    whole, corners = sample_path(path, resolution), corners_of_path(path, resolution, robot)
    n = len(whole)
    at = np.arange((n - 1) * _PARTS + 1) / _PARTS
    nodes = np.arange(n)
    s = elementary.interp(at, nodes, whole.s)
    xy = np.stack([elementary.interp(at, nodes, whole.xy[:, k]) for k in (0, 1)], axis=-1)
    heading = whole.heading[np.minimum(np.arange(len(at)) // _PARTS, n - 1)]
    kappa, stop = np.zeros(len(at)), np.zeros(len(at), dtype=np.bool_)
    stop[_PARTS * corners.node[corners.stop]] = True
    arcs = ~corners.stop
    node, bend = corners.node[arcs], 1.0 / corners.radius[arcs]
    for k in range(-(_PARTS // 2), _PARTS // 2 + 1):
        np.maximum.at(kappa, _PARTS * node + k, bend)
    return SampledPath(s, xy, heading, kappa, stop, resolution)
