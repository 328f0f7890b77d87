"""Every case there is of one or two patrols on a small map, in a fixed order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import product

from lampyris_selfcheck.reference.paths.timed import Cell

Free = tuple[tuple[bool, ...], ...]
Patrol = tuple[Cell, Cell]
Question = tuple[Free, Cell, Cell, tuple[Patrol, ...]]
"""Free cells row by row, start, goal, and the two cells of each patrol: on the first at tick 0."""

ONE: tuple[Cell, ...] = ((0, 0),)


def place(track: Sequence[Cell], period: int) -> Callable[[int], Cell]:
    """Where an obstacle is at a tick: on its track, then on its last ``period`` cells again and again."""
    n = len(track)
    return lambda t: track[t] if t < n else track[n - period + (t - n) % period]


@lru_cache(maxsize=4)
def questions(width: int, height: int, patrols: int) -> tuple[Question, ...]:
    """Every free space, start, another cell as goal, and patrols: none begins on the start, nor two on one
    cell.
    """
    out: list[Question] = []
    for bits in range(1 << (width * height)):
        free = tuple(tuple(bool(bits >> (y * width + x) & 1) for x in range(width)) for y in range(height))
        cells = [(x, y) for y, x in product(range(height), range(width)) if free[y][x]]
        for start in cells:
            ways = [
                ((ax, ay), (bx, by))
                for (ax, ay), (bx, by) in product(cells, cells)
                if (ax, ay) != start and max(abs(ax - bx), abs(ay - by)) <= 1
            ]
            sets: list[tuple[Patrol, ...]] = [(p,) for p in ways]
            if patrols == 2:
                sets = [(p, q) for p, q in product(ways, ways) if p[0] != q[0]]
            out += [(free, start, goal, some) for goal in cells if goal != start for some in sets]
    return tuple(out)


def first_of_group(cases: Sequence[Question], number: int) -> int:
    """The first of the cases that share map, start and goal with one."""
    while number and cases[number - 1][:3] == cases[number][:3]:
        number -= 1
    return number
