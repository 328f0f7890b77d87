"""Discs that meet on a path: which stretches of it a moving disc takes, and when a motion first meets one.

A path is straight between its nodes. Lengths in metres, times in seconds. Touching is not meeting: ``reach``
is the sum of the radii less a hair.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel

_FINE = 0.02
"""Shortest step along a motion, in which the two discs come nearer by at most this share of their reach."""


_SEAM = 1e-9
"""Share of an edge by which rounding may part what is taken of two neighbouring edges."""


@kernel()
def within(px, py, ex, ey, ax, ay, ux, uy, length, reach):
    """The part of a line that lies in a disc swept from a point along a unit vector; shares, lo > hi: none.

    The swept disc is convex: it cuts the line in one interval, which is the hull of what the two end discs
    and the rectangle between them cut.
    """
    low = 2.0
    high = -1.0
    square = ex * ex + ey * ey
    for k in range(2):
        qx = px - ax - k * length * ux
        qy = py - ay - k * length * uy
        half = qx * ex + qy * ey
        rest = half * half - square * (qx * qx + qy * qy - reach * reach)
        if rest > 0.0:
            root = sqrt(rest)
            low = min(low, (-half - root) / square)
            high = max(high, (root - half) / square)
    if length > 0.0:
        a = -1e300
        b = 1e300
        for k in range(2):
            if k == 0:
                at = (px - ax) * ux + (py - ay) * uy
                slope = ex * ux + ey * uy
                least = 0.0
                most = length
            else:
                at = (py - ay) * ux - (px - ax) * uy
                slope = ey * ux - ex * uy
                least = -reach
                most = reach
            if slope == 0.0:
                if at <= least or at >= most:
                    return low, high
            else:
                c = (least - at) / slope
                d = (most - at) / slope
                a = max(a, min(c, d))
                b = min(b, max(c, d))
        if a < b:
            low = min(low, a)
            high = max(high, b)
    return low, high


@kernel(out=("low", "high", "piece"))
def taken(s, x, y, cx, cy, around, block, ax, ay, bx, by, reach, low, high, piece):
    """Stretches of a path that discs take while each moves straight from one point to another.

    Parameters
    ----------
    s, x, y : float64 (n,), n >= 2, the path.
    cx, cy, around : float64: centre and radius of a disc about every ``block`` edges.
    ax, ay, bx, by, reach : float64 (p,): from where, to where, and how near is too near.
    low, high, piece : out, float64 and int64 (room,): stretches, and whose they are, in order. Stretches that
        touch are reported as one.

    Returns
    -------
    How many stretches there are; beyond ``room`` they are only counted.
    """
    count = 0
    room = len(low)
    edges = len(s) - 1
    for p in range(len(ax)):
        if reach[p] <= 0.0:
            continue
        dx = bx[p] - ax[p]
        dy = by[p] - ay[p]
        length = sqrt(dx * dx + dy * dy)
        ux = 0.0
        uy = 0.0
        if length > 0.0:
            ux = dx / length
            uy = dy / length
        mx = 0.5 * (ax[p] + bx[p])
        my = 0.5 * (ay[p] + by[p])
        far = reach[p] + 0.5 * length
        joined = False
        for b in range(len(cx)):
            gx = cx[b] - mx
            gy = cy[b] - my
            sum_ = far + around[b]
            if gx * gx + gy * gy > sum_ * sum_:
                joined = False
                continue
            for e in range(b * block, min((b + 1) * block, edges)):
                lo, hi = within(
                    x[e], y[e], x[e + 1] - x[e], y[e + 1] - y[e], ax[p], ay[p], ux, uy, length, reach[p]
                )
                if lo >= hi or hi <= 0.0 or lo >= 1.0:
                    joined = False
                    continue
                # Stretches are open, so none may end at a node that the disc takes.
                if lo < _SEAM:
                    lo = 0.0
                if hi > 1.0 - _SEAM:
                    hi = 1.0
                ds = s[e + 1] - s[e]
                end = s[e] + hi * ds
                if hi == 1.0:
                    end = s[e + 1]
                if joined and lo == 0.0:
                    if count <= room:
                        high[count - 1] = end
                else:
                    if count < room:
                        low[count] = s[e] + lo * ds
                        high[count] = end
                        piece[count] = p
                    count += 1
                joined = hi == 1.0
    return count


@kernel()
def chord_gap(rx, ry, dx, dy):
    """Least distance from the origin to the points from (rx, ry) to (rx + dx, ry + dy)."""
    square = dx * dx + dy * dy
    share = 0.0
    if square > 0.0:
        share = min(max(-(rx * dx + ry * dy) / square, 0.0), 1.0)
    rx += share * dx
    ry += share * dy
    return sqrt(rx * rx + ry * ry)


@kernel()
def first_contact_time(s, x, y, t, at, v, a, begin, ct, cx, cy, reach, top):
    """When a motion along a path first meets a moving disc, and which; (infinity, -1): never.

    Conservative advancement: from a moment at which the gap is g, nobody can meet before both have moved g
    together. Where that is a very short time, a short step is taken at once. In it both move almost
    uniformly, so the least distance of the chord of their relative motion is the gap, less by at most
    ``|a| dt^2 / 8`` for the robot's acceleration.

    Parameters
    ----------
    s, x, y : float64 (n,), the path, n >= 2.
    t, at, v, a : float64 (k,): the motion: at time t[i] it is at distance at[i] with speed v[i] and has the
        constant acceleration a[i] from then on. k >= 1. What comes after the last time is not looked at.
    begin : int64 (m + 1,): the corners of disc i are ``begin[i]`` up to ``begin[i + 1]``.
    ct, cx, cy : float64: times and places of the discs' corners. A disc is not there before its first, and
        stays at its last.
    reach, top : float64 (m,): how near is too near, and the greatest speed of each disc.
    """
    fast = 0.0
    for i in range(len(v)):
        fast = max(fast, v[i])
    until = t[len(t) - 1]
    who = -1
    found = 1e300
    lastedge = len(s) - 2
    for m in range(len(begin) - 1):
        corner = begin[m]
        lastcorner = begin[m + 1] - 1
        tau = max(t[0], ct[corner])
        if reach[m] <= 0.0:
            continue
        least = _FINE * reach[m] / max(fast + top[m], 1e-300)
        k = 0
        e = 0
        while tau <= min(until, found):
            while k + 2 < len(t) and t[k + 1] <= tau:
                k += 1
            while corner < lastcorner and ct[corner + 1] <= tau:
                corner += 1
            d = tau - t[k]
            here = at[k] + d * (v[k] + 0.5 * a[k] * d)
            if k + 1 < len(t):
                here = min(here, at[k + 1])
            while e < lastedge and s[e + 1] <= here:
                e += 1
            share = (here - s[e]) / (s[e + 1] - s[e])
            rx = x[e] + share * (x[e + 1] - x[e])
            ry = y[e] + share * (y[e + 1] - y[e])
            ox = cx[corner]
            oy = cy[corner]
            wx = 0.0
            wy = 0.0
            if corner < lastcorner:
                span = ct[corner + 1] - ct[corner]
                wx = (cx[corner + 1] - ox) / span
                wy = (cy[corner + 1] - oy) / span
                ox += wx * (tau - ct[corner])
                oy += wy * (tau - ct[corner])
            rx -= ox
            ry -= oy
            gap = sqrt(rx * rx + ry * ry) - reach[m]
            if gap < 0.0:
                found = tau
                who = m
                break
            step = gap / max(fast + top[m], 1e-300)
            if step >= least:
                tau += step
                continue
            # A short step, on one piece of the motion, one edge and one piece of the disc's path.
            step = least
            if k + 1 < len(t):
                step = min(step, t[k + 1] - tau)
            if corner < lastcorner:
                step = min(step, ct[corner + 1] - tau)
            speed = max(v[k] + a[k] * d, 0.0)
            go = max(step * (speed + 0.5 * a[k] * step), 0.0)
            left = s[e + 1] - here
            if e < lastedge and go > left:
                # The speed on the way to the edge's end is at most the greater of now and then.
                quick = max(speed, speed + a[k] * step)
                step = left / quick
                go = max(step * (speed + 0.5 * a[k] * step), 0.0)
            step = max(step, 1e-12 * max(tau, 1.0))
            share = go / (s[e + 1] - s[e])
            dx = share * (x[e + 1] - x[e]) - wx * step
            dy = share * (y[e + 1] - y[e]) - wy * step
            slack = 0.0
            if wx != 0.0 or wy != 0.0:
                slack = 0.125 * abs(a[k]) * step * step
            if chord_gap(rx, ry, dx, dy) < reach[m] + slack:
                found = tau
                who = m
                break
            tau += step
    return found, who
