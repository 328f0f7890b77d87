"""The planned path as controllers follow it: sections between stops, and how far the robot has come along them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lampyris._core import elementary
from lampyris.model.curve import PoseCurve
from lampyris.sim.steering.arc import RobotPose, wrapped
from lampyris.typing import Floats

_STEP = 0.25
"""Cells between two samples of a path, at most."""

_LEAST_SAMPLES = 8
"""Parts of a short section."""

_SEARCH = 0.6
"""Metres of the path ahead in which the nearest point is looked for, and half of the robot's reach as well.

Farther ahead the path may come back to where the robot is.
"""


@dataclass(frozen=True, slots=True, eq=False)
class Section:
    """A part of a path between two places where the robot stands.

    Parameters
    ----------
    s : distance of each sample from the beginning of the path, metres, (n,).
    x, y : metres, y up, (n,).
    yaw : radians, without jumps, (n,).
    direction : of travel, without jumps, (n,).
    gear : 1 ahead (or to a side), -1 in reverse, 0 for a turn in place.
    last : whether the path ends with it.
    """

    s: Floats
    x: Floats
    y: Floats
    yaw: Floats
    direction: Floats
    gear: int
    last: bool

    @property
    def end(self) -> RobotPose:
        """Where it ends."""
        return RobotPose(float(self.x[-1]), float(self.y[-1]), float(self.yaw[-1]))


def sections_of(curve: PoseCurve) -> list[Section]:
    """The sections of a path."""
    n = len(curve.lengths)
    if n == 0:
        return []
    begins, gears = curve.begins, curve.gears
    cuts = [0, *(int(k) for k in curve.stops if 0 < k < n), n]
    made = []
    for k in range(len(cuts) - 1):
        first, after = cuts[k], cuts[k + 1]
        low, high = float(begins[first]), float(begins[after])
        step = _STEP * curve.resolution
        count = max(math.ceil((high - low) / step), _LEAST_SAMPLES)
        s = low + (high - low) * np.arange(count + 1) / count
        inside = np.minimum(s, high - 1e-9 * max(high - low, 1.0))
        xy, heading = curve.at(inside)
        yaw = _unwrapped(curve.yaw_at(inside))
        along = _unwrapped(elementary.atan2(-heading[:, 1], heading[:, 0]))
        res = curve.resolution
        made.append(
            Section(s, xy[:, 0] * res, -xy[:, 1] * res, yaw, along, int(gears[first]), k + 2 == len(cuts))
        )
    return made


def _unwrapped(angle: Floats) -> Floats:
    """Angles without jumps."""
    d = np.diff(angle)
    return np.concatenate((angle[:1], angle[0] + np.cumsum(d - 2 * math.pi * np.round(d / (2 * math.pi)))))


class PathProgress:
    """Where on its path a robot is.

    Attributes
    ----------
    sections : of the path.
    k : the present one.
    at : number of the sample that is nearest to the robot.
    s : distance along the path of the point nearest to the robot, metres.
    beside : distance from it, metres, greater than 0 to its left.
    left : metres to the end of the present section; less than 0 beyond it.
    """

    def __init__(self, curve: PoseCurve, reach: float) -> None:
        self.sections = sections_of(curve)
        self._search = _SEARCH + 0.5 * reach
        self.k = self.at = 0
        self.s = self.beside = self.left = 0.0
        self._aside = 0.0

    @property
    def done(self) -> bool:
        """Whether there is no section any more."""
        return self.k >= len(self.sections)

    @property
    def section(self) -> Section:
        """The present one."""
        return self.sections[self.k]

    def next(self) -> None:
        """Go on to the next section."""
        self.k += 1
        self.at = 0

    def update(self, pose: RobotPose) -> None:
        """Find the point nearest to the robot; never one farther behind than a few samples."""
        if self.done:
            return
        one = self.section
        if one.gear == 0:
            self.left = abs(wrapped(float(one.yaw[-1]) - pose.yaw))
            self.s, self.beside = float(one.s[0]), 0.0
            return
        low = max(self.at - 3, 0)
        high = int(np.searchsorted(one.s, one.s[self.at] + self._search, side="right"))
        dx, dy = one.x[low:high] - pose.x, one.y[low:high] - pose.y
        self.at = low + int((dx * dx + dy * dy).argmin())
        k = self.at
        c, q = _unit(one, k)
        ahead = (pose.x - float(one.x[k])) * c + (pose.y - float(one.y[k])) * q
        self.beside = (pose.y - float(one.y[k])) * c - (pose.x - float(one.x[k])) * q
        last = len(one.s) - 1
        s = float(one.s[k]) + ahead
        if k < last:
            s = min(s, float(one.s[-1]))
        self.s = min(max(s, float(one.s[0])), float(one.s[-1]))
        self.left = float(one.s[-1]) - s

    def ahead(self, metres: float) -> tuple[float, float, float]:
        """The point of the present section so far ahead, and its yaw; beyond the end, on its tangent."""
        one = self.section
        s = self.s + metres
        end = float(one.s[-1])
        if s <= end:
            x, y, yaw = (float(elementary.interp(s, one.s, a)) for a in (one.x, one.y, one.yaw))
            return x, y, yaw
        c, q = _unit(one, len(one.s) - 1)
        over = s - end
        return float(one.x[-1]) + over * c, float(one.y[-1]) + over * q, float(one.yaw[-1])


def _unit(one: Section, k: int) -> tuple[float, float]:
    """Direction of travel at a sample."""
    angle = float(one.direction[k])
    return float(elementary.cos(angle)), float(elementary.sin(angle))
