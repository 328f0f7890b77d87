"""A robot with a footprint that moves along a curve of poses: safe pushes, and the first contact with a disc.

As :mod:`lampyris.kernels.motion.passive_safety` and :mod:`lampyris.kernels.motion.curve_motion` for discs. No point of the
robot moves more than ``rate`` metres a metre of a piece; ``moved`` sums that up to the beginning of each piece.
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel
from lampyris.kernels.motion.curve_motion import DEEP, TICKLE, chord, piece_of, place
from lampyris.kernels.motion.footprint_distance import in_frame, outlines_gap, point_gap

_PARTS = 64
"""The shortest step along a motion is this part of its time."""

_FINE = 4
"""Places that such a step is looked at in, at most so far apart."""

MET = 5e-7
"""Metres within which a polygon obstacle is in contact with the robot."""

APART = 2e-8
"""Metres that the two keep from each other for certain between two instants at which they are found to be apart."""


@kernel()
def footprint_stays_clear(
    px, py, hx, hy, begins, kappa, cosine, sine, turn, pieces, moved, rate, resolution, vx, vy, arm,
    hint, s0, v0, push, period, d_max, ox, oy, reach, speed,
):  # fmt: skip
    """Whether a push and the full braking after it keep clear of one obstacle until the robot stands.

    At every time tau until then the footprint must be at least ``reach + speed tau`` from (ox, oy). Conservative
    advancement, as :func:`lampyris.kernels.motion.passive_safety.stays_clear`; in steps that are too short for it the
    distance on the way is bounded by those at both ends, less half of what a point of the robot moves between them.
    """
    v1 = v0 + push * period
    first = period
    if v1 < 0.0:
        v1 = 0.0
        first = -v0 / push
    if v0 == 0.0 and v1 == 0.0:
        return True
    length = begins[pieces]
    s1 = s0 + 0.5 * (v0 + v1) * first
    total = first + v1 / d_max
    end = min(s1 + 0.5 * v1 * v1 / d_max, length)
    k = piece_of(begins, pieces, s0, hint)
    last = piece_of(begins, pieces, end, k)
    quick = 0.0
    for i in range(k, last + 1):
        quick = max(quick, rate[i])
    stop = moved[last] + rate[last] * (end - begins[last])
    here = moved[k] + rate[k] * (s0 - begins[k])
    ax, ay = in_frame(px, py, hx, hy, begins, kappa, cosine, sine, turn, resolution, k, s0, ox, oy)
    gap = math.sqrt(ax * ax + ay * ay) - arm - reach
    if gap >= stop - here + speed * total:
        return True
    least = total / _PARTS
    at = s0
    tau = 0.0
    near = point_gap(vx, vy, ax, ay)
    while True:
        gap = near - reach - speed * tau
        if gap < 0.0:
            return False
        if gap >= stop - here + speed * (total - tau):
            return True
        if tau < first:
            fast = max(v0 + push * tau, v1)
        else:
            fast = v1 - d_max * (tau - first)
        step = gap / (fast * quick + speed)
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
        to = max(min(to, length), at)
        far = reach + speed * tau
        places = _FINE if sweep else 1
        from_ = at
        for j in range(1, places + 1):
            at = to if j == places else from_ + (to - from_) * j / places
            k = piece_of(begins, pieces, at, k)
            there = moved[k] + rate[k] * (at - begins[k])
            ax, ay = in_frame(px, py, hx, hy, begins, kappa, cosine, sine, turn, resolution, k, at, ox, oy)
            new = point_gap(vx, vy, ax, ay)
            if sweep and 0.5 * (near + new - (there - here)) < far:
                return False
            near = new
            here = there
        if done:
            return True


@kernel(each=20_000)
def footprint_first_unsafe(
    px, py, hx, hy, begins, kappa, cosine, sine, turn, pieces, moved, rate, resolution, vx, vy, arm,
    s0, v0, push, period, d_max, xs, ys, reach, speed,
):  # fmt: skip
    """The first obstacle that a push and the braking after it are not safe from; -1: none."""
    hint = piece_of(begins, pieces, s0, 0)
    for m in range(len(xs)):
        if not footprint_stays_clear(
            px, py, hx, hy, begins, kappa, cosine, sine, turn, pieces, moved, rate, resolution, vx, vy, arm,
            hint, s0, v0, push, period, d_max, xs[m], ys[m], reach[m], speed[m],
        ):  # fmt: skip
            return m
    return -1


@kernel(out=("found",), each=20_000)
def footprint_first_contact(
    px, py, hx, hy, begins, kappa, cosine, sine, turn, pieces, moved, rate, resolution, vx, vy, arm,
    t, s, v, a, hint, t0, t1, x, y, ux, uy, reach, old, found,
):  # fmt: skip
    """The first instant at which a footprint on a curve and one of several discs overlap.

    As :func:`lampyris.kernels.motion.curve_motion.first_contact`; ``ux`` and ``uy`` are the velocities of the discs
    (cells/s), ``reach`` their radii with the robot's margin (metres).

    Returns
    -------
    The instant; infinity if there is none.
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
            span = t[k + 1] - t[k]
            quick = 0.0
            piece = piece_of(begins, pieces, s[k], hint)
            if moves:
                last = piece_of(begins, pieces, s[k] + span * (v[k] + 0.5 * a[k] * span), piece)
                for p in range(piece, last + 1):
                    quick = max(quick, rate[p])
                quick *= max(v[k], v[k] + a[k] * span)
            closing = quick + resolution * math.sqrt(ux[i] * ux[i] + uy[i] * uy[i])
            now, clear = begin, begin
            while True:
                d = now - t[k]
                far = s[k] + d * (v[k] + 0.5 * a[k] * d)
                piece = piece_of(begins, pieces, far, piece)
                ax, ay = in_frame(
                    px, py, hx, hy, begins, kappa, cosine, sine, turn, resolution, piece, far,
                    x[i] + ux[i] * (now - t0[i]), y[i] + uy[i] * (now - t0[i]),
                )  # fmt: skip
                gap = math.sqrt(ax * ax + ay * ay) - arm - reach[i] + DEEP
                if gap < closing * (end - now):
                    gap = point_gap(vx, vy, ax, ay) - reach[i] + DEEP
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
                ax, ay = in_frame(
                    px, py, hx, hy, begins, kappa, cosine, sine, turn, resolution, piece, far,
                    x[i] + ux[i] * (middle - t0[i]), y[i] + uy[i] * (middle - t0[i]),
                )  # fmt: skip
                if point_gap(vx, vy, ax, ay) - reach[i] + DEEP < 0.0:
                    now = middle
                else:
                    clear = middle
            if now < best:
                best = now
                found[0] = i
    return best


