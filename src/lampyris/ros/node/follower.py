"""The controller: velocity commands that keep a robot on a route, at the speeds of its profile.

Lateral control is the one for unicycles along a path (C. Samson: Path following and time-varying feedback stabilization of a
wheeled mobile robot, ICARCV 1992), linear in lateral offset and heading error: errors decay over some 0.4 m whatever the
speed. Between two sections, and where the heading is off by more than 0.5 rad, the robot turns in place.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from lampyris.model.robot import Robot
from lampyris.model.settings.ros_node import NodeSettings
from lampyris.ros.node.route import Route, RouteSection, wrapped
from lampyris.ros.transforms import PlanePose

OFFSET_GAIN, HEADING_GAIN = 8.0, 4.0
"""1/m2 and 1/m."""
TURN_FIRST = 0.5
"""rad: a heading that is off by more is corrected in place."""
CREEP = 0.05
"""m/s: the least speed on the last centimetres of a section."""
YAW_SPEED, YAW_ACCELERATION = 1.0, 2.0
"""rad/s and rad/s2 of turns in place, at most."""
LOST = 0.5
"""Metres: who is farther from the route needs a new one."""


class Velocity(NamedTuple):
    """A velocity with what limits it; ``done``: the route is finished; ``lost``: the robot is not on it."""

    v: float
    w: float
    cause: str
    done: bool = False
    lost: bool = False


class Follower:
    """Follows one route.

    Parameters
    ----------
    route, robot, settings : the path, the robot that follows it, the settings.
    """

    def __init__(self, route: Route, robot: Robot, settings: NodeSettings) -> None:
        self.route, self._robot, self._settings = route, robot, settings
        self._k, self._node = 0, 0
        self._turning = True  # towards the first section
        self.s = 0.0
        outer = max(robot.radius, 1e-3)
        self._yaw_rate = robot.yaw_rate_max or min(YAW_SPEED, robot.v_max / outer)

    @property
    def left(self) -> float:
        """Metres that are left."""
        return max(self.route.length - self.s, 0.0)

    def command(self, at: PlanePose, w_now: float) -> Velocity:
        """The command for a pose.

        Parameters
        ----------
        at : pose in the map frame.
        w_now : yaw rate, rad/s.
        """
        sections = self.route.sections
        while self._k < len(sections):
            section = sections[self._k]
            if self._turning:
                turn = self._turn(at[2], float(section.yaw[0]), w_now)
                if turn is not None:
                    return turn
                self._turning, self._node = False, 0
            made = self._along(section, at)
            if made is not None:
                return made
            self._k, self._turning = self._k + 1, True
        yaw = self.route.goal[2]
        if yaw is not None and self._can_turn:
            turn = self._turn(at[2], yaw, w_now)
            if turn is not None:
                return turn
        return Velocity(0.0, 0.0, "goal", done=True)

    @property
    def _can_turn(self) -> bool:
        return self._robot.drive != "ackermann"

    def _turn(self, yaw: float, to: float, w_now: float) -> Velocity | None:
        """A turn in place; None: it is done, or this robot cannot."""
        error = wrapped(to - yaw)
        still = abs(w_now) < 0.2
        if not self._can_turn or (abs(error) <= self._settings.yaw_tolerance and still):
            return None
        period = 1.0 / self._settings.rate
        # Slow enough to stop at the heading, and not past it within a period.
        most = min(
            self._yaw_rate, math.sqrt(2.0 * 0.5 * YAW_ACCELERATION * abs(error)), 0.5 * abs(error) / period
        )
        rate = min(most, abs(w_now) + YAW_ACCELERATION * period)
        return Velocity(0.0, math.copysign(rate, error), "turn")

    def _along(self, section: RouteSection, at: PlanePose) -> Velocity | None:
        """The command on a section; None: its end is reached."""
        x, y, yaw = at
        node, share, offset = self._project(section, x, y)
        s = float(section.s[node] + share * (section.s[node + 1] - section.s[node]))
        self._node, self.s = node, s
        if abs(offset) > LOST:
            return Velocity(0.0, 0.0, "off the path", lost=True)
        left = float(section.s[-1]) - s
        tolerance = self._settings.goal_tolerance if self._k == len(self.route.sections) - 1 else 0.02
        if left <= min(tolerance, 0.02):
            return None
        a, b = float(section.yaw[node]), float(section.yaw[node + 1])
        length = float(section.s[node + 1] - section.s[node])
        error = wrapped(yaw - (a + share * (b - a)))
        if abs(error) > TURN_FIRST and self._can_turn:
            return self._turn(yaw, a + share * (b - a), 0.0)
        v, k = self._speed(section, s, left)
        bend = (b - a) / length if length > 0 else 0.0
        cause = self.route.profile.why(min(section.first + k, len(self.route.profile.s) - 1))
        signed = v * section.gear
        w = bend * v - OFFSET_GAIN * signed * offset - HEADING_GAIN * v * error
        most = self._robot.yaw_rate_max or max(2.0 * self._yaw_rate, 1.0)
        if self._robot.turn_radius > 0:
            most = min(most, v / self._robot.turn_radius)
        return Velocity(signed, max(-most, min(most, w)), cause)

    def _project(self, section: RouteSection, x: float, y: float) -> tuple[int, float, float]:
        """The nearest place from here on: node before it, share of its piece, offset to the left (metres)."""
        reach = section.s[self._node] + LOST + 0.2
        last = int(np.searchsorted(section.s, reach))
        part = section.xy[self._node : max(last, self._node + 1) + 1]
        d = np.diff(part, axis=0)
        long = np.maximum((d * d).sum(axis=1), 1e-18)
        rel = np.array([x, y]) - part[:-1]
        share = np.clip((rel * d).sum(axis=1) / long, 0.0, 1.0)
        off = rel - share[:, None] * d
        k = int((off * off).sum(axis=1).argmin())
        yaw = float(section.yaw[self._node + k])
        cosine, sine = math.cos(yaw), math.sin(yaw)
        offset = float(off[k, 1] * cosine - off[k, 0] * sine)
        far = float(np.sqrt((off[k] * off[k]).sum()))
        return (
            self._node + k,
            float(share[k]),
            offset if abs(offset) > 0.5 * far else math.copysign(far, offset),
        )

    def _speed(self, section: RouteSection, s: float, left: float) -> tuple[float, int]:
        """The speed that the profile has one period on, and the node that limits it."""
        period, a = 1.0 / self._settings.rate, self._robot.a_max
        v = float(np.interp(s, section.s, section.v))
        ahead = s + v * period + 0.5 * a * period * period
        v = float(np.interp(ahead, section.s, section.v))
        slow = min(CREEP, math.sqrt(2.0 * self._robot.d_max * left), self._robot.v_max)
        k = int(np.clip(np.searchsorted(section.s, ahead), 0, len(section.s) - 1))
        return max(v, slow), k
