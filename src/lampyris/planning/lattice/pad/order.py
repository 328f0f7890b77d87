"""The order of states in a tunnel: those that are quick to reach the goal, their heading included, come first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.guided.guided_search import LOOK, around, sectors
from lampyris.planning.lattice.guided.lower_bound import Goal
from lampyris.planning.lattice.guided.open_space import FAR, NEVER, open_space_of
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.field import LowField
from lampyris.planning.lattice.pad.regions import Tunnel

MANY_GOALS = 64
"""Goal states that the order minds."""


def put_in_order(
    order: NDArray[np.int64], tunnel: Tunnel, goals: list[tuple[int, int]], lattice_map: LatticeMap,
    field: LowField | None, costs: NDArray[np.int64], known: Goal | None = None,
) -> None:  # fmt: skip
    """Note by how much each state of a tunnel is farther from the goals than its cell alone says, as if there were no walls.

    Near a goal the cost of the motion to it; elsewhere that of turning in place to where the cell's cheapest
    displacement leads. No lower bound comes of that.

    Parameters
    ----------
    order : int64 (cells * (headings + 1),): what is written.
    goals : cell index and heading.
    field, costs : of the projected graph, and its costs in the tunnel.
    known : what is known of the headings at the goals; None: their costs without walls.
    """
    lattice, cells = lattice_map.lattice, tunnel.cells
    n = lattice.shape.headings
    table = order.reshape(-1, n + 1)
    if field is None:
        table[cells] = 0
        return
    open_space = open_space_of(lattice, FAR)
    towards = _towards(cells, lattice_map, field)
    if lattice.shape.drive == "omnidirectional":
        extra = np.zeros((len(cells), n), dtype=np.int64)
    elif lattice.shape.drive == "ackermann":
        extra = around(lattice, FAR)[:, towards].T
    else:
        start = np.array([one.start for one in lattice.primitives])
        extra = open_space.turn[:, start[field.by[cells]]].T
    direct = np.full(extra.shape, NEVER)
    y, x = np.divmod(cells, lattice_map.stride)
    tables = (
        [(goal, open_space.to(heading)) for goal, heading in goals[:MANY_GOALS]]
        if known is None
        else [(known.cell, known.table)]
    )
    for goal, table_of in tables:
        half = (len(table_of) - 1) // 2
        goal_y, goal_x = divmod(goal, lattice_map.stride)
        near = (np.abs(x - goal_x) <= half) & (np.abs(y - goal_y) <= half)
        found = table_of[y[near] - goal_y + half, x[near] - goal_x + half]
        direct[near] = np.minimum(direct[near], found)
    low = costs[cells][:, None]
    entry = _entry(tunnel, lattice_map, towards, direct, low[:, 0], n)
    table[cells, :n] = np.where(direct < NEVER, np.maximum(direct - low, 0), np.minimum(extra + entry, NEVER))


def _towards(cells: NDArray[np.int64], lattice_map: LatticeMap, field: LowField) -> NDArray[np.int64]:
    """The heading in which the cheapest chain of displacements leads from each cell; the number of headings for none."""
    lattice = lattice_map.lattice
    at, gone = cells.copy(), np.zeros((len(cells), 2), dtype=np.int64)
    for _ in range(LOOK):
        by = field.by[at]
        to = gone + lattice.cell[by]
        on = (by >= 0) & (np.abs(to).max(axis=1) <= LOOK)
        gone = np.where(on[:, None], to, gone)
        at = np.where(on, at + lattice_map.offsets[by], at)
    found: NDArray[np.int64] = sectors(lattice.angles)[
        (gone[:, 1] + LOOK) * (2 * LOOK + 1) + gone[:, 0] + LOOK
    ].astype(np.int64)
    return found


def _entry(
    tunnel: Tunnel, lattice_map: LatticeMap, towards: NDArray[np.int64], direct: NDArray[np.int64],
    low: NDArray[np.int64], n: int,
) -> int:  # fmt: skip
    """What the heading of the goal costs more where the planned path comes near it."""
    path = np.searchsorted(tunnel.cells, [lattice_map.index(cell) for cell in tunnel.path])
    outside = np.flatnonzero(direct[path].min(axis=1) >= NEVER)
    if not len(outside) or outside[-1] + 1 == len(path):
        return 0
    first = path[outside[-1] + 1]
    if towards[first] == n:
        return 0
    least = direct[first, (towards[first] + np.arange(-1, 2)) % n].min()
    return max(int(least - low[first]), 0) if least < NEVER else 0
