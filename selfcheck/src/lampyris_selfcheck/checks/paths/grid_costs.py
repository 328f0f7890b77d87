"""Least costs from every cell of a map to some goals, by SciPy's Dijkstra: quick, no code of our searches.

Costs are whole numbers below 2^53, so that the floats SciPy adds up are exact. For octile moves a straight
costs Q and a diagonal P, a Pell pair: counts are then ordered as by ``n + m sqrt 2`` while diagonals differ
by less than Q, and the two counts can be told from the sum. Which steps there are and what they need is taken
from :mod:`lampyris_selfcheck.reference.paths.path_cost`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from lampyris.typing import BoolGrid, ByteGrid
from lampyris_selfcheck.reference.paths.path_cost import PLAIN, rules
from lampyris_selfcheck.reference.paths.search import TENTHS, Cell, Cost

Q, P = 6_625_109, 9_369_319
"""P^2 - 2 Q^2 is 1 or -1."""
_INVERSE_P = pow(P, -1, Q)
_EXACT = 2.0**53
_EDGE = 2
"""Longest step: the map is laid into so wide a frame of walls."""


def room_for(blocked: BoolGrid, radius: float) -> BoolGrid:
    """Cells whose centre is at least ``radius`` cells from every blocked cell's square; touching is free."""
    height, width = blocked.shape
    reach = int(np.ceil(radius + 0.5))
    framed = np.pad(blocked, reach)
    near = np.zeros_like(blocked)
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            apart = max(abs(dx) - 0.5, 0.0) ** 2 + max(abs(dy) - 0.5, 0.0) ** 2
            if apart < radius * radius - 1e-9 or dx == dy == 0:
                near |= framed[reach + dy : reach + dy + height, reach + dx : reach + dx + width]
    free: BoolGrid = ~near
    return free


def costs_to(
    goals: Sequence[Cell], free: BoolGrid, name: str, *, wide: bool = False, terrain: ByteGrid | None = None
) -> NDArray[np.int64]:
    """Least cost from every cell to each goal, int64 (goals, height, width); -1: no way.

    Parameters
    ----------
    goals : free cells.
    free : where the robot's centre may be, bool (height, width).
    name : the step set; ``wide``: for a robot of some radius.
    terrain : uint8 (height, width); costs then count 63rds, and a cell entered is paid for at its weight.

    Raises
    ------
    OverflowError : costs beyond what is exact.
    """
    height, width = free.shape
    inside = (slice(_EDGE, -_EDGE), slice(_EDGE, -_EDGE))
    framed = np.pad(free, _EDGE)
    weight = np.pad(np.ones(free.shape, np.int64) if terrain is None else PLAIN + terrain.astype(np.int64), 2)
    line = width + 2 * _EDGE
    at = np.arange(framed.size).reshape(framed.shape)[inside].ravel()
    flat, weights = framed.ravel(), weight.ravel()
    prices = (Q, P, 0) if name == "octile" else TENTHS[name]
    # Backwards: from the cell that a step enters to the one it leaves.
    table = list(rules(name, wide).items())
    legal = np.empty((at.size, len(table)), dtype=np.bool_)
    entered = np.empty((at.size, len(table)), dtype=np.float64)
    for k, ((dx, dy), (kind, through)) in enumerate(table):
        left = at - (dy * line + dx)
        here = flat[at] & flat[left]
        for a, b in through:
            here &= flat[left + (b * line + a)]
        legal[:, k] = here
        entered[:, k] = prices[kind] * weights[at]
    back = np.array([-(dy * width + dx) for (dx, dy), _ in table])
    # int32: SciPy before 1.14 takes no others here.
    other = (np.arange(at.size)[:, None] + back)[legal].astype(np.int32)
    pointers = np.concatenate(([0], np.cumsum(legal.sum(axis=1)))).astype(np.int32)
    graph = csr_array((entered[legal], other, pointers), shape=(at.size, at.size))
    found = dijkstra(graph, directed=True, indices=[y * width + x for x, y in goals])
    reached = np.isfinite(found)
    if found[reached].max() >= _EXACT:
        raise OverflowError(f"a way costs {found[reached].max()}")
    costs: NDArray[np.int64] = np.where(reached, found, -1).astype(np.int64)
    return costs.reshape(len(goals), height, width)


def parts_of(costs: NDArray[np.int64], name: str) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The (a, b) of each cost as :func:`lampyris_selfcheck.reference.paths.search.cost_of` writes them."""
    if name != "octile":
        return costs, np.zeros_like(costs)
    m = (costs % Q) * _INVERSE_P % Q
    n = (costs - m * P) // Q
    if (n[costs >= 0] < 0).any():
        raise OverflowError("more diagonals than can be told apart")
    return n, m


def cost_at(costs: NDArray[np.int64], cell: Cell, name: str) -> Cost | None:
    """A cell's cost in these parts; None: no way."""
    one = costs[cell[1] : cell[1] + 1, cell[0] : cell[0] + 1]
    if one[0, 0] < 0:
        return None
    n, m = parts_of(one, name)
    return int(n[0, 0]), int(m[0, 0])
