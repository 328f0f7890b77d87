"""Robots of a fleet that drive along their paths in the order of visits that their plan states, event by event.

W. Hoenig, S. Kiesel, A. Tinka, J. W. Durham, N. Ayanian, "Persistent and robust execution of MAPF schedules in warehouses",
IEEE RA-L 4(2), 2019; H. Ma, T. K. S. Kumar, S. Koenig, "Multi-agent path finding with delay probabilities", AAAI 2017.

A robot may drive to the vertex GRANTED of its path. The move from vertex k to k + 1 is granted when the robot that visits
that cell before it (PRED) has reached the vertex after its own visit (NEED). Motion has constant acceleration between
events: ends of a phase (accelerate, cruise, brake), vertices, delays, grants, and looks at obstacles. Moves of robots that
exchange their cells in a ring (GROUP) are driven by all of them at once.

Numbers of a robot, of a vertex and of a group stand in one row each; the constants below are the columns.
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel, stopped

ALONG, TURN, DELAY, PLACE, X, Y, VERTEX_REAL = 0, 1, 2, 3, 4, 5, 6
"""Of a vertex: metres along the path, seconds of turning there, seconds of a delay on the move that leaves it, metres along
the path where it happens, place in metres."""
NEXT_STOP, PRED, NEED, PRED_B, NEED_B, GROUP, VERTEX_WHOLE = 0, 1, 2, 3, 4, 5, 6
"""Of a vertex: the next vertex at which the robot has to stand; what the move that leaves it waits for, twice; its group."""
S, V, A, T0, END_S, END_V, HOLD, SINCE, V_MAX, A_MAX, D_MAX, RADIUS, WAITS = range(13)
CAUSES = 6
REAL = WAITS + CAUSES
MODE, AT, GRANTED, BRAKE, FIRED, TURNED, CAUSE, HEAD, NEXT, ON, PHASE, FROZEN, WHOLE = range(13)
RATE, SLOW, T_RISE, T_CRUISE, T_FALL, G_HOLD, GROUP_REAL = range(7)
"""Of a group: acceleration and braking in moves a square second, durations of the three phases, delay before it starts."""
REST, MOVE, RING, DEAD = 0, 1, 2, 3
NONE, ORDER, TURNING, DELAYED, OBSTACLE, REPLANNING = 0, 1, 2, 3, 4, 5
"""Causes of standing."""
ROW = 7
"""Columns of the log: robot, vertex behind it, beginning, duration, metres along its path, speed, acceleration."""
ENDED, LIMIT, FULL, STALLED = 0, 1, 2, 3
TINY = 1e-12
NEAR = 1e-9
"""Metres within which a phase ends at a vertex; seconds that are no progress in time."""
NEVER = 1e300


@kernel(out=("tree",))
def _due(tree, i, t):
    """Set when robot i has its next event."""
    k = len(tree) // 2 + i
    tree[k] = t
    k = k // 2
    while k >= 1:
        a = tree[2 * k]
        b = tree[2 * k + 1]
        tree[k] = a if a <= b else b
        k = k // 2


@kernel(out=("real", "whole", "tree"))
def _rest(real, whole, tree, i, t, cause, until):
    """Let robot i stand for a reason; the time before counts for the reason it had."""
    if whole[i * WHOLE + MODE] == REST:
        real[i * REAL + WAITS + whole[i * WHOLE + CAUSE]] += t - real[i * REAL + SINCE]
    whole[i * WHOLE + MODE] = REST
    whole[i * WHOLE + CAUSE] = cause
    real[i * REAL + SINCE] = t
    _due(tree, i, until)


@kernel()
def _missing(link, whole, row):
    """The robot that a move waits for, or -1."""
    p = link[row + PRED]
    if p >= 0 and whole[p * WHOLE + AT] < link[row + NEED]:
        return int(p)
    p = link[row + PRED_B]
    if p >= 0 and whole[p * WHOLE + AT] < link[row + NEED_B]:
        return int(p)
    return -1


@kernel(out=("whole",))
def _wait_for(whole, i, p):
    """Have robot i looked at again when robot p reaches a vertex."""
    if whole[i * WHOLE + ON] < 0:
        whole[i * WHOLE + ON] = p
        whole[i * WHOLE + NEXT] = whole[p * WHOLE + HEAD]
        whole[p * WHOLE + HEAD] = i


@kernel(out=("whole",))
def _extend(base, link, whole, i):
    """Grant robot i all moves that wait for nobody."""
    w = i * WHOLE
    last = base[i + 1] - base[i] - 1
    while whole[w + FROZEN] == 0 and whole[w + ON] < 0 and whole[w + GRANTED] < last:
        row = (base[i] + whole[w + GRANTED]) * VERTEX_WHOLE
        if link[row + GROUP] >= 0:
            break
        p = _missing(link, whole, row)
        if p >= 0:
            _wait_for(whole, i, p)
            break
        whole[w + GRANTED] += 1


@kernel()
def _danger(base, vert, real, whole, obs, many, period, quick, size, known, i, t, length, duration):
    """Whether an obstacle might touch robot i within ``duration`` seconds on the next ``length`` metres.

    Obstacles with known tracks are where their samples say; others may be anywhere that their top speed allows.
    """
    if many == 0:
        return False
    at = (base[i] + whole[i * WHOLE + AT]) * VERTEX_REAL
    on = at + VERTEX_REAL
    share = 1.0 / (vert[on + ALONG] - vert[at + ALONG])
    ux = (vert[on + X] - vert[at + X]) * share
    uy = (vert[on + Y] - vert[at + Y]) * share
    behind = real[i * REAL + S] - vert[at + ALONG]
    px = vert[at + X] + behind * ux
    py = vert[at + Y] + behind * uy
    last = len(obs) // (2 * many) - 1
    first = min(int(t / period), last)
    until = min(int((t + duration) / period) + 1, last)
    near = real[i * REAL + RADIUS] + size
    if known == 0:
        until = first
        near += quick * duration + quick * (t - first * period)
    else:
        near += 0.5 * quick * period
    for j in range(first, until + 1):
        for o in range(many):
            gx = obs[2 * (j * many + o)] - px
            gy = obs[2 * (j * many + o) + 1] - py
            ahead = min(max(gx * ux + gy * uy, 0.0), length)
            gx -= ahead * ux
            gy -= ahead * uy
            if gx * gx + gy * gy <= near * near:
                return True
    return False


@kernel()
def _in_danger(base, vert, real, whole, obs, many, period, quick, size, known, i, t):
    """The same for robot i until it was looked at again and has braked."""
    r = i * REAL
    top = min(real[r + V] + real[r + A_MAX] * period, real[r + V_MAX])
    length = top * period + top * top / (2.0 * real[r + D_MAX])
    return _danger(
        base, vert, real, whole, obs, many, period, quick, size, known, i, t, length,
        period + top / real[r + D_MAX],
    )  # fmt: skip


@kernel(out=("real", "whole", "tree", "ready"))
def _join(base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, i, g, t):
    """Robot i is ready for its move in a ring; the last one has all of them begin."""
    if whole[i * WHOLE + PHASE] != g + 1:
        whole[i * WHOLE + PHASE] = g + 1
        ready[g] += 1
    _rest(real, whole, tree, i, t, ORDER, NEVER)
    if ready[g] == gfirst[g + 1] - gfirst[g]:
        hold = greal[g * GROUP_REAL + G_HOLD]
        for m in range(gfirst[g], gfirst[g + 1]):
            j = gmember[m]
            _rest(real, whole, tree, j, t, DELAYED, NEVER)
        # The first one speaks for all.
        _due(tree, gmember[gfirst[g]], t + hold)


@kernel(out=("real", "whole", "tree", "ready"))
def _decide(
    base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, obs, many, period, quick, size, known, i, t
):  # fmt: skip
    """What robot i does from now on: stand for a reason, or a phase of constant acceleration."""
    r = i * REAL
    w = i * WHOLE
    s = real[r + S]
    v = real[r + V]
    k = whole[w + AT]
    last = base[i + 1] - base[i] - 1
    row = (base[i] + k) * VERTEX_REAL
    if k == last:
        # A speed that rounding left over.
        v = 0.0
        real[r + V] = 0.0
    if v == 0.0:
        if whole[w + BRAKE] == 3:
            _rest(real, whole, tree, i, t, NONE, NEVER)
            whole[w + MODE] = DEAD
            return
        whole[w + BRAKE] = 0
        if k == last:
            _rest(real, whole, tree, i, t, NONE, NEVER)
            return
        if real[r + HOLD] > t:
            _rest(real, whole, tree, i, t, DELAYED, real[r + HOLD])
            return
        if s == vert[row + ALONG]:
            if whole[w + FROZEN] != 0 and whole[w + GRANTED] <= k:
                _rest(real, whole, tree, i, t, REPLANNING, NEVER)
                return
            if whole[w + TURNED] < k and vert[row + TURN] > 0.0:
                whole[w + TURNED] = k
                _rest(real, whole, tree, i, t, TURNING, t + vert[row + TURN])
                return
            g = link[(base[i] + k) * VERTEX_WHOLE + GROUP]
            if g >= 0:
                p = link[(base[i] + k) * VERTEX_WHOLE + PRED_B]
                if p >= 0 and whole[p * WHOLE + AT] < link[(base[i] + k) * VERTEX_WHOLE + NEED_B]:
                    _wait_for(whole, i, int(p))
                    _rest(real, whole, tree, i, t, ORDER, NEVER)
                    return
                _join(base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, i, g, t)
                return
            _extend(base, link, whole, i)
            if whole[w + GRANTED] <= k:
                _rest(real, whole, tree, i, t, ORDER, NEVER)
                return
        if _in_danger(base, vert, real, whole, obs, many, period, quick, size, known, i, t):
            _rest(real, whole, tree, i, t, OBSTACLE, NEVER)
            return
    late = vert[row + DELAY] > 0.0 and whole[w + FIRED] < k and s >= vert[row + PLACE]
    if late and whole[w + BRAKE] == 0:
        whole[w + FIRED] = k
        if v == 0.0:
            real[r + HOLD] = t + vert[row + DELAY]
            _rest(real, whole, tree, i, t, DELAYED, real[r + HOLD])
            return
        whole[w + BRAKE] = 1
    if whole[w + MODE] == REST:
        _rest(real, whole, tree, i, t, NONE, NEVER)
    whole[w + MODE] = MOVE
    _phase(base, vert, link, real, whole, tree, i, t)


@kernel(out=("real", "whole", "tree"))
def _phase(base, vert, link, real, whole, tree, i, t):
    """The next phase of a motion that ends where the robot has to stand, cut off at the next vertex."""
    r = i * REAL
    w = i * WHOLE
    s = real[r + S]
    v = real[r + V]
    k = whole[w + AT]
    row = (base[i] + k) * VERTEX_REAL
    stop = min(link[(base[i] + k) * VERTEX_WHOLE + NEXT_STOP], whole[w + GRANTED])
    end = vert[(base[i] + stop) * VERTEX_REAL + ALONG]
    room = end - s
    rise = real[r + A_MAX]
    fall = real[r + D_MAX]
    needed = v * v / (2.0 * fall)
    accel = 0.0
    end_s = end
    end_v = 0.0
    peak = min(math.sqrt((2.0 * rise * fall * room + fall * v * v) / (rise + fall)), real[r + V_MAX])
    if whole[w + BRAKE] != 0 or room <= 0.0:
        accel = -fall
        end_s = min(s + needed, end)
    elif (
        needed >= room * (1.0 - TINY)
        or (peak - v <= TINY * peak and v < real[r + V_MAX])
        # The rest of the room is less than the rounding of places: a cruise there would have no length and be repeated.
        or (v >= real[r + V_MAX] and end - needed <= s)
    ):
        accel = -v * v / (2.0 * room)
    elif v < real[r + V_MAX]:
        accel = rise
        end_v = peak
        end_s = min(s + (peak * peak - v * v) / (2.0 * rise), end)
    else:
        end_v = v
        end_s = end - needed
    if end_s > end - NEAR:
        end_s = end
    cut = vert[row + VERTEX_REAL + ALONG]
    if end_v == 0.0 and end_s < cut and end_s > cut - NEAR:
        end_s = cut
    if vert[row + DELAY] > 0.0 and whole[w + FIRED] < k and vert[row + PLACE] > s:
        cut = vert[row + PLACE]
    if end_s > cut:
        end_v = math.sqrt(max(v * v + 2.0 * accel * (cut - s), 0.0))
        end_s = cut
    real[r + A] = accel
    real[r + T0] = t
    real[r + END_S] = end_s
    real[r + END_V] = end_v
    # Two events at one moment leave a phase of no length, which ends at once.
    _due(tree, i, t + 2.0 * (end_s - s) / (v + end_v) if end_s > s else t)


@kernel(out=("real", "log", "count"))
def _write(real, whole, log, count, i, duration):
    """Note the phase that robot i has driven."""
    if duration > 0.0:
        c = count[0] * ROW
        log[c] = i
        log[c + 1] = whole[i * WHOLE + AT]
        log[c + 2] = real[i * REAL + T0]
        log[c + 3] = duration
        log[c + 4] = real[i * REAL + S]
        log[c + 5] = real[i * REAL + V]
        log[c + 6] = real[i * REAL + A]
        count[0] += 1


@kernel(out=("real", "log", "count"))
def _cut(real, whole, log, count, i, t):
    """End the phase of a robot that drives now."""
    r = i * REAL
    past = t - real[r + T0]
    _write(real, whole, log, count, i, past)
    low = real[r + S]
    v = real[r + V]
    real[r + S] = min(max(low + past * (v + 0.5 * real[r + A] * past), low), real[r + END_S])
    real[r + V] = max(v + real[r + A] * past, 0.0)
    real[r + T0] = t


@kernel(out=("real", "whole", "tree", "log", "count", "ready"))
def _ring(
    base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period, quick, size,
    known, i, t,
):  # fmt: skip
    """The next phase of robots that move in a ring; whether robot i has reached its vertex."""
    g = link[(base[i] + whole[i * WHOLE + AT]) * VERTEX_WHOLE + GROUP]
    q = g * GROUP_REAL
    total = greal[q + T_RISE] + greal[q + T_CRUISE] + greal[q + T_FALL]
    if whole[i * WHOLE + MODE] == REST:
        for m in range(gfirst[g], gfirst[g + 1]):
            j = gmember[m]
            row = (base[j] + whole[j * WHOLE + AT]) * VERTEX_REAL
            length = vert[row + VERTEX_REAL + ALONG] - vert[row + ALONG]
            if _danger(
                base, vert, real, whole, obs, many, period, quick, size, known, j, t, length, total + period
            ):
                _due(tree, i, t + period)
                return False
        for m in range(gfirst[g], gfirst[g + 1]):
            j = gmember[m]
            row = (base[j] + whole[j * WHOLE + AT]) * VERTEX_REAL
            length = vert[row + VERTEX_REAL + ALONG] - vert[row + ALONG]
            _rest(real, whole, tree, j, t, NONE, t + greal[q + T_RISE])
            whole[j * WHOLE + MODE] = RING
            whole[j * WHOLE + PHASE] = -1
            real[j * REAL + T0] = t
            real[j * REAL + A] = length * greal[q + RATE]
        return False
    row = (base[i] + whole[i * WHOLE + AT]) * VERTEX_REAL
    length = vert[row + VERTEX_REAL + ALONG] - vert[row + ALONG]
    _write(real, whole, log, count, i, t - real[i * REAL + T0])
    phase = -whole[i * WHOLE + PHASE]
    if phase == 3:
        return True
    rise = greal[q + T_RISE]
    top = greal[q + RATE] * rise
    share = 0.5 * top * rise
    span = greal[q + T_CRUISE]
    if phase == 2 or span <= 0.0:
        share += top * span
        span = greal[q + T_FALL]
        phase = 2
    real[i * REAL + S] = vert[row + ALONG] + length * share
    real[i * REAL + V] = length * top
    real[i * REAL + A] = 0.0 if phase == 1 else -length * greal[q + SLOW]
    real[i * REAL + T0] = t
    whole[i * WHOLE + PHASE] = -(phase + 1)
    _due(tree, i, t + span)
    return False


@kernel(out=("real", "whole", "tree", "log", "count", "ready"))
def _reach(
    base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period, quick, size,
    known, i, t,
):  # fmt: skip
    """Robot i has come to its next vertex: those that waited for it are looked at."""
    w = i * WHOLE
    whole[w + AT] += 1
    whole[w + GRANTED] = max(whole[w + GRANTED], whole[w + AT])
    real[i * REAL + S] = vert[(base[i] + whole[w + AT]) * VERTEX_REAL + ALONG]
    j = whole[w + HEAD]
    whole[w + HEAD] = -1
    while j >= 0:
        follower = whole[j * WHOLE + NEXT]
        whole[j * WHOLE + ON] = -1
        before = whole[j * WHOLE + GRANTED]
        mode = whole[j * WHOLE + MODE]
        _extend(base, link, whole, j)
        if mode == REST and real[j * REAL + HOLD] <= t and whole[j * WHOLE + CAUSE] == ORDER:
            _decide(
                base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, obs, many, period, quick, size,
                known, j, t,
            )  # fmt: skip
        elif (
            mode == MOVE
            and whole[j * WHOLE + GRANTED] > before
            and real[j * REAL + A] < 0.0
            and whole[j * WHOLE + BRAKE] == 0
        ):
            _cut(real, whole, log, count, j, t)
            _decide(
                base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, obs, many, period, quick, size,
                known, j, t,
            )  # fmt: skip
        j = follower


@kernel(out=("real", "whole", "tree", "log", "count", "ready"))
def _look(
    base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period, quick, size,
    known, t,
):  # fmt: skip
    """Look at the obstacles: robots in danger brake, those that stood for an obstacle go on; how many drive or stand so."""
    busy = 0
    for i in range(len(base) - 1):
        mode = whole[i * WHOLE + MODE]
        if mode == MOVE:
            busy += 1
            if whole[i * WHOLE + BRAKE] == 0:
                past = t - real[i * REAL + T0]
                s = real[i * REAL + S]
                v = real[i * REAL + V]
                real[i * REAL + S] = s + past * (v + 0.5 * real[i * REAL + A] * past)
                real[i * REAL + V] = max(v + real[i * REAL + A] * past, 0.0)
                hit = _in_danger(base, vert, real, whole, obs, many, period, quick, size, known, i, t)
                real[i * REAL + S] = s
                real[i * REAL + V] = v
                if hit:
                    _cut(real, whole, log, count, i, t)
                    if real[i * REAL + V] > 0.0:
                        whole[i * WHOLE + BRAKE] = 2
                    _decide(
                        base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, obs, many, period,
                        quick, size, known, i, t,
                    )  # fmt: skip
        elif mode == REST and whole[i * WHOLE + CAUSE] == OBSTACLE:
            busy += 1
            _decide(
                base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, obs, many, period, quick, size,
                known, i, t,
            )  # fmt: skip
    return busy


@kernel(out=("real", "whole", "tree", "log", "count", "ready"))
def _halt_all(
    base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period, quick, size,
    known, faulty, t,
):  # fmt: skip
    """Robot ``faulty`` brakes permanently; all others that do not yet do so stop at the first vertex that they can."""
    for i in range(len(base) - 1):
        r = i * REAL
        w = i * WHOLE
        if whole[w + FROZEN] != 0 and i != faulty:
            continue
        whole[w + FROZEN] = 1
        mode = whole[w + MODE]
        if mode == RING:
            # The ring is completed first.
            whole[w + GRANTED] = whole[w + AT] + 1
            if i == faulty:
                whole[w + BRAKE] = 3
            continue
        if mode == MOVE:
            _cut(real, whole, log, count, i, t)
        if i == faulty:
            whole[w + BRAKE] = 3
        s = real[r + S]
        needed = real[r + V] * real[r + V] / (2.0 * real[r + D_MAX])
        e = whole[w + AT]
        while e < whole[w + GRANTED] and vert[(base[i] + e) * VERTEX_REAL + ALONG] < s + needed * (
            1.0 - TINY
        ):
            e += 1
        whole[w + GRANTED] = e
        _decide(
            base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, obs, many, period, quick, size,
            known, i, t,
        )  # fmt: skip


@kernel(out=("real", "whole", "tree", "log", "count", "ready", "clock"), each=20_000, of="vert")
def run(
    base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period, quick, size,
    known, fault, faulty, limit, clock, halt,
):  # fmt: skip
    """Drive until nothing more happens; how it ended.

    ENDED; LIMIT: the time is over; FULL: the log is, call again with more room; STALLED: too many events without progress in
    time, which no known drive has.

    Parameters
    ----------
    base : int64 (n + 1,): where the vertices of each robot begin.
    vert, link : float64 (vertices * VERTEX_REAL,), int32 (vertices * VERTEX_WHOLE,).
    real, whole : float64 (n * REAL,), int32 (n * WHOLE,): the robots.
    tree : float64 (2 * a power of two,): when each robot has its next event, NEVER at the beginning.
    log, count : float64 (room * ROW,), int64 (1,): the phases driven.
    gfirst, gmember, greal, ready : groups of robots that move in a ring, how many of each are ready.
    obs, many, period, quick, size, known : places of obstacles every ``period`` seconds, float64 (samples * many * 2,); their top
        speed and radius; whether their tracks are known to the robots.
    fault, faulty : float64 (f + 1,), int64 (f + 1,): when robots stop permanently, rising, and which; NEVER, -1 at the end.
    limit : seconds after which to give up.
    clock : float64 (4,): the time; the next look at the obstacles; 1 after the beginning, and 1 more after each fault; how many
        events may follow each other before the time must have moved on by NEAR.
    """
    n = len(base) - 1
    half = len(tree) // 2
    looks = 0
    since = clock[0]
    events = 0
    most = clock[3]
    if clock[2] == 0.0:
        clock[2] = 1.0
        for i in range(n):
            _extend(base, link, whole, i)
        for i in range(n):
            whole[i * WHOLE + CAUSE] = NONE
            _decide(
                base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, obs, many, period, quick, size,
                known, i, clock[0],
            )  # fmt: skip
    while True:
        if count[0] + 2 * n + 8 > len(log) // ROW:
            return FULL
        looks += 1
        if looks % 64 == 0 and stopped(halt):
            return LIMIT
        t = tree[1]
        look = clock[1] if many > 0 else NEVER
        f = int(clock[2]) - 1
        when = fault[f]
        if when <= min(t, look, limit) and (when <= clock[0] or t < NEVER or many > 0):
            clock[0] = when
            clock[2] += 1.0
            _halt_all(
                base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period,
                quick, size, known, int(faulty[f]), when,
            )  # fmt: skip
            continue
        if t >= NEVER and many == 0:
            return ENDED
        if min(t, look) > limit:
            clock[0] = limit
            return LIMIT
        if look <= t:
            clock[0] = look
            clock[1] = look + period
            busy = _look(
                base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period,
                quick, size, known, look,
            )  # fmt: skip
            if busy == 0 and tree[1] >= NEVER:
                return ENDED
            continue
        clock[0] = t
        if t > since + NEAR:
            since = t
            events = 0
        events += 1
        if events > most:
            return STALLED
        k = 1
        while k < half:
            k = 2 * k if tree[2 * k] <= tree[2 * k + 1] else 2 * k + 1
        i = k - half
        r = i * REAL
        w = i * WHOLE
        mode = whole[w + MODE]
        reached = False
        if mode == MOVE:
            _write(real, whole, log, count, i, t - real[r + T0])
            real[r + S] = real[r + END_S]
            real[r + V] = real[r + END_V]
            real[r + T0] = t
            reached = real[r + S] == vert[(base[i] + whole[w + AT] + 1) * VERTEX_REAL + ALONG]
            if real[r + V] == 0.0 and whole[w + BRAKE] == 1:
                real[r + HOLD] = t + vert[(base[i] + whole[w + FIRED]) * VERTEX_REAL + DELAY]
        elif mode == RING or whole[w + PHASE] > 0:
            reached = _ring(
                base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period,
                quick, size, known, i, t,
            )  # fmt: skip
            if not reached:
                continue
            whole[w + PHASE] = 0
            real[r + V] = 0.0
            real[r + SINCE] = t
            whole[w + MODE] = MOVE
        if reached:
            _reach(
                base, vert, link, real, whole, tree, log, count, gfirst, gmember, greal, ready, obs, many, period,
                quick, size, known, i, t,
            )  # fmt: skip
        _decide(
            base, vert, link, real, whole, tree, gfirst, gmember, greal, ready, obs, many, period, quick, size,
            known, i, t,
        )  # fmt: skip
