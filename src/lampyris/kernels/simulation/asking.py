"""Ticks of a simulation whose planner answers within them: one call for many ticks and many answers.

AD-GSO's next steps and SIPP among obstacles whose future nobody knows. Where an answer takes more than the kernel knows, it
returns as :func:`lampyris.kernels.simulation.ticks.advance` does, and the planner is asked for a plan.
"""

from __future__ import annotations

from lampyris.kernels._jit import clock, kernel
from lampyris.kernels.adgso.next_steps import next_steps
from lampyris.kernels.adgso.walk import ARRIVED, FIRST, HEMMED, LENGTH, LOOKED
from lampyris.kernels.simulation.ticks import (
    AHEAD,
    ANSWERED,
    ASK,
    BASE,
    CAPACITY,
    COMMITS,
    COUNTED,
    LAW,
    LAW_OUTSIDE,
    MARKED,
    NOW,
    OBSTACLES,
    PLACE,
    ROBOT,
    ROUNDS,
    STEPS,
    TIMED,
    UNTIL,
    UNTIL_TICK,
    advance,
)
from lampyris.kernels.spacetime.live_search import live_search
from lampyris.kernels.spacetime.timed_search import FOUND

(
    ANSWERS, REFUSED, PENDING, FROM, EXPANSIONS, SWITCHES, PER_ANSWER, HEMMED_AT, KNOWN, ROUTE_CELLS, SPENT, CLOCK_ASKED,
    CLOCK_ALL,
) = range(13)  # fmt: skip
"""Places in ``asked``. Answers given, whether the last question is left to the caller, whether the next call answers it (where
the caller fills in speeds, which it does from the plan that was driven). The cell of the last answer; states expanded by all;
how often the path was switched; states that one answer may expand (-1: any number). Of AD-GSO the cell in which the robot was
hemmed in (-1: none). Of SIPP, see there: ``known``, ``length``, states that the last search expanded. Readings of the clock:
spent on answers, and in all."""
ASKED_STATE = 13


@kernel(out=("st", "asked"))
def answer(st, asked, expansions, steps, until, until_tick, timed, following):
    """Follow the steps of an answer; ``following``: its second cell."""
    asked[ANSWERS] += 1
    asked[FROM] = st[ROBOT]
    asked[EXPANSIONS] += expansions
    if st[AHEAD] >= 0 and steps > 0 and following != st[AHEAD]:
        asked[SWITCHES] += 1
    st[PLACE] = 0
    st[STEPS] = steps
    st[UNTIL] = until
    st[UNTIL_TICK] = until_tick
    st[TIMED] = timed
    st[COMMITS] = 1
    st[COUNTED] = 0
    st[ROUNDS] = 1
    st[ANSWERED] = 1


@kernel(
    out=(
        "st", "where", "step_x", "step_y", "taken", "left", "gone", "walkers", "own", "shuttles", "robots", "tracks",
        "speeds", "causes", "events", "marks", "near_wall", "x", "why", "asked",
        "shut", "pairs", "tally", "path", "wall", "toll", "mark", "dist", "queue", "queued", "sub_path", "known",
    ),
    each=2000,
    of="where",
    thorough=True,
)  # fmt: skip
def advance_adgso(
    st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
    shuttles, shuttle_routes, recordings, recorded, robot_steps, route, enter_at,
    robots, tracks, speeds, causes, events, marks, law, counted, blocked, near_wall, x, why, asked,
    pairs, cost, luc, step, shut, terrain, setup, tally, path,
    ring_dx, ring_dy, ring_at, near, far, price, wall, toll, mark, dist, queue, queued, sub_path,
    known, lower, wanted, halt,
):  # fmt: skip
    """As :func:`lampyris.kernels.simulation.ticks.advance`, with the answers of AD-GSO.

    Parameters
    ----------
    st .. why : see there.
    asked : int64 (ASKED_STATE,).
    pairs .. wanted : see :func:`lampyris.kernels.adgso.next_steps.next_steps`; answers are written to ``path``.
    """
    began = clock()
    code = ASK
    while True:
        if asked[PENDING] == 0:
            followed = path if st[ANSWERED] != 0 else route
            code = advance(
                st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
                shuttles, shuttle_routes, recordings, recorded, robot_steps, followed, enter_at,
                robots, tracks, speeds, causes, events, marks, law, counted, blocked, near_wall, x, why, halt,
            )  # fmt: skip
            if code == ASK and st[LAW] == LAW_OUTSIDE:
                asked[PENDING] = 1
                break
        asked[PENDING] = 0
        if code != ASK:
            break
        since = clock()
        robot = st[ROBOT]
        count = st[MARKED]
        asked[REFUSED] = 1
        if cost[robot] >= 0 and 2 * count <= len(pairs):
            ending = next_steps(
                robot, marks, count, pairs, cost, luc, step, shut, terrain, setup, tally, path,
                ring_dx, ring_dy, ring_at, near, far, price, wall, toll, mark, dist, queue, queued, sub_path,
                known, lower, wanted, halt,
            )  # fmt: skip
            within = asked[PER_ANSWER] < 0 or tally[LOOKED] <= asked[PER_ANSWER]
            if ending == ARRIVED and within:
                asked[REFUSED] = 0
                asked[HEMMED_AT] = -1
                steps = tally[LENGTH] - 1
                until = max(min(tally[FIRST], steps), min(steps, 1))
                answer(st, asked, tally[LOOKED], steps, until, 0, 0, path[1])
            elif ending == HEMMED and within and asked[HEMMED_AT] != robot:
                asked[REFUSED] = 0
                asked[HEMMED_AT] = robot
                answer(st, asked, tally[LOOKED], -1, 0, 0, 0, -1)
        asked[CLOCK_ASKED] += clock() - since
        if asked[REFUSED] != 0:
            break
    asked[CLOCK_ALL] += clock() - began
    return code


