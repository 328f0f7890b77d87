"""How hard the robot may push for one period, so that whatever the others do it can still stand in time.

The robot pushes with a constant acceleration for one period and then brakes fully until it stands. That
motion is *passively safe* when no obstacle of known top speed could touch the robot before it stands: at
every time tau until then it is at least ``reach + speed tau`` from where the obstacle was. The proof that
this is enough, forever, is in docs/speed/moving_obstacles.md.

Lengths in metres, times in seconds. Between its nodes the path is taken straight; who asks adds to ``reach``
what the true path leaves that by.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel

ACCELERATION, CEILING = -2, -1
"""What binds the answer where no obstacle does."""

_ROUNDING = 1e-12
"""Share of v^2 by which rounding may lie above the ceiling."""

_LEVELS = 9
"""Pushes that are tried from the highest down; the safe ones need not be all those below some limit."""

_HALVINGS = 7
"""How often the gap between the best safe push found and the next unsafe one is halved."""

_PARTS = 64
"""The shortest step along a motion is this part of its time."""


@kernel()
def edge_at(s, s0):
    """The edge on which a distance lies: the greatest i <= n - 2 with s[i] <= s0, or 0."""
    low = 0
    high = len(s) - 1
    while high - low > 1:
        mid = (low + high) // 2
        if s[mid] <= s0:
            low = mid
        else:
            high = mid
    return low


@kernel()
def under_ceiling(s, ceiling, edge, s0, v0, push, period):
    """Whether pushing for one period keeps v^2 under the ceiling, which is linear between the nodes."""
    v1 = v0 + push * period
    if v1 < 0.0:
        v1 = 0.0
        s1 = s0 - 0.5 * v0 * v0 / push
    else:
        s1 = s0 + 0.5 * (v0 + v1) * period
    last = len(s) - 1
    if s1 > s[last]:
        return False
    i = edge + 1
    while i < last and s[i] < s1:
        if v0 * v0 + 2.0 * push * (s[i] - s0) > ceiling[i] * (1.0 + _ROUNDING):
            return False
        i += 1
    share = (s1 - s[i - 1]) / (s[i] - s[i - 1])
    top = ceiling[i - 1] + share * (ceiling[i] - ceiling[i - 1])
    return v1 * v1 <= top * (1.0 + _ROUNDING)


@kernel()
def stays_clear(s, x, y, edge, s0, v0, push, period, d_max, ox, oy, reach, speed):
    """Whether a push and the full braking after it keep clear of one obstacle until the robot stands.

    Conservative advancement: from a moment at which the gap is g, nothing can happen before the robot's travel
    and the obstacle's reach have used up g. Where that is less than a 64th of the whole time, a 64th is
    taken at once, and the distance covered in it is compared with the reach at its end.
    """
    v1 = v0 + push * period
    first = period
    if v1 < 0.0:
        v1 = 0.0
        first = -v0 / push
    if v0 == 0.0 and v1 == 0.0:
        return True
    s1 = s0 + 0.5 * (v0 + v1) * first
    total = first + v1 / d_max
    end = s1 + 0.5 * v1 * v1 / d_max
    least = total / _PARTS
    last = len(s) - 1
    at, i = s0, edge
    tau = 0.0
    while True:
        share = (at - s[i]) / (s[i + 1] - s[i])
        cx = x[i] + share * (x[i + 1] - x[i])
        cy = y[i] + share * (y[i + 1] - y[i])
        gap = sqrt((cx - ox) * (cx - ox) + (cy - oy) * (cy - oy)) - reach - speed * tau
        if gap < 0.0:
            return False
        if gap >= end - at + speed * (total - tau):
            return True
        if tau < first:
            fast = v0 + push * tau
            if fast < v1:
                fast = v1
        else:
            fast = v1 - d_max * (tau - first)
        step = gap / (fast + speed)
        sweep = step < least
        if sweep:
            step = least
        tau += step
        done = tau >= total
        if done:
            if not sweep:
                return True
            tau = total
            to = end
        elif tau < first:
            to = s0 + tau * (v0 + 0.5 * push * tau)
        else:
            to = s1 + (tau - first) * (v1 - 0.5 * d_max * (tau - first))
        if to > s[last]:
            to = s[last]
        if to < at:
            to = at
        if sweep:
            far = (reach + speed * tau) * (reach + speed * tau)
            while True:
                over = i + 1 < last and s[i + 1] < to
                share = 1.0
                if not over:
                    share = (to - s[i]) / (s[i + 1] - s[i])
                nx = x[i] + share * (x[i + 1] - x[i])
                ny = y[i] + share * (y[i + 1] - y[i])
                dx = nx - cx
                dy = ny - cy
                qx = ox - cx
                qy = oy - cy
                square = dx * dx + dy * dy
                along = 0.0
                if square > 0.0:
                    along = (qx * dx + qy * dy) / square
                    if along < 0.0:
                        along = 0.0
                    elif along > 1.0:
                        along = 1.0
                qx -= along * dx
                qy -= along * dy
                if qx * qx + qy * qy < far:
                    return False
                cx = nx
                cy = ny
                if not over:
                    break
                i += 1
            if done:
                return True
        else:
            while i + 1 < last and s[i + 1] < to:
                i += 1
        at = to


@kernel()
def first_unsafe(s, x, y, edge, s0, v0, push, period, d_max, px, py, reach, speed):
    """The first obstacle that a push and the braking after it are not safe from; -1: none."""
    for m in range(len(px)):
        if not stays_clear(s, x, y, edge, s0, v0, push, period, d_max, px[m], py[m], reach[m], speed[m]):
            return m
    return -1


@kernel()
def highest_push(s, x, y, ceiling, s0, v0, period, a_max, d_max, px, py, reach, speed):
    """The greatest acceleration for one period that is under the ceiling and passively safe.

    Parameters
    ----------
    s, x, y : float64 (n,), n >= 2: distances along the path, strictly rising, and where that is; metres.
    ceiling : float64 (n,): v^2 allowed at the nodes, linear between them, falling by no more than 2 d_max ds.
    s0, v0 : where the robot is and how fast.
    period : seconds until the next decision.
    a_max, d_max : m/s2.
    px, py, reach, speed : float64 (m,): centres of obstacles, sum of the radii, top speeds.

    Returns
    -------
    The acceleration, from -d_max to a_max, and what binds it: the number of an obstacle, ``CEILING`` or
    ``ACCELERATION``. Every answer but the last resort has been compared with all obstacles. The last resort is
    to brake fully, or to stay where one stands: that is the rest of the motion which was safe before.
    """
    edge = edge_at(s, s0)
    who = ACCELERATION
    top = a_max
    if not under_ceiling(s, ceiling, edge, s0, v0, top, period):
        who = CEILING
        low = -d_max
        high = a_max
        if under_ceiling(s, ceiling, edge, s0, v0, 0.0, period):
            low = 0.0
        else:
            high = 0.0
        for _ in range(48):
            mid = 0.5 * (low + high)
            if under_ceiling(s, ceiling, edge, s0, v0, mid, period):
                low = mid
            else:
                high = mid
        top = low
    rest = -d_max
    if v0 == 0.0:
        rest = 0.0
    if top <= rest:
        return rest, who
    bad = first_unsafe(s, x, y, edge, s0, v0, top, period, d_max, px, py, reach, speed)
    if bad < 0:
        return top, who
    who = bad
    low = rest
    high = top
    for k in range(1, _LEVELS):
        push = top - (top - rest) * k / _LEVELS
        bad = first_unsafe(s, x, y, edge, s0, v0, push, period, d_max, px, py, reach, speed)
        if bad < 0:
            low = push
            break
        who = bad
        high = push
    for _ in range(_HALVINGS):
        push = 0.5 * (low + high)
        bad = first_unsafe(s, x, y, edge, s0, v0, push, period, d_max, px, py, reach, speed)
        if bad < 0:
            low = push
        else:
            who = bad
            high = push
    return low, who
