"""A slow, plain field: Dijkstra with a heap and exact surds, as one would write it from the definition alone.

Shares nothing with lampyris but the names of the four step sets. A cost is ``n + m sqrt 2`` with fractions
n and m, compared exactly.
"""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, total_ordering

EIGHT = [(-1, -1), (1, -1), (-1, 1), (1, 1), (-1, 0), (1, 0), (0, -1), (0, 1)]
KNIGHT = [(-2, -1), (2, -1), (-2, 1), (2, 1), (-1, -2), (1, -2), (-1, 2), (1, 2)]
OFFSETS = {
    "dissertation": EIGHT,
    "octile": EIGHT,
    "four-connected": EIGHT[4:],
    "sixteen-connected": KNIGHT + EIGHT,
}


@total_ordering
@dataclass(frozen=True)
class Surd:
    """n + m sqrt 2."""

    n: Fraction
    m: Fraction

    def __add__(self, other: Surd) -> Surd:
        return Surd(self.n + other.n, self.m + other.m)

    def __lt__(self, other: Surd) -> bool:
        n, m = self.n - other.n, self.m - other.m
        if n <= 0 and m <= 0:
            return n < 0 or m < 0
        if n >= 0 and m >= 0:
            return False
        # Signs differ: compare n^2 with 2 m^2.
        return n * n > 2 * m * m if n < 0 else n * n < 2 * m * m

    def __float__(self) -> float:
        return float(self.n) + float(self.m) * 2.0**0.5


def surd(n: Fraction | int | str, m: Fraction | int = 0) -> Surd:
    return Surd(Fraction(n), Fraction(m))


COSTS = {
    "dissertation": {0: surd(1), 1: surd("7/5")},
    "octile": {0: surd(1), 1: surd(0, 1)},
    "four-connected": {0: surd(1)},
    "sixteen-connected": {0: surd(1), 1: surd("7/5"), 2: surd("11/5")},
}


def free_at(free, x, y):
    return 0 <= y < len(free) and 0 <= x < len(free[0]) and bool(free[y][x])


