"""Shortest curves of bounded curvature for a car that drives ahead only.

Dubins, "On curves of minimal length with a constraint on average curvature, and with prescribed initial and
terminal positions and tangents", American Journal of Mathematics 79(3), 1957; the lengths of the six words are
those of Shkel, Lumelsky, "Classification of the Dubins set", Robotics and Autonomous Systems 34(4), 2001.

Lengths are in turning radii. A kind of segment is 1 (to the left), 0 (straight) or -1 (to the right).
"""

from __future__ import annotations

from math import floor, inf, sqrt

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.curves.angles import TURN, acos, atan2, sine_cosine

NO_TURN = 1e-10
"""An arc this close to a whole turn is none: the angle of a goal straight ahead is 0 but for its rounding."""


@kernel(inline=True)
def _arc(angle):
    """The same angle in [0, 2 pi), or 0 if it is within rounding of a whole turn."""
    inside = angle - TURN * floor(angle / TURN)
    return 0.0 if inside > TURN - NO_TURN or inside < 0.0 else inside


@kernel(out=("lengths", "kinds"))
def dubins(x, y, yaw, lengths, kinds):
    """The shortest Dubins curve from the pose (0, 0, 0); returns its length.

    Parameters
    ----------
    x, y, yaw : the goal, in turning radii and radians.
    lengths : float64 (5,): lengths of the segments; the last two are 0.
    kinds : int64 (5,).
    """
    d = sqrt(x * x + y * y)
    theta = atan2(y, x)
    # In the frame whose x axis points from the start to the goal.
    a = -theta
    b = yaw - theta
    sin_a, cos_a = sine_cosine(a)
    sin_b, cos_b = sine_cosine(b)
    _, cos_ab = sine_cosine(a - b)
    best = inf
    for word in range(6):
        # Both arcs turn the same way in LSL, RSR and RLR, LRL: the mirrored words by the mirrored angles.
        mirror = -1.0 if word in (1, 3, 5) else 1.0
        sa = mirror * sin_a
        sb = mirror * sin_b
        if word < 2:  # LSL, RSR
            square = 2.0 + d * d - 2.0 * cos_ab + 2.0 * d * (sa - sb)
            angle = atan2(cos_b - cos_a, d + sa - sb)
            t = _arc(angle - mirror * a)
            q = _arc(mirror * b - angle)
            p = sqrt(max(square, 0.0))
            middle = 0
            last = 1
        elif word < 4:  # LSR, RSL
            square = d * d - 2.0 + 2.0 * cos_ab + 2.0 * d * (sa + sb)
            if square < 0.0:
                continue
            p = sqrt(square)
            angle = atan2(-cos_a - cos_b, d + sa + sb) - atan2(-2.0, p)
            t = _arc(angle - mirror * a)
            q = _arc(angle - mirror * b)
            middle = 0
            last = -1
        else:  # LRL, RLR
            cosine = (6.0 - d * d + 2.0 * cos_ab - 2.0 * d * (sa - sb)) / 8.0
            if abs(cosine) > 1.0:
                continue
            p = TURN - acos(cosine)
            t = _arc(atan2(cos_b - cos_a, d + sa - sb) - mirror * a + 0.5 * p)
            q = _arc(mirror * (b - a) - t + p)
            middle = -1
            last = 1
        length = t + p + q
        if length < best:
            best = length
            lengths[u64(0)] = t
            lengths[u64(1)] = p
            lengths[u64(2)] = q
            side = 1 if mirror > 0.0 else -1
            kinds[u64(0)] = side
            kinds[u64(1)] = middle * side
            kinds[u64(2)] = last * side
    for k in range(3, 5):
        lengths[u64(k)] = 0.0
        kinds[u64(k)] = 0
    return best
