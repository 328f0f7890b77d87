"""Walks on the lattice: what obstacles take of it, all that can be reached, and one path there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.errors import InternalFault, LimitError
from lampyris.kernels.motion.collision_time import taken
from lampyris.kernels.motion.path_time import prune, spread, walk_on
from lampyris.motion.timing.obstacle_tracks import CappedPath, Discs
from lampyris.motion.timing.spacetime_lattice import MAX_WORDS, Lattice
from lampyris.typing import Floats

_BLOCK = 16
"""Edges of a path that are ruled out by distance together."""

_SHARE = 0.15
"""Parts of a step are so short that robot and obstacle come nearer by at most this share of their reach."""


_AHEAD = 2.0
"""Seconds that a speed should be able to be held."""


class Blocked(Exception):
    """No walk arrives: which track, how far it gets (metres) and when (seconds)."""

    def __init__(self, who: int, s: float, t: float) -> None:
        super().__init__(who, s, t)
        self.who, self.s, self.t = who, s, t


class Walk(NamedTuple):
    """Place and speed at each step, in units; int64 (k + 1,)."""

    place: NDArray[np.int64]
    speed: NDArray[np.int64]


class Spans(NamedTuple):
    """What is taken of the lattice, by part of a step.

    Parameters
    ----------
    first : int64: spans of part i of step k are ``first[k parts + i]`` up to the next one's first.
    low, high : float64, units of length.
    who : int64: which disc.
    """

    first: NDArray[np.int64]
    low: Floats
    high: Floats
    who: NDArray[np.int64]


def walk(path: CappedPath, lattice: Lattice, discs: Discs, t: float, horizon: float | None) -> Walk:
    """The walk with fewest steps that meets nobody, from time ``t`` on.

    Raises
    ------
    Blocked : there is none before the horizon.
    LimitError : ``PATH_TIME``: it would take more than 256 MB to know.
    """
    levels, words = lattice.levels, lattice.words
    parts = parts_of(lattice, discs)
    if horizon is None:
        ends = float(discs.t.max()) - t
        most = math.ceil(max(ends, 0.0) / lattice.dt) + 2 * lattice.fewest + 16
    else:
        most = math.floor((horizon - t) / lattice.dt * (1.0 + 1e-12))
    begin, end, row = 0, 0, levels * words
    spans = Spans(np.zeros(1, dtype=np.int64), np.zeros(0), np.zeros(0), np.zeros(0, dtype=np.int64))
    reach = np.zeros(row, dtype=np.uint64)
    low, high = np.full(levels, words, dtype=np.int64), np.full(levels, -1, dtype=np.int64)
    reach[lattice.speed * words] = 1
    low[lattice.speed] = high[lattice.speed] = 0
    work = np.zeros(words, dtype=np.uint64)
    while True:
        begin, end = end, min(most, max(2 * end, lattice.fewest + lattice.fewest // 4 + 8))
        if end <= begin:
            raise _stuck(lattice, discs, spans, reach, low, high, max(begin - 1, 0), parts, t)
        if (end + 1) * row > MAX_WORDS:
            raise LimitError(
                "PATH_TIME",
                f"{end} steps of {lattice.dt:g} s with {levels} speeds on {lattice.places[-1]} places",
                where="tracks",
                allowed=f"{MAX_WORDS} words of 64 states",
                todo="drive a shorter part of the path, give a shorter horizon or a longer step",
            )
        spans = _longer(spans, spans_of(path, lattice, discs, t, begin, end, parts))
        reach = np.concatenate((reach, np.zeros((end - begin) * row, dtype=np.uint64)))
        low = np.concatenate((low, np.full((end - begin) * levels, words)))
        high = np.concatenate((high, np.full((end - begin) * levels, -1)))
        flat = (
            levels,
            lattice.rise,
            lattice.fall,
            lattice.speed,
            words,
            parts,
            spans.first,
            spans.low,
            spans.high,
        )
        done = spread(reach, low, high, work, begin, end, lattice.ok, lattice.goal, *flat)
        if done < -1:
            raise _stuck(lattice, discs, spans, reach, low, high, -2 - done, parts, t)
        if done >= 0:
            rest = (lattice.ok, lattice.goal, *flat)
            prune(reach, low, high, work, np.zeros(words, dtype=np.uint64), done, *rest)
            place, speed = np.zeros(done + 1, dtype=np.int64), np.zeros(done + 1, dtype=np.int64)
            ahead = max(1, math.ceil(_AHEAD / lattice.dt))
            lost = walk_on(reach, done, ahead, *rest, place, speed)
            if lost:
                raise InternalFault("PATH_TIME", f"no state is left after step {lost} of {done}")
            return Walk(place, speed)


def parts_of(lattice: Lattice, discs: Discs) -> int:
    """Parts of a step: 4 to 64, so that little is lost by taking each as a whole."""
    fast = float(lattice.unit.max()) * (lattice.levels - 1)
    near = discs.reach[discs.reach > 0.0]
    nearing = fast + float(discs.top.max())
    wanted = lattice.dt * nearing / (_SHARE * float(near.min()))
    return int(min(max(4, math.ceil(wanted)), 64))


def spans_of(
    path: CappedPath, lattice: Lattice, discs: Discs, t: float, begin: int, end: int, parts: int
) -> Spans:
    """What discs take of the lattice in the steps from ``begin`` to before ``end``; step 0 is at time ``t``.

    In each part of a step a disc takes all that it sweeps in it.
    """
    part = lattice.dt / parts
    grid = t + part * np.arange(begin * parts, end * parts + 1)
    rows: list[list[Floats]] = [[], [], [], [], []]
    number: list[NDArray[np.int64]] = []
    whose: list[NDArray[np.int64]] = []
    for m in range(len(discs)):
        a, b = int(discs.begin[m]), int(discs.begin[m + 1])
        times, x, y = discs.t[a:b], discs.x[a:b], discs.y[a:b]
        if discs.reach[m] <= 0.0 or times[0] >= grid[-1]:
            continue
        moments = np.union1d(grid, times[(times > grid[0]) & (times < grid[-1])])
        moments = moments[moments >= times[0]]
        if len(moments) < 2:
            continue
        px, py = elementary.interp(moments, times, x), elementary.interp(moments, times, y)
        middle = 0.5 * (moments[1:] + moments[:-1])
        number.append(np.clip(np.searchsorted(grid, middle, side="right") - 1, 0, len(grid) - 2))
        whose.append(np.full(len(middle), m, dtype=np.int64))
        reach = np.full(len(middle), discs.reach[m])
        for row, values in zip(rows, (px[:-1], py[:-1], px[1:], py[1:], reach), strict=True):
            row.append(values)
    count = (end - begin) * parts
    if not number:
        none = np.zeros(0)
        return Spans(np.zeros(count + 1, dtype=np.int64), none, none, np.zeros(0, dtype=np.int64))
    low, high, piece = _taken(path, [np.concatenate(row) for row in rows])
    of = np.concatenate(number)[piece]
    order = np.argsort(of, kind="stable")
    index = np.searchsorted(of[order], np.arange(count + 1))
    place = lattice.places.astype(np.float64)
    # What begins before the lattice or ends after it goes on there: nothing is to be squeezed in at its ends.
    units = [elementary.interp(v, lattice.legs, place) for v in (low, high)]
    units[0][low <= lattice.legs[0]] = -1.0
    units[1][high >= lattice.legs[-1]] = place[-1] + 1.0
    gone = high <= lattice.legs[0]
    units[1][gone] = -1.0
    return Spans(index, units[0][order], units[1][order], np.concatenate(whose)[piece][order])


def _taken(path: CappedPath, rows: list[Floats]) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Stretches of the path that the pieces take, and the piece of each."""
    edges = len(path.s) - 1
    firsts = np.arange(0, edges, _BLOCK)
    lasts = np.minimum(firsts + _BLOCK, edges)
    cx, cy = 0.5 * (path.x[firsts] + path.x[lasts]), 0.5 * (path.y[firsts] + path.y[lasts])
    # No point of a block is farther from the middle of its chord than its length has in it.
    around = path.s[lasts] - path.s[firsts]
    # Far more room than is needed: the longest array is how a kernel knows its work.
    room = min(len(rows[0]) * (len(firsts) + _BLOCK) + 64, 10**6)
    while True:
        low, high, piece = np.zeros(room), np.zeros(room), np.zeros(room, dtype=np.int64)
        count = taken(path.s, path.x, path.y, cx, cy, around, _BLOCK, *rows, low, high, piece)
        if count <= room:
            return low[:count], high[:count], piece[:count]
        room = count


