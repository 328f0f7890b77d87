"""Sampled bends: a dense polyline that lies on circles, and the circles themselves."""

from __future__ import annotations

import math
from typing import TypeAlias

import numpy as np

from lampyris.typing import Floats, Points

_NEAR = 1e-6
"""Cells: points so near to one circle are on it. Paths read from files are as exact as that."""
_CHORD = 0.5
"""Radians: the longest chord of a sampled circle. The sides of an octagon (0.79) are lines that are meant."""
_WHOLE = 5.0
"""Radians: the longest run; three points of a full circle would be two."""
_CHORDS = 3
"""Chords of a bend at least: any three points lie on a circle. Of fewer, lines beside it must touch it."""
_SHORT = 0.999
"""Cells: the longest chord of a bend of fewer; longer ones are lines that are meant."""
_TOUCH = 1e-5
"""Radians that such a line may be off."""

_Circle: TypeAlias = tuple[tuple[float, float], float]
"""Centre and radius, cells."""


def circled(points: Points) -> tuple[Points, Floats]:
    """The polyline whose rounded corners are the circles that a dense polyline was sampled from.

    Rounding the corners of a sampled circle again would give it another radius wherever the samples are not
    equally far apart: two samples at twice the distance beside one another cost two fifths of the radius.
    So on each chord of a run of at least four points of one circle (or of two or three, where the lines
    before and after it touch that circle) the point where the tangents at its ends meet is inserted, with the
    distance from it at which the arc begins.

    Parameters
    ----------
    points : float64 (n, 2), cells; no two in a row the same.

    Returns
    -------
    points : float64 (m, 2), m >= n.
    tangent : float64 (m,), cells: how long the tangent of the corner may be; infinity where nothing is known.
    """
    n = len(points)
    out: list[Points] = []
    most: list[Floats] = []
    k = done = 0
    while k + 1 < n:
        last = _run(points, k) if k + _CHORDS < n else k
        found = _of_run(points[k : last + 1]) if last > k else None
        if found is None:
            last, found = _between_lines(points, k)
        if found is None:
            k += 1
            continue
        out.append(points[done:k])
        most.append(np.full(k - done, np.inf))
        corners, tangent = _tangents(points[k : last + 1], *found)
        out.append(corners)
        most.append(tangent)
        k = done = last
    out.append(points[done:])
    most.append(np.full(n - done, np.inf))
    return np.concatenate(out), np.concatenate(most)


def _of_run(p: Points) -> _Circle | None:
    """The circle of a run, by three of its points."""
    return _circle(p[0], p[len(p) // 2], p[-1])


def _dot(a: Floats, b: Floats) -> float:
    return float(a[0] * b[0] + a[1] * b[1])


def _between_lines(points: Points, k: int) -> tuple[int, _Circle | None]:
    """A circle that begins at a point, of one or two short chords between two lines that touch it."""
    if not 0 < k < len(points) - 2:
        return k, None
    before = points[k] - points[k - 1]
    before = before / math.sqrt(_dot(before, before))
    for last in (k + 2, k + 1):
        if last + 1 >= len(points):
            continue
        p = points[k : last + 1]
        chord = p[1:] - p[:-1]
        length = np.sqrt((chord * chord).sum(axis=1))
        if length.max() > _SHORT:
            continue
        after = points[last + 1] - points[last]
        after = after / math.sqrt(_dot(after, after))
        across = p[-1] - p[0]
        whole = math.sqrt(_dot(across, across))
        sine = float(before[0] * across[1] - before[1] * across[0]) / max(whole, 1e-300)
        if abs(sine) < 1e-3 or _dot(before, across) <= 0.0:
            continue
        radius = 0.5 * whole / abs(sine)
        aside = np.array((-before[1], before[0])) * (radius if sine > 0.0 else -radius)
        away = p - (p[0] + aside)
        touches = abs(_dot(after, away[-1])) <= _TOUCH * radius and _dot(after, across) > 0.0
        on = np.abs(np.sqrt((away * away).sum(axis=1)) - radius).max() <= _NEAR
        if touches and on and length.max() <= _CHORD * radius:
            x, y = (p[0] + aside).tolist()
            return last, ((x, y), radius)
    return k, None


def _run(points: Points, first: int) -> int:
    """The last point of the longest run of one circle that begins at ``first``."""
    if not _fits(points[first : first + _CHORDS + 1]):
        return first
    low, step = first + _CHORDS, 1
    while low + step < len(points) and _fits(points[first : low + step + 1]):
        low, step = low + step, 2 * step
    while step > 0:
        if low + step < len(points) and _fits(points[first : low + step + 1]):
            low += step
        step //= 2
    return low


def _fits(p: Points) -> bool:
    """Whether points are on one circle, in order, with short chords."""
    found = _of_run(p)
    if found is None:
        return False
    (x, y), radius = found
    away = p - (x, y)
    if np.abs(np.sqrt((away * away).sum(axis=1)) - radius).max() > _NEAR:
        return False
    turned = away[:-1, 0] * away[1:, 1] - away[:-1, 1] * away[1:, 0]
    if not ((turned > 0.0).all() or (turned < 0.0).all()):
        return False
    chord = np.diff(p, axis=0)
    length = np.sqrt((chord * chord).sum(axis=1))
    # A chord is shorter than its arc by 1 % at the longest; that is no matter here.
    return bool(length.max() <= _CHORD * radius and length.sum() <= _WHOLE * radius)


def _circle(a: Floats, b: Floats, c: Floats) -> _Circle | None:
    """Centre and radius of the circle through three points; None: they lie on a line."""
    (bx, by), (cx, cy) = (b - a).tolist(), (c - a).tolist()
    cross = 2.0 * (bx * cy - by * cx)
    bb, cc = bx * bx + by * by, cx * cx + cy * cy
    # A bulge of the order of what points are off by is none.
    if abs(cross) <= 8.0 * _NEAR * math.sqrt(cc):
        return None
    x, y = (cy * bb - by * cc) / cross, (bx * cc - cx * bb) / cross
    return (float(a[0]) + x, float(a[1]) + y), math.sqrt(x * x + y * y)


def _tangents(p: Points, centre: tuple[float, float], radius: float) -> tuple[Points, Floats]:
    """The first point of a run and the corner on each of its chords, with the tangents."""
    a = p[:-1] - centre
    half = 0.5 * np.sqrt(np.square(np.diff(p, axis=0)).sum(axis=1))
    # Chord = 2 r sin(half), tangent = r tan(half); the corner is over the middle of the chord.
    cos = np.sqrt(1.0 - np.square(half / radius))
    middle = a + 0.5 * np.diff(p, axis=0)
    corners = np.concatenate((p[:1], middle / (cos * cos)[:, None] + centre))
    return corners, np.concatenate(([np.inf], half / cos))
