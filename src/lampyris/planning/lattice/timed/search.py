"""The timed search made callable: its memory, and the path that it found with its times."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice import timed_search as kernel
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.search import Found
from lampyris.planning.lattice.timed.discs import SLACK, MotionDiscs
from lampyris.planning.lattice.timed.obstacles import KnownObstacles

_ROOM, _SPANS = 1 << 14, 64


@dataclass(frozen=True, slots=True)
class TimedFound:
    """What one search found.

    Parameters
    ----------
    outcome : FOUND, EXHAUSTED or LIMIT of the kernel.
    expansions : nodes expanded.
    path : its states and primitives; the cost is the time of arrival, waiting included, in units of the lattice.
    departures : ticks at which each primitive begins.
    """

    outcome: int
    expansions: int
    path: Found | None = None
    departures: tuple[float, ...] = ()


class IntervalSearch:
    """One map, one robot, and obstacles with known tracks.

    Parameters
    ----------
    lattice_map : the map.
    discs : of the robot.
    obstacles : where they will be.
    speed : share of the top speed at which the robot drives.
    """

    def __init__(
        self, lattice_map: LatticeMap, discs: MotionDiscs, obstacles: KnownObstacles, speed: float
    ) -> None:
        self._map, self._discs, self._obstacles, self._speed = lattice_map, discs, obstacles, speed

    def find(
        self,
        heuristic: NDArray[np.int64],
        starts: list[tuple[int, int]],
        goals: list[tuple[int, int]],
        weight: float,
        limit: int | None,
    ) -> TimedFound:
        """The earliest arrival, to within ``weight``; starts and goals are pairs of cell index and heading."""
        n = len(self._map.lattice.angles)
        begin = np.array([cell * n + h for cell, h in starts], dtype=np.int64)
        end = np.array(sorted({cell * n + h for cell, h in goals}), dtype=np.int64)
        room, spans = _ROOM, _SPANS
        while True:
            memory = _Memory(self._map.walls.size * n, room, spans)
            outcome = self._run(memory, heuristic, begin, end, weight, -1 if limit is None else limit)
            if outcome == kernel.FULL:
                room *= 4
            elif outcome == kernel.MANY_SPANS:
                spans, room = 4 * spans, max(room, 8 * spans)
            else:
                return self._result(memory, heuristic, outcome, weight)

    def _run(
        self, memory: _Memory, heuristic: NDArray[np.int64], starts: NDArray[np.int64], goals: NDArray[np.int64],
        weight: float, limit: int,
    ) -> int:  # fmt: skip
        lattice_map, lattice, discs, obstacles = self._map, self._map.lattice, self._discs, self._obstacles
        return int(
            kernel.timed_search(
                lattice_map.walls, lattice_map.clear, heuristic, len(lattice.angles), lattice_map.stride,
                lattice_map.border, lattice.first, lattice_map.offsets, lattice.turned, discs.duration, lattice.reach,
                lattice.inscribed - 1e-6, lattice.sweep_first, lattice_map.swept, discs.disc_first, discs.disc,
                discs.disc_reach, discs.stand_first, discs.stand, discs.stand_reach, SLACK, obstacles.block,
                obstacles.block_first, obstacles.segment, self._tick, starts, goals, weight, limit, memory.slot,
                memory.state, memory.begin, memory.end, memory.time, memory.before, memory.by, memory.left,
                memory.open, memory.keys, memory.waits, memory.busy, memory.still, memory.count,
            )
        )  # fmt: skip

    @property
    def _tick(self) -> float:
        """Ticks of one unit of the lattice."""
        return 1.0 / UNIT / self._speed

    def _result(
        self, memory: _Memory, heuristic: NDArray[np.int64], outcome: int, weight: float
    ) -> TimedFound:
        expansions = int(memory.count[kernel.EXPANDED])
        node = int(memory.count[kernel.BEST])
        if outcome != kernel.FOUND:
            return TimedFound(outcome, expansions)
        n, lattice = len(self._map.lattice.angles), self._map.lattice
        arrival = float(memory.time[node])
        last = divmod(int(memory.state[node]), n)
        states, primitives, departures = [], [], []
        while memory.before[node] >= 0:
            primitives.append(int(memory.by[node]))
            departures.append(float(memory.left[node]))
            node = int(memory.before[node])
            states.append(divmod(int(memory.state[node]), n))
        assert all(lattice.primitives[p].start == h for p, (_, h) in zip(primitives, states, strict=True))
        # A path that arrives earlier goes through a node that waits: it arrives no earlier than its time and heuristic.
        used = int(memory.count[kernel.NODES])
        waits = memory.open[:used] != 0
        least = memory.time[:used][waits] + self._tick * heuristic[memory.state[:used][waits] // n]
        bound = max(float(least.min()), arrival / weight * (1 - 1e-9))
        cost = math.ceil(arrival / self._tick)
        found = Found(
            tuple(states[::-1]),
            tuple(primitives[::-1]),
            last,
            cost,
            min(math.floor(bound / self._tick), cost),
        )
        return TimedFound(outcome, expansions, found, tuple(departures[::-1]))


class _Memory:
    """What a search writes into; pages that it does not touch are never made."""

    def __init__(self, states: int, room: int, spans: int) -> None:
        self.slot = np.zeros(states, dtype=np.int32)
        self.state = np.zeros(room, dtype=np.int64)
        self.begin, self.end, self.time, self.left = (np.zeros(room) for _ in range(4))
        self.before = np.zeros(room, dtype=np.int32)
        self.by = np.zeros(room, dtype=np.int16)
        self.open = np.zeros(room, dtype=np.uint8)
        self.keys, self.waits = np.zeros(2 * room), np.zeros(2 * room, dtype=np.int32)
        self.busy, self.still = np.zeros(2 * spans), np.zeros(2 * spans)
        self.count = np.array([0, 0, 0, -1], dtype=np.int64)
