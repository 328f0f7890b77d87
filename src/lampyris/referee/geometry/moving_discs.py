"""Discs swept against discs in exact continuous time: the robot on lines and arcs, obstacles on their tracks.

Time is cut where anything changes: a stretch, a piece of the curve, a leg of a track. Within such an interval
the robot has one acceleration on one line or arc, and the obstacle one velocity. Where the robot stands, the
times of contact are roots of a quadratic. Where it moves, the interval is halved until each part is proved
clear or found in contact:

with m its middle, h half its length, d = |R - O| at m, w = |R'| + |O'| at most, and f = d^2, both

- ``d - w h`` (nobody is faster than that), and
- ``sqrt(f - |f'| h - (d + w h) A h^2)``, since f'' = 2 |R' - O'|^2 + 2 (R - O) R'' >= -2 D A

are lower bounds of the distance in it. The second makes the number of halvings a logarithm even where two
discs pass in exact touch; the first alone needs 1e5 parts for a touch resolved to 1e-9 m.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris.model.obstacles import Track
from lampyris.referee.geometry.lines_and_arcs import Pieces
from lampyris.referee.geometry.moving_footprint import signed_distance, times_within
from lampyris.referee.geometry.shapes import TOUCH, Ints
from lampyris.typing import Floats, Points

STANDS = 1e-9
"""m/s below which a robot stands."""

_HALVINGS = 48
"""An interval that is still open after so many is as short as the clock's rounding: discs in touch."""


@dataclass(frozen=True, slots=True)
class RobotMotion:
    """The robot's motion cut into parts: one acceleration on one piece each.

    Parameters
    ----------
    t0, t1 : seconds, (n,).
    s, v, a : at t0: metres along the curve, m/s, m/s2.
    piece : number of the piece in ``pieces``.
    pieces : all curves' pieces.
    outline : vertices of a footprint, metres, (k, 2); None: a disc, and distances are those of its centre.
    """

    t0: Floats
    t1: Floats
    s: Floats
    v: Floats
    a: Floats
    piece: Ints
    pieces: Pieces
    outline: Points | None = None

    def gap(self, part: Ints, t: Floats, centre: Points) -> Floats:
        """Metres from points to the centre of the disc, or to the footprint (negative inside), at times of parts; (m,)."""
        place = self.at(part, t)[0]
        if self.outline is None:
            away = place - centre
            return np.asarray(np.sqrt((away * away).sum(axis=1)))
        d = t - self.t0[part]
        s = self.s[part] + d * (self.v[part] + 0.5 * self.a[part] * d)
        return signed_distance(self.outline, place, self.pieces.yaw_at(self.piece[part], s), centre)

    @property
    def quick(self) -> Floats:
        """Maximum speed of any point of the robot, of each part."""
        if self.outline is None:
            return self.top
        arm = float(np.hypot(*self.outline.T).max())
        base = np.where(self.pieces.in_place, 0.0, 1.0)
        return self.top * (base + np.abs(self.pieces.turn) * arm)[self.piece]

    def at(self, part: Ints, t: Floats) -> tuple[Points, Points]:
        """Where the robot is (metres) and its velocity (m/s) at times ``t`` of some parts; (m, 2) each."""
        d = t - self.t0[part]
        a, v = self.a[part], self.v[part]
        place, along = self.pieces.place(self.piece[part], self.s[part] + d * (v + 0.5 * a * d))
        return place, along * np.maximum(v + a * d, 0.0)[:, None]

    @property
    def top(self) -> Floats:
        """Maximum speed of each part."""
        return np.maximum(self.v, self.v + self.a * (self.t1 - self.t0))

    @property
    def lateral(self) -> Floats:
        """Maximum lateral acceleration of each part, m/s2."""
        return self.top**2 * np.abs(self.pieces.bend[self.piece])


