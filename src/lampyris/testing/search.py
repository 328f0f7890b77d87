"""The cost of a cheapest path by a plain search that shares no code with any planner."""

from __future__ import annotations

import heapq

import numpy as np

from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.moves import Moves
from lampyris.typing import BoolGrid, ByteGrid, Cell


def cheapest(
    free: BoolGrid, moves: Moves, start: Cell, goal: Cell, terrain: ByteGrid | None = None
) -> int | None:
    """Exact cost of a cheapest path between two free cells, by a plain heap search; None if there is none.

    Over terrain (with weighed moves) each step costs its length times the weight of the cell entered.
    """
    height, width = free.shape

    def is_free(x: int, y: int) -> bool:
        return 0 <= x < width and 0 <= y < height and bool(free[y, x])

    best = {start: 0}
    heap = [(0, start)]
    while heap:
        spent, (x, y) = heapq.heappop(heap)
        if (x, y) == goal:
            return spent
        if spent > best[x, y]:
            continue
        for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True):
            there = (x + dx, y + dy)
            if not is_free(*there):
                continue
            weight = moves.scale if terrain is None else TERRAIN_UNIT + int(terrain[there[1], there[0]])
            reached = spent + cost // moves.scale * weight
            if reached >= best.get(there, reached + 1):
                continue
            if all(is_free(x + a, y + b) for a, b in _between(dx, dy, moves.corner_cutting)):
                best[there] = reached
                heapq.heappush(heap, (reached, there))
    return None


def _between(dx: int, dy: int, corner_cutting: bool) -> list[Cell]:
    """Cells that a step needs free besides its end (see Moves)."""
    sx, sy = int(np.sign(dx)), int(np.sign(dy))
    if abs(dx) == abs(dy) == 1:
        return [] if corner_cutting else [(dx, 0), (0, dy)]
    if abs(dx * dy) == 2:
        return [(sx, sy), (sx, 0) if abs(dx) == 2 else (0, sy)]
    return []
