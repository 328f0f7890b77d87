"""Sight between squares, slowly: every square is asked on its own, in whole numbers or in floats."""

from __future__ import annotations

from fractions import Fraction

import numpy as np


def crosses(ax: int, ay: int, bx: int, by: int, x: int, y: int, unit: int) -> bool:
    """Whether the segment meets the inside of the square of cell (x, y), of side ``unit``."""
    low, high = Fraction(0), Fraction(1)
    for a, d, edge in ((ax, bx - ax, x * unit), (ay, by - ay, y * unit)):
        if d == 0:
            if not edge < a < edge + unit:
                return False
            continue
        ends = sorted((Fraction(edge - a, d), Fraction(edge + unit - a, d)))
        low, high = max(low, ends[0]), min(high, ends[1])
    return low < high


def sees(opaque: np.ndarray, ax: int, ay: int, bx: int, by: int, unit: int) -> bool:
    """Whether no opaque square and no two that touch at a corner lie between a and b."""
    height, width = opaque.shape
    for y in range(height):
        for x in range(width):
            if opaque[y, x] and crosses(ax, ay, bx, by, x, y, unit):
                return False
    for y in range(1, height):
        for x in range(1, width):
            px, py = x * unit, y * unit
            on = (bx - ax) * (py - ay) == (by - ay) * (px - ax)
            inside = min(ax, bx) < px < max(ax, bx) and min(ay, by) < py < max(ay, by)
            four = opaque[y - 1, x - 1], opaque[y - 1, x], opaque[y, x - 1], opaque[y, x]
            if on and inside and four in ((True, False, False, True), (False, True, True, False)):
                return False
    return True


def seen_points(opaque: np.ndarray, eye: np.ndarray, points: np.ndarray) -> np.ndarray:
    """The same for many points in floats, cell (i, j) being the square from (i, j) to (i + 1, j + 1); bool
    (n,).

    Squares count as a little larger than they are, so that nothing is seen between two that touch.
    """
    ys, xs = np.nonzero(opaque)
    d = points - eye
    seen = np.ones(len(points), dtype=bool)
    with np.errstate(divide="ignore", invalid="ignore"):
        for x, y in zip(xs.tolist(), ys.tolist(), strict=True):
            low, high = np.zeros(len(points)), np.ones(len(points))
            for k, edge in ((0, x), (1, y)):
                ends = (edge - 1e-9 - eye[k]) / d[:, k], (edge + 1 + 1e-9 - eye[k]) / d[:, k]
                within = edge - 1e-9 < eye[k] < edge + 1 + 1e-9
                flat = d[:, k] == 0.0
                low = np.maximum(low, np.where(flat, 0.0 if within else 2.0, np.minimum(*ends)))
                high = np.minimum(high, np.where(flat, 1.0, np.maximum(*ends)))
            seen &= ~(low < high)
    return seen
