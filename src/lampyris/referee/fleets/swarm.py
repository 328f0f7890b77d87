"""Judges swarms of robots: their motion at every moment, and what they measured, heard and chose.

The motion of an iteration is judged from all its small steps (:class:`SwarmMotion`), a trace from what it records
(:func:`check_swarm`). Distances, lines of sight and signals are worked out a second time; nothing is taken from the simulation.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lampyris._core.arrays import index_array
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.model.settings.swarm import SwarmSettings
from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.referee.fleets.swarm_hearing import groups_violation, neighbours_violation
from lampyris.referee.fleets.swarm_signals import signal_at, signal_range
from lampyris.referee.verdict import Violation
from lampyris.typing import Floats

_SLACK = 1e-9
"""Share of a length that rounding may take."""
_AT_ONCE = 2_000_000
"""Places of pairs that are compared at once."""
_DEVIATIONS = 9.0
"""Standard deviations of noise that no measurement exceeds: one in 10^18 would."""


class SwarmMotion:
    """Judges the motion of a swarm, iteration by iteration.

    Robots drive straight within a small step. Rules: ``start`` (an iteration begins where the last one ended), ``speed``,
    ``step`` (no more than the step's length in an iteration), ``turn`` (no quicker than the maximum yaw rate), ``wall`` (no disc
    in a wall or beyond the edge of the map) and ``contact`` (no two discs overlap), each at every moment.

    Parameters
    ----------
    grid : the map.
    settings : resolved for the map.
    """

    def __init__(self, grid: Grid, settings: SwarmSettings) -> None:
        s = settings
        assert s.radius is not None
        assert s.step is not None
        assert s.small_step is not None
        self._grid, self._radius, self._step, self._small = grid, s.radius, s.step, s.small_step
        self._turn = s.small_step / s.v_max * s.yaw_rate_max
        walls = np.argwhere(grid.blocked)[:, ::-1]
        self._corner = walls * grid.resolution
        self._walls = cKDTree((walls + 0.5) * grid.resolution) if len(walls) else None
        self._last: Floats | None = None
        self._heading: Floats | None = None
        self._since: Any = 0
        self._seen = 0

    def see(self, path: Floats) -> Violation | None:
        """The first rule that an iteration breaks, or None.

        Parameters
        ----------
        path : float64 (steps + 1, n, 2), metres of the map frame: at the beginning and after each small step.
        """
        where = f"iteration {self._seen}"
        self._seen += 1
        if self._last is not None and not np.array_equal(path[0], self._last):
            return Violation("start", where, "a robot is not where the last iteration left it")
        self._last = path[-1]
        points = (self._grid.to_points(path[..., 0], path[..., 1]) + 0.5) * self._grid.resolution
        return self._speeds(points, where) or self._walled(points, where) or self._contacts(points, where)

    def _speeds(self, points: Floats, where: str) -> Violation | None:
        moves = np.diff(points, axis=0)
        length = np.sqrt((moves * moves).sum(axis=2))
        slack = _SLACK * (1.0 + np.abs(points).max())
        if (length > self._small + slack).any():
            t, i = _place(length, length.argmax())
            words = f"drives {length[t, i]:.6g} m in a small step of {self._small:.6g} m"
            return Violation("speed", f"{where}, robot {i}", words)
        total = length.sum(axis=0)
        if (total > self._step + len(moves) * slack).any():
            i = int(total.argmax())
            return Violation(
                "step", f"{where}, robot {i}", f"drives {total[i]:.6g} m; the step is {self._step:.6g} m"
            )
        if self._heading is None:
            self._heading = np.full(points.shape[1:], np.nan)
            self._since = np.zeros(points.shape[1])
        for t, move in enumerate(moves):
            self._since = self._since + 1
            # Of a shorter one rounding would decide the direction.
            drives = length[t] > 1e-3 * self._small
            ahead = move[drives] / length[t][drives][:, np.newaxis]
            dot = (ahead * self._heading[drives]).sum(axis=1)
            allowed = np.cos(np.minimum(self._since[drives] * self._turn + 1e-5, math.pi))
            wrong = dot < allowed - 1e-7  # False for the first motion of a robot, whose heading is not known
            if wrong.any():
                i = int(np.flatnonzero(drives)[int(wrong.argmax())])
                return Violation(
                    "turn", f"{where}, small step {t}, robot {i}", "turns more quickly than it can"
                )
            self._heading[drives] = ahead
            self._since[drives] = 0
        return None

    def _walled(self, points: Floats, where: str) -> Violation | None:
        size = self._grid.resolution
        wide, high = self._grid.width * size, self._grid.height * size
        least = self._radius * (1.0 - _SLACK) - _SLACK * size
        edge = np.minimum(points, np.array([wide, high]) - points).min(axis=2)
        if (edge < least).any():
            t, i = _place(edge, edge.argmin())
            words = (
                f"its centre is {edge[t, i]:.6g} m from the edge of the map, its radius {self._radius:.6g} m"
            )
            return Violation("wall", f"{where}, small step {t}, robot {i}", words)
        if self._walls is None:
            return None
        reach = self._radius + self._step + 0.75 * size
        near = self._walls.query_ball_point(points[0], reach)
        count = np.array([len(one) for one in near])
        robot = np.repeat(np.arange(len(near)), index_array(count))
        cell = (
            np.concatenate([np.array(one, dtype=np.int64) for one in near])
            if count.sum()
            else np.zeros(0, int)
        )
        each = max(1, _AT_ONCE // (8 * len(points)))
        for begin in range(0, len(robot), each):
            one, low = robot[begin : begin + each], self._corner[cell[begin : begin + each]]
            at = points[:, one]
            # The least distance of a segment from a square that it does not cross is at one of its ends or a corner.
            off = at - np.clip(at, low, low + size)
            square = (off * off).sum(axis=2)
            nearest = np.minimum(square[:-1], square[1:])
            for corner in ((0, 0), (0, 1), (1, 0), (1, 1)):
                nearest = np.minimum(nearest, _to_segment(at - (low + size * np.array(corner))))
            if (nearest < least * least).any():
                t, k = _place(nearest, nearest.argmin())
                gap = math.sqrt(float(nearest[t, k]))
                words = f"its centre comes within {gap:.6g} m of a wall, its radius is {self._radius:.6g} m"
                return Violation("wall", f"{where}, small step {t}, robot {one[k]}", words)
        return None

    def _contacts(self, points: Floats, where: str) -> Violation | None:
        pairs = cKDTree(points[0]).query_pairs(
            2.0 * (self._radius + self._step) * (1 + 1e-6), output_type="ndarray"
        )
        least = 2.0 * self._radius * (1.0 - _SLACK)
        each = max(1, _AT_ONCE // len(points))
        for begin in range(0, len(pairs), each):
            one, other = pairs[begin : begin + each].T
            nearest = _to_segment(points[:, one] - points[:, other])
            if (nearest < least * least).any():
                t, k = _place(nearest, nearest.argmin())
                gap = math.sqrt(float(nearest[t, k]))
                words = f"their centres come within {gap:.6g} m; two radii are {2 * self._radius:.6g} m"
                return Violation("contact", f"{where}, small step {t}, robots {one[k]} and {other[k]}", words)
        return None


def _place(array: NDArray[Any], flat: Any) -> tuple[int, int]:
    """Row and column of an element that is counted row by row."""
    row, column = divmod(int(flat), array.shape[1])
    return row, column


def _to_segment(ends: Floats) -> Floats:
    """Squared distance of the origin from the segments between successive points (steps + 1, m, 2); (steps, m)."""
    a, d = ends[:-1], np.diff(ends, axis=0)
    square = (d * d).sum(axis=2)
    share = np.clip(-(a * d).sum(axis=2) / np.where(square > 0.0, square, 1.0), 0.0, 1.0)
    nearest = a + share[..., np.newaxis] * d
    out: Floats = (nearest * nearest).sum(axis=2)
    return out


def check_swarm(trace: SwarmTrace, *, every: bool = False) -> Violation | None:
    """The first rule that a trace breaks, or None.

    Rules: ``settings`` (defaults resolved), ``finite``, ``sources`` (where their peaks are), ``contact``, ``wall`` and ``step``
    (between iterations), ``reading`` (the signal, and no more noise than there may be; of ``gradient``, the mean of four sensors
    on the rim, within the bounds of the signal on the disc), ``luciferin``, ``range``, ``neighbours`` and ``leader`` (of some
    robots in some iterations), ``group`` (made again in some iterations), ``held`` and ``status`` (counted again),
    ``encounters`` (no more than robots and iterations allow).

    Parameters
    ----------
    trace : judged.
    every : whether neighbours of all robots, and groups, are worked out again in all iterations.
    """
    if trace.settings != trace.settings.on(trace.grid):
        return Violation("settings", "trace", "a default is not resolved")
    for name in ("xy", "source_xy", "readings", "luciferin", "ranges"):
        if not np.isfinite(getattr(trace, name)).all():
            return Violation("finite", name, "not every value is finite")
    return (
        _check_sources(trace)
        or _check_places(trace)
        or _check_glow(trace)
        or _check_followers(trace)
        or neighbours_violation(trace, every)
        or groups_violation(trace, every)
        or _check_held(trace)
        or _check_encounters(trace)
    )


def _check_sources(trace: SwarmTrace) -> Violation | None:
    for t in range(trace.iterations + 1):
        places = [p for one in trace.sources for p in one.places(t * trace.settings.period)]
        if len(places) != trace.source_xy.shape[1] or not np.allclose(
            np.array(places).reshape(-1, 2), trace.source_xy[t], rtol=1e-9, atol=1e-9
        ):
            return Violation(
                "sources", f"iteration {t}", f"peaks at {trace.source_xy[t].tolist()}, not {places}"
            )
    return None


def _check_places(trace: SwarmTrace) -> Violation | None:
    """Discs apart and in the open at the recorded moments, and steps of a possible length."""
    s = trace.settings
    assert s.radius is not None
    assert s.step is not None
    judge = SwarmMotion(trace.grid, s)
    for t in range(trace.iterations + 1):
        points = (trace.grid.to_points(trace.xy[t, :, 0], trace.xy[t, :, 1]) + 0.5) * trace.grid.resolution
        still = np.stack((points, points))
        found = judge._walled(still, f"after iteration {t}") or judge._contacts(still, f"after iteration {t}")
        if found is not None:
            return found
    gap = np.diff(trace.xy, axis=0)
    length = np.sqrt((gap * gap).sum(axis=2))
    if length.size and length.max() > s.step + _SLACK * (1.0 + np.abs(trace.xy).max()):
        t, i = _place(length, length.argmax())
        return Violation(
            "step", f"iteration {t}, robot {i}", f"goes {length[t, i]:.6g} m; the step is {s.step:.6g} m"
        )
    return None


def _check_glow(trace: SwarmTrace) -> Violation | None:
    """Measurements, luciferin and decision ranges, all of them."""
    s = trace.settings
    assert s.sensor_range is not None
    assert s.beta is not None
    if (trace.luciferin[0] != s.luciferin).any() or (trace.ranges[0] != s.sensor_range).any():
        return Violation("luciferin", "at first", "luciferin or range is not that of the settings")
    if s.method != "gso":
        if (trace.luciferin != s.luciferin).any() or (trace.ranges != s.sensor_range).any():
            return Violation("luciferin", "trace", f"{s.method} changes luciferin or ranges")
        return _check_rims(trace)
    deviation = s.noise * max(one.highest for one in trace.sources)
    for t in range(trace.iterations):
        true = signal_at(trace.sources, trace.xy[t, :, 0], trace.xy[t, :, 1], t * s.period)
        wrong = np.abs(trace.readings[t] - true) > _DEVIATIONS * deviation + 1e-8 * (1.0 + np.abs(true))
        if wrong.any():
            i = int(wrong.argmax())
            words = f"measured {trace.readings[t, i]:.6g}; the signal is {true[i]:.6g}"
            return Violation("reading", f"iteration {t}, robot {i}", words)
    glow = (1 - s.rho) * trace.luciferin[:-1] + s.gamma * trace.readings
    wide = np.clip(trace.ranges[:-1] + s.beta * (s.nt - trace.neighbours), 0, s.sensor_range)
    for rule, made, recorded in (("luciferin", glow, trace.luciferin[1:]), ("range", wide, trace.ranges[1:])):
        wrong = np.abs(made - recorded) > 1e-9 * (1.0 + np.abs(made))
        if wrong.any():
            t, i = _place(wrong, wrong.argmax())
            words = f"{rule} {recorded[t, i]:.9g}; by its rule {made[t, i]:.9g}"
            return Violation(rule, f"iteration {t}, robot {i}", words)
    return None


def _check_rims(trace: SwarmTrace) -> Violation | None:
    """Measurements of robots that measure at four points of their rims and record the mean."""
    s = trace.settings
    assert s.radius is not None
    give = 0.5 * _DEVIATIONS * s.noise * max(one.highest for one in trace.sources)
    for t in range(trace.iterations):
        x, y, read = trace.xy[t, :, 0], trace.xy[t, :, 1], trace.readings[t]
        low, high = signal_range(trace.sources, x, y, t * s.period, s.radius)
        slack = give + 1e-8 * (1.0 + np.abs(high) + np.abs(low))
        wrong = (read < low - slack) | (read > high + slack)
        if wrong.any():
            i = int(wrong.argmax())
            words = f"measured {read[i]:.6g}; on its disc the signal is {low[i]:.6g} to {high[i]:.6g}"
            return Violation("reading", f"iteration {t}, robot {i}", words)
    return None


def _check_encounters(trace: SwarmTrace) -> Violation | None:
    most = trace.robots * trace.iterations
    for name in ("encounters", "wall_encounters"):
        if not 0 <= getattr(trace, name) <= most:
            words = f"{getattr(trace, name)}; at most one a robot and iteration, {most}"
            return Violation("encounters", name, words)
    if trace.robots == 1 and trace.encounters:
        return Violation("encounters", "encounters", f"{trace.encounters} of one robot")
    return None


def _check_followers(trace: SwarmTrace) -> Violation | None:
    """A robot with neighbours has a leader, brighter and of its own group; one without has none and stands."""
    n = trace.robots
    if (
        (trace.leaders < -1).any()
        or (trace.leaders >= n).any()
        or (trace.groups < 0).any()
        or (trace.groups >= n).any()
    ):
        return Violation("leader", "trace", "there is no such robot")
    follows = trace.leaders >= 0
    if (follows != (trace.neighbours > 0)).any():
        t, i = np.argwhere(follows != (trace.neighbours > 0))[0]
        words = f"{trace.neighbours[t, i]} neighbours and leader {trace.leaders[t, i]}"
        return Violation("leader", f"iteration {t}, robot {i}", words)
    t, i = np.nonzero(follows)
    j = trace.leaders[t, i]
    darker = trace.luciferin[t + 1, j] <= trace.luciferin[t + 1, i]
    if darker.any():
        k = int(darker.argmax())
        return Violation("leader", f"iteration {t[k]}, robot {i[k]}", f"robot {j[k]} is not brighter")
    apart = trace.groups[t, i] != trace.groups[t, j]
    if apart.any():
        k = int(apart.argmax())
        return Violation(
            "group", f"iteration {t[k]}, robot {i[k]}", f"is not in the group of its leader {j[k]}"
        )
    if trace.groups.size and (
        (trace.groups > np.arange(n)).any()
        or (np.take_along_axis(trace.groups, trace.groups.astype(np.int64), axis=1) != trace.groups).any()
    ):
        return Violation("group", "trace", "a group is not called by its least robot")
    if trace.settings.method == "gso":
        rests = (trace.xy[1:] == trace.xy[:-1]).all(axis=2)
        if (~rests & ~follows).any():
            t0, i0 = np.argwhere(~rests & ~follows)[0]
            return Violation("leader", f"iteration {t0}, robot {i0}", "moves without a leader")
    return None


def _check_held(trace: SwarmTrace) -> Violation | None:
    """Robots near each source, counted again, and what the status says of them."""
    s = trace.settings
    assert s.capture_radius is not None
    for t in range(trace.iterations + 1):
        gap = np.hypot(
            trace.xy[t, :, 0, np.newaxis] - trace.source_xy[t, :, 0],
            trace.xy[t, :, 1, np.newaxis] - trace.source_xy[t, :, 1],
        )
        bounds = []
        for slack in (-_SLACK, _SLACK):
            near = gap < s.capture_radius * (1 + slack)
            first = gap <= gap.min(axis=1, keepdims=True) * (1 + max(slack, 0.0))
            first &= np.cumsum(first, axis=1) == 1 if slack < 0 else True
            bounds.append((near & first).sum(axis=0))
        if (trace.held[t] < bounds[0]).any() and bounds[0].sum() == bounds[1].sum():
            return Violation(
                "held", f"iteration {t}", f"held {trace.held[t].tolist()}; counted {bounds[0].tolist()}"
            )
        if (trace.held[t] > bounds[1]).any():
            return Violation(
                "held", f"iteration {t}", f"held {trace.held[t].tolist()}; counted {bounds[1].tolist()}"
            )
    every = bool((trace.held[-1] >= s.capture_robots).all())
    wrong = (
        trace.status not in (Status.FOUND, Status.ITERATION_LIMIT, Status.LIMIT, Status.CANCELLED)
        or (trace.status is Status.FOUND and not every)
        or (trace.status is Status.ITERATION_LIMIT and (every or trace.iterations != s.iterations))
    )
    if wrong:
        return Violation(
            "status",
            "trace",
            f"{trace.status} after {trace.iterations} iterations, held {trace.held[-1].tolist()}",
        )
    return None
