"""Two trees of poses, joined by the shortest curves of the robot: RRT-Connect for footprints.

Kuffner, LaValle, "RRT-Connect: an efficient approach to single-query path planning", ICRA 2000. Lines are the curves of
:func:`lampyris.kernels.hybrid.goal_curve.goal_curve`, checked for collisions as those of hybrid A* are, the middle of each piece
first. What is kept out by its cost (``BELOW``): Hauser, Zhou, "Asymptotically optimal planning by feasible kinodynamic
planning in a state-cost space", IEEE Transactions on Robotics 32(6), 2016, without samples of the cost.

Positions are in cells of the padded map, y down. In the tree of the goal curves lead from a node to its parent; they
are kept as they are driven backwards, from the parent on.
"""

from __future__ import annotations

from math import inf, sqrt

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.curves.angles import PI, TURN, wrapped
from lampyris.kernels.curves.sampling import moved
from lampyris.kernels.hybrid.goal_curve import curve_free, goal_curve
from lampyris.kernels.sampling.draws import WHOLE, drawn

DONE, FOUND, STOPPED, FULL = 0, 1, 2, 3
LOOK = 8
"""Samples between two looks at the flag that stops the search."""
NEAR = 3
"""The nearest nodes by distance and yaw, of which that with the cheapest curve is taken."""
HALVES = 2
"""How often a step that is blocked is halved."""
LEAST = 0.5
"""Cells: a shorter curve is no step."""
# Entries of ``whole``.
STRIDE, ROWS, BORDER, FAMILY, DRIVE, KEY, SAMPLES, ROOM = range(8)
# Entries of ``numbers``.
INNER, OUTER, RADIUS, REVERSE, TURN_COST, STEP, ARM, BELOW = range(8)
# Entries of ``count``: nodes of either tree; draws, samples, curves checked; the nodes at which the trees met.
FIRST_NODES, SECOND_NODES, DRAWN, SAMPLED, CURVES, FIRST_MET, SECOND_MET = range(7)


@kernel(out=("segments", "goal", "lengths", "kinds"))
def _curve_between(nodes, n, target, whole, numbers, tree, segments, goal, lengths, kinds):
    """Write the curve between node n and a pose as it leads away from n; its cost."""
    reverse = numbers[u64(REVERSE)]
    if tree == 0:
        for k in range(3):
            goal[u64(k)] = target[u64(k)]
        return goal_curve(
            nodes[u64(4 * n)], nodes[u64(4 * n + 1)], nodes[u64(4 * n + 2)], goal, False, numbers[u64(RADIUS)],
            whole[u64(FAMILY)], whole[u64(DRIVE)], reverse, 0.0, numbers[u64(TURN_COST)], segments, lengths, kinds,
        )  # fmt: skip
    for k in range(3):
        goal[u64(k)] = nodes[u64(4 * n + k)]
    cost = goal_curve(
        target[u64(0)], target[u64(1)], target[u64(2)], goal, False, numbers[u64(RADIUS)], whole[u64(FAMILY)],
        whole[u64(DRIVE)], reverse, 0.0, numbers[u64(TURN_COST)], segments, lengths, kinds,
    )  # fmt: skip
    for k in range(3):
        other = 4 - k
        length = segments[u64(3 * k)]
        turn = segments[u64(3 * k + 1)]
        lateral = segments[u64(3 * k + 2)]
        segments[u64(3 * k)] = -segments[u64(3 * other)]
        segments[u64(3 * k + 1)] = -segments[u64(3 * other + 1)]
        segments[u64(3 * k + 2)] = segments[u64(3 * other + 2)]
        segments[u64(3 * other)] = -length
        segments[u64(3 * other + 1)] = -turn
        segments[u64(3 * other + 2)] = lateral
    return cost


