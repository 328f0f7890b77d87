"""Arcs in the corners of a polyline: the largest that fit between walls and between neighbours.

An arc that is tangent to both lines of a corner lies within the triangle of the corner and the two points
where it leaves the lines, so it is on the map wherever the lines are. Of its turn only the tangent of the
half is ever needed, which is algebra: ``tan(half) = |cross| / (1 + dot)`` of the two unit vectors.

A small enough arc is as near to its corner as one likes. So one fits wherever the corner itself is farther
from walls than is asked for, and wherever what it touches lies outside the turn. None fits where the disc in
the corner touches a wall on the inside: there the path can only turn in place.
"""

from __future__ import annotations

from math import ceil, floor, sqrt

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.motion.line_of_sight import EDGE, point_square

LEAST = 1e-6
"""A radius (cells) below which an arc is a corner: there what is shaved off the walls would count."""
_HALVINGS, _BISECTIONS = 40, 8


@kernel()
def _within(ux, uy, vx, vy, side, x, y):
    """Whether (x, y), seen from the centre, lies between the ends u and v of an arc."""
    return side * (ux * y - uy * x) >= 0.0 and side * (x * vy - y * vx) >= 0.0


@kernel()
def _arc_square(ux, uy, vx, vy, side, radius, qx, qy):
    """Squared distance between an arc around (0, 0), from u to v, and the square around (qx, qy).

    0: they meet. The arc is less than half a turn.

    They are nearest at an end of the arc, at a corner of the square, or where a side of the square runs as
    the arc does there, which is right, left, above or below the centre.
    """
    best = min(point_square(qx - ux, qy - uy), point_square(qx - vx, qy - vy))
    for k in range(4):
        sign = 1.0 if k & 1 else -1.0
        ex = sign * radius if k & 2 else 0.0
        ey = 0.0 if k & 2 else sign * radius
        if _within(ux, uy, vx, vy, side, ex, ey):
            best = min(best, point_square(qx - ex, qy - ey))
        kx = qx + (EDGE if k & 1 else -EDGE)
        ky = qy + (EDGE if k & 2 else -EDGE)
        if _within(ux, uy, vx, vy, side, kx, ky):
            gap = sqrt(kx * kx + ky * ky) - radius
            best = min(best, gap * gap)
        # A side of the square, at a distance along one axis: where the circle crosses it.
        at = (qx if k & 2 else qy) + sign * EDGE
        rest = radius * radius - at * at
        if rest >= 0.0:
            root = sqrt(rest)
            if k & 2:
                if abs(root - qy) <= EDGE and _within(ux, uy, vx, vy, side, at, root):
                    return 0.0
                if abs(-root - qy) <= EDGE and _within(ux, uy, vx, vy, side, at, -root):
                    return 0.0
            else:
                if abs(root - qx) <= EDGE and _within(ux, uy, vx, vy, side, root, at):
                    return 0.0
                if abs(-root - qx) <= EDGE and _within(ux, uy, vx, vy, side, -root, at):
                    return 0.0
    return best


@kernel()
def _arc_is_clear(wall, width, height, px, py, ax, ay, bx, by, side, tangent, radius, need2):
    """Whether the arc in corner (px, py) between directions a (in) and b (out) stays clear of walls.

    ``tangent``: how far from the corner it leaves the lines. ``need2``: squared distance that is asked for.
    ``side`` is 1 where the path turns from x towards y, else -1.
    """
    # Relative to the corner: ends, chord, centre.
    fx, fy = -tangent * ax, -tangent * ay
    tx, ty = tangent * bx, tangent * by
    ox, oy = fx - side * radius * ay, fy + side * radius * ax
    reach = sqrt(need2)
    # u along the longer axis of the chord, v along the other.
    du, dv, fu, fv, tu, pu, pv = tx - fx, ty - fy, fx, fy, tx, px, py
    wide, high, on, off = width, height, 1, width
    swapped = abs(dv) > abs(du)
    if swapped:
        du, dv, fu, fv, tu, pu, pv = dv, du, fy, fx, ty, py, px
        wide, high, on, off = height, width, width, 1
    chord = sqrt(du * du + dv * dv)
    half = 0.5 * chord
    rise = half * half / (radius + sqrt(max(0.0, radius * radius - half * half)))
    slope = dv / du
    per = chord / abs(du)
    # The corner lies on one side of the chord, and with it the arc; (0, 0) is the corner.
    pad = reach * per + 0.5 * (abs(du) + abs(dv)) / abs(du) + 1e-9
    over = fv - slope * fu
    up = pad + (rise * per if over < 0.0 else 0.0)
    down = pad + (rise * per if over > 0.0 else 0.0)
    first = max(0, ceil(pu + min(fu, tu, 0.0) - 0.5 - reach))
    last = min(wide - 1, floor(pu + max(fu, tu, 0.0) + 0.5 + reach))
    for u in range(first, last + 1):
        middle = pv + fv + slope * (u - pu - fu)
        low = max(0, ceil(middle - down))
        top = min(high - 1, floor(middle + up))
        at = u * on + low * off
        for v in range(low, top + 1):
            if wall[u64(at)]:
                qx = (v if swapped else u) - px - ox
                qy = (u if swapped else v) - py - oy
                gap = _arc_square(fx - ox, fy - oy, tx - ox, ty - oy, side, radius, qx, qy)
                if gap < need2:
                    return False
            at += off
    return True


