"""Batches of samples searched in the order of what a path through them may cost: BIT*.

Gammell, Srinivasa, Barfoot, "Batch Informed Trees (BIT*): informed asymptotically optimal anytime search", International
Journal of Robotics Research 39(5), 2020. Different from there: a line that a node of unchanged cost has been tried with
is not tried again in later batches, because then as now it would improve nothing; and where a sample falls on a node, a
line to it from any node of the tree drawn at random is queued (see :mod:`.growth`: there are finitely many cells).
"""

from __future__ import annotations

from math import inf

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.lattice.search import _pop, _push
from lampyris.kernels.sampling.buckets import around_improvable, file_node, node_at
from lampyris.kernels.sampling.draws import (
    ANCESTORS,
    BASE,
    GOAL,
    HIGH,
    KEY,
    RULE,
    SAMPLES,
    STRIDE,
    WIDE,
    drawn_cell,
    length,
    next_draw,
)
from lampyris.kernels.sampling.growth import DONE, DRAWN, LINES, NODES, REACHED, SAMPLED, STOPPED
from lampyris.kernels.sampling.lines import line_free
from lampyris.kernels.sampling.tree import EQUAL, cut, hang, length_to, settle

FULL = 3
LOOK = 64
"""Lines taken from the queue between two looks at the flag that stops the search."""
# Entries of ``count`` besides those of ``growth``: lines and nodes that wait; nodes of the tree; a batch is under way; the
# tree has nodes that no batch has seen.
EDGES, VERTICES, JOINED, BEGUN, FRESH = range(5, 10)


@kernel(out=("edge_key", "edge", "count"), inline=True)
def _offer(edge_key, edge, count, room, v, x, key):
    """Queue the line from node v to node x."""
    _push(edge_key, edge, count[EDGES], key, v * room + x)
    count[EDGES] += 1


@kernel()
def _slot(blocked, p, n):
    """Where the line from node p to node n is noted if it is found to be blocked."""
    return (p * 0x9E3779B1 + n) & (len(blocked) - 1)


