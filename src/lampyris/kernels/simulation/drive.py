"""A drive in continuous time, compiled: data, decision, motion and contacts, period by period.

The rules are those of :mod:`lampyris.sim.continuous.drive` for a robot that follows its path exactly and receives the true
positions of discs, number for number; tests hold the two equal. All state is in the arguments, so that a caller can stop
after any period, look at it, change it and go on. Where Python has something to do, :func:`advance` returns.
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel, stopped
from lampyris.kernels.motion.curve_motion import ceiling_push
from lampyris.kernels.motion.passive_safety import highest_push
from lampyris.kernels.simulation.drive_obstacles import (
    A_MAX,
    ANCHOR,
    AT_GOAL,
    AT_X,
    AT_Y,
    BEFORE,
    CAUSE,
    CLOCK,
    D_MAX,
    DRAWN_UNTIL,
    END,
    FAR,
    FROM,
    GIVE_UP,
    GOAL_X,
    GOAL_Y,
    HALTS,
    HEARD_X,
    HEARD_Y,
    INDEX,
    KNOWN,
    LAST_A,
    LAST_CAUSE,
    LAST_INDEX,
    LAST_V,
    LAST_X,
    LAST_Y,
    LAW,
    LEG_ROOM,
    LEGS,
    LOG_ROOM,
    LOGGED,
    MARGIN,
    NEAREST,
    NODE,
    NOW,
    NOWHERE,
    OBSTACLES,
    OF,
    PARKED,
    PATIENCE,
    PERIOD,
    PERIODS,
    PHASE,
    PUSH,
    QUICK,
    RADIUS,
    REACH,
    REPORTED,
    RESOLUTION,
    REST,
    ROBOT_X,
    ROBOT_Y,
    ROUNDING,
    SEEN_X,
    SEEN_Y,
    SEES,
    SEG_A,
    SEG_S,
    SEG_V,
    SEGMENTS,
    SINCE,
    SLACK,
    SPEED_X,
    SPEED_Y,
    STAMP,
    STEP,
    STOOD,
    STOP_AT,
    TICK,
    TIGHT,
    TIME_LIMIT,
    TO,
    TOP,
    TRAFFIC,
    TRIES,
    V_MAX,
    VX,
    VY,
    WAITED,
    WALKING,
    WALKS,
    WENT,
    WENT_ROOM,
    WIDE,
    YIELDS,
    S,
    T,
    V,
    X,
    Y,
    _after,
    _begin_tick,
    _route_at,
    _walk,
)  # fmt: skip

PAUSED, DECIDE, DECIDE_TICK, NEAR, CAME, FAULT = range(6)
"""What :func:`advance` returns: the period STOP_AT is over, or there is no room or no draw for
the next; the law has to decide; the traffic has to begin
a tick; an obstacle may touch the robot in this period, which is not
written down yet; a period is over after which the drive may
end or the planner may be asked; the next message cannot be trusted."""
LISTEN, DECIDED, MOVING, TICK_BEGUN = range(4)
"""Values of PHASE."""
OUTSIDE, CEILING, SAFE = range(3)
"""Values of LAW: decided by the caller, as fast as the ceiling allows, and such that the robot can stand before any contact."""
OF_ACCELERATION, OF_LIMIT, OF_BRAKING, OF_TURN, OF_MOVING_OBSTACLE, OF_OBSTACLE, OF_WAIT = range(7)
"""Causes that rules look at; others follow in the caller's list."""


@kernel(out=("st",))
def _trusted(st, fs, each, t, x, y):
    """Whether nothing is wrong with the positions of the obstacles now."""
    m = st[OBSTACLES]
    res = fs[RESOLUTION]
    if st[KNOWN]:
        if t <= fs[STAMP]:
            return False
        for one in range(m):
            wx = (each[SEEN_X * m + one] - each[LAST_X * m + one]) * res
            wy = (each[SEEN_Y * m + one] - each[LAST_Y * m + one]) * res
            may = each[QUICK * m + one] * ((t - fs[STAMP]) * (1.0 + 1e-9)) + 1e-9
            if wx * wx + wy * wy > may * may:
                return False
    if fs[V] > 0.0:
        for one in range(m):
            dx = (each[SEEN_X * m + one] - x) * res
            dy = (each[SEEN_Y * m + one] - y) * res
            reach = each[WIDE * m + one] + fs[TIGHT]
            if dx * dx + dy * dy < reach * reach:
                return False
    return True