@kernel()
def _fit(wall, width, height, px, py, ax, ay, bx, by, side, slant, most, least, need2):
    """The longest tangent of a clear arc, at most ``most`` and at least ``least``; 0: none.

    ``slant`` is the tangent of half the turn. Halved until it is clear, then made longer by bisection: within
    1/256 of the longest. (A longer one that is clear again beyond one that is not would pass a
    wall on its other side.)
    """
    bottom = max(least, LEAST * slant)
    if most < bottom:
        return 0.0
    good = most
    bad = most
    clear = _arc_is_clear(wall, width, height, px, py, ax, ay, bx, by, side, good, good / slant, need2)
    for _ in range(_HALVINGS):
        if clear:
            break
        if good <= bottom:
            return 0.0
        bad = good
        good = max(0.5 * good, bottom)
        clear = _arc_is_clear(wall, width, height, px, py, ax, ay, bx, by, side, good, good / slant, need2)
    if not clear:
        return 0.0
    for _ in range(_BISECTIONS if good < bad else 0):
        middle = 0.5 * (good + bad)
        if _arc_is_clear(wall, width, height, px, py, ax, ay, bx, by, side, middle, middle / slant, need2):
            good = middle
        else:
            bad = middle
    return good


@kernel(out=("want",))
def fit_corner_arcs(wall, width, height, xs, ys, hx, hy, slant, side, length, need, radius, least, want):
    """The longest tangent of an arc in each corner that lines and walls leave room for; 0: none.

    Parameters
    ----------
    wall, width, height : bool (height * width,), row by row; what lies outside is not a wall.
    xs, ys : float64 (n,), the corners and both ends.
    hx, hy, length : float64 (n - 1,), unit vector and length of each line.
    slant : float64 (n,), tangent of half the turn; 0 where there is none or where it is a half turn.
    side : float64 (n,), 1 or -1.
    need : float64 (n - 1,), squared distance that each line keeps from walls; an arc keeps the lesser of its
        two lines'.
    radius, least : the largest and the smallest radius, cells.
    want : float64 (n,). Given: how long a tangent may be besides. Out: how long it can be.
    """
    for i in range(1, len(xs) - 1):
        if slant[i] == 0.0:
            want[i] = 0.0
            continue
        most = min(radius * slant[i], want[i], length[i - 1], length[i])
        own = min(need[i - 1], need[i])
        low = least * slant[i]
        a, b, c, d = hx[i - 1], hy[i - 1], hx[i], hy[i]
        want[i] = _fit(wall, width, height, xs[i], ys[i], a, b, c, d, side[i], slant[i], most, low, own)


@kernel(out=("want", "tangent"))
def share(length, slant, least, want, tangent):
    """Divide each line between the arcs at its two ends.

    Parameters
    ----------
    length : float64 (n - 1,), of the lines.
    slant : float64 (n,), tangent of half the turn.
    least : the smallest radius.
    want : float64 (n,), the tangents wished for, at the ends 0; out: 0 where a corner must do without.
    tangent : out, float64 (n,), what each gets.

    Both get their wish if there is room; else who wishes for less than half the line gets that and the
    other the rest, and two who want more get half each. What a corner cannot use, for want of room on its
    other line, goes back to its neighbours, in their order. Where that leaves a corner less than the
    smallest radius needs, the one that lacks most among its neighbours gives up, and the pass is repeated.
    """
    n = len(want)
    for _ in range(n):
        for i in range(n):
            tangent[i] = want[i]
        for k in range(n - 1):
            half = 0.5 * length[k]
            a = want[k]
            b = want[k + 1]
            if a + b > length[k]:
                tangent[k] = min(tangent[k], max(half, length[k] - b))
                tangent[k + 1] = min(tangent[k + 1], max(half, length[k] - a))
        for i in range(1, n - 1):
            tangent[i] = min(want[i], length[i - 1] - tangent[i - 1], length[i] - tangent[i + 1])
        short = False
        for i in range(1, n - 1):
            mine = _lack(tangent, want, slant, least, i)
            if mine > 0.0:
                short = True
                before = _lack(tangent, want, slant, least, i - 1)
                if mine > before and mine >= _lack(tangent, want, slant, least, i + 1):
                    # Negative until all have been looked at.
                    want[i] = -want[i]
        if not short:
            break
        for i in range(n):
            want[i] = max(want[i], 0.0)


@kernel()
def _lack(tangent, want, slant, least, i):
    """Which part of its smallest radius a corner's arc lacks; 0: nothing."""
    if want[i] == 0.0 or slant[i] == 0.0:
        return 0.0
    lack = 1.0 - tangent[i] / (max(least, LEAST) * slant[i])
    return lack if lack > 1e-12 else 0.0
