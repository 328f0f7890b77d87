"""String pulling: a polyline checked against the map, and pulled straight between its own points."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris._core.arrays import index_array
from lampyris.errors import SettingError
from lampyris.kernels.motion.line_of_sight import SAME, line_gaps, pull
from lampyris.model.grid import Grid, frozen
from lampyris.typing import BoolGrid, Floats, Points

_TRIFLE = 1e-10
"""What is forgiven to a clearance (cells), a tenth of what the kernels shave off the walls."""
_STRAIGHT = 1e-11
"""A point that is no farther than this (cells) beside the line of its neighbours is no corner."""


@dataclass(frozen=True, slots=True, eq=False)
class Polyline:
    """A polyline in its piece of the map, cells.

    Parameters
    ----------
    xs, ys : float64 (n,), relative to ``corner``.
    heading, length : float64 (n - 1, 2) and (n - 1,): unit vector and length of each line.
    need : float64 (n - 1,), > 0: squared clearance that what replaces each line must keep: the disc's
        radius, or what the line itself has where that is less.
    reach : the disc's radius, or a trifle.
    wall : bool, the piece of the map around the polyline.
    corner : float64 (2,), the cell at the piece's top left.
    end : the last point as it was given.
    """

    xs: Floats
    ys: Floats
    heading: Points
    length: Floats
    need: Floats
    reach: float
    wall: BoolGrid
    corner: Floats
    end: tuple[float, float]

    def over(self, xs: Floats, ys: Floats, need: Floats) -> Polyline:
        """The same with other points."""
        step = np.stack((np.diff(xs), np.diff(ys)), axis=1)
        length = np.sqrt(step[:, 0] * step[:, 0] + step[:, 1] * step[:, 1])
        return replace(self, xs=xs, ys=ys, need=need, length=length, heading=step / length[:, None])

    def kept(self, chain: NDArray[np.int64]) -> Polyline:
        """Only some of the points, their numbers in order; both ends, or the one if they are the same."""
        if len(chain) == 1:
            return self.over(self.xs[chain], self.ys[chain], self.need[:0])
        return self.over(
            self.xs[chain], self.ys[chain], np.minimum.reduceat(self.need, index_array(chain[:-1]))
        )

    def corners(self) -> NDArray[np.int64]:
        """The numbers of both ends and of the points that do not lie on the line between their neighbours."""
        a, b = self.heading[:-1], self.heading[1:]
        aside = np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) * np.minimum(self.length[:-1], self.length[1:])
        onward = a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] > 0.0
        corner = np.concatenate(([True], (aside > _STRAIGHT) | ~onward, [True]))
        return np.flatnonzero(corner)


def lines_of(points: ArrayLike, grid: Grid, radius: float) -> Polyline:
    """A polyline that a disc of that radius (cells) follows; without points that follow themselves.

    Raises
    ------
    SettingError : ``PATH_POINTS``, ``PATH_OUTSIDE``, ``PATH_BLOCKED``.
    """
    given = _points(points, grid)
    end = (float(given[-1, 0]), float(given[-1, 1]))
    number = distinct(given)
    xy = given[number]
    reach = max(radius, _TRIFLE)
    pad = math.ceil(min(reach, float(grid.width + grid.height)) + 1.0)
    x0, y0 = (max(0, math.floor(v) - pad) for v in xy.min(axis=0).tolist())
    x1, y1 = (math.ceil(v) + pad + 1 for v in xy.max(axis=0).tolist())
    # Only the piece of the map around: a kernel's plain form turns its arrays into lists.
    # Frozen whether it is a copy or not: to numba what cannot be written is of another type.
    wall = frozen(np.ascontiguousarray(grid.blocked[y0:y1, x0:x1]))
    corner = np.array([x0, y0], dtype=np.float64)
    xs, ys = xy[:, 0] - corner[0], xy[:, 1] - corner[1]
    gaps = np.ones(len(xs) - 1)
    if len(xs) > 1:
        line_gaps(wall.ravel(), wall.shape[1], wall.shape[0], xs, ys, reach, gaps)
    if len(xs) == 1 or (gaps == 0.0).any():
        _refuse(xy, number, grid, int((gaps == 0.0).argmax()) if len(xs) > 1 else 0)
    own = np.maximum(np.sqrt(gaps) - _TRIFLE, _TRIFLE)
    need = np.where(gaps < reach * reach, own * own, reach * reach)
    empty = np.zeros(0)
    return Polyline(xs, ys, np.zeros((0, 2)), empty, empty, reach, wall, corner, end).over(xs, ys, need)


def pull_straight(lines: Polyline) -> Polyline:
    """The polyline with fewer of its points, and shorter, if that is possible."""
    n = len(lines.xs)
    if n < 3:
        return lines
    mark, link, back, chain = np.zeros((4, n), dtype=np.int64)
    height, width = lines.wall.shape
    wall = lines.wall.ravel()
    count = pull(
        wall, width, height, lines.xs, lines.ys, lines.need, lines.reach,
        mark, link, np.zeros(n), back, chain,
    )  # fmt: skip
    chain = chain[:count]
    chain = chain[distinct(np.stack((lines.xs[chain], lines.ys[chain]), axis=1))]
    return lines if len(chain) == n else lines.kept(chain)


def _points(points: ArrayLike, grid: Grid) -> Points:
    """Points that lie on the map, float64 (n, 2)."""
    try:
        given = np.array(points, dtype=np.float64)
    except (TypeError, ValueError):
        given = np.zeros(0)
    if given.ndim != 2 or given.shape[1] != 2 or len(given) == 0:
        raise SettingError(
            "PATH_POINTS", f"an array of shape {given.shape}", where="points", allowed="(n, 2), n >= 1"
        )
    x, y = given[:, 0], given[:, 1]
    inside = (x >= -0.5) & (x <= grid.width - 0.5) & (y >= -0.5) & (y <= grid.height - 0.5)
    if not inside.all():
        k = int(inside.argmin())
        finite = bool(np.isfinite(given[k]).all())
        raise SettingError(
            "PATH_OUTSIDE" if finite else "PATH_POINTS",
            f"({x[k]:.9g}, {y[k]:.9g})",
            where=f"points[{k}]",
            allowed=f"points of the map, {grid.width} x {grid.height} cells: "
            f"x -0.5 to {grid.width - 0.5}, y -0.5 to {grid.height - 0.5}",
        )
    return given


def distinct(xy: Points) -> NDArray[np.int64]:
    """The numbers of points without those that are where the one before was; both ends stay."""
    n = len(xy)
    step = np.diff(xy, axis=0)
    if not ((step * step).sum(axis=1) <= SAME * SAME).any():
        return np.arange(n)
    kept = [0]
    for k in range(1, n):
        if not _same(xy, k, kept[-1]):
            kept.append(k)
    if kept[-1] != n - 1:
        # The last point is returned as it was given, not as one next to it.
        if len(kept) > 1:
            kept.pop()
        if not _same(xy, n - 1, kept[-1]):
            kept.append(n - 1)
    return np.array(kept)


def _same(xy: Points, i: int, j: int) -> bool:
    dx, dy = xy[i] - xy[j]
    return bool(dx * dx + dy * dy <= SAME * SAME)


def _refuse(xy: Points, number: NDArray[np.int64], grid: Grid, line: int) -> None:
    """Name the first blocked square that a line of the polyline goes through, if there is one.

    The line is cut by the strips of columns and of rows that the squares stand in; the square that it is in
    from the least share of its length on is the first.
    """
    (ax, ay), (bx, by) = xy[line], xy[min(line + 1, len(xy) - 1)]
    x0, x1 = max(0, math.floor(min(ax, bx))), math.ceil(max(ax, bx)) + 1
    y0, y1 = max(0, math.floor(min(ay, by))), math.ceil(max(ay, by)) + 1
    rows, columns = np.nonzero(grid.blocked[y0:y1, x0:x1])
    low, high = np.zeros(len(rows)), np.ones(len(rows))
    for a, b, middle in ((ax, bx, columns + float(x0)), (ay, by, rows + float(y0))):
        # A tenth less than what the kernels shave off, so that none of theirs is missed.
        near, far = middle - a - (0.5 - 0.9e-9), middle - a + (0.5 - 0.9e-9)
        if a == b:
            high = np.where((near > 0.0) | (far < 0.0), -1.0, high)
        else:
            enter, leave = near / (b - a), far / (b - a)
            low = np.maximum(low, np.minimum(enter, leave))
            high = np.minimum(high, np.maximum(enter, leave))
    hit = low <= high
    if not hit.any():
        return
    k = int(np.where(hit, low, np.inf).argmin())
    x, y = float(ax + low[k] * (bx - ax)), float(ay + low[k] * (by - ay))
    raise SettingError(
        "PATH_BLOCKED",
        f"at ({x:.9g}, {y:.9g}) it enters blocked cell ({columns[k] + x0}, {rows[k] + y0})",
        where=f"{'points' if len(xy) == 1 else 'from points'}[{number[line]}]",
        allowed="a path through free cells; it may touch blocked ones",
        todo="plan it again on this map",
    )
