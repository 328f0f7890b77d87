"""The least cost between two states of a lattice, by the plainest search over its primitives."""

from __future__ import annotations

import heapq
from collections.abc import Callable, Iterable, Mapping, Sequence

State = tuple[int, int, int]
"""Column, row and heading."""
Motion = tuple[int, int, int, int, tuple[tuple[int, int], ...]]
"""Change of column and row, heading at the end, cost, and the cells swept, from those of the first cell."""


def least_costs(
    walls: Sequence[Sequence[bool]],
    motions: Mapping[int, Sequence[Motion]],
    starts: Iterable[State],
    more: Callable[[int, int, int, int], int] = lambda x, y, heading, place: 0,
    begun: Mapping[State, int] | None = None,
) -> dict[State, int]:
    """The least cost of every state that can be reached; cells off the map are no walls, but no base stands there.

    Parameters
    ----------
    walls : rows of cells.
    motions : of each heading.
    starts : states with cost 0.
    more : what a motion costs besides, by the cell and heading that it begins at and its place among their motions.
    begun : states with the cost at which the search begins there, besides ``starts``.
    """
    height, width = len(walls), len(walls[0])
    best = {**(begun or {}), **dict.fromkeys(starts, 0)}
    heap = [(cost, state) for state, cost in best.items()]
    heapq.heapify(heap)
    done: set[State] = set()
    while heap:
        cost, state = heapq.heappop(heap)
        if state in done:
            continue
        done.add(state)
        x, y, heading = state
        for place, (dx, dy, turned, length, swept) in enumerate(motions[heading]):
            price = length + more(x, y, heading, place)
            to = (x + dx, y + dy, turned)
            if not (0 <= to[0] < width and 0 <= to[1] < height):
                continue
            if cost + price >= best.get(to, cost + price + 1):
                continue
            if all(is_free(walls, x + a, y + b) for a, b in swept):
                best[to] = cost + price
                heapq.heappush(heap, (cost + price, to))
    return best


def is_free(walls: Sequence[Sequence[bool]], x: int, y: int) -> bool:
    """Whether a cell is no wall."""
    return not (0 <= y < len(walls) and 0 <= x < len(walls[0]) and walls[y][x])
