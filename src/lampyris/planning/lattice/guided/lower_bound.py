"""A lower bound that knows the headings at both ends: tables of open space around them, and the field in between.

A path leaves the square around its start, unless the goal lies in it, and costs until then no less than without walls. The
same holds at its other end, backward. In between it costs no less than the difference of the field. Either end may be several
states, each with the cost of a curve between it and the pose that is asked for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice.both_ends import least_of_goals, least_over_rim
from lampyris.planning.lattice.guided.open_space import NEVER, OpenSpace
from lampyris.planning.lattice.map import LatticeMap

PAIRS = 4_000_000
"""Pairs of states on both rims above which :func:`both_ends_bound` says nothing."""


@dataclass(frozen=True, eq=False)
class Goal:
    """The states at which a path may end.

    Parameters
    ----------
    cell : index of the cell in the middle of the square.
    states : cell index and heading of each.
    costs : of the curves from the states to the goal, 0 where the goal is a state.
    table : int64 (side, side, headings): costs to the goal without walls from each row, column and heading of the square.
    entry : what a path from outside the square costs more than the field says, at least.

    Table and entry may be of open space, or know the walls.
    """

    cell: int
    states: list[tuple[int, int]]
    costs: list[int]
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
    cell: int, half: int, lattice_map: LatticeMap, heuristic: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Row and column of the rim around a cell, the same in the map, and the field there; without cells that the base must not
    be on.
    """
    row, column = _rim(half, int(np.abs(lattice_map.lattice.cell).max()))
    stride = lattice_map.stride
    y, x = row + (cell // stride - half), column + (cell % stride - half)
    there = (y >= 0) & (y < len(heuristic) // stride) & (x >= 0) & (x < stride)
    known = np.where(there, heuristic[np.where(there, y * stride + x, 0)], -1)
    there = known >= 0
    return row[there], column[there], y[there], x[there], known[there]


def goal_of(
    states: list[tuple[int, int]],
    open_space: OpenSpace,
    lattice_map: LatticeMap,
    heuristic: NDArray[np.int64],
    costs: list[int] | None = None,
) -> Goal | None:
    """What is known of goal states (cell index, heading); None: they are too far apart for a square around all of them.

    A path that stays in the square around their middle stays in the larger squares around each of them, too.

    Parameters
    ----------
    costs : of the curves from the states to the goal; by default they are the goal, all at one cell.
    """
    prices = [0] * len(states) if costs is None else costs
    rows, columns = np.divmod(np.array([cell for cell, _ in states]), lattice_map.stride)
    row, column = (int((part.min() + part.max()) // 2) for part in (rows, columns))
    far = int(max(np.abs(rows - row).max(), np.abs(columns - column).max()))
    half = open_space.half - far
    if half < 2 * far:
        return None
    middle = row * lattice_map.stride + column
    table = np.full((2 * half + 1, 2 * half + 1, open_space.cost.shape[0]), NEVER)
    headings = np.array([heading for _, heading in states], dtype=np.int64)
    least_of_goals(
        open_space.towards(headings.tolist()).ravel(), open_space.half, table.shape[2], headings, rows - row, columns - column,
        np.array(prices, dtype=np.int64), half, table.ravel(),
    )  # fmt: skip
    around, across, _, _, known = _rim_in(middle, half, lattice_map, heuristic)
    entry = int((table[around, across] - known[:, None]).min(initial=NEVER))
    return Goal(middle, states, prices, table, entry)


def lower_bounds(
    starts: list[tuple[int, int]],
    start_costs: list[int],
    goal: Goal,
    open_space: OpenSpace,
    lattice_map: LatticeMap,
    heuristic: NDArray[np.int64],
) -> NDArray[np.int64]:
    """For each start state a cost that no path from there to the goal undercuts; int64 (n,).

    Parameters
    ----------
    starts : cell index and heading of each, where the heuristic is known.
    start_costs : of the curves to the start states, which count.
    """
    half, stride = open_space.half, lattice_map.stride
    row, column = _rim(half, int(np.abs(lattice_map.lattice.cell).max()))
    cells, headings = (np.array(part, dtype=np.int64) for part in zip(*starts, strict=True))
    bounds = np.zeros(len(starts), dtype=np.int64)
    least_over_rim(
        heuristic, stride, len(heuristic) // stride, cells, headings, row, column, half, open_space.least.ravel(),
        open_space.cost.ravel(), open_space.cost.shape[0], goal.table.ravel(), goal.half, goal.cell, goal.entry, bounds,
    )  # fmt: skip
    # Or without leaving the square around the start.
    ends, facing = (np.array(part, dtype=np.int64) for part in zip(*goal.states, strict=True))
    down, across = (
        a[None, :] - b[:, None]
        for a, b in zip(np.divmod(ends, stride), np.divmod(cells, stride), strict=True)
    )
    n, k = np.nonzero((np.abs(down) <= half) & (np.abs(across) <= half))
    direct = open_space.cost[headings[n], half + down[n, k], half + across[n, k], facing[k]]
    np.minimum.at(bounds, n, direct + np.array(goal.costs, dtype=np.int64)[k])
    known = [goal.at_least(one, stride, int(heuristic[one[0]])) for one in starts]
    return np.maximum(bounds, known) + np.array(start_costs, dtype=np.int64)


def both_ends_bound(
    starts: list[tuple[int, int]],
    start_costs: list[int],
    goal: Goal,
    open_space: OpenSpace,
    lattice_map: LatticeMap,
    heuristic: NDArray[np.int64],
) -> int:
    """A cost that no path from any start state to the goal undercuts, which knows from which side the goal is reached; or 0.

    With squares around both ends that do not meet, a path leaves the first at one of its states, enters the second for the last
    time at another, and drives from one to the other.

    Parameters
    ----------
    starts, start_costs : see :func:`lower_bounds`.
    """
    stride, jump = lattice_map.stride, lattice_map.lattice.cell
    from_y, from_x = np.divmod(np.array([cell for cell, _ in starts]), stride)
    to_y, to_x = np.divmod(np.array([cell for cell, _ in goal.states]), stride)
    middle_y, middle_x = (int((part.min() + part.max()) // 2) for part in (from_y, from_x))
    goal_y, goal_x = divmod(goal.cell, stride)
    far = int(max(np.abs(from_y - middle_y).max(), np.abs(from_x - middle_x).max()))
    far_goal = int(max(np.abs(to_y - goal_y).max(), np.abs(to_x - goal_x).max()))
    apart = max(abs(middle_y - goal_y), abs(middle_x - goal_x))
    half = min(open_space.half - far, goal.half, (apart - 1) // 2)
    if half < max(int(np.abs(jump).max()), far, far_goal):
        return 0
    _, _, y, x, known = _rim_in(middle_y * stride + middle_x, half, lattice_map, heuristic)
    _, _, y_in, x_in, known_in = _rim_in(goal.cell, half, lattice_map, heuristic)
    if not len(known) or not len(known_in):
        return 0
    left = np.full(len(known), NEVER)
    for (cell, heading), row, column, cost in zip(starts, from_y, from_x, start_costs, strict=True):
        gone = open_space.least[heading, y - row + open_space.half, x - column + open_space.half]
        np.minimum(left, np.maximum(gone, heuristic[cell] - known) + cost, out=left)
    entered = np.maximum(
        goal.table[y_in - goal_y + goal.half, x_in - goal_x + goal.half].min(axis=1), known_in
    )
    moved = np.abs(jump).any(axis=1)
    length = np.sqrt((jump[moved] * jump[moved]).sum(axis=1))
    unit = float((lattice_map.lattice.cost[moved] / length).min()) * (1 - 1e-12)

    def between(some: Any, others: Any) -> NDArray[np.float64]:
        down = y[some][:, None] - y_in[others][None, :]
        across = x[some][:, None] - x_in[others][None, :]
        driven = np.maximum(
            unit * np.sqrt(down * down + across * across), known[some][:, None] - known_in[others][None, :]
        )
        whole: NDArray[np.float64] = left[some][:, None] + driven + entered[others][None, :]
        return whole

    # Of the sums that some pair of states comes to none need be looked at that is greater beforehand.
    every = np.arange(len(entered))
    first = np.array([int((left + known).argmin())])
    most = float(between(first, every).min())
    some = np.flatnonzero(left + known <= most)
    down, across = y_in[:, None] - from_y[None, :], x_in[:, None] - from_x[None, :]
    away = unit * np.sqrt(down * down + across * across) + np.array(start_costs, dtype=np.int64)
    others = np.flatnonzero(entered + away.min(axis=1) <= most)
    if len(some) * len(others) > PAIRS:
        return 0
    least = between(some, others).min(initial=most) if len(some) and len(others) else most
    return math.floor(least)
