"""How near points and walls are to a robot's footprint at the poses of a curve.

A footprint is a simple polygon, convex or not; of one vertex it is a point. Its frame has x ahead and y to the left, in
metres. Positions on the map are in cells, y down. The arithmetic is ``+ - * /`` and roots, the same in both forms.
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel
from lampyris.kernels.motion.curve_motion import chord, piece_of, place


@kernel()
def point_gap(vx, vy, px, py):
    """Distance from a point to a polygon: to its nearest edge, negative inside."""
    count = len(vx)
    best = math.inf
    inside = False
    jx = vx[count - 1]
    jy = vy[count - 1]
    for i in range(count):
        ix = vx[i]
        iy = vy[i]
        ex = jx - ix
        ey = jy - iy
        wx = px - ix
        wy = py - iy
        square = ex * ex + ey * ey
        if square > 0.0:
            share = (wx * ex + wy * ey) / square
            share = 0.0 if share < 0.0 else (1.0 if share > 1.0 else share)
            wx -= share * ex
            wy -= share * ey
        d = wx * wx + wy * wy
        if d < best:
            best = d
        if (iy > py) != (jy > py) and px < ix + ex * (py - iy) / ey:
            inside = not inside
        jx = ix
        jy = iy
    best = math.sqrt(best)
    return -best if inside else best


@kernel()
def outlines_gap(vx, vy, wx, wy):
    """Distance between two polygons of one frame; 0 where they touch or overlap.

    Two that are apart are nearest at a vertex of one of them. Two that overlap have a vertex of one in the other, or
    edges that cross.
    """
    best = math.inf
    for i in range(len(wx)):
        best = min(best, point_gap(vx, vy, wx[i], wy[i]))
        if best <= 0.0:
            return 0.0
    for i in range(len(vx)):
        best = min(best, point_gap(wx, wy, vx[i], vy[i]))
        if best <= 0.0:
            return 0.0
    ax = vx[len(vx) - 1]
    ay = vy[len(vx) - 1]
    for i in range(len(vx)):
        bx = vx[i]
        by = vy[i]
        cx = wx[len(wx) - 1]
        cy = wy[len(wx) - 1]
        c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        for j in range(len(wx)):
            dx = wx[j]
            dy = wy[j]
            d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
            if c * d < 0.0:
                a = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
                b = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
                if a * b < 0.0:
                    return 0.0
            cx = dx
            cy = dy
            c = d
        ax = bx
        ay = by
    return best


@kernel()
def in_frame(px, py, hx, hy, begins, kappa, cosine, sine, turn, resolution, k, s, ox, oy):
    """A point of the map (cells) in the robot's frame (metres) where it is at distance ``s`` on piece ``k``."""
    x, y = place(px, py, hx, hy, begins, kappa, resolution, k, s)
    _, up, along = chord(turn[k] * (s - begins[k]))
    c = cosine[k] * along - sine[k] * up
    q = sine[k] * along + cosine[k] * up
    dx = (ox - x) * resolution
    dy = (y - oy) * resolution
    return c * dx + q * dy, c * dy - q * dx


@kernel(out=("gap",), each=2000)
def gaps_at(px, py, hx, hy, begins, kappa, cosine, sine, turn, pieces, resolution, vx, vy, s, xs, ys, gap):
    """Distance from each point (cells) to the footprint at distance ``s``, metres, negative inside; into ``gap``."""
    k = piece_of(begins, pieces, s, 0)
    for i in range(len(xs)):
        ax, ay = in_frame(px, py, hx, hy, begins, kappa, cosine, sine, turn, resolution, k, s, xs[i], ys[i])
        gap[i] = point_gap(vx, vy, ax, ay)


@kernel(out=("gap",), each=50_000)
def least_gaps(
    px,
    py,
    hx,
    hy,
    begins,
    kappa,
    cosine,
    sine,
    turn,
    pieces,
    moved,
    rate,
    resolution,
    vx,
    vy,
    s0,
    s1,
    parts,
    xs,
    ys,
    gap,
):
    """A lower bound of each point's distance to the footprint at all distances from ``s0`` to ``s1``; into ``gap``.

    The range is looked at in ``parts``. Where a point of the robot moves m between two places with the gaps a and b, the
    gap is at least ``(a + b - m) / 2`` on the way.

    Parameters
    ----------
    moved, rate : metres that a point of the robot moves at most from the beginning of the curve to that of each piece, and
        a metre of each piece.
    """
    for i in range(len(xs)):
        k = piece_of(begins, pieces, s0, 0)
        ax, ay = in_frame(px, py, hx, hy, begins, kappa, cosine, sine, turn, resolution, k, s0, xs[i], ys[i])
        before = point_gap(vx, vy, ax, ay)
        there = moved[k] + rate[k] * (s0 - begins[k])
        least = before
        for j in range(1, parts + 1):
            s = s1 if j == parts else s0 + (s1 - s0) * j / parts
            k = piece_of(begins, pieces, s, k)
            ax, ay = in_frame(
                px, py, hx, hy, begins, kappa, cosine, sine, turn, resolution, k, s, xs[i], ys[i]
            )
            after = point_gap(vx, vy, ax, ay)
            to = moved[k] + rate[k] * (s - begins[k])
            least = min(least, 0.5 * (before + after - (to - there)))
            before = after
            there = to
        gap[i] = least


