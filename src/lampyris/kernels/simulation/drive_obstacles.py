"""The obstacles of a drive, compiled: steps of random walkers tick by tick, straight motion, halts near the robot.

The rules are those of :mod:`lampyris.sim.traffic.continuous_traffic` and :mod:`lampyris.sim.traffic.separation`, number for
number. Positions are in cells, lengths along the path in metres, times in seconds. ``st`` and ``fs`` hold the state of the
drive; their places are defined here.
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel
from lampyris.kernels.motion.curve_motion import chord
from lampyris.kernels.simulation.obstacle_rules import crosses

(
    PERIODS, STOP_AT, PHASE, OBSTACLES, PIECES, PIECE, NODE, NOW, NOWHERE, LAW, TRIES, REPORTED, CAUSE, INDEX, REST,
    SEGMENTS, TRAFFIC, WALKING, LOGGED, LOG_ROOM, LEGS, LEG_ROOM, WENT, WENT_ROOM, WALKS, LATE_ONES, STOPPED_ONES, KNOWN,
    LAST_CAUSE, LAST_INDEX, LEFT, STRIDE, WALKERS, PER_TICK, DRAWN_FROM, DRAWN_UNTIL, SOON,
) = range(37)  # fmt: skip
"""Places in ``st``. Periods over, and to stop at; which part of a period is next; obstacles; pieces of the curve, and the
piece and the node found last; ticks begun; whether the path has no length; the law; of :class:`Waiting` tries and reported;
the decision's cause, index and node to rest at. Stretches of the period; whether there is traffic, and whether its ticks are
decided here; rows of ``log``, ``legs`` and ``went``, room for them, and parts that the traffic may divide a period into;
obstacles that are late and that are halted; whether a message has been received; cause and index of the last row of the log, -1
before the first of a path; of the walkers' world the cells left, the map's stride, specifications, draws a tick, ticks of the
first row of draws and after the last; points that the robot may soon be at."""
STATE = 37

(
    T, S, V, PERIOD, END, BEFORE, PUSH, TICK, TOP, RESOLUTION, RADIUS, SLACK, LENGTH, END_X, END_Y, GOAL_X, GOAL_Y, AT_GOAL,
    A_MAX, D_MAX, V_MAX, PATIENCE, GIVE_UP, TIME_LIMIT, STOOD, WAITED, ANCHOR, STEP, FAR, NEAREST, HALTS, SEES, ROBOT_X,
    ROBOT_Y, STAMP, CLOCK, APART, SIDE, LAST_V, LAST_A, MARGIN, PARKED, ROUNDING, TIGHT,
) = range(44)  # fmt: skip
"""Places in ``fs``. Time, distance and speed of the robot; length of a period, its end, the time before it; the decision;
seconds a tick, the obstacles' top speed; metres a cell; the robot's radius, what the curve leaves its nodes by, length and end
of the curve, the goal and how near is there, limits; of the waiting: patience, limits, and the numbers of :class:`Waiting`;
of the traffic's period: see :class:`RunningTraffic`; stamp of the last message; where within the period the obstacles are;
distance of the points ahead; side of a bucket; speed and push of the last row of the log; constants of the rules."""
NUMBERS = 44

(
    AT_X, AT_Y, GO_X, GO_Y, TO_X, TO_Y, SEEN_X, SEEN_Y, SPEED_X, SPEED_Y, LAST_X, LAST_Y, SINCE, WIDE, QUICK, REACH, DISC,
    MEANT_X, MEANT_Y, HEARD_X, HEARD_Y,
) = range(21)  # fmt: skip
"""Rows of ``each``, one number an obstacle: where it is, its velocity (cells/s), where the tick leads; where it was when the
period ended, and its velocity (m/s); the message before, since when it stands; radius and top speed (metres), sum of both
radii, radius (cells); where it is at the end of a part of a period; its velocity when the
message before was sent."""
EACH = 21
YIELDS, FIXED, LATE, STOPPED, STOPPING, CELL, CAME, STEP_X, STEP_Y, MARK, QUEUE = range(11)
"""Rows of ``flags``: whether it yields, is recorded, is late, was and is halted; its cell, the one before, its last step; lists
of obstacles. QUEUE has two rows."""
FLAGS = 13
OF, FROM, TO, X, Y, VX, VY = range(7)
"""Columns of ``legs``."""
WALKER_TABLE, WALKER_FIRST, WALKER_COUNT, WALKER_DRAW = range(4)
"""Places in ``walkers``, WALKER a specification."""
WALKER = 4
SEG_S, SEG_V, SEG_A = 3, 5, 7
"""Where in ``seg`` distances, speeds and pushes of the period's stretches begin, after their times: two stretches at most."""
DIAGONAL = math.sqrt(2.0)
"""The longest step, cells."""
SLACK_SHARE = 1e-10
"""As :data:`lampyris.sim.traffic.separation.SLACK`."""