def touched(dx, dy):
    """Cells that the open segment from (0, 0) to (dx, dy) passes through, by sampling it finely."""
    cells = set()
    for k in range(1, 1000):
        t = Fraction(k, 1000)
        x, y = t * dx, t * dy
        half = Fraction(1, 2)
        if (x + half).denominator == 1 or (y + half).denominator == 1:
            continue  # on a border: its two sides are found by the samples before and after
        cells.add((int((x + half) // 1), int((y + half) // 1)))
    return cells - {(0, 0), (dx, dy)}


@cache
def must_be_free(dx, dy):
    """The same in order, once for each step: sampling takes longer than importing this module."""
    return sorted(touched(dx, dy))


def legal(name, free, x, y, dx, dy):
    """Whether a robot at the free cell (x, y) may step by (dx, dy)."""
    if not free_at(free, x + dx, y + dy):
        return False
    if abs(dx * dy) == 2:
        return all(free_at(free, x + a, y + b) for a, b in must_be_free(dx, dy))
    if abs(dx * dy) == 1 and name != "dissertation":
        return free_at(free, x + dx, y) and free_at(free, x, y + dy)
    return True


def field(free, name, goal, corners=None):
    """Cost (Surd) and parent offset index (-1 at the goal) of every reachable cell, by cell.

    ``corners`` overrides the corner rule: ``cut`` or ``guard``.
    """
    rule = {None: name, "cut": "dissertation", "guard": "octile"}[corners]
    price = COSTS[name]
    cost = {}
    if not free_at(free, *goal):
        return cost, {}
    best = {goal: surd(0)}
    heap = [(best[goal], goal)]
    while heap:
        d, (x, y) = heapq.heappop(heap)
        if (x, y) in cost:
            continue
        cost[x, y] = d
        for dx, dy in OFFSETS[name]:
            n = (x + dx, y + dy)
            if n in cost or not legal(rule, free, x, y, dx, dy):
                continue
            c = d + price[abs(dx * dy)]
            if n not in best or c < best[n]:
                best[n] = c
                heapq.heappush(heap, (c, n))
    parent = {goal: -1}
    for (x, y), d in cost.items():
        if (x, y) == goal:
            continue
        for k, (dx, dy) in enumerate(OFFSETS[name]):
            p = (x + dx, y + dy)
            if p in cost and legal(rule, free, x, y, dx, dy) and cost[p] + price[abs(dx * dy)] == d:
                parent[x, y] = k
                break
    return cost, parent


def luciferin(cost, parent, name, rho, gamma):
    """Luciferin by its definition, in the order of cost."""
    luc = {}
    for cell in sorted(cost, key=lambda c: cost[c]):
        k = parent[cell]
        if k < 0:
            luc[cell] = 0.0
        else:
            dx, dy = OFFSETS[name][k]
            luc[cell] = (1 - rho) * luc[cell[0] + dx, cell[1] + dy] + gamma * float(cost[cell])
    return luc


def clearance2(blocked):
    """Squared distance from each centre to the nearest blocked square in half cells; None: no wall."""
    walls = [(x, y) for y, row in enumerate(blocked) for x, b in enumerate(row) if b]
    return [
        [
            min(
                (max(2 * abs(x - u) - 1, 0) ** 2 + max(2 * abs(y - v) - 1, 0) ** 2 for u, v in walls),
                default=None,
            )
            for x in range(len(blocked[0]))
        ]
        for y in range(len(blocked))
    ]


def gates(blocked, width_limit=None):
    """Gates by their definition: {cell: (axis, cells)}. ``width_limit``: runs narrower than this."""
    h, w = len(blocked), len(blocked[0])
    out = {}
    for y in range(h):
        for x in range(w):
            if blocked[y][x]:
                continue
            found = []
            for axis, dx, dy in (("x", 1, 0), ("y", 0, 1)):
                a = b = 0
                while (
                    x - (a + 1) * dx >= 0
                    and y - (a + 1) * dy >= 0
                    and not blocked[y - (a + 1) * dy][x - (a + 1) * dx]
                ):
                    a += 1
                    if (x - a * dx == 0 and dx) or (y - a * dy == 0 and dy):
                        break
                while (
                    x + (b + 1) * dx < w
                    and y + (b + 1) * dy < h
                    and not blocked[y + (b + 1) * dy][x + (b + 1) * dx]
                ):
                    b += 1
                low = (x - (a + 1) * dx, y - (a + 1) * dy)
                high = (x + (b + 1) * dx, y + (b + 1) * dy)
                walled = low[0] >= 0 and low[1] >= 0 and high[0] < w and high[1] < h
                size = a + b + 1
                if walled and (size == 1 if width_limit is None else size < width_limit):
                    found.append((axis, size))
            if found:
                out[x, y] = ("".join(f[0] for f in found), min(f[1] for f in found))
    return out


def dead_ends(blocked, found, strict):
    """Gates that lead nowhere: sweep over all of them until nothing changes."""
    free = [[not b for b in row] for row in blocked]
    dead = set()

    def leads(x, y, ahead, across):
        """Whether (x, y) can be left towards ``ahead``."""
        for s in (-1, 0, 1):
            n = (x + ahead[0] + s * across[0], y + ahead[1] + s * across[1])
            if not free_at(free, *n) or n in dead:
                continue
            corners = [(x + ahead[0], y + ahead[1]), (x + s * across[0], y + s * across[1])]
            if s == 0 or not strict or all(free_at(free, *c) for c in corners):
                return True
        return False

    while True:
        more = set()
        for (x, y), (axis, _) in found.items():
            up_and_down = leads(x, y, (0, -1), (1, 0)) and leads(x, y, (0, 1), (1, 0))
            left_and_right = leads(x, y, (-1, 0), (0, 1)) and leads(x, y, (1, 0), (0, 1))
            if (x, y) not in dead and not (("x" in axis and up_and_down) or ("y" in axis and left_and_right)):
                more.add((x, y))
        if not more:
            return dead
        dead |= more
