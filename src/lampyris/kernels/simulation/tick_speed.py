"""The physical law's speed at the cell just entered, for :mod:`.ticks`: wall, obstacles, and two passes."""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel
from lampyris.kernels.adgso.tick_speed import OF_ACCELERATION, OF_BRAKING, OF_GOAL, OF_LIMIT, OF_START

V_MAX, CREEP, D_MAX, A_MAX, RESOLUTION, RADIUS, RINGS, CLEARANCE = range(8)
"""Places in ``law``: m/s, m/s, m/s2, m/s2, metres a cell, metres; rings of cells around a node that are looked at; 1 if
walls count."""
OF_CLEARANCE, OF_OBSTACLE = 9, 10
"""Causes beside those of :mod:`lampyris.kernels.adgso.tick_speed`."""

UNKNOWN, NONE = -1, -2
"""In place of a distance to a wall: not looked up yet; no wall is near enough to count."""
_ROUNDING = 1e-12
"""As in :mod:`lampyris.motion.profile`."""


@kernel()
def wall_square(cell, blocked, rings, stride, height):
    """Squared half cells from a cell's centre to the nearest blocked square within so many rings; NONE: there is none.

    As :func:`lampyris.kernels.motion.nearest_wall.nearest_squares`, on a map with a border that is not blocked.
    """
    if blocked[cell] != 0:
        return 0
    cy = cell // stride
    cx = cell - cy * stride
    best = 1 << 62
    for k in range(1, rings + 1):
        flat = (2 * k - 1) * (2 * k - 1)
        if flat >= best:
            break
        for side in range(4):
            for j in range(-k, k + 1):
                px = cx + j
                py = cy - k
                if side == 1:
                    py = cy + k
                elif side == 2:
                    px = cx - k
                    py = cy + j
                elif side == 3:
                    px = cx + k
                    py = cy + j
                if px < 1 or py < 1 or px > stride - 2 or py > height:
                    continue
                if blocked[py * stride + px] != 0:
                    d = flat
                    if j != 0:
                        d += (2 * abs(j) - 1) * (2 * abs(j) - 1)
                    if d < best:
                        best = d
    return NONE if best == 1 << 62 else best


@kernel(out=("x", "cause", "near_wall"))
def physical_pace(
    came, route, place, steps, horizon, v, law, blocked, near_wall, where, obstacles, stride, height, x, cause
):
    """Speed at ``route[place]``, the cell just entered from ``came``; its cause is in ``cause[1]``.

    As :func:`lampyris.motion.laws.physical.physical_profile` on the cells ahead with ``on_infeasible="brake"``, to the
    last bit: the same sums in the same order.

    Parameters
    ----------
    steps : the route's.
    horizon : nodes that are looked at, less two.
    v : speed before.
    near_wall : int32 by cell number: see :func:`wall_square`; UNKNOWN: not looked up yet.
    where : the obstacles' cells.
    x : room, float64 (3 * (horizon + 2),).
    cause : room, int64 (2 * (horizon + 2),).
    """
    room = horizon + 2
    nodes = min(steps - place + 2, room)
    rings = int(law[RINGS])
    x0 = stride
    x1 = 0
    y0 = height + 2
    y1 = 0
    total = 0.0
    before = came
    along = 0.0
    for k in range(nodes):
        cell = came
        if k > 0:
            cell = route[place + k - 1]
        cy = cell // stride
        cx = cell - cy * stride
        x0 = min(x0, cx)
        x1 = max(x1, cx)
        y0 = min(y0, cy)
        y1 = max(y1, cy)
        cap = law[V_MAX]
        why = OF_LIMIT
        if law[CLEARANCE] != 0.0:
            if near_wall[cell] == UNKNOWN:
                near_wall[cell] = wall_square(cell, blocked, rings, stride, height)
            square = near_wall[cell]
            if square >= 0:
                distance = math.sqrt(float(square)) * (0.5 * law[RESOLUTION])
                bound = math.sqrt(2.0 * law[D_MAX] * max(distance - law[RADIUS], 0.0))
                bound = max(law[CREEP], bound)
                if bound < cap:
                    cap = bound
                    why = OF_CLEARANCE
        x[k] = cap
        cause[k] = why
        cause[room + k] = 1 << 62
        if k > 0:
            by = before // stride
            bx = before - by * stride
            total += math.sqrt(float((cx - bx) * (cx - bx) + (cy - by) * (cy - by)))
            x[2 * room + k - 1] = total * law[RESOLUTION] - along
            along = total * law[RESOLUTION]
        before = cell
    # Obstacles within the box around these nodes, widened by the rings: to each node the nearest of them.
    found = False
    for obstacle in range(obstacles):
        oy = where[obstacle] // stride
        ox = where[obstacle] - oy * stride
        if ox < x0 - rings or ox > x1 + rings or oy < y0 - rings or oy > y1 + rings:
            continue
        found = True
        for k in range(nodes):
            cell = came
            if k > 0:
                cell = route[place + k - 1]
            cy = cell // stride
            cx = cell - cy * stride
            gx = max(2 * abs(ox - cx) - 1, 0)
            gy = max(2 * abs(oy - cy) - 1, 0)
            cause[room + k] = min(cause[room + k], gx * gx + gy * gy)
    if found:
        for k in range(nodes):
            distance = math.sqrt(float(cause[room + k])) * (0.5 * law[RESOLUTION])
            bound = math.sqrt(2.0 * law[D_MAX] * max(distance - law[RADIUS], 0.0))
            bound = max(law[CREEP], bound)
            if bound < x[k]:
                x[k] = bound
                cause[k] = OF_OBSTACLE
    for k in range(nodes):
        x[room + k] = x[k]
        cause[room + k] = cause[k]
    for attempt in range(2):
        for k in range(nodes):
            x[k] = x[room + k] * x[room + k]
            cause[k] = cause[room + k]
        cause[nodes - 1] = OF_GOAL
        cause[0] = OF_START
        x[nodes - 1] = 0.0
        x[0] = min(x[0], v * v)
        if attempt == 1:
            floor = v * v
            x[0] = floor
            for k in range(1, nodes):
                floor -= 2.0 * law[D_MAX] * x[2 * room + k - 1]
                if floor <= 0.0:
                    break
                if floor > x[k]:
                    x[k] = floor
                    cause[k] = OF_BRAKING
        for k in range(1, nodes):
            reach = x[k - 1] + 2.0 * law[A_MAX] * x[2 * room + k - 1]
            keeps = cause[room + k] == OF_LIMIT and k < nodes - 1
            if reach < x[k] or (reach == x[k] and not keeps):
                x[k] = reach
                cause[k] = OF_ACCELERATION
        for k in range(nodes - 2, -1, -1):
            reach = x[k + 1] + 2.0 * law[D_MAX] * x[2 * room + k]
            if reach < x[k]:
                x[k] = reach
                cause[k] = OF_BRAKING
        if x[0] >= v * v * (1.0 - _ROUNDING):
            break
    return math.sqrt(x[1])
