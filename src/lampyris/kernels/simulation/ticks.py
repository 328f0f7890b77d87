"""A simulation in ticks, compiled: obstacles and robot of one cell, any traffic, any planner.

The rules are those of :mod:`lampyris.sim.grid.loop`, tick for tick and draw for draw; tests hold the two equal. All state is
in the arguments, so that a caller can stop after any tick, look at it, change it and go on. Where the rules ask the
planner, :func:`advance` returns, and is called again when ``route`` holds the new plan.

Cells are numbers in the map with a border one cell wide: ``(y + 1) * stride + x + 1``, where ``stride = width + 2``.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, lowest, stopped, u64
from lampyris.kernels.adgso.tick_speed import OF_GOAL, OF_WAITING, pace
from lampyris.kernels.simulation.obstacle_rules import crosses, rank
from lampyris.kernels.simulation.tick_speed import physical_pace

PAUSED, ASK, AT_GOAL, HIT, BLOCKED, HELD, TIMEOUT = range(7)
"""What :func:`advance` returns: the tick ``STOP_AT`` is over; the planner is to be asked; the endings, of which HELD is to
have waited too long for a schedule."""

(
    NOW, STOP_AT, LAST_TICK, DRAWN_FROM, PER_TICK, PHASE, OBSTACLES, CAPACITY, LEFT, ROBOT, GOAL, PLACE, UNTIL, STEPS,
    TIMED, UNTIL_TICK, COMMITS, COUNTED, ROUNDS, WAITING, HOLDING, PATIENCE, REPLANS, WAITS, ITERATIONS, AHEAD, MARKED,
    EVENTS, LAW, HORIZON, STRIDE, HEIGHT, ROOM, WALKERS, SHUTTLES, RECORDINGS, BASE, ANSWERED,
) = range(38)  # fmt: skip
"""Places in ``st``. Ticks: over, to stop at, at which it ends, of the first row of draws; draws a tick. Which part of a tick
is next. Obstacles there, and most; cells in ``left``; the robot's cell, its goal. The plan: index of the robot's cell, last
index committed to, steps (-1: no path), whether ``enter_at`` counts, the last tick committed to, whether the plan commits to
a part of it, whether its iterations were counted, how many there are. Ticks waited in a row, for obstacles and by the
schedule; how many are too many. Counters. The next cell of the plan that is left (-1: it cannot be entered now), cells in
``marks``, events written. The law, the map, how many specifications and obstacles of each kind there are, and the
tick that the first places of ``robots``, ``speeds``, ``causes`` and ``tracks`` are of. Whether the plan is an answer of
:mod:`lampyris.kernels.simulation.asking`."""
STATE = 38

BEGIN, ASKED, ASKED_TWICE = 0, 1, 2
"""Values of PHASE."""
LAW_OUTSIDE, LAW_PHYSICAL, LAW_DISSERTATION = 0, 1, 2
"""Values of LAW; with LAW_OUTSIDE the caller fills in speeds and causes."""
OF_OUTSIDE = 11
"""The cause of a speed that the caller fills in."""

APPEARED, AFTER_WAIT, NOT_NOW, MET, SCHEDULED, WAS_HIT, WAITED, NO_ENTRY, HEMMED_IN = range(9)
"""Events, three numbers each: tick, one of these, cell (of APPEARED the obstacle). Of an answer, in place of WAITED:
NO_ENTRY, and HEMMED_IN where it has no steps."""

TABLE, FIRST_OWN, OWNS, COUNT, FIRST_DRAW = range(5)
"""Places in ``walkers``, WALKER a specification: its table of steps, its part of ``own``, obstacles there and at most, its
part of a row of draws."""
WALKER = 5
OBSTACLE, STEP_TABLE, FIRST, LENGTH, AT, DIRECTION, STOOD, YIELDS, TURN_AFTER = range(9)
"""Places in ``shuttles``, SHUTTLE an obstacle: see :class:`lampyris.sim.traffic.traffic.Shuttle`; TURN_AFTER -1: never."""
SHUTTLE = 9


@kernel()
def allowed(steps, at, dx, dy):
    """Whether a table of steps has the step (dx, dy) from a cell."""
    j = 3 * (dy + 1) + dx + 1
    return j != 4 and (steps[at] >> (j - (j > 4))) & 1 == 1


@kernel(out=("st", "where", "step_x", "step_y", "taken", "left", "gone"))
def put(st, obstacle, to, dx, dy, where, step_x, step_y, taken, left, gone):
    """Move an obstacle that is alone on its cell."""
    at = where[obstacle]
    taken[at] = 0
    left[at] = obstacle + 1
    gone[st[LEFT]] = at
    st[LEFT] += 1
    taken[to] = obstacle + 1
    where[obstacle] = to
    step_x[obstacle] = dx
    step_y[obstacle] = dy


@kernel(
    out=(
        "st", "where", "step_x", "step_y", "taken", "left", "gone", "walkers", "own", "shuttles", "tracks", "events",
    )
)  # fmt: skip
def move_obstacles(
    st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
    shuttles, shuttle_routes, recordings, recorded, tracks, events,
):  # fmt: skip
    """One tick of all obstacles."""
    now = st[NOW]
    stride = st[STRIDE]
    room = st[ROOM]
    robot = st[ROBOT]
    for k in range(st[LEFT]):
        obstacle = left[gone[k]] - 1
        step_x[obstacle] = 0
        step_y[obstacle] = 0
        left[gone[k]] = 0
    st[LEFT] = 0
    # Recorded tracks move at one instant: all leave before any enters.
    for k in range(st[RECORDINGS]):
        first = recordings[3 * k + 1]
        last = recordings[3 * k + 2] - 1
        at = recorded[first + min(now - 1, last)]
        if at != recorded[first + min(now, last)]:
            taken[at] = 0
            left[at] = recordings[3 * k] + 1
            gone[st[LEFT]] = at
            st[LEFT] += 1
    for k in range(st[RECORDINGS]):
        first = recordings[3 * k + 1]
        last = recordings[3 * k + 2] - 1
        at = recorded[first + min(now - 1, last)]
        to = recorded[first + min(now, last)]
        if at != to:
            obstacle = recordings[3 * k]
            taken[to] = obstacle + 1
            where[obstacle] = to
            dy = (to - at + stride + 1) // stride - 1
            step_x[obstacle] = to - at - dy * stride
            step_y[obstacle] = dy
    for k in range(st[SHUTTLES]):
        b = SHUTTLE * k
        obstacle = shuttles[b + OBSTACLE]
        at = where[obstacle]
        to = -1
        dx = 0
        dy = 0
        for _ in range(2):
            place = shuttles[b + AT] + shuttles[b + DIRECTION]
            if 0 <= place < shuttles[b + LENGTH]:
                cell = shuttle_routes[shuttles[b + FIRST] + place]
                dy = (cell - at + stride + 1) // stride - 1
                dx = cell - at - dy * stride
                if allowed(open_steps, shuttles[b + STEP_TABLE] * room + at, dx, dy):
                    to = cell
                    break
            shuttles[b + DIRECTION] = -shuttles[b + DIRECTION]
        if to < 0:
            continue
        may = taken[to] == 0 and (shuttles[b + YIELDS] == 0 or to != robot)
        if may and dx != 0 and dy != 0 and crosses(at, dx, dy, stride, left, step_x, step_y):
            may = False
        if may:
            put(st, obstacle, to, dx, dy, where, step_x, step_y, taken, left, gone)
            shuttles[b + AT] += shuttles[b + DIRECTION]
            shuttles[b + STOOD] = 0
        else:
            shuttles[b + STOOD] += 1
            if 0 <= shuttles[b + TURN_AFTER] <= shuttles[b + STOOD]:
                shuttles[b + DIRECTION] = -shuttles[b + DIRECTION]
                shuttles[b + STOOD] = 0
    row = (now - st[DRAWN_FROM]) * st[PER_TICK]
    # No walker enters the robot's cell; it is nobody's, so that nothing else takes it for an obstacle.
    nobody = taken[robot] == 0
    if nobody:
        taken[robot] = -1
    for w in range(st[WALKERS]):
        b = WALKER * w
        first = row + walkers[b + FIRST_DRAW]
        table = walkers[b + TABLE] * room
        for n in range(walkers[b + OWNS]):
            obstacle = own[walkers[b + FIRST_OWN] + n]
            at = where[obstacle]
            up = at - stride
            down = at + stride
            # No branches: walls and obstacles come as they like, and would be guessed wrong every other time.
            may = open_steps[table + at] & (
                (taken[up - 1] == 0)
                | (taken[up] == 0) << 1
                | (taken[up + 1] == 0) << 2
                | (taken[at - 1] == 0) << 3
                | (taken[at + 1] == 0) << 4
                | (taken[down - 1] == 0) << 5
                | (taken[down] == 0) << 6
                | (taken[down + 1] == 0) << 7
            )
            if left[at - 1] + left[at + 1] + left[up] + left[down] != 0:
                for k in range(4):
                    dx = 2 * (k % 2) - 1
                    dy = 2 * (k // 2) - 1
                    if crosses(at, dx, dy, stride, left, step_x, step_y):
                        may &= ~(1 << (2 * (k % 2) + 5 * (k // 2)))
            count = may - ((may >> 1) & 85)
            count = (count & 51) + ((count >> 2) & 51)
            count = (count + (count >> 4)) & 15
            pick = int(draws[first + n] * (count + 1))
            if pick == 0:
                continue
            for _ in range(pick - 1):
                may &= may - 1
            k = lowest(u64(may))
            j = k + (k > 3)
            dy = j // 3 - 1
            dx = j - 3 * dy - 4
            put(st, obstacle, at + dy * stride + dx, dx, dy, where, step_x, step_y, taken, left, gone)
    if nobody:
        taken[robot] = 0
    for w in range(st[WALKERS]):
        b = WALKER * w
        chance = row + walkers[b + FIRST_DRAW] + walkers[b + COUNT]
        if rates[w] < 0.0 or walkers[b + OWNS] >= walkers[b + COUNT] or draws[chance] >= rates[w]:
            continue
        turn = int(draws[chance + 1] * 2147483648.0)
        table = walkers[b + TABLE] * room
        best = -1
        least = 0
        for c in range(room):
            if opened[table + c] != 0 and taken[c] == 0 and c != robot:
                found = rank(c, turn)
                if best < 0 or found < least:
                    best = c
                    least = found
        if best < 0:
            continue
        obstacle = st[OBSTACLES]
        st[OBSTACLES] += 1
        where[obstacle] = best
        step_x[obstacle] = 0
        step_y[obstacle] = 0
        taken[best] = obstacle + 1
        own[walkers[b + FIRST_OWN] + walkers[b + OWNS]] = obstacle
        walkers[b + OWNS] += 1
        note(st, events, APPEARED, w)
    for obstacle in range(st[OBSTACLES]):
        tracks[(now - st[BASE]) * st[CAPACITY] + obstacle] = where[obstacle]


@kernel(
    out=(
        "st", "where", "step_x", "step_y", "taken", "left", "gone", "walkers", "own", "shuttles", "tracks", "events",
    ),
    each=1500,
    of="tracks",
)  # fmt: skip
def move_on(
    st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
    shuttles, shuttle_routes, recordings, recorded, tracks, events, halt,
):  # fmt: skip
    """Tick after tick of all obstacles, up to the tick STOP_AT, while the robot stays; see :func:`advance`."""
    while st[NOW] < st[STOP_AT] and not stopped(halt):
        st[NOW] += 1
        move_obstacles(
            st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
            shuttles, shuttle_routes, recordings, recorded, tracks, events,
        )  # fmt: skip


@kernel(out=("st", "events"))
def note(st, events, word, cell):
    """Write down an event."""
    k = 3 * st[EVENTS]
    events[k] = st[NOW]
    events[k + 1] = word
    events[k + 2] = cell
    st[EVENTS] += 1


@kernel()
def may_enter(st, to, robot_steps, taken, left, step_x, step_y):
    """Whether the robot may make a step into a neighbour now: walls, nobody there, no swap, no crossing."""
    if taken[to] != 0:
        return False
    robot = st[ROBOT]
    stride = st[STRIDE]
    dy = (to - robot + stride + 1) // stride - 1
    dx = to - robot - dy * stride
    if dx < -1 or dx > 1 or dy < -1 or dy > 1 or not allowed(robot_steps, robot, dx, dy):
        return False
    if left[to] != 0 and taken[robot] == left[to]:
        return False
    return dx == 0 or dy == 0 or not crosses(robot, dx, dy, stride, left, step_x, step_y)


@kernel(out=("st", "marks"))
def close(st, where, robot_steps, taken, left, step_x, step_y, marks):
    """List in ``marks`` the cells closed to the robot: those of obstacles but for its own, and neighbours that it could not
    enter in this tick."""
    robot = st[ROBOT]
    stride = st[STRIDE]
    count = 0
    for obstacle in range(st[OBSTACLES]):
        if where[obstacle] != robot:
            marks[count] = where[obstacle]
            count += 1
    for dy in range(-1, 2):
        for dx in range(-1, 2):
            to = robot + dy * stride + dx
            if allowed(robot_steps, robot, dx, dy) and taken[to] == 0:
                if not may_enter(st, to, robot_steps, taken, left, step_x, step_y):
                    marks[count] = to
                    count += 1
    st[MARKED] = count


@kernel(
    out=(
        "st", "where", "step_x", "step_y", "taken", "left", "gone", "walkers", "own", "shuttles", "robots", "tracks",
        "speeds", "causes", "events", "marks", "near_wall", "x", "why",
    ),
    each=2000,
    of="where",
    thorough=True,
)  # fmt: skip
def advance(
    st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
    shuttles, shuttle_routes, recordings, recorded, robot_steps, route, enter_at,
    robots, tracks, speeds, causes, events, marks, law, counted, blocked, near_wall, x, why, halt,
):  # fmt: skip
    """Tick on until the planner has to be asked, the tick STOP_AT is over, or there is an outcome.

    Parameters
    ----------
    st : int64 (STATE,).
    where .. gone : obstacles: cell and last step of each; ``taken`` and ``left`` by cell number, obstacle + 1: who is there,
        who was there before a step of this tick; the cells in ``left``.
    draws : float64, PER_TICK a tick: of each specification of walkers one each, and two for appearing.
    walkers, own, rates : random walkers by specification (see WALKER), their obstacles, chance to appear; < 0: all there.
    opened, open_steps : by table and cell number: whether an obstacle may be there, a bit for each of the eight neighbours
        into which walls let it step, row by row.
    shuttles .. recorded : patrols and crossing obstacles (see SHUTTLE), recorded ones (obstacle, first, length), routes.
    robot_steps : as ``open_steps``, of the robot.
    route, enter_at : the plan: cells, and when each is to be entered.
    robots, tracks, speeds, causes : out, by tick; ``tracks`` has CAPACITY a tick.
    events, marks : out, see APPEARED and :func:`close`.
    law .. why : of the law LAW, see :func:`lampyris.kernels.simulation.tick_speed.physical_pace` and
        :func:`lampyris.kernels.adgso.tick_speed.pace`.
    """
    while True:
        if st[PHASE] == BEGIN:
            if st[NOW] >= st[STOP_AT] or stopped(halt):
                return PAUSED
            st[NOW] += 1
            move_obstacles(
                st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
                shuttles, shuttle_routes, recordings, recorded, tracks, events,
            )  # fmt: skip
        now = st[NOW]
        robot = st[ROBOT]
        met = taken[robot] != 0
        place = st[PLACE]
        ahead = -1
        if place < st[STEPS]:
            cell = route[place + 1]
            if may_enter(st, cell, robot_steps, taken, left, step_x, step_y):
                ahead = cell
        enter = -1
        hold = False
        if st[TIMED] != 0 and now <= st[UNTIL_TICK] and place < st[STEPS] and enter_at[place + 1] > now:
            hold = not met
        elif place < st[UNTIL]:
            enter = ahead
        if enter < 0 and not hold:
            if st[PHASE] == BEGIN:
                if place < st[UNTIL] or st[WAITING] > 0 or st[STEPS] < 0:
                    st[REPLANS] += 1
                    if st[WAITING] > 0 or st[STEPS] < 0:
                        note(st, events, AFTER_WAIT, robot)
                    else:
                        note(st, events, NOT_NOW, route[place + 1])
                close(st, where, robot_steps, taken, left, step_x, step_y, marks)
                st[AHEAD] = ahead
                st[PHASE] = ASKED
                return ASK
            if st[PHASE] == ASKED and met:
                st[REPLANS] += 1
                note(st, events, MET, robot)
                st[AHEAD] = ahead
                st[PHASE] = ASKED_TWICE
                return ASK
        st[PHASE] = BEGIN
        at = now - st[BASE]
        if enter >= 0:
            st[ROBOT] = enter
            st[PLACE] += 1
            st[WAITING] = 0
            st[HOLDING] = 0
            robots[at] = enter
            if st[COUNTED] == 0:
                st[ITERATIONS] += st[ROUNDS]
                st[COUNTED] = 1
            speeds[at] = 0.0
            if enter == st[GOAL]:
                causes[at] = OF_GOAL
                return AT_GOAL
            if st[LAW] == LAW_PHYSICAL:
                speeds[at] = physical_pace(
                    robot, route, st[PLACE], st[STEPS], st[HORIZON], speeds[at - 1], law, blocked, near_wall, where,
                    st[OBSTACLES], st[STRIDE], st[HEIGHT], x, why,
                )  # fmt: skip
                causes[at] = why[1]
            elif st[LAW] == LAW_DISSERTATION:
                speeds[at] = pace(
                    robot, route, st[PLACE], st[STEPS], st[HORIZON] + 1, speeds[at - 1], law, counted, blocked,
                    taken, st[STRIDE], st[HEIGHT], x, why,
                )  # fmt: skip
                causes[at] = why[1]
            else:
                causes[at] = OF_OUTSIDE
        else:
            st[WAITS] += 1
            robots[at] = robot
            speeds[at] = 0.0
            causes[at] = OF_WAITING
            if hold:
                note(st, events, SCHEDULED, robot)
                if st[COMMITS] != 0:
                    st[HOLDING] += 1
                    if st[HOLDING] > st[PATIENCE]:
                        return HELD
            else:
                st[WAITING] += 1
                if met:
                    note(st, events, WAS_HIT, robot)
                    return HIT
                word = WAITED
                if st[ANSWERED] != 0:
                    word = HEMMED_IN if st[STEPS] < 0 else NO_ENTRY
                note(st, events, word, robot)
                if st[WAITING] > st[PATIENCE]:
                    return BLOCKED
        if now == st[LAST_TICK]:
            return TIMEOUT
