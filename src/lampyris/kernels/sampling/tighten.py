"""A path made as short as it can be without passing over a wall: it turns where walls make it turn, not at cell centres.

Where a path leads from a over v to b, the shortest path from a to b that lies in this triangle, on the same side of all
walls as v, is the hull, on the side of v, of a, b and the corners of walls in the triangle. It takes the place of v. This
goes on until no v has a shorter one: the path is then the shortest of those that the first one can be deformed into without
passing over a wall. Around the corner of a wall the centre of a disc is led along a polygon around the arc. Every new line is
checked (see :mod:`.sweep`); where one meets a wall, v stays.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.graph.any_angle import CUT
from lampyris.kernels.sampling.sweep import HALF, UNITS, clear

GAIN = 0.0625
"""Units by which a path must be shorter to be taken: about a millionth of a cell."""
SNAP = 4
"""Units that a corner may be beyond a line of the path along a row or a column: a disc that just fits between two walls."""


@kernel()
def _apart(ax, ay, bx, by):
    """Distance between two places."""
    return sqrt(float((bx - ax) * (bx - ax) + (by - ay) * (by - ay)))


@kernel()
def _turn(ax, ay, bx, by, cx, cy):
    """Positive where a path from a over b to c turns from the x axis towards the y axis."""
    return (bx - ax) * (cy - by) - (by - ay) * (cx - bx)


@kernel()
def _sign(value):
    """-1, 0 or 1."""
    return 1 if value > 0 else -1 if value < 0 else 0


@kernel(out=("found",))
def _corners(wall, stride, ax, ay, vx, vy, bx, by, side, corner, reach, rule, found):
    """Where a path in the triangle a, v, b may turn: x and y into ``found``; how many, or -1 if there is no room for them.

    Parameters
    ----------
    wall, stride, rule : see :func:`lampyris.kernels.sampling.sweep.clear`.
    side : the sign of the turn at v.
    corner : int64 (2 k,): x, y of the places around the corner of a wall, seen from it, to where it points down and right.
    reach : the greatest of them.
    """
    many = 0
    deep = reach + UNITS
    top = max((min(ay, min(vy, by)) - deep) // UNITS, 0)
    bottom = min((max(ay, max(vy, by)) + deep) // UNITS + 1, len(wall) // stride - 3)
    for row in range(top, bottom + 1):
        low = row * UNITS - deep
        high = row * UNITS + deep
        least = float(stride * UNITS)
        most = -1.0
        for k in range(3):
            px = ax if k == 0 else vx if k == 1 else bx
            py = ay if k == 0 else vy if k == 1 else by
            qx = vx if k == 0 else bx if k == 1 else ax
            qy = vy if k == 0 else by if k == 1 else ay
            begin = 0.0
            end = 1.0
            if py != qy:
                one = (low - py) / (qy - py)
                two = (high - py) / (qy - py)
                begin = max(min(one, two), 0.0)
                end = min(max(one, two), 1.0)
            elif py < low or py > high:
                continue
            if begin <= end:
                one = px + begin * (qx - px)
                two = px + end * (qx - px)
                least = min(least, min(one, two))
                most = max(most, max(one, two))
        if most < 0.0:
            continue
        left = max(int(least - deep) // UNITS - 1, 0)
        right = min(int(most + deep) // UNITS + 1, stride - 3)
        at = (row + 1) * stride + 1
        for column in range(left, right + 1):
            if wall[u64(at + column)] == 0:
                continue
            mx = column * UNITS
            my = row * UNITS
            for sy in range(-1, 2, 2):
                if wall[u64(at + column + sy * stride)] != 0:
                    continue
                for sx in range(-1, 2, 2):
                    if wall[u64(at + column + sx)] != 0:
                        continue
                    if rule != CUT and wall[u64(at + column + sx + sy * stride)] != 0:
                        continue
                    for k in range(0, len(corner), 2):
                        qx = mx + sx * (HALF + corner[u64(k)])
                        qy = my + sy * (HALF + corner[u64(k + 1)])
                        first = side * _turn(ax, ay, vx, vy, qx, qy)
                        second = side * _turn(vx, vy, bx, by, qx, qy)
                        if first < 0:
                            # The line over it is one along a wall from which the disc has just its radius.
                            if ay == vy and abs(qy - ay) <= SNAP:
                                qy = ay + 0
                            elif ax == vx and abs(qx - ax) <= SNAP:
                                qx = ax + 0
                            else:
                                continue
                            first = 0
                            second = side * _turn(vx, vy, bx, by, qx, qy)
                        if second < 0:
                            if vy == by and abs(qy - by) <= SNAP:
                                qy = by + 0
                            elif vx == bx and abs(qx - bx) <= SNAP:
                                qx = bx + 0
                            else:
                                continue
                            second = 0
                            first = side * _turn(ax, ay, vx, vy, qx, qy)
                            if first < 0:
                                continue
                        if side * _turn(bx, by, ax, ay, qx, qy) <= 0:
                            continue
                        # On a line of the path: only if its wall is on the side towards which the path moves.
                        if first == 0 and side * _turn(ax, ay, vx, vy, mx, my) <= 0:
                            continue
                        if second == 0 and side * _turn(vx, vy, bx, by, mx, my) <= 0:
                            continue
                        if 2 * many + 2 > len(found):
                            return -1
                        found[u64(2 * many)] = qx
                        found[u64(2 * many + 1)] = qy
                        many += 1
    return many


@kernel(out=("hull",))
def _around(ax, ay, bx, by, side, found, many, hull):
    """The hull of a, b and the places found, from a to b on their side: x and y into ``hull``; how many, or -1: no room."""
    hull[0] = ax
    hull[1] = ay
    count = 1
    px = ax + 0
    py = ay + 0
    while px != bx or py != by:
        nx = bx + 0
        ny = by + 0
        for k in range(many):
            qx = found[u64(2 * k)]
            qy = found[u64(2 * k + 1)]
            if qx == px and qy == py:
                continue
            out = side * _turn(px, py, nx, ny, qx, qy)
            if out < 0:
                nx = qx + 0
                ny = qy + 0
            elif out == 0:
                ahead = (qx - px) * (nx - px) + (qy - py) * (ny - py)
                if ahead > (nx - px) * (nx - px) + (ny - py) * (ny - py):
                    nx = qx + 0
                    ny = qy + 0
        if 2 * count + 2 > len(hull):
            return -1
        hull[u64(2 * count)] = nx
        hull[u64(2 * count + 1)] = ny
        count += 1
        px = nx + 0
        py = ny + 0
    return count


@kernel(out=("x", "y"))
def _put(x, y, count, first, last, hull, some):
    """Put the places of a hull between two vertices, in place of what is between them; return how many vertices there are."""
    more = some - 1 - (last - first)
    if more > 0:
        for k in range(count - 1, last - 1, -1):
            x[u64(k + more)] = x[u64(k)]
            y[u64(k + more)] = y[u64(k)]
    elif more < 0:
        for k in range(last, count):
            x[u64(k + more)] = x[u64(k)]
            y[u64(k + more)] = y[u64(k)]
    for k in range(1, some - 1):
        x[u64(first + k)] = hull[u64(2 * k)]
        y[u64(first + k)] = hull[u64(2 * k + 1)]
    return count + more


@kernel(out=("x", "y", "found", "hull"), of="hull", each=400_000)
def tighten(wall, stride, corner, reach, radius, rule, many, x, y, found, hull, halt):
    """Make a path of free lines shorter; return how many vertices it has then.

    Parameters
    ----------
    wall, stride, radius, rule : see :func:`lampyris.kernels.sampling.sweep.clear`.
    corner, reach : see :func:`_corners`.
    many : vertices of the path.
    x, y : int64 (m,): the vertices, places; and room.
    found : int64 (2 f,): scratch.
    hull : int64 (2 h,): scratch.
    """
    count = many + 0
    k = 1
    left = 50 * many + 500
    while k < count - 1 and left > 0:
        if stopped(halt):
            return count
        left -= 1
        ax = x[u64(k - 1)]
        ay = y[u64(k - 1)]
        vx = x[u64(k)]
        vy = y[u64(k)]
        bx = x[u64(k + 1)]
        by = y[u64(k + 1)]
        side = _sign(_turn(ax, ay, vx, vy, bx, by))
        some = 2
        hull[0] = ax
        hull[1] = ay
        hull[2] = bx
        hull[3] = by
        if side != 0:
            corners = _corners(wall, stride, ax, ay, vx, vy, bx, by, side, corner, reach, rule, found)
            some = _around(ax, ay, bx, by, side, found, corners, hull) if corners >= 0 else -1
        before = _apart(ax, ay, vx, vy) + _apart(vx, vy, bx, by)
        better = some >= 2 and count + some < len(x)
        if better and side != 0:
            after = 0.0
            for i in range(some - 1):
                after += _apart(
                    hull[u64(2 * i)], hull[u64(2 * i + 1)], hull[u64(2 * i + 2)], hull[u64(2 * i + 3)]
                )
            better = after < before - GAIN
        if better:
            for i in range(some - 1):
                if better and not clear(
                    wall, stride, hull[u64(2 * i)], hull[u64(2 * i + 1)], hull[u64(2 * i + 2)], hull[u64(2 * i + 3)],
                    radius, rule,
                ):  # fmt: skip
                    better = False
        if better:
            count = _put(x, y, count, k - 1, k + 1, hull, some)
            # The angles at a and at b are others now.
            k = max(k - 1, 1)
        else:
            k += 1
    return count
