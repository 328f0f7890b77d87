"""Shortest paths over the corners of obstacles, and over cell centres that such paths bound.

Everything is on a lattice of whole numbers, half a square apart: square (c, r) spans 2 c to 2 c + 2 and 2 r to
2 r + 2; the corners of squares are even, their centres odd. A blocked square is forbidden inside; along its sides
and through its corners a line may run. What is said of lattice points and of the sides between them:

* ``SIDE_X``, ``SIDE_Y``: the side from the point to the next one in x (in y) may be followed;
* ``SHUT``: no line may pass through the point (two blocked squares meet there and corners may not be cut);
* ``BESIDE``: a blocked square touches the point, and lines between cell centres may not.

Lines of sight are exact, in integers. A path turns at a corner only around the blocked square there, so lines that
would turn away from it are not looked along.
"""

from __future__ import annotations

from math import floor, sqrt

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.heap import put, take

FOUND, EXHAUSTED, LIMIT, FULL = 0, 1, 2, 3
SIDE_X, SIDE_Y, SHUT, BESIDE = 1, 2, 4, 8
NEVER = 1e300
EDGE = 1e-9
"""Half squares by which lengths that are compared with a bound may be off."""
SAME = 1e-11
"""Half squares by which a length must be less to be shorter."""
LARGE = 4096
"""Spans of slopes that there is room for on maps so large that looking around once may take more than a millisecond."""
OFF = 1.4143
"""Half squares from the centre of a square to a line that runs through it, at most."""


