"""A path from elsewhere becomes part of a tree: its vertices are nodes from then on, each at the least of both costs."""

from __future__ import annotations

from math import inf

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.sampling.buckets import file_node, node_at
from lampyris.kernels.sampling.draws import length
from lampyris.kernels.sampling.nearest import put_node
from lampyris.kernels.sampling.tree import EQUAL, cut, hang, settle


@kernel(
    out=(
        "bucket", "link", "sides", "node_x", "node_y", "parent", "child", "after", "before", "cost", "stale", "joined", "changed",
        "count",
    ),
    of="turns", each=100,
)  # fmt: skip
def take_over(
    turns, stride, wide, base, bucket, link, sides, node_x, node_y, parent, child, after, before, cost, stale, joined, changed,
    count,
):  # fmt: skip
    """Hang the vertices of a path of free lines into a tree where that lowers their costs.

    Parameters
    ----------
    turns : int32 (k,): flat cells, that of the root (node 0) first.
    stride : length of a padded row.
    wide, base, bucket, link : see :func:`lampyris.kernels.sampling.buckets.file_node`; every node is filed.
    sides : see :func:`lampyris.kernels.sampling.nearest.put_node`; of length 0: there is no such tree.
    node_x, node_y, parent, child, after, before, cost : samples and nodes of the tree; those outside it have infinite cost.
    stale : uint8 (room,): set to 1 for each node whose cost has changed.
    joined : int32 (room,): nodes that have come into the tree are written after the first ``count[1]``.
    changed : int32 (room,): scratch.
    count : int64 (3,): nodes and samples; how many of ``joined``; the node of the last vertex is written to the third.
    """
    last = 0
    for k in range(1, len(turns)):
        cell = int(turns[u64(k)])
        y = cell // stride
        x = cell - y * stride
        n = node_at(bucket, link, wide, base, node_x, node_y, x, y)
        if n < 0:
            n = count[0] + 0
            count[0] += 1
            node_x[u64(n)] = x
            node_y[u64(n)] = y
            cost[u64(n)] = inf
            parent[u64(n)] = -1
            child[u64(n)] = -1
            file_node(bucket, link, wide, base, x, y, n)
            if len(sides) > 0:
                put_node(sides, node_x, node_y, 0, n)
        through = cost[u64(last)] + length(node_x[u64(last)], node_y[u64(last)], x, y)
        if through < cost[u64(n)] - EQUAL:
            if parent[u64(n)] < 0:
                joined[u64(count[1])] = n
                count[1] += 1
            cut(parent, child, after, before, n)
            hang(parent, child, after, before, n, last)
            cost[u64(n)] = through
            many = settle(node_x, node_y, parent, child, after, cost, changed, n)
            for i in range(many):
                stale[u64(changed[u64(i)])] = 1
        last = n + 0
    count[2] = last