def motion_of(
    t: Floats, s: Floats, v: Floats, a: Floats, leg: Ints, pieces: Pieces, outline: Points | None = None
) -> RobotMotion:
    """Cut a drive's stretches at the borders of pieces. ``leg`` numbers curves of ``pieces``.

    The distance at the end of a stretch is the next one's s (they are checked to agree), except where the leg
    changes.
    """
    columns = _segments(t, s, v, a, leg, pieces)
    t0, t1, at, speed, rate, low, high = columns[:7]
    middle = at + 0.5 * (t1 - t0) * (speed + 0.25 * rate * (t1 - t0))
    piece = np.zeros(len(t0), dtype=np.int64)
    for k in range(len(pieces.first) - 1):
        here = np.flatnonzero(low == pieces.first[k])
        begins = pieces.begin[pieces.first[k] : pieces.first[k + 1]]
        found = np.searchsorted(begins, middle[here], side="right") - 1
        piece[here] = low[here] + np.clip(found, 0, high[here] - low[here] - 1)
    return RobotMotion(t0, t1, at, speed, rate, piece, pieces, outline)


def _segments(
    t: Floats, s: Floats, v: Floats, a: Floats, leg: Ints, pieces: Pieces
) -> tuple[Floats, Floats, Floats, Floats, Floats, Ints, Ints]:
    """Stretches cut at borders: begin, end, s, v, a, and the first and one past the last piece of the leg."""
    n = len(t) - 1
    dt = np.diff(t)
    end = s[:n] + dt * (v[:n] + 0.5 * a[:n] * dt)
    rows = [np.stack((t[:n], s[:n], v[:n], a[:n], leg[:n].astype(np.float64)), axis=1)]
    for k in range(len(pieces.first) - 1):
        inner = pieces.begin[pieces.first[k] + 1 : pieces.first[k + 1]]
        i, j = np.searchsorted(inner, s[:n], side="right"), np.searchsorted(inner, end, side="left")
        for m in np.flatnonzero((leg[:n] == k) & (j > i)).tolist():
            border = inner[i[m] : j[m]]
            span = border - s[m]
            pace = v[m] + np.sqrt(np.maximum(v[m] ** 2 + 2 * a[m] * span, 0.0))
            later = 2 * span / np.where(pace > 0, pace, np.inf)
            speed = np.maximum(v[m] + a[m] * later, 0.0)
            one = np.ones(len(border))
            cut = np.stack((t[m] + later, border, speed, a[m] * one, k * one), axis=1)
            rows.append(cut[(cut[:, 0] > t[m]) & (cut[:, 0] < t[m + 1])])
    table = np.concatenate(rows)
    table = table[np.argsort(table[:, 0], kind="stable")]
    legs = table[:, 4].astype(np.int64)
    t1 = np.append(table[1:, 0], t[-1]) if len(table) else table[:, 0]
    return table[:, 0], t1, table[:, 1], table[:, 2], table[:, 3], pieces.first[legs], pieces.first[legs + 1]


class Pairs(NamedTuple):
    """Times during which one part of the robot's motion meets one leg of a track, (n,) each."""

    begin: Floats
    end: Floats
    part: Ints
    obstacle: Ints
    at: Points
    """Of the obstacle at ``begin``, metres; (n, 2)."""
    velocity: Points
    """Of the obstacle, m/s; (n, 2)."""
    reach: Floats
    """Sum of the two radii, metres."""

    def some(self, which: NDArray[np.generic]) -> Pairs:
        """Those asked for."""
        return Pairs(*(column[which] for column in self))

    def twice(self) -> Pairs:
        """All of them, and all once more."""
        return self.some(np.tile(np.arange(len(self.begin)), 2))


def pairs_of(motion: RobotMotion, tracks: Sequence[Track], radius: float, resolution: float) -> Pairs:
    """Every part of the motion with every disc that is there at the time."""
    columns: list[Pairs] = []
    last = float(motion.t1[-1]) if len(motion.t1) else 0.0
    for k, track in enumerate(tracks):
        if track.outline is not None:
            continue
        there = max(float(track.t[0]), float(motion.t0[0])) if len(motion.t0) else last
        inside = track.t[(track.t > there) & (track.t < last)]
        begin = motion.t0[(motion.t0 > there) & (motion.t0 < last)]
        cuts = np.unique(np.concatenate(([there], begin, inside, [last])))
        cuts = cuts[(cuts >= there) & (cuts <= last)]
        if last <= there:
            continue
        a, b = cuts[:-1], cuts[1:]
        middle = 0.5 * (a + b)
        part = np.clip(np.searchsorted(motion.t0, middle, side="right") - 1, 0, None)
        leg = np.searchsorted(track.t, middle, side="right") - 1
        xy = track.xy * resolution
        moves = np.concatenate((np.diff(xy, axis=0) / np.diff(track.t)[:, None], [(0.0, 0.0)]))
        u = moves[leg]
        at = xy[leg] + u * (a - track.t[leg])[:, None]
        n = len(a)
        reach = np.full(n, radius + track.radius)
        columns.append(Pairs(a, b, part, np.full(n, k), at, u, reach))
    if not columns:
        none, whole, flat = np.zeros(0), np.zeros(0, dtype=np.int64), np.zeros((0, 2))
        return Pairs(none, none, whole, whole, flat, flat, none)
    return Pairs(*(np.concatenate([c[i] for c in columns]) for i in range(len(Pairs._fields))))