@kernel(out=("st", "fs", "each"))
def _take_in(st, fs, each, t):
    """Take in where the obstacles are, and since when each has been there."""
    m = st[OBSTACLES]
    for one in range(m):
        x = each[SEEN_X * m + one]
        y = each[SEEN_Y * m + one]
        wx = (x - each[LAST_X * m + one]) * fs[RESOLUTION]
        wy = (y - each[LAST_Y * m + one]) * fs[RESOLUTION]
        if st[KNOWN] == 0 or wx * wx + wy * wy > 1e-9 * 1e-9:
            each[SINCE * m + one] = t
        each[LAST_X * m + one] = x
        each[LAST_Y * m + one] = y
        each[HEARD_X * m + one] = each[SPEED_X * m + one]
        each[HEARD_Y * m + one] = each[SPEED_Y * m + one]
    st[KNOWN] = 1
    fs[STAMP] = t


@kernel(out=("st", "fs", "near"))
def _decide(st, fs, nodes, squares, above, rail_x, rail_y, cause_of, index_of, each, near, x, y, period):
    """The push of the next period, under the ceiling and, by the law SAFE, passively safe; False: an obstacle stands so near
    that the caller has to decide."""
    m = st[OBSTACLES]
    s = fs[S]
    v = fs[V]
    count = len(nodes)
    k = st[NODE]
    while k > 0 and nodes[k] > s:
        k -= 1
    while k + 1 < count and nodes[k + 1] <= s:
        k += 1
    st[NODE] = k
    push, node, rest = ceiling_push(nodes, squares, count, k, s, v, period, fs[A_MAX], fs[D_MAX])
    st[CAUSE] = OF_ACCELERATION
    st[INDEX] = -1
    st[REST] = rest
    if node >= 0:
        st[CAUSE] = cause_of[node]
        st[INDEX] = index_of[node]
    fs[PUSH] = push
    if st[LAW] != SAFE or m == 0:
        return True
    share = 1.25
    for _ in range(min(st[TRIES], 10)):
        share *= 0.8
    res = fs[RESOLUTION]
    extra = fs[RADIUS] + fs[SLACK] + fs[MARGIN]
    slope = 1.0 + fs[A_MAX] / fs[D_MAX]
    fairly = period + 0.6 * fs[V_MAX] / fs[D_MAX]
    look = 0.5 * v * v / fs[D_MAX] + fs[V_MAX] * period
    for one in range(m):
        ax = (each[SEEN_X * m + one] - x) * res
        ay = (each[SEEN_Y * m + one] - y) * res
        gap = math.sqrt(ax * ax + ay * ay) - (each[WIDE * m + one] + fs[RADIUS])
        if (
            fs[STAMP] - each[SINCE * m + one] >= fs[PARKED]
            and gap < look + share * each[QUICK * m + one] * fairly
        ):
            return False
        near[one] = near[m + one] = each[SEEN_X * m + one] * res
        near[2 * m + one] = near[3 * m + one] = each[SEEN_Y * m + one] * res
        reach = each[WIDE * m + one] + extra
        near[4 * m + one] = reach
        berth = share * period * slope * each[QUICK * m + one]
        near[5 * m + one] = reach + min(berth, gap - fs[MARGIN] - fs[SLACK])
        near[6 * m + one] = each[QUICK * m + one]
        near[7 * m + one] = 0.0
    a, who = highest_push(
        nodes, rail_x, rail_y, above, s, v, period, push, fs[D_MAX],
        near[: 2 * m], near[2 * m : 4 * m], near[4 * m : 6 * m], near[6 * m : 8 * m],
    )  # fmt: skip
    if who >= 0:
        fs[PUSH] = a
        st[CAUSE] = OF_MOVING_OBSTACLE
        st[INDEX] = who % m
        st[REST] = -1
    return True


