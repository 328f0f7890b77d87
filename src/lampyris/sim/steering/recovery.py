"""Recovery: what a robot does that is stuck, because no safe motion leads along its path.

As the behaviours of Nav2's recovery it backs up, or drives ahead, a little, on the arc with the most room; then it plans
again. The braking rule filters these motions like all others.
"""

from __future__ import annotations

import math

import numpy as np

from lampyris.sim.steering.arc import Arc
from lampyris.sim.steering.control import Steer, View, stopping_speed

_FAR = 0.5
"""Metres that it moves, at most."""

_SPEED = 0.3
"""Share of the top speed."""

_PARTS = 5
"""Places on an arc at which its distance from obstacles is asked for."""


class Recovery:
    """One motion away from where the robot is stuck.

    Attributes
    ----------
    left : metres that it is still to move.
    """

    def __init__(self, view: View, number: int) -> None:
        self.arc, self.left = _best(view, number)

    def steer(self, view: View, moved: float) -> Steer | None:
        """The command for the next period, after ``moved`` metres; None: it is over."""
        self.left -= moved
        if self.left <= 0.01:
            return None
        arc = self.arc = self.arc._replace(direction=self.arc.direction + self.arc.bend * moved)
        robot = view.shape.robot
        v = min(_SPEED * robot.v_max, stopping_speed(self.left, view.v, view.period, robot.d_max))
        return Steer(arc, min(v, view.shape.most_speed(arc)), "turn")


def _best(view: View, number: int) -> tuple[Arc, float]:
    """The arc with the most room; which come first changes from try to try."""
    shape, yaw = view.shape, view.pose.yaw
    radius = max(shape.robot.turn_radius, 0.5 * shape.arm, 1e-3)
    bend = min(1.0 / radius, shape.most_bend(0.0))
    turns = (0.0, bend, -bend)
    arcs = [Arc(direction, turn, turn) for direction in (yaw + math.pi, yaw) for turn in turns]
    if shape.sideways:
        arcs += [Arc(yaw + side, 0.0, 0.0) for side in (0.5 * math.pi, -0.5 * math.pi)]
    if number % 2:
        arcs = arcs[3:] + arcs[:3]
    far = min(_FAR * (1.0 + 0.5 * (number // 2)), 2.0)
    best, most = arcs[0], 0.0
    for arc in arcs:
        room = 0.9 * min(view.walls.free(view.pose, arc, far), far)
        gaps = _least_gap(view, arc, room)
        score = room + min(gaps, 0.5)
        if room > 0.05 * far and score > most + 0.05:
            best, most = arc, score
    return best, 0.9 * view.walls.free(view.pose, best, far)


def _least_gap(view: View, arc: Arc, room: float) -> float:
    """Metres from the robot to the nearest obstacle as it is, along the arc."""
    if not len(view.message.xy) or room <= 0.0:
        return math.inf
    route = view.shape.route(view.pose, arc, room)
    gaps = [route.gaps(room * (k + 1) / _PARTS, view.message.xy) - view.message.radius for k in range(_PARTS)]
    return float(np.min(gaps))
