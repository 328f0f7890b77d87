"""A lower bound that knows the headings at both ends: tables of open space around them, and the field in between.

A path leaves the square around its start, unless the goal lies in it, and costs until then no less than without walls. The
same holds at its other end, backward. In between it costs no less than the difference of the field.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.guided.open_space import NEVER, OpenSpace
from lampyris.planning.lattice.map import LatticeMap

PAIRS = 4_000_000
"""Pairs of states on both rims above which :func:`both_ends_bound` says nothing."""


@dataclass(frozen=True, eq=False)
class Goal:
    """The goal states, all at one cell.

    Parameters
    ----------
    cell : index of the cell.
    headings : of the states.
    table : int64 (side, side, headings): costs to it without walls from each row, column and heading of a square around it.
    entry : what a path from outside the square costs more than the field says, at least.

    Both may be of open space, or know the walls.
    """

    cell: int
    headings: list[int]
    table: NDArray[np.int64]
    entry: int

    @property
    def half(self) -> int:
        """The square has ``2 * half + 1`` cells a side."""
        return int(self.table.shape[0] - 1) // 2

    def at_least(self, state: tuple[int, int], stride: int, known: int) -> int:
        """What a path from a state costs at least, where the field says ``known``."""
        (cell, heading), half = state, self.half
        y, x = (a - b + half for a, b in zip(divmod(cell, stride), divmod(self.cell, stride), strict=True))
        beyond = known + self.entry
        if 0 <= y <= 2 * half and 0 <= x <= 2 * half:
            beyond = min(beyond, int(self.table[y, x, heading]))
        return max(known, beyond)

    @cached_property
    def with_cells(self) -> NDArray[np.int64]:
        """The table, and for each cell without a heading the least; int64 (side * side * (headings + 1),)."""
        flat = np.concatenate((self.table, self.table.min(axis=2, keepdims=True)), axis=2).ravel()
        return np.ascontiguousarray(flat)


@lru_cache(8)
def _rim(half: int, step: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Row and column of the cells of a square from which a motion of ``step`` cells may lead out of it."""
    row, column = np.mgrid[0 : 2 * half + 1, 0 : 2 * half + 1].reshape(2, -1)
    outer = np.maximum(np.abs(row - half), np.abs(column - half)) > half - step
    return row[outer], column[outer]


