"""Polygon obstacles against the robot in continuous time: both move, and both may turn.

Written from the definitions, apart from the kernels that drive. Time is cut where anything changes: a part of the robot's
motion, a leg of a track. Within such an interval no point of the robot is faster than w1 and none of the obstacle faster
than w2 = speed + yaw rate x arm. With d the distance of the two outlines (0 where they overlap) in its middle and h half its
length, it is at least d - (w1 + w2) h in the whole interval. An interval in which that is more than 0 is clear; one with d
below :data:`TOUCHING` in its middle is a contact; any other is halved. So no overlap is missed, and what is called a
contact is one within :data:`TOUCHING`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lampyris.model.obstacles import Track
from lampyris.referee.geometry.moving_discs import STANDS, Episode, RobotMotion
from lampyris.referee.geometry.shapes import Ints
from lampyris.typing import Floats, Points

TOUCHING = 1e-8
"""Metres within which two outlines count as touching."""

_HALVINGS = 60
"""No interval is open after so many: it is then shorter than the clock's rounding."""

_AT_ONCE = 2_000_000
"""Pairs of a vertex and an edge that are looked at together."""


@dataclass(frozen=True, slots=True)
class PolygonPairs:
    """Times during which one part of the robot's motion meets one leg of the track of one polygon, (n,) each.

    Parameters
    ----------
    obstacle : its number.
    outline : its vertices, metres, (k, 2); x ahead, y to the left.
    begin, end, part : from when to when, and which part of the motion.
    at, velocity : of its centre at ``begin``: metres (y down), m/s; (n, 2).
    yaw, spin : its heading at ``begin`` and its yaw rate; radians counterclockwise.
    """

    obstacle: int
    outline: Points
    begin: Floats
    end: Floats
    part: Ints
    at: Points
    velocity: Points
    yaw: Floats
    spin: Floats

    def some(self, which: NDArray[np.generic]) -> PolygonPairs:
        """Those asked for."""
        columns = ("begin", "end", "part", "at", "velocity", "yaw", "spin")
        return replace(self, **{name: getattr(self, name)[which] for name in columns})

    def moving(self, motion: RobotMotion, moves: bool) -> PolygonPairs:
        """Those in which the robot moves, or those in which it stands."""
        return self.some((motion.top[self.part] > STANDS) == moves)


def polygon_pairs(motion: RobotMotion, tracks: Sequence[Track], resolution: float) -> list[PolygonPairs]:
    """Every part of the motion with every polygon that is there at the time, an entry for each polygon."""
    found: list[PolygonPairs] = []
    for k, track in enumerate(tracks):
        if track.outline is None or track.yaw is None or not len(motion.t0):
            continue
        first, last = max(float(track.t[0]), float(motion.t0[0])), float(motion.t1[-1])
        if last <= first:
            continue
        cuts = np.unique(np.concatenate(([first, last], motion.t0, track.t)))
        cuts = cuts[(cuts >= first) & (cuts <= last)]
        begin, end = cuts[:-1], cuts[1:]
        middle = 0.5 * (begin + end)
        part = np.maximum(np.searchsorted(motion.t0, middle, side="right") - 1, 0)
        leg = np.searchsorted(track.t, middle, side="right") - 1
        state = np.column_stack((track.xy * resolution, track.yaw))
        rates = np.vstack((np.diff(state, axis=0) / np.diff(track.t)[:, None], np.zeros((1, 3))))[leg]
        now = state[leg] + rates * (begin - track.t[leg])[:, None]
        found.append(
            PolygonPairs(
                k, np.array(track.outline), begin, end, part, now[:, :2], rates[:, :2], now[:, 2], rates[:, 2]
            )
        )
    return found


def _laid(outline: Points, place: Points, yaw: Floats) -> Points:
    """Vertices of an outline at poses, metres (y down); (m, k, 2)."""
    cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    ahead, left = outline[None, :, 0], outline[None, :, 1]
    x = place[:, :1] + ahead * cos - left * sin
    y = place[:, 1:] - ahead * sin - left * cos
    return np.stack((x, y), axis=2)