@kernel(out=("st", "fs"))
def _at_goal(st, fs, path, s):
    """Whether a robot that stands there has arrived."""
    x, y = _route_at(st, fs, path, s)
    return st[NOWHERE] == 0 and max(abs(x - fs[GOAL_X]), abs(y - fs[GOAL_Y])) <= fs[AT_GOAL]


@kernel(out=("st", "fs", "seg"))
def _set_off(st, fs, path, nodes, seg):
    """The stretches of the period by the decision, cut where the robot comes to rest; how far away obstacles matter in it."""
    t = fs[T]
    s = fs[S]
    v = fs[V]
    a = fs[PUSH]
    end = fs[END]
    seg[0] = t
    seg[SEG_S] = s
    seg[SEG_V] = v
    seg[SEG_A] = a
    st[SEGMENTS] = 1
    if v == 0.0 and a <= 0.0:
        seg[SEG_V] = 0.0
        seg[SEG_A] = 0.0
        seg[1] = end
    else:
        rest = -v / a if a < 0.0 else math.inf
        seg[1] = end
        if st[REST] >= 0 or rest < end - t:
            seg[1] = min(t + rest, end)
            seg[2] = end
            seg[SEG_S + 1] = nodes[st[REST]] if st[REST] >= 0 else s - 0.5 * v * v / a
            seg[SEG_V + 1] = 0.0
            seg[SEG_A + 1] = 0.0
            st[SEGMENTS] = 2
            if _at_goal(st, fs, path, seg[SEG_S + 1]):
                seg[2] = seg[1]
    n = st[SEGMENTS]
    fast = 0.0
    for k in range(n):
        _, late = _after(seg, k, seg[k + 1])
        fast = max(fast, max(seg[SEG_V + k], late))
    # As in :meth:`lampyris.sim.traffic.continuous_traffic.RunningTraffic._begin_period`.
    quick = min(fast + fs[A_MAX] * fs[TICK], fs[V_MAX])
    seen = (quick * fs[TICK] + 0.5 * quick * quick / fs[D_MAX]) / fs[RESOLUTION] + 3.0
    step = min(end - t, fs[TICK])
    halts = (fs[TOP] + fast + fs[A_MAX] * step) * step / fs[RESOLUTION]
    last, _ = _after(seg, n - 1, seg[n])
    driven = (last - s) / fs[RESOLUTION] + fs[ROUNDING]
    fs[HALTS] = driven + halts
    fs[SEES] = driven + max(seen, halts)
    fs[ROBOT_X], fs[ROBOT_Y] = _route_at(st, fs, path, s)
    fs[NEAREST] = -math.inf


@kernel()
def _in_reach(st, fs, seg, each, legs):
    """Whether an obstacle may come to touch the robot in this period, wherever on its way it is."""
    m = st[OBSTACLES]
    room = st[LEG_ROOM]
    n = st[SEGMENTS]
    last, _ = _after(seg, n - 1, seg[n])
    driven = (last - seg[SEG_S]) / fs[RESOLUTION] + fs[ROUNDING]
    for k in range(st[LEGS]):
        one = int(legs[OF * room + k])
        seconds = legs[TO * room + k] - legs[FROM * room + k]
        reach = (each[WIDE * m + one] + fs[RADIUS]) / fs[RESOLUTION] + driven
        if abs(legs[X * room + k] - fs[ROBOT_X]) <= reach + abs(legs[VX * room + k]) * seconds:
            if abs(legs[Y * room + k] - fs[ROBOT_Y]) <= reach + abs(legs[VY * room + k]) * seconds:
                return True
    return False


