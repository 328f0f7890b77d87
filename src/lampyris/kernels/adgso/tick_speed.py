"""The dissertation's speed at the cell just entered, for :mod:`.simulate`: rings, angles and two passes."""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel

V_MAX, V_MIN, DROP1, DROP2, STRAIGHT, DIAGONAL, BRAKING, V180, V135, V90 = range(10)
"""Places in ``law``."""
OF_START, OF_LIMIT, OF_RING1, OF_RING2, OF_ANGLE, OF_GOAL, OF_ACCELERATION, OF_BRAKING, OF_WAITING = range(9)
"""Causes."""


@kernel(out=("x", "cause"))
def pace(came, path, place, steps, horizon, v, law, counted, blocked, taken, stride, height, x, cause):
    """Velocity at ``path[place]``, the cell just entered from ``came``; its cause is in ``cause[1]``.

    As :meth:`lampyris.sim.grid.tick_speed.TickSpeed.drive` on the ``horizon`` cells ahead.

    Parameters
    ----------
    v : velocity before.
    law : float64, see V_MAX; and at 10, 11 the cosines between which an angle is nearest 135 degrees.
    counted : uint8 (25 * 25,): by place in the 5 x 5 square around a node and heading into it: bit 1 if what
        is taken there counts, bit 2 if what is off the map does.
    blocked : uint8 by cell number, with the border.
    taken : by cell number, 0 where nobody is.
    x, cause : room, horizon + 2.
    """
    before = came
    # Nodes: came, then path[place], ..., n of them after the first.
    nodes = min(steps - place + 1, horizon + 1) + 1
    x[0] = v
    cause[0] = OF_START
    dx0 = 0
    dy0 = 0
    for k in range(1, nodes):
        cell = path[place + k - 1]
        step = cell - before
        dy = (step + stride + 1) // stride - 1
        dx = step - dy * stride
        heading = (dy + 2) * 5 + dx + 2
        n1 = 0
        n2 = 0
        cy = cell // stride
        cx = cell - cy * stride
        for q in range(25):
            rule = counted[q * 25 + heading]
            if rule == 0:
                continue
            ox = q % 5 - 2
            oy = q // 5 - 2
            px = cx + ox
            py = cy + oy
            hit = 0
            if px < 1 or py < 1 or px > stride - 2 or py > height:
                hit = rule & 2
            else:
                other = py * stride + px
                if blocked[other] != 0 or taken[other] != 0:
                    hit = rule & 1
            if hit != 0:
                if -1 <= ox <= 1 and -1 <= oy <= 1:
                    n1 += 1
                else:
                    n2 += 1
        best = law[V_MAX]
        why = OF_LIMIT
        by_rings = max(law[V_MIN], law[V_MAX] - law[DROP1] * n1 - law[DROP2] * n2)
        if by_rings < best:
            best = by_rings
            why = OF_RING1 if law[DROP1] * n1 >= law[DROP2] * n2 else OF_RING2
        x[k] = best
        cause[k] = why
        if k >= 2:
            # The angle at the node before, between the step into it and this one.
            dot = dx0 * dx + dy0 * dy
            length = (dx0 * dx0 + dy0 * dy0) * (dx * dx + dy * dy)
            cosine = dot / math.sqrt(length)
            by_angle = law[V180] if cosine > law[10] else (law[V135] if cosine > law[11] else law[V90])
            if by_angle < x[k - 1]:
                x[k - 1] = by_angle
                cause[k - 1] = OF_ANGLE
        dx0 = dx
        dy0 = dy
        before = cell
    last = nodes - 1
    if 0.0 < x[last]:
        x[last] = 0.0
        cause[last] = OF_GOAL
    before = came
    for k in range(1, nodes):
        step = path[place + k - 1] - before
        dy = (step + stride + 1) // stride - 1
        dx = step - dy * stride
        reach = x[k - 1] + (law[DIAGONAL] if dx != 0 and dy != 0 else law[STRAIGHT])
        if reach < x[k] or (reach == x[k] and cause[k] != OF_LIMIT):
            x[k] = reach
            cause[k] = OF_ACCELERATION
        before = path[place + k - 1]
    for k in range(nodes - 2, -1, -1):
        reach = x[k + 1] + law[BRAKING]
        if reach < x[k]:
            x[k] = reach
            cause[k] = OF_BRAKING
    return x[1]
