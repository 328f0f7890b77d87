"""The cheapest simple curve from a pose to the goal, as if there were no walls."""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._jit import kernel, u64
from lampyris.kernels.curves.angles import PI, atan2, sine_cosine, wrapped
from lampyris.kernels.curves.dubins import dubins
from lampyris.kernels.curves.reeds_shepp import reeds_shepp
from lampyris.kernels.curves.sampling import moved
from lampyris.kernels.hybrid.collision import piece_free

DUBINS, REEDS_SHEPP = 0, 1
CAR, IN_PLACE, SIDEWAYS = 0, 1, 2
SEGMENTS = 5


@kernel(out=("segments",), inline=True)
def _turn_drive_turn(distance, bearing, yaw, goal_yaw, reverse, turn_cost, best, segments):
    """A turn in place, a straight line, a turn in place, ahead or in reverse, if it costs less than ``best``."""
    for gear in (1.0, -1.0):
        if gear < 0.0 and reverse == 0.0:
            break
        travel = bearing if gear > 0.0 else bearing + PI
        first = wrapped(travel - yaw)
        last = wrapped(goal_yaw - travel)
        if distance == 0.0:
            first = wrapped(goal_yaw - yaw)
            last = 0.0
        cost = distance * (1.0 if gear > 0.0 else reverse) + turn_cost * (abs(first) + abs(last))
        if cost < best:
            best = cost
            for k in range(15):
                segments[u64(k)] = 0.0
            segments[u64(1)] = first
            segments[u64(3)] = gear * distance
            segments[u64(7)] = last
    return best


@kernel(out=("segments", "lengths", "kinds"))
def goal_curve(
    x, y, yaw, goal, any_yaw, radius, family, drive, reverse, switch, turn_cost, segments, lengths, kinds
):
    """Write the segments of the cheapest curve from a pose to the goal; returns its cost.

    Parameters
    ----------
    x, y, yaw : the pose.
    goal : float64 (3,): x, y, yaw.
    any_yaw : whether the yaw at the goal is free; then it is that of the straight line to it.
    radius : of arcs, in cells.
    family : :data:`DUBINS` or :data:`REEDS_SHEPP`.
    drive : :data:`CAR`, :data:`IN_PLACE` (turns in place) or :data:`SIDEWAYS` (and moves in any direction).
    reverse : cost of a cell's length in reverse; 0: it must not be driven in reverse.
    switch, turn_cost : cost of a change of gear, and of a radian turned in place.
    segments : float64 (15,): length, turn and lateral of each segment.
    lengths, kinds : float64 (5,), int64 (5,): room.
    """
    dx = goal[u64(0)] - x
    dy = goal[u64(1)] - y
    distance = sqrt(dx * dx + dy * dy)
    bearing = atan2(dy, dx)
    goal_yaw = goal[u64(2)]
    if any_yaw:
        goal_yaw = bearing if drive != SIDEWAYS and distance > 0.0 else yaw
    if drive == SIDEWAYS:
        for k in range(15):
            segments[u64(k)] = 0.0
        turn = wrapped(goal_yaw - yaw)
        segments[u64(0)] = distance
        segments[u64(2)] = wrapped(bearing - yaw)
        segments[u64(4)] = turn
        return distance + turn_cost * abs(turn)
    s, c = sine_cosine(yaw)
    to_x = (c * dx + s * dy) / radius
    to_y = (c * dy - s * dx) / radius
    if family == REEDS_SHEPP:
        cost = radius * reeds_shepp(to_x, to_y, goal_yaw - yaw, reverse, switch / radius, lengths, kinds)
    else:
        cost = radius * dubins(to_x, to_y, goal_yaw - yaw, lengths, kinds)
    for k in range(5):
        segments[u64(3 * k)] = radius * lengths[u64(k)]
        segments[u64(3 * k + 1)] = lengths[u64(k)] * kinds[u64(k)]
        segments[u64(3 * k + 2)] = 0.0
    if drive == IN_PLACE:
        cost = _turn_drive_turn(distance, bearing, yaw, goal_yaw, reverse, turn_cost, cost, segments)
    return cost


@kernel(inline=True)
def first_gear(segments, drive):
    """The gear that the first segment with a length is driven in; 0: none has one."""
    for k in range(5):
        length = segments[u64(3 * k)]
        if length != 0.0:
            return 1 if length > 0.0 or drive == SIDEWAYS else -1
    return 0


@kernel()
def curve_free(wall, clear, stride, rows, border, px, py, cover, inner, outer, x, y, yaw, segments):
    """Whether the footprint touches no wall along all segments, from a pose where it touches none."""
    for k in range(5):
        length = segments[u64(3 * k)]
        turn = segments[u64(3 * k + 1)]
        lateral = segments[u64(3 * k + 2)]
        if length == 0.0 and turn == 0.0:
            continue
        if not piece_free(
            wall, clear, stride, rows, border, px, py, cover, inner, outer, x, y, yaw, length, turn, lateral
        ):
            return False
        x, y, yaw = moved(x, y, yaw, length, turn, lateral)
    return True