def _longer(a: Spans, b: Spans) -> Spans:
    """Spans of steps that follow one another as one."""
    index = np.concatenate((a.first, b.first[1:] + a.first[-1]))
    return Spans(index, *(np.concatenate(pair) for pair in zip(a[1:], b[1:], strict=True)))


def _stuck(
    lattice: Lattice,
    discs: Discs,
    spans: Spans,
    reach: NDArray[np.uint64],
    low: NDArray[np.int64],
    high: NDArray[np.int64],
    step: int,
    parts: int,
    t: float,
) -> Blocked:
    """Who is in the way: at the last step that could be reached, the span nearest ahead of the farthest."""
    levels, words = lattice.levels, lattice.words
    farthest = 0
    for j in range(levels):
        row = step * levels + j
        if high[row] >= low[row]:
            word = int(reach[row * words + high[row]])
            n = 64 * int(high[row]) + word.bit_length() - 1
            farthest = max(farthest, 2 * n - j + lattice.speed)
    s = float(lattice.s_of(np.array([farthest]))[0])
    first = spans.first[min(step * parts, len(spans.first) - 1)]
    until = spans.first[min((step + 1) * parts, len(spans.first) - 1)]
    near = slice(int(first), int(until))
    who = -1
    if until > first:
        away = np.where(spans.high[near] >= farthest, np.maximum(spans.low[near] - farthest, 0.0), np.inf)
        who = int(spans.who[near][int(away.argmin())])
    return Blocked(who, s, t + step * lattice.dt)