def moving(motion: RobotMotion, pairs: Pairs) -> NDArray[np.bool_]:
    """Whether the robot moves in each pair's time."""
    return motion.top[pairs.part] > STANDS


class _Seen(NamedTuple):
    """One middle of each interval looked at."""

    distance: Floats
    low: Floats
    """A lower bound of the distance in the whole interval."""


def _look(motion: RobotMotion, p: Pairs, begin: Floats, end: Floats) -> _Seen:
    m, h = 0.5 * (begin + end), 0.5 * (end - begin)
    place, drive = motion.at(p.part, m)
    centre = p.at + p.velocity * (m - p.begin)[:, None]
    if motion.outline is not None:
        d = motion.gap(p.part, m, centre)
        return _Seen(d, d - (motion.quick[p.part] + np.hypot(p.velocity[:, 0], p.velocity[:, 1])) * h)
    gap = place - centre
    f = (gap * gap).sum(axis=1)
    d = np.sqrt(f)
    top = motion.top[p.part]
    w = (top + np.hypot(p.velocity[:, 0], p.velocity[:, 1])) * h
    rate = 2.0 * np.abs((gap * (drive - p.velocity)).sum(axis=1))
    pull = np.abs(motion.a[p.part]) + motion.lateral[p.part]
    square = f - rate * h - (d + w) * pull * h * h
    return _Seen(d, np.maximum(d - w, np.sqrt(np.maximum(square, 0.0))))


def first_contact(motion: RobotMotion, pairs: Pairs) -> tuple[float, int, float] | None:
    """The first contact while the robot moves: time (within a part), obstacle, distance of the centres (metres).

    Contact is an overlap of more than :data:`lampyris.referee.geometry.shapes.TOUCH`.
    """
    p = pairs.some(np.flatnonzero(moving(motion, pairs)))
    limit = p.reach - TOUCH * np.maximum(1.0, p.reach)
    keep = limit > 0
    p, limit = p.some(keep), limit[keep]
    begin, end = p.begin, p.end
    best: tuple[float, int, float] | None = None
    for _ in range(_HALVINGS):
        if len(begin) == 0:
            break
        seen = _look(motion, p, begin, end)
        hit = seen.distance < limit
        if hit.any():
            k = int(np.flatnonzero(hit)[np.argmin(begin[hit])])
            t = 0.5 * float(begin[k] + end[k])
            if best is None or t < best[0]:
                best = (t, int(p.obstacle[k]), float(seen.distance[k]))
        # What is in contact is halved on towards its beginning; what begins after the first known is done.
        open_ = np.flatnonzero(seen.low < limit)
        if best is not None:
            open_ = open_[begin[open_] < best[0]]
        p, limit, begin, end = p.some(open_), limit[open_], begin[open_], end[open_]
        begin, end = _halves(begin, end)
        p = p.twice()
        limit = np.concatenate((limit, limit))
    return best


def _halves(begin: Floats, end: Floats) -> tuple[Floats, Floats]:
    m = 0.5 * (begin + end)
    return np.concatenate((begin, m)), np.concatenate((m, end))


def nearest(motion: RobotMotion, pairs: Pairs, give: float = 1e-6) -> tuple[float, float, int]:
    """The least gap between robot and obstacle while it moves (metres, within ``give``), when, and which.

    (infinity, 0, -1) if nobody was there. A gap below 0 is how far two discs overlap.
    """
    p = pairs.some(np.flatnonzero(moving(motion, pairs)))
    begin, end = p.begin, p.end
    best, when, who = np.inf, 0.0, -1
    for _ in range(_HALVINGS):
        if len(begin) == 0:
            break
        seen = _look(motion, p, begin, end)
        k = int(np.argmin(seen.distance - p.reach))
        if seen.distance[k] - p.reach[k] < best:
            best, who = float(seen.distance[k] - p.reach[k]), int(p.obstacle[k])
            when = 0.5 * float(begin[k] + end[k])
        open_ = np.flatnonzero(seen.low - p.reach < best - give)
        p, begin, end = p.some(open_), begin[open_], end[open_]
        begin, end = _halves(begin, end)
        p = p.twice()
    return best, when, who


