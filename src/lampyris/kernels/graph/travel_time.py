"""A* for the path of least travel time: a state is a cell and the step that led there.

The time of a path is a sum over its nodes. Each step is divided at its middle; the half next to a node is driven no
faster than the corner at that node allows, and along a step the square of the speed is linear between the caps of its two
ends. So what a node costs depends on the step into it and the step out of it alone, and the best path through states is
exact. A state's cost is counted up to the middle of the step that led there.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._helpers import LOOK
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT
from lampyris.kernels.heap import put, take


@kernel()
def half_step(length, one, other, corner, acceleration):
    """Seconds on the half of a step next to a corner.

    Parameters
    ----------
    length : metres of the whole step.
    one, other : the caps of its ends, m/s, > 0.
    corner : greatest speed at the corner, m/s; 0: the robot stops there.
    acceleration : m/s2, from a stop; braking, to one.
    """
    if corner == 0.0:
        most = max(one, other)
        if most * most >= acceleration * length:
            return sqrt(length / acceleration)
        return 0.5 * most / acceleration + 0.5 * length / most
    return length / (min(one, corner) + min(other, corner))


@kernel(out=("heap", "place", "f", "h", "g", "before", "result"), each=1600)
def travel_time(
    free, node, edge, layered, stride, start, goal, budget,
    offset, via, across, dx, dy, length, corner, norm, top, a_max, d_max,
    heap, place, f, h, g, before, result, halt,
):  # fmt: skip
    """The path of least travel time between two free cells.

    Parameters
    ----------
    free : uint8 (n,), padded by blocked cells.
    node : float64 (n,), the cap of each cell, m/s.
    edge : float64, caps of the step that leaves each cell, m/s, infinity: none; (steps * n,) by step and cell, or (1,).
    layered : whether ``edge`` is by step and cell.
    stride, start, goal, budget : as for :func:`lampyris.kernels.graph.search.search`.
    offset, via, across, dx, dy : the steps; ``via`` and ``across`` are the cells that each touches on its way.
    length : float64 (steps,), metres.
    corner : float64 (steps * steps,), greatest speed by the step into a node and the step out of it: infinity straight
        on, 0 for a stop.
    norm : float64 (4,), the length of the shortest path in an open plane, as two linear forms, in metres a cell.
    top : the greatest cap anywhere.
    a_max, d_max : m/s2.
    heap : int32 (steps * n + 2,); place : int32 (steps * n + 1,), 0.
    f, h, g : float64 (steps * n + 1,); g infinity.
    before : int8 (steps * n + 1,): the step before the last of each state, ``steps`` in the first; for the goal the last.
    result : float64 (3,): how it ended, expansions, seconds.
    """
    steps = len(offset)
    n = len(free)
    end = steps * n
    gy = goal // stride
    gx = goal - gy * stride
    inf = 1e300 * 1e300
    heap[0] = 0
    expansions = 0
    ending = EXHAUSTED
    state = -1  # the start: any step, no corner
    while True:
        if state < 0:
            cell = start
            last = steps
            paid = 0.0
        else:
            if heap[0] == 0:
                break
            state = int(heap[1])
            if state == end:
                ending = FOUND
                break
            if expansions == budget or (expansions % LOOK == 0 and stopped(halt)):
                ending = LIMIT
                break
            take(heap, place, f, h, state)
            last = state // n
            cell = state - last * n
            paid = g[u64(state)]
        expansions += 1
        came = cell if last == steps else cell - offset[u64(last)]
        in_a = node[u64(came)]
        in_b = node[u64(cell)]
        if last < steps and layered:
            in_a = min(in_a, edge[u64(last * n + came)])
            in_b = min(in_b, edge[u64(last * n + came)])
        y = cell // stride
        x = cell - y * stride
        for k in range(steps):
            there = cell + offset[u64(k)]
            if (
                free[u64(there)] == 0
                or free[u64(cell + via[u64(k)])] == 0
                or free[u64(cell + across[u64(k)])] == 0
            ):
                continue
            out_a = node[u64(cell)]
            out_b = node[u64(there)]
            if layered:
                out_a = min(out_a, edge[u64(k * n + cell)])
                out_b = min(out_b, edge[u64(k * n + cell)])
            reached = paid
            if last == steps:
                reached += half_step(length[u64(k)], out_a, out_b, inf, a_max)
            else:
                most = corner[u64(last * steps + k)]
                reached += half_step(length[u64(last)], in_a, in_b, most, d_max)
                reached += half_step(length[u64(k)], out_a, out_b, most, a_max)
            to = k * n + there
            if reached >= g[u64(to)]:
                continue
            g[u64(to)] = reached
            before[u64(to)] = last
            a = abs(x + dx[u64(k)] - gx)
            b = abs(y + dy[u64(k)] - gy)
            if a < b:
                a, b = b, a
            rest = max(norm[0] * a + norm[1] * b, norm[2] * a + norm[3] * b) + 0.5 * length[u64(k)]
            h[u64(to)] = rest / top
            f[u64(to)] = reached + h[u64(to)]
            put(heap, place, f, h, to)
            if there == goal:
                whole = reached + half_step(length[u64(k)], out_a, out_b, inf, d_max)
                if whole < g[u64(end)]:
                    g[u64(end)] = whole
                    before[u64(end)] = k
                    h[u64(end)] = 0.0
                    f[u64(end)] = whole
                    put(heap, place, f, h, end)
        if state < 0:
            state = 0
    result[0] = ending
    result[1] = expansions
    result[2] = g[u64(end)]
