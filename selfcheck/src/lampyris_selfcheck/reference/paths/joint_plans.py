"""Least sums of costs of fleets, by time-expanded search: which costs, robot by robot, can be had together.

All ways to share out a total are tried, the least total first. Whether the robots can arrive at these ticks is seen layer
by layer: the set of all places of all robots at a tick, and what the next tick makes of it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from itertools import product

Cell = tuple[int, int]


def least_sum_of_costs(
    blocked: Sequence[Sequence[bool]],
    starts: Sequence[Cell],
    goals: Sequence[Cell],
    most: int,
    *,
    octile: bool = False,
) -> int | None:
    """The least sum of the ticks at which each robot comes to its goal for good.

    Parameters
    ----------
    blocked : rows of the map.
    starts, goals : cells (x, y).
    most : how much more than the sum of the shortest paths is tried.
    octile : whether robots also step diagonally, past free cells only, and two not across each other.

    None : more is needed, or there is no plan.
    """
    steps = [(i, j) for i in (0, 1, -1) for j in (0, 1, -1) if octile or not (i and j)]
    near = {
        (x, y): [
            (x + i, y + j)
            for i, j in steps
            if 0 <= y + j < len(blocked)
            and 0 <= x + i < len(blocked[0])
            and not (blocked[y + j][x + i] or blocked[y][x + i] or blocked[y + j][x])
        ]
        for y, row in enumerate(blocked)
        for x, wall in enumerate(row)
        if not wall
    }
    far = [_distances(near, goal) for goal in goals]
    alone = [table.get(start) for table, start in zip(far, starts, strict=True)]
    if None in alone:
        return None
    for extra in range(most + 1):
        for shares in _shares(extra, len(goals)):
            ends = [(a or 0) + more for a, more in zip(alone, shares, strict=True)]
            if _is_possible(near, far, tuple(starts), ends):
                return sum(ends)
    return None


def _distances(near: dict[Cell, list[Cell]], goal: Cell) -> dict[Cell, int]:
    found = {goal: 0}
    queue = deque([goal])
    while queue:
        cell = queue.popleft()
        for other in near[cell]:
            if other not in found:
                found[other] = found[cell] + 1
                queue.append(other)
    return found


def _shares(total: int, parts: int) -> Iterator[tuple[int, ...]]:
    if parts == 1:
        yield (total,)
        return
    for first in range(total + 1):
        for rest in _shares(total - first, parts - 1):
            yield (first, *rest)


def _is_diagonal(a: Cell, b: Cell) -> bool:
    return a[0] != b[0] and a[1] != b[1]


def _middle(a: Cell, b: Cell) -> Cell:
    return a[0] + b[0], a[1] + b[1]


def _is_possible(
    near: dict[Cell, list[Cell]], far: list[dict[Cell, int]], starts: tuple[Cell, ...], ends: list[int]
) -> bool:
    """Whether all can be on their goals from these ticks on."""
    layer = {starts}
    for tick in range(1, max(ends) + 1):
        following = set()
        for old in layer:
            choices = [
                [cell for cell in near[at] if cell in table and table[cell] <= max(0, end - tick)]
                for at, table, end in zip(old, far, ends, strict=True)
            ]
            for new in product(*choices):
                apart = len(set(new)) == len(new)
                if apart and not any(
                    (new[i] == old[j] and new[j] == old[i])
                    or (_is_diagonal(old[i], new[i]) and _middle(old[i], new[i]) == _middle(old[j], new[j]))
                    for i in range(len(new))
                    for j in range(i)
                ):
                    following.add(new)
        layer = following
        if not layer:
            return False
    return True