class Episode(NamedTuple):
    """A contact while the robot stood: which obstacle, from when to when."""

    obstacle: int
    begin: float
    end: float


def standing_contacts(motion: RobotMotion, pairs: Pairs, apart: float = 1e-9) -> list[Episode]:
    """Contacts while the robot stands, in order of obstacle and time.

    Those of one obstacle that are no more than ``apart`` seconds apart are one.
    """
    p = pairs.some(np.flatnonzero(~moving(motion, pairs)))
    if len(p.begin) == 0:
        return []
    limit = p.reach - TOUCH * np.maximum(1.0, p.reach)
    if motion.outline is not None:
        return _on_footprint(motion, p, limit, apart)
    gap = p.at - motion.at(p.part, p.begin)[0]
    u = p.velocity
    a = (u * u).sum(axis=1)
    b = (gap * u).sum(axis=1)
    c = (gap * gap).sum(axis=1) - limit * np.maximum(limit, 0.0)
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    crosses = (a > 0) & (b * b - a * c > 0)
    safe = np.where(crosses, a, 1.0)
    still = (a == 0) & (c < 0)
    length = p.end - p.begin
    enter = np.where(still, 0.0, np.clip((-b - root) / safe, 0.0, length))
    leave = np.where(still, length, np.clip((-b + root) / safe, 0.0, length))
    met = np.flatnonzero((still | crosses) & (leave > enter) & (limit > 0))
    out: list[Episode] = []
    for k in met[np.lexsort((p.begin[met], p.obstacle[met]))].tolist():
        one = Episode(int(p.obstacle[k]), float(p.begin[k] + enter[k]), float(p.begin[k] + leave[k]))
        if out and out[-1].obstacle == one.obstacle and one.begin <= out[-1].end + apart:
            one = one._replace(begin=out.pop().begin)
        out.append(one)
    return out


def _on_footprint(motion: RobotMotion, p: Pairs, limit: Floats, apart: float) -> list[Episode]:
    """As :func:`standing_contacts`, of a footprint."""
    assert motion.outline is not None
    moves = np.hypot(p.velocity[:, 0], p.velocity[:, 1]) * (p.end - p.begin)
    near = np.flatnonzero((motion.gap(p.part, p.begin, p.at) < limit + moves) & (limit > 0))
    out: list[Episode] = []
    for k in near[np.lexsort((p.begin[near], p.obstacle[near]))].tolist():
        part, begin = p.part[k : k + 1], float(p.begin[k])
        place = motion.at(part, p.begin[k : k + 1])[0][0]
        yaw = float(motion.pieces.yaw_at(motion.piece[part], motion.s[part])[0])
        length = float(p.end[k]) - begin
        found = times_within(motion.outline, place, yaw, p.at[k], p.velocity[k], float(limit[k]), length)
        for t0, t1 in found:
            one = Episode(int(p.obstacle[k]), begin + t0, begin + t1)
            if out and out[-1].obstacle == one.obstacle and one.begin <= out[-1].end + apart:
                one = one._replace(begin=out.pop().begin)
            out.append(one)
    return out


def gap_at(motion: RobotMotion, track: Track, radius: float, resolution: float, t: float) -> float:
    """Metres between the two discs' rims at one time; infinity before the obstacle is there."""
    if t < track.t[0] or len(motion.t0) == 0:
        return float("inf")
    part = np.array([max(0, int(np.searchsorted(motion.t0, t, side="right")) - 1)])
    when = np.array([min(max(t, float(motion.t0[0])), float(motion.t1[-1]))])
    x, y = (float(np.interp(t, track.t, track.xy[:, k])) * resolution for k in (0, 1))
    if motion.outline is not None:
        return float(motion.gap(part, when, np.array([(x, y)]))[0]) - track.radius
    place = motion.at(part, when)[0][0]
    return float(np.hypot(place[0] - x, place[1] - y)) - radius - track.radius
