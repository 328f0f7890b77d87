"""A whole simulation of AD-GSO among random walkers, in one call: many runs, not one to be watched.

The rules are those of :mod:`lampyris.sim.grid.loop`, tick for tick and draw for draw; a test holds the two equal.
What one call cannot do (repairing a field, finding a gate on arrival, obstacles that do not yield) makes it
return :data:`ELSEWHERE`, and the loop is run instead.

Cells are numbers in the map with a border one cell wide: ``(y + 1) * stride + x + 1``, where ``stride =
width + 2``.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, lowest, stopped, u64
from lampyris.kernels.adgso.lookahead_walk import walk_known
from lampyris.kernels.adgso.tick_speed import OF_GOAL, OF_WAITING, pace
from lampyris.kernels.adgso.walk import ARRIVED, AT, FIRST, HEMMED, LENGTH, LOOKED, OBSTACLE, STOP, WALL

RUNNING, AT_GOAL, BLOCKED, TIMEOUT, ELSEWHERE, MORE_DRAWS = 0, 1, 2, 3, 4, 5
"""What :func:`drive_ticks` returns: out of this block's draws; the outcomes; not for this kernel."""

(
    NOW,
    OBSTACLES,
    LEFT,
    ROBOT,
    PLACE,
    UNTIL,
    STEPS,
    PATIENT,
    REPLANS,
    WAITS,
    PATH_SWITCHES,
    ITERATIONS,
    EXPANSIONS,
) = range(13)
HEMMED_AT, COUNTED, LAST_TICK, PATIENCE, MARKED = 13, 14, 15, 16, 17
"""Places in ``state``: ticks over, obstacles there, cells in ``left``, the robot's cell, index of its cell in
``path``, last index committed to, steps of the path (-1: no path; NOT_ASKED), ticks of waiting in a row,
counters, the cell where the walk was hemmed in last (-1: none), whether the plan's iteration was counted,
limits (a last tick of -1: ten times the map's sides, and four times the first path's steps), cells in
``marks``."""
STATE = 18
NOT_ASKED = -2

EVENT_BLOCKED, EVENT_WAITED, EVENT_HEMMED, EVENT_WAIT = 1, 2, 4, 8
"""Bits of ``events``: replanned because the next cell could not be entered, after waiting; waited because
hemmed in, because the next cell could not be entered."""


@kernel()
def crosses(cell, dx, dy, stride, left, step_x, step_y):
    """Whether a diagonal step from a cell crosses a diagonal driven in this tick."""
    obstacle = left[cell + dx] - 1
    if obstacle >= 0 and step_x[obstacle] == -dx and step_y[obstacle] == dy:
        return True
    obstacle = left[cell + dy * stride] - 1
    return obstacle >= 0 and step_x[obstacle] == dx and step_y[obstacle] == -dy


