"""How far two paths are apart."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris.typing import Floats, Points

_SAME = 1e-4
"""Share of the step by which two points or lines may differ that are looked at once."""
_OF_ALL = 1e-5
"""No more than this share of what both polylines cover."""
_PAIRS = 8_192
"""Pairs of a disc and a line that are looked at together: what stays in the processor's cache."""


def length_of(points: Points) -> float:
    """Length of a polyline, in the unit of its points."""
    return float(_lengths(points).sum())


def deviation(a: Points, b: Points, step: float) -> float:
    """The maximum distance of either polyline from the other, in the unit of their points.

    Looked at are the corners of both and points no farther apart than ``step`` between them, so it may be
    more by at most half of that (and a ten-thousandth of it where lines lie on one another). Points are
    gathered in discs, two of which lie in a larger one; a line that is too far from a disc to be the nearest of
    any point in it is not looked at below. Near linear along paths, and the number of points to 1.5 where all
    lines cross each other.

    Parameters
    ----------
    a, b : float64 (n, 2), (m, 2); n, m >= 1.
    step : > 0.
    """
    both = np.concatenate((a, b))
    same = min(_SAME * step, _OF_ALL * float(np.ptp(both, axis=0).max())) or math.ulp(1.0)
    return max(_farthest(_dense(a, step), b, same), _farthest(_dense(b, step), a, same))


def _lengths(points: Points) -> Floats:
    d = np.diff(points, axis=0)
    out: Floats = np.sqrt((d * d).sum(axis=1))
    return out


def _dense(points: Points, step: float) -> Points:
    if len(points) < 2:
        return points
    parts = np.maximum(np.ceil(_lengths(points) / step), 1.0).astype(np.int64)
    line = np.repeat(np.arange(len(parts)), index_array(parts))
    first = np.cumsum(parts) - parts
    share = (np.arange(len(line)) - first[line]) / parts[line]
    made = points[line] + share[:, None] * (points[line + 1] - points[line])
    return np.concatenate((made, points[-1:]))


class _Discs:
    """Discs around points by level: single points first, the disc around all of them last.

    Disc k of a level is around discs 2 k and 2 k + 1 of the level before.
    """

    def __init__(self, points: Points) -> None:
        low = high = points[_along_curve(points)]
        self.centre, self.radius = [low], [np.zeros(len(low))]
        while len(low) > 1:
            pairs = np.arange(0, len(low), 2)
            low, high = (
                np.minimum.reduceat(low, index_array(pairs)),
                np.maximum.reduceat(high, index_array(pairs)),
            )
            half = 0.5 * (high - low)
            self.centre.append(low + half)
            # Rounding must not leave a point outside.
            self.radius.append(
                np.sqrt((half * half).sum(axis=1)) * (1.0 + 1e-12) + 1e-12 * np.abs(high).max()
            )


def _along_curve(xy: Points) -> NDArray[np.int64]:
    """Numbers of the places in the order of a Z-order curve: neighbours in the list lie near each other."""
    least = xy.min(axis=0)
    width = max(float((xy.max(axis=0) - least).max()), 1e-300)
    at = np.minimum((xy - least) * (65_536.0 / width), 65_535.0).astype(np.uint64)
    for shift, mask in ((8, 0x00FF00FF), (4, 0x0F0F0F0F), (2, 0x33333333), (1, 0x55555555)):
        at = (at | (at << np.uint64(shift))) & np.uint64(mask)
    return np.argsort(at[:, 0] | (at[:, 1] << np.uint64(1)), kind="stable")


def _once(rows: Floats, same: float) -> Floats:
    """The first of the rows that are alike to within ``same``, as a path to and fro has them again and again."""
    _, first = np.unique(np.rint(rows / same), axis=0, return_index=True)
    once: Floats = rows[first]
    return once


def _farthest(points: Points, line: Points, same: float) -> float:
    """The maximum distance of the points from the polyline; what differs by less than ``same`` is one."""
    begin, end = (line[:-1], line[1:]) if len(line) > 1 else (line, line)
    # Of lines that lie on one another all would be nearest, and none could be left out.
    lines_once = _once(np.hstack((begin, end)), same)
    begin, end = lines_once[:, :2], lines_once[:, 2:]
    discs, worst = _Discs(_once(points, same)), 0.0
    # A level, numbers of discs, rising, and for each a line that may be the nearest of one of its points.
    todo = [(len(discs.radius) - 1, np.zeros(len(begin), dtype=np.int64), np.arange(len(begin)))]
    while todo:
        level, disc, lines = todo.pop()
        starts = np.flatnonzero(np.diff(disc, prepend=-1))
        sizes = np.diff(np.append(starts, len(disc)))
        away = np.sqrt(_squares(discs.centre[level][disc], begin[lines], end[lines]))
        least, radius = np.minimum.reduceat(away, index_array(starts)), discs.radius[level][disc[starts]]
        # Some point is at least so far away; discs all of whose points stay below that do not matter.
        worst = max(worst, float((least - radius).max()))
        if level == 0:
            continue
        most = np.where(least + radius > worst, least + 2.0 * radius, -1.0)
        kept = away <= np.repeat(most, index_array(sizes))
        disc, lines = disc[kept], lines[kept]
        for part in _parted(disc):
            below = np.concatenate((2 * disc[part], 2 * disc[part] + 1))
            there = below < len(discs.radius[level - 1])
            both = np.tile(lines[part], 2)[there]
            order = np.argsort(below[there], kind="stable")
            todo.append((level - 1, below[there][order], both[order]))
    return worst


def _parted(disc: NDArray[np.int64]) -> list[slice]:
    """A rising list cut between two discs where it is longer than is looked at together."""
    if len(disc) <= _PAIRS or disc[0] == disc[-1]:
        return [slice(None)] if len(disc) else []
    cut = int(np.searchsorted(disc, disc[len(disc) // 2], side="left"))
    cut = cut or int(np.searchsorted(disc, disc[0], side="right"))
    return [slice(cut, None), slice(cut)]


def _squares(points: Points, begin: Points, end: Points) -> Floats:
    """Squared distance of each point from its line, (m,); all arguments (m, 2)."""
    # Column by column: sums over an axis of two are slow.
    dx, dy = (end - begin).T
    qx, qy = (points - begin).T
    size = dx * dx + dy * dy
    share = np.clip((qx * dx + qy * dy) / np.where(size > 0.0, size, 1.0), 0.0, 1.0)
    ex, ey = qx - share * dx, qy - share * dy
    out: Floats = ex * ex + ey * ey
    return out