@kernel(out=("wx", "wy", "found"), each=40_000)
def outline_first_contact(
    px, py, hx, hy, begins, kappa, cosine, sine, turn, pieces, rate, resolution, vx, vy, arm, margin,
    t, s, v, a, hint, t0, t1, x, y, ux, uy, yaw, spin, first, ox, oy, reach, old, wx, wy, found,
):  # fmt: skip
    """The first instant at which a robot on a curve and one of several polygons are within :data:`MET` of each other.

    Conservative advancement: a step is so short that the gap stays above :data:`APART` in it, however both move and turn.

    Parameters
    ----------
    px .. arm : as above; a disc is an outline of one vertex and a margin.
    t, s, v, a, hint : the robot's stretches, as of :func:`lampyris.kernels.motion.curve_motion.first_contact`.
    t0 .. uy : legs of obstacles, as there, with their heading at ``t0`` and how it turns (radians counterclockwise; rad/s).
    first, ox, oy : the vertices of leg i are ``first[i]`` up to ``first[i + 1]``, metres, x ahead, y to the left.
    reach : distance of their farthest vertex from the centre, metres.
    old : 1 where the obstacle has touched the standing robot before.
    wx, wy : room for the vertices of one.
    found : (1,): which leg, -1 none.

    Returns
    -------
    The instant; infinity if there is none.
    """
    best = math.inf
    found[0] = -1.0
    for i in range(len(t0)):
        count = first[i + 1] - first[i]
        for k in range(len(s)):
            begin = max(t[k], t0[i])
            end = min(min(t[k + 1], t1[i]), best)
            if begin > end:
                continue
            moves = v[k] > 0.0 or a[k] > 0.0
            if old[i] and not moves:
                continue
            span = t[k + 1] - t[k]
            quick = 0.0
            piece = piece_of(begins, pieces, s[k], hint)
            if moves:
                last = piece_of(begins, pieces, s[k] + span * (v[k] + 0.5 * a[k] * span), piece)
                for p in range(piece, last + 1):
                    quick = max(quick, rate[p])
                quick *= max(v[k], v[k] + a[k] * span)
            closing = quick + resolution * math.sqrt(ux[i] * ux[i] + uy[i] * uy[i]) + abs(spin[i]) * reach[i]
            now = begin
            while True:
                d = now - t[k]
                far = s[k] + d * (v[k] + 0.5 * a[k] * d)
                piece = piece_of(begins, pieces, far, piece)
                rx, ry = place(px, py, hx, hy, begins, kappa, resolution, piece, far)
                d = now - t0[i]
                dx = (x[i] + ux[i] * d - rx) * resolution
                dy = (ry - y[i] - uy[i] * d) * resolution
                gap = math.sqrt(dx * dx + dy * dy) - arm - reach[i] - margin
                if gap < closing * (end - now) + MET:
                    _, up, along = chord(turn[piece] * (far - begins[piece]))
                    c = cosine[piece] * along - sine[piece] * up
                    q = sine[piece] * along + cosine[piece] * up
                    _, up, along = chord(yaw[i] + spin[i] * d)
                    for j in range(count):
                        ex = dx + along * ox[first[i] + j] - up * oy[first[i] + j]
                        ey = dy + up * ox[first[i] + j] + along * oy[first[i] + j]
                        wx[j] = c * ex + q * ey
                        wy[j] = c * ey - q * ex
                    gap = outlines_gap(vx, vy, wx[:count], wy[:count]) - margin
                if gap < MET:
                    best = now
                    found[0] = i
                    break
                if now >= end or gap - APART >= closing * (end - now):
                    break
                now = min(end, now + (gap - APART) / closing)
    return best
