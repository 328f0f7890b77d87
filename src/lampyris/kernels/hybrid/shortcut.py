"""Shortcuts: exact curves between poses of a path, where they are free and cost less than the path does.

Of all sequences of nodes from the first to the last the cheapest is found, by dynamic programming from the first node on:
two nodes are joined by the path, if they are neighbours, or by a curve. Curves are checked for collisions in the order of
what they would come to, and only until one is free.
"""

from __future__ import annotations

from math import ceil, floor, inf, sqrt

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.curves.sampling import moved
from lampyris.kernels.hybrid.goal_curve import CAR, SIDEWAYS, curve_free, goal_curve

NO_LENGTH = 1e-9
"""Cells, or radians, below which a segment is left out: rounding of a curve that begins or ends straight."""
LEAST_LENGTH = 2e-6
"""Cells of the shortest segment that a curve may have, if it is not left out."""
COARSE, SCREEN = 8.0, 2.0
"""Cells between two places of the base that are looked up before a curve is checked exactly: first few, then more."""
SLACK = 1e-6
"""Cells by which rounding may lengthen a straight line."""
BEHIND = 8
"""Nodes behind the beginning of the curve to the last node from which curves to the next are tried."""
# Entries of ``whole`` and ``numbers``.
STRIDE, ROWS, BORDER, FAMILY, DRIVE = range(5)
INNER, OUTER, RADIUS, REVERSE, TURN_COST, GAIN = range(6)


@kernel(out=("segments", "goal", "lengths", "kinds"))
def node_curve(nodes, i, j, whole, numbers, segments, goal, lengths, kinds):
    """Write the segments of the cheapest curve from node i to node j; returns its cost, infinite if it is of no use."""
    for k in range(3):
        goal[u64(k)] = nodes[u64(3 * j + k)]
    x = nodes[u64(3 * i)]
    y = nodes[u64(3 * i + 1)]
    yaw = nodes[u64(3 * i + 2)]
    drive = whole[u64(DRIVE)]
    cost = goal_curve(
        x, y, yaw, goal, False, numbers[u64(RADIUS)], whole[u64(FAMILY)], drive, numbers[u64(REVERSE)], 0.0,
        numbers[u64(TURN_COST)], segments, lengths, kinds,
    )  # fmt: skip
    if drive == SIDEWAYS:  # it drives as a car, too
        straight = cost
        cost = goal_curve(
            x, y, yaw, goal, False, numbers[u64(RADIUS)], whole[u64(FAMILY)], CAR, numbers[u64(REVERSE)], 0.0,
            numbers[u64(TURN_COST)], segments, lengths, kinds,
        )  # fmt: skip
        if straight <= cost:
            cost = goal_curve(
                x, y, yaw, goal, False, numbers[u64(RADIUS)], whole[u64(FAMILY)], drive, numbers[u64(REVERSE)], 0.0,
                numbers[u64(TURN_COST)], segments, lengths, kinds,
            )  # fmt: skip
    for k in range(5):
        length = abs(segments[u64(3 * k)])
        if length < NO_LENGTH and abs(segments[u64(3 * k + 1)]) < NO_LENGTH:
            segments[u64(3 * k)] = 0.0
            segments[u64(3 * k + 1)] = 0.0
        elif 0.0 < length < LEAST_LENGTH:
            return inf
    return cost


@kernel()
def base_free(clear, stride, rows, border, inner, x, y, yaw, segments, apart):
    """Whether the base is on the map and not nearer to a wall than the footprint allows, at places of a curve ``apart``."""
    for k in range(5):
        length = segments[u64(3 * k)]
        turn = segments[u64(3 * k + 1)]
        lateral = segments[u64(3 * k + 2)]
        parts = ceil(abs(length) / apart)
        for i in range(1, parts + 1):
            share = i / parts
            px, py, _ = moved(x, y, yaw, share * length, share * turn, lateral)
            if min(min(px, py) - border, min(stride - 1 - border - px, rows - 1 - border - py)) <= -0.5:
                return False
            column = floor(px + 0.5)
            row = floor(py + 0.5)
            off = sqrt((px - column) * (px - column) + (py - row) * (py - row))
            if clear[u64(row * stride + column)] + off < inner - 1e-5:
                return False
        x, y, yaw = moved(x, y, yaw, length, turn, lateral)
    return True