@kernel(out=("st",))
def _route_at(st, fs, path, s):
    """Where a distance along the path lies, cells."""
    if s >= fs[LENGTH]:
        return fs[END_X], fs[END_Y]
    w = st[PIECES] + 1
    k = st[PIECE]
    while k > 0 and s < path[4 * w + k]:
        k -= 1
    while k + 2 < w and s >= path[4 * w + k + 1]:
        k += 1
    st[PIECE] = k
    # As kernels.motion.curve_motion.place.
    along = max(s, 0.0) - path[4 * w + k]
    bend = path[5 * w + k]
    x = path[k]
    y = path[w + k]
    hx = path[2 * w + k]
    hy = path[3 * w + k]
    if bend == 0.0:
        return x + along * hx / fs[RESOLUTION], y + along * hy / fs[RESOLUTION]
    ratio, sine, cosine = chord(0.5 * bend * along)
    far = along * ratio / fs[RESOLUTION]
    return x + far * (hx * cosine - hy * sine), y + far * (hx * sine + hy * cosine)


@kernel()
def _after(seg, k, t):
    """Distance and speed at a time of stretch ``k``."""
    d = t - seg[k]
    v = seg[SEG_V + k] + seg[SEG_A + k] * d
    if v < 0.0:
        v = 0.0
    return seg[SEG_S + k] + d * (seg[SEG_V + k] + 0.5 * seg[SEG_A + k] * d), v


@kernel()
def _motion_at(seg, count, t):
    """Distance and speed at a time; the ends answer for times outside."""
    for k in range(count):
        if t < seg[k + 1]:
            return _after(seg, k, max(t, seg[k]))
    return _after(seg, count - 1, seg[count])


@kernel()
def _keeps_apart(each, m, one, x, y, other):
    """Whether an obstacle that moves to (x, y) keeps clear of another one's motion to its MEANT place."""
    px = each[AT_X * m + one] - each[AT_X * m + other]
    py = each[AT_Y * m + one] - each[AT_Y * m + other]
    dx = x - each[MEANT_X * m + other] - px
    dy = y - each[MEANT_Y * m + other] - py
    along = -(px * dx + py * dy)
    if along <= 0.0:
        return True
    length = dx * dx + dy * dy
    share = along / length if along < length else 1.0
    ex = px + share * dx
    ey = py + share * dy
    far = each[DISC * m + one] + each[DISC * m + other]
    return ex * ex + ey * ey >= far * far * (1.0 - SLACK_SHARE)


@kernel(out=("flags",))
def _list_near(each, flags, m, one):
    """List in MARK the obstacles that a step of this one might come too near to; how many."""
    count = 0
    x = each[AT_X * m + one]
    y = each[AT_Y * m + one]
    reach = each[DISC * m + one] + 2.0 * DIAGONAL
    for k in range(m):
        far = reach + each[DISC * m + k]
        near = abs(each[AT_X * m + k] - x) < far and abs(each[AT_Y * m + k] - y) < far
        if near and k != one and flags[FIXED * m + k] == 0:
            flags[MARK * m + count] = k
            count += 1
    return count


@kernel()
def _may_go(each, flags, m, one, x, y, count):
    """Whether an obstacle may move to (x, y), as far as the motions of the ``count`` in MARK go."""
    for n in range(count):
        if not _keeps_apart(each, m, one, x, y, flags[MARK * m + n]):
            return False
    return True