@kernel()
def square_gap(ax, ay, bx, by, cx, cy):
    """Distance from a line segment to the unit square around (cx, cy); 0 where they meet."""
    ax -= cx
    ay -= cy
    bx -= cx
    by -= cy
    dx = bx - ax
    dy = by - ay
    first = 0.0
    last = 1.0
    if dx == 0.0:
        if abs(ax) >= 0.5:
            last = -1.0
    else:
        p = (-0.5 - ax) / dx
        q = (0.5 - ax) / dx
        first = max(first, min(p, q))
        last = min(last, max(p, q))
    if dy == 0.0:
        if abs(ay) >= 0.5:
            last = -1.0
    else:
        p = (-0.5 - ay) / dy
        q = (0.5 - ay) / dy
        first = max(first, min(p, q))
        last = min(last, max(p, q))
    if first < last:
        return 0.0
    gx = max(abs(ax) - 0.5, 0.0)
    gy = max(abs(ay) - 0.5, 0.0)
    best = gx * gx + gy * gy
    gx = max(abs(bx) - 0.5, 0.0)
    gy = max(abs(by) - 0.5, 0.0)
    best = min(best, gx * gx + gy * gy)
    square = dx * dx + dy * dy
    if square > 0.0:
        for corner in range(4):
            qx = (0.5 if corner & 1 else -0.5) - ax
            qy = (0.5 if corner & 2 else -0.5) - ay
            share = (qx * dx + qy * dy) / square
            share = 0.0 if share < 0.0 else (1.0 if share > 1.0 else share)
            qx -= share * dx
            qy -= share * dy
            best = min(best, qx * qx + qy * qy)
    return math.sqrt(best)


@kernel(out=("cells_x", "cells_y"))
def outline_gap(blocked, width, height, vx, vy, x, y, cosine, sine, cells_x, cells_y, most):
    """Distance from a polygon to the nearest blocked square, cells; ``most`` if none is nearer than that."""
    count = len(vx)
    low_x = math.inf
    low_y = math.inf
    high_x = -math.inf
    high_y = -math.inf
    for v in range(count):
        px = x + cosine * vx[v] - sine * vy[v]
        py = y - (sine * vx[v] + cosine * vy[v])
        cells_x[v] = px
        cells_y[v] = py
        low_x = min(low_x, px)
        low_y = min(low_y, py)
        high_x = max(high_x, px)
        high_y = max(high_y, py)
    best = most
    left = max(math.floor(low_x - best), 0)
    right = min(math.ceil(high_x + best), width - 1)
    top = max(math.floor(low_y - best), 0)
    bottom = min(math.ceil(high_y + best), height - 1)
    for row in range(top, bottom + 1):
        if row - 0.5 > high_y + best or row + 0.5 < low_y - best:
            continue
        for column in range(left, right + 1):
            if not blocked[row * width + column]:
                continue
            jx = cells_x[count - 1]
            jy = cells_y[count - 1]
            inside = False
            for v in range(count):
                ix = cells_x[v]
                iy = cells_y[v]
                best = min(best, square_gap(ix, iy, jx, jy, column, row))
                if (iy > row) != (jy > row) and column < ix + (jx - ix) * (row - iy) / (jy - iy):
                    inside = not inside
                jx = ix
                jy = iy
            if inside:
                best = 0.0
    return best


@kernel(out=("cells_x", "cells_y", "gap"), each=20_000, of="xs")
def wall_gaps(blocked, width, height, vx, vy, xs, ys, cosine, sine, cells_x, cells_y, gap):
    """Distance from the footprint to the nearest blocked square at each pose, cells; into ``gap``.

    Parameters
    ----------
    blocked : bool (height * width,), row by row.
    vx, vy : vertices, cells.
    xs, ys, cosine, sine : the poses: cells, and the direction ahead, y up.
    cells_x, cells_y : room for the vertices on the map.
    gap : given: the distance from the base to the nearest blocked square, or how far to look if that is less. It stays
        where no square is nearer to the footprint.
    """
    for i in range(len(xs)):
        gap[i] = outline_gap(
            blocked, width, height, vx, vy, xs[i], ys[i], cosine[i], sine[i], cells_x, cells_y, gap[i]
        )  # fmt: skip
