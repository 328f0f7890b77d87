"""Safe interval path planning over the states (cell, heading) of a lattice, among discs whose tracks are known.

Phillips, Likhachev, "SIPP: Safe interval path planning for dynamic environments", ICRA 2011; here time is continuous.

Times are in ticks: the time that the robot needs for a cell's length at its top speed. The footprint is covered by discs.
For a motion, each disc at each of some places along it stands for the span of time around the one at which the robot is
there; its radius covers what any point moves within that span. An obstacle is a disc, too, whose track consists of straight
*segments*, each at a constant speed; so the times at which a disc of the robot meets it are the roots of a quadratic.

A *node* is a state and one interval of time in which no obstacle meets the robot that stands there. Of all paths into a node
only the earliest matters: it can wait. A state that no obstacle ever comes near has one node, and time is of no account
there.

In cells outside a *region* the search has neither headings nor intervals: such a cell has one node, in which the robot may
be at any time. From there it may drive any primitive, whatever heading that begins with, and obstacles are looked at only
where the motion leads into a region. So no path of the lattice arrives before the one that this search finds (planning with
adaptive dimensionality: Gochev et al., SoCS 2011; among moving obstacles: Vemula, Muelling, Oh, SoCS 2016).

A state is ``cell * (headings + 1) + heading``, or ``+ headings`` for a cell without one.

Arrays of fixed rows, flat: ``disc`` has five numbers a row: x, y (cells, y down, from the centre of the first cell), radius,
and the begin and end of the span (ticks from the departure); ``segment`` six: begin, end, x and y at its begin, and velocity;
``block``, which is some segments of one obstacle, seven: least and greatest x, least and greatest y, begin, end, radius.
"""

from __future__ import annotations

import math

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.lattice.low_field import is_free
from lampyris.kernels.lattice.search import _pop, _push, is_goal

FOUND, EXHAUSTED, LIMIT, FULL, MANY_SPANS = 0, 1, 2, 3, 4

FOREVER = 1e15
"""Ticks: later than any."""
NEVER_SAFE = -1
"""Mark of a state in which the robot is never safe; 0: the state has not been looked at."""
# Entries of ``count``.
WAITING, NODES, EXPANDED, BEST, LOW = 0, 1, 2, 3, 4


@kernel(out=("busy",), each=100, of="busy")
def collect(
    block, block_first, segment, disc, low, high, reach, early, late, x, y, begin, end, busy
):  # fmt: skip
    """Times of departure at which discs would meet an obstacle: how many intervals were written; -1: too many.

    Parameters
    ----------
    block, block_first, segment, disc : see above; block b has the segments ``block_first[b]`` to ``block_first[b + 1]``.
    low, high : which discs.
    reach : no point of these is farther from (x, y), cells.
    early, late : the first begin and the last end of a span of these discs.
    x, y : cells.
    begin, end : only departures between these are of interest.
    busy : float64 (2 n,): begin and end of each interval, rising, apart from one another.
    """
    n = 0
    room = len(busy) // 2
    for b in range(len(block_first) - 1):
        o = 7 * b
        if block[u64(o + 5)] <= begin + early or block[u64(o + 4)] >= end + late:
            continue
        far = reach + block[u64(o + 6)]
        if x + far < block[u64(o)] or x - far > block[u64(o + 1)]:
            continue
        if y + far < block[u64(o + 2)] or y - far > block[u64(o + 3)]:
            continue
        for k in range(block_first[u64(b)], block_first[u64(b + 1)]):
            q = 6 * k
            t0 = segment[u64(q)]
            t1 = segment[u64(q + 1)]
            if t1 <= begin + early or t0 >= end + late:
                continue
            px = segment[u64(q + 2)] - x
            py = segment[u64(q + 3)] - y
            vx = segment[u64(q + 4)]
            vy = segment[u64(q + 5)]
            a = vx * vx + vy * vy
            if a > 0.0:
                # The nearest that the segment comes to the middle.
                along = -(px * vx + py * vy) / a
                along = min(max(along, 0.0), t1 - t0)
                near_x = px + along * vx
                near_y = py + along * vy
            else:
                near_x = px
                near_y = py
            if near_x * near_x + near_y * near_y >= far * far:
                continue
            for d in range(low, high):
                e = 5 * d
                dx = px - disc[u64(e)]
                dy = py - disc[u64(e + 1)]
                r = disc[u64(e + 2)] + block[u64(o + 6)]
                c = dx * dx + dy * dy - r * r
                if a == 0.0:
                    if c >= 0.0:
                        continue
                    first = t0
                    last = t1
                else:
                    h = dx * vx + dy * vy
                    rest = h * h - a * c
                    if rest <= 0.0:
                        continue
                    root = math.sqrt(rest)
                    first = t0 + max((-h - root) / a, 0.0)
                    last = min(t0 + (-h + root) / a, t1)
                    if first >= last:
                        continue
                first = max(first - disc[u64(e + 4)], begin)
                last = min(last - disc[u64(e + 3)], end)
                if first > last:
                    continue
                # Join it with the intervals that it touches.
                i = 0
                above = n
                while i < above:
                    middle = (i + above) >> 1
                    if busy[u64(2 * middle + 1)] < first:
                        i = middle + 1
                    else:
                        above = middle
                j = i
                while j < n and busy[u64(2 * j)] <= last:
                    first = min(first, busy[u64(2 * j)])
                    last = max(last, busy[u64(2 * j + 1)])
                    j += 1
                if j == i:
                    if n == room:
                        return -1
                    m = n
                    while m > i:
                        busy[u64(2 * m)] = busy[u64(2 * m - 2)]
                        busy[u64(2 * m + 1)] = busy[u64(2 * m - 1)]
                        m -= 1
                    n += 1
                elif j > i + 1:
                    m = j
                    while m < n:
                        busy[u64(2 * (m - j + i + 1))] = busy[u64(2 * m)]
                        busy[u64(2 * (m - j + i + 1) + 1)] = busy[u64(2 * m + 1)]
                        m += 1
                    n -= j - i - 1
                busy[u64(2 * i)] = first
                busy[u64(2 * i + 1)] = last
    return n


