"""Driving along a curve: where a distance is, how hard to push under a ceiling of speeds, the first contact.

All of it is geometry of one instant after another, so it uses ``+ - * /`` and roots only, the same in both
forms. Positions are in cells, lengths in metres, times in seconds.
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel

SERIES = 0.8
"""Half turns beyond this (radians) are halved before the series, and doubled back."""

DEEP = 1.5e-9
"""Metres that two discs must overlap to be in contact: those that touch by design do not.

The referee says 1e-9; the instant found here is one at which it sees the contact, too.
"""

TICKLE = 1e-6
"""Seconds of the least step towards a contact. A graze that is shorter is not deeper than 1e-6 m."""


@kernel()
def piece_of(begins, pieces, s, hint):
    """The piece of the curve on which distance ``s`` lies, looked for from piece ``hint`` on."""
    k = hint
    while k > 0 and s < begins[k]:
        k -= 1
    while k + 1 < pieces and s >= begins[k + 1]:
        k += 1
    return k


@kernel()
def chord(turn):
    """sin(x) / x and the sine and cosine of x = ``turn``, by their series; exact to the last bits."""
    halvings = 0
    x = turn
    while abs(x) > SERIES:
        x = 0.5 * x
        halvings += 1
    z = x * x
    rest = 1.0
    for k in range(17, 1, -2):
        rest = 1.0 - rest * z / (k * (k - 1.0))
    sine = x * rest
    rest = 1.0
    for k in range(16, 0, -2):
        rest = 1.0 - rest * z / (k * (k - 1.0))
    cosine = rest
    for _ in range(halvings):
        sine, cosine = 2.0 * sine * cosine, 1.0 - 2.0 * sine * sine
    ratio = 1.0 if turn == 0.0 else sine / turn
    return ratio, sine, cosine


@kernel()
def place(px, py, hx, hy, begins, kappa, resolution, k, s):
    """Where distance ``s`` lies on piece ``k``, cells: the chord at half the angle that has been turned."""
    along = s - begins[k]
    bend = kappa[k]
    x, y = px[k], py[k]
    if bend == 0.0:
        return x + along * hx[k] / resolution, y + along * hy[k] / resolution
    ratio, sine, cosine = chord(0.5 * bend * along)
    far = along * ratio / resolution
    return x + far * (hx[k] * cosine - hy[k] * sine), y + far * (hx[k] * sine + hy[k] * cosine)


@kernel()
def travelled(v, a, period):
    """How far a push takes in ``period`` seconds, standing still once at rest."""
    if v + a * period < 0.0:
        return -0.5 * v * v / a
    return period * (v + 0.5 * a * period)


@kernel()
def ceiling_push(nodes, squares, count, at, s, v, period, a_max, d_max):
    """The hardest push for one period that keeps a robot under a ceiling it can follow.

    In the plane of distance and squared speed both the ceiling (straight between nodes) and a constant push
    are straight lines, so it is a matter of slopes; only where the period ends between two nodes there is a
    quadratic to solve.

    Parameters
    ----------
    nodes, squares : distance and squared speed of the ceiling, ``count`` of each.
    at : the last node that is not ahead of ``s``.
    s, v : where the robot is and how fast.

    Returns
    -------
    The push, -d_max to a_max; the node that binds it (-1: none does); and the node at which the robot comes
    to rest exactly (-1: at none).
    """
    push, node, rest = a_max, -1, -1
    x = v * v
    if at + 1 >= count:
        push, node = -d_max, count - 1
    for k in range(at + 1, count):
        end = s + travelled(v, push, period)
        gap = nodes[k] - s
        if gap > 0.0 and end >= nodes[k]:
            slope = 0.5 * (squares[k] - x) / gap
            if slope >= push:
                continue
            if s + travelled(v, slope, period) >= nodes[k] or (squares[k] == 0.0 and 2.0 * gap <= v * period):
                push, node = slope, k
                if squares[k] == 0.0:
                    rest = k
                    break
                continue
        elif gap <= 0.0:
            if x > squares[k]:
                push, node = -d_max, k
                break
            continue
        # The period ends on the edge that ends in node k: (v + a T)^2 = c + m (s + v T + a T^2 / 2).
        edge = nodes[k] - nodes[k - 1]
        m = (squares[k] - squares[k - 1]) / edge
        c = squares[k - 1] + m * (s - nodes[k - 1])
        last = v + push * period
        if last > 0.0 and last * last > c + m * (end - s):
            half = v - 0.25 * m * period
            root = half * half - (x - c - m * v * period)
            if root < 0.0:
                push = -d_max
            else:
                push = min(push, (math.sqrt(root) - half) / period)
            node = k
        break
    if push < -d_max:
        # What braking along the ceiling itself needs may be a rounding more than d_max; anything else is not.
        if push < -d_max * (1.0 + 1e-9):
            rest = -1
            push = -d_max
    return push, node, rest


@kernel(out=("found",))
def first_contact(
    px,
    py,
    hx,
    hy,
    begins,
    kappa,
    pieces,
    resolution,
    t,
    s,
    v,
    a,
    hint,
    t0,
    t1,
    x,
    y,
    vx,
    vy,
    reach,
    old,
    found,
):
    """The first instant at which a robot on a curve and one of several discs overlap.

    Parameters
    ----------
    px .. pieces : the curve.
    t, s, v, a : the robot's stretches, (m,) each, and when the last ends: ``t`` has m + 1.
    hint : the piece on which the first begins.
    t0, t1, x, y, vx, vy, reach : legs of obstacles, (n,) each: from when to when, where it is at ``t0``
        (cells), its velocity (cells/s), and the sum of the two radii (metres).
    old : (n,), 1 where the disc has touched the standing robot before: not reported again while it stands.
    found : (1,): which leg, -1 none.

    Returns
    -------
    The instant; infinity if there is none.

    The gap shrinks at no more than the sum of both speeds, so as much time as that takes can be left out; at
    an overlap the instant is bisected. Steps are at least 1e-6 s.
    """
    best = math.inf
    found[0] = -1.0
    for i in range(len(t0)):
        for k in range(len(s)):
            begin = max(t[k], t0[i])
            end = min(min(t[k + 1], t1[i]), best)
            if begin > end:
                continue
            moves = v[k] > 0.0 or a[k] > 0.0
            if old[i] and not moves:
                continue
            quick = max(v[k], v[k] + a[k] * (t[k + 1] - t[k])) if moves else 0.0
            closing = quick + resolution * math.sqrt(vx[i] * vx[i] + vy[i] * vy[i])
            now, clear = begin, begin
            piece = hint
            while True:
                d = now - t[k]
                far = s[k] + d * (v[k] + 0.5 * a[k] * d)
                piece = piece_of(begins, pieces, far, piece)
                rx, ry = place(px, py, hx, hy, begins, kappa, resolution, piece, far)
                ox = (x[i] + vx[i] * (now - t0[i]) - rx) * resolution
                oy = (y[i] + vy[i] * (now - t0[i]) - ry) * resolution
                gap = math.sqrt(ox * ox + oy * oy) - reach[i] + DEEP
                if gap < 0.0:
                    break
                clear = now
                if now >= end or gap >= closing * (end - now):
                    break
                now = min(end, now + max(gap / closing, TICKLE))
            if gap >= 0.0:
                continue
            for _ in range(60):
                middle = 0.5 * (clear + now)
                if middle <= clear or middle >= now:
                    break
                d = middle - t[k]
                far = s[k] + d * (v[k] + 0.5 * a[k] * d)
                piece = piece_of(begins, pieces, far, piece)
                rx, ry = place(px, py, hx, hy, begins, kappa, resolution, piece, far)
                ox = (x[i] + vx[i] * (middle - t0[i]) - rx) * resolution
                oy = (y[i] + vy[i] * (middle - t0[i]) - ry) * resolution
                if math.sqrt(ox * ox + oy * oy) - reach[i] + DEEP < 0.0:
                    now = middle
                else:
                    clear = middle
            if now < best:
                best = now
                found[0] = i
    return best
