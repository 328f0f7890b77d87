"""Nodes at cells, in square buckets of the map: the one at a cell, and all within a distance.

Each bucket holds a list of its nodes: its first, and for each node the next. Numbers of nodes are stored plus ``base``;
what is below it is from an earlier search and counts as nothing, so that nothing is cleared between two searches.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64

BITS = 3
"""A bucket is 2 to this power cells wide and high."""


@kernel(out=("bucket", "link"))
def file_node(bucket, link, wide, base, x, y, n):
    """Put node n, at a cell, into its bucket.

    Parameters
    ----------
    bucket : int32: the first node of each bucket, plus ``base``.
    link : int32: the next node of each node's bucket, plus ``base``.
    wide : buckets in a row.
    """
    b = (y >> BITS) * wide + (x >> BITS)
    link[u64(n)] = bucket[u64(b)]
    bucket[u64(b)] = base + n


@kernel()
def node_at(bucket, link, wide, base, node_x, node_y, x, y):
    """The node at a cell; -1: there is none."""
    n = bucket[u64((y >> BITS) * wide + (x >> BITS))] - base
    while n >= 0:
        if node_x[u64(n)] == x and node_y[u64(n)] == y:
            return n
        n = link[u64(n)] - base
    return -1


@kernel(out=("near",))
def around(bucket, link, wide, high, base, node_x, node_y, x, y, radius, near):
    """Write the nodes within a distance of a cell, the one at it left out, to ``near``; return how many."""
    reach = int(radius)
    count = 0
    most = radius * radius
    for v in range(max(y - reach, 0) >> BITS, min((y + reach) >> BITS, high - 1) + 1):
        for u in range(max(x - reach, 0) >> BITS, min((x + reach) >> BITS, wide - 1) + 1):
            n = bucket[u64(v * wide + u)] - base
            while n >= 0:
                dx = node_x[u64(n)] - x
                dy = node_y[u64(n)] - y
                d = dx * dx + dy * dy
                # Written in any case: a branch here would be mispredicted too often.
                near[u64(count)] = n
                count += (d > 0) & (d <= most)
                n = link[u64(n)] - base
    return count


@kernel(out=("near",))
def around_improvable(bucket, link, wide, high, base, node_x, node_y, cost, x, y, radius, spent, near):
    """The same as :func:`around`, without nodes whose cost a line from the cell cannot lower.

    Parameters
    ----------
    cost : float64, the cost of each node.
    spent : the cost at the cell; a node is kept if its cost exceeds this by at least the length of the line, up to
        rounding. With minus infinity all nodes are kept.
    """
    reach = int(radius)
    count = 0
    most = radius * radius
    for v in range(max(y - reach, 0) >> BITS, min((y + reach) >> BITS, high - 1) + 1):
        for u in range(max(x - reach, 0) >> BITS, min((x + reach) >> BITS, wide - 1) + 1):
            n = bucket[u64(v * wide + u)] - base
            while n >= 0:
                dx = node_x[u64(n)] - x
                dy = node_y[u64(n)] - y
                d = float(dx * dx + dy * dy)
                gap = cost[u64(n)] - spent
                near[u64(count)] = n
                count += (gap > 0.0) & (d > 0.0) & (d <= most) & (d <= gap * gap * 1.000001)
                n = link[u64(n)] - base
    return count
