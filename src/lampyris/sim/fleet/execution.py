"""A plan driven in continuous time, until all robots have arrived, some have failed, or the time is over."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import MEMORY
from lampyris.kernels.fleet_motion import execution as kernels
from lampyris.model.fleet.delays import Delays
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.sim.fleet.visits import Visits, visits_of
from lampyris.typing import Cells, Floats

_MIB = 2**20
_ROOM = 8
"""Bytes of a number of the log."""
_EVENTS = 64
"""Events of each robot, besides one for each vertex, after which time must have passed."""


@dataclass(frozen=True, slots=True, eq=False)
class Hazards:
    """What moves besides the robots.

    Parameters
    ----------
    places : float64 (samples, m, 2), metres of the map frame, from second 0 on.
    period : seconds between two samples, and between two looks of the robots.
    radius, speed : of each obstacle, the greatest.
    known : whether the robots know their tracks.
    """

    places: Floats
    period: float
    radius: float
    speed: float
    known: bool


@dataclass(slots=True, eq=False)
class Stage:
    """What came of driving one plan.

    Parameters
    ----------
    log : float64 (phases, 7): robot, visit behind it, beginning, duration, metres along its path, speed, acceleration.
    visits : of the plan.
    reached : int64 (n,): the last visit of each robot that it has come to.
    between : bool (n,): whether each stands between two cells at the end.
    arrivals : float64 (n,), seconds; NaN: not at the end of its path.
    waits : float64 (n, 6), seconds by cause of the kernel.
    end : seconds, when nothing more happens.
    limited, stalled : whether the drive was cut off, and whether that was because time made no progress.
    failed : how many of the faults fell into this drive.
    delayed, rings : how many moves were delayed and rings driven.
    """

    log: Floats
    visits: Visits
    reached: NDArray[np.int64]
    between: NDArray[np.bool_]
    arrivals: Floats
    waits: Floats
    end: float
    limited: bool
    stalled: bool
    failed: int
    delayed: int
    rings: int

    def cells_under(self, robot: int) -> Cells:
        """The cell on which a robot stands at the end, or the two between which it stands: int32 (1 or 2, 2)."""
        row = self.visits.base[robot] + self.reached[robot]
        return self.visits.cells[row : row + 1 + int(self.between[robot])]


def drive_plan(
    grid: Grid,
    paths: Sequence[Cells],
    robots: Sequence[Robot],
    delays: Delays,
    rng: np.random.Generator,
    *,
    hazards: Hazards | None = None,
    begin: float = 0.0,
    limit: float = math.inf,
    faults: Sequence[tuple[int, float]] = (),
) -> Stage:
    """Drive a plan from rest at the first cells of its paths.

    Parameters
    ----------
    grid, paths, robots : discs that fit into a cell; the paths by ticks have no conflicts.
    delays, rng : random delays, and their generator.
    hazards : moving obstacles.
    begin, limit : seconds at which the drive begins, and at which it is cut off.
    faults : robots and seconds, rising, at which they stop permanently. With the first one all others stop at the first cell that
        they can, and the drive ends when all stand; faults after that are not part of it.

    Raises
    ------
    LimitError : ``MEMORY``: the log would take more than is allowed.
    """
    visits = visits_of(paths)
    n, rows = len(robots), len(visits.cells)
    vert, link = _vertices(grid, visits, robots)
    held, holds = _draw_delays(visits, vert, delays, rng)
    gfirst = np.zeros(len(visits.rings) + 1, dtype=np.int64)
    gfirst[1:] = np.cumsum([len(one) for one in visits.rings])
    gmember = np.array([visits.robot[row] for one in visits.rings for row in one] or [0], dtype=np.int64)
    greal = _ring_phases(visits, vert, robots, holds)
    real, whole, tree = _states(robots, begin)
    moving = _moving(hazards)
    most = rows + _EVENTS * n
    clock = np.array([begin, (math.floor(begin / moving[2]) + 1) * moving[2], 0.0, float(most)])
    ready = np.zeros(max(1, len(visits.rings)), dtype=np.int64)
    log = np.empty((4 * rows + 4 * n + 16) * kernels.ROW)
    count = np.zeros(1, dtype=np.int64)
    faulty = np.array([*(k for k, _ in faults), -1], dtype=np.int64)
    when = np.array([*(t for _, t in faults), kernels.NEVER])
    while True:
        ending = kernels.run(
            visits.base, vert.ravel(), link.ravel(), real, whole, tree, log, count, gfirst, gmember, greal, ready,
            *moving, when, faulty, min(limit, kernels.NEVER / 2), clock,
        )  # fmt: skip
        if ending != kernels.FULL:
            break
        MEMORY.demand(2 * log.nbytes // _MIB, f"the phases of {n:,} robots", instead="take fewer robots")
        log = np.concatenate((log, np.empty(len(log))))
    state, words = real.reshape(n, kernels.REAL), whole.reshape(n, kernels.WHOLE)
    driven = log[: int(count[0]) * kernels.ROW].reshape(-1, kernels.ROW)
    end = float(clock[0])
    limited = ending in (kernels.LIMIT, kernels.STALLED)
    if limited:
        driven = _cut_off(driven, state, words, end)
    made = _stage(visits, driven, state, words, held, begin, end)
    made.between = state[:, kernels.S] > vert[visits.base[:-1] + made.reached, kernels.ALONG] + kernels.NEAR
    made.limited, made.stalled, made.failed = limited, bool(ending == kernels.STALLED), int(clock[2]) - 1
    return made


def _vertices(grid: Grid, visits: Visits, robots: Sequence[Robot]) -> tuple[Floats, NDArray[np.int32]]:
    """The rows of the kernel's tables ``vert`` and ``link``."""
    rows = len(visits.cells)
    vert = np.zeros((rows, kernels.VERTEX_REAL))
    link = np.zeros((rows, kernels.VERTEX_WHOLE), dtype=np.int32)
    whose, last = visits.robot, visits.last
    step = np.zeros((rows, 2), dtype=np.int64)
    step[:-1] = visits.cells[1:].astype(np.int64) - visits.cells[:-1]
    step[last] = 0
    length = grid.resolution * np.sqrt((step * step).sum(axis=1).astype(np.float64))
    for k in range(len(robots)):
        own = slice(visits.base[k], visits.base[k + 1])
        vert[own, kernels.ALONG][1:] = np.cumsum(length[own][:-1])
    vert[:, kernels.X : kernels.Y + 1] = grid.to_metres(visits.cells)
    came = np.zeros((rows, 2), dtype=np.int64)
    came[1:] = step[:-1]
    first = np.zeros(rows, dtype=np.bool_)
    first[visits.base[:-1]] = True
    came[first] = 0
    bend = (came != step).any(axis=1)
    ring = visits.ring >= 0
    stands = bend | ring | last
    stands[1:] |= ring[:-1]
    turning = bend & ~first & ~last
    vert[:, kernels.TURN] = np.where(turning, _angle(came, step) * _per_radian(robots)[whose], 0.0)
    # The next row at which a robot stands, from behind.
    index = np.where(stands, np.arange(rows), rows)
    following = np.minimum.accumulate(index[::-1])[::-1]
    ahead = np.append(following[1:], rows)
    local = np.arange(rows) - visits.base[whose]
    link[:, kernels.NEXT_STOP] = np.where(last, local, ahead - visits.base[whose])
    for column, values in (
        (kernels.PRED, visits.pred), (kernels.NEED, visits.need), (kernels.PRED_B, visits.pred_b),
        (kernels.NEED_B, visits.need_b), (kernels.GROUP, visits.ring),
    ):  # fmt: skip
        link[:, column] = values
    return vert, link


