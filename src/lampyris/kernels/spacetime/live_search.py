"""SIPP among obstacles that go on as they do now: forecast, safe intervals, search and choice in one call.

For a simulation that asks at every tick. Robot and obstacles are of one cell, and of an obstacle no more is known than where
it is and where it was a tick before. Equal to what :mod:`lampyris.planning.spacetime.session` does step by step.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel
from lampyris.kernels.spacetime.timed_search import FOUND, FULL, NEVER, clean, sipp


@kernel(out=("values",))
def sort(values, low, high):
    """Sort ``values[low:high]`` in place, ascending (Shell's method)."""
    gap = 1
    while gap < (high - low) // 3:
        gap = 3 * gap + 1
    while gap > 0:
        for i in range(low + gap, high):
            value = values[i]
            j = i
            while j >= low + gap and values[j - gap] > value:
                values[j] = values[j - gap]
                j -= gap
            values[j] = value
        gap //= 3


@kernel(out=("stood_at", "since"))
def watch(where, step_x, step_y, new, obstacles, now, known, stood_at, since):
    """Note where each obstacle is, and since when; ``known``: for so many it was noted before."""
    for k in range(obstacles):
        first = now
        if new[k] == 0 and step_x[k] == 0 and step_y[k] == 0:
            first = now - 1
        if k < known and stood_at[k] == where[k]:
            first = min(first, since[k])
        stood_at[k] = where[k]
        since[k] = first


@kernel(out=("slot", "touched", "first", "barred", "counts"), inline=True)
def touch(cell, slot, touched, first, barred, counts):
    """The slot of a cell, which has one from here on."""
    s = slot[cell]
    if s < 0:
        s = counts[0]
        slot[cell] = s
        touched[s] = cell
        first[s] = -1
        barred[s] = -1
        counts[0] += 1
    return s


@kernel(out=("slot", "touched", "first", "barred", "counts", "busy", "order"), inline=True)
def occupy(cell, begins, ends, inside, slot, touched, first, barred, counts, busy, order):
    """Note that an obstacle is on a cell from one tick to another."""
    if inside[cell] == 0:
        return
    s = touch(cell, slot, touched, first, barred, counts)
    k = counts[1]
    busy[2 * k] = begins
    busy[2 * k + 1] = ends
    order[k] = first[s]
    first[s] = k
    counts[1] += 1


@kernel(out=("slot", "touched", "first", "barred", "counts", "bans", "later"), inline=True)
def bar(cell, dx, dy, tick, inside, kind_of, steps, slot, touched, first, barred, counts, bans, later):
    """Note that the step (dx, dy) out of a cell must not end at a tick."""
    kind = kind_of[3 * (dx + 1) + dy + 1]
    if inside[cell] == 0 or kind < 0:
        return
    s = touch(cell, slot, touched, first, barred, counts)
    k = counts[2]
    bans[k] = tick * steps + kind
    later[k] = barred[s]
    barred[s] = k
    counts[2] += 1


@kernel(out=("slot", "touched", "first", "barred", "counts", "bans", "later"))
def bar_hop(
    cell, dx, dy, tick, stride, inside, kind_of, steps, slot, touched, first, barred, counts, bans, later
):
    """Note the steps that would swap places with, or cross, an obstacle whose step (dx, dy) from a cell ends at a tick."""
    to = cell + dy * stride + dx
    bar(to, -dx, -dy, tick, inside, kind_of, steps, slot, touched, first, barred, counts, bans, later)
    if dx != 0 and dy != 0:
        to = cell + dx
        bar(to, -dx, dy, tick, inside, kind_of, steps, slot, touched, first, barred, counts, bans, later)
        to = cell + dy * stride
        bar(to, dx, -dy, tick, inside, kind_of, steps, slot, touched, first, barred, counts, bans, later)


@kernel(out=("slot", "touched", "first", "barred", "counts", "busy", "bans", "order", "later"))
def forecast(
    where, step_x, step_y, new, obstacles, now, tick, horizon, velocity, most_stays, since, walkable, inside, stride,
    kind_of, steps, slot, touched, first, barred, counts, busy, bans, order, later,
):  # fmt: skip
    """Note what obstacles that are at ``where`` at ``now`` occupy and forbid after ``tick``, cell by cell: ``first`` and
    ``barred`` begin the lists of a slot's rows of ``busy`` and ``bans``, which go on by ``order`` and ``later``."""
    for k in range(counts[0]):
        slot[touched[k]] = -1
    counts[0] = 0
    counts[1] = 0
    counts[2] = 0
    for k in range(obstacles):
        cell = where[k]
        dx = step_x[k]
        dy = step_y[k]
        if new[k] == 0 and now - 1 >= tick:
            came = cell - dy * stride - dx
            occupy(came, now - 1, now - 1, inside, slot, touched, first, barred, counts, busy, order)
            if dx != 0 or dy != 0:
                bar_hop(
                    came, dx, dy, now, stride, inside, kind_of, steps, slot, touched, first, barred, counts, bans, later
                )  # fmt: skip
        occupy(cell, now, now, inside, slot, touched, first, barred, counts, busy, order)
        if horizon == 0:
            continue
        if velocity == 0 or new[k] != 0:
            dx = 0
            dy = 0
        for ahead in range(1, horizon + 1):
            to = cell + dy * stride + dx
            if (dx != 0 or dy != 0) and walkable[to] == 0:
                dx = 0
                dy = 0
                to = cell
            if dx != 0 or dy != 0:
                bar_hop(
                    cell, dx, dy, now + ahead, stride, inside, kind_of, steps, slot, touched, first, barred, counts,
                    bans, later,
                )  # fmt: skip
            elif ahead < horizon:
                # It stays: one row says so for all ticks.
                occupy(
                    cell,
                    now + ahead,
                    now + horizon,
                    inside,
                    slot,
                    touched,
                    first,
                    barred,
                    counts,
                    busy,
                    order,
                )
                break
            occupy(to, now + ahead, now + ahead, inside, slot, touched, first, barred, counts, busy, order)
            cell = to
        stood = now - since[k]
        if stood > 0:
            stays = min(2 * stood, most_stays)
            occupy(where[k], now + 1, now + stays, inside, slot, touched, first, barred, counts, busy, order)


@kernel(out=("first", "begin", "end", "owner", "barred", "ban", "order"))
def merge(touched, first, begin, end, owner, barred, ban, counts, busy, bans, order, later):
    """Safe intervals and forbidden steps, slot by slot, of what :func:`forecast` has noted; ``first`` and ``barred`` then
    say where those of a slot begin. Once after each forecast."""
    cells = counts[0]
    made = 0
    total = 0
    for s in range(cells):
        head = first[s]
        # By time: few ranges each.
        ordered = -1
        while head >= 0:
            after = order[head]
            if ordered < 0 or busy[2 * head] <= busy[2 * ordered]:
                order[head] = ordered
                ordered = head
            else:
                at = ordered
                while order[at] >= 0 and busy[2 * order[at]] < busy[2 * head]:
                    at = order[at]
                order[head] = order[at]
                order[at] = head
            head = after
        first[s] = made
        safe = -NEVER
        while ordered >= 0:
            if busy[2 * ordered] > safe:
                begin[made] = safe
                end[made] = busy[2 * ordered] - 1
                owner[made] = touched[s]
                made += 1
            safe = max(safe, busy[2 * ordered + 1] + 1)
            ordered = order[ordered]
        begin[made] = safe
        end[made] = NEVER - 1
        owner[made] = touched[s]
        made += 1
        head = barred[s]
        barred[s] = total
        while head >= 0:
            ban[total] = bans[head]
            total += 1
            head = later[head]
        sort(ban, barred[s], total)
    first[cells] = made
    barred[cells] = total
    return made


@kernel()
def safe_until(cell, tick, slot, first, begin, end):
    """The last tick to which a robot may stay on a cell where it is at ``tick``, with or without right."""
    s = slot[cell]
    if s < 0:
        return NEVER
    for i in range(first[s], first[s + 1]):
        if begin[i] <= tick + 1 <= end[i]:
            return end[i]
    return tick


@kernel()
def still_good(
    route, enter, at, length, tick, stride, kind_of, steps, slot, first, barred, busy, bans, order, later
):
    """Whether a robot that is on ``route[at]`` at ``tick`` may drive on as planned, by what :func:`forecast` has noted."""
    for k in range(at, length - 1):
        u = route[k]
        v = route[k + 1]
        t = tick if k == at else enter[k]
        then = enter[k + 1]
        s = slot[u]
        if s >= 0:
            i = first[s]
            while i >= 0:
                if t + 1 < then and busy[2 * i] < then and busy[2 * i + 1] > t:
                    return False
                i = order[i]
            dy = (v - u + stride + 1) // stride - 1
            dx = v - u - dy * stride
            code = then * steps + kind_of[3 * (dx + 1) + dy + 1]
            i = barred[s]
            while i >= 0:
                if bans[i] == code:
                    return False
                i = later[i]
        s = slot[v]
        if s >= 0:
            i = first[s]
            while i >= 0:
                if busy[2 * i] <= then <= busy[2 * i + 1]:
                    return False
                i = order[i]
    return True


@kernel(out=("route", "enter", "result"))
def keep_on(route, enter, at, length, tick, result):
    """Answer with the rest of the route that is driven."""
    for k in range(at, length):
        route[k - at] = route[k]
        enter[k - at] = enter[k]
    enter[0] = tick
    result[4] = length - at
    result[5] = 1


@kernel(
    out=(
        "stood_at", "since", "slot", "touched", "first", "begin", "end", "owner", "barred", "ban", "counts", "busy", "bans",
        "order", "later", "arrive", "paid", "came", "done", "heap", "place", "key", "tie", "route", "enter", "result",
    ),
    each=3000,
    of="free",
)  # fmt: skip
def live_search(
    where, step_x, step_y, new, obstacles, now, tick, known, stood_at, since, horizon, velocity, most_stays, margin, limit,
    robot, walkable, inside, stride, kind_of,
    free, offset, via, across, price, toll, steps_left, rest, goal,
    slot, touched, first, begin, end, owner, barred, ban, counts, busy, bans, order, later,
    arrive, paid, came, done, heap, place, key, tie, route, enter, length, result, halt,
):  # fmt: skip
    """The earliest arrival, or the route that is driven if it is still good and the new one saves too little.

    Where the bare map already says that no new one can save more, none is searched for.

    Parameters
    ----------
    where, step_x, step_y, new, obstacles : cells and last steps, whether each has just appeared, how many there are.
    now, tick : of those places; at which the robot is on ``robot``.
    known, stood_at, since : see :func:`watch`.
    horizon, velocity, most_stays, margin : settings.
    limit : states expanded at most; -1: no limit.
    walkable, inside : uint8 by cell: where obstacles can be, whether it is a cell of the map.
    kind_of : int64 (9,), the number of each step, at 3 (dx + 1) + dy + 1; -1 for none.
    free .. goal : see :func:`lampyris.kernels.spacetime.timed_search.sipp`.
    slot .. later : room; ``counts`` has what was touched last. The intervals are made only where a search needs them.
    arrive .. tie : room, one more than cells and intervals, as :func:`lampyris.kernels.spacetime.timed_search.clean` leaves
        it.
    route, enter, length : the route that is driven, its ticks and cells; the new one is written over it, if it is found. The
        ending FULL says that there is no room for it.
    result : out, int64 (8,): of the search; at 4 the number of cells, at 5 whether the route is the old one.
    """
    watch(where, step_x, step_y, new, obstacles, now, known, stood_at, since)
    forecast(
        where, step_x, step_y, new, obstacles, now, tick, horizon, velocity, most_stays, since, walkable, inside, stride,
        kind_of, len(offset), slot, touched, first, barred, counts, busy, bans, order, later,
    )  # fmt: skip
    at = -1
    for k in range(length):
        if enter[k] <= tick:
            at = k
    last = tick
    if 0 <= at < length - 1:
        last = enter[length - 1]  # ``enter`` of the cell that the robot is on becomes ``tick``
    if at >= 0 and (
        route[at] != robot
        or not still_good(
            route,
            enter,
            at,
            length,
            tick,
            stride,
            kind_of,
            len(offset),
            slot,
            first,
            barred,
            busy,
            bans,
            order,
            later,
        )
    ):
        at = -1
    result[5] = 0
    if at >= 0 and last - tick - steps_left[robot] <= margin:
        # No path is shorter than the map alone lets it be: a new one would save too little.
        result[0] = FOUND
        result[1] = 0
        keep_on(route, enter, at, length, tick, result)
        return
    merge(touched, first, begin, end, owner, barred, ban, counts, busy, bans, order, later)
    stay = safe_until(robot, tick, slot, first, begin, end)
    sipp(
        free, offset, via, across, price, toll, steps_left, rest, slot, first, begin, end, owner, barred, ban,
        robot, goal, tick, stay, NEVER, limit, arrive, paid, came, done, heap, place, key, tie, result, halt,
    )  # fmt: skip
    if result[0] == FOUND and at >= 0 and last - tie[result[4] - 1] <= margin:
        keep_on(route, enter, at, length, tick, result)
    elif result[4] > len(route):
        result[0] = FULL
    else:
        for k in range(result[4]):
            route[k] = key[k]
            enter[k] = tie[k]
    clean(arrive, done, heap, place, result[1])
