"""A slow, plain field over terrain: Dijkstra with a heap and exact fractions, from the definition alone.

A cost is ``n + m sqrt 2`` with n and m whole 63rds; shares the sign test of :mod:`.field` and its legal
steps, and nothing with lampyris.
"""

from __future__ import annotations

import heapq
from fractions import Fraction

from lampyris_selfcheck.reference.paths.field import COSTS, OFFSETS, Surd, legal, surd


def weighs(terrain, cell):
    """What entering the cell costs, in plain cells."""
    return Fraction(63 + int(terrain[cell[1]][cell[0]]), 63)


def times(cost, factor):
    return Surd(cost.n * factor, cost.m * factor)


def field(free, terrain, name, goal, rule=None):
    """Cost (Surd) and parent offset index (-1 at the goal) of every cell that reaches the goal, by cell."""
    if not free[goal[1]][goal[0]]:
        return {}, {}
    price = COSTS[name]
    rule = {None: name, "cut": "dissertation", "guard": "octile"}[rule]
    cost = {}
    best = {goal: surd(0)}
    heap = [(best[goal], goal)]
    while heap:
        d, (x, y) = heapq.heappop(heap)
        if (x, y) in cost:
            continue
        cost[x, y] = d
        for dx, dy in OFFSETS[name]:
            before = (x - dx, y - dy)
            if not 0 <= before[0] < len(free[0]) or not 0 <= before[1] < len(free):
                continue
            if not free[before[1]][before[0]] or not legal(rule, free, *before, dx, dy):
                continue
            c = d + times(price[abs(dx * dy)], weighs(terrain, (x, y)))
            if before not in best or c < best[before]:
                best[before] = c
                heapq.heappush(heap, (c, before))
    parent = {}
    for (x, y), d in cost.items():
        parent[x, y] = -1
        for k, (dx, dy) in enumerate(OFFSETS[name]):
            n = (x + dx, y + dy)
            if (x, y) == goal or n not in cost or not legal(rule, free, x, y, dx, dy):
                continue
            if cost[n] + times(price[abs(dx * dy)], weighs(terrain, n)) == d:
                parent[x, y] = k
                break
    return cost, parent