@kernel(out=("each", "flags"))
def _settle(fs, each, flags, m):
    """Halt those that would meet an obstacle that is late or halts: STOPPING grows."""
    queued = 0
    for one in range(m):
        if flags[LATE * m + one] or flags[STOPPING * m + one]:
            flags[QUEUE * m + queued] = one
            queued += 1
    while queued > 0:
        queued -= 1
        one = flags[QUEUE * m + queued]
        count = _list_near(each, flags, m, one)
        # In order of buckets, column by column: who halts first may decide who else has to.
        for n in range(1, count):
            k = flags[MARK * m + n]
            u = math.floor(each[AT_X * m + k] / fs[SIDE])
            w = math.floor(each[AT_Y * m + k] / fs[SIDE])
            i = n
            while i > 0:
                before = flags[MARK * m + i - 1]
                bu = math.floor(each[AT_X * m + before] / fs[SIDE])
                if bu < u or (bu == u and math.floor(each[AT_Y * m + before] / fs[SIDE]) <= w):
                    break
                flags[MARK * m + i] = before
                i -= 1
            flags[MARK * m + i] = k
        for n in range(count):
            other = flags[MARK * m + n]
            x = each[MEANT_X * m + one]
            y = each[MEANT_Y * m + one]
            if _keeps_apart(each, m, one, x, y, other):
                continue
            who = one
            if x == each[AT_X * m + one] and y == each[AT_Y * m + one]:
                who = other
            each[MEANT_X * m + who] = each[AT_X * m + who]
            each[MEANT_Y * m + who] = each[AT_Y * m + who]
            flags[STOPPING * m + who] = 1
            flags[QUEUE * m + queued] = who
            queued += 1


@kernel(out=("st", "went"))
def _went_to(st, went, one, t, x, y):
    """Write down that an obstacle was at (x, y) at a time."""
    k = 4 * st[WENT]
    went[k] = one
    went[k + 1] = t
    went[k + 2] = x
    went[k + 3] = y
    st[WENT] += 1


@kernel(out=("st", "each", "flags", "legs", "went"))
def _walk(
    st, fs, path, seg, each, flags, legs, went, t, end,
):  # fmt: skip
    """Every obstacle moves on from ``t`` to ``end``, which is no later than the tick's end."""
    m = st[OBSTACLES]
    stopping = 0
    for one in range(m):
        flags[STOPPING * m + one] = 0
    if fs[NEAREST] < fs[HALTS]:
        s0, v0 = _motion_at(seg, st[SEGMENTS], t)
        s1, v1 = _motion_at(seg, st[SEGMENTS], end)
        x0, y0 = _route_at(st, fs, path, s0)
        x1, y1 = _route_at(st, fs, path, s1)
        both = fs[TOP] + max(v0, v1) + fs[A_MAX] * (end - t)
        for one in range(m):
            if flags[YIELDS * m + one] == 0:
                continue
            ax = x0 - each[AT_X * m + one]
            ay = y0 - each[AT_Y * m + one]
            near = each[REACH * m + one] + both * (end - t) / fs[RESOLUTION]
            if ax * ax + ay * ay < near * near:
                vx = each[GO_X * m + one]
                vy = each[GO_Y * m + one]
                later = (x1 - each[AT_X * m + one]) * vx + (y1 - each[AT_Y * m + one]) * vy
                if ax * vx + ay * vy > 0.0 or later > 0.0:
                    flags[STOPPING * m + one] = 1
                    stopping += 1
    if stopping > 0 or st[LATE_ONES] > 0:
        for one in range(m):
            x = each[AT_X * m + one]
            y = each[AT_Y * m + one]
            if flags[STOPPING * m + one] == 0:
                x = x + each[GO_X * m + one] * (end - t)
                y = y + each[GO_Y * m + one] * (end - t)
            each[MEANT_X * m + one] = x
            each[MEANT_Y * m + one] = y
        _settle(fs, each, flags, m)
        stopping = 0
        for one in range(m):
            stopping += flags[STOPPING * m + one]
    if stopping > 0 or st[STOPPED_ONES] > 0:
        for one in range(m):
            if flags[STOPPING * m + one] != flags[STOPPED * m + one]:
                _went_to(st, went, one, t, each[AT_X * m + one], each[AT_Y * m + one])
            flags[STOPPED * m + one] = flags[STOPPING * m + one]
            if flags[STOPPING * m + one] and flags[LATE * m + one] == 0:
                flags[LATE * m + one] = 1
                st[LATE_ONES] += 1
        st[STOPPED_ONES] = stopping
    room = st[LEG_ROOM]
    n = st[LEGS]
    for one in range(m):
        vx = each[GO_X * m + one]
        vy = each[GO_Y * m + one]
        if flags[STOPPING * m + one]:
            vx = 0.0
            vy = 0.0
        legs[OF * room + n] = one
        legs[FROM * room + n] = t
        legs[TO * room + n] = end
        legs[X * room + n] = each[AT_X * m + one]
        legs[Y * room + n] = each[AT_Y * m + one]
        legs[VX * room + n] = vx
        legs[VY * room + n] = vy
        each[AT_X * m + one] += vx * (end - t)
        each[AT_Y * m + one] += vy * (end - t)
        n += 1
    st[LEGS] = n
    if end >= st[NOW] * fs[TICK]:
        for one in range(m):
            if flags[LATE * m + one] == 0:
                each[AT_X * m + one] = each[TO_X * m + one]
                each[AT_Y * m + one] = each[TO_Y * m + one]
            _went_to(st, went, one, end, each[AT_X * m + one], each[AT_Y * m + one])


