"""Two trees, from the start and from the goal, that grow towards each other: RRT-Connect.

Kuffner, LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000. A line of a whole step
that is blocked is halved up to :data:`HALVES` times (ours), so that long steps serve narrow places, too.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.sampling.buckets import file_node, nearest, node_at
from lampyris.kernels.sampling.draws import drawn_cell
from lampyris.kernels.sampling.growth import (
    BASE, DONE, FOUND, GOAL, HIGH, KEY, LOOK, RULE, SAMPLES, START, STOPPED, STRIDE, WIDE, steered,
)  # fmt: skip
from lampyris.kernels.sampling.lines import line_free

HALVES = 3
# Entries of ``count``: nodes of either tree; draws, samples, lines; the nodes at which the trees met.
FIRST_NODES, SECOND_NODES, DRAWN, SAMPLED, LINES, FIRST_MET, SECOND_MET = range(7)


@kernel(out=("bucket", "link", "node_x", "node_y", "parent", "count"))
def _extend(free, even, whole, step, halves, bucket, link, node_x, node_y, parent, count, tree, room, x, y):
    """Grow a tree by one line towards a cell; the new node, or -1."""
    stride = whole[STRIDE]
    base = whole[BASE]
    at = tree * whole[WIDE] * whole[HIGH]
    first = tree * room
    v = nearest(bucket, link, whole[WIDE], whole[HIGH], at, base, node_x, node_y, first, count[u64(tree)], x, y)
    vx = int(node_x[u64(v)])
    vy = int(node_y[u64(v)])
    if vx == x and vy == y:
        return v
    far = step
    for _ in range(halves + 1):
        cell = steered(stride, vx, vy, x, y, far)
        cy = cell // stride
        cx = cell - cy * stride
        count[LINES] += 1
        if (cx != vx or cy != vy) and line_free(free, even, stride, vx, vy, cx, cy, whole[RULE]):
            if (cx != x or cy != y) and node_at(
                bucket, link, whole[WIDE], at, base, node_x, node_y, cx, cy
            ) >= 0:
                return -1
            n = first + count[u64(tree)]
            count[u64(tree)] += 1
            node_x[u64(n)] = cx
            node_y[u64(n)] = cy
            parent[u64(n)] = v
            file_node(bucket, link, whole[WIDE], at, base, cx, cy, n)
            return n
        far = min(far, abs(x - vx) + abs(y - vy)) / 2.0
        if far < 1.5:
            return -1
    return -1


@kernel(out=("bucket", "link", "node_x", "node_y", "parent", "count"), of="cells", each=100)
def connect(free, even, cells, whole, step, bucket, link, node_x, node_y, parent, count, halt):
    """Take samples until the trees meet or so many are taken.

    Parameters
    ----------
    free, even, cells, whole, step : see :func:`lampyris.kernels.sampling.growth.grow`.
    bucket, link : of both trees, one after the other.
    node_x, node_y, parent : int32 (2 room,): of both trees; node 0 is the start, node ``room`` the goal.
    count : int64 (7,).
    """
    room = len(node_x) // 2
    stride = whole[STRIDE]
    for turn in range(whole[SAMPLES]):
        if turn % LOOK == LOOK - 1 and stopped(halt):
            return STOPPED
        tree = count[SAMPLED] & 1
        count[SAMPLED] += 1
        target = drawn_cell(
            free, stride, cells, whole[KEY], whole[START], whole[GOAL], -1.0, count, DRAWN
        )
        if count[SAMPLED] == 1:
            target = whole[GOAL]
        y = target // stride
        x = target - y * stride
        n = _extend(free, even, whole, step, HALVES, bucket, link, node_x, node_y, parent, count, tree, room, x, y)
        if n < 0:
            continue
        x = int(node_x[u64(n)])
        y = int(node_y[u64(n)])
        while True:
            m = _extend(
                free, even, whole, step, 0, bucket, link, node_x, node_y, parent, count, 1 - tree, room, x, y
            )
            if m < 0:
                break
            if node_x[u64(m)] == x and node_y[u64(m)] == y:
                count[FIRST_MET] = n if tree == 0 else m
                count[SECOND_MET] = m if tree == 0 else n
                return FOUND
    return DONE
