"""A lower bound that knows the headings at both ends: tables of open space around them, and the field in between.

A path leaves the square around its start, unless the goal lies in it, and costs until then no less than without walls. The
same holds at its other end, backward. In between it costs no less than the difference of the field.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.guided.open_space import NEVER, OpenSpace
from lampyris.planning.lattice.map import LatticeMap


@dataclass(frozen=True, slots=True, eq=False)
class Goal:
    """The goal states, all at one cell.

    Parameters
    ----------
    cell : index of the cell.
    headings : of the states.
    table : int64 (side, side, headings): costs to it without walls from each row, column and heading of a square around it.
    entry : what a path from outside the square costs more than the field says, at least.
    """

    cell: int
    headings: list[int]
    table: NDArray[np.int64]
    entry: int


@dataclass(frozen=True, slots=True, eq=False)
class _Square:
    """The cells of a square that lie in the map.

    Parameters
    ----------
    index : int64 (n,): of the map.
    row, column : int64 (n,): in the square.
    rim : bool (n,): whether a motion may lead from there out of the square.
    """

    index: NDArray[np.int64]
    row: NDArray[np.int64]
    column: NDArray[np.int64]
    rim: NDArray[np.bool_]


def _square(cell: int, half: int, lattice_map: LatticeMap, heuristic: NDArray[np.int64]) -> _Square:
    """The square around a cell; cells where the base must not be are left out."""
    step = int(np.abs(lattice_map.lattice.cell).max())
    y, x = divmod(cell, lattice_map.stride)
    rows = len(heuristic) // lattice_map.stride
    row, column = np.mgrid[0 : 2 * half + 1, 0 : 2 * half + 1].reshape(2, -1)
    at_y, at_x = row + y - half, column + x - half
    there = (at_y >= 0) & (at_y < rows) & (at_x >= 0) & (at_x < lattice_map.stride)
    index = np.where(there, at_y * lattice_map.stride + at_x, 0)
    there &= heuristic[index] >= 0
    index, row, column = index[there], row[there], column[there]
    away = np.maximum(np.abs(row - half), np.abs(column - half))
    return _Square(index, row, column, away > half - step)


def goal_of(
    states: list[tuple[int, int]], open_space: OpenSpace, lattice_map: LatticeMap, heuristic: NDArray[np.int64]
) -> Goal:
    """What is known of goal states (cell index, heading), all at one cell."""
    table = open_space.to(states[0][1])
    for _, heading in states[1:]:
        table = np.minimum(table, open_space.to(heading))
    square = _square(states[0][0], open_space.half, lattice_map, heuristic)
    rim = square.rim
    more = table[square.row[rim], square.column[rim]] - heuristic[square.index[rim]][:, None]
    return Goal(states[0][0], [heading for _, heading in states], np.ascontiguousarray(table), int(more.min(initial=NEVER)))


def lower_bound(
    start: tuple[int, int], goal: Goal, open_space: OpenSpace, lattice_map: LatticeMap, heuristic: NDArray[np.int64]
) -> int:
    """A cost that no path from a start state to the goal undercuts."""
    half = open_space.half
    square = _square(start[0], half, lattice_map, heuristic)
    gone = open_space.cost[start[1], square.row, square.column]
    known = heuristic[square.index][:, None]
    rest = np.full(gone.shape, NEVER)
    y, x = np.divmod(square.index, lattice_map.stride)
    goal_y, goal_x = divmod(goal.cell, lattice_map.stride)
    row, column = y - goal_y + half, x - goal_x + half
    near = (row >= 0) & (row <= 2 * half) & (column >= 0) & (column <= 2 * half)
    rest[near] = goal.table[row[near], column[near]]
    # From inside the goal's square either within it, or out of it and in again.
    rest = np.maximum(known, np.minimum(rest, known + goal.entry))
    least = (gone + rest)[square.rim].min(initial=NEVER)
    inside = gone[square.index == goal.cell][:, goal.headings]  # or never out of the square around the start
    return max(min(int(least), int(inside.min(initial=NEVER))), int(heuristic[start[0]]))
