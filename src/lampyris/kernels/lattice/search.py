"""Weighted A* and ARA* over the states (cell, heading) of a lattice.

Likhachev, Gordon, Thrun, "ARA*: Anytime A* with provable bounds on sub-optimality", NIPS 2003.

A state is ``cell * headings + heading``, a cell an index of the padded map. Its cost so far stands in ``mark``
above the number of the search, so that nothing is cleared between two searches. The waiting states are a heap of
pairs (key, state) in two arrays; a state whose cost falls is put in once more, and what is found closed when it is
taken out is skipped. All of it is the caller's: a kernel that runs out of room, or of its budget, returns and is
called again to go on.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64

FOUND, EXHAUSTED, LIMIT, FULL = 0, 1, 2, 3

SHIFT = 47
"""Bits of a cost; above them is the number of the search."""
LOOK = 512
"""States expanded between two looks at the flag that stops the search."""
# Entries of ``count``.
WAITING, INCONSISTENT, EXPANDED, GENERATED, CHECKED = 0, 1, 2, 3, 4


@kernel(out=("keys", "states"), inline=True)
def _push(keys, states, n, key, state):
    """Put a pair into a heap of ``n``."""
    i = n
    while i > 0:
        above = (i - 1) >> 1
        if keys[u64(above)] <= key:
            break
        keys[u64(i)] = keys[u64(above)]
        states[u64(i)] = states[u64(above)]
        i = above
    keys[u64(i)] = key
    states[u64(i)] = state


@kernel(out=("keys", "states"), inline=True)
def _pop(keys, states, n):
    """Take the first pair out of a heap of ``n``; the caller has read it."""
    last = n - 1
    key = keys[u64(last)]
    state = states[u64(last)]
    i = 0
    child = 1
    while child < last:
        if child + 1 < last:
            child += keys[u64(child + 1)] < keys[u64(child)]  # no branch: which is less cannot be foreseen
        if keys[u64(child)] >= key:
            break
        keys[u64(i)] = keys[u64(child)]
        states[u64(i)] = states[u64(child)]
        i = child
        child = 2 * i + 1
    keys[u64(i)] = key
    states[u64(i)] = state


@kernel(inline=True)
def is_covered(clear, disc_first, disc, disc_radius, cell, primitive):
    """Whether no wall is in the discs that cover the sweep of a primitive from a cell: then it is free."""
    for k in range(disc_first[u64(primitive)], disc_first[u64(primitive + 1)]):
        if clear[u64(cell + disc[u64(k)])] < disc_radius[u64(k)]:
            return False
    return True


@kernel(inline=True)
def is_goal(goals, state):
    """Whether a state is one of the goal states, which rise; there is at least one."""
    left = 0
    right = len(goals) - 1
    while left < right:
        middle = (left + right) >> 1
        if goals[u64(middle)] < state:
            left = middle + 1
        else:
            right = middle
    return goals[u64(left)] == state


@kernel(inline=True)
def _goal_index(goals, state):
    """The index of a state among the goal states, which rise; -1: it is none of them. There is at least one."""
    left = 0
    right = len(goals) - 1
    while left < right:
        middle = (left + right) >> 1
        if goals[u64(middle)] < state:
            left = middle + 1
        else:
            right = middle
    return left if goals[u64(left)] == state else -1


@kernel(out=("mark", "parent", "closed", "keys", "states", "aside", "count", "best"), of="closed", each=10)
def search(
    wall, clear, heuristic, headings, first, offset, turned, cost, reach, inner, sweep_first, sweep,
    disc_first, disc, disc_radius,
    goals, ends, near, weight, limit, run, mark, parent, closed, round_, keys, states, aside, count, best,
    price, price_first, price_cell, price_weight, halt,
):  # fmt: skip
    """Search until a goal state is taken out, nothing waits, or the budget is used.

    Parameters
    ----------
    wall : uint8 (cells,): 1 where a cell of the padded map is blocked.
    clear : float32 (cells,): distance from the centre of a cell to the nearest wall, in cells.
    heuristic : int64 (cells,): admissible cost to the goal; negative: the base must not be there.
    headings : number of headings.
    first : int32 (headings + 1,): where the primitives of a heading begin.
    offset, turned, cost : int64, int32, int64 (primitives,): change of cell, heading at the end, cost.
    reach : float32 (primitives,): farthest point of the sweep from the centre of its first cell, in cells.
    inner : clearance below which the base cannot stand at a cell, in cells.
    sweep_first, sweep : int32 (primitives + 1,), int32 (k,): cells that a primitive sweeps, as offsets.
    disc_first, disc, disc_radius : int32 (primitives + 1,), int32 (k,), float32 (k,): discs that cover a sweep.
    goals : int64 (g,): goal states, rising, at least one.
    ends : int64 (g,): what it costs to get from each to the goal; no heuristic of a goal state is greater than that.
    near : no goal state has a greater heuristic.
    weight : keys are cost + weight * heuristic.
    limit : greatest number of expansions; negative: none.
    run : number of this search, above those before it.
    mark, parent, closed : int64, int16, uint8 (states,).
    round_ : closed states hold this number; 1 in the first round of a search.
    keys, states : the heap; int64 and int32 of one length.
    aside : int32: states that were closed when their cost fell.
    count : int64 (5,): waiting, set aside, expanded, generated, swept cells looked at.
    best : int64 (2,): cost of the best path to the goal, and its goal state; -1: none yet.
    price : uint8 (cells,): terrain; empty: there is none.
    price_first : int32 (primitives + 1,): where the cells begin that the base passes through during a primitive.
    price_cell, price_weight : int32, int64 (k,): each as an offset, and what a terrain value of 1 there adds to the cost.
    """
    priced = len(price) > 0
    waiting = int(count[u64(0)])
    aside_n = int(count[u64(1)])
    expanded = int(count[u64(2)])
    generated = int(count[u64(3)])
    checked = int(count[u64(4)])
    room = len(keys) - 64
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
        cell = state // headings
        heading = state - cell * headings
        room_here = clear[u64(cell)]
        for p in range(first[u64(heading)], first[u64(heading + 1)]):
            there = cell + offset[u64(p)]
            h = heuristic[u64(there)]
            if h < 0 or clear[u64(there)] < inner:
                continue
            to = there * headings + turned[u64(p)]
            g_to = g + cost[u64(p)]
            old = mark[u64(to)]
            new = old < low or old >= high
            if not new and old - low <= g_to:
                continue
            if best[u64(0)] >= 0 and g_to + h >= best[u64(0)]:
                continue
            generated += 1
            if room_here < reach[u64(p)] and not is_covered(clear, disc_first, disc, disc_radius, cell, p):
                open_ = True
                for k in range(sweep_first[u64(p)], sweep_first[u64(p + 1)]):
                    if wall[u64(cell + sweep[u64(k)])] != 0:
                        open_ = False
                        checked += k - sweep_first[u64(p)]
                        break
                if not open_:
                    continue
            if priced:
                for k in range(price_first[u64(p)], price_first[u64(p + 1)]):
                    g_to += price_weight[u64(k)] * price[u64(cell + price_cell[u64(k)])]
                if not new and old - low <= g_to:
                    continue
                if best[u64(0)] >= 0 and g_to + h >= best[u64(0)]:
                    continue
            mark[u64(to)] = low + g_to
            parent[u64(to)] = p
            if new:
                closed[u64(to)] = 0
            if h <= near:
                k = _goal_index(goals, to)
                if k >= 0:
                    whole = g_to + ends[u64(k)]
                    if best[u64(0)] < 0 or whole < best[u64(0)]:
                        best[u64(0)] = whole
                        best[u64(1)] = to
            if closed[u64(to)] == round_ and weight > 1.0:
                aside[u64(aside_n)] = to
                aside_n += 1
            else:
                closed[u64(to)] = 0
                _push(keys, states, waiting, g_to + int(weight * h), to)
                waiting += 1
    else:
        result = 0 if best[u64(0)] >= 0 else 1
    count[u64(0)] = waiting
    count[u64(1)] = aside_n
    count[u64(2)] = expanded
    count[u64(3)] = generated
    count[u64(4)] = checked
    return result
