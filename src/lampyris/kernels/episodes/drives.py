"""One action of many episodes in continuous time."""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel
from lampyris.kernels.curves.angles import sine_cosine
from lampyris.kernels.episodes.cells import LCG, LCG_MODULUS, draw_task

_PIECE = 0.25
"""Cells between two places at which a robot that moves is held against the walls."""


@kernel(inline=True)
def disc_hits(x, y, reach, room, wall, width):
    """Whether a disc touches a blocked cell, or its centre is off the map; all in cells.

    ``room`` is the distance from the centre of each cell to the nearest wall, -1 beyond the edge of the map;
    ``wall`` is 1 in blocked cells of the map itself, not beyond its edge.
    """
    column = int(x + 0.5)
    row = int(y + 0.5)
    free = room[row * width + column]
    if free < 0.0:
        return True
    dx = x - column
    dy = y - row
    if free - sqrt(dx * dx + dy * dy) > reach:
        return False
    far = int(reach + 1.0)
    last = len(wall) // width - 1
    for r in range(max(row - far, 0), min(row + far, last) + 1):
        for c in range(max(column - far, 0), min(column + far, width - 1) + 1):
            if wall[r * width + c] != 0:
                dx = max(abs(x - c) - 0.5, 0.0)
                dy = max(abs(y - r) - 0.5, 0.0)
                if dx * dx + dy * dy <= reach * reach:
                    return True
    return False


@kernel(inline=True)
def potential(x, y, field, to_go, width, otherwise):
    """Cells to the goal from a point: through the centre of its cell or of a neighbour, whichever is the shortest."""
    column = int(x + 0.5)
    row = int(y + 0.5)
    best = -1.0
    for r in range(row - 1, row + 2):
        for c in range(column - 1, column + 2):
            left = to_go[field + r * width + c]
            if left >= 0.0:
                dx = x - c
                dy = y - r
                whole = left + sqrt(dx * dx + dy * dy)
                if best < 0.0 or whole < best:
                    best = whole
    return best if best >= 0.0 else otherwise


@kernel(inline=True)
def observe_drive(i, x, y, sine, cosine, goal, speed, shut, width, patch, seen):
    """Write what episode i observes, in the frame of the robot: patch, direction to the goal (ahead, left), distance, speed."""
    half = patch // 2
    k = i * (patch * patch + 4)
    for a in range(half, half - patch, -1):
        # Half a cell more, so that cutting the fraction off rounds; the border keeps all indices above 0.
        ahead_x = x + a * cosine + 0.5
        ahead_y = y - a * sine + 0.5
        for b in range(half, half - patch, -1):
            seen[k] = shut[int(ahead_y - b * cosine) * width + int(ahead_x - b * sine)]
            k += 1
    right = goal % width - x
    up = y - goal // width
    distance = sqrt(right * right + up * up)
    seen[k] = 0.0
    seen[k + 1] = 0.0
    if distance > 0.0:
        seen[k] = (right * cosine + up * sine) / distance
        seen[k + 1] = (up * cosine - right * sine) / distance
    seen[k + 2] = distance / (distance + 10.0)
    seen[k + 3] = speed


