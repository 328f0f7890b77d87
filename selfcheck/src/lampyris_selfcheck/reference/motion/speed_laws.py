"""Slow references of the speed laws, written from the equations alone: no sweep, no table, no window, no kernel.

The passes have a closed form. A speed bound at node k reaches node i on a slope: rising from k < i, falling
to k > i. The greatest x under all of them is therefore the least of all bounds seen from i, which is O(n^2)
and needs no order.
"""

from __future__ import annotations

import math


def under_slopes(bound: list[float], rise: list[float], fall: list[float]) -> list[float]:
    """Greatest x with x <= bound, x[i+1] <= x[i] + rise[i], x[i] <= x[i+1] + fall[i]."""
    n = len(bound)
    up, down = [0.0], [0.0]
    for r, f in zip(rise, fall, strict=True):
        up.append(up[-1] + r)
        down.append(down[-1] + f)
    return [
        min(bound[k] + (up[i] - up[k] if k <= i else down[k] - down[i]) for k in range(n)) for i in range(n)
    ]


def angle_between(u: tuple[int, int], w: tuple[int, int]) -> float:
    """Degrees between two directions, 0 to 180."""
    apart = abs(math.atan2(u[1], u[0]) - math.atan2(w[1], w[0]))
    return math.degrees(min(apart, 2 * math.pi - apart))


def dissertation(cells: list[tuple[int, int]], n1: list[int], n2: list[int], v0: float = 0.0) -> list[float]:
    """Speeds by method.md, "The dissertation's speed law", from degrees and closed slopes."""
    n = len(cells)
    bound, rise = [], []
    for i in range(n):
        limit = min(80.0, max(20.0, 80.0 - 6 * n1[i] - 3 * n2[i]))
        if 0 < i < n - 1:
            into = (cells[i][0] - cells[i - 1][0], cells[i][1] - cells[i - 1][1])
            out = (cells[i + 1][0] - cells[i][0], cells[i + 1][1] - cells[i][1])
            interior = 180.0 - angle_between(into, out)
            limit = min(limit, 80.0 if interior > 157.5 else 60.0 if interior > 112.5 else 20.0)
        bound.append(limit)
        if i:
            dx, dy = abs(cells[i][0] - cells[i - 1][0]), abs(cells[i][1] - cells[i - 1][1])
            rise.append({(1, 0): 20.0, (0, 1): 20.0, (1, 1): 28.0, (1, 2): 44.0, (2, 1): 44.0}[dx, dy])
    bound[0], bound[-1] = min(bound[0], v0), 0.0
    return under_slopes(bound, rise, [40.0] * (n - 1))


def ring_count(
    cell: tuple[int, int],
    heading: tuple[int, int],
    ring: int,
    blocked: list[list[bool]],
    obstacles: set[tuple[int, int]],
    *,
    ahead: bool,
    outside: bool,
) -> int:
    """Count one ring around one cell, cell by cell, by angles in degrees."""
    height, width = len(blocked), len(blocked[0])
    found = 0
    for y in range(cell[1] - 2, cell[1] + 3):
        for x in range(cell[0] - 2, cell[0] + 3):
            offset = (x - cell[0], y - cell[1])
            if max(abs(offset[0]), abs(offset[1])) != ring:
                continue
            if ahead and (heading == (0, 0) or angle_between(heading, offset) > 45.0 + 1e-9):
                continue
            inside = 0 <= x < width and 0 <= y < height
            if inside:
                found += blocked[y][x] or (x, y) in obstacles
            else:
                found += outside
    return found


def surface_distance(cell: tuple[int, int], squares: list[tuple[int, int]]) -> float:
    """Cells from a cell's centre to the nearest point of these unit squares; infinity if there is none."""
    best = math.inf
    for x, y in squares:
        nearest_x = min(max(cell[0] + 0.5, x), x + 1)
        nearest_y = min(max(cell[1] + 0.5, y), y + 1)
        best = min(best, math.hypot(cell[0] + 0.5 - nearest_x, cell[1] + 0.5 - nearest_y))
    return best


def time_by_small_steps(ds: float, a: float, d: float, cap: float, steps: int = 200_000) -> float:
    """Rest to rest: ds / v added up over small steps at the speed that both ends and the cap allow."""
    h = ds / steps
    total = 0.0
    for k in range(steps):
        s = (k + 0.5) * h
        total += h / min(cap, math.sqrt(2 * a * s), math.sqrt(2 * d * (ds - s)))
    return total
