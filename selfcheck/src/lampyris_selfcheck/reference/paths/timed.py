"""Earliest arrival by a plain breadth-first search over cells and ticks, with footprints cell by cell.

Shares no code with the planners: bodies are functions of time, covers are sets.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction

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


def arrivals(
    free: Sequence[Sequence[bool]],
    steps: Sequence[Cell],
    cutting: bool,
    start: Cell,
    bodies: Sequence[Body],
    *,
    own: Sequence[Cell] = ((0, 0),),
    tick: int = 0,
    period: int = 1,
    settled: int = 0,
    goal: Cell | None = None,
) -> dict[Cell, int]:
    """The first tick at which the robot can be on each cell; cells it can never be on are left out.

    Ends when the same cells can be held at the same place of the bodies' common ``period``, which they keep
    from the tick ``settled`` on: from there nothing new comes. With ``goal`` it ends there, too.
    """
    first = {start: tick}
    ways = {a: [b for b in _next(a, steps) if b == a or legal(free, a, b, cutting)] for a in _free(free)}
    far = 2 + max(abs(x) for _, shape in bodies for cell in (*shape, *own) for x in cell) if bodies else 0
    far *= 2
    here, known = frozenset([start]), set()
    while here and (goal is None or goal not in first):
        if tick >= settled:
            state = (here, (tick - settled) % period)
            if state in known:
                break
            known.add(state)
        tick += 1
        places = [(body, body[0](tick - 1)) for body in bodies]
        there = set()
        for a in here:
            near = [b for b, (x, y) in places if abs(a[0] - x) <= far and abs(a[1] - y) <= far]
            for b in ways[a]:
                if b not in there and not any(clash(a, b, own, body, tick) for body in near):
                    there.add(b)
        for b in there - first.keys():
            first[b] = tick
        here = frozenset(there)
    return first


def _next(a: Cell, steps: Sequence[Cell]) -> list[Cell]:
    return [(a[0] + dx, a[1] + dy) for dx, dy in [(0, 0), *steps]]


def _free(free: Sequence[Sequence[bool]]) -> list[Cell]:
    return [(x, y) for y, row in enumerate(free) for x, here in enumerate(row) if here]


def nearest2(a0: Cell, a1: Cell, b0: Cell, b1: Cell) -> Fraction:
    """Square of the least distance of two points that go straight and evenly, in one tick; exact."""
    px, py = a0[0] - b0[0], a0[1] - b0[1]
    vx, vy = a1[0] - b1[0] - px, a1[1] - b1[1] - py
    fast = vx * vx + vy * vy
    if not fast:
        return Fraction(px * px + py * py)
    when = min(max(Fraction(-(px * vx + py * vy), fast), Fraction(0)), Fraction(1))
    return (px + when * vx) ** 2 + (py + when * vy) ** 2
