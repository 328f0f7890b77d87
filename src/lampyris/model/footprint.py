"""Footprints: the outline of a robot in its own frame."""

from __future__ import annotations

import math
from collections.abc import Sequence

from lampyris._core.predicates import numbers
from lampyris.errors import SettingError, shown

Polygon = tuple[tuple[float, float], ...]
"""Vertices (x ahead, y to the left), metres, counterclockwise."""

MOST_VERTICES = 64
_GREATEST = 1e6


def footprint_of(given: object, where: str = "robot.footprint") -> Polygon:
    """A polygon from its vertices, counterclockwise.

    Parameters
    ----------
    given : pairs (x, y) in metres; x points ahead, y to the left; the origin is the base of the robot, the
        point that its poses are those of: the centre of the axle that does not steer.

    Raises
    ------
    SettingError : ``ROBOT_FOOTPRINT``: fewer than three vertices or more than 64, two equal ones in a row, edges
        that cross, or an origin that is not inside.
    """

    def refuse(what: str, allowed: str) -> SettingError:
        return SettingError("ROBOT_FOOTPRINT", what, where=where, allowed=allowed)

    pairs = "3 to 64 pairs [x, y] of metres, each within 1e6"
    listed = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else given
    array = numbers(listed, (None, 2))
    if array is None or not 3 <= len(array) <= MOST_VERTICES or not (abs(array) <= _GREATEST).all():
        raise refuse(shown(given), pairs)
    points = [(float(x), float(y)) for x, y in array.tolist()]
    edges = list(zip(points, points[1:] + points[:1], strict=True))
    for k, (a, b) in enumerate(edges):
        if a == b:
            raise refuse(f"vertex {k} {a} twice in a row", "every vertex once")
    for i, first in enumerate(edges):
        for j in range(i + 1, len(edges)):
            neighbours = j == i + 1 or (i == 0 and j == len(edges) - 1)
            if _meet(first, edges[j], neighbours):
                raise refuse(f"edges {i} and {j} cross or touch", "an outline that does not cross itself")
    area = math.fsum(ax * by - bx * ay for (ax, ay), (bx, by) in edges)
    if area < 0:
        points = [points[0], *points[:0:-1]]
    if not _inside(points):
        raise refuse("the origin, the base of the robot, is not inside", "an outline around (0, 0)")
    return tuple(points)


def rectangle_of(given: object, where: str = "robot.rectangle") -> Polygon:
    """The footprint of a rectangle with the base in its middle, from its length and its width in metres.

    Raises
    ------
    SettingError : ``ROBOT_FOOTPRINT``: not two positive numbers.
    """
    listed = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else given
    sides = numbers(listed, (2,))
    if sides is None or not ((sides > 0) & (sides <= _GREATEST)).all():
        allowed = "[length, width], metres, each above 0, at most 1e6"
        raise SettingError("ROBOT_FOOTPRINT", shown(given), where=where, allowed=allowed)
    x, y = (sides / 2).tolist()
    return ((-x, -y), (x, -y), (x, y), (-x, y))


def circumscribed_radius(polygon: Polygon) -> float:
    """Distance from the base to the farthest vertex, metres."""
    return max(math.hypot(x, y) for x, y in polygon)


def inscribed_radius(polygon: Polygon) -> float:
    """Distance from the base to the nearest edge, metres."""
    least = math.inf
    for (ax, ay), (bx, by) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        ex, ey = bx - ax, by - ay
        t = min(1.0, max(0.0, -(ax * ex + ay * ey) / (ex * ex + ey * ey)))
        least = min(least, math.hypot(ax + t * ex, ay + t * ey))
    return least


_Edge = tuple[tuple[float, float], tuple[float, float]]


def _side(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _meet(first: _Edge, second: _Edge, neighbours: bool) -> bool:
    """Whether two edges have a point in common, besides the vertex that neighbours share."""
    (a, b), (c, d) = first, second
    sides = (_side(a, b, c), _side(a, b, d), _side(c, d, a), _side(c, d, b))
    if neighbours:
        # Neighbours that fold back onto one another overlap.
        shared = b if b in (c, d) else a
        p, q = (a if shared == b else b), (d if shared == c else c)
        ahead = (p[0] - shared[0]) * (q[0] - shared[0]) + (p[1] - shared[1]) * (q[1] - shared[1])
        return _side(shared, p, q) == 0 and ahead > 0
    if sides[0] * sides[1] < 0 and sides[2] * sides[3] < 0:
        return True
    return any(
        side == 0 and _between(edge, point)
        for side, edge, point in zip(sides, (first, first, second, second), (c, d, a, b), strict=True)
    )


def _between(edge: _Edge, point: tuple[float, float]) -> bool:
    (ax, ay), (bx, by) = edge
    x, y = point
    return min(ax, bx) <= x <= max(ax, bx) and min(ay, by) <= y <= max(ay, by)


def _inside(points: list[tuple[float, float]]) -> bool:
    """Whether the origin is inside an outline, and not on it."""
    if inscribed_radius(tuple(points)) <= 0:
        return False
    crossings = 0
    for (ax, ay), (bx, by) in zip(points, points[1:] + points[:1], strict=True):
        if (ay > 0) != (by > 0) and ax - ay * (bx - ax) / (by - ay) > 0:
            crossings += 1
    return crossings % 2 == 1
