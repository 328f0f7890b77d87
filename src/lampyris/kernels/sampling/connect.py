"""Two trees, from the start and from the goal, that grow towards each other: RRT-Connect.

Kuffner, LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000, in its form with two
greedy trees: the tree that takes the sample grows towards it until it is blocked, too, and the smaller tree takes it.
A line of a whole step that is blocked is halved up to :data:`HALVES` times, and then a step of one cell along either axis
is tried (ours): long steps then serve narrow places, too, and trees slide along walls to doors.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.sampling.draws import GOAL, REACH, RULE, SAMPLES, STRIDE, drawn_cell
from lampyris.kernels.sampling.growth import DONE, FOUND, LOOK, STOPPED, steered
from lampyris.kernels.sampling.lines import line_free
from lampyris.kernels.sampling.nearest import nearest, node_at, put_node

HALVES = 2
# Entries of ``count``: nodes of either tree; draws, samples, lines; the vertices of the path.
FIRST_NODES, SECOND_NODES, DRAWN, SAMPLED, LINES, VERTICES = range(6)


@kernel(out=("sides", "node_x", "node_y", "parent", "count"))
def _extend(free, even, whole, step, sides, node_x, node_y, parent, count, tree, room, v, x, y):
    """Grow a tree by one line from node v towards a cell that is no node of it; the new node, or -1."""
    stride = whole[STRIDE]
    first = tree * room
    vx = int(node_x[u64(v)])
    vy = int(node_y[u64(v)])
    far = step
    for attempt in range(HALVES + 3):
        if attempt <= HALVES:
            cell = steered(stride, vx, vy, x, y, far)
            far = min(far, abs(x - vx) + abs(y - vy)) / 2.0
        elif attempt == HALVES + 1:
            cell = vy * stride + vx + (0 if x == vx else 1 if x > vx else -1)
        else:
            cell = (vy + (0 if y == vy else 1 if y > vy else -1)) * stride + vx
        cy = cell // stride
        cx = cell - cy * stride
        if cx == vx and cy == vy:
            continue
        count[LINES] += 1
        if not line_free(free, even, stride, vx, vy, cx, cy, whole[RULE]):
            continue
        if (cx != x or cy != y) and node_at(sides, node_x, node_y, first, cx, cy) >= 0:
            continue
        n = first + count[u64(tree)]
        count[u64(tree)] += 1
        node_x[u64(n)] = cx
        node_y[u64(n)] = cy
        parent[u64(n)] = v
        put_node(sides, node_x, node_y, first, n)
        return n
    return -1


@kernel(out=("sides", "stack", "node_x", "node_y", "parent", "count"))
def _connect(free, even, whole, step, sides, stack, node_x, node_y, parent, count, tree, room, x, y):
    """Grow a tree towards a cell until it is blocked, or has grown by ``REACH`` nodes: the last new node; -1: none."""
    v = nearest(sides, node_x, node_y, tree * room, x, y, stack)
    if node_x[u64(v)] == x and node_y[u64(v)] == y:
        return v
    last = -1
    for _ in range(whole[REACH]):
        n = _extend(free, even, whole, step, sides, node_x, node_y, parent, count, tree, room, v, x, y)
        if n < 0:
            break
        last = n
        if node_x[u64(n)] == x and node_y[u64(n)] == y:
            break
        v = n
    return last


@kernel(out=("sides", "stack", "node_x", "node_y", "parent", "count"), of="cells", each=100)
def connect(free, even, cells, narrow, whole, step, sides, stack, node_x, node_y, parent, count, halt):
    """Take samples until the trees meet or so many are taken.

    Where they meet, ``stack`` holds the flat cells of the path, start first, and ``count`` how many there are.

    Parameters
    ----------
    free, even, cells, narrow, whole, step : see :func:`lampyris.kernels.sampling.growth.grow`. ``REACH`` of ``whole``: nodes
        by which a tree grows at most towards one cell.
    sides, stack : see :func:`lampyris.kernels.sampling.nearest.nearest`; of both trees.
    node_x, node_y, parent : int32 (2 room,): of both trees; node 0 is the start, node ``room`` the goal.
    count : int64 (6,).
    """
    room = len(node_x) // 2
    stride = whole[STRIDE]
    for turn in range(whole[SAMPLES]):
        if turn % LOOK == LOOK - 1 and stopped(halt):
            return STOPPED
        tree = 0 if count[FIRST_NODES] <= count[SECOND_NODES] else 1
        count[SAMPLED] += 1
        target = drawn_cell(free, cells, narrow, narrow, whole, -1.0, count, DRAWN)
        if count[SAMPLED] == 1:
            target = whole[GOAL]
        y = target // stride
        x = target - y * stride
        n = _connect(free, even, whole, step, sides, stack, node_x, node_y, parent, count, tree, room, x, y)
        if n < 0:
            continue
        x = int(node_x[u64(n)])
        y = int(node_y[u64(n)])
        m = _connect(
            free, even, whole, step, sides, stack, node_x, node_y, parent, count, 1 - tree, room, x, y
        )
        if m < 0 or node_x[u64(m)] != x or node_y[u64(m)] != y:
            continue
        many = 0
        at = n if tree == 0 else m
        while at >= 0:
            many += 1
            at = parent[u64(at)] + 0
        at = n if tree == 0 else m
        for k in range(many):
            stack[u64(many - 1 - k)] = int(node_y[u64(at)]) * stride + int(node_x[u64(at)])
            at = parent[u64(at)] + 0
        at = parent[u64(m if tree == 0 else n)] + 0
        while at >= 0:
            stack[u64(many)] = int(node_y[u64(at)]) * stride + int(node_x[u64(at)])
            many += 1
            at = parent[u64(at)] + 0
        count[VERTICES] = many
        return FOUND
    return DONE
