"""Paths that turn anywhere, at the corners of walls, in place of paths that turn at cell centres."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.graph.any_angle import CUT, TOUCH, WIDE
from lampyris.kernels.map_models.polyanya import walk_along
from lampyris.kernels.sampling.sweep import FAR, HALF, UNITS
from lampyris.kernels.sampling.tighten import tighten
from lampyris.planning.field.layers import FORGIVEN
from lampyris.planning.sampling.ground import Lines
from lampyris.typing import BoolGrid, Cell, Cells, Floats

PARTS = (4, 0.25), (8, 2.0), (16, math.inf)
"""Sides of the polygon around a quarter of the arc around the corner of a wall, for radii below so many cells."""
_SPARE = 3
"""Units by which a polygon keeps farther from its corner than the radius: places are whole units."""
_ROOM = 4096
"""Corners of walls in one triangle of a path, at most: with more its middle stays."""
NEAR = 2.0
"""Cells, along either axis, that the walk of a disc's path may be from a place at which the path turns."""

_Ints = NDArray[np.int64]
Walking = Callable[[BoolGrid], Cells | None]
"""A walk by single steps through some of the cells that are free; None: there is none."""


class Walls:
    """The walls of one map, among which paths are shortened.

    Memory: 1 byte a cell; 2 for a point.

    Parameters
    ----------
    blocked : bool (height, width).
    radius : of the robot, cells.
    rule : ``CUT``, ``TOUCH`` or ``WIDE``: what lines may do, see :mod:`lampyris.kernels.sampling.sweep`.
    diagonals : see :func:`lampyris.kernels.map_models.polyanya.walk_along`.

    Attributes
    ----------
    far : whether the map is too large: lines stay as they are.
    """

    def __init__(self, blocked: BoolGrid, radius: float, rule: int, diagonals: int) -> None:
        height, width = blocked.shape
        self.far = height * height + width * width >= FAR * FAR
        framed = np.zeros((height + 2, width + 2), dtype=np.uint8)
        framed[1:-1, 1:-1] = blocked
        self._wall, self._stride = framed.ravel(), width + 2
        self._inside = np.zeros_like(framed)
        self._inside[1:-1, 1:-1] = 1
        self._rule, self._diagonals = rule, diagonals
        # Half of what a cell's centre is forgiven, so that no sum of rounding errors is beyond it.
        self._radius = radius * UNITS * (1.0 - 0.5 * FORGIVEN)
        self._corner = _around_corner(radius) if rule == WIDE else np.full(2, int(rule == TOUCH))
        self._reach = int(self._corner.max())

    def shortened(self, lines: Lines, closed: Sequence[Cell], walking: Walking) -> Lines:
        """The shortest lines that these can be moved to without passing over a wall; the same lines if there are none.

        The walk of a disc's lines is the one given if it stays near them, else another near them; if there is none, the lines
        stay as they are.

        Parameters
        ----------
        lines : between cell centres.
        closed : cells that count as walls.
        walking : finds a walk from the first cell to the last one.
        """
        if self.far or len(lines.turns) < 3:
            return lines
        shut = np.array([(y + 1) * self._stride + x + 1 for x, y in closed], dtype=np.int64)
        before = self._wall[shut]
        self._wall[shut] = 1
        try:
            places = self._tightened(lines.turns.astype(np.int64) * UNITS)
            if places is None:
                return lines
            walk = lines.walk if self._rule == WIDE else self._walk(places)
        finally:
            self._wall[shut] = before
        if self._rule == WIDE and not _follows(walk, places):
            other = walking(self._beside(places))
            if other is None or not _follows(other, places) or _length(other) < _length(places / UNITS):
                return lines
            walk = other
        return Lines(places / UNITS, walk)

    def _beside(self, places: _Ints) -> BoolGrid:
        """The cells near the lines between places; bool (height, width)."""
        beside = np.zeros_like(self._inside, dtype=np.bool_)
        reach = int(NEAR)
        for a, b in pairwise(places / UNITS):
            parts = np.linspace(0.0, 1.0, 2 + int(np.abs(b - a).max()))[:, None]
            for x, y in np.floor(a + (b - a) * parts + 0.5).astype(np.int64).tolist():
                beside[max(y + 2 - reach, 0) : y + 1 + reach, max(x + 2 - reach, 0) : x + 1 + reach] = True
        return beside[1:-1, 1:-1]

    def _tightened(self, turns: _Ints) -> _Ints | None:
        room = (4 + len(self._corner)) * len(turns) + 256
        x, y = np.zeros((2, room), dtype=np.int64)
        x[: len(turns)], y[: len(turns)] = turns.T
        found, hull = np.empty(2 * _ROOM, dtype=np.int64), np.empty(2 * room, dtype=np.int64)
        rules = (self._corner, self._reach, self._radius, self._rule)
        count = int(tighten(self._wall, self._stride, *rules, len(turns), x, y, found, hull))
        places = np.stack((x[:count], y[:count]), axis=1)
        if count == len(turns) and (places == turns).all():
            return None
        return places

    def _walk(self, places: _Ints) -> Cells:
        """The walk along lines of a point."""
        square = self._inside.ravel() & (1 - self._wall)
        if self._rule == CUT:
            places = self._with_corners(places)
        x, y = (np.ascontiguousarray(one) for one in (places + 3 * HALF).T)
        room = 1 + int((np.abs(np.diff(x)).sum() + np.abs(np.diff(y)).sum()) // UNITS) + 6 * len(x)
        path = np.empty(room, dtype=np.int32)
        count = int(walk_along(square, self._stride, UNITS, x, y, self._diagonals, path))
        row, column = np.divmod(path[:count], np.int32(self._stride))
        return np.stack((column, row), axis=1) - np.int32(1)

    def _with_corners(self, places: _Ints) -> _Ints:
        """The same with the corners of walls that the lines run through: there the walk may have to change sides.

        Places at which lines turn are corners or centres of squares: whole numbers of half cells.
        """
        halves = places // HALF
        made = []
        for (ax, ay), (bx, by) in pairwise(halves.tolist()):
            parts = math.gcd(bx - ax, by - ay)
            at = np.arange(parts, dtype=np.int64)[:, None] * ((bx - ax) // parts, (by - ay) // parts) + (
                ax,
                ay,
            )
            corner = at[(at % 2 == 1).all(axis=1)]
            right, down = ((corner + 1) // 2).T
            flat = (down + 1) * self._stride + right + 1
            around = [self._wall[flat - k] for k in (0, 1, self._stride, self._stride + 1)]
            made += [at[:1], corner[(np.add.reduce(around) > 0) & (corner != at[0]).any(axis=1)]]
        return np.concatenate((*made, halves[-1:])) * HALF


def _around_corner(radius: float) -> _Ints:
    """Where a disc turns around the corner of a wall: vertices of a polygon around its arc, between down and right of it.

    By square roots alone, which are the same everywhere.
    """
    parts = next(parts for parts, most in PARTS if radius < most)
    cos, sin, halves = math.sqrt(0.5), math.sqrt(0.5), 1
    while halves < parts:
        halves *= 2
        cos, sin = math.sqrt((1.0 + cos) / 2.0), math.sqrt((1.0 - cos) / 2.0)
    far = (math.ceil(radius * UNITS) + _SPARE) / cos
    double = cos * cos - sin * sin, 2.0 * cos * sin
    places, (x, y) = [], (cos, sin)
    for _ in range(parts):
        places += [math.floor(far * x + 0.5), math.floor(far * y + 0.5)]
        x, y = x * double[0] - y * double[1], x * double[1] + y * double[0]
    return np.array(places, dtype=np.int64)


def _length(points: Cells | Floats) -> float:
    d = np.diff(points.astype(np.float64), axis=0)
    return math.fsum(np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]).tolist())


def _follows(walk: Cells, places: _Ints) -> bool:
    """Whether a walk comes near to each place, one after the other."""
    at, cells = 0, walk.tolist()
    for x, y in (places / UNITS).tolist():
        while at < len(cells) and max(abs(cells[at][0] - x), abs(cells[at][1] - y)) > NEAR:
            at += 1
        if at == len(cells):
            return False
    return True