@kernel(
    out=("offer", "known", "drawn", "best", "before", "curves", "count", "segments", "goal", "lengths", "kinds"),
    of="offer", each=60_000,
)  # fmt: skip
def shortcut(
    wall, clear, px, py, cover, whole, numbers, nodes, along,
    offer, known, drawn, best, before, curves, count, segments, goal, lengths, kinds, halt,
):  # fmt: skip
    """The cheapest sequence of parts of the path and free curves from the first node to the last.

    Parameters
    ----------
    wall, clear, px, py, cover : see :func:`lampyris.kernels.hybrid.collision.judge`.
    whole : int64 (5,): stride, rows and border of the map; family of curves and drive (see ``goal_curve``).
    numbers : float64 (6,): radii of the discs inside and around the outline; turning radius; cost of a cell's length in
        reverse, 0: none; cost of a radian turned in place; what a curve must cost less than the path.
    nodes : float64 (3 n,): x, y, yaw of poses of the path where the footprint is free, in order.
    along : float64 (n,): cost of the path up to each of them.
    offer, known, drawn : float64, uint8 (n,), float64 (15 n,): room.
    best : float64 (n,): least cost up to each node.
    before : int64 (n,): the node before each node in that sequence.
    curves : float64 (15 n,): segments of the curve from there; all 0: it follows the path.
    count : int64 (2,): curves worked out, and checked for collisions.
    segments, goal, lengths, kinds : room: float64 (15,), (3,), (5,), int64 (5,).
    """
    n = len(along)
    stride = whole[u64(STRIDE)]
    rows = whole[u64(ROWS)]
    border = whole[u64(BORDER)]
    inner = numbers[u64(INNER)]
    outer = numbers[u64(OUTER)]
    best[u64(0)] = 0.0
    before[u64(0)] = -1
    count[u64(0)] = 0
    count[u64(1)] = 0
    for j in range(1, n):
        if stopped(halt):
            return
        kept = best[u64(j - 1)] + along[u64(j)] - along[u64(j - 1)]
        at = j - 1
        curved = False
        # Curves from far behind the one that led to the last node are most likely not free, either.
        low = max(0, int(before[u64(j - 1)]) - BEHIND)
        for i in range(low, j):
            dx = nodes[u64(3 * j)] - nodes[u64(3 * i)]
            dy = nodes[u64(3 * j + 1)] - nodes[u64(3 * i + 1)]
            straight = sqrt(dx * dx + dy * dy)
            # No curve is shorter than the straight line: where even that saves too little, none is worked out.
            worth = along[u64(j)] - along[u64(i)] - straight >= numbers[u64(GAIN)] - SLACK
            offer[u64(i)] = best[u64(i)] + straight if worth else inf
            known[u64(i)] = 0
        while True:
            i = -1
            least = kept
            for k in range(low, j):
                if offer[u64(k)] < least:
                    least = offer[u64(k)]
                    i = k
            if i < 0:
                break
            if known[u64(i)] == 0:
                cost = node_curve(nodes, i, j, whole, numbers, segments, goal, lengths, kinds)
                known[u64(i)] = 1
                for k in range(15):
                    drawn[u64(15 * i + k)] = segments[u64(k)]
                count[u64(0)] += 1
                saved = along[u64(j)] - along[u64(i)] - cost
                offer[u64(i)] = best[u64(i)] + cost if saved >= numbers[u64(GAIN)] else inf
                continue
            offer[u64(i)] = inf
            for k in range(15):
                segments[u64(k)] = drawn[u64(15 * i + k)]
            count[u64(1)] += 1
            x = nodes[u64(3 * i)]
            y = nodes[u64(3 * i + 1)]
            yaw = nodes[u64(3 * i + 2)]
            if (
                base_free(clear, stride, rows, border, inner, x, y, yaw, segments, COARSE)
                and base_free(clear, stride, rows, border, inner, x, y, yaw, segments, SCREEN)
                and curve_free(
                    wall, clear, stride, rows, border, px, py, cover, inner, outer, x, y, yaw, segments
                )
            ):
                kept = least
                at = i
                curved = True
                break
        best[u64(j)] = kept
        before[u64(j)] = at
        for k in range(15):
            curves[u64(15 * j + k)] = segments[u64(k)] if curved else 0.0
