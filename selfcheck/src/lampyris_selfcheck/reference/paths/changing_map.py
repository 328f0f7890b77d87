"""A map that changes, in plain lists, and its costs by Dijkstra with a heap: a judge of incremental planners.

Shares nothing with lampyris but the names of the step sets and of a Change's fields. A cost is counted, not
summed: straights, diagonals and knight's steps, each weighed in 63rds by the cell it enters. For octile moves
two counts are compared by ``n + m sqrt 2`` with thirteen digits, which is exact here: different counts of
less than ten million differ by more than 1e-8.
"""

from __future__ import annotations

import heapq

Cell = tuple[int, int]
Counts = tuple[int, int, int]

UNIT = 63
PRICES = {
    "dissertation": (10, 14, 0),
    "octile": (10**13, 14142135623731, 0),
    "four-connected": (1, 0, 0),
    "sixteen-connected": (10, 14, 22),
}


def steps_of(name: str, wide: bool) -> list[tuple[int, int, int, list[Cell]]]:
    """Every step: dx, dy, kind (0 straight, 1 diagonal, 2 knight's), and which cells besides its end have to
    be free. A wide robot makes no knight's steps and cuts no corners.
    """
    out: list[tuple[int, int, int, list[Cell]]] = [
        (1, 0, 0, []),
        (-1, 0, 0, []),
        (0, 1, 0, []),
        (0, -1, 0, []),
    ]
    if name == "four-connected":
        return out
    guarded = name != "dissertation" or wide
    for x in (-1, 1):
        for y in (-1, 1):
            out.append((x, y, 1, [(x, 0), (0, y)] if guarded else []))
            if name == "sixteen-connected" and not wide:
                out.append((2 * x, y, 2, [(x, 0), (x, y)]))
                out.append((x, 2 * y, 2, [(0, y), (x, y)]))
    return out


class ChangingMap:
    """Walls and terrain as rows, changed as a Change says."""

    def __init__(
        self, blocked: list[list[bool]], terrain: list[list[int]] | None, radius: float = 0.0
    ) -> None:
        self.blocked = [list(row) for row in blocked]
        self.terrain = [[0] * len(row) for row in blocked] if terrain is None else [list(r) for r in terrain]
        self._ground = [list(row) for row in self.terrain]  # also of the cells under walls
        self.radius = radius
        self.width, self.height = len(blocked[0]), len(blocked)

    def change(self, blocked: object, freed: object, terrain: object) -> None:
        """What turned into a wall, what is none any more (unless it is both), other ground."""
        for x, y in freed:  # type: ignore[attr-defined]
            self.blocked[y][x] = False
        for x, y in blocked:  # type: ignore[attr-defined]
            self.blocked[y][x] = True
        for (x, y), value in terrain:  # type: ignore[attr-defined]
            if not self.blocked[y][x]:
                self._ground[y][x] = value
        for y, row in enumerate(self.blocked):
            for x, wall in enumerate(row):
                self.terrain[y][x] = 0 if wall else self._ground[y][x]

    @property
    def weighed(self) -> bool:
        """Whether any cell has terrain."""
        return any(map(any, self.terrain))

    def free(self) -> list[list[bool]]:
        """Where the robot's centre may be: at least its radius from every wall's square."""
        reach = int(self.radius) + 1
        near = [
            (dx, dy)
            for dx in range(-reach, reach + 1)
            for dy in range(-reach, reach + 1)
            if max(abs(dx) - 0.5, 0) ** 2 + max(abs(dy) - 0.5, 0) ** 2 < self.radius**2 or dx == dy == 0
        ]
        out = [[True] * self.width for _ in range(self.height)]
        for y, row in enumerate(self.blocked):
            for x, wall in enumerate(row):
                if wall:
                    for dx, dy in near:
                        if 0 <= x + dx < self.width and 0 <= y + dy < self.height:
                            out[y + dy][x + dx] = False
        return out


def costs(
    free: list[list[bool]], terrain: list[list[int]], name: str, goal: Cell, wide: bool
) -> dict[Cell, Counts]:
    """Weighed counts of a cheapest way from every cell that can reach the goal."""
    height, width = len(free), len(free[0])
    if not free[goal[1]][goal[0]]:
        return {}
    # A margin of walls all round, so that no step asks for the edge.
    line = width + 4
    room = [False] * (line * (height + 4))
    burden = [0] * len(room)
    for y in range(height):
        for x in range(width):
            room[(y + 2) * line + x + 2] = free[y][x]
            burden[(y + 2) * line + x + 2] = UNIT + terrain[y][x]
    price = PRICES[name]
    # Backwards from a settled cell: the steps that end there, the cells between seen from that end.
    rules = [
        (-dy * line - dx, kind, [(b - dy) * line + a - dx for a, b in via])
        for dx, dy, kind, via in steps_of(name, wide)
    ]
    start = (goal[1] + 2) * line + goal[0] + 2
    best = {start: 0}
    counts: dict[int, Counts] = {start: (0, 0, 0)}
    heap = [(0, start)]
    while heap:
        paid, at = heapq.heappop(heap)
        if paid > best[at]:
            continue
        weight, here = burden[at], counts[at]
        for offset, kind, via in rules:
            there = at + offset
            cost = paid + price[kind] * weight
            if not room[there] or cost >= best.get(there, cost + 1) or not all(room[at + v] for v in via):
                continue
            best[there] = cost
            n, m, k = here
            counts[there] = (n + weight * (kind == 0), m + weight * (kind == 1), k + weight * (kind == 2))
            heapq.heappush(heap, (cost, there))
    return {(i % line - 2, i // line - 2): c for i, c in counts.items()}
