"""A tree of poses that is rewired as it grows: RRT* by exact curves, around a path that is known.

Karaman, Frazzoli, "Sampling-based algorithms for optimal motion planning", International Journal of Robotics Research
30(7), 2011 (the nearest nodes, their number growing with the logarithm of all); only samples that a cheaper path may lead
through: Gammell, Srinivasa, Barfoot, IROS 2014; a share of samples near the path: Nasir et al., "RRT*-SMART: a rapid
convergence implementation of RRT*", International Journal of Advanced Robotic Systems 10, 2013.

Nodes are roots, then the goals, then all others. Goals are no parents. Positions are as in :mod:`.pose_connect`.
"""

from __future__ import annotations

from math import inf, sqrt

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.curves.angles import PI, TURN, wrapped
from lampyris.kernels.hybrid.goal_curve import curve_free
from lampyris.kernels.sampling.draws import WHOLE, drawn
from lampyris.kernels.sampling.pose_connect import (
    ARM,
    BELOW,
    BORDER,
    DONE,
    FULL,
    INNER,
    KEY,
    LOOK,
    OUTER,
    ROOM,
    ROWS,
    SAMPLES,
    STEP,
    STOPPED,
    STRIDE,
    _curve_between,
)
from lampyris.kernels.sampling.tree import EQUAL, cut, hang

NEAREST = 48
"""Nodes around a sample that are looked at, at most."""
EACH = 3
"""Nodes around a sample for each doubling of the tree."""
LOCAL = 0x80000000
"""Of 2**32 samples so many are near the path."""
YAW = 0.6
"""Radians by which the yaw of a sample near the path differs from the path's, at most."""
FINER = 3
"""Samples near the path are up to half a ``STEP`` from it, or that halved 1, 2, ... times, up to so many; a bit mask."""
# Entries of ``whole`` after those of ``pose_connect``: how many roots and goals there are.
ROOTS, GOALS = 8, 9
# Entries of ``count``.
NODES, DRAWN, SAMPLED, CURVES = range(4)


@kernel(out=("nodes",))
def _settle(nodes, parent, child, after, paid, n):
    """Work out the costs of all below node n."""
    at = n
    while True:
        c = child[u64(at)]
        if c < 0:
            while at != n and after[u64(at)] < 0:
                at = parent[u64(at)] + 0
            if at == n:
                return
            c = after[u64(at)]
        at = c + 0
        nodes[u64(4 * at + 3)] = nodes[u64(4 * parent[u64(at)] + 3)] + paid[u64(at)]


@kernel(out=("near", "far"))
def _nearest(nodes, count, first, last, arm, target, most, near, far):
    """List the nodes nearest to a pose, nearest first, none of ``first`` to ``last - 1``; how many."""
    many = 0
    for n in range(count):
        if n >= first and n < last:
            continue
        dx = nodes[u64(4 * n)] - target[u64(0)]
        dy = nodes[u64(4 * n + 1)] - target[u64(1)]
        d = dx * dx + dy * dy
        if many == most and d >= far[u64(many - 1)]:
            continue
        turn = arm * wrapped(nodes[u64(4 * n + 2)] - target[u64(2)])
        d += turn * turn
        if many == most:
            if d >= far[u64(many - 1)]:
                continue
            many -= 1
        k = many
        while k > 0 and far[u64(k - 1)] > d:
            far[u64(k)] = far[u64(k - 1)]
            near[u64(k)] = near[u64(k - 1)]
            k -= 1
        far[u64(k)] = d
        near[u64(k)] = n
        many += 1
    return many


@kernel(out=("segments", "goal", "lengths", "kinds", "count"))
def _curve(
    wall,
    clear,
    px,
    py,
    cover,
    whole,
    numbers,
    nodes,
    n,
    target,
    most,
    check,
    segments,
    goal,
    lengths,
    kinds,
    count,
):
    """The cost of the curve from a node to a pose, which is written; infinite if it is ``most`` or more, or not free."""
    cost = _curve_between(nodes, n, target, whole, numbers, 0, segments, goal, lengths, kinds)
    if cost >= most:
        return inf
    if check:
        count[u64(CURVES)] += 1
        if not curve_free(
            wall, clear, whole[u64(STRIDE)], whole[u64(ROWS)], whole[u64(BORDER)], px, py, cover,
            numbers[u64(INNER)], numbers[u64(OUTER)], nodes[u64(4 * n)], nodes[u64(4 * n + 1)],
            nodes[u64(4 * n + 2)], segments,
        ):  # fmt: skip
            return inf
    return cost


