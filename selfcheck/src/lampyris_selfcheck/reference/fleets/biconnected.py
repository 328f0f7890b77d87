"""Maps in which neighbouring free cells always lie on a common cycle."""

from __future__ import annotations

from lampyris_selfcheck.reference.fleets.fleet_rules import Cell, Rows, neighbours


def is_biconnected(blocked: Rows) -> bool:
    """Whether the free cells are connected, three or more, and stay connected without any one of them.

    Depth-first search with the earliest ancestor that a subtree reaches (Hopcroft, Tarjan 1973).
    """
    free = [(x, y) for y, row in enumerate(blocked) for x, wall in enumerate(row) if not wall]
    if len(free) < 3:
        return False
    root = free[0]
    order: dict[Cell, int] = {root: 0}
    low: dict[Cell, int] = {root: 0}
    stack = [(root, root, iter(neighbours(blocked, root)))]
    branches = 0
    while stack:
        cell, parent, rest = stack[-1]
        other = next(rest, None)
        if other is None:
            stack.pop()
            if cell == root:
                continue
            low[parent] = min(low[parent], low[cell])
            if parent != root and low[cell] >= order[parent]:
                return False
        elif other not in order:
            branches += cell == root
            order[other] = low[other] = len(order)
            stack.append((other, cell, iter(neighbours(blocked, other))))
        elif other != parent:
            low[cell] = min(low[cell], order[other])
    return len(order) == len(free) and branches == 1
