"""Hybrid A*: weighted A* over continuous poses, one for each cell and heading.

Dolgov, Thrun, Montemerlo, Diebel, "Path planning for autonomous vehicles in unknown semi-structured environments",
International Journal of Robotics Research 29(5), 2010. As there, a curve to the goal is tried now and then, the more
often the nearer the goal is. Different from there: a curve that is free becomes a candidate with its cost, and
the search ends when nothing that waits has a lower key; and a pose that is replaced by a cheaper one of its cell and
heading stays where it is in memory, because paths may lead through it.

All motions turn by whole numbers of heading bins, so that a node's yaw is the first one and a whole number of bins.
"""

from __future__ import annotations

from math import floor, sqrt

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.curves.angles import wrapped
from lampyris.kernels.hybrid.collision import piece_free
from lampyris.kernels.hybrid.goal_curve import curve_free, first_gear, goal_curve
from lampyris.kernels.lattice.search import _pop, _push

FOUND, EXHAUSTED, LIMIT, FULL = 0, 1, 2, 3
WAITING, EXPANDED, GENERATED, NODES, UNTIL_CURVE, CURVES = 0, 1, 2, 3, 4, 5
# Entries of ``numbers``.
(
    INNER, OUTER, RADIUS, REVERSE, SWITCH, TURN_COST, WEIGHT, ZONE, INTERVAL, REACH, YAW_REACH, YAW, BIN, LEAST,
) = range(14)  # fmt: skip
# Entries of ``whole``.
STRIDE, ROWS, BORDER, BINS, MOTIONS, FAMILY, DRIVE, ANY_YAW, ANALYTIC, BUDGET, FIRST = range(11)


@kernel(out=("node_float", "node_whole"), inline=True)
def _add(node_float, node_whole, n, x, y, g, heading, parent, motion, gear, state):
    """Write node ``n``."""
    node_float[u64(3 * n)] = x
    node_float[u64(3 * n + 1)] = y
    node_float[u64(3 * n + 2)] = g
    node_whole[u64(6 * n)] = heading
    node_whole[u64(6 * n + 1)] = parent
    node_whole[u64(6 * n + 2)] = motion
    node_whole[u64(6 * n + 3)] = gear
    node_whole[u64(6 * n + 4)] = state
    node_whole[u64(6 * n + 5)] = 0


@kernel(inline=True)
def _is_goal(x, y, yaw, goal, any_yaw, reach, yaw_reach):
    """Whether a pose is within the tolerances of the goal."""
    if reach < 0.0:
        return False
    dx = x - goal[u64(0)]
    dy = y - goal[u64(1)]
    if dx * dx + dy * dy > reach * reach:
        return False
    return any_yaw or abs(wrapped(yaw - goal[u64(2)])) <= yaw_reach


@kernel(out=("count", "best", "segments", "tried", "lengths", "kinds"))
def _try_curve(
    wall, clear, px, py, cover, whole, numbers, goal, x, y, yaw, g, gear, node, h,
    count, best, segments, tried, lengths, kinds,
):  # fmt: skip
    """Try the curve from a node to the goal if it is time, and keep it if it is the best so far."""
    count[u64(UNTIL_CURVE)] -= 1
    if count[u64(UNTIL_CURVE)] > 0:
        return
    count[u64(UNTIL_CURVE)] = 1 + int(h / numbers[u64(INTERVAL)])
    cost = goal_curve(
        x, y, yaw, goal, whole[u64(ANY_YAW)] != 0, numbers[u64(RADIUS)], whole[u64(FAMILY)], whole[u64(DRIVE)],
        numbers[u64(REVERSE)], numbers[u64(SWITCH)], numbers[u64(TURN_COST)], tried, lengths, kinds,
    )  # fmt: skip
    if first_gear(tried, whole[u64(DRIVE)]) * gear < 0:
        cost += numbers[u64(SWITCH)]
    if best[u64(0)] >= 0.0 and g + cost >= best[u64(0)]:
        return
    count[u64(CURVES)] += 1
    if curve_free(
        wall, clear, whole[u64(STRIDE)], whole[u64(ROWS)], whole[u64(BORDER)], px, py, cover, numbers[u64(INNER)],
        numbers[u64(OUTER)], x, y, yaw, tried,
    ):  # fmt: skip
        best[u64(0)] = g + cost
        best[u64(1)] = node
        best[u64(2)] = 1.0
        for k in range(15):
            segments[u64(k)] = tried[u64(k)]