@kernel(out=("target", "count"))
def _draw(cells, beacons, whole, numbers, target, count):
    """Draw a pose: in any cell where the base may be, or near the path."""
    key = whole[u64(KEY)]
    at = count[u64(DRAWN)]
    count[u64(DRAWN)] += 6
    across = drawn(key, at + 1) / WHOLE - 0.5
    along = drawn(key, at + 2) / WHOLE - 0.5
    turn = drawn(key, at + 3) / WHOLE
    if len(beacons) > 0 and drawn(key, at) < LOCAL:
        k = 3 * ((drawn(key, at + 4) * (len(beacons) // 3)) >> 32)
        close = drawn(key, at + 5)
        share = close / WHOLE / (1 << (close & FINER))
        wide = share * numbers[u64(STEP)]
        target[u64(0)] = beacons[u64(k)] + across * wide
        target[u64(1)] = beacons[u64(k + 1)] + along * wide
        target[u64(2)] = wrapped(beacons[u64(k + 2)] + (2.0 * turn - 1.0) * YAW * share)
        return
    stride = whole[u64(STRIDE)]
    cell = int(cells[u64((drawn(key, at + 4) * len(cells)) >> 32)])
    row = cell // stride
    target[u64(0)] = cell - row * stride + across
    target[u64(1)] = row + along
    target[u64(2)] = turn * TURN - PI


@kernel(
    out=(
        "nodes", "parent", "child", "after", "before", "paid", "pieces", "target", "segments", "goal", "lengths", "kinds",
        "near", "far", "count",
    ),
    of="cells", each=2000,
)  # fmt: skip
def improve_poses(
    wall, clear, px, py, cover, cells, beacons, whole, numbers, nodes, parent, child, after, before, paid, pieces, target,
    segments, goal, lengths, kinds, near, far, count, halt,
):  # fmt: skip
    """Take so many samples; the cost of the best path falls or stays.

    Parameters
    ----------
    wall, clear, px, py, cover, cells : see :func:`lampyris.kernels.sampling.pose_connect.connect_poses`.
    beacons : float64 (3 k,): poses of the path.
    whole : int64 (10,); numbers : float64 (8,): see there. ``STEP``: see :data:`FINER`.
    nodes : float64 (4 room,): x, y, yaw and cost; infinite: a goal that is not reached.
    parent, child, after, before : int32 (room,): see :mod:`lampyris.kernels.sampling.tree`.
    paid, pieces : float64 (room,), (15 room,): costs of the curves from the parents, and the curves.
    target, segments, goal, lengths, kinds : room: float64 (5,), (15,), (3,), (5,), int64 (5,).
    near, far : int64 and float64 (2 NEAREST,): room.
    count : int64 (4,).
    """
    roots = whole[u64(ROOTS)]
    last = roots + whole[u64(GOALS)]
    best = inf
    for n in range(roots, last):
        best = min(best, nodes[u64(4 * n + 3)])
    best = min(best, numbers[u64(BELOW)])
    gx = nodes[u64(4 * roots)]
    gy = nodes[u64(4 * roots + 1)]
    for turn in range(whole[u64(SAMPLES)]):
        if turn % LOOK == 0 and stopped(halt):
            return STOPPED
        if count[u64(NODES)] + 1 >= whole[u64(ROOM)]:
            return FULL
        count[u64(SAMPLED)] += 1
        _draw(cells, beacons, whole, numbers, target, count)
        x = target[u64(0)]
        y = target[u64(1)]
        yaw = target[u64(2)]
        dx = x - nodes[u64(0)]
        dy = y - nodes[u64(1)]
        rest = sqrt((x - gx) * (x - gx) + (y - gy) * (y - gy))
        if sqrt(dx * dx + dy * dy) + rest >= best:
            continue
        bits = 1
        while (count[u64(NODES)] >> bits) > 0:
            bits += 1
        many = _nearest(
            nodes,
            count[u64(NODES)],
            roots,
            last,
            numbers[u64(ARM)],
            target,
            min(EACH * bits, NEAREST),
            near,
            far,
        )
        # First the costs of curves from the nodes around, then a curve from the best of them that is free, then
        # curves from the new node to those around and to the goals.
        n = -1
        i = 0
        ahead = True
        while True:
            check = True
            v = 0
            if n < 0 and ahead:
                if i == many:
                    ahead = False
                    continue
                v = int(near[u64(i)])
                check = False
                begin = v
                most = best - rest - nodes[u64(4 * v + 3)]
            elif n < 0:
                i = -1
                least = inf
                for k in range(many):
                    if far[u64(NEAREST + k)] < least:
                        least = far[u64(NEAREST + k)]
                        i = k
                if i < 0:
                    break
                far[u64(NEAREST + i)] = inf
                v = int(near[u64(i)])
                begin = v
                most = best - rest - nodes[u64(4 * v + 3)]
            else:
                if i == many + last - roots:
                    break
                v = int(near[u64(i)]) if i < many else roots + i - many
                i += 1
                begin = n
                most = min(nodes[u64(4 * v + 3)] - EQUAL, best) - nodes[u64(4 * n + 3)]
                if v < roots:
                    continue
                for k in range(3):
                    target[u64(k)] = nodes[u64(4 * v + k)]
            dx = x - nodes[u64(4 * v)]
            dy = y - nodes[u64(4 * v + 1)]
            cost = inf
            if sqrt(dx * dx + dy * dy) < most:
                cost = _curve(
                    wall, clear, px, py, cover, whole, numbers, nodes, begin, target, most, check, segments, goal,
                    lengths, kinds, count,
                )  # fmt: skip
            if not check:
                far[u64(NEAREST + i)] = nodes[u64(4 * v + 3)] + cost
                i += 1
                continue
            if cost == inf or cost == 0.0:
                continue
            to = v
            if n < 0:
                n = count[u64(NODES)] + 0
                count[u64(NODES)] += 1
                nodes[u64(4 * n)] = x
                nodes[u64(4 * n + 1)] = y
                nodes[u64(4 * n + 2)] = yaw
                child[u64(n)] = -1
                to = n
                i = 0
            else:
                cut(parent, child, after, before, v)
            hang(parent, child, after, before, to, begin)
            paid[u64(to)] = cost
            nodes[u64(4 * to + 3)] = nodes[u64(4 * begin + 3)] + cost
            for k in range(15):
                pieces[u64(15 * to + k)] = segments[u64(k)]
            _settle(nodes, parent, child, after, paid, to)
            for k in range(roots, last):
                best = min(best, nodes[u64(4 * k + 3)])
    return DONE
