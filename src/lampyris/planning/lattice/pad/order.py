"""The order of states in a tunnel: those that are quick to reach the goal, their heading included, come first."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.guided.open_space import NEVER, open_space_of
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.field import LowField
from lampyris.planning.lattice.pad.regions import Tunnel

MANY_GOALS = 64
"""Goal states that the order minds."""


def put_in_order(
    order: NDArray[np.int64], tunnel: Tunnel, goals: list[tuple[int, int]], lattice_map: LatticeMap,
    field: LowField | None, costs: NDArray[np.int64],
) -> None:  # fmt: skip
    """Note by how much each state of a tunnel is farther from the goals than its cell alone says, as if there were no walls.

    Near a goal the cost of the motion to it; elsewhere that of turning, on the spot, to where the cell's cheapest
    displacement leads. No lower bound comes of that.

    Parameters
    ----------
    order : int64 (cells * (headings + 1),): what is written.
    goals : cell index and heading.
    field, costs : of the projected graph, and its costs in the tunnel.
    """
    lattice, cells = lattice_map.lattice, tunnel.cells
    n = lattice.shape.headings
    table = order.reshape(-1, n + 1)
    if field is None or lattice.shape.drive == "omnidirectional":
        table[cells] = 0
        return
    open_space = open_space_of(lattice)
    half = open_space.half
    start = np.array([one.start for one in lattice.primitives])
    extra = open_space.turn[:, start[field.by[cells]]].T
    direct = np.full(extra.shape, NEVER)
    y, x = np.divmod(cells, lattice_map.stride)
    for goal, heading in goals[:MANY_GOALS]:
        goal_y, goal_x = divmod(goal, lattice_map.stride)
        near = (np.abs(x - goal_x) <= half) & (np.abs(y - goal_y) <= half)
        known = open_space.to(heading)[y[near] - goal_y + half, x[near] - goal_x + half]
        direct[near] = np.minimum(direct[near], known)
    low = costs[cells][:, None]
    table[cells, :n] = np.where(direct < NEVER, np.maximum(direct - low, 0), np.minimum(extra, NEVER))
