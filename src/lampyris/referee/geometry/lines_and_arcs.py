"""Lines and arcs, measured a second time: where a curve runs, whether it hangs together, how near walls come.

Independent of :meth:`lampyris.model.curve.Curve.at`: an arc is a rotation about its centre here, and a nearly
straight one is summed as a series.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lampyris.model.curve import Curve, PoseCurve
from lampyris.model.grid import Grid
from lampyris.referee.geometry.shapes import Ints, slack
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats, Points

SAME = 1e-6
"""Cells, or parts of a unit vector, within which two pieces of a curve join."""

_GENTLE = 1e-4
"""Turn of a piece (radians) below which its series is exact and a centre would be too far off."""

_SHRUNK = 0.5 - 1e-9
"""Half a wall's side as it is judged: running along a wall's face or over its corner only touches."""

_LONG = 16.0
"""Cells of a line whose walls are looked up at once: a long slanting one has a box full of others' walls."""


@dataclass(frozen=True, slots=True)
class Pieces:
    """Pieces of several curves, one after the other, in metres.

    Parameters
    ----------
    at : (n, 2), where each begins.
    along : (n, 2), unit vector there.
    bend : (n,), curvature, 1/m, with its sign.
    begin, end : (n,), distance along its curve.
    first : (curves + 1,), number of each curve's first piece.
    yaw, turn : (n,), yaw of a robot with a heading where each begins (radians counterclockwise) and radians a metre;
        0 where it has none.
    """

    at: Points
    along: Points
    bend: Floats
    begin: Floats
    end: Floats
    first: Ints
    yaw: Floats
    turn: Floats

    def yaw_at(self, piece: Ints, s: Floats) -> Floats:
        """Yaw of the robot at distances ``s`` on its pieces."""
        return np.asarray(self.yaw[piece] + self.turn[piece] * (s - self.begin[piece]))

    @property
    def in_place(self) -> NDArray[np.bool_]:
        """Whether each piece is a turn on which the base stands still."""
        still: NDArray[np.bool_] = (self.along == 0.0).all(axis=1)
        return still

    def place(self, piece: Ints, s: Floats) -> tuple[Points, Points]:
        """Where a robot is (metres) and along what it drives, at distances ``s`` on its pieces; (m, 2) each.

        With t the heading, n what it turns to, and w = k l the turn so far: x = p + (sin w t + (1 - cos w) n)
        / k. Of a turn below 1e-4: x = p + l ((1 - w^2 / 6) t + (w / 2) n), off by l w^3 / 24.
        """
        length = s - self.begin[piece]
        t = self.along[piece]
        n = np.stack((-t[:, 1], t[:, 0]), axis=1)
        k = self.bend[piece]
        w = k * length
        sine, cosine = np.sin(w), np.cos(w)
        gentle = np.abs(w) < _GENTLE
        safe = np.where(gentle, 1.0, k)
        forth = np.where(gentle, length * (1.0 - w * w / 6.0), sine / safe)
        aside = np.where(gentle, length * w / 2.0, (1.0 - cosine) / safe)
        place = self.at[piece] + forth[:, None] * t + aside[:, None] * n
        return place, cosine[:, None] * t + sine[:, None] * n


def pieces_of(curves: tuple[Curve, ...], resolution: float) -> Pieces:
    """All pieces of some curves. A curve of none (start and goal are one) is a piece of no length."""
    at, along, bend, begin, end, first = [], [], [], [], [], [0]
    yaw, turn = [], []
    for curve in curves:
        n = len(curve.lengths)
        poses = curve if isinstance(curve, PoseCurve) else None
        turn.append(poses.turn if poses is not None and n else np.zeros(max(n, 1)))
        if poses is None:
            yaw.append(np.zeros(max(n, 1)))
        else:
            yaw.append(poses.yaw if n else np.array([poses.end_yaw]))
        if n == 0:
            at.append(np.array([curve.end]))
            along.append(np.array([(1.0, 0.0)]))
            bend.append(np.zeros(1))
            begin.append(np.zeros(1))
            end.append(np.zeros(1))
        else:
            sums = np.concatenate(([0.0], np.cumsum(curve.lengths)))
            at.append(curve.xy)
            along.append(curve.heading)
            bend.append(curve.curvature)
            begin.append(sums[:-1])
            end.append(sums[1:])
        first.append(first[-1] + max(n, 1))
    if not curves:
        nothing, none = np.zeros((0, 2)), np.zeros(0)
        return Pieces(nothing, nothing, none, none, none, np.array(first), none, none)
    return Pieces(
        np.concatenate(at) * resolution,
        np.concatenate(along),
        np.concatenate(bend),
        np.concatenate(begin),
        np.concatenate(end),
        np.array(first),
        np.concatenate(yaw),
        np.concatenate(turn),
    )