def _angle(came: NDArray[np.int64], step: NDArray[np.int64]) -> Floats:
    """Angles between steps to neighbouring cells, radians: multiples of an eighth of a turn."""
    dot = (came * step).sum(axis=1)
    cross = came[:, 0] * step[:, 1] - came[:, 1] * step[:, 0]
    eighths = np.where(dot > 0, np.where(cross == 0, 0, 1), np.where(dot == 0, 2, np.where(cross == 0, 4, 3)))
    return eighths * (math.pi / 4.0)


def _per_radian(robots: Sequence[Robot]) -> Floats:
    """Seconds that each robot takes to turn by a radian in place."""
    made = []
    for one in robots:
        rate = one.yaw_rate_max
        if one.drive == "omnidirectional" or (rate is None and one.radius == 0.0):
            made.append(0.0)
        else:
            made.append(1.0 / rate if rate is not None else one.radius / one.v_max)
    return np.array(made)


def _draw_delays(
    visits: Visits, vert: Floats, delays: Delays, rng: np.random.Generator
) -> tuple[NDArray[np.int64], Floats]:
    """Draw the delays: the rows that have one, and how long each ring is held before it begins."""
    rows = len(visits.cells)
    chance, share, where = rng.random(rows), rng.random(rows), rng.random(rows)
    hit = (chance < delays.probability) & ~visits.last & (share > 0.0)
    duration = np.where(hit, 2.0 * delays.duration * share, 0.0)
    hit &= duration > 0.0
    holds = np.array([max(duration[list(one)]) for one in visits.rings] or [0.0])
    alone = visits.ring < 0
    length = np.zeros(rows)
    length[:-1] = np.diff(vert[:, kernels.ALONG])
    vert[:, kernels.DELAY] = np.where(alone, duration, 0.0)
    vert[:, kernels.PLACE] = vert[:, kernels.ALONG] + np.where(hit, where * length, 0.0)
    return np.flatnonzero(hit), holds


