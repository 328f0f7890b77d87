"""The least travel time of a path under caps of cells and corners, by Dijkstra over all pairs of steps."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass

Cell = tuple[int, int]


@dataclass(frozen=True)
class Limits:
    """What limits the speed; SI units, cells are metres.

    Parameters
    ----------
    radius, v_max, a_max, d_max, a_lat_max, turn_radius : of the robot.
    creep : share of v_max that clearance leaves.
    """

    radius: float
    v_max: float
    a_max: float
    d_max: float
    a_lat_max: float
    turn_radius: float
    creep: float = 0.1


def corner_speed(before: Cell, after: Cell, limits: Limits) -> float:
    """By trigonometry: an arc tangent to both steps within half the shorter; 0: it does not fit."""
    turn = abs(math.remainder(math.atan2(after[1], after[0]) - math.atan2(before[1], before[0]), math.tau))
    if turn < 1e-9:
        return math.inf
    if turn > math.pi - 1e-9:
        return 0.0
    radius = 0.5 * min(math.hypot(*before), math.hypot(*after)) / math.tan(turn / 2)
    return 0.0 if radius < limits.turn_radius else math.sqrt(limits.a_lat_max * radius)


def clearance_speed(blocked: Sequence[Sequence[bool]], cell: Cell, limits: Limits) -> float:
    """The speed from which the robot can stop within its distance to the nearest wall, at least creeping speed."""
    gaps = [
        math.hypot(max(abs(x - cell[0]) - 0.5, 0.0), max(abs(y - cell[1]) - 0.5, 0.0))
        for y, row in enumerate(blocked)
        for x, one in enumerate(row)
        if one
    ]
    room = max(min(gaps, default=math.inf) - limits.radius, 0.0)
    return min(limits.v_max, max(limits.creep * limits.v_max, math.sqrt(2.0 * limits.d_max * room)))


def least_time(
    blocked: Sequence[Sequence[bool]],
    steps: Sequence[Cell],
    start: Cell,
    goal: Cell,
    limits: Limits,
    zones: Sequence[Sequence[float]] | None = None,
) -> float:
    """Seconds of the fastest path of a disc that cuts no corners; infinity: there is none."""
    high, wide = len(blocked), len(blocked[0])
    free = {(x, y) for y in range(high) for x in range(wide) if not blocked[y][x]}
    caps = {cell: clearance_speed(blocked, cell, limits) for cell in free}

    def legal(cell: Cell, step: Cell) -> bool:
        (x, y), (dx, dy) = cell, step
        return {(x + dx, y + dy), (x + dx, y), (x, y + dy)} <= free

    def half(cell: Cell, step: Cell, corner: float, acceleration: float) -> float:
        (x, y), (dx, dy) = cell, step
        far, a, b = math.hypot(dx, dy), caps[cell], caps[x + dx, y + dy]
        if zones is not None:
            limit = min(zones[v][u] for v in {y, y + dy} for u in {x, x + dx})
            a, b = min(a, limit), min(b, limit)
        if corner > 0.0:
            return far / (min(a, corner) + min(b, corner))
        v = max(a, b)
        ramp = v * v / (2 * acceleration)
        if ramp >= far / 2:
            return math.sqrt(far / acceleration)
        return v / acceleration + (far / 2 - ramp) / v

    if start == goal:
        return 0.0
    queue = [
        (half(start, step, math.inf, 1.0), start[0] + step[0], start[1] + step[1], k)
        for k, step in enumerate(steps)
        if legal(start, step)
    ]
    heapq.heapify(queue)
    done: set[tuple[int, int, int]] = set()
    best = math.inf
    while queue:
        spent, x, y, k = heapq.heappop(queue)
        if (x, y, k) in done:
            continue
        done.add((x, y, k))
        back = (x - steps[k][0], y - steps[k][1])
        if (x, y) == goal:
            best = min(best, spent + half(back, steps[k], math.inf, 1.0))
        for j, step in enumerate(steps):
            if legal((x, y), step):
                corner = corner_speed(steps[k], step, limits)
                more = half(back, steps[k], corner, limits.d_max) + half((x, y), step, corner, limits.a_max)
                heapq.heappush(queue, (spent + more, x + step[0], y + step[1], j))
    return best