@kernel(out=("st", "fs", "log", "reasons"))
def _write_down(st, fs, seg, log, reasons):
    """Log the period's stretches; a robot that goes on standing for the same reason is logged once."""
    room = st[LOG_ROOM]
    for k in range(st[SEGMENTS]):
        v = seg[SEG_V + k]
        a = seg[SEG_A + k]
        still = v == 0.0 and a == 0.0
        cause = st[CAUSE]
        if still and cause <= OF_BRAKING:
            cause = OF_TURN
        if still and st[LAST_CAUSE] == cause and st[LAST_INDEX] == st[INDEX]:
            if fs[LAST_V] == 0.0 and fs[LAST_A] == 0.0:
                continue
        if seg[k + 1] > seg[k]:
            n = st[LOGGED]
            log[n] = seg[k]
            log[room + n] = seg[SEG_S + k]
            log[2 * room + n] = v
            log[3 * room + n] = a
            reasons[n] = cause
            reasons[room + n] = st[INDEX]
            st[LOGGED] += 1
            st[LAST_CAUSE] = cause
            st[LAST_INDEX] = st[INDEX]
            fs[LAST_V] = v
            fs[LAST_A] = a


@kernel(out=("fs", "each"))
def _arrive(st, fs, each, legs):
    """Put every obstacle where it is when the robot's period is over."""
    m = st[OBSTACLES]
    room = st[LEG_ROOM]
    for k in range(st[LEGS]):
        if legs[FROM * room + k] > fs[T]:
            continue
        one = int(legs[OF * room + k])
        d = min(fs[T], legs[TO * room + k]) - legs[FROM * room + k]
        each[SEEN_X * m + one] = legs[X * room + k] + legs[VX * room + k] * d
        each[SEEN_Y * m + one] = legs[Y * room + k] + legs[VY * room + k] * d
        each[SPEED_X * m + one] = legs[VX * room + k] * fs[RESOLUTION]
        each[SPEED_Y * m + one] = legs[VY * room + k] * fs[RESOLUTION]


@kernel()
def _nearest(st, fs, each, flags):
    """Distance along an axis from the nearest obstacle that yields to the robot, beyond both radii; any below HALTS will do."""
    m = st[OBSTACLES]
    least = math.inf
    for one in range(m):
        if flags[YIELDS * m + one]:
            dx = abs(each[AT_X * m + one] - fs[ROBOT_X])
            dy = abs(each[AT_Y * m + one] - fs[ROBOT_Y])
            least = min(least, max(dx, dy) - each[REACH * m + one])
            if least < fs[HALTS]:
                break
    return least


