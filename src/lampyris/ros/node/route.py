"""A planned path as the follower drives it: nodes with speeds, in sections between stops."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris import api
from lampyris._core import elementary
from lampyris.errors import SettingError
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.robot import Polygon, Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.typing import Floats

AHEAD, REVERSE = 1, -1


@dataclass(frozen=True)
class RouteSection:
    """A part of a route that is driven in one go; the robot stands before and after it.

    Parameters
    ----------
    s : float64 (n,), metres from the begin of the route, rising.
    xy : float64 (n, 2), metres of the map frame.
    yaw : float64 (n,), headings of the robot, without jumps by a whole turn.
    v : float64 (n,), m/s >= 0.
    gear : 1 ahead, -1 in reverse.
    first : index of its first node in the profile.
    """

    s: Floats
    xy: Floats
    yaw: Floats
    v: Floats
    gear: int
    first: int


@dataclass(frozen=True)
class Route:
    """What is driven.

    Parameters
    ----------
    sections : in order; none if the robot is there already.
    goal : pose to stand in at the end; a yaw of None: any.
    profile : the speeds, with causes.
    poses : float64 (n, 3): the path, for others to see.
    """

    sections: tuple[RouteSection, ...]
    goal: tuple[float, float, float | None]
    profile: Profile
    poses: Floats

    @property
    def length(self) -> float:
        """Metres."""
        return float(self.sections[-1].s[-1]) if self.sections else 0.0


def widened(robot: Robot, margin: float) -> Robot:
    """The robot with an outline that is farther out by a margin, metres."""
    if robot.footprint is None:
        return replace(robot, radius=robot.radius + margin)
    share = 1.0 + margin / robot.inscribed_radius
    outline: Polygon = tuple((x * share, y * share) for x, y in robot.footprint)
    return replace(robot, footprint=outline)


def route_of_plan(scene: Scene, plan: Plan, law: str, yaw: float | None, **settings: object) -> Route:
    """The route of a plan that found a path.

    Parameters
    ----------
    scene, plan : of the widened robot.
    law : speed law; ``settings`` are its own.
    yaw : the heading at the goal; None: any.
    """
    if plan.pose_path is not None:
        profile = api.speed_profile(scene, plan, law, law_settings=settings)
        poses = plan.pose_path
        turned = poses.turned_in_place
        arm = max(float(profile.s[-1]) - poses.length_m, 0.0) / turned if turned > 0 else 0.0
        assert profile.xy is not None
        xy = scene.grid.to_metres(profile.xy)
        gear = poses.gear_at(profile.s, arm)
        sections = _by_gear(profile, xy, np.unwrap(poses.yaw_at(profile.s, arm)), gear)
        end = poses.poses[-1]
        return Route(sections, (*end[:2].tolist(), yaw), profile, poses.poses)
    # A path that is pulled straight would pass by its via points.
    path = api.smooth(scene, plan, method="arcs" if plan.via else "straight")
    return route_of_path(scene, path, law, yaw, **settings)


def route_of_path(scene: Scene, path: SampledPath, law: str, yaw: float | None, **settings: object) -> Route:
    """The route of a sampled path, driven ahead."""
    profile = api.speed_profile(scene, path, law, law_settings=settings)
    if not profile.metric:
        allowed = "a law in m/s; `lampyris laws` lists them"
        raise SettingError("LAW", f"law {law!r} is in {profile.units}", where="law", allowed=allowed)
    xy = scene.grid.to_metres(path.xy)
    hx, hy = path.heading.T
    angles = np.unwrap(elementary.atan2(0.0 - hy, hx) + scene.grid.origin[2])
    cuts = [0, *(k for k in np.flatnonzero(path.stop).tolist() if 0 < k < len(xy) - 1), len(xy) - 1]
    sections = []
    for a, b in pairwise(cuts):
        if b > a:
            along = angles[a : b + 1].copy()
            along[-1] = along[-2] if path.stop[b] else along[-1]  # the last heading is that of the turn
            sections.append(
                RouteSection(profile.s[a : b + 1], xy[a : b + 1], along, profile.v[a : b + 1], AHEAD, a)
            )
    return Route(tuple(sections), (*xy[-1].tolist(), yaw), profile, np.column_stack((xy, angles)))


def _by_gear(profile: Profile, xy: Floats, yaw: Floats, gear: NDArray[np.int64]) -> tuple[RouteSection, ...]:
    """Sections of one gear; turns in place are what lies between two of them."""
    sections: list[RouteSection] = []
    n, a = len(xy), 0
    while a < n - 1:
        b = a + 1
        while b < n - 1 and gear[b] == gear[a]:
            b += 1
        if gear[a] != 0:
            part = slice(a, b + 1)
            sections.append(
                RouteSection(profile.s[part], xy[part], yaw[part], profile.v[part], int(gear[a]), a)
            )
        a = b
    return tuple(sections)


def wrapped(angle: float) -> float:
    """An angle in -pi .. pi."""
    return math.remainder(angle, 2.0 * math.pi)
