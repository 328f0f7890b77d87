"""Pure pursuit, plain and regulated: the arc through a point of the path ahead."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lampyris.model.settings.steering import PurePursuit, RegulatedPurePursuit
from lampyris.sim.steering.arc import HAIR, Arc, RobotPose, angle_of, cos_sin, wrapped
from lampyris.sim.steering.control import Steer, View, stopping_speed
from lampyris.typing import Floats

_LEAST = 1e-3
"""Metres: a point that is nearer says nothing of where to go."""

_SHORTER = 3
"""Lookahead distances that are tried: each half of the one before."""

_LOOKS = 10
"""Places at which the outline is compared with obstacles."""


def pursuit_arc(view: View, lookahead: float) -> Arc:
    """The arc from the robot through the point of the path so far ahead; of an omnidirectional robot, towards it.

    In the robot's frame the point is at (x, y); the circle through it and tangent to the robot's axis has the curvature
    2 y / (x^2 + y^2) (Coulter 1992). In reverse the same circle is driven backwards.
    """
    pose, progress = view.pose, view.progress
    gear = -1 if progress.section.gear < 0 else 1
    x, y, _ = progress.ahead(lookahead)
    dx, dy = x - pose.x, y - pose.y
    if view.shape.sideways:
        return _sideways_arc(view, dx, dy, 0.3 * lookahead)
    c, q = cos_sin(pose.yaw)
    ahead, left = c * dx + q * dy, c * dy - q * dx
    square = ahead * ahead + left * left
    bend = 2.0 * left / square if square > _LEAST * _LEAST else 0.0
    return within_limits(view, Arc(pose.yaw if gear > 0 else pose.yaw + math.pi, gear * bend, gear * bend))


def free_pursuit(view: View, lookahead: float) -> tuple[Arc, float]:
    """The arc through the point so far ahead, or half or a quarter as far, so that it touches no wall before the point.

    A point far ahead cuts corners, which a robot between walls cannot. If none is free, the one with the most room.
    """
    best, most, far = None, -1.0, lookahead
    for _ in range(_SHORTER):
        arc = pursuit_arc(view, lookahead)
        ahead = min(lookahead, max(view.progress.left, 0.0) + 0.05)
        room = view.walls.free(view.pose, arc, ahead) / ahead
        if room > most + 1e-9:
            best, most, far = arc, room, lookahead
        if room >= HAIR:
            break
        lookahead *= 0.5
    assert best is not None
    return best, far


def _sideways_arc(view: View, dx: float, dy: float, soon: float) -> Arc:
    """Towards a point, the direction of travel turning as quickly as it may; the yaw is the path's after ``soon`` metres."""
    wanted = angle_of(dy, dx)
    direction = wanted if view.arc is None or view.arc.in_place else view.arc.direction
    far = max(math.sqrt(dx * dx + dy * dy), _LEAST)
    off = wrapped(wanted - direction)
    # The circle through the point, tangent to the direction of travel.
    bend = 2.0 * cos_sin(off - 0.5 * math.pi)[0] / far
    if abs(off) > 0.5 * math.pi:
        bend = math.copysign(2.0 / far, off)
    yaw = view.progress.ahead(soon)[2]
    return within_limits(view, Arc(direction, bend, wrapped(yaw - view.pose.yaw) / soon))


def within_limits(view: View, arc: Arc) -> Arc:
    """The arc within what the robot can do at its present speed."""
    most = view.shape.most_bend(view.v)
    bend = min(max(arc.bend, -most), most)
    turn = arc.turn if view.shape.sideways else bend
    limit = view.shape.most_turn(view.v)
    turn = min(max(turn, -limit), limit)
    return replace_arc(arc, bend if view.shape.sideways else turn, turn)


def replace_arc(arc: Arc, bend: float, turn: float) -> Arc:
    """The same direction with another curvature and yaw."""
    return Arc(arc.direction, bend, turn, arc.in_place)


@dataclass
class Pursuit:
    """Pure pursuit at the speed that the law allows where the robot is.

    Parameters
    ----------
    settings : its settings.
    """

    settings: PurePursuit

    def begin(self, view: View) -> None:
        """Nothing is remembered."""

    def steer(self, view: View) -> Steer:
        """Towards the point ahead, as fast as the ceiling of speeds allows."""
        arc, _ = free_pursuit(view, lookahead_of(view, self.settings))
        v, cause = _ceiling(view)
        return arriving(view, Steer(arc, v, cause))


def lookahead_of(view: View, settings: PurePursuit) -> float:
    """Metres to the point that is steered for."""
    wide = min(max(settings.lookahead_time * view.v, settings.lookahead_min), settings.lookahead_max)
    # Far beside the path a point at the distance of the lookahead is none ahead.
    return max(wide, min(0.7 * abs(view.progress.beside), settings.lookahead_max))


