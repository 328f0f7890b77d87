"""Discs that drive straight: how near they come to each other, to walls and to the edge of the map."""

from __future__ import annotations

import math
from collections.abc import Sequence

Point = tuple[float, float]
SAMPLES = 64
"""Places of a motion at which its distance to walls is taken."""


def closest(a: Point, b: Point, c: Point, d: Point) -> float:
    """Least distance of two points, one from ``a`` to ``b`` and one from ``c`` to ``d`` in the same time."""
    x, y = a[0] - c[0], a[1] - c[1]
    u, v = (b[0] - d[0]) - x, (b[1] - d[1]) - y
    square = u * u + v * v
    share = 0.0 if square == 0.0 else min(1.0, max(0.0, -(x * u + y * v) / square))
    return math.sqrt((x + share * u) ** 2 + (y + share * v) ** 2)


def wall_gap(a: Point, b: Point, blocked: Sequence[Sequence[bool]], cell: float) -> float:
    """Distance of a motion to the nearest blocked cell or edge of the map, metres from the upper left corner, y down.

    Taken at some places of the motion: it may be more by half of what lies between two of them.
    """
    high, wide = len(blocked), len(blocked[0])
    least = math.inf
    for k in range(SAMPLES + 1):
        x = a[0] + (b[0] - a[0]) * k / SAMPLES
        y = a[1] + (b[1] - a[1]) * k / SAMPLES
        least = min(least, x, y, wide * cell - x, high * cell - y)
        for v in range(max(0, int(y / cell) - 2), min(high, int(y / cell) + 3)):
            for u in range(max(0, int(x / cell) - 2), min(wide, int(x / cell) + 3)):
                if blocked[v][u]:
                    dx = max(u * cell - x, 0.0, x - (u + 1) * cell)
                    dy = max(v * cell - y, 0.0, y - (v + 1) * cell)
                    least = min(least, math.sqrt(dx * dx + dy * dy))
    return least
