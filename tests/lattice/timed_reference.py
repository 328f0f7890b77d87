"""Earliest arrivals on a small map by a search over everything: all states, all times at which they are free, no heuristic.

Written from the definition in docs/poses.md, apart from the planners; the lattice's motions, sweeps and covering discs are
taken from it, for they are what the arrivals are the earliest of.
"""

from __future__ import annotations

import heapq
import math
from typing import Any

import numpy as np

from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.timed.discs import motion_discs

Span = tuple[float, float]
LATE = 1e9


def ticks_of(track: list[tuple[int, int]], wide: float) -> np.ndarray:
    """One row a tick of an obstacle's track: x, y, step x, step y, begin, end, radius; the last one stands."""
    rows = []
    for tick, (x, y) in enumerate(track):
        last = tick == len(track) - 1
        to = (x, y) if last else track[tick + 1]
        rows.append((x, y, to[0] - x, to[1] - y, tick, LATE if last else tick + 1, wide))
    return np.array(rows, dtype=float)


def meetings(discs: np.ndarray, x: float, y: float, ticks: np.ndarray) -> list[Span]:
    """Departures from a cell at which discs, each with its span of time, are nearer to an obstacle than both radii."""
    px, py, radius, early, late = (discs[:, [k]] for k in range(5))
    ox, oy, sx, sy, begin, end, wide = ticks.T
    dx, dy = ox - x - px, oy - y - py
    square, mixed, least = sx * sx + sy * sy, dx * sx + dy * sy, dx * dx + dy * dy - (radius + wide) ** 2
    stands = np.broadcast_to(square == 0, least.shape)
    root = np.sqrt(np.maximum(mixed * mixed - square * least, 0.0))
    each = np.where(stands, 1.0, square)
    first = np.where(stands, 0.0, np.clip((-mixed - root) / each, 0.0, 1.0))
    last = np.where(stands, end - begin, np.clip((-mixed + root) / each, 0.0, 1.0))
    met = np.where(stands, least < 0, last > first)
    low, high = begin + first - late, begin + last - early
    return list(zip(low[met].tolist(), high[met].tolist(), strict=True))


def united(spans: list[Span]) -> list[Span]:
    """The union of intervals, in order."""
    out: list[Span] = []
    for low, high in sorted(spans):
        if out and low <= out[-1][1]:
            out[-1] = (out[-1][0], max(out[-1][1], high))
        else:
            out.append((low, high))
    return out


def gaps(spans: list[Span], low: float, high: float) -> list[Span]:
    """What is left of an interval."""
    out, at = [], low
    for a, b in united(spans):
        if a > at and at <= high:
            out.append((at, min(a, high)))
        at = max(at, b)
    if at <= high:
        out.append((at, high))
    return out


class Exhaustive:
    """All arrivals on one map; ``session`` gives the lattice and the states of the ends."""

    def __init__(self, scene: Scene, session: Any) -> None:
        self.lattice, self.map = session._lattice, session.lattice_map
        self.discs = motion_discs(self.lattice, 1.0)
        res = scene.grid.resolution
        self.ticks = np.concatenate(
            [ticks_of(list(one.track), max(one.radius / res, 0.5)) for one in scene.traffic]  # type: ignore[union-attr]
        )

    def arrival(self, starts: list[Any], goals: list[Any]) -> float:
        """Ticks; infinite: there is none."""
        lattice, grid = self.lattice, self.map.grid
        stand = self.discs.stand.reshape(-1, 5)
        move = self.discs.disc.reshape(-1, 5)
        free: dict[Any, list[Span]] = {}
        busy: dict[Any, list[Span]] = {}

        def intervals(state: Any) -> list[Span]:
            if state not in free:
                (x, y), heading = state
                part = stand[self.discs.stand_first[heading] : self.discs.stand_first[heading + 1]]
                free[state] = gaps(meetings(part, x, y, self.ticks), 0.0, LATE)
            return free[state]

        best: dict[Any, float] = {}
        heap: list[Any] = []
        for state in starts:
            if intervals(state) and intervals(state)[0][0] == 0.0:
                best[state, 0] = 0.0
                heapq.heappush(heap, (0.0, state, 0))
        done = math.inf
        while heap:
            at, state, k = heapq.heappop(heap)
            if at > best[state, k]:
                continue
            if state in goals:
                done = min(done, at)
            (x, y), heading = state
            for p in range(lattice.first[heading], lattice.first[heading + 1]):
                to = (x + int(lattice.cell[p, 0]), y + int(lattice.cell[p, 1]))
                if not grid.contains(to):
                    continue
                swept = lattice.sweep[lattice.sweep_first[p] : lattice.sweep_first[p + 1]]
                if any(
                    grid.contains((x + a, y + b)) and self.map.walls[self.map.index((x + a, y + b))]
                    for a, b in swept.tolist()
                ):
                    continue
                end = (to, int(lattice.turned[p]))
                lasts = float(lattice.cost[p]) / UNIT
                if ((x, y), p) not in busy:
                    part = move[self.discs.disc_first[p] : self.discs.disc_first[p + 1]]
                    busy[(x, y), p] = united(meetings(part, x, y, self.ticks))
                for leave, _ in gaps(busy[(x, y), p], at, intervals(state)[k][1]):
                    for j, (low, high) in enumerate(intervals(end)):
                        if low <= leave + lasts <= high and leave + lasts < best.get((end, j), math.inf):
                            best[end, j] = leave + lasts
                            heapq.heappush(heap, (leave + lasts, end, j))
        return done
