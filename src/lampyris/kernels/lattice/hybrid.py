"""Weighted A* and ARA* in a graph of mixed dimension: states with a heading inside regions, cells outside.

Gochev, Cohen, Butzke, Safonova, Likhachev, "Path planning with adaptive dimensionality", SoCS 2011.

A state is ``cell * (headings + 1) + heading``, or ``+ headings`` for a cell without one. The memory is that of
:func:`lampyris.kernels.lattice.search.search`, whose rules hold here too.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.lattice.low_field import is_free
from lampyris.kernels.lattice.search import _goal_index, _pop, _push

LOW = 5
"""Entry of ``count``: cells expanded, a part of all expansions."""


@kernel(inline=True)
def informed(h, cell, heading, stride, row, table, half, goal, entry):
    """The heuristic of a state that knows the headings of the goal.

    A path from within the square around the goal either stays there, where it costs no less than without walls, or leaves it and
    comes back. One that comes from outside costs ``entry`` more than the difference of the field.
    """
    y = cell // row
    x = cell - y * row - goal + goal // row * row + half
    y += half - goal // row
    side = 2 * half + 1
    beyond = h + entry
    if x < 0 or x >= side or y < 0 or y >= side:
        return beyond
    return max(h, min(table[u64((y * side + x) * stride + heading)], beyond))


@kernel(out=("mark", "parent", "closed", "keys", "states", "aside", "count", "best"), of="closed", each=10)
def search(
    wall, clear, heuristic, headings, first, offset, turned, cost, reach, inner, sweep_first, sweep,
    inside, member, group_first, most, order, row, table, half, goal, entry,
    goals, ends, near, weight, limit, run, mark, parent, closed, round_, keys, states, aside,
    count, best, halt,
):  # fmt: skip
    """Search until a goal state is taken out, nothing waits, or the budget is used.

    From a state with a heading every primitive of that heading leads on, from a cell every displacement at the
    cost of its cheapest free primitive; but into a region each primitive of the displacement leads to a heading
    of its own.

    Parameters
    ----------
    inside : uint8 (cells,): 1 in a region.
    member, group_first : int32: primitives that move the base, by displacement, cheap ones first; where those of
        each displacement begin.
    most : paths that cost more are of no use; negative: all are.
    order : int64 (states,), or (1,) and 0: what is added to the heuristic for the order of states, not for bounds.
    row : cells of a row of the map.
    table : int64 (side * side * (headings + 1),): costs to the goal without walls from the states of a square around it; see
        :func:`informed`.
    half : the square has ``2 * half + 1`` cells a side; negative: there is no table.
    goal : the cell in its middle.
    entry : what a path from outside the square costs more than the heuristic says, at least; not negative.
    count : int64 (6,): as in the other search, and cells expanded.

    All else is as in :func:`lampyris.kernels.lattice.search.search`.
    """
    waiting = int(count[u64(0)])
    aside_n = int(count[u64(1)])
    expanded = int(count[u64(2)])
    generated = int(count[u64(3)])
    checked = int(count[u64(4)])
    lows = int(count[u64(5)])
    stride = headings + 1
    room = len(keys) - len(offset)
    groups = len(group_first) - 1
    ordered = 0
    if len(order) > 1:
        ordered = 1
    low = run << 47
    high = (run + 1) << 47
    look = 512
    result = 1
    while waiting > 0:
        if best[u64(0)] >= 0 and keys[u64(0)] >= best[u64(0)]:
            result = 0
            break
        if limit >= 0 and expanded >= limit:
            result = 2
            break
        if waiting >= room or aside_n >= room:
            result = 3
            break
        look -= 1
        if look == 0:
            look = 512
            if stopped(halt):
                break
        state = int(states[u64(0)])
        _pop(keys, states, waiting)
        waiting -= 1
        if closed[u64(state)] == round_:
            continue
        closed[u64(state)] = round_
        expanded += 1
        g = mark[u64(state)] - low
        cell = state // stride
        heading = state - cell * stride
        is_low = heading == headings
        # The primitives of a heading are one group of their own; a cell has one for each displacement.
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
                g_to = g + cost[u64(p)]
                if most >= 0 and g_to + h > most:
                    if is_low:
                        break
                    continue
                facing = headings
                if inside[u64(there)] != 0:
                    facing = int(turned[u64(p)])
                to = there * stride + facing
                old = mark[u64(to)]
                new = old < low or old >= high
                least = int(h)
                if half >= 0:
                    least = int(informed(h, there, facing, stride, row, table, half, goal, entry))
                if (
                    (not new and old - low <= g_to)
                    or (most >= 0 and g_to + least > most)
                    or (best[u64(0)] >= 0 and g_to + least >= best[u64(0)])
                ):
                    if is_low and facing == headings:
                        break
                    continue
                generated += 1
                checked += 1
                if not is_free(wall, clear, reach, sweep_first, sweep, cell, p):
                    continue
                mark[u64(to)] = low + g_to
                parent[u64(to)] = p
                if new:
                    closed[u64(to)] = 0
                if h <= near:
                    k = _goal_index(goals, to)
                    if k >= 0:
                        whole = g_to + ends[u64(k)]
                        if (most < 0 or whole <= most) and (best[u64(0)] < 0 or whole < best[u64(0)]):
                            best[u64(0)] = whole
                            best[u64(1)] = to
                if closed[u64(to)] == round_ and weight > 1.0:
                    aside[u64(aside_n)] = to
                    aside_n += 1
                else:
                    closed[u64(to)] = 0
                    if ordered == 1:
                        least = int(h + order[u64(to)])
                    _push(keys, states, waiting, g_to + int(weight * least), to)
                    waiting += 1
                if is_low and facing == headings:
                    break
    else:
        result = 0 if best[u64(0)] >= 0 else 1
    count[u64(0)] = waiting
    count[u64(1)] = aside_n
    count[u64(2)] = expanded
    count[u64(3)] = generated
    count[u64(4)] = checked
    count[u64(5)] = lows
    return result
