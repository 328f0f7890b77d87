"""A* over the free leaves of a quadtree, and a polyline pulled straight over its own points."""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._helpers import LOOK
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.graph.any_angle import sees
from lampyris.kernels.heap import put, take

FOUND, EXHAUSTED, LIMIT = 0, 1, 2


@kernel()
def _far(ax, ay, bx, by):
    """Distance between two cells."""
    dx = bx - ax
    dy = by - ay
    return sqrt(float(dx * dx + dy * dy))


@kernel(
    out=("f", "g", "h", "gate", "come", "closed", "heap", "place", "chain", "result"), each=10_000, of="side"
)
def leaf_search(
    leaf, width, x, y, side, corners, start_x, start_y, goal_x, goal_y, budget,
    f, g, h, gate, come, closed, heap, place, chain, result, halt,
):  # fmt: skip
    """A short chain of cells from start to goal that passes from leaf to leaf through the middles of shared sides.

    Parameters
    ----------
    leaf : int32 (width * width,), the free leaf of each cell, -1 where there is none.
    x, y, side : int64 (m,); upper left cell and side of each free leaf.
    corners : 1 where leaves that share a corner are joined.
    budget : greatest number of leaves expanded; -1: no limit.
    f, g, h : float64 (m,), g -1 before; gate : int64 (4 m,): the last cell of the leaf before and the first cell of
        this one; come : int32 (m,): the leaf before; scratch.
    closed : uint8 (m,); heap, place : int32 (m + 1,) and (m,); 0 before.
    chain : int64 (4 m + 4,); cells (x, y, ...) with the goal first.
    result : int64 (3,): FOUND, EXHAUSTED or LIMIT; leaves expanded; cells of the chain.
    """
    first = int(leaf[start_y * width + start_x])
    last = int(leaf[goal_y * width + goal_x])
    g[first] = 0.0
    h[first] = _far(start_x, start_y, goal_x, goal_y)
    f[first] = h[first]
    gate[4 * first + 2] = start_x
    gate[4 * first + 3] = start_y
    come[first] = first
    put(heap, place, f, h, first)
    expanded = 0
    result[0] = EXHAUSTED
    while heap[0] > 0:
        u = heap[1] + 0
        if u == last:
            result[0] = FOUND
            break
        if expanded == budget or (expanded % LOOK == 0 and stopped(halt)):
            result[0] = LIMIT
            break
        take(heap, place, f, h, u)
        closed[u64(u)] = 1
        expanded += 1
        here_x = gate[u64(4 * u + 2)]
        here_y = gate[u64(4 * u + 3)]
        n = side[u64(u)]
        # Sides: right, left, below, above; then the corners.
        for face in range(4 + 4 * corners):
            k = 0
            while k < (n if face < 4 else 1):
                if face == 0:
                    in_x, in_y, dx, dy = x[u64(u)] + n - 1, y[u64(u)] + k, 1, 0
                elif face == 1:
                    in_x, in_y, dx, dy = x[u64(u)], y[u64(u)] + k, -1, 0
                elif face == 2:
                    in_x, in_y, dx, dy = x[u64(u)] + k, y[u64(u)] + n - 1, 0, 1
                elif face == 3:
                    in_x, in_y, dx, dy = x[u64(u)] + k, y[u64(u)], 0, -1
                else:
                    dx = 1 if face & 1 else -1
                    dy = 1 if face & 2 else -1
                    in_x = x[u64(u)] + (n - 1 if dx > 0 else 0)
                    in_y = y[u64(u)] + (n - 1 if dy > 0 else 0)
                to_x = in_x + dx
                to_y = in_y + dy
                if to_x < 0 or to_y < 0 or to_x >= width or to_y >= width:
                    break
                v = int(leaf[u64(to_y * width + to_x)])
                if v < 0:
                    k += 1
                    continue
                shared = min(n, side[u64(v)]) if face < 4 else 1
                middle = (shared - 1) // 2
                if face < 2:
                    in_y += middle
                    to_y += middle
                elif face < 4:
                    in_x += middle
                    to_x += middle
                k += shared
                if closed[u64(v)] != 0:
                    continue
                through = g[u64(u)] + _far(here_x, here_y, in_x, in_y) + _far(in_x, in_y, to_x, to_y)
                if g[u64(v)] >= 0.0 and through >= g[u64(v)]:
                    continue
                g[u64(v)] = through
                h[u64(v)] = _far(to_x, to_y, goal_x, goal_y)
                f[u64(v)] = through + h[u64(v)]
                come[u64(v)] = u
                gate[u64(4 * v)] = in_x
                gate[u64(4 * v + 1)] = in_y
                gate[u64(4 * v + 2)] = to_x
                gate[u64(4 * v + 3)] = to_y
                put(heap, place, f, h, v)
    count = 0
    if result[0] == FOUND:
        chain[0] = goal_x
        chain[1] = goal_y
        count = 1
        u = last
        while True:
            chain[2 * count] = gate[u64(4 * u + 2)]
            chain[2 * count + 1] = gate[u64(4 * u + 3)]
            count += 1
            if u == first:
                break
            chain[2 * count] = gate[u64(4 * u)]
            chain[2 * count + 1] = gate[u64(4 * u + 1)]
            count += 1
            u = int(come[u])
    result[1] = expanded
    result[2] = count


@kernel(out=("cost", "back", "chain"), each=100_000, of="x")
def pulled(free, weight, stride, rule, x, y, cost, back, chain, halt):
    """The shortest path of lines of sight over the points of a polyline, in their order; how many points are left.

    Parameters
    ----------
    free, weight, stride, rule : as for :func:`lampyris.kernels.graph.any_angle.theta`; cells of one weight.
    x, y : int64 (n,), padded; neighbours see each other.
    cost : float64 (n,), back : int64 (n,); scratch.
    chain : int64 (n,); the points that stay, last first.
    """
    n = len(x)
    cost[0] = 0.0
    for j in range(1, n):
        if stopped(halt):
            return 0
        back[j] = j - 1
        cost[j] = cost[j - 1] + _far(x[j - 1], y[j - 1], x[j], y[j])
        for i in range(j - 1):
            through = cost[i] + _far(x[i], y[i], x[j], y[j])
            if through < cost[j] and sees(
                free, weight, 0, stride, y[i] * stride + x[i], x[i], y[i], x[j], y[j], rule
            ):
                cost[j] = through
                back[j] = i
    count = 1
    chain[0] = n - 1
    while chain[count - 1] > 0:
        chain[count] = back[chain[count - 1]]
        count += 1
    return count
