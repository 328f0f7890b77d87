"""Two trees, from the start and from the goal, that grow towards each other: RRT-Connect.

Kuffner, LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000. A line of a whole step
that is blocked is halved up to :data:`HALVES` times, and then a step of one cell along either axis is tried (ours): long
steps then serve narrow places, too, and nodes slide along walls to doors.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.sampling.draws import GOAL, RULE, SAMPLES, STRIDE, drawn_cell
from lampyris.kernels.sampling.growth import DONE, FOUND, LOOK, STOPPED, steered
from lampyris.kernels.sampling.lines import line_free
from lampyris.kernels.sampling.nearest import nearest, node_at, put_node

HALVES = 3
# Entries of ``count``: nodes of either tree; draws, samples, lines; the nodes at which the trees met.
FIRST_NODES, SECOND_NODES, DRAWN, SAMPLED, LINES, FIRST_MET, SECOND_MET = range(7)


@kernel(out=("sides", "stack", "node_x", "node_y", "parent", "count"))
def _extend(free, even, whole, step, halves, sides, stack, node_x, node_y, parent, count, tree, room, x, y):
    """Grow a tree by one line towards a cell; the new node, or -1."""
    stride = whole[STRIDE]
    first = tree * room
    v = nearest(sides, node_x, node_y, first, x, y, stack)
    vx = int(node_x[u64(v)])
    vy = int(node_y[u64(v)])
    if vx == x and vy == y:
        return v
    far = step
    for attempt in range(halves + 3):
        if attempt <= halves:
            cell = steered(stride, vx, vy, x, y, far)
            far = min(far, abs(x - vx) + abs(y - vy)) / 2.0
        elif halves == 0:
            return -1
        elif attempt == halves + 1:
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


@kernel(out=("sides", "stack", "node_x", "node_y", "parent", "count"), of="cells", each=100)
def connect(free, even, cells, narrow, whole, step, sides, stack, node_x, node_y, parent, count, halt):
    """Take samples until the trees meet or so many are taken.

    Parameters
    ----------
    free, even, cells, narrow, whole, step : see :func:`lampyris.kernels.sampling.growth.grow`.
    sides, stack : see :func:`lampyris.kernels.sampling.nearest.nearest`; of both trees.
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
        target = drawn_cell(free, cells, narrow, whole, -1.0, count, DRAWN)
        if count[SAMPLED] == 1:
            target = whole[GOAL]
        y = target // stride
        x = target - y * stride
        n = _extend(
            free, even, whole, step, HALVES, sides, stack, node_x, node_y, parent, count, tree, room, x, y
        )
        if n < 0:
            continue
        x = int(node_x[u64(n)])
        y = int(node_y[u64(n)])
        while True:
            m = _extend(
                free, even, whole, step, 0, sides, stack, node_x, node_y, parent, count, 1 - tree, room, x, y
            )
            if m < 0:
                break
            if node_x[u64(m)] == x and node_y[u64(m)] == y:
                count[FIRST_MET] = n if tree == 0 else m
                count[SECOND_MET] = m if tree == 0 else n
                return FOUND
    return DONE
