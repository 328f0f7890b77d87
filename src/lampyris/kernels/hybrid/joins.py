"""Exact curves that join one pose to each of many others, the cheapest free ones of them."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.hybrid.goal_curve import curve_free
from lampyris.kernels.hybrid.shortcut import BORDER, INNER, OUTER, ROWS, SCREEN, STRIDE, base_free, node_curve


@kernel(out=("costs", "segments", "goal", "lengths", "kinds"), of="costs", each=120_000)
def join_costs(nodes, into, whole, numbers, costs, segments, goal, lengths, kinds, halt):
    """The cost of the cheapest curve between the first node and each of the others, as if there were no walls.

    Parameters
    ----------
    nodes : float64 (3 n + 3,): x, y, yaw of each.
    into : whether curves lead from the others to the first node, and not from it.
    whole, numbers : see :func:`lampyris.kernels.hybrid.shortcut.shortcut`.
    costs : float64 (n,): infinite where there is none.
    segments, goal, lengths, kinds : room: float64 (15,), (3,), (5,), int64 (5,).
    """
    for k in range(1, len(costs) + 1):
        if k & 63 == 0 and stopped(halt):
            return
        i = k if into else 0
        costs[u64(k - 1)] = node_curve(
            nodes, i, 0 if into else k, whole, numbers, segments, goal, lengths, kinds
        )


@kernel(out=("curves", "taken", "segments", "goal", "lengths", "kinds"), of="taken", each=600_000)
def free_joins(
    wall, clear, px, py, cover, whole, numbers, nodes, into, order,
    curves, taken, segments, goal, lengths, kinds, halt,
):  # fmt: skip
    """Curves between the first node and the first of the others in an order where the footprint touches no wall.

    Parameters
    ----------
    wall, clear, px, py, cover : see :func:`lampyris.kernels.hybrid.collision.judge`.
    whole, numbers, nodes, into : see :func:`join_costs`.
    order : int64 (m,): numbers of nodes, 1 and above, in the order in which they are tried.
    curves : float64 (15 k,): segments of each curve that is free.
    taken : int64 (k,): the node of each; 0: there are no more.
    segments, goal, lengths, kinds : room.
    """
    stride = whole[u64(STRIDE)]
    rows = whole[u64(ROWS)]
    border = whole[u64(BORDER)]
    inner = numbers[u64(INNER)]
    outer = numbers[u64(OUTER)]
    count = 0
    for m in range(len(order)):
        if m & 15 == 15 and stopped(halt):
            return
        if count == len(taken):
            break
        k = int(order[u64(m)])
        i = k if into else 0
        node_curve(nodes, i, 0 if into else k, whole, numbers, segments, goal, lengths, kinds)
        x = nodes[u64(3 * i)]
        y = nodes[u64(3 * i + 1)]
        yaw = nodes[u64(3 * i + 2)]
        if base_free(clear, stride, rows, border, inner, x, y, yaw, segments, SCREEN) and curve_free(
            wall, clear, stride, rows, border, px, py, cover, inner, outer, x, y, yaw, segments
        ):
            taken[u64(count)] = k
            for n in range(15):
                curves[u64(15 * count + n)] = segments[u64(n)]
            count += 1
    for m in range(count, len(taken)):
        taken[u64(m)] = 0