@kernel(out=("st", "fs", "soon"))
def _look_ahead(st, fs, path, seg, each, flags, soon, t):
    """The points that the robot soon comes to by its present speed; none if nobody near would yield."""
    st[SOON] = 0
    fs[APART] = 0.0
    if fs[NEAREST] >= fs[SEES]:
        return
    m = st[OBSTACLES]
    s, v = _motion_at(seg, st[SEGMENTS], t)
    quick = min(v + fs[A_MAX] * fs[TICK], fs[V_MAX])
    ahead = min(quick * fs[TICK] + 0.5 * quick * quick / fs[D_MAX], fs[LENGTH] - s)
    x, y = _route_at(st, fs, path, s)
    far = ahead / fs[RESOLUTION] + 3.0
    seen = False
    for one in range(m):
        d = max(abs(each[AT_X * m + one] - x), abs(each[AT_Y * m + one] - y)) - far
        if flags[YIELDS * m + one] and d < each[REACH * m + one]:
            seen = True
            break
    if not seen:
        return
    steps = max(math.ceil(ahead / (0.25 * fs[RESOLUTION])), 1)
    count = 1
    if ahead > 0.0:
        count = 1 + min(math.ceil(steps * v * fs[TICK] / ahead), steps)
    soon[0] = x
    soon[1] = y
    for k in range(1, count):
        x, y = _route_at(st, fs, path, s + ahead * k / steps)
        soon[2 * k] = x
        soon[2 * k + 1] = y
    st[SOON] = count
    fs[APART] = ahead / steps / fs[RESOLUTION]


@kernel()
def _meets(st, fs, soon, far, x, y, dx, dy):
    """Whether a step from a cell comes nearer than ``far`` to where the robot soon is; going away never does."""
    length = dx * dx + dy * dy
    squared = far * far
    for k in range(st[SOON]):
        ax = soon[2 * k] - x
        ay = soon[2 * k + 1] - y
        along = ax * dx + ay * dy
        if along <= 0.0:
            continue
        share = min(along / length, 1.0)
        ex = ax - share * dx
        ey = ay - share * dy
        if ex * ex + ey * ey < squared:
            return True
    return False


@kernel(out=("st", "each", "flags", "taken", "left", "gone"))
def _step_to(st, each, flags, taken, left, gone, one, to, dx, dy):
    """Move an obstacle to a cell, from the middle of which the tick leads on."""
    m = st[OBSTACLES]
    at = flags[CELL * m + one]
    taken[at] = 0
    left[at] = one + 1
    gone[st[LEFT]] = at
    st[LEFT] += 1
    taken[to] = one + 1
    flags[CELL * m + one] = to
    flags[STEP_X * m + one] = dx
    flags[STEP_Y * m + one] = dy
    each[MEANT_X * m + one] = to % st[STRIDE] - 1
    each[MEANT_Y * m + one] = to // st[STRIDE] - 1


