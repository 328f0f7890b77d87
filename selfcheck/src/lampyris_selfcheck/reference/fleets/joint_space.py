"""Small fleets in the space of all robots' cells: whether there is a plan, and the least costs of one."""

from __future__ import annotations

import heapq
from collections.abc import Sequence
from itertools import product

from lampyris_selfcheck.reference.fleets.fleet_rules import Cell, Rows, cross, neighbours

Joint = tuple[Cell, ...]


def _steps(blocked: Rows, cells: Joint, still: Sequence[bool] = (), *, octile: bool = False) -> list[Joint]:
    """What a tick can lead to without a conflict; robots that are ``still`` do not move."""
    ways = [
        [cell] if still and still[k] else [cell, *neighbours(blocked, cell, octile=octile)]
        for k, cell in enumerate(cells)
    ]
    pairs = [(i, j) for i in range(len(cells)) for j in range(i)]
    return [
        new
        for new in product(*ways)
        if len(set(new)) == len(new)
        and not any(new[i] == cells[j] and new[j] == cells[i] for i, j in pairs)
        and not (octile and any(cross(cells[i], new[i], cells[j], new[j]) for i, j in pairs))
    ]


def is_solvable(
    blocked: Rows, starts: Sequence[Cell], goals: Sequence[Cell], *, octile: bool = False
) -> bool:
    """Whether the robots can reach their goals, by a search over all configurations."""
    first, last = tuple(starts), tuple(goals)
    seen, front = {first}, [first]
    while front and last not in seen:
        fresh = {new for cells in front for new in _steps(blocked, cells, octile=octile)} - seen
        seen |= fresh
        front = list(fresh)
    return last in seen


def least_sum_of_costs(
    blocked: Rows, starts: Sequence[Cell], goals: Sequence[Cell], *, octile: bool = False
) -> int | None:
    """The least sum of the ticks from which each robot stays at its goal; None: there is no plan.

    Dijkstra over cells and which robots have stopped: one that is on its goal may stop for good at any tick, and
    costs nothing from then on.
    """
    n = len(goals)
    first = (tuple(starts), (False,) * n)
    best, queue = {first: 0}, [(0, first)]
    while queue:
        cost, state = heapq.heappop(queue)
        if cost > best[state]:
            continue
        cells, still = state
        if all(still):
            return cost
        following = [
            (cost, (cells, (*still[:k], True, *still[k + 1 :])))
            for k in range(n)
            if cells[k] == goals[k] and not still[k]
        ]
        paid = cost + n - sum(still)
        following += [(paid, (new, still)) for new in _steps(blocked, cells, still, octile=octile)]
        for price, then in following:
            if price < best.get(then, price + 1):
                best[then] = price
                heapq.heappush(queue, (price, then))
    return None


def least_sum_of_loss(
    blocked: Rows, starts: Sequence[Cell], goals: Sequence[Cell], *, octile: bool = False
) -> int | None:
    """The least number of robots and ticks in which a robot is not on its goal before and after; None: no plan."""
    first, last = tuple(starts), tuple(goals)
    best, queue = {first: 0}, [(0, first)]
    while queue:
        cost, cells = heapq.heappop(queue)
        if cost > best[cells]:
            continue
        if cells == last:
            return cost
        for new in _steps(blocked, cells, octile=octile):
            price = cost + sum(not u == v == w for u, v, w in zip(cells, new, last, strict=True))
            if price < best.get(new, price + 1):
                best[new] = price
                heapq.heappush(queue, (price, new))
    return None