@kernel(
    out=("slot", "node_state", "node_begin", "node_end", "node_time", "node_open", "still"),
    each=10,
    of="still",
)
def _lay(
    block, block_first, segment, stand, low, high, reach, x, y, state, nodes,
    slot, node_state, node_begin, node_end, node_time, node_open, still,
):  # fmt: skip
    """Make the nodes of a state; how many nodes there are now, -1: ``still`` has too little room.

    ``node_...`` must have room for one more than ``still`` has intervals.
    """
    n = collect(
        block, block_first, segment, stand, low, high, reach, 0.0, 0.0, x, y, 0.0, 1e15, still
    )  # fmt: skip
    if n < 0:
        return -1
    first = nodes
    at = 0.0
    for k in range(n + 1):
        until = still[u64(2 * k)] if k < n else 1e15
        if until > at:
            node_state[u64(nodes)] = state
            node_begin[u64(nodes)] = at
            node_end[u64(nodes)] = until
            node_time[u64(nodes)] = 2e15
            node_open[u64(nodes)] = 0
            nodes += 1
        if k < n:
            at = still[u64(2 * k + 1)]
    slot[u64(state)] = first + 1 if nodes > first else -1
    return nodes


@kernel(
    out=(
        "slot", "node_state", "node_begin", "node_end", "node_time", "node_before", "node_by", "node_left", "node_open",
        "keys", "waits", "still", "count",
    ),
    of="starts",
    each=20_000,
)  # fmt: skip
def _begin(
    heuristic, headings, stride, border, stand_first, stand, stand_reach, block, block_first, segment, order, pull,
    starts, slot, node_state, node_begin, node_end, node_time, node_before, node_by, node_left, node_open,
    keys, waits, still, count,
):  # fmt: skip
    """Put the start states into the heap, at time 0; 0, or what :func:`timed_search` returns where there is no room."""
    nodes = 0
    waiting = 0
    each = headings + 1
    spans = len(still) // 2 + 2
    ordered = 0
    if len(order) > 1:
        ordered = 1
    for k in range(len(starts)):
        state = starts[u64(k)]
        cell = state // each
        heading = state - cell * each
        h = heuristic[u64(cell)]
        if h < 0 or slot[u64(state)] != 0:
            continue
        if nodes + spans >= len(node_state) or waiting + 1 >= len(keys):
            return 3
        if heading == headings:
            made = nodes + 1
            slot[u64(state)] = made
            node_state[u64(nodes)] = state
            node_begin[u64(nodes)] = 0.0
            node_end[u64(nodes)] = 1e15
        else:
            made = _lay(
                block, block_first, segment, stand, stand_first[u64(heading)], stand_first[u64(heading + 1)], stand_reach,
                float(cell % stride - border), float(cell // stride - border), state, nodes,
                slot, node_state, node_begin, node_end, node_time, node_open, still,
            )  # fmt: skip
            if made < 0:
                return 4
        if made > nodes and node_begin[u64(nodes)] == 0.0:
            node_time[u64(nodes)] = 0.0
            node_before[u64(nodes)] = -1
            node_by[u64(nodes)] = -1
            node_left[u64(nodes)] = 0.0
            node_open[u64(nodes)] = 1
            _push(keys, waits, waiting, pull * (h + order[u64(state * ordered)]), nodes)
            waiting += 1
        nodes = made
    count[u64(0)] = waiting
    count[u64(1)] = nodes
    return 0


@kernel(
    out=("node_time", "node_before", "node_by", "node_left", "node_open", "keys", "waits"),
    of="busy",
    each=1000,
)
def _enter(
    busy, n, node, primitive, time, leave, lasts, most, rest, pull, to, nodes, waiting,
    slot, node_state, node_begin, node_end, node_time, node_before, node_by, node_left, node_open, keys, waits,
):  # fmt: skip
    """Reach a state by a primitive, at the earliest after each of ``n`` forbidden intervals of departures.

    Returns how many wait now; -1: no room. ``rest`` is the least time from there to the goal, ``pull`` what is added to an
    arrival for its key.
    """
    departure = time
    k = 0
    while departure <= leave:
        until = busy[u64(2 * k)] if k < n else leave
        if until > departure or (k == n and n == 0):
            arrival = departure + lasts
            if most >= 0.0 and arrival + rest > most:
                break
            target = int(slot[u64(to)]) - 1
            while target < nodes and node_state[u64(target)] == to and node_end[u64(target)] < arrival:
                target += 1
            if (
                target < nodes
                and node_state[u64(target)] == to
                and node_begin[u64(target)] <= arrival
                and arrival < node_time[u64(target)]
            ):
                if waiting + 1 >= len(keys):
                    return -1
                node_time[u64(target)] = arrival
                node_before[u64(target)] = node
                node_by[u64(target)] = primitive
                node_left[u64(target)] = departure
                node_open[u64(target)] = 1
                _push(keys, waits, waiting, arrival + pull, target)
                waiting += 1
        if k == n:
            break
        departure = busy[u64(2 * k + 1)]
        k += 1
    return waiting


@kernel(
    out=(
        "slot", "node_state", "node_begin", "node_end", "node_time", "node_before", "node_by", "node_left", "node_open",
        "keys", "waits", "busy", "still", "count",
    ),
    of="keys",
    each=2000,
)  # fmt: skip
def timed_search(
    wall, clear, heuristic, headings, stride, border, first, offset, turned, duration, reach, inner, sweep_first, sweep,
    disc_first, disc, disc_reach, stand_first, stand, stand_reach, slack, block, block_first, segment,
    inside, member, group_first, most, order, tick, starts, goals, weight, limit,
    slot, node_state, node_begin, node_end, node_time, node_before, node_by, node_left, node_open,
    keys, waits, busy, still, count, halt,
):  # fmt: skip
    """The earliest arrival in a goal state, from start states that the robot leaves at time 0 or later.

    Parameters
    ----------
    wall .. sweep : as for :func:`lampyris.kernels.lattice.search.search`.
    stride, border : of the padded map.
    duration : float64 (primitives,): ticks.
    disc_first, disc, disc_reach : int64 (primitives + 1,), float64 (5 k,), float64 (primitives,): the discs of each
        primitive, and how far they reach from the centre of its first cell.
    stand_first, stand, stand_reach : the same of the robot that stands at each heading.
    slack : ticks before a departure and after an arrival that the discs of a motion stand for.
    block, block_first, segment : the obstacles.
    inside : uint8 (cells,): 1 in a region, where states have headings and intervals of time.
    member, group_first : int32: primitives that move the base, by displacement, quick ones first; where those of
        each displacement begin.
    most : arrivals later than that are of no use, ticks; negative: all are.
    order : int64 (states,), or (1,) and 0: what is added to the heuristic for the order of states, not for bounds.
    tick : ticks of one unit of ``heuristic`` and ``order``.
    starts, goals : int64, (s,), (g,): states; goals rising, at least one. Outside regions they stand for cells.
    weight : keys are time + weight * (heuristic + order).
    limit : greatest number of expansions; negative: none.
    slot : int32 (states,): one more than the first node of a state; 0 to begin with.
    node_state .. node_open : int64, float64, float64, float64, int32, int16, float64, uint8 (n,): state, interval, earliest
        arrival, the node before and the primitive and departure by which it comes from there, and whether it waits.
    keys, waits : the heap; float64 and int32 of one length.
    busy, still : float64 (2 m,): scratch.
    count : int64 (5,): waiting, nodes, expanded, the node of the goal, cells expanded; zeros, and -1 the fourth.

    Returns
    -------
    FOUND, EXHAUSTED, LIMIT; FULL: there was too little room for nodes, MANY_SPANS: for intervals of time; nothing of what
    was written is of use then.
    """
    nodes = 0
    waiting = 0
    expanded = 0
    lows = 0
    spans = len(still) // 2 + 2
    each = headings + 1
    groups = len(group_first) - 1
    ordered = 0
    if len(order) > 1:
        ordered = 1
    look = 512
    result = _begin(
        heuristic, headings, stride, border, stand_first, stand, stand_reach, block, block_first, segment, order,
        weight * tick, starts, slot, node_state, node_begin, node_end, node_time, node_before, node_by, node_left,
        node_open, keys, waits, still, count,
    )  # fmt: skip
    if result != 0:
        return result
    nodes = int(count[u64(1)])
    waiting = int(count[u64(0)])
    result = 1
    while waiting > 0:
        if limit >= 0 and expanded >= limit:
            result = 2
            break
        look -= 1 + (len(block_first) >> 4)
        if look <= 0:
            look = 512
            if stopped(halt):
                break
        node = int(waits[u64(0)])
        _pop(keys, waits, waiting)
        waiting -= 1
        if node_open[u64(node)] == 0:
            continue
        node_open[u64(node)] = 0
        state = int(node_state[u64(node)])
        if is_goal(goals, state):
            node_open[u64(node)] = 1
            count[u64(3)] = node
            result = 0
            break
        expanded += 1
        time = node_time[u64(node)]
        leave = node_end[u64(node)]
        cell = state // each
        heading = state - cell * each
        x = float(cell % stride - border)
        y = float(cell // stride - border)
        # The primitives of a heading are one group of their own; a cell has one for each displacement.
        is_low = heading == headings
        group = 0
        more = 1
        begin = 0
        end = 0
        if is_low:
            lows += 1
            more = groups
        else:
            begin = int(first[u64(heading)])
            end = int(first[u64(heading + 1)])
        while group < more:
            if is_low:
                begin = int(group_first[u64(group)])
                end = int(group_first[u64(group + 1)])
            group += 1
            m = begin
            while m < end:
                p = m
                if is_low:
                    p = int(member[u64(m)])
                m += 1
                there = cell + offset[u64(p)]
                h = heuristic[u64(there)]
                if h < 0 or clear[u64(there)] < inner:
                    if is_low:
                        break
                    continue
                lasts = duration[u64(p)]
                if most >= 0.0 and time + lasts + tick * h > most:
                    if is_low:
                        break
                    continue
                to = there * each + headings
                to_low = inside[u64(there)] == 0
                if to_low:
                    known = int(slot[u64(to)])
                    if known > 0 and node_time[u64(known - 1)] <= time + lasts:
                        if is_low:
                            break
                        continue
                else:
                    to = there * each + turned[u64(p)]
                    if slot[u64(to)] < 0:
                        continue
                if not is_free(wall, clear, reach, sweep_first, sweep, cell, p):
                    continue
                n = 0
                if not (is_low and to_low):
                    n = collect(
                        block, block_first, segment, disc, disc_first[u64(p)], disc_first[u64(p + 1)],
                        disc_reach[u64(p)], -slack, lasts + slack, x, y, time, leave, busy,
                    )  # fmt: skip
                    if n < 0:
                        return 4
                if slot[u64(to)] == 0:
                    if nodes + spans >= len(node_state):
                        return 3
                    if to_low:
                        node_state[u64(nodes)] = to
                        node_begin[u64(nodes)] = 0.0
                        node_end[u64(nodes)] = 1e15
                        node_time[u64(nodes)] = 2e15
                        node_open[u64(nodes)] = 0
                        nodes += 1
                        slot[u64(to)] = nodes
                    else:
                        end_heading = int(turned[u64(p)])
                        nodes = _lay(
                            block, block_first, segment, stand, stand_first[u64(end_heading)],
                            stand_first[u64(end_heading + 1)], stand_reach,
                            float(there % stride - border), float(there // stride - border), to, nodes,
                            slot, node_state, node_begin, node_end, node_time, node_open, still,
                        )  # fmt: skip
                        if nodes < 0:
                            return 4
                        if slot[u64(to)] < 0:
                            continue
                waiting = _enter(
                    busy, n, node, p, time, leave, lasts, most, tick * h, weight * tick * (h + order[u64(to * ordered)]),
                    to, nodes, waiting, slot, node_state, node_begin, node_end, node_time, node_before, node_by, node_left,
                    node_open, keys, waits,
                )  # fmt: skip
                if waiting < 0:
                    return 3
                if is_low and to_low:
                    break
    count[u64(0)] = waiting
    count[u64(1)] = nodes
    count[u64(2)] = expanded
    count[u64(4)] = lows
    return result
