"""The motions of hybrid A*: short arcs and straight lines from any pose.

Lengths are in cells; y points down as rows do, and angles turn from x to y.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris.kernels.hybrid.goal_curve import DUBINS, REEDS_SHEPP
from lampyris.model.robot import Polygon, circumscribed_radius, inscribed_radius
from lampyris.planning.lattice.shortcut import covering_discs
from lampyris.typing import Floats

_TURNS = 36
"""A turn in place is about one of so many parts of a whole turn."""
_DIRECTIONS = 8
"""Directions in which an omnidirectional robot moves."""


@dataclass(frozen=True, slots=True)
class HybridShape:
    """What the motions of a robot depend on; lengths in cells.

    Parameters
    ----------
    footprint : vertices (x ahead, y to the left), counterclockwise, the base inside.
    drive : ``differential``, ``ackermann`` or ``omnidirectional``.
    turn_radius : smallest radius of an arc; at least one cell is taken.
    headings : bins of the yaw.
    motion_length : of a straight line, and at least that of an arc.
    reverse_cost : by how much a length driven in reverse costs more; infinite: none is.
    turn_cost : cost of a radian turned in place.
    switch_cost : cost of a change between driving ahead and in reverse.
    """

    footprint: Polygon
    drive: str
    turn_radius: float
    headings: int
    motion_length: float
    reverse_cost: float
    turn_cost: float
    switch_cost: float

    @property
    def radius(self) -> float:
        """Radius of the arcs."""
        return max(self.turn_radius, 1.0)

    @property
    def inner(self) -> float:
        """Radius of the greatest disc around the base within the footprint."""
        return inscribed_radius(self.footprint)

    @property
    def outer(self) -> float:
        """Distance from the base to the farthest vertex."""
        return circumscribed_radius(self.footprint)

    @property
    def cover(self) -> Floats:
        """Discs that cover the footprint: x, y (down), radius; float64 (n, 3)."""
        return covering_discs(self.footprint)

    @property
    def backward(self) -> bool:
        """Whether it drives in reverse."""
        return math.isfinite(self.reverse_cost) and self.drive != "omnidirectional"

    @property
    def family(self) -> int:
        """Which curves lead to the goal."""
        return REEDS_SHEPP if self.backward else DUBINS


@dataclass(frozen=True, slots=True, eq=False)
class MotionSet:
    """The motions from any pose, as the search reads them.

    Parameters
    ----------
    parts : float64 (n, 4): length, turn, lateral, cost.
    turned : int64 (n, 2): bins turned, gear.
    """

    parts: Floats
    turned: NDArray[np.int64]

    def displacements(self, yaw: float, headings: int) -> tuple[Floats, Floats]:
        """Change of x and of y, float64 (headings * n,), for headings at whole bins from a yaw."""
        length, turn, lateral, _ = self.parts.T
        half = turn / 2
        chord = np.where(turn != 0, length * elementary.sin(half) / np.where(turn != 0, half, 1.0), length)
        yaws = yaw + np.arange(headings) * (2 * math.pi / headings)
        direction = yaws[:, None] + (lateral + half)
        return (chord * elementary.cos(direction)).ravel(), (chord * elementary.sin(direction)).ravel()


@lru_cache(16)
def motions_of(shape: HybridShape) -> MotionSet:
    """The motions of a robot."""
    wide = 2 * math.pi / shape.headings
    by = max(1, math.ceil(shape.motion_length / (shape.radius * wide) - 1e-9))
    by = min(by, max(1, shape.headings // 4))
    bend = shape.radius * by * wide
    rows: list[tuple[float, float, float, float, int, int]] = []
    for gear in (1, -1) if shape.backward else (1,):
        price = 1.0 if gear > 0 else shape.reverse_cost
        rows.append((gear * shape.motion_length, 0.0, 0.0, price * shape.motion_length, 0, gear))
        # Driven in reverse, an arc of the wheels turned to the left turns the robot to the right.
        rows += [(gear * bend, side * by * wide, 0.0, price * bend, side * by, gear) for side in (1, -1)]
    if shape.drive != "ackermann":
        few = max(1, round(shape.headings / _TURNS))
        cost = few * wide * shape.turn_cost
        rows += [(0.0, side * few * wide, 0.0, cost, side * few, 0) for side in (1, -1)]
    if shape.drive == "omnidirectional":
        angles = [2 * math.pi * k / _DIRECTIONS for k in range(1, _DIRECTIONS)]
        rows += [(shape.motion_length, 0.0, angle, shape.motion_length, 0, 1) for angle in angles]
    return MotionSet(
        np.array([row[:4] for row in rows]),
        np.array([(row[4] % shape.headings, row[5]) for row in rows], dtype=np.int64),
    )
