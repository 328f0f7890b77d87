"""Robot: shape, drive and limits, in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from lampyris._core.noun import Noun
from lampyris._core.settings import check_settings, number, under_code, word
from lampyris.errors import SettingError, shown

LEAST, GREATEST = 1e-6, 1e6
"""Range of every limit: what lies beyond is a wrong unit."""


Polygon = tuple[tuple[float, float], ...]
"""Vertices (x ahead, y to the left), metres, counterclockwise."""

MOST_VERTICES = 64
_REACH = 1e6
DRIVES = ("differential", "ackermann", "omnidirectional")


@dataclass(frozen=True, slots=True, repr=False)
class Robot(Noun):
    """A robot: a disc, or a polygon with a heading.

    Parameters
    ----------
    radius : robot radius; 0 treats the robot as a point. With a footprint it is the distance from the base to the
        farthest vertex, whatever was given: what plans for discs keeps that far from walls.
    v_max : maximum speed.
    a_max : maximum acceleration.
    d_max : maximum deceleration.
    a_lat_max : maximum lateral acceleration in a turn.
    turn_radius : minimum turning radius. Where no arc of that radius fits, it stands still and turns on the
        spot. 0: any bend, as slowly as a_lat_max requires.
    jerk_max : maximum jerk; it limits profiles, not drives.
    drive : drive type, used only by planners with headings: differential turns in place, ackermann does not,
        omnidirectional also moves sideways.
    footprint : vertices (x ahead, y to the left) of its outline in metres, in order; the origin is its base, the
        point between the wheels that do not steer. None: a disc.
    yaw_rate_max : maximum yaw rate on a path of poses. The default lets the point that is farthest from the base move at
        v_max while the robot turns in place, and limits nothing else.

    Raises
    ------
    SettingError : ``ROBOT_LIMIT``: a limit out of its range (beyond 1e6 it is a wrong unit); ``ROBOT_FOOTPRINT``: an
        outline that crosses itself or does not hold the base.

    Examples
    --------
    >>> car = Robot(footprint=[(0.9, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.9, -0.3)], drive="ackermann")
    >>> round(car.radius, 3), car.inscribed_radius
    (0.949, 0.3)
    """

    radius: float = number(0.0, 0.0, GREATEST, unit="m")
    v_max: float = number(1.0, LEAST, GREATEST, unit="m/s", title="top speed")
    a_max: float = number(0.5, LEAST, GREATEST, unit="m/s2", title="acceleration")
    d_max: float = number(1.0, LEAST, GREATEST, unit="m/s2", title="braking")
    a_lat_max: float = number(1.0, LEAST, GREATEST, unit="m/s2", title="sideways acceleration")
    turn_radius: float = number(0.0, 0.0, GREATEST, unit="m", title="turning radius")
    jerk_max: float | None = number(None, LEAST, GREATEST, unit="m/s3", none="no limit", title="jerk")
    drive: str = word("differential", DRIVES, title="drive")
    footprint: Polygon | None = None
    yaw_rate_max: float | None = number(
        None,
        LEAST,
        GREATEST,
        unit="rad/s",
        none="v_max at the farthest point, in place",
        title="yaw rate",
    )

    if TYPE_CHECKING:  # what is accepted; what is held is declared above

        def __init__(
            self,
            radius: float = ...,
            v_max: float = ...,
            a_max: float = ...,
            d_max: float = ...,
            a_lat_max: float = ...,
            turn_radius: float = ...,
            jerk_max: float | None = ...,
            drive: str = ...,
            footprint: Sequence[Sequence[float]] | None = ...,
            yaw_rate_max: float | None = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        check_settings(self, under_code("ROBOT_LIMIT", "robot."))
        if self.footprint is None:
            return
        polygon = footprint_of(self.footprint)
        radius = circumscribed_radius(polygon)
        object.__setattr__(self, "footprint", polygon)
        object.__setattr__(self, "radius", radius)

    @property
    def inscribed_radius(self) -> float:
        """Radius of the greatest disc around the base that is within the robot, metres."""
        return self.radius if self.footprint is None else inscribed_radius(self.footprint)


def disc(robot: Robot, radius: float) -> Robot:
    """The same robot as a disc of that radius, metres, without its footprint."""
    return replace(robot, footprint=None, radius=radius)


def inscribed_disc(robot: Robot) -> Robot:
    """The same robot as the greatest disc around its base that is within its footprint."""
    return disc(robot, robot.inscribed_radius)


def footprint_of(given: object, where: str = "robot.footprint", code: str = "ROBOT_FOOTPRINT") -> Polygon:
    """A polygon from its vertices, counterclockwise.

    Parameters
    ----------
    given : pairs (x, y) in metres; x points ahead, y to the left; the origin is the base, the point that poses are
        those of: of a robot the centre of the axle that does not steer.
    where, code : of errors.

    Raises
    ------
    SettingError : ``ROBOT_FOOTPRINT``, or another code: as :func:`outline_of`, or an origin that is not inside.
    """
    points = outline_of(given, where, code)
    if not _inside(list(points)):
        what, allowed = "the origin, the base, is not inside", "an outline around (0, 0)"
        raise SettingError(code, what, where=where, allowed=allowed)
    return points


def outline_of(given: object, where: str, code: str, reach: float = _REACH) -> Polygon:
    """A polygon anywhere from its vertices, metres, counterclockwise.

    Parameters
    ----------
    where, code : of errors.
    reach : greatest coordinate, metres.

    Raises
    ------
    SettingError : fewer than three vertices or more than 64, two equal ones in a row, or edges that cross.
    """
    from lampyris._core.predicates import numbers

    def refuse(what: str, allowed: str) -> SettingError:
        return SettingError(code, what, where=where, allowed=allowed)

    pairs = f"3 to 64 pairs [x, y] of metres, each within {'1e6' if reach == _REACH else '1e9'}"
    listed = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else given
    array = numbers(listed, (None, 2))
    if array is None or not 3 <= len(array) <= MOST_VERTICES or not (abs(array) <= reach).all():
        raise refuse(shown(given), pairs)
    points = [(float(x), float(y)) for x, y in array.tolist()]
    edges = list(zip(points, points[1:] + points[:1], strict=True))
    for k, (a, b) in enumerate(edges):
        if max(abs(a[0] - b[0]), abs(a[1] - b[1])) < LEAST:
            raise refuse(f"vertex {k} {a} twice in a row", f"vertices at least {LEAST:g} m apart")
    for i, first in enumerate(edges):
        for j in range(i + 1, len(edges)):
            neighbours = j == i + 1 or (i == 0 and j == len(edges) - 1)
            if _meet(first, edges[j], neighbours):
                raise refuse(f"edges {i} and {j} cross or touch", "an outline that does not cross itself")
    area = math.fsum(ax * by - bx * ay for (ax, ay), (bx, by) in edges)
    if area < 0:
        points = [points[0], *points[:0:-1]]
    return tuple(points)


def rectangle_of(given: object, where: str = "robot.rectangle", code: str = "ROBOT_FOOTPRINT") -> Polygon:
    """The footprint of a rectangle with the base in its middle, from its length and its width in metres.

    Raises
    ------
    SettingError : ``ROBOT_FOOTPRINT``, or another code: not two positive numbers.
    """
    from lampyris._core.predicates import numbers

    listed = list(given) if isinstance(given, Sequence) and not isinstance(given, str) else given
    sides = numbers(listed, (2,))
    if sides is None or not ((sides >= LEAST) & (sides <= _REACH)).all():
        allowed = "[length, width], metres, each 1e-6 to 1e6"
        raise SettingError(code, shown(given), where=where, allowed=allowed)
    x, y = (sides / 2).tolist()
    return ((-x, -y), (x, -y), (x, y), (-x, y))


def circumscribed_radius(polygon: Polygon) -> float:
    """Distance from the base to the farthest vertex, metres."""
    return max(math.sqrt(x * x + y * y) for x, y in polygon)


def inscribed_radius(polygon: Polygon) -> float:
    """Distance from the base to the nearest edge, metres."""
    least = math.inf
    for (ax, ay), (bx, by) in zip(polygon, (*polygon[1:], polygon[0]), strict=True):
        ex, ey = bx - ax, by - ay
        t = min(1.0, max(0.0, -(ax * ex + ay * ey) / (ex * ex + ey * ey)))
        x, y = ax + t * ex, ay + t * ey
        least = min(least, math.sqrt(x * x + y * y))
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