@kernel(out=("state", "where", "step_x", "step_y", "taken", "left", "gone"))
def stroll(state, where, step_x, step_y, taken, left, gone, open_steps, stride, draws, first):
    """Every walker steps to the option that its draw means, or stays: one tick of the obstacles.

    ``draws[first + k]`` is walker k's. ``gone`` lists the cells of ``left`` so that they can be cleared.
    ``open_steps`` has a bit for each of the eight neighbours, row by row, into which walls let a walker step.
    """
    for k in range(state[LEFT]):
        obstacle = left[gone[k]] - 1
        step_x[obstacle] = 0
        step_y[obstacle] = 0
        left[gone[k]] = 0
    state[LEFT] = 0
    # Nobody enters the robot's cell; it is nobody's, so that nothing else takes it for an obstacle.
    taken[state[ROBOT]] = -1
    for obstacle in range(state[OBSTACLES]):
        at = where[obstacle]
        up = at - stride
        down = at + stride
        # No branches: walls and obstacles come as they like, and would be guessed wrong every other time.
        may = open_steps[at] & (
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
        pick = int(draws[first + obstacle] * (count + 1))
        if pick == 0:
            continue
        for _ in range(pick - 1):
            may &= may - 1
        k = lowest(u64(may))
        j = k + (k > 3)
        dy = j // 3 - 1
        dx = j - 3 * dy - 4
        to = at + dy * stride + dx
        taken[at] = 0
        left[at] = obstacle + 1
        gone[state[LEFT]] = at
        state[LEFT] += 1
        taken[to] = obstacle + 1
        where[obstacle] = to
        step_x[obstacle] = dx
        step_y[obstacle] = dy
    taken[state[ROBOT]] = 0


@kernel()
def rank(cell, turn):
    """The rank of a cell in a random order; :func:`lampyris.sim.traffic.obstacle_draws.ranks` has the same numbers."""
    x = (cell * 0x9E3779B1 + turn) & 0x7FFFFFFF
    x = ((x ^ (x >> 16)) * 0x45D9F3B) & 0x7FFFFFFF
    x = ((x ^ (x >> 15)) * 0x45D9F3B) & 0x7FFFFFFF
    return x ^ (x >> 16)


@kernel(out=("state", "where", "taken"))
def appear(state, where, taken, opened, count, rate, chance, place):
    """With chance ``rate`` one more walker, on the free cell that is first in the order ``place`` means."""
    if state[OBSTACLES] >= count or chance >= rate:
        return 0
    turn = int(place * 2147483648.0)
    best = -1
    least = 0
    for c in range(len(opened)):
        if opened[c] != 0 and taken[c] == 0 and c != state[ROBOT]:
            found = rank(c, turn)
            if best < 0 or found < least:
                best = c
                least = found
    if best < 0:
        return 0
    where[state[OBSTACLES]] = best
    state[OBSTACLES] += 1
    taken[best] = state[OBSTACLES]
    return 1


@kernel()
def may_enter(robot, to, stride, free, cutting, taken, left, step_x, step_y):
    """Whether the robot may make a step into a neighbour now: walls, nobody there, no swap, no crossing."""
    if free[to] == 0 or taken[to] != 0:
        return False
    obstacle = left[to]
    if obstacle != 0 and taken[robot] == obstacle:
        return False
    step = to - robot
    dy = (step + stride + 1) // stride - 1
    dx = step - dy * stride
    if dx != 0 and dy != 0:
        if cutting == 0 and (free[robot + dx] == 0 or free[robot + dy * stride] == 0):
            return False
        return not crosses(robot, dx, dy, stride, left, step_x, step_y)
    return True


@kernel(out=("state", "shut", "marks"))
def close(state, where, shut, marks, stride, free, cutting, offsets, taken, left, step_x, step_y):
    """Mark in ``shut`` what is closed to the robot: obstacles, and neighbours that it could not enter in
    this tick. ``marks`` has the x and y of each."""
    robot = state[ROBOT]
    count = state[OBSTACLES]
    for obstacle in range(count):
        cell = where[obstacle]
        shut[cell] |= OBSTACLE
        marks[2 * obstacle + 1] = cell // stride
        marks[2 * obstacle] = cell - cell // stride * stride
    for k in range(len(offsets)):
        to = robot + offsets[k]
        if free[to] == 0 or taken[to] != 0:
            continue
        dy = (offsets[k] + stride + 1) // stride - 1
        dx = offsets[k] - dy * stride
        if dx != 0 and dy != 0 and cutting == 0 and (free[robot + dx] == 0 or free[robot + dy * stride] == 0):
            continue
        if not may_enter(robot, to, stride, free, cutting, taken, left, step_x, step_y):
            shut[to] |= OBSTACLE
            marks[2 * count + 1] = to // stride
            marks[2 * count] = to - to // stride * stride
            count += 1
    state[MARKED] = count


@kernel(
    out=(
        "state", "tally", "path", "shut", "marks", "wall", "toll", "room", "dist", "queue", "queued", "sub_path",
        "known",
    )
)  # fmt: skip
def ask(
    state, where, taken, left, step_x, step_y, free, stride, cutting, offsets, horizon,
    cost, luc, step, shut, terrain, setup, tally, path,
    ring_dx, ring_dy, ring_at, near, far, price, wall, toll, room, dist, queue, queued, sub_path,
    known, marks, lower, halt,
):  # fmt: skip
    """Plan from where the robot stands; False if that is for the loop, because it would repair.

    The path is ``path``, of which the first sub-path and ``horizon`` steps more are there; ``state[STEPS]`` =
    -1 says hemmed in.
    """
    robot = state[ROBOT]
    ahead = -1
    if 0 <= state[PLACE] < state[STEPS]:
        cell = path[state[PLACE] + 1]
        if may_enter(robot, cell, stride, free, cutting, taken, left, step_x, step_y):
            ahead = cell
    if cost[robot] < 0:
        return False
    close(state, where, shut, marks, stride, free, cutting, offsets, taken, left, step_x, step_y)
    for k in range(STOP):
        tally[k] = 0
    tally[AT] = robot
    tally[LENGTH] = 1
    path[0] = robot
    code = walk_known(
        cost, luc, step, shut, terrain, setup, tally, path,
        ring_dx, ring_dy, ring_at, near, far, price, wall, toll, room, dist, queue, queued, sub_path,
        known, marks, state[MARKED], lower, horizon, halt,
    )  # fmt: skip
    for k in range(state[MARKED]):
        shut[marks[2 * k + 1] * stride + marks[2 * k]] &= WALL
    state[EXPANSIONS] += tally[LOOKED]
    state[PLACE] = 0
    if code == HEMMED:
        if state[HEMMED_AT] == robot:
            return False
        state[HEMMED_AT] = robot
        state[STEPS] = -1
        state[UNTIL] = 0
    elif code == ARRIVED:
        state[HEMMED_AT] = -1
        state[STEPS] = tally[LENGTH] - 1
        state[UNTIL] = max(tally[FIRST], min(state[STEPS], 1))
        state[COUNTED] = 0
        if ahead >= 0 and state[STEPS] > 0 and path[1] != ahead:
            state[PATH_SWITCHES] += 1
    else:
        return False
    return True


@kernel(
    out=(
        "state", "where", "step_x", "step_y", "taken", "left", "gone", "robots", "tracks", "events",
        "aims", "speeds", "causes", "nodes", "why", "shut", "tally", "path", "wall", "toll", "room", "dist",
        "queue", "queued", "sub_path", "known", "marks",
    )
)  # fmt: skip
def drive_ticks(
    state, where, step_x, step_y, taken, left, gone, robots, tracks, events, aims, speeds, causes,
    draws, count, opened, open_steps, rate,
    free, stride, robot_cuts, offsets, goal, horizon, law, counted, blocked, height, nodes, why,
    cost, luc, step, shut, terrain, setup, tally, path,
    ring_dx, ring_dy, ring_at, near, far, price, wall, toll, room, dist, queue, queued, sub_path,
    known, marks, lower, halt,
):  # fmt: skip
    """Tick on until there is an outcome or this block's draws are used up; see :func:`run` of the loop.

    At tick 0 it asks for the first plan, too.

    Parameters
    ----------
    where .. gone : obstacles and room to move them in. ``taken`` and ``left``: by cell number, obstacle + 1.
    robots, events, aims : out, by tick: the robot's cell, bits of the events, the cell that could not be entered.
    tracks : out, ``count`` a tick: each obstacle's cell, 0 before it appeared.
    speeds, causes : out, by tick, of the dissertation's law.
    draws : float64, ``count + 2`` a tick of this block.
    opened, open_steps, rate : of walkers: cells that they may be on, see :func:`stroll`, chance to appear.
    free .. offsets : of the robot: cells, numbering, whether it may cut corners, its steps.
    horizon .. why : see :func:`lampyris.kernels.adgso.tick_speed.pace`; ``nodes`` and ``why`` are its room.
    cost .. lower : see :func:`lampyris.kernels.adgso.lookahead_walk.walk_known`.
    """
    if state[STEPS] == NOT_ASKED:
        robots[0] = state[ROBOT]
        for obstacle in range(count):
            tracks[obstacle] = where[obstacle] if obstacle < state[OBSTACLES] else 0
        speeds[0] = 0.0
        if not ask(
            state, where, taken, left, step_x, step_y, free, stride, robot_cuts, offsets, horizon,
            cost, luc, step, shut, terrain, setup, tally, path,
            ring_dx, ring_dy, ring_at, near, far, price, wall, toll, room, dist, queue, queued, sub_path,
            known, marks, lower, halt,
        ) or state[STEPS] < 0:  # fmt: skip
            return ELSEWHERE
        if state[LAST_TICK] < 0:
            state[LAST_TICK] = 10 * (height + stride - 2) + 4 * state[STEPS]
    block = len(draws) // (count + 2)
    for tick in range(block):
        if stopped(halt):
            return ELSEWHERE
        state[NOW] += 1
        now = state[NOW]
        events[now] = 0
        speeds[now] = 0.0
        first = tick * (count + 2)
        stroll(state, where, step_x, step_y, taken, left, gone, open_steps, stride, draws, first)
        if rate <= 1.0:
            appear(state, where, taken, opened, count, rate, draws[first + count], draws[first + count + 1])
        for obstacle in range(count):
            tracks[now * count + obstacle] = where[obstacle] if obstacle < state[OBSTACLES] else 0
        enter = -1
        if 0 <= state[PLACE] < state[UNTIL]:
            cell = path[state[PLACE] + 1]
            if may_enter(state[ROBOT], cell, stride, free, robot_cuts, taken, left, step_x, step_y):
                enter = cell
        if enter < 0:
            if state[PLACE] < state[UNTIL] or state[PATIENT] > 0 or state[STEPS] < 0:
                state[REPLANS] += 1
                if state[PATIENT] > 0 or state[STEPS] < 0:
                    events[now] |= EVENT_WAITED
                else:
                    events[now] |= EVENT_BLOCKED
                    aims[now] = path[state[PLACE] + 1]
            if not ask(
                state, where, taken, left, step_x, step_y, free, stride, robot_cuts, offsets, horizon,
                cost, luc, step, shut, terrain, setup, tally, path,
                ring_dx, ring_dy, ring_at, near, far, price, wall, toll, room, dist, queue, queued, sub_path,
                known, marks, lower, halt,
            ):  # fmt: skip
                return ELSEWHERE
            if state[UNTIL] > 0:
                cell = path[1]
                if may_enter(state[ROBOT], cell, stride, free, robot_cuts, taken, left, step_x, step_y):
                    enter = cell
        if enter < 0:
            state[WAITS] += 1
            state[PATIENT] += 1
            events[now] |= EVENT_HEMMED if state[STEPS] < 0 else EVENT_WAIT
            robots[now] = state[ROBOT]
            causes[now] = OF_WAITING
            if state[PATIENT] > state[PATIENCE]:
                return BLOCKED
        else:
            came = state[ROBOT]
            state[ROBOT] = enter
            state[PLACE] += 1
            state[PATIENT] = 0
            robots[now] = enter
            if state[COUNTED] == 0:
                state[ITERATIONS] += 1
                state[COUNTED] = 1
            if enter == goal:
                causes[now] = OF_GOAL
                return AT_GOAL
            speeds[now] = pace(
                came, path, state[PLACE], state[STEPS], horizon, speeds[now - 1], law, counted, blocked,
                taken, stride, height, nodes, why,
            )  # fmt: skip
            causes[now] = why[1]
        if now == state[LAST_TICK]:
            return TIMEOUT
    return MORE_DRAWS
