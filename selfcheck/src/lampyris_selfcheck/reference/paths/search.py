"""Cheapest ways by repeated relaxation, in plain Python: slow, short, sharing nothing with what it judges.

Costs are counted, not summed: a way is (straights, diagonals, knights), and two ways are compared by the
exact sign of their difference, for octile moves by squaring instead of by a rational stand-in for sqrt 2.
"""

from __future__ import annotations

from collections import deque
from itertools import product

Cell = tuple[int, int]
Counts = tuple[int, int, int]
Cost = tuple[int, int]
"""a + b sqrt 2; b is 0 save for octile moves."""

TENTHS = {"dissertation": (10, 14, 0), "sixteen-connected": (10, 14, 22), "four-connected": (10, 0, 0)}


def cost_of(counts: tuple[int, ...], name: str) -> Cost:
    """What so many straights, diagonals and knight's steps cost."""
    n, m, k = (*counts, 0, 0)[:3]
    if name == "octile":
        return n, m
    a, b, c = TENTHS[name]
    return a * n + b * m + c * k, 0


def less(p: Cost, q: Cost) -> bool:
    """Whether p < q, exactly."""
    a, b = p[0] - q[0], p[1] - q[1]
    if a < 0 and b < 0:
        return True
    if a >= 0 and b >= 0:
        return False
    return a * a > 2 * b * b if a < 0 else a * a < 2 * b * b


def steps(name: str) -> list[Cell]:
    """The steps (dx, dy) of a step set."""
    reach = 2 if name == "sixteen-connected" else 1
    box = product(range(-reach, reach + 1), repeat=2)
    longest = 1 if name == "four-connected" else 2 if reach == 1 else 5
    return [(x, y) for x, y in box if 0 < x * x + y * y <= longest and (x * x + y * y != 4)]


def needs(dx: int, dy: int, name: str) -> set[Cell]:
    """The cells that must be free for a step, its own end included.

    Those whose inside the straight line between the two centres runs through, found by trying 24 points of
    it that lie on no border; and for a diagonal, unless corners may be cut, the two cells it passes
    between.
    """
    cells = {
        ((12 + dx * t) // 24, (12 + dy * t) // 24)
        for t in range(1, 25)
        if _inside(dx * t) and _inside(dy * t)
    }
    if abs(dx * dy) == 1 and name != "dissertation":
        cells |= {(dx, 0), (0, dy)}
    return cells


def _inside(t: int) -> bool:
    return (12 + t) % 24 != 0


def distances(free: list[list[bool]], name: str, goal: Cell) -> dict[Cell, Counts]:
    """Counts of a cheapest way from every cell that can reach the goal."""
    height, width = len(free), len(free[0])

    def is_free(x: int, y: int) -> bool:
        return 0 <= x < width and 0 <= y < height and free[y][x]

    if not is_free(*goal):
        return {}
    rules = [(dx, dy, needs(dx, dy, name), abs(dx * dy)) for dx, dy in steps(name)]
    best: dict[Cell, Counts] = {goal: (0, 0, 0)}
    waiting = deque([goal])
    while waiting:
        x, y = waiting.popleft()
        here = best[x, y]
        for dx, dy, through, kind in rules:
            # All steps can be driven both ways.
            if not all(is_free(x + a, y + b) for a, b in through):
                continue
            there = (x + dx, y + dy)
            counts = list(here)
            counts[kind] += 1
            way: Counts = (counts[0], counts[1], counts[2])
            if there not in best or less(cost_of(way, name), cost_of(best[there], name)):
                best[there] = way
                waiting.append(there)
    return best


def verdict(free: list[list[bool]], start: Cell, known: dict[Cell, Counts], goal: Cell) -> str:
    """The status word that a complete planner must answer, given the distances to the goal."""
    if not free[start[1]][start[0]]:
        return "start-occupied"
    if not free[goal[1]][goal[0]]:
        return "goal-occupied"
    return "found" if start in known else "no-path"


def read_map(text: str) -> list[list[bool]]:
    """Free cells of a MovingAI map: ``.``, ``G`` and ``S``."""
    lines = text.splitlines()
    height = next(int(line.split()[1]) for line in lines if line.startswith("height"))
    rows = lines[lines.index("map") + 1 :][:height]
    return [[c in ".GS" for c in row] for row in rows]


def read_queries(text: str) -> list[tuple[Cell, Cell, float, float]]:
    """Start, goal, published length and how far off it may be printed, of each query of a ``.scen`` file."""
    found = []
    for line in text.splitlines()[1:]:
        words = line.split()
        if not words:
            continue
        sx, sy, gx, gy = (int(w) for w in words[4:8])
        length = float(words[8])
        decimals = len(words[8].partition(".")[2])
        found.append(((sx, sy), (gx, gy), length, max(1e-5 * length, 0.5 * 10.0**-decimals)))
    return found
