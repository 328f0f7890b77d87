"""What the walls around a goal add to costs: exact ones of the states near it, and a bound for paths from farther off."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.lattice import goal_costs as kernel
from lampyris.planning.graph.expanded import run_noting
from lampyris.planning.lattice.guided.lower_bound import Goal
from lampyris.planning.lattice.guided.open_space import NEVER
from lampyris.planning.lattice.lattice import StateLattice
from lampyris.planning.lattice.map import LatticeMap
from lampyris.typing import Cells

MANY = 4_000
"""Expansions after which it ends with what it knows."""


@lru_cache(8)
def by_end(lattice: StateLattice) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.int32]]:
    """Heading at the beginning of each primitive; primitives by the heading at their end, and where each heading's begin."""
    began = np.array([one.start for one in lattice.primitives], dtype=np.int32)
    last = np.argsort(lattice.turned, kind="stable").astype(np.int32)
    first = np.searchsorted(lattice.turned[last], np.arange(lattice.shape.headings + 1)).astype(np.int32)
    return began, last, first


def with_walls(
    goal: Goal,
    lattice_map: LatticeMap,
    costs: NDArray[np.int64],
    limit: int,
    places: list[Cells] | None = None,
) -> tuple[Goal, int]:
    """The same goal with the walls around it, and the states expanded.

    A search backward from the goal states within the square of the table, in the order of the excess over ``costs``, which are
    consistent. It ends where a path may have left the square with excess K: no path from a state that it has not expanded costs
    less than ``costs`` and K. Of those that it has expanded the cost is exact.

    Parameters
    ----------
    goal : with costs without walls.
    costs : of the projected graph; int64 (cells,).
    limit : greatest number of expansions.
    places : is given the cells of the states that are expanded; see :class:`LatticeSearch`.
    """
    lattice, half = lattice_map.lattice, goal.half
    n, side = lattice.shape.headings, 2 * half + 1
    began, last, first = by_end(lattice)
    corner_y, corner_x = (part - half for part in divmod(goal.cell, lattice_map.stride))
    found = np.full(side * side * n, -1, dtype=np.int64)
    done = np.zeros(side * side * n, dtype=np.uint8)
    room = 1 << 14
    keys, states = np.zeros(room, dtype=np.int64), np.zeros(room, dtype=np.int32)
    waiting = sorted(
        (cost - int(costs[cell]), cell, heading, cost)
        for (cell, heading), cost in zip(goal.states, goal.costs, strict=True)
    )  # a sorted array is a heap
    for k, (excess, cell, heading, cost) in enumerate(waiting):
        y, x = divmod(cell, lattice_map.stride)
        keys[k], states[k] = excess, ((y - corner_y) * side + x - corner_x) * n + heading
        found[states[k]] = cost
    count = np.array((len(waiting), 0, NEVER), dtype=np.int64)
    large_enough = False
    while not large_enough:
        args = (
            lattice_map.walls, lattice_map.clear, lattice.inscribed - 1e-6, lattice.reach, lattice.sweep_first,
            lattice_map.swept, costs, n, first, last, lattice_map.offsets, began, lattice.cost,
            lattice_map.stride, goal.cell, half, min(limit, MANY), found, done, keys, states, count,
        )  # fmt: skip
        if places is None:
            large_enough = bool(kernel.spread_back(*args))
        else:
            large_enough, expanded = run_noting(kernel.spread_back, args, done, 1)
            down, across = np.divmod(expanded // n, side)
            places.append(lattice_map.cells(goal.cell + (down - half) * lattice_map.stride + across - half))
        keys = np.concatenate((keys, np.zeros_like(keys)))
        states = np.concatenate((states, np.zeros_like(states)))
    least = int(count[kernel.EXCESS])
    known = _square(goal, lattice_map, costs)[:, :, None]
    exact = done.reshape(side, side, n) != 0
    table = np.where(exact, found.reshape(side, side, n), np.maximum(goal.table, known + least))
    return (
        replace(goal, table=np.ascontiguousarray(table), entry=max(goal.entry, least)),
        int(count[kernel.EXPANDED]),
    )


def _square(goal: Goal, lattice_map: LatticeMap, costs: NDArray[np.int64]) -> NDArray[np.int64]:
    """The costs of the cells of the square; 0 where there are none."""
    half, stride = goal.half, lattice_map.stride
    y, x = (part + np.arange(-half, half + 1) for part in divmod(goal.cell, stride))
    there = ((y >= 0) & (y < len(costs) // stride))[:, None] & ((x >= 0) & (x < stride))[None, :]
    index = np.where(there, y[:, None] * stride + x[None, :], 0)
    return np.where(there, np.maximum(costs[index], 0), 0)