@kernel(out=("st", "each", "flags", "taken", "left", "gone"))
def _bring_back(st, fs, each, flags, taken, left, gone, qx, qy):
    """Those that are late finish their step, or go back if that is towards a robot that is near: LATE 2 is to stay late."""
    m = st[OBSTACLES]
    stride = st[STRIDE]
    for one in range(m):
        if flags[LATE * m + one] == 0:
            continue
        number = flags[CELL * m + one]
        came = flags[CAME * m + one]
        x1 = float(number % stride - 1)
        y1 = float(number // stride - 1)
        ax = each[AT_X * m + one]
        ay = each[AT_Y * m + one]
        near = each[REACH * m + one] + 1.5
        met = (qx - ax) * (x1 - ax) + (qy - ay) * (y1 - ay) > 0.0
        met = met and (qx - ax) * (qx - ax) + (qy - ay) * (qy - ay) <= near * near
        met = met and flags[YIELDS * m + one] != 0
        count = _list_near(each, flags, m, one)
        on = _may_go(each, flags, m, one, x1, y1, count)
        may = False
        dx = came % stride - number % stride
        dy = came // stride - number // stride
        if (met or not on) and came != number and taken[came] == 0:
            steps_x = flags[STEP_X * m : STEP_X * m + m]
            steps_y = flags[STEP_Y * m : STEP_Y * m + m]
            may = dx == 0 or dy == 0 or not crosses(number, dx, dy, stride, left, steps_x, steps_y)
        if may:
            x0 = float(came % stride - 1)
            y0 = float(came // stride - 1)
            may = _may_go(each, flags, m, one, x0, y0, count)
        if not may:
            if on:
                each[MEANT_X * m + one] = x1
                each[MEANT_Y * m + one] = y1
            else:
                flags[LATE * m + one] = 2
            continue
        _step_to(st, each, flags, taken, left, gone, one, came, dx, dy)
        flags[CAME * m + one] = number


@kernel(out=("st", "fs", "each", "flags", "taken", "left", "gone", "soon"))
def _begin_tick(
    st, fs, path, seg, each, flags, taken, left, gone, draws, walkers, own,
    open_steps, soon, t,
):  # fmt: skip
    """A tick begins: who is late goes on or back, all random walkers choose a step."""
    m = st[OBSTACLES]
    stride = st[STRIDE]
    room = len(taken)
    st[NOW] += 1
    _look_ahead(st, fs, path, seg, each, flags, soon, t)
    for one in range(m):
        each[MEANT_X * m + one] = each[AT_X * m + one]
        each[MEANT_Y * m + one] = each[AT_Y * m + one]
    if st[LATE_ONES] > 0:
        s, _ = _motion_at(seg, st[SEGMENTS], t)
        qx, qy = _route_at(st, fs, path, s)
        _bring_back(st, fs, each, flags, taken, left, gone, qx, qy)
    for k in range(st[LEFT]):
        left[gone[k]] = 0
    st[LEFT] = 0
    for one in range(m):
        flags[STEP_X * m + one] = 0
        flags[STEP_Y * m + one] = 0
    row = (st[NOW] - st[DRAWN_FROM]) * st[PER_TICK]
    steps_x = flags[STEP_X * m : STEP_X * m + m]
    steps_y = flags[STEP_Y * m : STEP_Y * m + m]
    for w in range(st[WALKERS]):
        b = WALKER * w
        table = walkers[b + WALKER_TABLE] * room
        for n in range(walkers[b + WALKER_COUNT]):
            one = own[walkers[b + WALKER_FIRST] + n]
            if flags[LATE * m + one] != 0:
                continue
            at = flags[CELL * m + one]
            bits = open_steps[table + at]
            x = at % stride - 1
            y = at // stride - 1
            far = fs[RADIUS] / fs[RESOLUTION] + each[DISC * m + one] + 0.5 * fs[APART]
            near = _list_near(each, flags, m, one)
            may = 0
            options = 0
            for j in range(8):
                if (bits >> j) & 1 == 0:
                    continue
                i = j + (j > 3)
                dy = i // 3 - 1
                dx = i - 3 * dy - 4
                if taken[at + dy * stride + dx] != 0:
                    continue
                if dx != 0 and dy != 0 and crosses(at, dx, dy, stride, left, steps_x, steps_y):
                    continue
                if not _may_go(each, flags, m, one, float(x + dx), float(y + dy), near):
                    continue
                if st[SOON] > 0 and _meets(st, fs, soon, far, x, y, dx, dy):
                    continue
                may |= 1 << j
                options += 1
            pick = int(draws[row + walkers[b + WALKER_DRAW] + n] * (options + 1))
            if pick == 0:
                continue
            for j in range(8):
                if (may >> j) & 1:
                    pick -= 1
                    if pick == 0:
                        i = j + (j > 3)
                        dy = i // 3 - 1
                        dx = i - 3 * dy - 4
                        flags[CAME * m + one] = at
                        _step_to(st, each, flags, taken, left, gone, one, at + dy * stride + dx, dx, dy)
                        steps_x[one] = dx
                        steps_y[one] = dy
                        break
    st[LATE_ONES] = 0
    for one in range(m):
        late = int(flags[LATE * m + one] == 2)
        flags[LATE * m + one] = late
        st[LATE_ONES] += late
        each[TO_X * m + one] = each[MEANT_X * m + one]
        each[TO_Y * m + one] = each[MEANT_Y * m + one]
        each[GO_X * m + one] = (each[TO_X * m + one] - each[AT_X * m + one]) / fs[TICK]
        each[GO_Y * m + one] = (each[TO_Y * m + one] - each[AT_Y * m + one]) / fs[TICK]
