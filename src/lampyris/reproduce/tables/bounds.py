"""Bounds that hold on every map: what a printed length, sum or number of iterations cannot be.

Steps cost 1 and 1.4 between neighbouring cells, so everything is counted in tenths.
"""

from __future__ import annotations

from lampyris.typing import Cell

STRAIGHT, DIAGONAL = 10, 14


def apart(start: Cell, goal: Cell) -> tuple[int, int]:
    """Columns and rows between two cells."""
    return abs(start[0] - goal[0]), abs(start[1] - goal[1])


def octile(start: Cell, goal: Cell) -> int:
    """Tenths of the shortest path on an empty map: no path on any map costs less."""
    dx, dy = apart(start, goal)
    return DIAGONAL * min(dx, dy) + STRAIGHT * abs(dx - dy)


def fewest(start: Cell, goal: Cell, reach: int) -> int:
    """Iterations that are needed at least, each of them ``reach`` cells at most."""
    return -(-max(apart(start, goal)) // reach)


def tenths(printed: str) -> int | None:
    """A printed number in tenths; None if it has more than one digit after the point."""
    value = round(float(printed) * 1000)
    return value // 100 if value % 100 == 0 else None


def mixes(start: Cell, goal: Cell, cost: int) -> list[tuple[int, int]]:
    """Every number of straights and of diagonals that costs so much and can lead from start to goal.

    Of ``a`` straights some are along x and some along y, of ``b`` diagonals each is one column and one row
    either way: a mix leads there if with some split the columns, and the rows, are neither too few nor of
    the wrong parity.
    """
    dx, dy = apart(start, goal)
    out = []
    for b in range(cost // DIAGONAL + 1):
        a, rest = divmod(cost - DIAGONAL * b, STRAIGHT)
        if rest == 0 and any(_leads(dx, along + b) and _leads(dy, a - along + b) for along in range(a + 1)):
            out.append((a, b))
    return out


def _leads(away: int, steps: int) -> bool:
    return steps >= away and (steps - away) % 2 == 0


def why_not(start: Cell, goal: Cell, cost: int) -> str:
    """Why no path between these cells costs so much, on any map; empty if one may."""
    least = octile(start, goal)
    if cost < least:
        return f"below {least / 10:g}, the shortest path between these cells on an empty map"
    if not mixes(start, goal, cost):
        return "no straights (1) and diagonals (1.4) that lead from the one cell to the other cost it"
    return ""


def sum_range(start: Cell, goal: Cell, iterations: int, reach: int) -> tuple[int, int]:
    """Least and greatest sum of cost-to-go over the cells where iterations begin and end, in tenths.

    ``k`` iterations before the end, what is still driven costs 1.4 a cell at most, and cost-to-go is not more
    than that; ``k`` iterations after the start it is not less than the octile distance less what was driven.
    A last move that is not counted (see Table 4.11) is allowed for: one iteration more at the upper end.
    """
    step = DIAGONAL * reach
    far = octile(start, goal)
    least = sum(max(far - step * k, 0) for k in range(iterations + 1))
    most = sum(step * k for k in range(iterations + 2))
    return least, most
