"""Straight lines between any two places, and what a disc or a point that moves along them meets.

Places are whole numbers of 1 / :data:`UNITS` of a cell, the centre of cell (c, r) at (c, r) times :data:`UNITS`. Walls are
closed squares of one cell. The rule is ``CUT`` or ``TOUCH`` of :mod:`lampyris.kernels.graph.any_angle` for a point, decided
in integers: its line must not run through the inside of a wall, or not touch one; and ``WIDE`` for a disc, whose distance
from a wall must not be less than its radius, whatever the line: it need not pass between four free cells.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.graph.any_angle import CUT, TOUCH

UNITS = 2**16
HALF = 2**15
FAR = 2**13
"""Cells across the map up to which products of places have room in 64 bits."""


@kernel()
def _hits(px, py, dx, dy, length, radius, rule):
    """Whether the line from (0, 0) to (dx, dy) hits the square around (px, py).

    Line and square are apart if they are on the axis x, or y, or at right angles to the line. If that gap is less than the
    radius, a disc hits the square only where an end of the line is too near to the square, or a corner of it to the line.
    """
    gap_x = max(px - HALF - max(0, dx), min(0, dx) - px - HALF)
    gap_y = max(py - HALF - max(0, dy), min(0, dy) - py - HALF)
    across = abs(px * dy - py * dx) - HALF * (abs(dx) + abs(dy))
    if rule == TOUCH:
        return gap_x <= 0 and gap_y <= 0 and across <= 0
    if gap_x < 0 and gap_y < 0 and across < 0:
        return True
    if rule == CUT:
        return False
    if float(max(gap_x, gap_y)) >= radius or float(across) > radius * length:
        return False
    for end in range(2):
        ex = float(max(abs(px - end * dx) - HALF, 0))
        ey = float(max(abs(py - end * dy) - HALF, 0))
        if sqrt(ex * ex + ey * ey) < radius:
            return True
    for corner in range(4):
        qx = px - HALF + (corner & 1) * UNITS
        qy = py - HALF + (corner >> 1) * UNITS
        along = qx * dx + qy * dy
        if along > 0 and along < dx * dx + dy * dy and float(abs(qx * dy - qy * dx)) < radius * length:
            return True
    return False


@kernel()
def clear(wall, stride, ax, ay, bx, by, radius, rule):
    """Whether a line between two places meets no wall.

    Parameters
    ----------
    wall : uint8 (n,), 1 where there is a wall; with a frame of one cell, which is none.
    stride : length of a row, frame included.
    ax, ay, bx, by : the places; with ``CUT`` two different ones.
    radius : of the disc, units; float. 0.0 for a point.
    rule : see above.
    """
    dx = bx - ax
    dy = by - ay
    length = sqrt(float(dx * dx + dy * dy))
    reach = int(radius) + HALF + 1
    top = max((min(ay, by) - reach) // UNITS, 0)
    bottom = min((max(ay, by) + reach) // UNITS + 1, len(wall) // stride - 3)
    for row in range(top, bottom + 1):
        # The part of the line that is so near to the row.
        begin = 0.0
        end = 1.0
        if dy != 0:
            one = (row * UNITS - reach - ay) / dy
            two = (row * UNITS + reach - ay) / dy
            begin = max(min(one, two), 0.0)
            end = min(max(one, two), 1.0)
            if begin > end:
                continue
        one = ax + begin * dx
        two = ax + end * dx
        left = max(int(min(one, two) - reach) // UNITS - 1, 0)
        right = min(int(max(one, two) + reach) // UNITS + 1, stride - 3)
        at = (row + 1) * stride + 1
        for column in range(left, right + 1):
            if wall[u64(at + column)] != 0:
                if _hits(column * UNITS - ax, row * UNITS - ay, dx, dy, length, radius, rule):
                    return False
    return True