@kernel(out=("segments",))
def _shortened(segments, arm, step):
    """Keep the beginning of a curve, as long as a step (a radian in place counts as ``arm``); whether it was longer."""
    left = step
    cut = False
    for k in range(5):
        length = segments[u64(3 * k)]
        turn = segments[u64(3 * k + 1)]
        far = abs(length) if length != 0.0 else abs(turn) * arm
        if far > left:
            share = left / far
            segments[u64(3 * k)] = length * share
            segments[u64(3 * k + 1)] = turn * share
            cut = True
        left -= min(far, left)
    return cut


@kernel()
def _cost_of(segments, tree, reverse, turn_cost):
    """What a curve of a tree costs, driven the way that the path will be."""
    cost = 0.0
    for k in range(5):
        length = segments[u64(3 * k)] if tree == 0 else -segments[u64(3 * k)]
        if length == 0.0:
            cost += turn_cost * abs(segments[u64(3 * k + 1)])
        else:
            cost += length if length > 0.0 else -length * reverse
    return cost


@kernel(out=("nodes", "parent", "pieces", "segments", "goal", "lengths", "kinds", "count"))
def _extend(
    wall, clear, px, py, cover, whole, numbers, nodes, parent, pieces, tree, only, target, segments, goal,
    lengths, kinds, count,
):  # fmt: skip
    """Grow a tree by one curve towards a pose; the new node, or -1, and 1 if it is at the pose, as ``2 * node + 1``.

    Parameters
    ----------
    only : the node to grow from; -1: the nearest.
    target : float64 (5,): the pose; x and y of a root of the other tree, for the bound of the cost.
    """
    room = whole[u64(ROOM)]
    first = tree * room
    arm = numbers[u64(ARM)]
    v = only
    if only < 0:
        a = -1
        b = -1
        c = -1
        da = inf
        db = inf
        dc = inf
        for n in range(first, first + count[u64(tree)]):
            dx = nodes[u64(4 * n)] - target[u64(0)]
            dy = nodes[u64(4 * n + 1)] - target[u64(1)]
            turn = arm * wrapped(nodes[u64(4 * n + 2)] - target[u64(2)])
            d = dx * dx + dy * dy + turn * turn
            if d < dc:
                if d < da:
                    dc = db
                    c = b
                    db = da
                    b = a
                    da = d
                    a = n
                elif d < db:
                    dc = db
                    c = b
                    db = d
                    b = n
                else:
                    dc = d
                    c = n
        ids = (a, b, c)
        least = inf
        for k in range(NEAR):
            n = ids[k]
            if n >= 0:
                cost = _curve_between(nodes, n, target, whole, numbers, tree, segments, goal, lengths, kinds)
                if cost < least:
                    least = cost
                    v = n
    step = numbers[u64(STEP)]
    for attempt in range(HALVES + 1):
        _curve_between(nodes, v, target, whole, numbers, tree, segments, goal, lengths, kinds)
        cut = _shortened(segments, arm, step if attempt > 0 or only < 0 else 4.0 * step)
        x = nodes[u64(4 * v)]
        y = nodes[u64(4 * v + 1)]
        yaw = nodes[u64(4 * v + 2)]
        if not cut and attempt > 0 and only >= 0:
            return -1
        ex = x
        ey = y
        turned = yaw
        for k in range(5):
            ex, ey, turned = moved(
                ex, ey, turned, segments[u64(3 * k)], segments[u64(3 * k + 1)], segments[u64(3 * k + 2)]
            )
        g = nodes[u64(4 * v + 3)] + _cost_of(segments, tree, numbers[u64(REVERSE)], numbers[u64(TURN_COST)])
        dx = ex - target[u64(3)]
        dy = ey - target[u64(4)]
        if g + sqrt(dx * dx + dy * dy) >= numbers[u64(BELOW)]:
            return -1
        count[u64(CURVES)] += 1
        if curve_free(
            wall, clear, whole[u64(STRIDE)], whole[u64(ROWS)], whole[u64(BORDER)], px, py, cover, numbers[u64(INNER)],
            numbers[u64(OUTER)], x, y, yaw, segments,
        ):  # fmt: skip
            n = first + count[u64(tree)]
            count[u64(tree)] += 1
            nodes[u64(4 * n)] = ex
            nodes[u64(4 * n + 1)] = ey
            nodes[u64(4 * n + 2)] = wrapped(turned)
            nodes[u64(4 * n + 3)] = g
            parent[u64(n)] = v
            for k in range(15):
                pieces[u64(15 * n + k)] = segments[u64(k)]
            return 2 * n + (0 if cut else 1)
        step /= 2.0
        if step < LEAST:
            return -1
    return -1