@kernel(
    out=(
        "x", "y", "yaw", "speed", "target", "steps", "left", "driven", "ended", "generator", "seen", "reward",
        "terminated", "truncated", "hit",
    ),
    each=60_000,
    of="begin",
)  # fmt: skip
def step_drives(
    begin, throttle, turn, shut, wall, room, to_go, starts, first, goals, width, patch, radius, v_max, a_max,
    d_max, yaw_rate, resolution, period, tolerance, collision, start_yaw, shaped, discount, limit, x, y, yaw,
    speed, target, steps, left, driven, ended, generator, seen, reward, terminated, truncated, hit,
):  # fmt: skip
    """One action of each episode; one that has ended begins again instead. Returns how many steps were made.

    Parameters
    ----------
    begin : int64 (n,): -1: begin an episode.
    throttle, turn : float64 (n,), -1 to 1: shares of the greatest acceleration (braking if negative) and yaw rate.
    shut : float32 (size,): 1 where the robot's centre may not be, as a cell. The map has a border of such cells, wide enough
        for the patch at any heading.
    wall : uint8 (size,): 1 in blocked cells of the map.
    room : float32 (size,): see :func:`disc_hits`.
    to_go : float64 (goals * size,): cells to each goal, -1: none.
    starts, first, goals, width, patch : as for :func:`lampyris.kernels.episodes.cells.step_cells`.
    radius : of the robot, cells.
    v_max, a_max, d_max, yaw_rate : m/s, m/s2, m/s2, rad/s.
    resolution : metres a cell.
    period : seconds of a step.
    tolerance : cells from the goal within which the robot has arrived.
    collision : seconds that a collision costs, besides those to go.
    start_yaw : radians; beyond 4: drawn for each episode.
    shaped, discount, limit : as for ``step_cells``.
    x, y : in and out, float64 (n,): the centre, cells of the bordered map, y down.
    yaw : in and out, float64 (n,): radians counterclockwise from the x axis of the map, y up.
    speed : in and out, float64 (n,): m/s.
    target, steps, ended, generator : as for ``step_cells``.
    left : in and out, float64 (n,): seconds to go at v_max, by the field.
    driven : in and out, float64 (n,): metres.
    seen, reward, terminated, truncated : as for ``step_cells``.
    hit : out, bool (n,): whether the robot touched a wall.
    """
    size = len(shut)
    made = 0
    pace = resolution / v_max
    for i in range(len(begin)):
        terminated[i] = False
        truncated[i] = False
        hit[i] = False
        reward[i] = 0.0
        if begin[i] < 0 or ended[i] != 0:
            place = starts[draw_task(i, generator, target, first)]
            x[i] = place % width
            y[i] = place // width
            generator[i] = LCG * generator[i] % LCG_MODULUS
            yaw[i] = start_yaw
            if start_yaw > 4.0:
                yaw[i] = (2.0 * generator[i] / LCG_MODULUS - 1.0) * 3.141592653589793
            speed[i] = 0.0
            steps[i] = 0
            driven[i] = 0.0
            ended[i] = 0
            left[i] = pace * potential(x[i], y[i], target[i] * size, to_go, width, 0.0)
            sine, cosine = sine_cosine(yaw[i])
        else:
            made += 1
            push = min(max(throttle[i], -1.0), 1.0)
            before = speed[i]
            after = before + period * push * (a_max if push >= 0.0 else d_max)
            after = min(max(after, 0.0), v_max)
            rate = yaw_rate * min(max(turn[i], -1.0), 1.0)
            sine, cosine = sine_cosine(yaw[i] + 0.5 * period * rate)
            metres = 0.5 * (before + after) * period
            length = metres / resolution
            pieces = int(length / _PIECE) + 1
            piece = length / pieces
            touched = False
            if length > 0.0:
                for k in range(1, pieces + 1):
                    there_x = x[i] + k * piece * cosine
                    there_y = y[i] - k * piece * sine
                    if disc_hits(there_x, there_y, radius + 0.5 * piece, room, wall, width):
                        touched = True
                        break
            yaw[i] += period * rate
            if yaw[i] > 3.141592653589793:
                yaw[i] -= 6.283185307179586
            elif yaw[i] < -3.141592653589793:
                yaw[i] += 6.283185307179586
            steps[i] += 1
            speed[i] = after
            if touched:
                speed[i] = 0.0
                hit[i] = True
                terminated[i] = True
                ended[i] = 1
                reward[i] = -period - collision - (0.0 if shaped != 0 else left[i])
            else:
                x[i] += length * cosine
                y[i] -= length * sine
                driven[i] += metres
                goal = goals[target[i]]
                dx = x[i] - goal % width
                dy = y[i] - goal // width
                old = left[i]
                left[i] = pace * potential(x[i], y[i], target[i] * size, to_go, width, old / pace)
                if dx * dx + dy * dy <= tolerance * tolerance:
                    left[i] = 0.0
                    terminated[i] = True
                    ended[i] = 1
                elif steps[i] >= limit:
                    truncated[i] = True
                    ended[i] = 1
                reward[i] = -period
                if shaped != 0:
                    reward[i] += old - discount * left[i]
            sine, cosine = sine_cosine(yaw[i])
        observe_drive(
            i, x[i], y[i], sine, cosine, goals[target[i]], speed[i] / v_max, shut, width, patch, seen
        )
    return made
