"""The push of the next period: as hard as is under the ceiling and passively safe.

Passive safety: the robot stands before anybody whose top speed is known could touch it, whatever they all
do. Derivation, proof and measurements: docs/speed/moving_obstacles.md.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lampyris.kernels.passive import ACCELERATION, CEILING, highest_push
from lampyris.model.movers import Movers
from lampyris.model.robot import Robot
from lampyris.motion.course import Course
from lampyris.motion.moving import fresh
from lampyris.typing import Floats

_CAUSES = {ACCELERATION: "acceleration", CEILING: "limit"}


class Rails(NamedTuple):
    """A course as the kernel wants it, made once for many pushes.

    Parameters
    ----------
    s : float64 (n,), metres along the way, n >= 2.
    x, y : float64 (n,), metres: cells times the resolution.
    slack : metres by which the way leaves the straight lines between the nodes at most.
    resolution : metres a cell.
    """

    s: Floats
    x: Floats
    y: Floats
    slack: float
    resolution: float


class Push(NamedTuple):
    """The acceleration of the next period, m/s2, and what binds it.

    ``cause`` is ``acceleration`` (a_max), ``limit`` (the ceiling), ``moving obstacle`` (its number is
    ``about``) or ``no data``.
    """

    a: float
    cause: str
    about: int = -1


def rails_of(course: Course) -> Rails:
    """The course as arrays in metres; one of a single node becomes an edge that cannot be driven.

    An arc of curvature k leaves its chord by at most ``k ds^2 / 8`` at equal shares of both.
    """
    points = course.xy * course.resolution
    s = course.s
    if len(s) == 1:
        s, points = np.array((0.0, 1e-9)), np.repeat(points, 2, axis=0)
        return Rails(s, points[:, 0].copy(), points[:, 1].copy(), 0.0, course.resolution)
    ds = s[1:] - s[:-1]
    bend = np.minimum(course.curvature[1:], course.curvature[:-1]) * ds * ds
    slack = 0.125 * float(bend.max())
    return Rails(s.copy(), points[:, 0].copy(), points[:, 1].copy(), slack, course.resolution)


def push(
    rails: Rails,
    ceiling: Floats,
    s: float,
    v: float,
    movers: Movers | None,
    robot: Robot,
    period: float,
    margin: float = 0.0,
    max_age: float = 0.5,
) -> Push:
    """The greatest acceleration from which full braking stays safe, held for one period.

    Parameters
    ----------
    rails : the way.
    ceiling : float64 (n,): v^2 that the static profile allows at each node (linear between the nodes), 0 at
        the last and at stops. It must fall by no more than ``2 d_max ds``, as a feasible profile's does.
    s, v : where the robot is, metres along the way, and its speed.
    movers : all that is known of obstacles; their reach grows with their age. None: there are none.
    period : seconds until the next decision.
    margin : metres to be left between the robot and any obstacle while it moves.
    max_age : seconds after which old knowledge counts as none.

    If the last period's push was safe, full braking is safe now; so it is what is answered when nothing else
    is. A robot that stands, stays: it answers 0. Without fresh knowledge: full braking.
    """
    if movers is None:
        px = py = reach = speed = _NONE
    elif not fresh(movers, max_age):
        return Push(-robot.d_max if v > 0.0 else 0.0, "no data")
    else:
        px, py = movers.xy[:, 0] * rails.resolution, movers.xy[:, 1] * rails.resolution
        speed = movers.top_speed + 0.0
        reach = movers.radius + (robot.radius + margin + rails.slack) + speed * movers.age
    if not ceiling.flags.writeable:
        ceiling = ceiling.copy()  # to numba an array that cannot be written is of another type
    a, who = highest_push(
        rails.s,
        rails.x,
        rails.y,
        ceiling,
        float(s),
        float(v),
        float(period),
        robot.a_max,
        robot.d_max,
        px,
        py,
        reach,
        speed,
    )
    return Push(a, _CAUSES.get(who, "moving obstacle"), max(who, -1) if who >= 0 else -1)


_NONE: Floats = np.zeros(0)
