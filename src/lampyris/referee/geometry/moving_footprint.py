"""A footprint on lines, arcs and turns in place: its distance from points, and when a disc is on it while it stands.

Written from the definitions, apart from the kernels that drive: a point is taken into the robot's frame, its distance to
each edge measured, and its side found by the parity of crossings.
"""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris.typing import Floats, Points


def signed_distance(outline: Points, place: Points, yaw: Floats, centre: Points) -> Floats:
    """Metres from points to the outline at poses, negative inside; (m,).

    Parameters
    ----------
    outline : (k, 2), metres; x ahead, y to the left.
    place, yaw : of the robot: metres (y down), radians counterclockwise; (m, 2) and (m,).
    centre : the points, metres (y down); (m, 2).
    """
    away = centre - place
    cos, sin = np.cos(yaw), np.sin(yaw)
    ahead = cos * away[:, 0] - sin * away[:, 1]
    left = -sin * away[:, 0] - cos * away[:, 1]
    return _to_outline(outline, np.column_stack((ahead, left)))


def _to_outline(outline: Points, points: Points) -> Floats:
    a, b = outline, np.roll(outline, -1, axis=0)
    edge = b - a
    p = points[:, None, :] - a
    share = np.clip((p * edge).sum(axis=2) / (edge * edge).sum(axis=1), 0.0, 1.0)
    rest = p - share[:, :, None] * edge
    distance = np.sqrt((rest * rest).sum(axis=2).min(axis=1))
    signed: Floats = np.where(_inside(outline, points), -distance, distance)
    return signed


def _inside(outline: Points, points: Points) -> NDArray[np.bool_]:
    x, y = points[:, :1], points[:, 1:]
    ax, ay = outline.T
    bx, by = np.roll(outline, -1, axis=0).T
    with np.errstate(divide="ignore", invalid="ignore"):
        crosses = ((ay > y) != (by > y)) & (x < ax + (bx - ax) * (y - ay) / (by - ay))
    inside: NDArray[np.bool_] = crosses.sum(axis=1) % 2 == 1
    return inside


def times_within(
    outline: Points, place: Points, yaw: float, at: Points, velocity: Points, limit: float, length: float
) -> list[tuple[float, float]]:
    """When a point that moves straight is within ``limit`` of a standing footprint, or on it: intervals in [0, length].

    The place of each edge is convex with its margin, so that the point is in it for one interval; these, and those between
    the edges that the point crosses while it is inside, are joined.

    Parameters
    ----------
    place, yaw : of the robot; metres (y down), radians.
    at, velocity : of the point: metres (y down), m/s.
    limit : metres, > 0.
    length : seconds.
    """
    cos, sin = math.cos(yaw), math.sin(yaw)

    def turned(v: Points) -> tuple[float, float]:
        return cos * float(v[0]) - sin * float(v[1]), -sin * float(v[0]) - cos * float(v[1])

    px, py = turned(at - place)
    ux, uy = turned(velocity)
    spans: list[tuple[float, float]] = []
    cuts = {0.0, length}
    for (ax, ay), (bx, by) in zip(outline.tolist(), np.roll(outline, -1, axis=0).tolist(), strict=True):
        span = _in_capsule((px - ax, py - ay), (ux, uy), (bx - ax, by - ay), limit)
        if span is not None and min(span[1], length) > max(span[0], 0.0):
            spans.append((max(span[0], 0.0), min(span[1], length)))
        across = ux * (by - ay) - uy * (bx - ax)
        if across != 0.0:
            t = ((ax - px) * (by - ay) - (ay - py) * (bx - ax)) / across
            if 0.0 < t < length:
                cuts.add(t)
    times = sorted(cuts)
    for t0, t1 in pairwise(times):
        middle = 0.5 * (t0 + t1)
        if _inside(outline, np.array([(px + ux * middle, py + uy * middle)]))[0]:
            spans.append((t0, t1))
    joined: list[tuple[float, float]] = []
    for t0, t1 in sorted(spans):
        if joined and t0 <= joined[-1][1]:
            joined[-1] = (joined[-1][0], max(joined[-1][1], t1))
        else:
            joined.append((t0, t1))
    return joined


def _in_capsule(
    p: tuple[float, float], u: tuple[float, float], edge: tuple[float, float], limit: float
) -> tuple[float, float] | None:
    """When p + u t is within ``limit`` of the segment from the origin to ``edge``; None: never."""
    low, high = math.inf, -math.inf
    for ex, ey in ((0.0, 0.0), edge):
        span = _in_disc((p[0] - ex, p[1] - ey), u, limit)
        if span is not None:
            low, high = min(low, span[0]), max(high, span[1])
    length = math.hypot(*edge)
    along = (edge[0] / length, edge[1] / length)
    begin, end = -math.inf, math.inf
    for axis, least, most in ((along, 0.0, length), ((-along[1], along[0]), -limit, limit)):
        at, rate = p[0] * axis[0] + p[1] * axis[1], u[0] * axis[0] + u[1] * axis[1]
        if rate == 0.0:
            if not least < at < most:
                begin = math.inf
            continue
        t0, t1 = sorted(((least - at) / rate, (most - at) / rate))
        begin, end = max(begin, t0), min(end, t1)
    if begin < end:
        low, high = min(low, begin), max(high, end)
    return (low, high) if low < high else None


def _in_disc(p: tuple[float, float], u: tuple[float, float], limit: float) -> tuple[float, float] | None:
    a, b = u[0] * u[0] + u[1] * u[1], p[0] * u[0] + p[1] * u[1]
    c = p[0] * p[0] + p[1] * p[1] - limit * limit
    if a == 0.0:
        return (-math.inf, math.inf) if c < 0.0 else None
    rest = b * b - a * c
    if rest <= 0.0:
        return None
    root = math.sqrt(rest)
    return (-b - root) / a, (-b + root) / a