def _ring_phases(visits: Visits, vert: Floats, robots: Sequence[Robot], holds: Floats) -> Floats:
    """The common motion of the robots of each ring, in moves: the least of what they can."""
    made = np.zeros((max(1, len(visits.rings)), kernels.GROUP_REAL))
    whose = visits.robot
    for g, members in enumerate(visits.rings):
        size = [vert[row + 1, kernels.ALONG] - vert[row, kernels.ALONG] for row in members]
        own = [robots[whose[row]] for row in members]
        rise, fall, top = (
            min(getattr(one, name) / long for one, long in zip(own, size, strict=True))
            for name in ("a_max", "d_max", "v_max")
        )
        peak = min(top, math.sqrt(2.0 * rise * fall / (rise + fall)))
        cruise = max(0.0, (1.0 - peak * peak / (2.0 * rise) - peak * peak / (2.0 * fall)) / peak)
        if peak < top:
            cruise = 0.0
        made[g] = rise, fall, peak / rise, cruise, peak / fall, holds[g]
    return made.ravel()


def _states(robots: Sequence[Robot], begin: float) -> tuple[Floats, NDArray[np.int32], Floats]:
    n = len(robots)
    real = np.zeros((n, kernels.REAL))
    for column, name in (
        (kernels.V_MAX, "v_max"), (kernels.A_MAX, "a_max"), (kernels.D_MAX, "d_max"), (kernels.RADIUS, "radius"),
    ):  # fmt: skip
        real[:, column] = [getattr(one, name) for one in robots]
    real[:, kernels.SINCE] = begin
    whole = np.zeros((n, kernels.WHOLE), dtype=np.int32)
    for column in (kernels.HEAD, kernels.NEXT, kernels.ON, kernels.FIRED):
        whole[:, column] = -1
    half = 1
    while half < n:
        half *= 2
    return real.ravel(), whole.ravel(), np.full(2 * half, kernels.NEVER)


def _moving(hazards: Hazards | None) -> tuple[Floats, int, float, float, float, int]:
    """Obstacles as the kernel takes them: places, how many, period, top speed, radius, whether tracks are known."""
    if hazards is None or not hazards.places.shape[1]:
        return np.zeros(2), 0, 1.0, 0.0, 0.0, 0
    places = np.ascontiguousarray(hazards.places).ravel()
    return places, hazards.places.shape[1], hazards.period, hazards.speed, hazards.radius, int(hazards.known)


def _cut_off(driven: Floats, state: Floats, words: NDArray[np.int32], end: float) -> Floats:
    """The log with the phases that were under way when the time was over."""
    rows = []
    for k in np.flatnonzero(
        (words[:, kernels.MODE] == kernels.MOVE) | (words[:, kernels.MODE] == kernels.RING)
    ):
        s, v, a, t = (state[k, c] for c in (kernels.S, kernels.V, kernels.A, kernels.T0))
        if end > t:
            rows.append([k, words[k, kernels.AT], t, end - t, s, v, a])
            state[k, kernels.S] = s + (end - t) * (v + 0.5 * a * (end - t))
    return np.concatenate((driven, np.array(rows).reshape(-1, kernels.ROW)))


def _stage(
    visits: Visits, driven: Floats, state: Floats, words: NDArray[np.int32], held: NDArray[np.int64],
    begin: float, end: float,
) -> Stage:  # fmt: skip
    n = len(words)
    reached = words[:, kernels.AT].astype(np.int64)
    home = reached == np.diff(visits.base) - 1
    arrivals = np.full(n, begin)
    np.maximum.at(arrivals, driven[:, 0].astype(np.int64), driven[:, 2] + driven[:, 3])
    arrivals[~home] = np.nan
    waits = state[:, kernels.WAITS : kernels.WAITS + kernels.CAUSES].copy()
    resting = np.flatnonzero((words[:, kernels.MODE] == kernels.REST) & ~home)
    waits[resting, words[resting, kernels.CAUSE]] += end - state[resting, kernels.SINCE]
    whose, local = visits.robot, np.arange(len(visits.cells)) - visits.base[visits.robot]
    passed = reached[whose] > local
    rings = sum(int(passed[one[0]]) for one in visits.rings)
    delayed = int(np.count_nonzero(passed[held]))
    between = np.zeros(n, dtype=np.bool_)
    return Stage(driven, visits, reached, between, arrivals, waits, end, False, False, 0, delayed, rings)