def joins(curve: Curve, name: str, turn_radius: float) -> Violation | None:
    """Whether a curve hangs together: pieces join, headings too (but at stops), and it ends at its end.

    Straight lines alone need no stops where the turn radius is 0: the robot turns while it drives.

    Rules: ``curve``, and ``bend`` where it is sharper than the robot can drive.
    """
    n = len(curve.lengths)
    if n == 0:
        return None
    if len(curve.stops) and not 0 <= curve.stops.min() <= curve.stops.max() < n:
        return Violation("curve", name, f"a stop before piece {int(curve.stops.max())} of {n}")
    off = np.abs(np.hypot(curve.heading[:, 0], curve.heading[:, 1]) - 1.0)
    if off.max() > SAME:
        k = int(off.argmax())
        return Violation("curve", f"{name}, piece {k}", f"its heading is {1 + float(off[k])!r} long, not 1")
    sharp = np.abs(curve.curvature) * turn_radius > 1.0 + SAME
    if sharp.any():
        k = int(sharp.argmax())
        what = f"radius {1 / abs(curve.curvature[k]):g} m; the robot drives {turn_radius:g} m at least"
        return Violation("bend", f"{name}, piece {k}", what)
    pieces = pieces_of((curve,), curve.resolution)
    to, goes = pieces.place(np.arange(n), pieces.end)
    to = to / curve.resolution
    gap = np.hypot(*(to - np.concatenate((curve.xy[1:], [curve.end]))).T)
    room = SAME * (1.0 + np.abs(to).max(axis=1))
    if (gap > room).any():
        k = int((gap > room).argmax())
        return Violation("curve", f"{name}, piece {k}", f"ends {gap[k]:g} cells from where the next begins")
    turn = np.hypot(*(goes[:-1] - curve.heading[1:]).T) > SAME * 10
    turn[curve.stops[curve.stops > 0] - 1] = False
    corners_are_driven = turn_radius == 0.0 and not curve.curvature.any()
    if turn.any() and not corners_are_driven:
        k = int(turn.argmax())
        return Violation("curve", f"{name}, piece {k + 1}", "turns in place where there is no stop")
    return None


def wall_along(
    curve: Curve, s0: float, s1: float, grid: Grid, radius: float
) -> tuple[float, float, tuple[int, int]] | None:
    """The first part between s0 and s1 too near to a wall: distance (metres), where (s), the wall.

    Too near: less than the radius, or into a wall for a robot without size. The border of the map is no wall.
    """
    limit = radius / grid.resolution
    give = slack(radius) / grid.resolution
    for near, s, cell in _pieces_and_walls(curve, s0, s1, grid, limit + 1.0):
        if near < limit - give or (near <= 0.0 and limit <= give):
            return near * grid.resolution, s, cell
    return None


def nearest_wall(curve: Curve, s0: float, s1: float, grid: Grid, reach: float) -> float:
    """The least distance from a stretch of a curve to a wall, metres; infinity if beyond ``reach``."""
    found = [d for d, _, _ in _pieces_and_walls(curve, s0, s1, grid, reach / grid.resolution)]
    least = min(found, default=math.inf) * grid.resolution
    return least if least <= reach else math.inf


def _pieces_and_walls(
    curve: Curve, s0: float, s1: float, grid: Grid, reach: float
) -> list[tuple[float, float, tuple[int, int]]]:
    """Of each short part of the path: distance to the nearest wall (cells), where it begins, which."""
    pieces = pieces_of((curve,), curve.resolution)
    res = curve.resolution
    out = []
    for k in range(len(pieces.bend)):
        lo, hi = max(s0, float(pieces.begin[k])), min(s1, float(pieces.end[k]))
        if hi < lo or (hi == lo and s1 > s0):
            continue
        bend = float(pieces.bend[k])
        # Parts of an arc turn by less than a right angle: their boxes are small, and angles have no seam.
        count = max(1, math.ceil((hi - lo) / res / _LONG), math.ceil(abs(bend) * (hi - lo) / 1.5))
        cuts = lo + (hi - lo) * np.arange(count + 1) / count
        ends, headings = pieces.place(np.full(count + 1, k), cuts)
        for j in range(count):
            a, b = ends[j] / res, ends[j + 1] / res
            bow = abs(bend) * (cuts[j + 1] - cuts[j]) ** 2 / res
            x, y = _walls_about(grid, a, b, reach + bow)
            if len(x) == 0:
                continue
            if abs(bend) * (cuts[j + 1] - cuts[j]) < _GENTLE and bow < 1e-10:
                d = segment_to_squares(a, b, x, y)
            else:
                d = arc_to_squares(a, b, headings[j], bend * res, float(cuts[j + 1] - cuts[j]) / res, x, y)
            i = int(d.argmin())
            out.append((float(d[i]), float(cuts[j]), (int(x[i]), int(y[i]))))
    return out