@kernel(
    out=(
        "slot", "node_float", "node_whole", "keys", "heap", "count", "best", "segments", "tried", "lengths", "kinds",
    ),
    of="node_float", each=100,
)  # fmt: skip
def search(
    wall, clear, field, px, py, cover, whole, numbers, goal, motion_x, motion_y, motion_float, motion_whole,
    slot, node_float, node_whole, keys, heap, count, best, segments, tried, lengths, kinds, halt,
):  # fmt: skip
    """Search until the best path found costs no more than the least key, nothing waits, or the budget is used.

    Parameters
    ----------
    wall, clear, field : uint8, float32, float32 (cells,) of the padded map: walls; distance from the centre to the
        nearest wall; estimate of the cost to the goal, negative where the base must not be.
    px, py, cover : float64 (k,), (k,), (3 d,): vertices of the outline, in cells; discs that cover it.
    whole, numbers : int64 (11,), float64 (14,): what the names above say. ``REACH`` below 0: only a curve reaches the
        goal; ``BUDGET``: greatest number of expansions, negative: none; ``FIRST``: number of the first node.
    goal : float64 (3,).
    motion_x, motion_y : float64 (bins * motions,): change of position, by heading and motion.
    motion_float : float64 (4 * motions,): length, turn, lateral, cost.
    motion_whole : int64 (2 * motions,): bins turned, gear.
    slot : int32 (states,): number of the node that holds a state; below ``FIRST``: none does.
    node_float : float64 (3 * room,): x, y, cost.
    node_whole : int32 (6 * room,): heading, parent, motion, gear, state; 2 if closed, 1 if its key has the curve.
    keys, heap : float64, int32: what waits.
    count : int64 (6,): waiting, expanded, generated, nodes, expansions until the next curve, curves tried.
    best : float64 (3,): cost of the best path, negative: none; its last node; whether a curve ends it.
    segments : float64 (15,): the curve at the end of the best path.
    tried, lengths, kinds : room.
    """
    stride = whole[u64(STRIDE)]
    rows = whole[u64(ROWS)]
    border = whole[u64(BORDER)]
    bins = whole[u64(BINS)]
    motions = whole[u64(MOTIONS)]
    first = whole[u64(FIRST)]
    inner = numbers[u64(INNER)]
    outer = numbers[u64(OUTER)]
    weight = numbers[u64(WEIGHT)]
    room = min(len(node_float) // 3, len(heap)) - motions - 2
    look = 64
    while count[u64(WAITING)] > 0:
        if best[u64(0)] >= 0.0 and keys[u64(0)] >= best[u64(0)]:
            return FOUND
        if whole[u64(BUDGET)] >= 0 and count[u64(EXPANDED)] >= whole[u64(BUDGET)]:
            return LIMIT
        if count[u64(WAITING)] >= room or count[u64(NODES)] >= room:
            return FULL
        look -= 1
        if look == 0:
            look = 64
            if stopped(halt):
                return LIMIT
        node = int(heap[u64(0)])
        _pop(keys, heap, count[u64(WAITING)])
        count[u64(WAITING)] -= 1
        state = int(node_whole[u64(6 * node + 4)])
        flag = node_whole[u64(6 * node + 5)]
        if slot[u64(state)] != first + node or flag == 2:
            continue
        x = node_float[u64(3 * node)]
        y = node_float[u64(3 * node + 1)]
        g = node_float[u64(3 * node + 2)]
        heading = int(node_whole[u64(6 * node)])
        gear = int(node_whole[u64(6 * node + 3)])
        cell = state // bins
        h = float(field[u64(cell)])
        yaw = numbers[u64(YAW)] + heading * numbers[u64(BIN)]
        if flag == 0 and h < numbers[u64(ZONE)]:
            # Near the goal the curve as if there were no walls says more than the field; it takes a microsecond, so it
            # is only worked out for what is about to be expanded.
            node_whole[u64(6 * node + 5)] = 1
            cost = goal_curve(
                x, y, yaw, goal, whole[u64(ANY_YAW)] != 0, numbers[u64(RADIUS)], whole[u64(FAMILY)], whole[u64(DRIVE)],
                numbers[u64(REVERSE)], numbers[u64(SWITCH)], numbers[u64(TURN_COST)], tried, lengths, kinds,
            )  # fmt: skip
            cost -= numbers[u64(LEAST)]
            if cost > h:
                _push(keys, heap, count[u64(WAITING)], g + weight * cost, node)
                count[u64(WAITING)] += 1
                continue
        node_whole[u64(6 * node + 5)] = 2
        count[u64(EXPANDED)] += 1
        if whole[u64(ANALYTIC)] != 0:
            _try_curve(
                wall, clear, px, py, cover, whole, numbers, goal, x, y, yaw, g, gear, node, h,
                count, best, segments, tried, lengths, kinds,
            )  # fmt: skip
        column = floor(x + 0.5)
        row = floor(y + 0.5)
        room_here = (
            clear[u64(cell)] - sqrt((x - column) * (x - column) + (y - row) * (y - row)) - outer - 1e-5
        )
        inside = min(min(x, y) - border, min(stride - 1 - border - x, rows - 1 - border - y))
        for m in range(motions):
            to_x = x + motion_x[u64(heading * motions + m)]
            to_y = y + motion_y[u64(heading * motions + m)]
            to_cell = floor(to_y + 0.5) * stride + floor(to_x + 0.5)
            if to_cell < 0 or to_cell >= len(field):
                continue
            to_h = float(field[u64(to_cell)])
            if to_h < 0.0:
                continue
            to_heading = (heading + motion_whole[u64(2 * m)]) % bins
            to_gear = motion_whole[u64(2 * m + 1)]
            to_g = g + motion_float[u64(4 * m + 3)]
            if to_gear * gear < 0:
                to_g += numbers[u64(SWITCH)]
            if to_gear == 0:
                to_gear = gear
            if best[u64(0)] >= 0.0 and to_g + to_h >= best[u64(0)]:
                continue
            to_state = to_cell * bins + to_heading
            old = slot[u64(to_state)] - first
            if old >= 0 and (
                node_whole[u64(6 * old + 5)] == 2 or node_float[u64(3 * old + 2)] <= to_g + 1e-9
            ):
                continue
            count[u64(GENERATED)] += 1
            length = motion_float[u64(4 * m)]
            turn = motion_float[u64(4 * m + 1)]
            far = abs(length) + abs(turn) * outer
            if (room_here < far or inside < far) and not piece_free(
                wall, clear, stride, rows, border, px, py, cover, inner, outer, x, y, yaw, length, turn,
                motion_float[u64(4 * m + 2)],
            ):  # fmt: skip
                continue
            n = int(count[u64(NODES)])
            count[u64(NODES)] += 1
            _add(node_float, node_whole, n, to_x, to_y, to_g, to_heading, node, m, to_gear, to_state)
            slot[u64(to_state)] = first + n
            if (best[u64(0)] < 0.0 or to_g < best[u64(0)]) and _is_goal(
                to_x,
                to_y,
                yaw + turn,
                goal,
                whole[u64(ANY_YAW)] != 0,
                numbers[u64(REACH)],
                numbers[u64(YAW_REACH)],
            ):
                best[u64(0)] = to_g
                best[u64(1)] = n
                best[u64(2)] = 0.0
            _push(keys, heap, count[u64(WAITING)], to_g + weight * to_h, n)
            count[u64(WAITING)] += 1
    return FOUND if best[u64(0)] >= 0.0 else EXHAUSTED
