"""Motion primitives: short motions from one lattice state to another.

Headings are those of short lattice vectors, so that a straight primitive ends at the centre of a cell. A turn
to a neighbouring heading is a straight line and an arc, or an arc and a straight line, tangent to both
headings, with the shortest such motion whose arc is at least as wide as the turning radius:
Pivtoraiko, Knepper, Kelly, "Differentially constrained mobile robot motion planning in state lattices",
Journal of Field Robotics 26(3), 2009.

Positions are in cells, x to the right and y up; headings are counted counterclockwise from the x axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from lampyris._core import elementary
from lampyris.typing import Floats

_QUARTERS = {
    16: ((1, 0), (2, 1), (1, 1), (1, 2)),
    32: ((1, 0), (5, 1), (5, 2), (3, 2), (1, 1), (2, 3), (2, 5), (1, 5)),
}
"""Lattice vectors of the headings of the first quarter turn."""
HEADINGS = tuple(_QUARTERS)


@lru_cache(8)
def vectors(headings: int) -> tuple[tuple[int, int], ...]:
    """The lattice vector of each heading, counterclockwise from (1, 0)."""
    found: list[tuple[int, int]] = list(_QUARTERS[headings])
    for _ in range(3):
        found += [(-y, x) for x, y in found[-headings // 4 :]]
    return tuple(found)


@lru_cache(8)
def angles(headings: int | tuple[float, ...]) -> tuple[float, ...]:
    """The angle of each heading, radians in [0, 2 pi): of so many of ours, or those given."""
    if isinstance(headings, tuple):
        return headings
    return tuple(float(elementary.atan2(y, x)) % (2 * math.pi) for x, y in vectors(headings))


@dataclass(frozen=True, slots=True)
class Primitive:
    """A motion from the cell (0, 0): straight lines and arcs, one after the other.

    Parameters
    ----------
    start, end : headings, as numbers.
    cell : (x, y) where it ends, y up.
    pieces : (length in cells, turn in radians) of each piece: a straight line has no turn, a turn in place no
        length. A negative length is driven in reverse.
    heading : radians, at the start.
    lateral : angle between the direction of travel and the heading; not 0 for an omnidirectional robot alone.
    """

    start: int
    end: int
    cell: tuple[int, int]
    pieces: tuple[tuple[float, float], ...]
    heading: float
    lateral: float = 0.0

    @property
    def length(self) -> float:
        """Distance driven, cells."""
        return math.fsum(abs(length) for length, _ in self.pieces)

    @property
    def reach(self) -> float:
        """How far from the first cell it ends along an axis, cells."""
        return float(max(map(abs, self.cell)))

    @property
    def turn(self) -> float:
        """Angle turned, radians, whichever direction."""
        return math.fsum(abs(turn) for _, turn in self.pieces)

    @property
    def reverse(self) -> bool:
        """Whether it is driven in reverse."""
        return any(length < 0 for length, _ in self.pieces)

    @property
    def price(self) -> float:
        """Factor of its cost."""
        return 1.0

    def poses(self, step: float, arm: float) -> Floats:
        """Poses along it, both ends included: x, y (cells, y up) and yaw; float64 (n, 3).

        Parameters
        ----------
        step : maximum distance that a point within ``arm`` of the base moves between two poses, cells.
        arm : cells.
        """
        yaw = self.heading
        found = [np.array([(0.0, 0.0, yaw)])]
        for length, turn in self.pieces:
            n = max(1, math.ceil((abs(length) + abs(turn) * arm) / step))
            share = np.arange(1, n + 1) / n
            half = share * (turn / 2)
            chord = share * length
            if turn != 0:
                chord *= elementary.sin(half) / half
            direction = yaw + self.lateral + half
            x = found[-1][-1, 0] + chord * elementary.cos(direction)
            y = found[-1][-1, 1] + chord * elementary.sin(direction)
            found.append(np.column_stack((x, y, yaw + 2 * half)))
            yaw += turn
        return np.concatenate(found)


def straight(headings: int, k: int, direction: int = 1) -> Primitive:
    """One lattice vector ahead, or back (``direction`` -1)."""
    x, y = vectors(headings)[k]
    return Primitive(
        k,
        k,
        (direction * x, direction * y),
        ((direction * math.sqrt(x * x + y * y), 0.0),),
        angles(headings)[k],
    )


def in_place(headings: int, k: int, by: int) -> Primitive:
    """A turn in place to the next heading (``by`` 1: counterclockwise, -1: clockwise)."""
    end = (k + by) % headings
    return Primitive(k, end, (0, 0), ((0.0, _turn(headings, k, end)),), angles(headings)[k])


def _turn(headings: int, start: int, end: int) -> float:
    """The angle from one heading to another, in (-pi, pi]."""
    turn = angles(headings)[end] - angles(headings)[start]
    return turn - 2 * math.pi * math.ceil((turn - math.pi) / (2 * math.pi) - 1e-12)


def arc(headings: int, k: int, by: int, radius: float) -> Primitive:
    """The shortest turn ahead to the heading ``by`` further on, no tighter than ``radius`` cells."""
    end = (k + by) % headings
    turn = _turn(headings, k, end)
    a, b = angles(headings)[k], angles(headings)[end]
    (cos_a, sin_a), (cos_b, sin_b) = elementary.direction(a), elementary.direction(b)
    cos_half, sin_half = elementary.direction(abs(turn) / 2)
    half = sin_half / cos_half
    # Where both tangents are as short as the radius allows; from there each lattice vector ahead only adds length,
    # so that the shortest end lies within the parallelogram of the two vectors.
    least = radius * half
    (ax, ay), (bx, by) = vectors(headings)[k], vectors(headings)[end]
    x0, y0 = least * (cos_a + cos_b), least * (sin_a + sin_b)
    best: tuple[float, tuple[int, int], float, float] | None = None
    sine = sin_b * cos_a - cos_b * sin_a
    for x in range(math.floor(x0 + min(0, ax) + min(0, bx)) - 1, math.ceil(x0 + max(0, ax) + max(0, bx)) + 2):
        for y in range(
            math.floor(y0 + min(0, ay) + min(0, by)) - 1, math.ceil(y0 + max(0, ay) + max(0, by)) + 2
        ):
            # Where the two tangents meet: at d along the first, e before the end on the second.
            d = (x * sin_b - y * cos_b) / sine
            e = (y * cos_a - x * sin_a) / sine
            tangent = min(d, e)
            if tangent <= 1e-9 or tangent / half < radius - 1e-9:
                continue
            length = abs(d - e) + tangent / half * abs(turn)
            key = (round(length, 9), (x, y), d, e)
            if best is None or key < best:
                best = key
    assert best is not None
    _, cell, d, e = best
    tangent = min(d, e)
    bend = (tangent / half * abs(turn), turn)
    ahead, after = (d - tangent, 0.0), (e - tangent, 0.0)
    pieces = tuple(piece for piece in (ahead, bend, after) if abs(piece[0]) > 1e-9)
    return Primitive(k, end, cell, pieces, a)


def quarter_turned(one: Primitive, headings: int, quarters: int) -> Primitive:
    """The same motion turned counterclockwise by so many quarter turns."""
    x, y = one.cell
    for _ in range(quarters):
        x, y = -y, x
    start, end = ((k + quarters * headings // 4) % headings for k in (one.start, one.end))
    return replace(one, start=start, end=end, cell=(x, y), heading=angles(headings)[start])


def back(one: Primitive, headings: int) -> Primitive:
    """The motion that drives the same curve from its end to its beginning, in reverse, moved to the origin."""
    pieces = tuple((-length, -turn) for length, turn in reversed(one.pieces))
    x, y = one.cell
    return Primitive(one.end, one.start, (-x, -y), pieces, angles(headings)[one.end], one.lateral)
