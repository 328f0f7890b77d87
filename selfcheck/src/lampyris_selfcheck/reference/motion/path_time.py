"""Slow references for moving obstacles: a search state by state in a dictionary, and gaps on dense samples.

Shares no code with what it judges: distances are of its own making, and states are tuples, not bits.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from lampyris.model.obstacles import Track
from lampyris.model.profile import Profile
from lampyris.motion.geometry.sampled_path import SampledPath

Point = tuple[float, float]


def segment_distance(p: Point, q: Point, a: Point, b: Point) -> float:
    """Least distance between the segments pq and ab."""
    if _cross(p, q, a, b):
        return 0.0
    return min(_to(p, a, b), _to(q, a, b), _to(a, p, q), _to(b, p, q))


def _to(p: Point, a: Point, b: Point) -> float:
    ax, ay = b[0] - a[0], b[1] - a[1]
    long = ax * ax + ay * ay
    share = 0.0 if long == 0.0 else ((p[0] - a[0]) * ax + (p[1] - a[1]) * ay) / long
    share = min(1.0, max(0.0, share))
    return math.hypot(p[0] - a[0] - share * ax, p[1] - a[1] - share * ay)


def _cross(p: Point, q: Point, a: Point, b: Point) -> bool:
    def side(u: Point, v: Point, w: Point) -> float:
        return (v[0] - u[0]) * (w[1] - u[1]) - (v[1] - u[1]) * (w[0] - u[0])

    return side(p, q, a) * side(p, q, b) < 0.0 and side(a, b, p) * side(a, b, q) < 0.0


def stretch(course: SampledPath, s0: float, s1: float) -> list[Point]:
    """The corners of a course between two distances, metres."""
    xs, ys = course.xy[:, 0] * course.resolution, course.xy[:, 1] * course.resolution
    at = [s0, *[float(s) for s in course.s if s0 < s < s1], s1]
    return [(float(np.interp(s, course.s, xs)), float(np.interp(s, course.s, ys))) for s in at]


def where(track: Track, t: float, resolution: float) -> Point:
    """Where a track is, metres."""
    x = float(np.interp(t, track.t, track.xy[:, 0])) * resolution
    return x, float(np.interp(t, track.t, track.xy[:, 1])) * resolution


def hits(
    course: SampledPath, s0: float, s1: float, tracks: Sequence[Track], radius: float, t0: float, t1: float
) -> bool:
    """Whether the way from s0 to s1, taken as a whole, comes too near to what a track sweeps in that time."""
    line = stretch(course, s0, s1)
    for track in tracks:
        if t1 <= track.t[0]:
            continue
        begin = max(t0, float(track.t[0]))
        moments = [begin, *[float(t) for t in track.t if begin < t < t1], t1]
        swept = [where(track, t, course.resolution) for t in moments]
        for p, q in pairwise(line):
            for a, b in pairwise(swept):
                if segment_distance(p, q, a, b) < radius + track.radius - 1e-9:
                    return True
    return False


def steps_to_goal(
    course: SampledPath,
    ceiling: np.ndarray[Any, Any],
    tracks: Sequence[Track],
    radius: float,
    *,
    dt: float,
    unit: float,
    last: int,
    rise: int,
    fall: int,
    parts: int,
    most: int,
) -> int:
    """Fewest steps from (place 0, speed 0) to (the last place, speed 0); -1: none in ``most`` steps.

    ``ceiling`` is v^2 at the course's nodes, linear between them; a step of dt seconds goes from speed j to k
    (units of ``unit`` m/s) and covers (j + k) / last of the course's length for (j + k) units.
    """
    length = float(course.s[-1])
    states = {(0, 0)}
    free: dict[tuple[int, int, int], bool] = {}
    for step in range(most):
        following = set()
        for m, j in sorted(states):
            for k in range(max(0, j - fall), j + rise + 1):
                to = m + j + k
                if to > last:
                    continue
                key = (m, j, k)
                if key not in free:
                    free[key] = _below(course, ceiling, length / last, m, j, k, unit)
                if not free[key]:
                    continue
                clear = True
                for part in range(parts):
                    f0, f1 = part / parts, (part + 1) / parts
                    s0, s1 = ((m + 2 * j * f + (k - j) * f * f) * length / last for f in (f0, f1))
                    if hits(course, s0, s1, tracks, radius, (step + f0) * dt, (step + f1) * dt):
                        clear = False
                        break
                if clear:
                    following.add((to, k))
        states = following
        if (last, 0) in states:
            return step + 1
        if not states:
            return -1
    return -1


def _below(
    course: SampledPath, ceiling: np.ndarray[Any, Any], h: float, m: int, j: int, k: int, unit: float
) -> bool:
    if j + k == 0:
        return True
    s0, s1 = m * h, (m + j + k) * h
    at = [s0, *[float(s) for s in course.s if s0 < s < s1], s1]
    for s in at:
        x = (j * j + (k * k - j * j) * (s - s0) / (s1 - s0)) * unit * unit
        top = 0.0 if s >= course.s[-1] * (1 - 1e-12) else float(np.interp(s, course.s, ceiling))
        if x > top * (1 + 1e-9) + 1e-15:
            return False
    return True


def least_gap(
    profile: Profile,
    course: SampledPath,
    tracks: Sequence[Track],
    radius: float,
    *,
    t0: float = 0.0,
    dense: int,
) -> float:
    """Least gap between the robot and any track, on samples of the profile in time; metres."""
    t = np.linspace(0.0, profile.t[-1], dense)
    k = np.clip(np.searchsorted(profile.t, t, side="right") - 1, 0, len(profile.t) - 2)
    d = t - profile.t[k]
    s = profile.s[k] + d * (profile.v[k] + 0.5 * profile.a[k] * d)
    if course.curve is not None:
        xy = course.curve.at(s)[0]
    else:
        xy = np.stack([np.interp(s, course.s, course.xy[:, c]) for c in (0, 1)], axis=-1)
    worst = math.inf
    for one in tracks:
        there = t + t0 >= one.t[0]
        if there.any():
            e = (xy - one.at(t + t0))[there] * course.resolution
            worst = min(worst, float(np.sqrt((e * e).sum(axis=1)).min()) - radius - one.radius)
    return worst