@kernel(
    out=(
        "st", "where", "step_x", "step_y", "taken", "left", "gone", "walkers", "own", "shuttles", "robots", "tracks",
        "speeds", "causes", "events", "marks", "near_wall", "x", "why", "asked",
        "new", "stood_at", "since", "slot", "touched", "first", "begin", "end", "owner", "barred", "ban", "counts",
        "busy", "bans", "order", "later", "arrive", "paid", "came", "done", "heap", "place", "key", "tie", "path", "enter",
        "result",
    ),
    each=3000,
    of="where",
    thorough=True,
)  # fmt: skip
def advance_sipp(
    st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
    shuttles, shuttle_routes, recordings, recorded, robot_steps, route, enter_at,
    robots, tracks, speeds, causes, events, marks, law, counted, blocked, near_wall, x, why, asked,
    new, stood_at, since, horizon, velocity, most_stays, margin, walkable, inside, stride, kind_of,
    free, offset, via, across, price, toll, steps_left, rest, goal,
    slot, touched, first, begin, end, owner, barred, ban, counts, busy, bans, order, later,
    arrive, paid, came, done, heap, place, key, tie, path, enter, result, halt,
):  # fmt: skip
    """As :func:`lampyris.kernels.simulation.ticks.advance`, with the answers of SIPP.

    Parameters
    ----------
    st .. why : see there.
    asked : int64 (ASKED_STATE,).
    new : room, one for each obstacle that ``stood_at`` has room for.
    stood_at .. result : see :func:`lampyris.kernels.spacetime.live_search.live_search`; answers are written to ``path`` and
        ``enter``, which are its ``route`` and ``enter``.
    """
    start = clock()
    code = ASK
    while True:
        if asked[PENDING] == 0:
            followed = path if st[ANSWERED] != 0 else route
            times = enter if st[ANSWERED] != 0 else enter_at
            code = advance(
                st, where, step_x, step_y, taken, left, gone, draws, walkers, own, rates, opened, open_steps,
                shuttles, shuttle_routes, recordings, recorded, robot_steps, followed, times,
                robots, tracks, speeds, causes, events, marks, law, counted, blocked, near_wall, x, why, halt,
            )  # fmt: skip
            if code == ASK and st[LAW] == LAW_OUTSIDE:
                asked[PENDING] = 1
                break
        asked[PENDING] = 0
        if code != ASK:
            break
        asking = clock()
        asked[REFUSED] = 1
        obstacles = st[OBSTACLES]
        now = st[NOW]
        if 0 < obstacles <= len(stood_at) and asked[PER_ANSWER] != 0:
            before = (now - 1 - st[BASE]) * st[CAPACITY]
            for k in range(obstacles):
                new[k] = now == st[BASE] or tracks[before + k] == 0
            live_search(
                where, step_x, step_y, new, obstacles, now, max(now - 1, 0), asked[KNOWN], stood_at, since, horizon, velocity,
                most_stays, margin, asked[PER_ANSWER], st[ROBOT], walkable, inside, stride, kind_of,
                free, offset, via, across, price, toll, steps_left, rest, goal,
                slot, touched, first, begin, end, owner, barred, ban, counts, busy, bans, order, later,
                arrive, paid, came, done, heap, place, key, tie, path, enter, asked[ROUTE_CELLS], result, halt,
            )  # fmt: skip
            asked[KNOWN] = obstacles
            asked[SPENT] = result[1]
            if result[0] == FOUND:
                asked[REFUSED] = 0
                asked[ROUTE_CELLS] = result[4]
                steps = result[4] - 1
                last = enter[0] + 1
                until = 0
                while until < steps and enter[until + 1] <= last:
                    until += 1
                answer(st, asked, result[1], steps, until, last, 1, path[min(steps, 1)])
        asked[CLOCK_ASKED] += clock() - asking
        if asked[REFUSED] != 0:
            break
    asked[CLOCK_ALL] += clock() - start
    return code