@kernel()
def sight(square, node, stride, ax, ay, bx, by, shut):
    """1 where the straight line between two lattice points is free, else 0.

    Parameters
    ----------
    square : uint8 (n,), 1 where a square is free; blocked around.
    node : uint8 (n,), SIDE_X, SIDE_Y, SHUT and BESIDE of each corner, in the same order.
    stride : squares in a row.
    shut : SHUT, or BESIDE: what corners have that no line may pass through.
    """
    dx = bx - ax
    dy = by - ay
    if dy == 0:
        low = min(ax, bx)
        high = max(ax, bx)
        row = (ay >> 1) * stride
        if ay & 1:
            for c in range(low >> 1, (high + 1) >> 1):
                if square[u64(row + c)] == 0:
                    return 0
            return 1
        for c in range(low >> 1, high >> 1):
            flags = node[u64(row + c)]
            if flags & 1 == 0 or (flags & shut != 0 and 2 * c > low):
                return 0
        return 1
    if dx == 0:
        low = min(ay, by)
        high = max(ay, by)
        c = ax >> 1
        if ax & 1:
            for r in range(low >> 1, (high + 1) >> 1):
                if square[u64(r * stride + c)] == 0:
                    return 0
            return 1
        for r in range(low >> 1, high >> 1):
            flags = node[u64(r * stride + c)]
            if flags & 2 == 0 or (flags & shut != 0 and 2 * r > low):
                return 0
        return 1
    x = ax
    y = ay
    last = bx
    if dx < 0:
        x = bx
        y = by
        last = ax
        dx = -dx
        dy = -dy
    # The line's y times dx at the border of each column.
    two = 2 * dx
    here = y * dx
    c = x >> 1
    while x < last:
        border = min(2 * c + 2, last)
        there = here + (border - x) * dy
        for r in range(min(here, there) // two, (max(here, there) - 1) // two + 1):
            if square[u64(r * stride + c)] == 0:
                return 0
        if border < last and there % two == 0 and node[u64(there // two * stride + c + 1)] & shut != 0:
            return 0
        x = border
        here = there
        c += 1
    return 1


@kernel(out=("spans", "seen"))
def in_view(square, stride, x, y, cone, rest, reach, known, own, inset, vertex, spans, seen, halt):
    """List the centres of squares and the corners that can be seen from a lattice point, and perhaps more; how many, or -1.

    The slopes of lines that are still free are followed from column to column, in each of four directions; blocked
    squares cut them. Slopes are floats and kept wider than they are, so that nothing is missing; who needs to know
    asks :func:`sight`.

    Parameters
    ----------
    cone : float64 (8,), the least and the greatest slope of each of the directions +x, +y, -x, -y; within -1 to 1.
    rest, reach : float64 (n,): from the centre of each square to a goal, or less. Squares that no line to the goal
        within ``reach`` runs through are left out, and so is what is behind them.
    known, own : float64 (n,) and a float: centres are left out that are known to be nearer than ``own`` and the line
        to them.
    inset : centres are listed if the line to them is farther from blocked squares than this, as a slope.
    vertex : int32 (n,), which vertex a corner is; -1: none. Of length 1: no corners are listed.
    spans : float64, room for two lists of spans of slopes, as many as squares in a row and a column.
    seen : int32; the result: flat indices of squares, some of them twice, and -1 - vertex of corners. Where it is too
        short, -1 is returned.
    """
    half = len(spans) // 2
    height = len(square) // stride
    corners = len(vertex) > 1
    large = half > LARGE
    most = reach + OFF
    count = 0
    odd = x & 1
    if odd and corners:
        # Its own square: paths begin at its centre.
        at = (y >> 1) * stride + (x >> 1)
        seen[0] = at
        count = 1
        for k in range(4):
            v = vertex[u64(at + (k >> 1) * stride + (k & 1))]
            if v >= 0:
                seen[u64(count)] = -1 - v
                count += 1
    for side in range(4):
        if cone[2 * side] > cone[2 * side + 1]:
            continue
        upright = side & 1
        ahead = 1 if side < 2 else -1
        across = x if upright else y
        rows = stride if upright else height
        most_listed = len(seen) - 3 * rows - 1
        step = stride if upright else 1
        beside = 1 if upright else stride
        aboard = u64(beside)
        beyond = u64(step if ahead == 1 else 0)
        along = y if upright else x
        column = ((along + odd) // 2 if ahead == 1 else (along - odd - 1) // 2) * step
        near = float(odd)
        far = near + 2.0
        base = 0
        spans[0] = cone[2 * side] - 4.0 * EDGE
        spans[1] = cone[2 * side + 1] + 4.0 * EDGE
        many = 1
        while many > 0:
            other = half - base
            kept = 0
            middle = near + 1.0
            squared = middle * middle
            if large and stopped(halt):
                return 0
            if count + 6 * many > most_listed:
                return -1
            for i in range(many):
                low = spans[base + 2 * i]
                high = spans[base + 2 * i + 1]
                first = floor((across + low * (far if low < 0.0 else near) - EDGE) / 2.0)
                last = floor((across + high * (near if high < 0.0 else far) + EDGE) / 2.0)
                if first < 0:
                    first = 0
                if last >= rows:
                    last = rows - 1
                lowest = (low + inset) * middle
                highest = (high - inset) * middle
                at = u64(first * beside + column)
                aside = float(2 * first - across) + 1.0
                shut = 1
                emitted = 0
                for r in range(first, last + 2):
                    upper = high
                    after = high
                    if r <= last:
                        if square[at] != 0:
                            away = squared + aside * aside
                            room = most - rest[at]
                            if room >= 0.0 and away - 2.0 <= room * room:
                                nearer = known[at] - own
                                if nearer > 0.0 and away < nearer * nearer and lowest <= aside <= highest:
                                    seen[u64(count)] = at
                                    count += 1
                                if corners:
                                    if shut:
                                        v = vertex[at + beyond]
                                        if (
                                            v >= 0
                                            and (low - EDGE) * far <= aside - 1.0 <= (high + EDGE) * far
                                        ):
                                            seen[u64(count)] = -1 - v
                                            count += 1
                                    v = vertex[at + beyond + aboard]
                                    if v >= 0 and (low - EDGE) * far <= aside + 1.0 <= (high + EDGE) * far:
                                        seen[u64(count)] = -1 - v
                                        count += 1
                                    shut = 0
                                emitted = 0
                                at += aboard
                                aside += 2.0
                                continue
                        start = aside - 1.0
                        end = aside + 1.0
                        upper = -2.0
                        if start >= 0.0:
                            upper = start / far
                        elif near > 0.0:
                            upper = start / near
                        after = 2.0
                        if end <= 0.0:
                            after = end / far
                        elif near > 0.0:
                            after = end / near
                            nearest = (after - EDGE + inset) * middle
                            if nearest > lowest:
                                lowest = nearest
                        upper += EDGE
                        if upper > high:
                            upper = high
                        after -= EDGE
                        at += aboard
                        aside += 2.0
                    # Between two blocked squares only lines along rows and columns run.
                    if upper >= low and emitted == 0:
                        if kept > 0 and low <= spans[other + 2 * kept - 1]:
                            if upper > spans[other + 2 * kept - 1]:
                                spans[other + 2 * kept - 1] = upper
                        else:
                            spans[other + 2 * kept] = low
                            spans[other + 2 * kept + 1] = upper
                            kept += 1
                    if after > low:
                        low = after
                    shut = 1
                    emitted = 1
                    if low > high:
                        break
            base = other
            many = kept
            column += ahead * step
            near = far
            far += 2.0
    return count


@kernel(out=("cone",))
def open_cone(ex, ey, a, b, cone):
    """The directions in which a shortest path goes on that came to a corner along a line.

    It goes straight on, or turns around the blocked square, until it runs along its side.

    Parameters
    ----------
    ex, ey : the line; 0, 0 where there is none.
    a, b : where the blocked square lies, -1 or 1 each; 0 where a path may turn at will.
    cone : float64 (8,); the result, see :func:`in_view`.
    """
    if a == 0 or (ex == 0 and ey == 0):
        for side in range(4):
            cone[2 * side] = -1.0
            cone[2 * side + 1] = 1.0
        return
    for side in range(4):
        cone[2 * side] = 2.0
        cone[2 * side + 1] = -2.0
    # From here on the side that the path may come to lie along is that of y; else x and y change places.
    swap = 0 if ex * a < 0 or (ex == 0 and ey * b > 0) else 1
    if swap:
        ex, ey = ey, ex
        a, b = b, a
    right = abs(ex)
    up = abs(ey)
    widest = 1.0 if right >= up else float(right) / float(up)
    side = (2 if b < 0 else 0) + 1 - swap
    cone[2 * side] = min(0.0, -a * widest)
    cone[2 * side + 1] = max(0.0, -a * widest)
    if right >= up and right > 0:
        least = float(up) / float(right)
        side = (2 if a > 0 else 0) + swap
        cone[2 * side] = min(b * least, float(b))
        cone[2 * side + 1] = max(b * least, float(b))


@kernel(out=("seen",))
def _along_sides(node, stride, x, y, vertex, seen, count):
    """List more corners: those along sides that may have blocked squares on both sides; how many, or -1."""
    for k in range(4):
        upright = k & 1
        back = k >> 1
        step = (1 - 2 * back) * (stride if upright else 1)
        flag = SIDE_Y if upright else SIDE_X
        at = (y >> 1) * stride + (x >> 1)
        more = 1
        while more:
            v = vertex[u64(at)]
            if v >= 0:
                if count == len(seen):
                    return -1
                seen[u64(count)] = -1 - v
                count += 1
            more = node[u64(at + step * back)] & flag
            at += step
    return count


@kernel(
    out=("f", "g", "parent", "heap", "place", "edges", "to_go", "cone", "spans", "seen", "result"),
    each=20_000,
    of="f",
)
def straight_paths(
    square, node, stride, shut, vx, vy, qx, qy, centres, wide, root, target, bound, onward, budget,
    f, g, h, parent, heap, place, edges, rest, to_go, vertex, inset, cone, spans, seen, result, halt,
):  # fmt: skip
    """Shortest paths of straight lines from one point to all others that may lie on a path to a target within a bound.

    The points are vertices, the two ends and the corners at which a path may turn; or the centres of all squares. A search
    that ended can be continued with all arrays as it left them.

    Parameters
    ----------
    square, node, stride, shut : see :func:`sight`.
    vx, vy : int64 (v,), the vertices: the ends and the corners at which a path may turn.
    qx, qy : int64 (v,), where the blocked square of a corner lies, -1 or 1 each; 0 where a path may turn at will.
    centres : 1 where the points are the centres of squares, else 0.
    wide : 1 to follow sides that may have blocked squares on both sides.
    root, target : points: vertices, or squares by flat index.
    bound : half squares; what lies on no path of this length is left out.
    onward : 1 to go on beyond the target, as far as paths within the bound.
    budget : greatest number of points expanded; -1: no limit.
    f, g : float64, of each point, NEVER before. Afterwards ``g`` is the length of the shortest path to each point that was
        expanded: ``place`` is 0 and ``g`` not NEVER.
    h : float64, of each point: from it to the target, or less.
    parent : int32, of each point: the one before it on its path.
    heap, place : int32, one more than points and as many; empty and zeros before.
    edges : int32 (k, 2) flat: the first pairs of points that were seen to see each other.
    rest : float64 (n,), see :func:`in_view`.
    to_go : float64 (n,), NEVER before; with vertices, the length of the shortest path from the centre of each square to
        the root, where one may lie on a path to the target within the bound; zeros: not asked for.
    vertex, inset, spans, seen : see :func:`in_view`.
    cone : float64 (8,); scratch.
    result : int64 (3,), zeros before: FOUND if the target was reached, EXHAUSTED, LIMIT, or FULL where ``seen`` is too
        short; points expanded; pairs in ``edges``.
    """
    expanded = result[1] + 0
    kept = result[2] + 0
    if expanded == 0:
        g[root] = 0.0
        f[root] = h[root]
        parent[root] = root
        put(heap, place, f, h, root)
    known = g if centres else to_go
    x = 0
    y = 0
    a = 0
    b = 0
    open_cone(0, 0, 0, 0, cone)
    result[0] = EXHAUSTED
    while heap[0] > 0:
        u = heap[1] + 0
        if f[u64(u)] > bound:
            break
        if u == target:
            result[0] = FOUND
            if onward == 0:
                break
        if expanded == budget or stopped(halt):
            result[0] = LIMIT
            break
        own = g[u64(u)]
        looked = 0
        if centres:
            y = u // stride
            x = 2 * (u - y * stride) + 1
            y = 2 * y + 1
        else:
            p = parent[u64(u)]
            x = vx[u64(u)] + 0
            y = vy[u64(u)] + 0
            a = qx[u64(u)] + 0
            b = qy[u64(u)] + 0
            open_cone(x - vx[u64(p)], y - vy[u64(p)], a, b, cone)
        if u != target:
            looked = in_view(
                square, stride, x, y, cone, rest, bound - own, known, own + SAME, inset, vertex, spans, seen, halt
            )  # fmt: skip
            if looked >= 0 and centres == 0:
                seen[u64(looked)] = -1 - target
                looked += 1
                if wide and (x | y) & 1 == 0:
                    looked = _along_sides(node, stride, x, y, vertex, seen, looked)
            if looked < 0:
                result[0] = FULL
                break
        take(heap, place, f, h, u)
        expanded += 1
        for i in range(looked):
            v = int(seen[u64(i)])
            if v >= 0:
                ey = v // stride
                ex = 2 * (v - ey * stride) + 1 - x
                ey = 2 * ey + 1 - y
                if centres == 0:
                    to_go[u64(v)] = min(to_go[u64(v)], own + sqrt(float(ex * ex + ey * ey)))
                    continue
            else:
                v = -1 - v
                ex = vx[u64(v)] - x
                ey = vy[u64(v)] - y
                if ex * a * ey * b > 0 or ex * qx[u64(v)] * ey * qy[u64(v)] > 0:
                    continue
            through = own + sqrt(float(ex * ex + ey * ey))
            if through + SAME >= g[u64(v)] or through + h[u64(v)] > bound:
                continue
            if sight(square, node, stride, x, y, x + ex, y + ey, shut) == 0:
                continue
            g[u64(v)] = through
            f[u64(v)] = through + h[u64(v)]
            parent[u64(v)] = u
            put(heap, place, f, h, v)
            if centres and v == target:
                bound = through + EDGE
            if 2 * kept + 1 < len(edges):
                edges[2 * kept] = u
                edges[2 * kept + 1] = v
                kept += 1
    result[1] = expanded
    result[2] = kept
