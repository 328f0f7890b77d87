"""The timed search made callable: its memory, and the path that it found with its times."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice import timed_search as kernel
from lampyris.planning.graph.expanded import run_noting
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.search import Found
from lampyris.planning.lattice.timed.discs import SLACK, MotionDiscs
from lampyris.planning.lattice.timed.obstacles import KnownObstacles
from lampyris.typing import Cells

_ROOM, _SPANS = 1 << 14, 64


NO_ORDER = np.zeros(1, dtype=np.int64)
_NO_CELLS = np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class TimedFound:
    """What one search found.

    Parameters
    ----------
    outcome : FOUND, EXHAUSTED or LIMIT of the kernel.
    expansions, low : nodes expanded, and those of them that are cells without a heading.
    path : its states and primitives; the cost is the time of arrival, waiting included, in units of the lattice.
    departures : ticks at which each primitive begins.
    arrivals : ticks at which each state is reached, the last one included.
    lower_bound : ticks before which no path arrives; 0 if no path was found.
    reached : indices of the cells that were reached, if no path was found.
    """

    outcome: int
    expansions: int
    low: int = 0
    path: Found | None = None
    departures: tuple[float, ...] = ()
    arrivals: tuple[float, ...] = ()
    lower_bound: float = 0.0
    reached: NDArray[np.int64] = field(default_factory=lambda: _NO_CELLS)


@dataclass(frozen=True, slots=True, eq=False)
class Regions:
    """Where states have a heading and intervals of time, and the motions of cells outside.

    Parameters
    ----------
    inside : uint8 (cells,): 1 there.
    member, group_first : see :class:`lampyris.planning.lattice.pad.projection.Projection`.
    """

    inside: NDArray[np.uint8]
    member: NDArray[np.int32]
    group_first: NDArray[np.int32]

    @classmethod
    def everywhere(cls, cells: int) -> Regions:
        """All cells of a map."""
        return cls(np.ones(cells, dtype=np.uint8), np.zeros(0, dtype=np.int32), np.zeros(1, dtype=np.int32))


class IntervalSearch:
    """One map, one robot, and obstacles with known tracks.

    Parameters
    ----------
    lattice_map : the map.
    discs : of the robot.
    obstacles : where they will be.
    speed : share of the top speed at which the robot drives.

    Attributes
    ----------
    tick : ticks of one unit of the lattice.
    expanded : as that of :class:`LatticeSearch`.
    """

    def __init__(
        self, lattice_map: LatticeMap, discs: MotionDiscs, obstacles: KnownObstacles, speed: float
    ) -> None:
        self._map, self._discs, self._obstacles = lattice_map, discs, obstacles
        self.tick = 1.0 / UNIT / speed
        self.expanded: list[Cells] | None = None
        self._each = len(lattice_map.lattice.angles) + 1

    def find(
        self,
        heuristic: NDArray[np.int64],
        starts: list[tuple[int, int]],
        goals: list[tuple[int, int]],
        weight: float,
        limit: int | None,
        *,
        regions: Regions | None = None,
        most: float = -1.0,
        order: NDArray[np.int64] = NO_ORDER,
    ) -> TimedFound:
        """The earliest arrival, to within ``weight``.

        Parameters
        ----------
        heuristic : int64 (cells,), units of the lattice.
        starts, goals : cell index and heading; those outside regions stand for their cells.
        limit : greatest number of expansions; None: none.
        regions : None: everywhere.
        most : ticks; paths that arrive later are not looked for; negative: all are.
        order : see the kernel.
        """
        regions = regions or Regions.everywhere(self._map.walls.size)
        begin = np.array([self._state(one, regions) for one in starts], dtype=np.int64)
        end = np.array(sorted({self._state(one, regions) for one in goals}), dtype=np.int64)
        room, spans = _ROOM, _SPANS
        while True:
            memory = _Memory(self._map.walls.size * self._each, room, spans)
            outcome = self._run(
                memory, heuristic, begin, end, weight, -1 if limit is None else limit, regions, most, order
            )
            if outcome == kernel.FULL:
                room *= 4
            elif outcome == kernel.MANY_SPANS:
                spans, room = 4 * spans, max(room, 8 * spans)
            else:
                return self._result(memory, heuristic, outcome, weight)

    def _state(self, one: tuple[int, int], regions: Regions) -> int:
        cell, heading = one
        return cell * self._each + (heading if regions.inside[cell] else self._each - 1)

    def _run(
        self, memory: _Memory, heuristic: NDArray[np.int64], starts: NDArray[np.int64], goals: NDArray[np.int64],
        weight: float, limit: int, regions: Regions, most: float, order: NDArray[np.int64],
    ) -> int:  # fmt: skip
        lattice_map, lattice, discs, obstacles = self._map, self._map.lattice, self._discs, self._obstacles
        args = (
                lattice_map.walls, lattice_map.clear, heuristic, self._each - 1, lattice_map.stride,
                lattice_map.border, lattice.first, lattice_map.offsets, lattice.turned, discs.duration, lattice.reach,
                lattice.inscribed - 1e-6, lattice.sweep_first, lattice_map.swept, discs.disc_first, discs.disc,
                discs.disc_reach, discs.stand_first, discs.stand, discs.stand_reach, SLACK, obstacles.block,
                obstacles.block_first, obstacles.segment, regions.inside, regions.member, regions.group_first, most, order,
                self.tick, starts, goals, weight, limit, memory.slot,
                memory.state, memory.begin, memory.end, memory.time, memory.before, memory.by, memory.left,
                memory.open, memory.keys, memory.waits, memory.busy, memory.still, memory.count,
        )  # fmt: skip
        if self.expanded is None:
            return int(kernel.timed_search(*args))
        outcome, nodes = run_noting(kernel.timed_search, args, memory.open, 0)
        if outcome in (kernel.FOUND, kernel.EXHAUSTED, kernel.LIMIT):  # else it begins again
            # The goal's node is taken, too, but not expanded.
            nodes = nodes[: int(memory.count[kernel.EXPANDED])]
            self.expanded.append(lattice_map.cells(memory.state[nodes] // self._each))
        return int(outcome)

    def _result(
        self, memory: _Memory, heuristic: NDArray[np.int64], outcome: int, weight: float
    ) -> TimedFound:
        expansions, low = int(memory.count[kernel.EXPANDED]), int(memory.count[kernel.LOW])
        node = int(memory.count[kernel.BEST])
        used = int(memory.count[kernel.NODES])
        each = self._each
        if outcome != kernel.FOUND:
            reached = memory.state[:used][memory.time[:used] < kernel.FOREVER] // each
            return TimedFound(outcome, expansions, low, reached=reached)
        arrivals = [float(memory.time[node])]
        last = divmod(int(memory.state[node]), each)
        states, primitives, departures = [], [], []
        while memory.before[node] >= 0:
            primitives.append(int(memory.by[node]))
            departures.append(float(memory.left[node]))
            node = int(memory.before[node])
            states.append(divmod(int(memory.state[node]), each))
            arrivals.append(float(memory.time[node]))
        # A path that arrives earlier goes through a node that waits: it arrives no earlier than its time and heuristic.
        waits = memory.open[:used] != 0
        least = memory.time[:used][waits] + self.tick * heuristic[memory.state[:used][waits] // each]
        bound = min(max(float(least.min()), arrivals[0] / weight * (1 - 1e-9)), arrivals[0])
        cost = math.ceil(arrivals[0] / self.tick)
        found = Found(
            tuple(states[::-1]), tuple(primitives[::-1]), last, cost, min(math.floor(bound / self.tick), cost)
        )
        return TimedFound(
            outcome, expansions, low, found, tuple(departures[::-1]), tuple(arrivals[::-1]), bound
        )


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
        self.count = np.array([0, 0, 0, -1, 0], dtype=np.int64)
