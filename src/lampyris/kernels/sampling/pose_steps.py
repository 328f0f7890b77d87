"""Poses of a path moved by small steps, one after the other, where the curves to and from them then cost less."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.hybrid.goal_curve import curve_free
from lampyris.kernels.sampling.pose_connect import (
    ARM,
    BORDER,
    INNER,
    OUTER,
    ROWS,
    STRIDE,
    _curve_between,
)
from lampyris.kernels.sampling.tree import EQUAL


@kernel(
    out=("nodes", "paid", "pieces", "target", "segments", "goal", "lengths", "kinds"),
    of="nodes",
    each=100_000,
)
def step_poses(
    wall, clear, px, py, cover, whole, numbers, step, nodes, paid, pieces, target, segments, goal, lengths, kinds, halt,
):  # fmt: skip
    """Try steps along x and y, and turns, of every pose of a path but its ends; return how many made it cheaper.

    Parameters
    ----------
    wall, clear, px, py, cover, whole, numbers : see :func:`lampyris.kernels.sampling.pose_connect.connect_poses`.
    step : of x and y, cells; a turn moves a point at the distance ``ARM`` as far.
    nodes : float64 (4 m + 4,): x, y and yaw of the poses; a fourth number of each and a last node are room.
    paid, pieces : float64 (m,), (15 m,): of each pose what the curve to it from the one before costs, and the curve.
    target, segments, goal, lengths, kinds : room: float64 (5,), (30,), (3,), (5,), int64 (5,).
    """
    many = len(paid)
    better = 0
    for n in range(1, many - 1):
        if stopped(halt):
            return better
        for direction in range(6):
            axis = direction >> 1
            far = step if direction & 1 else -step
            if axis == 2:
                far /= numbers[u64(ARM)]
            for k in range(3):
                nodes[u64(4 * many + k)] = nodes[u64(4 * n + k)]
            nodes[u64(4 * many + axis)] += far
            most = paid[u64(n)] + paid[u64(n + 1)] - EQUAL
            for k in range(3):
                target[u64(k)] = nodes[u64(4 * n + 4 + k)]
            onwards = _curve_between(nodes, many, target, whole, numbers, 0, segments, goal, lengths, kinds)
            if onwards >= most:
                continue
            for k in range(15):
                segments[u64(15 + k)] = segments[u64(k)]
            for k in range(3):
                target[u64(k)] = nodes[u64(4 * many + k)]
            here = _curve_between(nodes, n - 1, target, whole, numbers, 0, segments, goal, lengths, kinds)
            if here + onwards >= most:
                continue
            if not curve_free(
                wall, clear, whole[u64(STRIDE)], whole[u64(ROWS)], whole[u64(BORDER)], px, py, cover, numbers[u64(INNER)],
                numbers[u64(OUTER)], nodes[u64(4 * n - 4)], nodes[u64(4 * n - 3)], nodes[u64(4 * n - 2)], segments,
            ):  # fmt: skip
                continue
            if not curve_free(
                wall, clear, whole[u64(STRIDE)], whole[u64(ROWS)], whole[u64(BORDER)], px, py, cover, numbers[u64(INNER)],
                numbers[u64(OUTER)], target[u64(0)], target[u64(1)], target[u64(2)], segments[15:],
            ):  # fmt: skip
                continue
            for k in range(3):
                nodes[u64(4 * n + k)] = target[u64(k)]
            for k in range(15):
                pieces[u64(15 * n + k)] = segments[u64(k)]
                pieces[u64(15 * n + 15 + k)] = segments[u64(15 + k)]
            paid[u64(n)] = here
            paid[u64(n + 1)] = onwards
            better += 1
    return better
