"""Judges drives of fleets: the motion of every robot, every pair at every moment, and the order of visits.

Positions are worked out a second time from the phases of the trace alone. Whether two discs touch between two moments is
decided by halving: two robots that are farther apart at the middle of an interval than their speeds could take them within
its half do not touch in it; other intervals are halved until that is so or they are found touching. The only tolerance is
1e-6 of the sum of the radii.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lampyris._core.arrays import index_array
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.grid import Grid
from lampyris.model.obstacles import Track
from lampyris.model.plan import Status
from lampyris.referee.fleets.visit_order import order_violation
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

_SLACK = 1e-6
"""Share of a length, speed or sum of radii that rounding may take; and seconds."""
_FEW = 64
"""Robots up to which all pairs are compared."""
_AT_ONCE = 400_000
"""Places that are worked out at once."""

Pairs = NDArray[np.int64]


def check_fleet_trace(trace: FleetTrace) -> Violation | None:
    """The first rule that a trace breaks, or None.

    Rules: ``start``, ``phases`` (each begins where and as fast as the one before ended, at a later time), ``direction``
    (only a robot that stands turns), ``speed``, ``acceleration``, ``wall``, ``contact`` (as many pairs touch as it says;
    with the policy ``order``: none), ``obstacle`` (as many as it says; robots stand then), ``order`` (of the visits of each
    cell, as planned), ``goal``, ``arrival``, ``waits`` (they and the driving add up to the arrival), ``fault`` (a robot that
    failed no longer drives).
    """
    motion = TracePositions(trace)
    found = _check_phases(trace) or _check_limits(trace) or _check_ends(trace)
    if found is not None:
        return found
    walls = wall_contacts(trace)
    if len(walls) != trace.wall_contacts or (len(walls) and trace.settings.policy == "order"):
        who = f"robot {walls[0]}" if walls else "trace"
        return Violation("wall", who, f"{len(walls)} robots touch walls; {trace.wall_contacts} are stated")
    pairs = motion.contacts()
    if len(pairs) != trace.contacts or (pairs and trace.settings.policy == "order"):
        who = "robots {} and {}, {:.3f} s".format(*pairs[0]) if pairs else "trace"
        return Violation("contact", who, f"{len(pairs)} pairs touch; {trace.contacts} are stated")
    met = motion.obstacle_contacts(trace.obstacles)
    driving = [one for one in met if one[3]]
    if (len(met), len(driving)) != (trace.obstacle_contacts, trace.moving_contacts) or driving:
        worst = (driving or met or [(-1, -1, 0.0, False)])[0]
        return Violation(
            "obstacle", f"robot {worst[0]} and obstacle {worst[1]}, {worst[2]:.3f} s",
            f"{len(met)} pairs touch, {len(driving)} robots driving; {trace.obstacle_contacts} are stated",
        )  # fmt: skip
    return order_violation(trace)


def _check_phases(trace: FleetTrace) -> Violation | None:
    who, t, long = trace.robot, trace.t, trace.duration
    if not len(who):
        return None
    slack = _SLACK * (1.0 + trace.duration_s)
    x, y, v = _after(trace)
    scale = _SLACK * (trace.grid.resolution + np.abs(np.concatenate((trace.x, trace.y))).max())
    size = np.sqrt(trace.dx * trace.dx + trace.dy * trace.dy)
    if (np.abs(size - 1.0) > _SLACK).any():
        return _at(trace, int(np.abs(size - 1.0).argmax()), "direction", "is not of length 1")
    if (long <= 0.0).any() or (t < 0.0).any() or (np.diff(who) < 0).any():
        return Violation("phases", "trace", "a phase without a duration, or robots out of order")
    same = who[1:] == who[:-1]
    gap = t[1:] - (t[:-1] + long[:-1])
    early = same & (gap < -slack)
    if early.any():
        return _at(trace, int(early.argmax()) + 1, "phases", "begins before the one before it has ended")
    away = np.maximum(np.abs(trace.x[1:] - x[:-1]), np.abs(trace.y[1:] - y[:-1]))
    if (same & (away > scale)).any():
        return _at(
            trace, int((same & (away > scale)).argmax()) + 1, "phases", "begins where the last did not end"
        )
    first = np.concatenate(([True], ~same))
    starts = trace.grid.to_metres(trace.starts)[who[first]]
    off = np.maximum(np.abs(trace.x[first] - starts[:, 0]), np.abs(trace.y[first] - starts[:, 1]))
    if (off > scale).any():
        k = int(who[first][off.argmax()])
        return Violation("start", f"robot {k}", "does not begin at its start")
    if trace.settings.policy != "order":
        return None
    quick = _SLACK * (1.0 + max(one.v_max for one in trace.robots))
    # A speed that rounding left over at a vertex: v^2 = 2 d times 1e-9 m.
    still = np.sqrt(2.0 * max(one.d_max for one in trace.robots) * scale) + quick
    rests = gap > slack
    jump = np.where(rests, np.maximum(v[:-1], trace.v[1:]) > still, np.abs(trace.v[1:] - v[:-1]) > still)
    turns = (np.abs(trace.dx[1:] - trace.dx[:-1]) + np.abs(trace.dy[1:] - trace.dy[:-1])) > _SLACK
    if (same & jump).any():
        return _at(
            trace,
            int((same & jump).argmax()) + 1,
            "phases",
            "begins with another speed than the last ended with",
        )
    if (first[1:] & (trace.v[1:] > still)).any() or trace.v[0] > still:
        return Violation("phases", "trace", "a robot begins with a speed")
    fast = same & turns & (np.maximum(v[:-1], trace.v[1:]) > still)
    return _at(trace, int(fast.argmax()) + 1, "direction", "changes while driving") if fast.any() else None


def _after(trace: FleetTrace) -> tuple[Floats, Floats, Floats]:
    """Place and speed at the end of each phase."""
    far = trace.duration * (trace.v + 0.5 * trace.a * trace.duration)
    return trace.x + far * trace.dx, trace.y + far * trace.dy, trace.v + trace.a * trace.duration


def _at(trace: FleetTrace, row: int, rule: str, sentence: str) -> Violation:
    return Violation(rule, f"robot {trace.robot[row]}, {trace.t[row]:.6f} s", f"the phase {sentence}")


def _check_limits(trace: FleetTrace) -> Violation | None:
    top, rise, fall = (
        np.array([getattr(one, name) for one in trace.robots])[trace.robot]
        for name in ("v_max", "a_max", "d_max")
    )
    end = trace.v + trace.a * trace.duration
    slow = np.minimum(trace.v, end) < -1e-4 * top
    fast = (np.maximum(trace.v, end) > top * (1 + _SLACK)) | slow
    if fast.any():
        row = int(fast.argmax())
        return _at(
            trace, row, "speed", f"drives at {max(trace.v[row], end[row]):.9g} m/s, allowed {top[row]:g}"
        )
    # Rounding may leave a few nanometres to brake in: what counts is the speed that is won or lost beyond the limit.
    beyond = np.maximum(trace.a - rise, -fall - trace.a) * trace.duration
    harsh = beyond > _SLACK * top
    if harsh.any() and trace.settings.policy == "order":
        row = int(harsh.argmax())
        return _at(
            trace,
            row,
            "acceleration",
            f"has {trace.a[row]:.9g} m/s2, allowed -{fall[row]:g} to {rise[row]:g}",
        )
    return None


def _check_ends(trace: FleetTrace) -> Violation | None:
    n = len(trace.robots)
    x, y, _ = _after(trace)
    places = trace.grid.to_metres(trace.starts.astype(np.float64))
    places[trace.robot] = np.stack((x, y), axis=1)
    ends = np.zeros(n)
    ends[trace.robot] = trace.t + trace.duration
    goals = trace.grid.to_metres(trace.goals)
    near = 0.5 * trace.grid.resolution if trace.settings.policy == "orca" else 1e-5 * trace.grid.resolution
    gap = places - goals
    off = np.sqrt((gap * gap).sum(axis=1)) > near * (1 + _SLACK)
    there = ~np.isnan(trace.arrivals)
    if (off & there).any():
        return Violation("goal", f"robot {int((off & there).argmax())}", "arrived, but is not at its goal")
    failed = [k for k, _ in trace.faults]
    others = np.ones(n, dtype=np.bool_)
    others[failed] = False
    if (trace.status is Status.FOUND) != bool(there[others].all()):
        return Violation(
            "arrival", "trace", f"{trace.status.value}, but {int(there.sum())} of {n} robots arrived"
        )
    for k, when in trace.faults:
        own = trace.robots[k]
        rows = trace.robot == k
        last = float((trace.t + trace.duration)[rows].max(initial=0.0))
        most = when + own.v_max / own.d_max
        if trace.rotations:
            # A robot in a ring completes its move, at the pace of the slowest.
            slow = (min(getattr(one, name) for one in trace.robots) for name in ("v_max", "a_max", "d_max"))
            v, rise, fall = slow
            most += 1.5 * trace.grid.resolution / v + v / rise + v / fall
        if last > most + _SLACK * (1.0 + most):
            return Violation("fault", f"robot {k}", f"failed at {when:g} s, but drives until {last:g} s")
    if trace.settings.policy != "order":
        return None
    late = there & (np.abs(np.where(there, trace.arrivals, 0.0) - ends) > _SLACK * (1 + ends))
    late &= trace.driving > 0.0
    if late.any():
        k = int(late.argmax())
        return Violation(
            "arrival", f"robot {k}", f"at {trace.arrivals[k]:.6f} s; its last phase ends at {ends[k]:.6f} s"
        )
    total = trace.driving + trace.waits.sum(axis=1)
    wrong = there & (np.abs(np.where(there, trace.arrivals, total) - total) > 1e-6 * (1 + total))
    if wrong.any():
        k = int(wrong.argmax())
        return Violation(
            "waits", f"robot {k}", f"drives and stands {total[k]:.6f} s until {trace.arrivals[k]:.6f} s"
        )
    return None


def wall_contacts(trace: FleetTrace) -> list[int]:
    """The robots that touch a wall or the edge of the map, rising."""
    grid, size = trace.grid, trace.grid.resolution
    x1, y1, _ = _after(trace)
    n = len(trace.robots)
    still = grid.to_metres(trace.starts)
    who = np.concatenate((trace.robot, np.arange(n)))
    begin = np.concatenate((np.stack((trace.x, trace.y), axis=1), still))
    end = np.concatenate((np.stack((x1, y1), axis=1), still))
    a, b = (grid.to_points(one[:, 0], one[:, 1]) + 0.5 for one in (begin, end))
    radius = np.array([one.radius for one in trace.robots])[who] / size * (1.0 - _SLACK)
    low, high = np.minimum(a, b) - radius[:, None], np.maximum(a, b) + radius[:, None]
    slack = 1e-9 * (grid.width + grid.height)
    hit = (low < -slack).any(axis=1) | (high[:, 0] > grid.width + slack) | (high[:, 1] > grid.height + slack)
    corner = np.floor(low).astype(np.int64)
    span = (np.floor(high).astype(np.int64) - corner).max(axis=0, initial=0)
    for v in range(int(span[1]) + 1):
        for u in range(int(span[0]) + 1):
            column = np.clip(corner[:, 0] + u, 0, grid.width - 1)
            row = np.clip(corner[:, 1] + v, 0, grid.height - 1)
            rows = np.flatnonzero(grid.blocked[row, column] & ~hit)
            if len(rows):
                box = np.stack((column[rows], row[rows]), axis=1).astype(np.float64)
                hit[rows] |= _gap_to_box(a[rows], b[rows], box) < radius[rows]
    return sorted(set(who[hit].tolist()))


def _gap_to_box(a: Floats, b: Floats, box: Floats) -> Floats:
    """Distance between segments and squares of side 1, whose upper left corners are given."""
    least = np.full(len(a), np.inf)
    for end in (a, b):
        out = end - np.clip(end, box, box + 1.0)
        least = np.minimum(least, np.sqrt((out * out).sum(axis=1)))
    d = b - a
    square = np.maximum((d * d).sum(axis=1), 1e-300)
    for corner in ((0, 0), (1, 0), (0, 1), (1, 1)):
        gap = box + corner - a
        share = np.clip((gap * d).sum(axis=1) / square, 0.0, 1.0)
        gap -= share[:, None] * d
        least = np.minimum(least, np.sqrt((gap * gap).sum(axis=1)))
    # A segment through the square: the part of it between the four lines.
    with np.errstate(divide="ignore", invalid="ignore"):
        near, far = (box - a) / d, (box + 1.0 - a) / d
    inside = (a >= box) & (a <= box + 1.0)
    near, far = (
        np.where(d == 0.0, np.where(inside, other, -other), one)
        for one, other in ((np.minimum(near, far), -np.inf), (np.maximum(near, far), np.inf))
    )
    least[(np.maximum(near.max(axis=1), 0.0) < np.minimum(far.min(axis=1), 1.0))] = 0.0
    return least


class TracePositions:
    """Where the robots of a trace are at any moment."""

    def __init__(self, trace: FleetTrace) -> None:
        self._trace = trace
        self._starts = trace.grid.to_metres(trace.starts.astype(np.float64))
        self._end = trace.duration_s
        self._span = self._end + 1.0
        self._key = trace.robot * self._span + trace.t
        self._radius = np.array([one.radius for one in trace.robots])
        top = np.zeros(len(trace.robots))
        np.maximum.at(top, trace.robot, np.maximum(trace.v, trace.v + trace.a * trace.duration))
        self._top = top * (1.0 + _SLACK)

    def places(self, who: Pairs, t: Floats) -> Floats:
        """Metres of the map frame, (k, 2), of robots at moments."""
        tr = self._trace
        made = self._starts[who].copy()
        t = np.minimum(t, self._end)
        if len(tr.robot):
            row = np.searchsorted(self._key, who * self._span + t, side="right") - 1
            on = (row >= 0) & (tr.robot[row] == who)
            row = row[on]
            past = np.clip(t[on] - tr.t[row], 0.0, tr.duration[row])
            far = past * (tr.v[row] + 0.5 * tr.a[row] * past)
            made[on] = np.stack((tr.x[row] + far * tr.dx[row], tr.y[row] + far * tr.dy[row]), axis=1)
        return made

    def speeds(self, who: Pairs, t: Floats) -> Floats:
        """Speeds of robots at moments, m/s."""
        tr = self._trace
        made = np.zeros(len(who))
        t = np.minimum(t, self._end)
        if len(tr.robot):
            row = np.searchsorted(self._key, who * self._span + t, side="right") - 1
            on = (row >= 0) & (tr.robot[row] == who)
            on[on] = t[on] < (tr.t + tr.duration)[row[on]]
            made[on] = (tr.v[row] + tr.a[row] * (t - tr.t[row]))[on]
        return made

    def contacts(self) -> list[tuple[int, int, float]]:
        """Pairs of robots that touch, each once, with a moment at which they do."""
        n = len(self._radius)
        found: dict[tuple[int, int], float] = {}
        if n < 2:
            return []
        if self._trace.settings.policy == "orca":
            return self._straight_contacts()
        step = 0.5 * self._trace.grid.resolution / max(float(self._top.max()), 1e-9)
        reach = 2.0 * float(self._radius.max()) + float(self._top.max()) * step * (1.0 + _SLACK)
        for middles in self._blocks(step, n):
            who = np.tile(np.arange(n), len(middles))
            places = self.places(who, np.repeat(middles, n)).reshape(len(middles), n, 2)
            i, j, k = _near_pairs(places, reach)
            begin = middles[k] - 0.5 * step
            for a, b, t in self._refined(i, j, begin, begin + step):
                found.setdefault((a, b), t)
        return [(a, b, t) for (a, b), t in sorted(found.items())]

    def _straight_contacts(self) -> list[tuple[int, int, float]]:
        """The same for robots that all drive straight and evenly for ``period`` seconds at a time."""
        n, step = len(self._radius), self._trace.settings.period
        found: dict[tuple[int, int], float] = {}
        reach = 2.0 * float(self._radius.max()) + 2.0 * float(self._top.max()) * step * (1.0 + _SLACK)
        for middles in self._blocks(step, n):
            who, begin = np.tile(np.arange(n), len(middles)), middles - 0.5 * step
            a, b = (
                self.places(who, np.repeat(t, n)).reshape(len(middles), n, 2) for t in (begin, begin + step)
            )
            i, j, k = _near_pairs(a, reach)
            gap, move = a[k, i] - a[k, j], (b[k, i] - b[k, j]) - (a[k, i] - a[k, j])
            square = (move * move).sum(axis=1)
            share = np.clip(-(gap * move).sum(axis=1) / np.maximum(square, 1e-300), 0.0, 1.0)
            gap = gap + share[:, None] * move
            touch = np.sqrt((gap * gap).sum(axis=1)) < (self._radius[i] + self._radius[j]) * (1.0 - _SLACK)
            times = begin[k] + share * step
            for one, other, t in zip(
                i[touch].tolist(), j[touch].tolist(), times[touch].tolist(), strict=True
            ):
                found.setdefault((one, other), t)
        return [(one, other, t) for (one, other), t in sorted(found.items())]

    def _blocks(self, step: float, n: int, *, all_: bool = False) -> Iterator[Floats]:
        """The middles of the intervals in which a robot moves, or of all, so many at once.

        While all stand nothing changes: the first interval and those of the phases are enough for pairs of robots.
        """
        tr = self._trace
        count = max(1, int(np.ceil(self._end / step)))
        each = max(1, _AT_ONCE // n)
        if all_:
            for k in range(0, count, each):
                yield (np.arange(k, min(count, k + each), dtype=np.float64) + 0.5) * step
            return
        first = np.clip(np.floor(tr.t / step) - 1.0, 0.0, count - 1.0).astype(np.int64)
        last = np.clip(np.floor((tr.t + tr.duration) / step) + 1.0, 0.0, count - 1.0).astype(np.int64)
        long = last - first + 1
        within = np.arange(int(long.sum())) - np.repeat(np.cumsum(long) - long, index_array(long))
        chosen = np.unique(
            np.concatenate((np.zeros(1, dtype=np.int64), np.repeat(first, index_array(long)) + within))
        )
        for k in range(0, len(chosen), each):
            yield (chosen[k : k + each].astype(np.float64) + 0.5) * step

    def _refined(self, i: Pairs, j: Pairs, begin: Floats, end: Floats) -> list[tuple[int, int, float]]:
        """The pairs that touch within intervals."""
        found: dict[tuple[int, int], float] = {}
        sum_ = self._radius[i] + self._radius[j]
        speed = self._top[i] + self._top[j]
        while len(i):
            middle, half = 0.5 * (begin + end), 0.5 * (end - begin)
            gap = self.places(i, middle) - self.places(j, middle)
            apart = np.sqrt((gap * gap).sum(axis=1))
            near = sum_ * (1.0 - _SLACK)
            for k in np.flatnonzero(apart < near).tolist():
                found.setdefault((int(i[k]), int(j[k])), float(middle[k]))
            open_ = (apart >= near) & (apart - speed * half < near) & (speed * half > 0.1 * _SLACK * sum_)
            i, j, sum_, speed = (np.repeat(one[open_], 2) for one in (i, j, sum_, speed))
            begin, end, middle = begin[open_], end[open_], middle[open_]
            begin, end = np.stack((begin, middle), 1).ravel(), np.stack((middle, end), 1).ravel()
        return [(a, b, t) for (a, b), t in found.items()]

    def obstacle_contacts(self, tracks: tuple[Track, ...]) -> list[tuple[int, int, float, bool]]:
        """Pairs of a robot and an obstacle that touch, a moment, and whether the robot drove at any such moment."""
        n = len(self._radius)
        found: dict[tuple[int, int], tuple[float, bool]] = {}
        for o, track in enumerate(tracks):
            top = float(self._top.max(initial=0.0)) + track.top_speed
            step = 0.5 * self._trace.grid.resolution / max(top, 1e-9)
            for middles in self._blocks(step, n, all_=True):
                i = np.tile(np.arange(n), len(middles))
                middle = np.repeat(middles, n)
                half = np.full(len(i), 0.5 * step)
                near = (self._radius[i] + track.radius) * (1.0 - _SLACK)
                while len(i):
                    gap = self.places(i, middle) - _track_places(track, self._trace.grid, middle)
                    apart = np.sqrt((gap * gap).sum(axis=1))
                    touch = apart < near
                    drives = self.speeds(i[touch], middle[touch]) > 1e-6
                    for k, t, fast in zip(
                        i[touch].tolist(), middle[touch].tolist(), drives.tolist(), strict=True
                    ):
                        since, before = found.get((k, o), (t, False))
                        found[k, o] = since, before or fast
                    open_ = ~touch & (apart - top * half < near) & (top * half > 0.1 * _SLACK * near)
                    i, near, half = (np.repeat(one[open_], 2) for one in (i, near, half))
                    half = 0.5 * half
                    middle = np.repeat(middle[open_], 2)
                    middle = middle + half * np.tile([-1.0, 1.0], len(middle) // 2)
        return [(k, o, t, drove) for (k, o), (t, drove) in sorted(found.items())]


def _track_places(track: Track, grid: Grid, t: Floats) -> Floats:
    cells = np.stack([np.interp(t, track.t, track.xy[:, c]) for c in range(2)], axis=1)
    return grid.to_metres(cells)


def _near_pairs(places: Floats, reach: float) -> tuple[Pairs, Pairs, Pairs]:
    """Pairs i < j of robots that are near each other, and the number of the moment."""
    moments, n = places.shape[:2]
    if n <= _FEW:
        i, j = np.triu_indices(n, 1)
        gap = places[:, i] - places[:, j]
        k, pair = np.nonzero((gap * gap).sum(axis=2) < reach * reach)
        return i[pair], j[pair], k
    parts = []
    for moment in range(moments):
        pairs = cKDTree(places[moment]).query_pairs(reach, output_type="ndarray").astype(np.int64)
        parts.append(np.concatenate((pairs, np.full((len(pairs), 1), moment)), axis=1))
    made = np.concatenate(parts) if parts else np.zeros((0, 3), dtype=np.int64)
    return made[:, 0], made[:, 1], made[:, 2]