@kernel(
    out=(
        "st", "fs", "each", "flags", "near", "legs", "seg", "log", "reasons",
        "went", "taken", "left", "gone", "soon",
    ),
    each=4000,
    of="went",
    thorough=True,
)  # fmt: skip
def advance(
    st, fs, path, nodes, squares, above, rail_x, rail_y, cause_of, index_of,
    each, flags, near, legs, seg, log, reasons, went,
    taken, left, gone, draws, walkers, own, open_steps, soon, halt,
):  # fmt: skip
    """Drive on until Python has something to do, or the period STOP_AT is over.

    Parameters
    ----------
    st, fs : int64 (STATE,) and float64 (NUMBERS,).
    path : the curve's pieces: x, y, heading (2), where they begin, curvature; PIECES + 1 of each.
    nodes, squares, above : distance and squared speed of the ceiling at each node; a ceiling above all speeds.
    rail_x, rail_y : of the nodes, metres.
    cause_of, index_of : what limits the ceiling at each node: number of the cause, and what it is about.
    each, flags : float64 (EACH * m,) and int64 (FLAGS * m,): the obstacles, row by row.
    near : float64 (8 * m,). Work space, as ``seg`` (9,).
    legs : float64 (7 * LEG_ROOM,), out: how the obstacles move in this period, column by column.
    log, reasons : out: t, s, v, a and cause, index of stretches, column by column.
    went : out: obstacle, t, x, y of the ends of straight motions.
    taken, left, gone : by cell number the obstacle there, that left in this tick, + 1; the cells in ``left``.
    draws, walkers, own, open_steps : random walkers, see :func:`lampyris.kernels.simulation.ticks.advance`.
    soon : work space: points ahead.
    """
    while True:
        if st[PHASE] == LISTEN:
            full = st[LOGGED] + 2 > st[LOG_ROOM] or st[WENT] + 2 * st[OBSTACLES] * st[WALKS] > st[WENT_ROOM]
            full = full or (st[WALKING] and st[NOW] + st[WALKS] > st[DRAWN_UNTIL])
            if st[PERIODS] >= st[STOP_AT] or full or stopped(halt):
                return PAUSED
            t = fs[T]
            x, y = _route_at(st, fs, path, fs[S])
            if not _trusted(st, fs, each, t, x, y):
                return FAULT
            _take_in(st, fs, each, t)
            st[PERIODS] += 1
            fs[END] = st[PERIODS] * fs[PERIOD]
            st[PHASE] = DECIDED
            st[LEGS] = 0
            fs[CLOCK] = t
            if st[NOWHERE] or fs[STOOD] >= fs[PATIENCE]:
                fs[PUSH] = -fs[D_MAX]
                st[CAUSE] = OF_WAIT
                st[INDEX] = -1
                st[REST] = -1
            elif st[LAW] == OUTSIDE or not _decide(
                st,
                fs,
                nodes,
                squares,
                above,
                rail_x,
                rail_y,
                cause_of,
                index_of,
                each,
                near,
                x,
                y,
                fs[END] - t,
            ):
                return DECIDE
        if st[PHASE] == DECIDED:
            _set_off(st, fs, path, nodes, seg)
            st[PHASE] = MOVING
        while st[TRAFFIC] and fs[CLOCK] < fs[END]:
            t = fs[CLOCK]
            if st[PHASE] == MOVING:
                if fs[NEAREST] < fs[SEES]:
                    fs[NEAREST] = _nearest(st, fs, each, flags)
                if st[NOW] * fs[TICK] <= t:
                    if st[WALKING] == 0:
                        return DECIDE_TICK
                    _begin_tick(
                        st, fs, path, seg, each, flags, taken, left, gone,
                        draws, walkers, own, open_steps, soon, st[NOW] * fs[TICK],
                    )  # fmt: skip
            st[PHASE] = MOVING
            until = min(st[NOW] * fs[TICK], fs[END])
            if until > t and st[OBSTACLES] > 0:
                _walk(
                    st, fs, path, seg, each, flags, legs, went, t, until,
                )  # fmt: skip
            fs[CLOCK] = until
            fs[NEAREST] -= 1.0 + 1e-9
        if _in_reach(st, fs, seg, each, legs):
            return NEAR
        _write_down(st, fs, seg, log, reasons)
        n = st[SEGMENTS]
        fs[BEFORE] = fs[T]
        fs[T] = seg[n]
        fs[S], fs[V] = _after(seg, n - 1, seg[n])
        _arrive(st, fs, each, legs)
        st[PHASE] = LISTEN
        if fs[T] >= fs[TIME_LIMIT]:
            return CAME
        if fs[V] == 0.0 and _at_goal(st, fs, path, fs[S]):
            return CAME
        # As in :class:`lampyris.sim.world.waiting.Waiting`.
        if fs[S] - fs[ANCHOR] > fs[STEP]:
            fs[ANCHOR] = fs[S]
            fs[STOOD] = 0.0
            fs[WAITED] = 0.0
            st[REPORTED] = 0
        if fs[S] > fs[FAR]:
            st[TRIES] = 0
        if OF_MOVING_OBSTACLE <= st[CAUSE] <= OF_WAIT:
            stood = fs[STOOD] + (fs[T] - fs[BEFORE])
            waited = fs[WAITED] + (fs[T] - fs[BEFORE])
            late = st[REPORTED] == 0 or waited > fs[GIVE_UP] or stood >= fs[PATIENCE] - 1e-9
            if fs[V] == 0.0 and late:
                return CAME
            fs[STOOD] = stood
            fs[WAITED] = waited
