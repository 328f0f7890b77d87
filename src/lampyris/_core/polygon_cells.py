"""Which cells of a grid a polygon covers."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from lampyris.typing import BoolGrid, Cells, Points

ROUNDING = 1e-9
"""Cells by which a polygon may reach into a square that it does not cover: what rounding makes of a common edge."""


def polygon_cells(vertices: Points, height: int, width: int) -> Cells:
    """Every cell whose square a polygon overlaps, however little of it, row by row; int32, (n, 2).

    A cell is covered if an edge runs through its square, or if its centre is inside.

    Parameters
    ----------
    vertices : float64 (k, 2), of a simple polygon, in order; cells: the centre of cell (x, y) is at (x, y).
    height, width : of the grid.
    """
    (left, top), (right, bottom) = vertices.min(axis=0), vertices.max(axis=0)
    x0, y0 = max(float(np.floor(left)), 0.0), max(float(np.floor(top)), 0.0)
    x1, y1 = min(float(np.ceil(right)) + 1.0, float(width)), min(float(np.ceil(bottom)) + 1.0, float(height))
    if x0 >= x1 or y0 >= y1:
        return np.zeros((0, 2), dtype=np.int32)
    covered = _covered(vertices - (x0, y0), int(y1 - y0), int(x1 - x0))
    rows, columns = np.nonzero(covered)
    return np.column_stack((columns + int(x0), rows + int(y0))).astype(np.int32)


def _covered(vertices: Points, height: int, width: int) -> BoolGrid:
    """The same as bool, (height, width)."""
    steps = np.zeros((height, width + 1), dtype=np.int64)
    flips = np.zeros((height, width + 1), dtype=np.int64)
    half = 0.5 - ROUNDING
    for (ax, ay), (bx, by) in pairwise([*vertices.tolist(), vertices[0].tolist()]):
        low, high = min(ay, by), max(ay, by)
        first, last = max(np.ceil(low - half), 0.0), min(np.floor(high + half), height - 1.0)
        if first > last:
            continue
        rows = np.arange(int(first), int(last) + 1)
        # Where the edge enters and leaves the band of each row.
        slope = 0.0 if high == low else (bx - ax) / (by - ay)
        ends = [np.clip(rows + side, low, high) for side in (-half, half)]
        x0, x1 = (ax + (y - ay) * slope for y in ends) if high > low else (ax + 0.0 * rows, bx + 0.0 * rows)
        left, right = np.minimum(x0, x1), np.maximum(x0, x1)
        begin = np.clip(np.ceil(left - half), 0, width).astype(np.int64)
        end = np.clip(np.floor(right + half) + 1.0, 0, width).astype(np.int64)
        some = begin < end
        np.add.at(steps, (rows[some], begin[some]), 1)
        np.add.at(steps, (rows[some], end[some]), -1)
        inside = rows[(rows >= low) & (rows < high)]
        x = ax + (inside - ay) * slope
        right_of = np.clip(np.floor(x) + 1.0, 0, width).astype(np.int64)
        np.add.at(flips, (inside, right_of), 1)
    covered: BoolGrid = np.cumsum(steps, axis=1)[:, :width] > 0
    covered |= np.cumsum(flips, axis=1)[:, :width] % 2 == 1
    return covered