def _walls_about(grid: Grid, a: Points, b: Points, reach: float) -> tuple[Ints, Ints]:
    """Blocked cells whose squares lie within ``reach`` of the box of two points, cells."""
    low = np.floor(np.minimum(a, b) - reach).astype(np.int64)
    high = np.ceil(np.maximum(a, b) + reach).astype(np.int64) + 1
    x0, y0 = max(0, int(low[0])), max(0, int(low[1]))
    y, x = np.nonzero(grid.blocked[y0 : max(y0, int(high[1])), x0 : max(x0, int(high[0]))])
    return x + x0, y + y0


def _point(p: Points, x: Ints, y: Ints) -> Floats:
    """Distance of a point to squares, cells."""
    out: Floats = np.hypot(
        np.maximum(np.abs(p[..., 0] - x) - _SHRUNK, 0.0), np.maximum(np.abs(p[..., 1] - y) - _SHRUNK, 0.0)
    )
    return out


def segment_to_squares(a: Points, b: Points, x: Ints, y: Ints) -> Floats:
    """Distance in cells from the line a-b to the squares of cells (x, y); 0 where it enters one.

    The line is one for all squares, (2,), or one for each, (n, 2).
    """
    ax, ay = a[..., 0], a[..., 1]
    dx, dy = b[..., 0] - ax, b[..., 1] - ay
    length2 = np.maximum(dx * dx + dy * dy, 1e-300)
    best = np.minimum(_point(a, x, y), _point(b, x, y))
    sides = []
    for cx in (-_SHRUNK, _SHRUNK):
        for cy in (-_SHRUNK, _SHRUNK):
            px, py = x + cx - ax, y + cy - ay
            share = np.clip((px * dx + py * dy) / length2, 0.0, 1.0)
            best = np.minimum(best, np.hypot(px - share * dx, py - share * dy))
            sides.append(px * dy - py * dx)
    across = np.array(sides)
    meet = (
        (x + _SHRUNK > np.minimum(ax, b[..., 0]))
        & (x - _SHRUNK < np.maximum(ax, b[..., 0]))
        & (y + _SHRUNK > np.minimum(ay, b[..., 1]))
        & (y - _SHRUNK < np.maximum(ay, b[..., 1]))
        & (across.min(axis=0) < 0)
        & (across.max(axis=0) > 0)
    )
    return np.where(meet, 0.0, best)


def arc_to_squares(
    a: Points, b: Points, along: Points, bend: float, length: float, x: Ints, y: Ints
) -> Floats:
    """Distance in cells from an arc to the squares of cells (x, y); 0 where it enters one.

    The nearest pair is one of: an end of the arc and the square, a corner of the square and the arc, one of
    the circle's four outermost points and a side; or they meet, and the circle cuts a side within the arc.

    Parameters
    ----------
    a, b : ends, cells. along : unit vector at a. bend : 1 / radius, 1/cells, with its sign. length : cells.
    """
    rho = 1.0 / abs(bend)
    sign = math.copysign(1.0, bend)
    cx, cy = a[0] - along[1] / bend, a[1] + along[0] / bend
    begin = math.atan2(a[1] - cy, a[0] - cx)
    turn = length / rho

    def on_arc(px: ArrayLike, py: ArrayLike) -> NDArray[np.bool_]:
        angle = sign * (np.arctan2(np.subtract(py, cy), np.subtract(px, cx)) - begin)
        return np.asarray(angle - 2 * math.pi * np.floor(angle / (2 * math.pi)) <= turn)

    best = np.minimum(_point(a, x, y), _point(b, x, y))
    for ox, oy in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
        p = np.array((cx + rho * ox, cy + rho * oy))
        if bool(on_arc(p[0], p[1])):
            best = np.minimum(best, _point(p, x, y))
    for ox in (-_SHRUNK, _SHRUNK):
        for oy in (-_SHRUNK, _SHRUNK):
            px, py = x + ox, y + oy
            d = np.abs(np.hypot(px - cx, py - cy) - rho)
            best = np.minimum(best, np.where(on_arc(px, py), d, np.inf))
    for side in (-_SHRUNK, _SHRUNK):
        for root in (-1.0, 1.0):
            up = rho * rho - (x + side - cx) ** 2
            px, py = x + side, cy + root * np.sqrt(np.maximum(up, 0.0))
            cut = (up >= 0) & (np.abs(py - y) <= _SHRUNK) & on_arc(px, py)
            over = rho * rho - (y + side - cy) ** 2
            qx, qy = cx + root * np.sqrt(np.maximum(over, 0.0)), y + side
            cut |= (over >= 0) & (np.abs(qx - x) <= _SHRUNK) & on_arc(qx, qy)
            best = np.where(cut, 0.0, best)
    return best