@kernel(
    out=(
        "bucket", "link", "node_x", "node_y", "parent", "child", "after", "before", "cost", "stale", "tree", "edge_key", "edge",
        "vertex_key", "vertex", "near", "changed", "blocked", "count",
    ),
    of="near", each=8000,
)  # fmt: skip
def search_batch(
    free, even, cells, narrow, trail, whole, radius, bucket, link, node_x, node_y, parent, child, after, before, cost, stale,
    tree, edge_key, edge, vertex_key, vertex, near, changed, blocked, count, halt,
):  # fmt: skip
    """Take one batch of samples, and search until no line that waits can lead to a shorter path.

    Parameters
    ----------
    free, even, cells, narrow, trail, whole, bucket, link, near, changed : see :func:`lampyris.kernels.sampling.growth.grow`.
    radius : of the neighbourhood in this batch.
    node_x, node_y, parent, child, after, before, cost : samples and nodes of the tree; a sample has infinite cost. Node 0
        is the start, node 1 the goal.
    stale : uint8 (room,): 1 where a node of the tree waits for lines from it to be queued.
    tree : int32 (room,): the nodes of the tree, as they joined it: before the first batch the start, or a whole path.
    edge_key, edge : float64, int64: the lines that wait.
    vertex_key, vertex : float64, int64: the nodes that wait.
    blocked : int64, as many as a power of two, 0 at first: lines that were found to be blocked, from node p to node n as
        p * room + n + 1, each in the place of its own; a later one takes the place of an earlier. A node whose cost falls is
        asked for lines again, and five of six that it is asked for are among these.
    count : int64 (10,).
    """
    stride = whole[STRIDE]
    rule = whole[RULE]
    wide = whole[WIDE]
    high = whole[HIGH]
    base = whole[BASE]
    goal = whole[GOAL]
    key = whole[KEY]
    room = len(cost)
    gy = goal // stride
    gx = goal - gy * stride
    if count[BEGUN] == 0:
        count[BEGUN] = 1
        count[EDGES] = 0
        count[VERTICES] = 0
        if count[FRESH] != 0:
            count[FRESH] = 0
            for k in range(count[JOINED]):
                v = int(tree[u64(k)])
                if v != 1 and stale[u64(v)] != 0:
                    estimate = cost[u64(v)] + length_to(node_x, node_y, v, gx, gy)
                    _push(vertex_key, vertex, count[VERTICES], estimate, v)
                    count[VERTICES] += 1
        best = cost[u64(1)]
        for turn in range(whole[SAMPLES]):
            if turn % LOOK == LOOK - 1 and stopped(halt):
                return STOPPED
            count[SAMPLED] += 1
            cell = drawn_cell(free, cells, narrow, trail, whole, best if best < inf else -1.0, count, DRAWN)
            if cell < 0:
                continue
            y = cell // stride
            x = cell - y * stride
            n = node_at(bucket, link, wide, base, node_x, node_y, x, y)
            many = 0
            if n < 0:
                n = count[NODES]
                count[NODES] += 1
                node_x[u64(n)] = x
                node_y[u64(n)] = y
                cost[u64(n)] = inf
                parent[u64(n)] = -1
                child[u64(n)] = -1
                stale[u64(n)] = 0
                file_node(bucket, link, wide, base, x, y, n)
                many = around_improvable(
                    bucket, link, wide, high, base, node_x, node_y, cost, x, y, radius, -inf, near
                )
            else:
                pick = (next_draw(key, count, DRAWN) * count[JOINED]) >> 32
                near[u64(0)] = tree[u64(pick)]
                many = 1
            rest = length(x, y, gx, gy)
            for i in range(many):
                v = int(near[u64(i)])
                through = cost[u64(v)] + length_to(node_x, node_y, v, x, y)
                if through < cost[u64(n)] - EQUAL and through + rest < best and count[EDGES] < len(edge):
                    _offer(edge_key, edge, count, room, v, n, through + rest)
    turn = 0
    while True:
        best = cost[u64(1)]
        by_edge = edge_key[u64(0)] if count[EDGES] > 0 else inf
        by_vertex = vertex_key[u64(0)] if count[VERTICES] > 0 else inf
        if min(by_edge, by_vertex) >= best:
            break
        turn += 1
        if turn % LOOK == 0 and stopped(halt):
            return STOPPED
        if by_vertex <= by_edge:
            if count[EDGES] + count[NODES] > len(edge):
                return FULL
            v = int(vertex[u64(0)])
            _pop(vertex_key, vertex, count[VERTICES])
            count[VERTICES] -= 1
            if stale[u64(v)] == 0:
                continue
            stale[u64(v)] = 0
            x = int(node_x[u64(v)])
            y = int(node_y[u64(v)])
            spent = cost[u64(v)] + 0.0
            many = around_improvable(
                bucket, link, wide, high, base, node_x, node_y, cost, x, y, radius, spent, near
            )
            for i in range(many):
                n = int(near[u64(i)])
                through = spent + length_to(node_x, node_y, n, x, y)
                if through < cost[u64(n)] - EQUAL:
                    estimate = through + length_to(node_x, node_y, n, gx, gy)
                    if estimate < best:
                        _offer(edge_key, edge, count, room, v, n, estimate)
            continue
        if count[VERTICES] + count[NODES] > len(vertex):
            return FULL
        both = int(edge[u64(0)])
        _pop(edge_key, edge, count[EDGES])
        count[EDGES] -= 1
        p = both // room
        n = both - p * room
        x = int(node_x[u64(n)])
        y = int(node_y[u64(n)])
        through = cost[u64(p)] + length_to(node_x, node_y, p, x, y)
        if through >= cost[u64(n)] - EQUAL or through + length(x, y, gx, gy) >= best:
            continue
        if blocked[u64(_slot(blocked, p, n))] == both + 1:
            continue
        count[LINES] += 1
        if not line_free(free, even, stride, node_x[u64(p)], node_y[u64(p)], x, y, rule):
            blocked[u64(_slot(blocked, p, n))] = both + 1
            continue
        for _ in range(whole[ANCESTORS]):
            o = int(parent[u64(p)])
            if o < 0 or blocked[u64(_slot(blocked, o, n))] == o * room + n + 1:
                break
            count[LINES] += 1
            if not line_free(free, even, stride, node_x[u64(o)], node_y[u64(o)], x, y, rule):
                blocked[u64(_slot(blocked, o, n))] = o * room + n + 1
                break
            p = o + 0
            through = cost[u64(p)] + length_to(node_x, node_y, p, x, y)
        if parent[u64(n)] < 0:
            tree[u64(count[JOINED])] = n
            count[JOINED] += 1
        cut(parent, child, after, before, n)
        hang(parent, child, after, before, n, p)
        cost[u64(n)] = through
        many = settle(node_x, node_y, parent, child, after, cost, changed, n)
        best = cost[u64(1)]
        for i in range(many):
            o = int(changed[u64(i)])
            if o == 1:
                count[REACHED] = 1
                continue
            estimate = cost[u64(o)] + length_to(node_x, node_y, o, gx, gy)
            stale[u64(o)] = 1
            if estimate < best:
                _push(vertex_key, vertex, count[VERTICES], estimate, o)
                count[VERTICES] += 1
    count[BEGUN] = 0
    return DONE
