"""A tree of nodes at cells: who is whose parent, and what it costs to come to each node from the root.

The children of a node are a list: the node has its first child, each child the one after and the one before it.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.sampling.draws import length

EQUAL = 1e-9
"""Lengths that differ by less are the same."""


@kernel(inline=True)
def length_to(node_x, node_y, n, x, y):
    """Distance of node n from a cell."""
    return length(node_x[u64(n)], node_y[u64(n)], x, y)


@kernel(out=("parent", "child", "after", "before"), inline=True)
def hang(parent, child, after, before, n, p):
    """Make node n, which has no parent, a child of p."""
    parent[u64(n)] = p
    c = child[u64(p)]
    after[u64(n)] = c
    before[u64(n)] = -1
    if c >= 0:
        before[u64(c)] = n
    child[u64(p)] = n


@kernel(out=("child", "after", "before"), inline=True)
def cut(parent, child, after, before, n):
    """Take node n out of its parent's children, if it has a parent."""
    p = parent[u64(n)]
    if p < 0:
        return
    a = after[u64(n)]
    b = before[u64(n)]
    if b >= 0:
        after[u64(b)] = a
    else:
        child[u64(p)] = a
    if a >= 0:
        before[u64(a)] = b


@kernel(out=("cost", "changed"))
def settle(node_x, node_y, parent, child, after, cost, changed, n):
    """Work out the costs of all below node n; write n and them to ``changed``, return how many."""
    changed[u64(0)] = n
    count = 1
    at = n
    while True:
        c = child[u64(at)]
        if c < 0:
            while at != n and after[u64(at)] < 0:
                at = parent[u64(at)] + 0
            if at == n:
                return count
            c = after[u64(at)]
        at = c + 0
        p = parent[u64(at)]
        cost[u64(at)] = cost[u64(p)] + length(
            node_x[u64(p)], node_y[u64(p)], node_x[u64(at)], node_y[u64(at)]
        )
        changed[u64(count)] = at
        count += 1
