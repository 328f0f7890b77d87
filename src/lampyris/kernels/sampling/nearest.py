"""The nearest node: a k-d tree in the plane, that nodes are put into one by one.

Bentley, "Multidimensional binary search trees used for associative searching", Communications of the ACM 18(9), 1975. By turns
along x and y, nodes with a lesser coordinate are on the left, all others on the right. Nodes come at random, so that it needs
no balance; a row of nodes in a line makes it deeper by their number at most.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64


@kernel(out=("sides",))
def put_node(sides, node_x, node_y, root, n):
    """Put node n into the tree of a root; it may be the root.

    Parameters
    ----------
    sides : int32 (2 room,): the left and the right child of each node, -1: none.
    node_x, node_y : int32: the cells of the nodes.
    """
    sides[u64(2 * n)] = -1
    sides[u64(2 * n + 1)] = -1
    if n == root:
        return
    x = node_x[u64(n)]
    y = node_y[u64(n)]
    at = root
    axis = 0
    while True:
        right = (1 if x >= node_x[u64(at)] else 0) if axis == 0 else (1 if y >= node_y[u64(at)] else 0)
        below = sides[u64(2 * at + right)] + 0
        if below < 0:
            sides[u64(2 * at + right)] = n
            return
        at = below
        axis ^= 1


@kernel()
def node_at(sides, node_x, node_y, root, x, y):
    """The node at a cell; -1: there is none."""
    at = root
    axis = 0
    while at >= 0:
        nx = node_x[u64(at)]
        ny = node_y[u64(at)]
        if nx == x and ny == y:
            return at
        right = (1 if x >= nx else 0) if axis == 0 else (1 if y >= ny else 0)
        at = sides[u64(2 * at + right)] + 0
        axis ^= 1
    return -1


@kernel(out=("stack",))
def nearest(sides, node_x, node_y, root, x, y, stack):
    """The node nearest to a cell; of several the first that is met.

    Parameters
    ----------
    stack : int64 (2 room,): room.
    """
    at = root
    best = root
    least = 1 << 62
    axis = 0
    top = 0
    while True:
        while at >= 0:
            dx = int(node_x[u64(at)]) - x
            dy = int(node_y[u64(at)]) - y
            d = dx * dx + dy * dy
            if d < least:
                least = d
                best = at
            off = dx if axis == 0 else dy
            axis ^= 1
            near = 2 * at if off > 0 else 2 * at + 1
            far = sides[u64(near ^ 1)] + 0
            if far >= 0 and off * off < least:
                stack[u64(2 * top)] = 2 * far + axis
                stack[u64(2 * top + 1)] = off * off
                top += 1
            at = sides[u64(near)] + 0
        while top > 0:
            top -= 1
            if stack[u64(2 * top + 1)] < least:
                at = stack[u64(2 * top)] >> 1
                axis = stack[u64(2 * top)] & 1
                break
        if at < 0:
            return best
