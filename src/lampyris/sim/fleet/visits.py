"""The order of visits of a fleet plan: which robot has to leave a cell before which may enter it.

A plan by ticks is read as an order alone (an action dependency graph, Hoenig et al. 2019): whenever robot j enters a cell that
robot i visited before, j's move waits until i has reached the next cell of its path. Where robots exchange their cells in a
ring within one tick, each would wait for the next: such a ring is one motion of all its robots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris.typing import Cells

Longs = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class Visits:
    """The visits of all robots, one row each, robot by robot.

    Parameters
    ----------
    base : int64 (n + 1,): where the rows of each robot begin.
    cells : int32 (rows, 2): the cells that it visits one after another.
    arrival, departure : int64 (rows,): the first and the last tick there; the departure of the last one is -1.
    pred, need : int32 (rows,): the move that leaves a row may begin when robot ``pred`` (-1: none) has reached its visit
        ``need``.
    pred_b, need_b : the same for the crossing of a diagonal move.
    ring : int32 (rows,): the ring that the move that leaves a row belongs to; -1: none.
    rings : rows of the members of each ring.
    """

    base: Longs
    cells: Cells
    arrival: Longs
    departure: Longs
    pred: NDArray[np.int32]
    need: NDArray[np.int32]
    pred_b: NDArray[np.int32]
    need_b: NDArray[np.int32]
    ring: NDArray[np.int32]
    rings: tuple[tuple[int, ...], ...]

    @property
    def robot(self) -> Longs:
        """The robot of each row."""
        return np.repeat(np.arange(len(self.base) - 1), index_array(np.diff(self.base)))

    @property
    def last(self) -> NDArray[np.bool_]:
        """Whether a row is the last of its robot."""
        made = np.zeros(len(self.cells), dtype=np.bool_)
        made[self.base[1:] - 1] = True
        return made


def visits_of(paths: Sequence[Cells]) -> Visits:
    """The visits of paths by ticks, and their order.

    Parameters
    ----------
    paths : of a plan without conflicts: int32 (ticks + 1, 2) each.
    """
    base = np.zeros(len(paths) + 1, dtype=np.int64)
    parts, arrivals, departures = [], [], []
    for k, path in enumerate(paths):
        moved = np.flatnonzero((np.diff(path, axis=0) != 0).any(axis=1))
        arrivals.append(np.concatenate(([0], moved + 1)))
        departures.append(np.concatenate((moved, [-1])))
        parts.append(path[arrivals[-1]])
        base[k + 1] = base[k] + len(arrivals[-1])
    cells = np.concatenate(parts).astype(np.int32)
    arrival = np.concatenate(arrivals).astype(np.int64)
    departure = np.concatenate(departures).astype(np.int64)
    rows = len(cells)
    robot = np.repeat(np.arange(len(paths)), index_array(np.diff(base)))
    local = np.arange(rows) - base[robot]
    wide = int(cells[:, 0].max()) + 2
    number = cells[:, 1].astype(np.int64) * wide + cells[:, 0]
    pred, need = np.full(rows, -1, np.int32), np.zeros(rows, np.int32)
    order = np.lexsort((arrival, number))
    before, after = order[:-1], order[1:]
    waits = (number[before] == number[after]) & (robot[before] != robot[after])
    first, second = before[waits], after[waits]
    # The move into a visit is the one that leaves the visit before it.
    pred[second - 1] = robot[first]
    need[second - 1] = local[first] + 1
    leaving = np.full(rows, -1, np.int64)
    together = departure[first] == departure[second - 1]
    leaving[second[together] - 1] = first[together]
    pred_b, need_b = _crossings(cells, departure, robot, local, wide)
    ring, rings = _rings(leaving)
    return Visits(base, cells, arrival, departure, pred, need, pred_b, need_b, ring, rings)


def _crossings(
    cells: Cells, departure: Longs, robot: Longs, local: Longs, wide: int
) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """What diagonal moves wait for that pass the same corner of four cells."""
    pred, need = np.full(len(cells), -1, np.int32), np.zeros(len(cells), np.int32)
    moves = np.flatnonzero(departure >= 0)
    step = cells[moves + 1] - cells[moves]
    moves = moves[(step != 0).all(axis=1)]
    if len(moves):
        corner = np.minimum(cells[moves], cells[moves + 1]).astype(np.int64)
        number = corner[:, 1] * wide + corner[:, 0]
        order = np.lexsort((departure[moves], number))
        moves, number = moves[order], number[order]
        waits = (number[1:] == number[:-1]) & (robot[moves[1:]] != robot[moves[:-1]])
        first, second = moves[:-1][waits], moves[1:][waits]
        pred[second] = robot[first]
        need[second] = local[first] + 1
    return pred, need


def _rings(leaving: Longs) -> tuple[NDArray[np.int32], tuple[tuple[int, ...], ...]]:
    """The cycles of moves that each wait for the next one of the same tick."""
    ring = np.full(len(leaving), -1, np.int32)
    rings: list[tuple[int, ...]] = []
    seen = np.zeros(len(leaving), dtype=np.int64)
    for begin in np.flatnonzero(leaving >= 0).tolist():
        chain, row = [], begin
        while row >= 0 and seen[row] == 0:
            seen[row] = begin + 1
            chain.append(row)
            row = int(leaving[row])
        if row >= 0 and seen[row] == begin + 1:
            members = tuple(chain[chain.index(row) :])
            ring[list(members)] = len(rings)
            rings.append(members)
    return ring, tuple(rings)
