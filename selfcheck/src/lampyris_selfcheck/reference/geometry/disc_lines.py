"""Straight lines of discs between cell centres, in fractions, and which cells single steps connect."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from fractions import Fraction
from itertools import pairwise, product

from lampyris_selfcheck.reference.paths.any_angle import Cell

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
