"""The rules of a plan for several robots, from their definitions: one robot, one pair and one tick at a time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import combinations, pairwise

Cell = tuple[int, int]
Rows = Sequence[Sequence[bool]]


def neighbours(blocked: Rows, cell: Cell, *, octile: bool = False) -> list[Cell]:
    """The free cells that a step leads to; with octile moves also diagonally, between two free cells."""
    x, y = cell

    def free(u: int, v: int) -> bool:
        return 0 <= v < len(blocked) and 0 <= u < len(blocked[0]) and not blocked[v][u]

    found = [(u, v) for u, v in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)) if free(u, v)]
    if octile:
        diagonal = ((x + 1, y + 1), (x - 1, y + 1), (x + 1, y - 1), (x - 1, y - 1))
        found += [(u, v) for u, v in diagonal if free(u, v) and free(u, y) and free(x, v)]
    return found


def cross(a: Cell, b: Cell, c: Cell, d: Cell) -> bool:
    """Whether the diagonal steps from ``a`` to ``b`` and from ``c`` to ``d`` meet in the middle, and share no cell."""
    middle = (a[0] + b[0], a[1] + b[1])
    return middle == (c[0] + d[0], c[1] + d[1]) and len({a, b, c, d}) == 4


def distances(blocked: Rows, goal: Cell, *, octile: bool = False) -> dict[Cell, int]:
    """Steps to a cell from all cells that are connected with it, by breadth-first search."""
    found, queue = {goal: 0}, deque([goal])
    while queue:
        cell = queue.popleft()
        for other in neighbours(blocked, cell, octile=octile):
            if other not in found:
                found[other] = found[cell] + 1
                queue.append(other)
    return found


def broken(
    blocked: Rows,
    starts: Sequence[Cell],
    goals: Sequence[Cell],
    paths: Sequence[Sequence[Cell]],
    *,
    whole: bool = True,
    octile: bool = False,
) -> set[str]:
    """The names of all rules that paths break; a robot stays at the end of its path.

    Parameters
    ----------
    blocked : rows of the map.
    starts, goals : cells (x, y).
    paths : one for each robot, a cell for each tick.
    whole : whether the paths have to end at the goals, at the tick of the arrival.
    octile : whether diagonal steps are allowed, where both cells beside them are free.
    """
    if len(paths) != len(starts):
        return {"paths"}
    found = set()
    for path, start, goal in zip(paths, starts, goals, strict=True):
        if path[0] != start:
            found.add("start")
        for x, y in path:
            if not (0 <= y < len(blocked) and 0 <= x < len(blocked[0])):
                found.add("outside")
            elif blocked[y][x]:
                found.add("wall")
        for (x, y), (u, v) in pairwise(path):
            if max(abs(x - u), abs(y - v)) > 1 or (not octile and x != u and y != v):
                found.add("step")
            elif x != u and y != v and any(_is_wall(blocked, *cell) for cell in ((x, v), (u, y))):
                found.add("wall")
        if whole and path[-1] != goal:
            found.add("goal")
        if whole and len(path) > 1 and path[-1] == path[-2]:
            found.add("arrival")
    last = max(len(path) for path in paths)
    for one, other in combinations([[*path, *[path[-1]] * (last - len(path))] for path in paths], 2):
        for t in range(last):
            if one[t] == other[t]:
                found.add("vertex")
            if t and one[t] == other[t - 1] and one[t - 1] == other[t] and one[t] != one[t - 1]:
                found.add("swap")
            if octile and t and cross(one[t - 1], one[t], other[t - 1], other[t]):
                found.add("crossing")
    return found


def _is_wall(blocked: Rows, x: int, y: int) -> bool:
    return 0 <= y < len(blocked) and 0 <= x < len(blocked[0]) and blocked[y][x]
