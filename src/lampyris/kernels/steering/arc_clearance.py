"""How far a robot may drive along an arc before its outline comes to a wall."""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel
from lampyris.kernels.motion.curve_motion import chord
from lampyris.kernels.motion.footprint_distance import outline_gap

NEAR = 1e-4
"""Cells from a wall within which the robot is at it, and drives on only where that takes it away from the wall."""

_TOUCH = 1e-9
"""Cells from a wall within which the robot touches it."""

_SHARE = 0.9
"""Share of the distance to the nearest wall that is driven before it is asked for again."""

_PLACES = 600
"""Places that are looked at, at most; what is farther is not known to be free."""

_DIAGONAL = 0.70710678118654757
"""Cells: the farthest that a point is from the centre of its cell."""


@kernel(out=("cells_x", "cells_y"), each=200_000, of="vx")
def free_arc(
    blocked, clear, width, height, resolution, vx, vy, arm, margin, x, y, hx, hy, cosine, sine, bend, turn,
    limit, cells_x, cells_y,
):  # fmt: skip
    """How far the robot can move along an arc, metres, at most ``limit``: no wall is touched, and the base is on the map.

    Conservative advancement: from a pose whose outline is a distance g from the nearest wall no point of the robot
    reaches one before a point of it has moved by g. Very near a wall it goes on as long as g grows: by parts of g that
    grow with it, so that a robot can leave a wall that it all but touches.

    Parameters
    ----------
    blocked, clear : of each cell, row by row: whether it is blocked, and metres from its centre to the nearest wall.
    vx, vy : vertices, cells; x ahead, y to the left.
    arm, margin : metres from the base to the farthest vertex, and the margin around the outline.
    x, y : the base, cells.
    hx, hy : direction of travel, y down; 0, 0 for a turn in place.
    cosine, sine : of the yaw, y up.
    bend, turn : curvature (1/m, y down) and yaw (rad/m, y up) along the arc.
    cells_x, cells_y : room for the vertices.
    """
    still = hx == 0.0 and hy == 0.0
    rate = abs(turn) * arm + (0.0 if still else 1.0)
    if rate == 0.0:
        return limit
    s = 0.0
    before = 0.0
    for _ in range(_PLACES):
        ratio, up, along = chord(0.5 * bend * s)
        far = s * ratio / resolution
        px = x + far * (hx * along - hy * up)
        py = y + far * (hx * up + hy * along)
        _, up, along = chord(turn * s)
        c = cosine * along - sine * up
        q = sine * along + cosine * up
        border = min(min(px + 0.5, width - 0.5 - px), min(py + 0.5, height - 0.5 - py))
        if border <= 0.0:
            return s
        rest = limit - s
        column = min(max(math.floor(px + 0.5), 0), width - 1)
        row = min(max(math.floor(py + 0.5), 0), height - 1)
        gap = clear[row * width + column] - _DIAGONAL * resolution - arm - margin
        if gap < rest * rate:
            # The outline itself, no farther than what is left, and than a few cells.
            most = min((rest * rate + margin) / resolution + 2.0 * NEAR, margin / resolution + 3.0)
            near = outline_gap(blocked, width, height, vx, vy, px, py, c, q, cells_x, cells_y, most)
            gap = max(gap, near * resolution - margin)
        reach = gap / rate
        if not still:
            reach = min(reach, border * resolution)
        if reach >= rest:
            return limit
        if reach <= NEAR * resolution and (reach <= _TOUCH * resolution or reach <= before):
            return s
        before = reach
        s += _SHARE * reach
    return s
