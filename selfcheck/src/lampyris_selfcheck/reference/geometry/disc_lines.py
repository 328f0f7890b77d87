"""Straight lines of discs and points between cell centres or other places, in fractions, and which cells single steps connect."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise, product

from lampyris_selfcheck.reference.paths.any_angle import Cell

Place = tuple[Fraction, Fraction]
"""x, y in cells."""
HALF = Fraction(1, 2)
Rows = Sequence[Sequence[bool]]
"""Whether each cell is free, rows of the map."""


def disc_sees(free: Rows, begin: Cell, end: Cell) -> bool:
    """Whether a line keeps to squares between four free centres, and to rows and columns of free centres."""
    stops = {Fraction(0), Fraction(1)}
    for axis in (0, 1):
        d = end[axis] - begin[axis]
        if d:
            low, high = sorted((begin[axis], end[axis]))
            stops |= {Fraction(k - begin[axis], d) for k in range(low, high + 1)}
    for s, t in pairwise(sorted(stops)):
        x, y = (begin[axis] + (s + t) / 2 * (end[axis] - begin[axis]) for axis in (0, 1))
        if not all(
            free[v][u] for u, v in product({math.floor(x), math.ceil(x)}, {math.floor(y), math.ceil(y)})
        ):
            return False
    return True


def connected(free: Rows, begin: Cell, *, corners: bool) -> set[Cell]:
    """The free cells that steps to neighbours reach; diagonal ones past walls only if corners may be cut."""
    found, queue = {begin}, deque([begin])
    while queue:
        x, y = queue.popleft()
        for dx, dy in product((-1, 0, 1), repeat=2):
            u, v = x + dx, y + dy
            inside = 0 <= v < len(free) and 0 <= u < len(free[0])
            if inside and free[v][u] and (corners or not dx * dy) and (u, v) not in found:
                found.add((u, v))
                queue.append((u, v))
    return found


def shared(begin: Place, end: Place, cell: Cell) -> tuple[Fraction, Fraction] | None:
    """From where to where (shares of the line) a line is in the closed square of a cell; None: nowhere."""
    low, high = Fraction(0), Fraction(1)
    for axis in (0, 1):
        d, off = end[axis] - begin[axis], begin[axis] - cell[axis]
        if not d:
            if abs(off) > HALF:
                return None
            continue
        a, b = sorted(((-HALF - off) / d, (HALF - off) / d))
        low, high = max(low, a), min(high, b)
    return (low, high) if low <= high else None


def enters(begin: Place, end: Place, cell: Cell) -> bool:
    """Whether a line runs through the inside of the square of a cell."""
    part = shared(begin, end, cell)
    if part is None:
        return False
    middle = (part[0] + part[1]) / 2
    at = [begin[axis] + middle * (end[axis] - begin[axis]) for axis in (0, 1)]
    return all(abs(at[axis] - cell[axis]) < HALF for axis in (0, 1))


def squared_gap(begin: Place, end: Place, cell: Cell) -> Fraction:
    """Square of the distance between a line, or one place, and the closed square of a cell."""
    if shared(begin, end, cell) is not None:
        return Fraction(0)
    gaps = []
    for place in (begin, end):
        beyond = [abs(place[axis] - cell[axis]) - HALF for axis in (0, 1)]
        off = [one if one > 0 else Fraction(0) for one in beyond]
        gaps.append(off[0] ** 2 + off[1] ** 2)
    d = [end[axis] - begin[axis] for axis in (0, 1)]
    length = d[0] ** 2 + d[1] ** 2
    for sides in product((-HALF, HALF), repeat=2):
        off = [cell[axis] + sides[axis] - begin[axis] for axis in (0, 1)]
        along = off[0] * d[0] + off[1] * d[1]
        if 0 < along < length:
            gaps.append((off[0] * d[1] - off[1] * d[0]) ** 2 / length)
    return min(gaps)
