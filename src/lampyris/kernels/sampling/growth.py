"""One tree that grows from the start: RRT, RRT* and Informed RRT*.

LaValle, "Rapidly-exploring random trees: a new tool for path planning", TR 98-11, Iowa State University, 1998. Karaman,
Frazzoli, "Sampling-based algorithms for optimal motion planning", International Journal of Robotics Research 30(7), 2011.
Gammell, Srinivasa, Barfoot, "Informed RRT*: optimal sampling-based path planning focused via direct sampling of an
admissible ellipsoidal heuristic", IROS 2014. Ancestors as parents: Jeong, Lee, Kim, "Quick-RRT*: triangular
inequality-based implementation of RRT* with improved initial solution and convergence rate", Expert Systems with
Applications 123, 2019.

States are the centres of free cells. There are finitely many, so a sample may fall on a node: RRT* then looks for a
better parent of that node, and rewires around it. For every node that is tried one more parent is considered besides the
neighbours, any node of the tree drawn at random (ours): without it nothing but the shrinking neighbourhood would be looked
at, and the tree would end as that of the best paths with short lines.
"""

from __future__ import annotations

from math import floor

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.sampling.buckets import around, file_node
from lampyris.kernels.sampling.draws import (
    ANCESTORS,
    BASE,
    BIAS,
    GOAL,
    HIGH,
    INFORMED,
    KEY,
    RULE,
    SAMPLES,
    STAR,
    START,
    STRIDE,
    WIDE,
    drawn_cell,
    length,
    next_draw,
)
from lampyris.kernels.sampling.lines import line_free
from lampyris.kernels.sampling.nearest import nearest, node_at, put_node
from lampyris.kernels.sampling.tree import EQUAL, cut, hang, length_to, settle

DONE, FOUND, STOPPED = 0, 1, 2
LOOK = 32
"""Samples between two looks at the flag that stops the search."""
# Entries of ``count``.
NODES, DRAWN, SAMPLED, REACHED, LINES = range(5)


@kernel()
def steered(stride, ax, ay, bx, by, step):
    """The cell on the way from a to b that is at most about a step away, flat."""
    d = length(ax, ay, bx, by)
    if d <= step:
        return by * stride + bx
    return floor(ay + (by - ay) * step / d + 0.5) * stride + floor(ax + (bx - ax) * step / d + 0.5)


