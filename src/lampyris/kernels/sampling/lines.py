"""Straight lines between cells, checked so that a line that hits something is found out early.

The rule is that of :mod:`lampyris.kernels.graph.any_angle`. A few points of the line are looked at first, in van der
Corput's order (the middle, the quarters, the eighths): a line through a wall is mostly refused by the first or second of
them. Whatever passes is walked from cell to cell.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.graph.any_angle import sees

NEAR = 6
"""Lines that are no longer than this (cells) along both axes are walked at once."""
DEEP = 3
"""Points are 1/2, 1/4, 3/4, ... up to parts of 2 to this power."""


@kernel()
def line_free(free, even, stride, ax, ay, bx, by, rule):
    """Whether the robot's centre may move straight from one free cell to another.

    Parameters
    ----------
    free : uint8 (n,), padded; 1 where the robot may be.
    even : uint8 (1,): 0.
    stride : length of a padded row.
    ax, ay, bx, by : the cells, padded.
    rule : see :mod:`lampyris.kernels.graph.any_angle`.
    """
    if free[u64(by * stride + bx)] == 0:
        return False
    dx = bx - ax
    dy = by - ay
    if abs(dx) > NEAR or abs(dy) > NEAR:
        for deep in range(1, DEEP + 1):
            parts = 1 << deep
            half = parts >> 1
            for k in range(1, parts, 2):
                # The point is (k dx, k dy) / parts from a. It lies inside a cell, which then must be free, unless it
                # lies on the edge between two.
                px = k * dx + half
                py = k * dy + half
                if px & (parts - 1) == 0 or py & (parts - 1) == 0:
                    continue
                if free[u64((ay + (py >> deep)) * stride + ax + (px >> deep))] == 0:
                    return False
    return sees(free, even, 0, stride, ay * stride + ax, ax, ay, bx, by, rule) == 1