def _rim_in(
    cell: int, half: int, lattice_map: LatticeMap, heuristic: NDArray[np.int64], within: int | None = None
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Row and column of the rim around a cell, the same in the map, and the field there; without cells that the base must not
    be on. Rows and columns are those of a square of half size ``within``, if it is given.
    """
    row, column = _rim(half, int(np.abs(lattice_map.lattice.cell).max()))
    stride = lattice_map.stride
    y, x = row + (cell // stride - half), column + (cell % stride - half)
    there = (y >= 0) & (y < len(heuristic) // stride) & (x >= 0) & (x < stride)
    known = np.where(there, heuristic[np.where(there, y * stride + x, 0)], -1)
    there = known >= 0
    shift = 0 if within is None else within - half
    return row[there] + shift, column[there] + shift, y[there], x[there], known[there]


def goal_of(
    states: list[tuple[int, int]],
    open_space: OpenSpace,
    lattice_map: LatticeMap,
    heuristic: NDArray[np.int64],
) -> Goal:
    """What is known of goal states (cell index, heading), all at one cell."""
    table = open_space.to(states[0][1])
    for _, heading in states[1:]:
        table = np.minimum(table, open_space.to(heading))
    row, column, _, _, known = _rim_in(states[0][0], open_space.half, lattice_map, heuristic)
    entry = int((table[row, column] - known[:, None]).min(initial=NEVER))
    return Goal(states[0][0], [heading for _, heading in states], np.ascontiguousarray(table), entry)


def lower_bound(
    start: tuple[int, int],
    goal: Goal,
    open_space: OpenSpace,
    lattice_map: LatticeMap,
    heuristic: NDArray[np.int64],
) -> int:
    """A cost that no path from a start state to the goal undercuts."""
    half, (cell, heading) = open_space.half, start
    row, column, y, x, known = _rim_in(cell, half, lattice_map, heuristic)
    goal_y, goal_x = divmod(goal.cell, lattice_map.stride)
    # From the rim on: within the square around the goal, or from outside into it.
    rest = np.broadcast_to((known + goal.entry)[:, None], (len(known), goal.table.shape[2]))
    near = (np.abs(y - goal_y) <= half) & (np.abs(x - goal_x) <= half)
    if near.any():
        rest = rest.copy()
        rest[near] = np.minimum(rest[near], goal.table[y[near] - goal_y + half, x[near] - goal_x + half])
    gone = open_space.cost[heading, row, column]
    least = int((gone + np.maximum(rest, known[:, None])).min(initial=NEVER))
    # Or without leaving the square around the start.
    across, down = goal_x - cell % lattice_map.stride, goal_y - cell // lattice_map.stride
    if max(abs(across), abs(down)) <= half:
        least = min(least, int(open_space.cost[heading, half + down, half + across][goal.headings].min()))
    return max(least, goal.at_least(start, lattice_map.stride, int(heuristic[cell])))


def departure_bound(
    start: tuple[int, int],
    goals: list[tuple[int, int]],
    open_space: OpenSpace,
    lattice_map: LatticeMap,
    heuristic: NDArray[np.int64],
) -> int:
    """A cost that no path from a start state to any of some goal states undercuts, whatever their headings cost more."""
    half, (cell, heading), stride = open_space.half, start, lattice_map.stride
    row, column, _, _, known = _rim_in(cell, half, lattice_map, heuristic)
    least = int((open_space.cost[heading, row, column] + known[:, None]).min(initial=NEVER))
    cells, turns = np.array(goals, dtype=np.int64).T
    y, x = cells // stride - cell // stride + half, cells % stride - cell % stride + half
    near = (y >= 0) & (y <= 2 * half) & (x >= 0) & (x <= 2 * half)
    if near.any():
        least = min(least, int(open_space.cost[heading, y[near], x[near], turns[near]].min()))
    return max(least, int(heuristic[cell]))


def both_ends_bound(
    start: tuple[int, int],
    goal: Goal,
    open_space: OpenSpace,
    lattice_map: LatticeMap,
    heuristic: NDArray[np.int64],
) -> int:
    """A cost that no path from a start state to the goal undercuts, which knows from which side the goal is reached; or 0.

    With squares around both ends that do not meet, a path leaves the first at one of its states, enters the second for the last
    time at another, and drives from one to the other.
    """
    (cell, heading), stride = start, lattice_map.stride
    apart = max(abs(a - b) for a, b in zip(divmod(cell, stride), divmod(goal.cell, stride), strict=True))
    half = min(open_space.half, goal.half, (apart - 1) // 2)
    if half < int(np.abs(lattice_map.lattice.cell).max()) or heuristic[cell] < 0:
        return 0
    row, column, y, x, known = _rim_in(cell, half, lattice_map, heuristic, open_space.half)
    left = np.maximum(open_space.cost[heading, row, column].min(axis=1), heuristic[cell] - known)
    row, column, goal_y, goal_x, goal_known = _rim_in(goal.cell, half, lattice_map, heuristic, goal.half)
    entered = np.maximum(goal.table[row, column].min(axis=1), goal_known)
    if not len(left) or not len(entered):
        return 0
    moved = np.abs(lattice_map.lattice.cell).any(axis=1)
    jump = lattice_map.lattice.cell[moved]
    far = np.sqrt((jump * jump).sum(axis=1))
    unit = float((lattice_map.lattice.cost[moved] / far).min()) * (1 - 1e-12)

    def between(some: Any, others: Any) -> NDArray[np.float64]:
        down = y[some][:, None] - goal_y[others][None, :]
        across = x[some][:, None] - goal_x[others][None, :]
        driven = np.maximum(
            unit * np.sqrt(down * down + across * across), known[some][:, None] - goal_known[others][None, :]
        )
        whole: NDArray[np.float64] = left[some][:, None] + driven + entered[others][None, :]
        return whole

    # Of the sums that some pair of states comes to none need be looked at that is greater beforehand.
    every = np.arange(len(entered))
    first = np.array([int((left + known).argmin())])
    most = float(between(first, every).min())
    some = np.flatnonzero(left + known <= most)
    down, across = goal_y - cell // stride, goal_x - cell % stride
    away = unit * np.sqrt(down * down + across * across)
    others = np.flatnonzero(entered + away <= most)
    if len(some) * len(others) > PAIRS:
        return 0
    least = between(some, others).min(initial=most) if len(some) and len(others) else most
    return math.floor(least)
