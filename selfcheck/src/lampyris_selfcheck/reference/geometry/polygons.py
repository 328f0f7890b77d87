"""Convex polygons, and how deep two of them overlap: by their separating axes."""

from __future__ import annotations

import math
from collections.abc import Sequence

Point = tuple[float, float]


def overlap(one: Sequence[Point], other: Sequence[Point]) -> float:
    """How far one of two convex polygons must move until they do not overlap; negative: they are apart."""
    least = math.inf
    for polygon in (one, other):
        for (ax, ay), (bx, by) in zip(polygon, [*polygon[1:], polygon[0]], strict=True):
            nx, ny = by - ay, ax - bx
            size = math.sqrt(nx * nx + ny * ny)
            a = [(x * nx + y * ny) / size for x, y in one]
            b = [(x * nx + y * ny) / size for x, y in other]
            least = min(least, max(a) - min(b), max(b) - min(a))
    return least


def placed(outline: Sequence[Point], x: float, y: float, yaw: float) -> list[Point]:
    """An outline at a pose."""
    c, s = math.cos(yaw), math.sin(yaw)
    return [(x + c * u - s * v, y + s * u + c * v) for u, v in outline]


def links_of(
    base: Point, lengths: Sequence[float], widths: Sequence[float], turns: Sequence[float]
) -> list[list[Point]]:
    """The rectangles of a planar chain: each link turned against the one before it."""
    made, (x, y), angle = [], base, 0.0
    for length, width, turn in zip(lengths, widths, turns, strict=True):
        angle += turn
        made.append(
            placed(
                [(0.0, -width / 2), (length, -width / 2), (length, width / 2), (0.0, width / 2)], x, y, angle
            )
        )
        x, y = x + length * math.cos(angle), y + length * math.sin(angle)
    return made


def deepest(
    polygon: Sequence[Point], blocked: Sequence[Sequence[bool]], cell: float, *, edge: bool = True
) -> float:
    """How deep a polygon lies in blocked cells of a map whose lower left corner is the origin, y up.

    ``edge``: or beyond the edge of the map.
    """
    xs, ys = ([p[k] for p in polygon] for k in (0, 1))
    high, wide = len(blocked), len(blocked[0])
    beyond = max(-min(xs), -min(ys), max(xs) - wide * cell, max(ys) - high * cell)
    worst = beyond if edge else -math.inf
    for column in range(max(0, int(min(xs) / cell)), min(wide, int(max(xs) / cell) + 1)):
        for up in range(max(0, int(min(ys) / cell)), min(high, int(max(ys) / cell) + 1)):
            if blocked[high - 1 - up][column]:
                x, y = column * cell, up * cell
                square = [(x, y), (x + cell, y), (x + cell, y + cell), (x, y + cell)]
                worst = max(worst, overlap(polygon, square))
    return worst
