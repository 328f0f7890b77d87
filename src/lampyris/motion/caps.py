"""Speed caps: each a small function of numbers and arrays, one speed a node, with equation and source.

A cap knows nothing of paths, maps, or the other caps. The minimum of them is taken once, in
:mod:`lampyris.motion.lowest`, where each node gets the name of the cap that binds it. What else a new cap needs is
listed in CONTRIBUTING.md.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.typing import Floats

# Cosines of the turns half way between straight on, 45 and 90 degrees, by half-angle formulas: no call of
# cos, so the same bits everywhere. No two grid steps meet at exactly such a turn (its tangent is
# irrational).
COS_22_5 = math.sqrt(2.0 + math.sqrt(2.0)) / 2.0
COS_67_5 = math.sqrt(2.0 - math.sqrt(2.0)) / 2.0


def limit(count: int, v_max: float) -> Floats:
    """The robot's top speed at every node: ``v <= v_max``."""
    return np.full(count, v_max, dtype=np.float64)


def curvature(kappa: Floats, *, a_lat_max: float) -> Floats:
    """Slow enough for the bend: ``v <= sqrt(a_lat_max / |kappa|)``, infinity where it is straight.

    Parameters
    ----------
    kappa : 1/m, the greatest that touches the node; (n,).
    a_lat_max : lateral acceleration, m/s2.

    Source: uniform motion on a circle, ``a = v^2 kappa``.
    """
    out = np.full(len(kappa), np.inf)
    size = np.abs(kappa)
    np.divide(a_lat_max, size, out=out, where=size > 0.0)
    np.sqrt(out, out=out)
    return out


def yaw_rate(turn: Floats, *, yaw_rate_max: float) -> Floats:
    """Slow enough to turn the robot: ``v <= yaw_rate_max / turn``, infinity where it does not turn.

    Parameters
    ----------
    turn : radians a metre, the greatest that touches the node; (n,).
    yaw_rate_max : rad/s.
    """
    out = np.full(len(turn), np.inf)
    np.divide(yaw_rate_max, turn, out=out, where=turn > 0.0)
    return out


def approach(left: Floats, *, v_max: float, distance: float, v_app: float) -> Floats:
    """Slower towards the goal: ``max(v_max left / distance, v_app)`` within ``distance`` of it.

    Parameters
    ----------
    left : metres of the path that are left; (n,).
    v_max : m/s, at the distance where it begins and beyond.
    distance : metres, > 0.
    v_app : m/s, > 0: never less for this reason; the goal itself is braked for.

    Source: the approach rule of Nav2's Regulated Pure Pursuit.
    """
    return np.where(left < distance, np.maximum(v_max * (left / distance), v_app), np.inf)


def narrow(margin: Floats, *, sigma_0: float, sigma_v: float, k: float, creep: float) -> Floats:
    """Slow enough that uncertainty fits the room: ``k (sigma_0 + sigma_v v) <= margin``.

    Parameters
    ----------
    margin : metres between the robot's edge and the nearest surface; (n,).
    sigma_0 : standard deviation of the position when standing, metres.
    sigma_v : what each m/s adds to it, seconds.
    k : how many standard deviations must fit.
    creep : m/s, never less than this.

    The criterion is Miura's, Negishi's and Shirai's (2006), the formula ours: docs/speed/uncertainty.md.
    """
    return np.maximum(creep, (margin - k * sigma_0) / (k * sigma_v))


def undecided(distance: Floats, *, observations: int, period: float, creep: float) -> Floats:
    """Slow enough to observe what is ahead often enough: ``v <= distance / (observations period)``.

    Parameters
    ----------
    distance : metres between the robot's edge and the nearest cell not known to be free; (n,).
    observations : how many it takes to be sure.
    period : seconds between two.
    creep : m/s, never less than this.

    The criterion is Miura's, Negishi's and Shirai's (2006), the formula ours: docs/speed/uncertainty.md.
    """
    return np.maximum(creep, distance / (observations * period))


def clearance(distance: Floats, *, radius: float, d_max: float, creep: float) -> Floats:
    """Slow enough to stop before the nearest surface: ``v <= sqrt(2 d_max (distance - radius))``.

    Parameters
    ----------
    distance : metres from the robot's centre to the nearest surface, infinity where there is none; shape
        (n,).
    radius : the robot's, metres.
    d_max : braking, m/s2.
    creep : m/s, never less than this, so that a robot in a tight but free place still moves. There the cap
        stops promising what its name says: the robot needs ``creep^2 / (2 d_max)`` metres to stop.

    Source: stopping distance v^2 / (2 d) of uniform braking; the bound on speed by what is near is Lumelsky's
    ``V = sqrt(2 p r)`` with the clearance in place of the radius of vision (dissertation, related work).
    """
    return np.maximum(creep, np.sqrt(2.0 * d_max * np.maximum(distance - radius, 0.0)))


def rings(
    n1: NDArray[np.int64], n2: NDArray[np.int64], *, v_max: float, v_min: float, drop1: float, drop2: float
) -> Floats:
    """Slower for each obstacle around a node: ``max(v_min, v_max - drop1 n1 - drop2 n2)``.

    Parameters
    ----------
    n1, n2 : obstacles counted in ring 1 and in ring 2 (:func:`lampyris.motion.laws.rings.ring_counts`); shape
        (n,).
    v_max, v_min, drop1, drop2 : velocity units: 80, 20, 6 and 3 in the dissertation.

    Source: dissertation, Algorithm 3.11 and Equation 3.2, summed over the obstacles as its Tables 4.12-4.17
    are.
    """
    return np.maximum(v_min, v_max - drop1 * n1 - drop2 * n2)


def angle(turn_cosine: Floats, *, v_180: float, v_135: float, v_90: float) -> Floats:
    """Slower where the path bends: one speed each for interior angles near 180, 135 and 90 degrees.

    Parameters
    ----------
    turn_cosine : cosine of the turn (180 degrees less the interior angle); 1 straight on, 0 a right angle,
        -1 back; (n,).
    v_180, v_135, v_90 : velocity units: 80, 60 and 20 in the dissertation. The borders are at 157.5 and
        112.5 degrees; anything sharper than 112.5 has ``v_90``.

    Source: dissertation, Algorithm 3.12 and Table 3.1.
    """
    return np.where(turn_cosine > COS_22_5, v_180, np.where(turn_cosine > COS_67_5, v_135, v_90))
