"""Earliest arrival by a plain breadth-first search over cells and ticks, with footprints cell by cell.

Shares no code with the planners: bodies are functions of time, covers are sets.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

Cell = tuple[int, int]
Body = tuple[Callable[[int], Cell], Sequence[Cell]]
"""Where it is at a tick, and its footprint."""

EIGHT = [(dx, dy) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy]
FOUR = [(1, 0), (-1, 0), (0, 1), (0, -1)]


def cover(cell: Cell, footprint: Sequence[Cell]) -> set[Cell]:
    return {(cell[0] + dx, cell[1] + dy) for dx, dy in footprint}


def clash(a0: Cell, a1: Cell, own: Sequence[Cell], body: Body, tick: int) -> str:
    """What goes wrong when one goes from a0 to a1 while the body makes its step that ends at ``tick``."""
    place, shape = body
    b0, b1 = place(tick - 1), place(tick)
    old, new = cover(a0, own), cover(a1, own)
    was, now = cover(b0, shape), cover(b1, shape)
    if new & now:
        return "together"
    if new & was and old & now:
        return "swap"
    da = (a1[0] - a0[0], a1[1] - a0[1])
    db = (b1[0] - b0[0], b1[1] - b0[1])
    if da[0] and da[1] and db[0] and db[1] and da != db and da != (-db[0], -db[1]):
        for x, y in old:
            for u, v in was:
                # Two diagonals of one block meet in its middle.
                if (2 * x + da[0], 2 * y + da[1]) == (2 * u + db[0], 2 * v + db[1]):
                    return "cross"
    return ""


def legal(free: Sequence[Sequence[bool]], a: Cell, b: Cell, cutting: bool) -> bool:
    """Whether walls allow the step."""
    height, width = len(free), len(free[0])
    if not (0 <= b[0] < width and 0 <= b[1] < height) or not free[b[1]][b[0]]:
        return False
    if a[0] != b[0] and a[1] != b[1] and not cutting:
        return free[a[1]][b[0]] and free[b[1]][a[0]]
    return True


def earliest(
    free: Sequence[Sequence[bool]],
    steps: Sequence[Cell],
    cutting: bool,
    start: Cell,
    goal: Cell,
    bodies: Sequence[Body],
    *,
    own: Sequence[Cell] = ((0, 0),),
    tick: int = 0,
    until: int = 200,
) -> int | None:
    """The first tick at which the robot can be on the goal; None if not by ``until``."""
    here = {start}
    if start == goal:
        return tick
    while here and tick < until:
        tick += 1
        there = set()
        for a in here:
            for dx, dy in [(0, 0), *steps]:
                b = (a[0] + dx, a[1] + dy)
                if b in there or not (b == a or legal(free, a, b, cutting)):
                    continue
                if not any(clash(a, b, own, body, tick) for body in bodies):
                    there.add(b)
        if goal in there:
            return tick
        here = there
    return None
