"""Exact costs from the states around a goal: Dijkstra's search backward, walls included, in the order of the excess cost.

The excess of a state is its cost to the goal, less what a consistent heuristic says. Along a path backward from the goal it
never falls: when every state with a lesser excess than K is expanded, each path from another state has an excess of K at least.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.lattice.low_field import is_free
from lampyris.kernels.lattice.search import _pop, _push

# Entries of ``count``.
WAITING, EXPANDED, EXCESS = 0, 1, 2


@kernel(out=("costs", "done", "keys", "states", "count"), of="costs", each=500)
def spread_back(
    wall, clear, inner, reach, sweep_first, sweep, heuristic, headings, last_first, last, offset, began, price,
    row, goal, half, limit, costs, done, keys, states, count, halt,
):  # fmt: skip
    """Expand the states of a square around the goal until a path may have left it.

    Parameters
    ----------
    wall, clear, inner, reach, sweep_first, sweep, headings, offset : see :func:`lampyris.kernels.lattice.search.search`.
    heuristic : int64 (cells,): consistent cost to the goal; negative: the base must not be there.
    last_first, last : int32: primitives by the heading at their end, and where those of each heading begin.
    began, price : int32, int64 (primitives,): heading at the beginning, cost.
    row : cells of a row of the map.
    goal : the cell in the middle of the square.
    half : the square has ``2 * half + 1`` cells a side.
    limit : greatest number of expansions.
    costs, done : int64, uint8 (side * side * headings,): by row, column and heading; -1 where none is known, 1 where it is exact.
    keys, states : the heap, int64 and int32 of one length, in which the goal states wait.
    count : int64 (3,): waiting, expanded, least excess of a state outside the square (to begin with a greater number than any).

    Returns
    -------
    Whether the heap was large enough. ``count[2]`` is then what every path from a state that is not done exceeds the
    heuristic by, at least.
    """
    waiting = int(count[u64(0)])
    expanded = int(count[u64(1)])
    excess = int(count[u64(2)])
    side = 2 * half + 1
    goal_y = goal // row
    goal_x = goal - goal_y * row
    room = len(keys) - len(offset)
    look = 512
    while waiting > 0:
        key = int(keys[u64(0)])
        if key >= excess:
            break
        if waiting >= room:
            count[u64(0)] = waiting
            count[u64(1)] = expanded
            count[u64(2)] = excess
            return False
        state = int(states[u64(0)])
        if done[u64(state)] == 0 and expanded >= limit:
            excess = key
            break
        _pop(keys, states, waiting)
        waiting -= 1
        if done[u64(state)] != 0:
            continue
        look -= 1
        if look == 0:
            look = 512
            if stopped(halt):
                excess = key
                break
        done[u64(state)] = 1
        expanded += 1
        place = state // headings
        heading = state - place * headings
        y = place // side
        x = place - y * side
        cell = (goal_y + y - half) * row + goal_x + x - half
        for m in range(last_first[u64(heading)], last_first[u64(heading + 1)]):
            p = int(last[u64(m)])
            there = cell - offset[u64(p)]
            h = heuristic[u64(there)]
            if h < 0 or clear[u64(there)] < inner:
                continue
            cost = costs[u64(state)] + price[u64(p)]
            beyond = cost - h
            if beyond >= excess:
                continue
            at_y = there // row
            at_x = there - at_y * row - goal_x + half
            at_y += half - goal_y
            inside = at_x >= 0 and at_x < side and at_y >= 0 and at_y < side
            to = 0
            if inside:
                to = (at_y * side + at_x) * headings + int(began[u64(p)])
                if costs[u64(to)] >= 0 and costs[u64(to)] <= cost:
                    continue
            if not is_free(wall, clear, reach, sweep_first, sweep, there, p):
                continue
            if inside:
                costs[u64(to)] = cost
                _push(keys, states, waiting, beyond, to)
                waiting += 1
            else:
                excess = beyond
    count[u64(0)] = waiting
    count[u64(1)] = expanded
    count[u64(2)] = excess
    return True
