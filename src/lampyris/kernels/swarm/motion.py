"""Discs that drive in small steps among walls and each other, and never touch.

Robots move one after the other within a small step. A robot compares its motion with the others' *relative* to its own, over
the whole small step: with those that moved before it as they moved, with the others as if they stood. A robot that stands is
then never touched by one that was allowed to move, so that standing is always possible, and the discs are apart at every moment.
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel
from lampyris.kernels.swarm.bins import fill_bins


@kernel(out=("normal",), inline=True, each=10_000)
def blocked_by(
    i, dx, dy, x, y, now_x, now_y, apart, walls, blocked, width, height, cell, away, near, many, normal
):  # fmt: skip
    """Whether moving robot i by (dx, dy) would touch a wall (1) or a robot (2), or not (0).

    ``normal`` gets the direction from what is touched to the robot, of the one that is approached most squarely.
    """
    px = x[i]
    py = y[i]
    ex = px + dx
    ey = py + dy
    hit = 0
    worst = 0.0
    wide = width * cell
    high = height * cell
    if ex < away and dx < 0.0:
        hit = 1
        normal[0] = 1.0
        normal[1] = 0.0
        worst = dx
    if ex > wide - away and dx > 0.0 and -dx < worst:
        hit = 1
        normal[0] = -1.0
        normal[1] = 0.0
        worst = -dx
    if ey < away and dy < 0.0 and dy < worst:
        hit = 1
        normal[0] = 0.0
        normal[1] = 1.0
        worst = dy
    if ey > high - away and dy > 0.0 and -dy < worst:
        hit = 1
        normal[0] = 0.0
        normal[1] = -1.0
        worst = -dy
    if walls != 0:
        low_x = max(int((min(px, ex) - away) / cell), 0)
        high_x = min(int((max(px, ex) + away) / cell), width - 1)
        low_y = max(int((min(py, ey) - away) / cell), 0)
        high_y = min(int((max(py, ey) + away) / cell), height - 1)
        length = dx * dx + dy * dy
        for v in range(low_y, high_y + 1):
            for u in range(low_x, high_x + 1):
                if blocked[v * width + u] == 0:
                    continue
                left = u * cell
                top = v * cell
                # From the nearest point of the wall's square to the robot, before the motion and after it.
                gx = px - min(max(px, left), left + cell)
                gy = py - min(max(py, top), top + cell)
                along = gx * dx + gy * dy
                if along >= 0.0:
                    continue
                fx = ex - min(max(ex, left), left + cell)
                fy = ey - min(max(ey, top), top + cell)
                least = fx * fx + fy * fy
                for corner in range(4):
                    cx = left + (corner % 2) * cell - px
                    cy = top + (corner // 2) * cell - py
                    share = min(max((cx * dx + cy * dy) / length, 0.0), 1.0)
                    cx -= share * dx
                    cy -= share * dy
                    least = min(least, cx * cx + cy * cy)
                if least >= away * away:
                    continue
                size = math.sqrt(gx * gx + gy * gy)
                if along < worst * size or hit == 0:
                    hit = 1
                    worst = along / size
                    normal[0] = gx / size
                    normal[1] = gy / size
    for k in range(many):
        j = near[k]
        gx = px - x[j]
        gy = py - y[j]
        # The motion relative to robot j, which may have moved within this small step.
        mx = ex - now_x[j] - gx
        my = ey - now_y[j] - gy
        along = gx * mx + gy * my
        if along >= 0.0:
            continue
        square = mx * mx + my * my
        share = min(-along / square, 1.0)
        nx = gx + share * mx
        ny = gy + share * my
        if nx * nx + ny * ny >= apart * apart:
            continue
        size = math.sqrt(gx * gx + gy * gy)
        if hit == 0 or gx * dx + gy * dy < worst * size:
            worst = (gx * dx + gy * dy) / size
            normal[0] = gx / size
            normal[1] = gy / size
        hit = 2
    return hit


@kernel(
    out=("x", "y", "cosine", "sine", "left", "now_x", "now_y", "first", "member", "near", "normal", "path_x", "path_y", "met"),
    each=100_000,
    of="x",
)  # fmt: skip
def drive_steps(
    goal_x, goal_y, blocked, clear, width, height, cell, away, apart, steps, reach, turn_cos, turn_sin,
    side, columns, rows, x, y, cosine, sine, left, now_x, now_y, first, member, near, normal, path_x, path_y, met,
):  # fmt: skip
    """Drive every robot by small steps in its direction, around what is in the way; returns the robot's motions.

    A robot whose way ahead is blocked turns to the tangent at what blocks it, the one nearer to its direction (of two
    equal ones that to its right), and if that is blocked to the other; it stands if both are. It turns at one place,
    and drives where it looks.

    Parameters
    ----------
    goal_x, goal_y : float64 (n,): unit vectors: where each robot wants to go.
    blocked, clear, width, height, cell : the map, metres from each cell's centre to the nearest wall, metres a cell.
    away, apart : least distance of a robot's centre to walls, and of two centres, metres.
    steps, reach : number of small steps, and metres of each at the most.
    turn_cos, turn_sin : of the greatest turn of a small step.
    side, columns, rows : of the bins.
    x, y, cosine, sine : in and out, float64 (n,): place and heading.
    left : in and out, float64 (n,): metres that each may still drive.
    now_x, now_y, first, member, near, normal : scratch.
    path_x, path_y : out, float64 (steps * n,): where each robot is after each small step.
    met : out, int64 (n,): 1 where a wall was in the way, 2 a robot, 3 both.
    """
    n = len(x)
    far = apart + 2.0 * reach
    square = far * far
    per_side = 1.0 / side
    per_cell = 1.0 / cell
    motions = 0
    for i in range(n):
        met[i] = 0
    for step in range(steps):
        fill_bins(x, y, side, columns, rows, first, member)
        for i in range(n):
            now_x[i] = x[i]
            now_y[i] = y[i]
        for i in range(n):
            room = min(left[i], reach)
            if room <= 0.0:
                continue
            ux = goal_x[i]
            uy = goal_y[i]
            tx = ux
            ty = uy
            free = False
            px = x[i]
            py = y[i]
            many = 0
            low_x = min(max(int((px - far) * per_side), 0), columns - 1)
            high_x = min(max(int((px + far) * per_side), 0), columns - 1)
            low_y = min(max(int((py - far) * per_side), 0), rows - 1)
            high_y = min(max(int((py + far) * per_side), 0), rows - 1)
            for v in range(low_y, high_y + 1):
                for k in range(first[v * columns + low_x], first[v * columns + high_x + 1]):
                    j = member[k]
                    gx = px - x[j]
                    gy = py - y[j]
                    if gx * gx + gy * gy < square and j != i:
                        near[many] = j
                        many += 1
            u = min(max(int(px * per_cell), 0), width - 1)
            v = min(max(int(py * per_cell), 0), height - 1)
            aside = abs(px - (u + 0.5) * cell) + abs(py - (v + 0.5) * cell)
            walls = 1 if clear[v * width + u] - aside < away + reach else 0
            for attempt in range(3):
                hit = blocked_by(
                    i, tx * room, ty * room, x, y, now_x, now_y, apart, walls, blocked, width, height, cell, away,
                    near, many, normal,
                )  # fmt: skip
                if hit == 0:
                    free = True
                    break
                if attempt == 0:
                    met[i] = met[i] | hit
                    # y is down: (-y, x) is to the right of (x, y).
                    tx = -normal[1]
                    ty = normal[0]
                    ahead = tx * ux + ty * uy
                    if ahead < -1e-9:
                        tx = -tx
                        ty = -ty
                    elif ahead <= 1e-9:
                        tx = -uy
                        ty = ux
                else:
                    tx = -tx
                    ty = -ty
            if not free:
                continue
            dot = cosine[i] * tx + sine[i] * ty
            if dot < turn_cos:
                cross = cosine[i] * ty - sine[i] * tx
                turn = turn_sin if cross >= 0.0 else -turn_sin
                hx = cosine[i] * turn_cos - sine[i] * turn
                hy = cosine[i] * turn + sine[i] * turn_cos
                size = math.sqrt(hx * hx + hy * hy)
                cosine[i] = hx / size
                sine[i] = hy / size
                continue
            cosine[i] = tx
            sine[i] = ty
            now_x[i] = x[i] + tx * room
            now_y[i] = y[i] + ty * room
            left[i] -= room
            motions += 1
        for i in range(n):
            x[i] = now_x[i]
            y[i] = now_y[i]
            path_x[step * n + i] = x[i]
            path_y[step * n + i] = y[i]
    return motions