def outline_distances(one: Points, other: Points) -> Floats:
    """Distance between two polygons in each of m cases, 0 where they overlap; (m,).

    Parameters
    ----------
    one, other : vertices, (m, k, 2) and (m, n, 2); a polygon of one vertex is a point.
    """
    m, size = len(one), one.shape[1] * other.shape[1]
    out = np.zeros(m)
    some = max(1, _AT_ONCE // size)
    for k in range(0, m, some):
        a, b = one[k : k + some], other[k : k + some]
        gap = np.minimum(_to_edges(a, b), _to_edges(b, a))
        within = _inside(a[:, 0], b) | _inside(b[:, 0], a) | _cross(a, b)
        out[k : k + some] = np.where(within, 0.0, gap)
    return out


def _to_edges(points: Points, polygon: Points) -> Floats:
    """Least distance of any point to any edge, case by case; (m,)."""
    a = polygon[:, None]
    edge = np.roll(polygon, -1, axis=1)[:, None] - a
    away = points[:, :, None] - a
    square = (edge * edge).sum(axis=3)
    share = np.clip((away * edge).sum(axis=3) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    rest = away - share[..., None] * edge
    least: Floats = np.sqrt((rest * rest).sum(axis=3).min(axis=(1, 2)))
    return least


def _inside(point: Points, polygon: Points) -> NDArray[np.bool_]:
    """Whether the edges of a polygon go round a point, by the sum of the angles under which it sees them."""
    ray = polygon - point[:, None]
    next_ray = np.roll(ray, -1, axis=1)
    cross = ray[..., 0] * next_ray[..., 1] - ray[..., 1] * next_ray[..., 0]
    turn = np.arctan2(cross, (ray * next_ray).sum(axis=2)).sum(axis=1)
    round_it: NDArray[np.bool_] = np.abs(turn) > np.pi
    return round_it


def _cross(one: Points, other: Points) -> NDArray[np.bool_]:
    """Whether an edge of one cuts an edge of the other: shares along both of the point where their lines meet."""
    a, b = one[:, :, None], other[:, None]
    u, v = np.roll(one, -1, axis=1)[:, :, None] - a, np.roll(other, -1, axis=1)[:, None] - b
    away = b - a
    wide = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    safe = np.where(wide == 0.0, 1.0, wide)
    first = (away[..., 0] * v[..., 1] - away[..., 1] * v[..., 0]) / safe
    second = (away[..., 0] * u[..., 1] - away[..., 1] * u[..., 0]) / safe
    met = (wide != 0.0) & (first >= 0.0) & (first <= 1.0) & (second >= 0.0) & (second <= 1.0)
    found: NDArray[np.bool_] = met.any(axis=(1, 2))
    return found


def _gaps(motion: RobotMotion, p: PolygonPairs, t: Floats, radius: float, near: Floats) -> Floats:
    """Metres between the robot and the polygon at times, 0 where they overlap; (m,).

    Parameters
    ----------
    radius : of the robot, if it is a disc.
    near : what is farther apart than this by the discs around both has that distance, which is less.
    """
    place = motion.at(p.part, t)[0]
    since = t - p.begin
    centre = p.at + p.velocity * since[:, None]
    disc = motion.outline is None
    outline = np.zeros((1, 2)) if motion.outline is None else motion.outline
    arms = _arm(outline) + (radius if disc else 0.0) + _arm(p.outline)
    gap: Floats = np.hypot(*(centre - place).T) - arms
    close = np.flatnonzero(gap < near)
    if len(close):
        d = t[close] - motion.t0[p.part[close]]
        part = p.part[close]
        s = motion.s[part] + d * (motion.v[part] + 0.5 * motion.a[part] * d)
        yaw = np.zeros(len(close)) if disc else motion.pieces.yaw_at(motion.piece[part], s)
        robot = _laid(outline, place[close], yaw)
        theirs = _laid(p.outline, centre[close], p.yaw[close] + p.spin[close] * since[close])
        gap[close] = np.maximum(outline_distances(robot, theirs) - (radius if disc else 0.0), 0.0)
    return gap


def _arm(outline: Points) -> float:
    return float(np.hypot(*outline.T).max())


@dataclass(frozen=True, slots=True)
class _Look:
    """Intervals, the gap in the middle of each, and a lower bound of it in the whole of it."""

    pairs: PolygonPairs
    begin: Floats
    end: Floats
    gap: Floats
    low: Floats

    def halves(self, which: NDArray[np.generic]) -> tuple[PolygonPairs, Floats, Floats]:
        """Both halves of those asked for."""
        begin, end = self.begin[which], self.end[which]
        middle = 0.5 * (begin + end)
        pairs = self.pairs.some(np.tile(np.arange(len(self.begin))[which], 2))
        return pairs, np.concatenate((begin, middle)), np.concatenate((middle, end))


def _look(
    motion: RobotMotion, p: PolygonPairs, begin: Floats, end: Floats, radius: float, near: float
) -> _Look:
    h = 0.5 * (end - begin)
    quick = motion.quick[p.part] + np.hypot(*p.velocity.T) + np.abs(p.spin) * _arm(p.outline)
    gap = _gaps(motion, p, 0.5 * (begin + end), radius, quick * h + near)
    return _Look(p, begin, end, gap, gap - quick * h)


def first_polygon_contact(
    motion: RobotMotion, pairs: Sequence[PolygonPairs], radius: float
) -> tuple[float, int, float] | None:
    """The first contact while the robot moves: time (within an interval of contact), obstacle, gap (metres)."""
    best: tuple[float, int, float] | None = None
    for one in pairs:
        p = one.moving(motion, True)
        begin, end = p.begin, p.end
        for _ in range(_HALVINGS):
            if not len(begin):
                break
            look = _look(motion, p, begin, end, radius, TOUCHING)
            hit = look.gap < TOUCHING
            if hit.any():
                k = int(np.flatnonzero(hit)[np.argmin(begin[hit])])
                t = 0.5 * float(begin[k] + end[k])
                if best is None or t < best[0]:
                    best = (t, p.obstacle, float(look.gap[k]))
            open_ = look.low <= 0.0
            if best is not None:
                open_ &= begin < best[0]
            p, begin, end = look.halves(open_)
    return best


def nearest_polygon(
    motion: RobotMotion, pairs: Sequence[PolygonPairs], radius: float, give: float = 1e-4
) -> tuple[float, float, int]:
    """The least gap while the robot moves (metres, within ``give``; 0 where they overlap), when, and which.

    (infinity, 0, -1) if no polygon was there. Two sides that pass along each other are looked at in steps of ``give``.
    """
    best, when, who = np.inf, 0.0, -1
    for one in pairs:
        p = one.moving(motion, True)
        begin, end = p.begin, p.end
        for _ in range(_HALVINGS):
            if not len(begin):
                break
            look = _look(motion, p, begin, end, radius, min(best, 1e300))
            k = int(np.argmin(look.gap))
            if look.gap[k] < best:
                best, who, when = float(look.gap[k]), p.obstacle, 0.5 * float(begin[k] + end[k])
            # Nothing is less than no gap at all.
            p, begin, end = look.halves(np.maximum(look.low, 0.0) < best - give)
    return best, when, who


def standing_polygon_contacts(
    motion: RobotMotion, pairs: Sequence[PolygonPairs], radius: float, apart: float
) -> list[Episode]:
    """Contacts while the robot stands, in order of obstacle and time; those less than ``apart`` seconds apart are one.

    Their ends are within a sixteenth of ``apart``.
    """
    out: list[Episode] = []
    for one in pairs:
        spans: list[tuple[float, float]] = []
        for t0, t1 in _standing_spans(motion, one.moving(motion, False), radius, apart / 16.0):
            spans += zip(t0.tolist(), t1.tolist(), strict=True)
        for begin, end in sorted(spans):
            if out and out[-1].obstacle == one.obstacle and begin <= out[-1].end + apart:
                last = out.pop()
                begin, end = last.begin, max(last.end, end)
            out.append(Episode(one.obstacle, begin, end))
    return out


def _standing_spans(
    motion: RobotMotion, p: PolygonPairs, radius: float, fine: float
) -> Iterator[tuple[Floats, Floats]]:
    """Intervals no longer than ``fine`` with a contact in their middle, and all that are not proved clear."""
    begin, end = p.begin, p.end
    for _ in range(_HALVINGS):
        if not len(begin):
            return
        look = _look(motion, p, begin, end, radius, TOUCHING)
        done = (look.gap < TOUCHING) & (end - begin <= fine)
        yield begin[done], end[done]
        p, begin, end = look.halves((look.low <= 0.0) & ~done)


def polygon_gap_at(motion: RobotMotion, track: Track, radius: float, resolution: float, t: float) -> float:
    """Metres between robot and polygon at one time, 0 where they overlap; infinity before the obstacle is there."""
    assert track.outline is not None
    assert track.yaw is not None
    if t < track.t[0] or not len(motion.t0):
        return float("inf")
    part = np.array([max(0, int(np.searchsorted(motion.t0, t, side="right")) - 1)])
    when = np.array([min(max(t, float(motion.t0[0])), float(motion.t1[-1]))])
    x, y, yaw = (float(np.interp(t, track.t, column)) for column in (*track.xy.T, track.yaw))
    at, none = np.array([(x, y)]) * resolution, np.zeros((1, 2))
    pair = PolygonPairs(0, np.array(track.outline), when, when, part, at, none, np.array([yaw]), np.zeros(1))
    return float(_gaps(motion, pair, when, radius, np.array([np.inf]))[0])
