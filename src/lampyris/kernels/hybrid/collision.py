"""Whether a footprint that moves along a straight line or an arc touches a wall.

A piece of the motion is judged at the pose in its middle: no point of the footprint is farther from where it is then
than half of what it moves in all (``margin``). If the footprint widened by the margin is free, the piece is; if the
footprint as it is touches a wall, it is not; else both halves are judged. What is undecided at a margin of
:data:`FINE` counts as a collision, so that none is ever missed.

Positions are in cells of the padded map, (0, 0) the centre of its first cell, y down; angles turn from x to y.
"""

from __future__ import annotations

from math import ceil, floor, sqrt

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.curves.angles import sine_cosine
from lampyris.kernels.curves.sampling import moved

FINE = 0.05
"""Margin, in cells, below which a piece is not halved any more."""
COARSE = 0.75
"""Margin, in cells, up to which the edges of the widened footprint are looked at."""
ROUND = 1e-6
"""Cells by which rounding may move a footprint."""


@kernel()
def edges_free(wall, stride, x, y, c, s, px, py, margin):
    """Whether the edges of a polygon at a pose, widened by a margin along each axis, touch no wall.

    Parameters
    ----------
    wall : uint8 (cells,).
    stride : cells of a row.
    x, y, c, s : position; cosine and sine of the yaw.
    px, py : float64 (k,): vertices in the frame of the robot.
    """
    k = len(px)
    half = 0.5 + margin
    ax = x + c * px[u64(k - 1)] - s * py[u64(k - 1)]
    ay = y + s * px[u64(k - 1)] + c * py[u64(k - 1)]
    for i in range(k):
        bx = x + c * px[u64(i)] - s * py[u64(i)]
        by = y + s * px[u64(i)] + c * py[u64(i)]
        if ax <= bx:
            x0, y0, x1, y1 = ax, ay, bx, by
        else:
            x0, y0, x1, y1 = bx, by, ax, ay
        slope = (y1 - y0) / (x1 - x0) if x1 > x0 else 0.0
        column = floor(x0 - half) + 1
        last = ceil(x1 + half) - 1
        while column <= last:
            if x1 > x0:
                ya = y0 + slope * (max(x0, column - half) - x0)
                yb = y0 + slope * (min(x1, column + half) - x0)
            else:
                ya = y0
                yb = y1
            if ya > yb:
                ya, yb = yb, ya
            row = floor(ya - half) + 1
            bottom = ceil(yb + half) - 1
            at = row * stride + column
            while row <= bottom:
                if wall[u64(at)] != 0:
                    return False
                row += 1
                at += stride
            column += 1
        ax = bx
        ay = by
    return True


@kernel(inline=True)
def _discs_free(clear, stride, rows, x, y, c, s, cover, margin):
    """Whether discs that cover the footprint at a pose are farther than a margin from every wall."""
    for k in range(0, len(cover), 3):
        px = x + c * cover[u64(k)] - s * cover[u64(k + 1)]
        py = y + s * cover[u64(k)] + c * cover[u64(k + 1)]
        column = floor(px + 0.5)
        row = floor(py + 0.5)
        # What is known at the centre of the cell is known at the point but for the distance between the two.
        need = cover[u64(k + 2)] + margin
        spare = clear[u64(row * stride + column)] - need
        if spare < 0.0 or (px - column) * (px - column) + (py - row) * (py - row) > spare * spare:
            return False
    return True


@kernel()
def judge(wall, clear, stride, rows, border, px, py, cover, inner, outer, x, y, c, s, margin, last):
    """What is known at one pose of a piece: 1 free all along, 0 a collision, 2 neither.

    Parameters
    ----------
    wall, clear : uint8, float32 (cells,): walls; distance from the centre of a cell to the nearest wall.
    stride, rows, border : of the padded map: cells of a row, rows, cells of its border on each side.
    px, py, inner, outer : outline, radii of the discs around the base inside it and around it.
    cover : float64 (3 k,): x, y, radius of discs in the frame of the robot that together cover it.
    x, y, c, s : the pose, with the cosine and sine of its yaw.
    margin : no point is farther from where it is at this pose during the piece.
    last : whether the piece shall not be halved.
    """
    edge = min(min(x, y) - border, min(stride - 1 - border - x, rows - 1 - border - y)) + 0.5
    if edge <= 0.0:
        return 0  # the base is off the map
    column = floor(x + 0.5)
    row = floor(y + 0.5)
    room = clear[u64(row * stride + column)]
    off = sqrt((x - column) * (x - column) + (y - row) * (y - row))
    if room + off < inner - 1e-5:
        return 0
    if edge >= margin:
        if room - off >= outer + margin + 1e-5:
            return 1
        if _discs_free(clear, stride, rows, x, y, c, s, cover, margin + 1e-5):
            return 1
        if margin <= COARSE and edges_free(wall, stride, x, y, c, s, px, py, margin + ROUND):
            return 1
    if last or not edges_free(wall, stride, x, y, c, s, px, py, 0.0):
        return 0
    return 2


@kernel()
def piece_free(
    wall, clear, stride, rows, border, px, py, cover, inner, outer, x, y, yaw, length, turn, lateral
):
    """Whether the footprint touches no wall along one segment; it is known to be free where the segment begins.

    Parameters
    ----------
    x, y, yaw : where the segment begins.
    length, turn, lateral : see :func:`lampyris.kernels.curves.sampling.moved`.
    """
    margin = 0.5 * (abs(length) + abs(turn) * outer)
    parts = 1
    i = 0
    while True:
        share = (2 * i + 1) / (2 * parts)
        mx, my, angle = moved(x, y, yaw, share * length, share * turn, lateral)
        s, c = sine_cosine(angle)
        found = judge(
            wall,
            clear,
            stride,
            rows,
            border,
            px,
            py,
            cover,
            inner,
            outer,
            mx,
            my,
            c,
            s,
            margin,
            margin <= FINE,
        )
        if found == 0:
            return False
        if found == 2:
            parts *= 2
            margin *= 0.5
            i *= 2
            continue
        i += 1
        while i & 1 == 0 and parts > 1:
            i >>= 1
            parts >>= 1
            margin *= 2.0
        if i == parts:
            return True
