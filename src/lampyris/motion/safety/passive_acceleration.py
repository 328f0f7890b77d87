"""The push of the next period: as hard as is under the ceiling and passively safe.

Passive safety: the robot stands before any obstacle whose top speed is known could touch it, whatever they all
do. Derivation, proof and measurements: docs/speed/moving_obstacles.md.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from lampyris.kernels.motion.passive_safety import ACCELERATION, CEILING, highest_push
from lampyris.motion.geometry.sampled_path import SampledPath
from lampyris.typing import Floats

_CAUSES = {ACCELERATION: "acceleration", CEILING: "limit"}


class Rails(NamedTuple):
    """A sampled path as the kernel wants it, made once for many pushes.

    Parameters
    ----------
    s : float64 (n,), metres along the path, n >= 2.
    x, y : float64 (n,), metres: cells times the resolution.
    slack : metres by which the path leaves the straight lines between the nodes at most.
    resolution : metres a cell.
    """

    s: Floats
    x: Floats
    y: Floats
    slack: float
    resolution: float


class Near(NamedTuple):
    """Discs that nobody may touch while the robot moves; float64 (m,) each.

    Parameters
    ----------
    x, y : metres: where they were seen.
    reach : metres: how near the robot's centre may not come now. What they may have moved since they were
        seen is in it, and all radii and margins, and the slack of the rails.
    speed : m/s: how fast their reach grows.
    """

    x: Floats
    y: Floats
    reach: Floats
    speed: Floats


class Push(NamedTuple):
    """The acceleration of the next period, m/s2, and what binds it.

    ``cause`` is ``acceleration`` (a_max), ``limit`` (the ceiling) or ``moving obstacle`` (its number is
    ``cause_index``).
    """

    a: float
    cause: str
    cause_index: int = -1


def rails_of(samples: SampledPath) -> Rails:
    """The sampled path as arrays in metres; one of a single node becomes an edge that cannot be driven.

    An arc of curvature k leaves its chord by at most ``k ds^2 / 8`` at equal shares of both.
    """
    points = samples.xy * samples.resolution
    s = samples.s
    if len(s) == 1:
        s, points = np.array((0.0, 1e-9)), np.repeat(points, 2, axis=0)
        return Rails(s, points[:, 0].copy(), points[:, 1].copy(), 0.0, samples.resolution)
    ds = s[1:] - s[:-1]
    bend = np.minimum(samples.curvature[1:], samples.curvature[:-1]) * ds * ds
    slack = 0.125 * float(bend.max())
    return Rails(s.copy(), points[:, 0].copy(), points[:, 1].copy(), slack, samples.resolution)


def push(
    rails: Rails, ceiling: Floats, s: float, v: float, near: Near, period: float, a_max: float, d_max: float
) -> Push:
    """The maximum acceleration from which full braking stays safe, held for one period.

    Parameters
    ----------
    rails : the path.
    ceiling : float64 (n,): v^2 that the static profile allows at each node (linear between the nodes), 0 at
        the last and at stops. It must fall by no more than ``2 d_max ds``, as a feasible profile's does.
    s, v : where the robot is, metres along the path, and its speed.
    near : all that is known of obstacles.
    period : seconds until the next decision.
    a_max, d_max : what the robot can do, or is wished to, m/s2; ``a_max`` may be less than 0.

    If the last period's push was safe, full braking is safe now; so it is what is answered when nothing else
    is. A robot that stands, stays: it answers 0.
    """
    if not ceiling.flags.writeable:
        ceiling = ceiling.copy()  # to numba an array that cannot be written is of another type
    a, who = highest_push(
        rails.s, rails.x, rails.y, ceiling, float(s), float(v), float(period), a_max, d_max, *near
    )
    return Push(a, _CAUSES.get(who, "moving obstacle"), max(int(who), -1))