def _ceiling(view: View) -> tuple[float, str]:
    """The law's speed at the place that the robot can reach by the end of the period, and what limits it there."""
    leg, robot, period = view.leg, view.shape.robot, view.period
    s = view.progress.s + period * (view.v + 0.5 * robot.a_max * period)
    k = min(max(int(np.searchsorted(leg.nodes, s, side="right")) - 1, 0), len(leg.nodes) - 2)
    share = min(max((s - leg.nodes[k]) / (leg.nodes[k + 1] - leg.nodes[k]), 0.0), 1.0)
    square = float(leg.squares[k] + share * (leg.squares[k + 1] - leg.squares[k]))
    cause = leg.profile.cause[k + 1]
    return math.sqrt(square), "braking" if cause in ("goal", "turn", "start") else cause


def arriving(view: View, steer: Steer) -> Steer:
    """No faster than to stop at the end of the section, and as the arc allows."""
    shape = view.shape
    stop = stopping_speed(max(view.progress.left, 0.0), view.v, view.period, shape.robot.d_max)
    if stop < steer.v:
        steer = steer._replace(v=stop, cause="braking")
    most = shape.most_speed(steer.arc)
    if most < steer.v:
        steer = steer._replace(v=most, cause="curvature")
    return steer


@dataclass
class RegulatedPursuit:
    """Regulated pure pursuit (Macenski et al. 2023).

    Parameters
    ----------
    settings : its settings.
    """

    settings: RegulatedPurePursuit

    def begin(self, view: View) -> None:
        """Nothing is remembered."""

    def steer(self, view: View) -> Steer:
        """Towards the point ahead, at the regulated speed; a stop where the arc leads into something soon."""
        one, robot = self.settings, view.shape.robot
        arc, lookahead = free_pursuit(view, lookahead_of(view, one))
        desired = robot.v_max if one.desired is None else min(one.desired, robot.v_max)
        v, cause = desired, "limit"
        tight = abs(arc.bend) * one.min_radius
        if tight > 1.0:
            v, cause = desired / tight, "curvature"
        gap, who = self._nearest(view)
        if gap < one.scaling_distance:
            near = desired * one.scaling_gain * max(gap, 0.0) / one.scaling_distance
            if near < v:
                v, cause = near, "clearance" if who < 0 else "moving obstacle"
        least = min(one.min_speed, desired)
        if v < least:
            v = least
        left = max(view.progress.left, 0.0)
        if view.progress.section.last and left < one.approach_distance:
            slow = max(desired * left / one.approach_distance, min(one.approach_speed, desired))
            if slow < v:
                v, cause = slow, "approach"
        hit = self._collides(view, arc, max(view.v, min(v, robot.a_max * view.period)), lookahead)
        if hit is not None:
            return Steer(arc, 0.0, "clearance" if hit < 0 else "moving obstacle", hit)
        return arriving(view, Steer(arc, v, cause, who if cause == "moving obstacle" else -1))

    def _nearest(self, view: View) -> tuple[float, int]:
        """Metres from the outline to the nearest wall or obstacle as they are, at least; and whose (-1: a wall)."""
        shape, res = view.shape, view.shape.grid.resolution
        row = min(max(math.floor(-view.pose.y / res + 0.5), 0), shape.grid.height - 1)
        column = min(max(math.floor(view.pose.x / res + 0.5), 0), shape.grid.width - 1)
        wall = float(view.walls.clear[row, column]) - view.shape.robot.inscribed_radius
        gaps = _gaps(view, view.pose)
        if len(gaps) and float(gaps.min()) < wall:
            return float(gaps.min()), int(gaps.argmin())
        return wall, -1

    def _collides(self, view: View, arc: Arc, v: float, lookahead: float) -> int | None:
        """What the robot would touch within the time of the check, going on at a speed: -1 a wall; None: nothing.

        It looks no farther than the point that is steered for.
        """
        far = min(v * self.settings.collision_time, lookahead, max(view.progress.left, 0.0) + 0.1)
        if far <= 0.0:
            return None
        if view.walls.free(view.pose, arc, far) < far * HAIR:
            return -1
        if not len(view.message.xy):
            return None
        for k in range(_LOOKS + 1):
            gaps = _gaps(view, view.shape.along(view.pose, arc, far * k / _LOOKS))
            if float(gaps.min()) <= 0.0:
                return int(gaps.argmin())
        return None


def _gaps(view: View, pose: RobotPose) -> Floats:
    """Metres from the outline at a pose to each obstacle as it is, (m,)."""
    here = view.shape.route(pose, Arc(pose.yaw, 0.0, 0.0), 1e-3)
    return here.gaps(0.0, view.message.xy) - view.message.radius