@kernel(
    out=("nodes", "parent", "pieces", "target", "segments", "goal", "lengths", "kinds", "count"),
    of="cells",
    each=2000,
)
def connect_poses(
    wall, clear, px, py, cover, cells, whole, numbers, nodes, parent, pieces, target, segments, goal, lengths, kinds,
    count, halt,
):  # fmt: skip
    """Take samples until the trees meet or so many are taken.

    Parameters
    ----------
    wall, clear, px, py, cover : see :func:`lampyris.kernels.hybrid.collision.judge`.
    cells : int32 (f,): cells where the base may be, of the padded map.
    whole : int64 (8,); numbers : float64 (8,): what the names above say. ``STEP``: of curves, in cells. ``ARM``: cells that
        a radian counts as. ``BELOW``: no path that costs as much is of use. ``ROOM``: nodes that a tree has room for.
    nodes : float64 (8 room,): x, y, yaw and cost from the root, of both trees; roots are there.
    parent, pieces : int32 (2 room,), float64 (30 room,): parents, and the curves from them.
    target, segments, goal, lengths, kinds : room: float64 (5,), (15,), (3,), (5,), int64 (5,).
    count : int64 (7,).
    """
    stride = whole[u64(STRIDE)]
    room = whole[u64(ROOM)]
    key = whole[u64(KEY)]
    for turn in range(whole[u64(SAMPLES)]):
        if turn % LOOK == 0 and stopped(halt):
            return STOPPED
        if max(count[u64(FIRST_NODES)], count[u64(SECOND_NODES)]) + 64 > room:
            return FULL
        tree = count[u64(SAMPLED)] & 1
        count[u64(SAMPLED)] += 1
        at = count[u64(DRAWN)]
        count[u64(DRAWN)] += 4
        cell = int(cells[u64((drawn(key, at) * len(cells)) >> 32)])
        row = cell // stride
        target[u64(0)] = cell - row * stride + drawn(key, at + 1) / WHOLE - 0.5
        target[u64(1)] = row + drawn(key, at + 2) / WHOLE - 0.5
        target[u64(2)] = drawn(key, at + 3) / WHOLE * TURN - PI
        if count[u64(SAMPLED)] == 1:
            for k in range(3):
                target[u64(k)] = nodes[u64(4 * room + k)]
        for k in range(2):
            target[u64(3 + k)] = nodes[u64(4 * (1 - tree) * room + k)]
        n = _extend(
            wall, clear, px, py, cover, whole, numbers, nodes, parent, pieces, tree, -1, target, segments,
            goal, lengths, kinds, count,
        )  # fmt: skip
        if n < 0:
            continue
        n >>= 1
        for k in range(3):
            target[u64(k)] = nodes[u64(4 * n + k)]
        for k in range(2):
            target[u64(3 + k)] = nodes[u64(4 * tree * room + k)]
        most = numbers[u64(BELOW)]
        at = -1
        for _ in range(48):
            m = _extend(
                wall, clear, px, py, cover, whole, numbers, nodes, parent, pieces, 1 - tree, at, target,
                segments, goal, lengths, kinds, count,
            )  # fmt: skip
            if m < 0:
                break
            at = m >> 1
            if m & 1 and nodes[u64(4 * n + 3)] + nodes[u64(4 * at + 3)] < most:
                count[u64(FIRST_MET)] = n if tree == 0 else at
                count[u64(SECOND_MET)] = at if tree == 0 else n
                return FOUND
            if m & 1:
                break
    return DONE
