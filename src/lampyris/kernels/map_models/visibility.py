"""Shortest paths over the corners of obstacles, and over cell centres that such paths bound.

Everything is on a lattice of whole numbers, half a square apart: square (c, r) spans 2 c to 2 c + 2 and 2 r to
2 r + 2; the corners of squares are even, their centres odd. A blocked square is forbidden inside; along its sides
and through its corners a line may run. What is said of lattice points and of the sides between them:

* ``SIDE_X``, ``SIDE_Y``: the side from the point to the next one in x (in y) may be followed;
* ``SHUT``: no line may pass through the point (two blocked squares meet there and corners may not be cut).

Lines of sight are exact, in integers. A path turns at a corner only around the blocked square there, so lines that
would turn away from it are not looked along.
"""

from __future__ import annotations

from math import floor, sqrt

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.graph.any_angle import sees
from lampyris.kernels.heap import put, take

FOUND, EXHAUSTED, LIMIT = 0, 1, 2
SIDE_X, SIDE_Y, SHUT = 1, 2, 4
NEVER = 1e300
EDGE = 1e-9
"""Half squares by which lengths that are compared with a bound may be off."""


@kernel()
def sight(square, node, stride, ax, ay, bx, by):
    """1 where the straight line between two lattice points is free, else 0.

    Parameters
    ----------
    square : uint8 (n,), 1 where a square is free; blocked around.
    node : uint8 (n,), SIDE_X, SIDE_Y and SHUT of each corner, in the same order.
    stride : squares in a row.
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
            if flags & 1 == 0 or (flags & 4 != 0 and 2 * c > low):
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
            if flags & 2 == 0 or (flags & 4 != 0 and 2 * r > low):
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
        if border < last and there % two == 0 and node[u64(there // two * stride + c + 1)] & 4 != 0:
            return 0
        x = border
        here = there
        c += 1
    return 1


@kernel(out=("spans", "squares"))
def in_view(square, stride, x, y, spans, squares):
    """List all free squares that can be seen from a lattice point, and perhaps a few more; how many.

    The slopes of lines that are still free are followed from column to column, in each of four directions; blocked
    squares cut them. Slopes are floats and kept wider than they are, so that no square is missing; who needs to know
    asks :func:`sight`.

    Parameters
    ----------
    spans : float64, room for two lists of spans of slopes, as many as squares in a row and a column.
    squares : int32; the result, flat indices, some of them twice. Where it is too short, -1 is returned.
    """
    half = len(spans) // 2
    height = len(square) // stride
    count = 0
    for side in range(4):
        upright = side & 1
        ahead = 1 if side < 2 else -1
        along = y if upright else x
        across = x if upright else y
        rows = stride if upright else height
        step = stride if upright else 1
        beside = 1 if upright else stride
        k = along >> 1 if ahead == 1 else (along - 1) >> 1
        near = 0.0
        far = float(2 * k + 2 - along if ahead == 1 else along - 2 * k)
        base = 0
        spans[0] = -1.0
        spans[1] = 1.0
        many = 1
        while many > 0:
            other = half - base
            kept = 0
            for i in range(many):
                low = spans[base + 2 * i]
                high = spans[base + 2 * i + 1]
                first = max(0, floor((across + min(low * near, low * far) - EDGE) / 2.0))
                last = min(rows - 1, floor((across + max(high * near, high * far) + EDGE) / 2.0))
                shut = 0
                for r in range(first, last + 2):
                    upper = high
                    after = high
                    if r <= last:
                        at = r * beside + k * step
                        if square[u64(at)] != 0:
                            if count == len(squares):
                                return -1
                            squares[u64(count)] = at
                            count += 1
                            shut = 0
                            continue
                        start = float(2 * r - across)
                        end = start + 2.0
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
                        upper = min(high, upper + EDGE)
                        after -= EDGE
                    # Between two blocked squares only lines along rows and columns run.
                    if upper >= low and shut == 0:
                        if kept > 0 and low <= spans[other + 2 * kept - 1]:
                            spans[other + 2 * kept - 1] = max(upper, spans[other + 2 * kept - 1])
                        else:
                            spans[other + 2 * kept] = low
                            spans[other + 2 * kept + 1] = upper
                            kept += 1
                    low = max(low, after)
                    shut = 1
                    if low > high:
                        break
            base = other
            many = kept
            k += ahead
            near = far
            far += 2.0
    return count


@kernel(out=("tried", "spans", "squares", "seen"))
def corners_in_view(square, node, stride, x, y, vertex, tried, turn, spans, squares, seen):
    """List the ends and all corners that can be seen from a lattice point, and perhaps more; how many, or -1.

    Parameters
    ----------
    vertex : int32 (n,), which vertex a corner is; -1: none.
    tried : int32 (v,), the last turn at which a vertex was listed; ``turn`` : one that was not before.
    spans, squares : see :func:`in_view`; -1 is returned where it does.
    seen : int32 (v,); the result.
    """
    looked = in_view(square, stride, x, y, spans, squares)
    if looked < 0:
        return -1
    seen[0] = 0
    seen[1] = 1
    count = 2
    for i in range(looked):
        for k in range(4):
            v = vertex[u64(squares[u64(i)] + (k >> 1) * stride + (k & 1))]
            if v >= 0 and tried[u64(v)] != turn:
                tried[u64(v)] = turn
                seen[u64(count)] = v
                count += 1
    if (x | y) & 1:
        return count
    # The point itself, and along sides that may have blocked squares on both sides.
    for k in range(4):
        upright = k & 1
        back = k >> 1
        step = (1 - 2 * back) * (stride if upright else 1)
        flag = SIDE_Y if upright else SIDE_X
        at = (y >> 1) * stride + (x >> 1)
        more = 1
        while more:
            v = vertex[u64(at)]
            if v >= 0 and tried[u64(v)] != turn:
                tried[u64(v)] = turn
                seen[u64(count)] = v
                count += 1
            more = node[u64(at + step * back)] & flag
            at += step
    return count


@kernel(
    out=("f", "g", "parent", "closed", "heap", "place", "edges", "tried", "spans", "squares", "seen", "result"),
    each=20_000, of="vx",
)  # fmt: skip
def corner_tree(
    square, node, stride, vx, vy, qx, qy, root, target, bound, budget,
    f, g, h, parent, closed, heap, place, edges, vertex, tried, spans, squares, seen, result, halt,
):  # fmt: skip
    """Shortest paths from one vertex to every other that may lie on a path to the target within a bound.

    Parameters
    ----------
    vx, vy : int64 (v,), the vertices: the ends and the corners at which a path may turn.
    qx, qy : int64 (v,), where the blocked square of a corner lies, -1 or 1 each; 0 where a path may turn at will.
    root, target : vertices.
    bound : half squares; what lies on no path of this length is left out.
    budget : greatest number of vertices expanded; -1: no limit.
    f, g : float64 (v,), NEVER before. Afterwards ``g`` is the length of the shortest path of each closed vertex.
    h : float64 (v,), straight distance to the target.
    parent : int32 (v,); scratch.
    closed : uint8 (v,), 0 before.
    heap, place : int32 (v + 1,) and (v,), 0 before.
    edges : int32 (k, 2) flat: the first pairs of vertices that were seen to see each other.
    vertex, tried, spans, squares, seen : see :func:`corners_in_view`; ``tried`` 0 before. Where it lists nothing all
        vertices are looked at: ``squares`` says from how many squares on that is less work.
    result : int64 (3,): FOUND if the target was reached, EXHAUSTED or LIMIT; vertices expanded; pairs in ``edges``.
    """
    g[root] = 0.0
    f[root] = h[root]
    parent[root] = root
    put(heap, place, f, h, root)
    expanded = 0
    kept = 0
    result[0] = EXHAUSTED
    while heap[0] > 0:
        u = heap[1] + 0
        if expanded == budget or stopped(halt):
            result[0] = LIMIT
            break
        take(heap, place, f, h, u)
        closed[u64(u)] = 1
        expanded += 1
        if u == target:
            result[0] = FOUND
            continue
        x = vx[u64(u)]
        y = vy[u64(u)]
        a = qx[u64(u)]
        b = qy[u64(u)]
        looked = corners_in_view(square, node, stride, x, y, vertex, tried, expanded, spans, squares, seen)
        for i in range(len(vx) if looked < 0 else looked):
            v = i
            if looked >= 0:
                v = int(seen[u64(i)])
            if closed[u64(v)] != 0:
                continue
            ex = vx[u64(v)] - x
            ey = vy[u64(v)] - y
            if ex * a * ey * b > 0 or ex * qx[u64(v)] * ey * qy[u64(v)] > 0:
                continue
            through = g[u64(u)] + sqrt(float(ex * ex + ey * ey))
            if through >= g[u64(v)] or through + h[u64(v)] > bound:
                continue
            if sight(square, node, stride, x, y, x + ex, y + ey) == 0:
                continue
            g[u64(v)] = through
            f[u64(v)] = through + h[u64(v)]
            parent[u64(v)] = u
            put(heap, place, f, h, v)
            if 2 * kept + 1 < len(edges):
                edges[2 * kept] = u
                edges[2 * kept + 1] = v
                kept += 1
    result[1] = expanded
    result[2] = kept


@kernel()
def _nearest(square, node, stride, vx, vy, qx, qy, g, closed, x, y, seen, looked, most):
    """Length of the shortest path from a tree's root to a lattice point; over ``most`` if it is longer than that.

    ``seen`` : the first ``looked`` are the vertices to consider; all where ``looked`` is -1.
    """
    best = most
    for i in range(len(vx) if looked < 0 else looked):
        v = i
        if looked >= 0:
            v = int(seen[u64(i)])
        if closed[u64(v)] == 0 or g[u64(v)] >= best:
            continue
        ex = x - vx[u64(v)]
        ey = y - vy[u64(v)]
        if ex * qx[u64(v)] * ey * qy[u64(v)] > 0:
            continue
        through = g[u64(v)] + sqrt(float(ex * ex + ey * ey))
        if through < best and sight(square, node, stride, vx[u64(v)], vy[u64(v)], x, y) == 1:
            best = through
    return best


@kernel(out=("cells", "to_go", "queue", "mark", "tried", "spans", "squares", "seen", "result"), each=20_000)
def cells_within(
    square, node, stride, vx, vy, qx, qy, g_start, closed_start, g_goal, closed_goal, start, bound, reach,
    cells, to_go, queue, mark, vertex, tried, spans, squares, seen, result, halt,
):  # fmt: skip
    """The free cells that lie on a continuous path from start to goal within a bound; how many.

    Such points form one region, as every point is joined to the straightest path by its own: so they are met by
    going from cell to neighbour within ``reach``, a bound that is wider by what a cell's centre may be off.

    Parameters
    ----------
    vx .. qy : see :func:`corner_tree`; vertex 0 is the start, vertex 1 the goal.
    g_start, closed_start, g_goal, closed_goal : trees from both ends, grown within ``reach``.
    start : flat index of the square of the start.
    cells : int32 (n,); the result: flat indices, the start first.
    to_go : float64 (n,); the result: from each of them to the goal.
    queue : int32 (n,), mark : uint8 (n,), 0 before; scratch.
    vertex .. seen : see :func:`corner_tree`.
    result : int64 (1,); cells looked at.
    """
    queue[0] = start
    mark[start] = 1
    first = 0
    count = 1
    found = 0
    while first < count:
        at = queue[u64(first)] + 0
        first += 1
        if stopped(halt):
            break
        r = at // stride
        x = 2 * (at - r * stride) + 1
        y = 2 * r + 1
        gx = vx[1] - x
        gy = vy[1] - y
        straight = sqrt(float(gx * gx + gy * gy))
        looked = corners_in_view(square, node, stride, x, y, vertex, tried, first, spans, squares, seen)
        come = _nearest(
            square, node, stride, vx, vy, qx, qy, g_start, closed_start, x, y, seen, looked,
            reach - straight + EDGE,
        )  # fmt: skip
        if come + straight > reach:
            continue
        go = _nearest(
            square, node, stride, vx, vy, qx, qy, g_goal, closed_goal, x, y, seen, looked, reach - come + EDGE
        )
        if come + go > reach:
            continue
        if come + go <= bound:
            cells[u64(found)] = at
            to_go[u64(found)] = go
            found += 1
        for k in range(9):
            to = at + (k // 3 - 1) * stride + k % 3 - 1
            if square[u64(to)] != 0 and mark[u64(to)] == 0:
                mark[u64(to)] = 1
                queue[u64(count)] = to
                count += 1
    result[0] = first
    return found


@kernel(
    out=("f", "g", "parent", "closed", "heap", "place", "chain", "spans", "squares", "result"),
    each=20_000, of="cells",
)  # fmt: skip
def straightest(
    square, weight, stride, rule, cells, to_go, goal, bound, budget,
    f, g, parent, closed, heap, place, chain, number, spans, squares, result, halt,
):  # fmt: skip
    """The shortest path of straight lines between the centres of some cells.

    Parameters
    ----------
    weight : uint8 (1,), 0.
    rule : see :mod:`lampyris.kernels.graph.any_angle`; the lines of sight are those of Theta*.
    cells, to_go : see :func:`cells_within`; the first is the start.
    goal : its place in ``cells``.
    bound : length of a path that is known, half squares.
    budget : greatest number of cells expanded; -1: no limit.
    f, g .. place : scratch, as for :func:`corner_tree`.
    chain : int32 (m,); the turning points as places in ``cells``, goal first.
    number : int32 (n,), the place of a square in ``cells``; -1: none.
    spans, squares : see :func:`in_view`; where that lists nothing all cells are looked at.
    result : int64 (3,): FOUND, EXHAUSTED or LIMIT; cells expanded; turning points.
    """
    g[0] = 0.0
    f[0] = to_go[0]
    put(heap, place, f, to_go, 0)
    expanded = 0
    result[0] = EXHAUSTED
    most = bound
    while heap[0] > 0:
        u = heap[1] + 0
        if u == goal:
            result[0] = FOUND
            break
        if expanded == budget or stopped(halt):
            result[0] = LIMIT
            break
        take(heap, place, f, to_go, u)
        closed[u64(u)] = 1
        expanded += 1
        at = cells[u64(u)] + 0
        y = at // stride
        x = at - y * stride
        looked = in_view(square, stride, 2 * x + 1, 2 * y + 1, spans, squares)
        for i in range(len(cells) if looked < 0 else looked):
            v = i
            if looked >= 0:
                v = int(number[u64(squares[u64(i)])])
            if v < 0 or closed[u64(v)] != 0:
                continue
            down = cells[u64(v)] // stride
            ey = down - y
            ex = cells[u64(v)] - down * stride - x
            through = g[u64(u)] + 2.0 * sqrt(float(ex * ex + ey * ey))
            if through >= g[u64(v)] or through + to_go[u64(v)] > most:
                continue
            if sees(square, weight, 0, stride, at, x, y, x + ex, y + ey, rule) == 0:
                continue
            g[u64(v)] = through
            f[u64(v)] = through + to_go[u64(v)]
            parent[u64(v)] = u
            put(heap, place, f, to_go, v)
            if v == goal:
                most = through + EDGE
    points = 0
    if result[0] == FOUND:
        u = goal
        chain[0] = goal
        points = 1
        while u != 0:
            u = int(parent[u])
            chain[points] = u
            points += 1
    result[1] = expanded
    result[2] = points