@kernel(
    out=(
        "bucket", "link", "sides", "stack", "node_x", "node_y", "parent", "child", "after", "before", "cost", "near", "changed",
        "count",
    ),
    of="near", each=8000,
)  # fmt: skip
def grow(
    free, even, cells, narrow, trail, whole, step, radius, bucket, link, sides, stack, node_x, node_y, parent, child, after,
    before, cost, near, changed, count, halt,
):  # fmt: skip
    """Take samples until so many are taken, or (RRT) a path is found.

    Parameters
    ----------
    free : uint8 (n,), padded; 1 where the robot may be.
    even : uint8 (1,): 0.
    cells, narrow : int32: the free cells, and those of them in narrow places, flat.
    trail : int32: the cells of the best path, flat, near which a share of the samples is drawn.
    whole : int64 (16,): what the names in :mod:`.draws` say. ``SAMPLES``: of this call. ``STAR``: whether paths are improved.
        ``BIAS``, ``NARROW``: of 2**32 samples so many are the goal, or in narrow places. ``ANCESTORS``: of a parent, that
        are tried in its place.
    step : longest line by which the tree grows, cells.
    radius : float64 (32,): of the neighbourhood when the tree has 2**k nodes or more.
    bucket, link : see :func:`lampyris.kernels.sampling.buckets.file_node`; RRT has no use for them.
    sides, stack : see :func:`lampyris.kernels.sampling.nearest.nearest`.
    node_x, node_y, parent, child, after, before, cost : the tree; the start is node 0.
    near, changed : int32 (room,): scratch.
    count : int64 (5,): nodes, draws, samples; node of the goal, -1: not reached; lines checked.
    """
    stride = whole[STRIDE]
    rule = whole[RULE]
    wide = whole[WIDE]
    high = whole[HIGH]
    base = whole[BASE]
    star = whole[STAR]
    start = whole[START]
    goal = whole[GOAL]
    key = whole[KEY]
    sy = start // stride
    sx = start - sy * stride
    gy = goal // stride
    gx = goal - gy * stride
    for turn in range(whole[SAMPLES]):
        if turn % LOOK == LOOK - 1 and stopped(halt):
            return STOPPED
        count[SAMPLED] += 1
        reached = count[REACHED]
        best = cost[u64(reached)] if reached >= 0 else -1.0
        bits = next_draw(key, count, DRAWN)
        target = goal
        if bits >= whole[BIAS] or reached >= 0:
            informed = best if whole[INFORMED] != 0 else -1.0
            target = drawn_cell(free, cells, narrow, trail, whole, informed, count, DRAWN)
            if target < 0:
                continue
        y = target // stride
        x = target - y * stride
        nodes = count[NODES]
        v = nearest(sides, node_x, node_y, 0, x, y, stack)
        vx = node_x[u64(v)]
        vy = node_y[u64(v)]
        n = -1
        if vx == x and vy == y:
            n = v
        else:
            cell = steered(stride, vx, vy, x, y, step)
            y = cell // stride
            x = cell - y * stride
            if cell != target:
                n = node_at(sides, node_x, node_y, 0, x, y)
        if n >= 0 and star == 0:
            continue
        if best >= 0.0 and length(sx, sy, x, y) + length(x, y, gx, gy) >= best:
            continue
        p = v
        through = cost[u64(v)] + length(vx, vy, x, y)
        if n < 0:
            count[LINES] += 1
            if not line_free(free, even, stride, vx, vy, x, y, rule):
                continue
        else:
            p = parent[u64(n)]
            through = cost[u64(n)]
        many = 0
        if star != 0:
            k = 0
            while (nodes >> (k + 1)) > 0:
                k += 1
            many = around(
                bucket, link, wide, high, base, node_x, node_y, x, y, min(radius[u64(k)], step), near
            )
            other = (next_draw(key, count, DRAWN) * nodes) >> 32
            for i in range(many + 1):
                o = near[u64(i)] if i < many else other
                offered = cost[u64(o)] + length_to(node_x, node_y, o, x, y)
                if offered < through - EQUAL:
                    count[LINES] += 1
                    if line_free(free, even, stride, node_x[u64(o)], node_y[u64(o)], x, y, rule):
                        through = offered
                        p = o + 0
            for _ in range(whole[ANCESTORS]):
                if p < 0 or parent[u64(p)] < 0:
                    break
                o = parent[u64(p)]
                count[LINES] += 1
                if not line_free(free, even, stride, node_x[u64(o)], node_y[u64(o)], x, y, rule):
                    break
                p = o + 0
                through = cost[u64(o)] + length_to(node_x, node_y, o, x, y)
        if n < 0:
            n = nodes
            count[NODES] += 1
            node_x[u64(n)] = x
            node_y[u64(n)] = y
            child[u64(n)] = -1
            cost[u64(n)] = through
            hang(parent, child, after, before, n, p)
            put_node(sides, node_x, node_y, 0, n)
            if star != 0:
                file_node(bucket, link, wide, base, x, y, n)
        elif through < cost[u64(n)] - EQUAL:
            cut(parent, child, after, before, n)
            hang(parent, child, after, before, n, p)
            cost[u64(n)] = through
            settle(node_x, node_y, parent, child, after, cost, changed, n)
        for i in range(many):
            o = int(near[u64(i)])
            offered = cost[u64(n)] + length_to(node_x, node_y, o, x, y)
            if offered < cost[u64(o)] - EQUAL:
                count[LINES] += 1
                if line_free(free, even, stride, x, y, node_x[u64(o)], node_y[u64(o)], rule):
                    cut(parent, child, after, before, o)
                    hang(parent, child, after, before, o, n)
                    cost[u64(o)] = offered
                    settle(node_x, node_y, parent, child, after, cost, changed, o)
        if count[REACHED] < 0:
            away = length(x, y, gx, gy)
            if away == 0.0:
                count[REACHED] = n
            elif away <= step:
                count[LINES] += 1
                if line_free(free, even, stride, x, y, gx, gy, rule):
                    g = count[NODES]
                    count[NODES] += 1
                    node_x[u64(g)] = gx
                    node_y[u64(g)] = gy
                    child[u64(g)] = -1
                    cost[u64(g)] = cost[u64(n)] + away
                    hang(parent, child, after, before, g, n)
                    put_node(sides, node_x, node_y, 0, g)
                    if star != 0:
                        file_node(bucket, link, wide, base, gx, gy, g)
                    count[REACHED] = g
            if count[REACHED] >= 0 and star == 0:
                return FOUND
    return DONE
