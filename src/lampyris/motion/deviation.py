"""How far two ways are apart."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris.typing import Floats, Points

_BLOCK = 64
"""Points, and lines, that are looked at together."""


def length_of(points: Points) -> float:
    """Length of a polyline, in the unit of its points."""
    return float(_lengths(points).sum())


def deviation(a: Points, b: Points, step: float) -> float:
    """The greatest distance of either polyline from the other, in the unit of their points.

    Looked at are the corners of both and points no farther apart than ``step`` between them, so it may be
    more by at most half of that. 100,000 points against as many: some 2 s.

    Parameters
    ----------
    a, b : float64 (n, 2), (m, 2); n, m >= 1.
    step : > 0.
    """
    return max(_farthest(_dense(a, step), b), _farthest(_dense(b, step), a))


def _lengths(points: Points) -> Floats:
    d = np.diff(points, axis=0)
    out: Floats = np.sqrt((d * d).sum(axis=1))
    return out


def _dense(points: Points, step: float) -> Points:
    if len(points) < 2:
        return points
    parts = np.maximum(np.ceil(_lengths(points) / step), 1.0).astype(np.int64)
    line = np.repeat(np.arange(len(parts)), parts)
    first = np.cumsum(parts) - parts
    share = (np.arange(len(line)) - first[line]) / parts[line]
    made = points[line] + share[:, None] * (points[line + 1] - points[line])
    return np.concatenate((made, points[-1:]))


def _boxes(low: Points, high: Points) -> tuple[NDArray[np.int64], Points, Points]:
    begin = np.arange(0, len(low), _BLOCK)
    return begin, np.minimum.reduceat(low, begin), np.maximum.reduceat(high, begin)


def _farthest(points: Points, line: Points) -> float:
    """The greatest distance of the points from the polyline.

    Blocks of points are held against those blocks of lines whose boxes may hold the nearest.
    """
    begin, end = (line[:-1], line[1:]) if len(line) > 1 else (line, line)
    first, low, high = _boxes(np.minimum(begin, end), np.maximum(begin, end))
    worst = 0.0
    for k in range(0, len(points), _BLOCK):
        some = points[k : k + _BLOCK]
        under, over = some.min(axis=0), some.max(axis=0)
        apart = np.maximum(np.maximum(low - over, under - high), 0.0)
        across = np.maximum(high, over) - np.minimum(low, under)
        least = (apart * apart).sum(axis=1)
        near = np.flatnonzero(least <= (across * across).sum(axis=1).min())
        which = (first[near][:, None] + np.arange(_BLOCK)).ravel()
        which = which[which < len(begin)]
        worst = max(worst, float(_squares(some, begin[which], end[which]).min(axis=1).max()))
    return math.sqrt(worst)


def _squares(points: Points, begin: Points, end: Points) -> NDArray[np.float64]:
    """Squared distance of each point from each line, (n, m)."""
    d, q = end - begin, points[:, None, :] - begin
    size = (d * d).sum(axis=1)
    share = np.clip((q * d).sum(axis=2) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
    e = q - share[:, :, None] * d
    out: NDArray[np.float64] = (e * e).sum(axis=2)
    return out
