"""A greedy search over the states (cell, heading) of a lattice, in an order that knows headings.

It looks for any path that costs no more than is allowed. The order is an estimate, not a lower bound, so that no bound
follows from it: what is allowed is a multiple of a lower bound that is known beforehand. States that cannot be part of such
a path by the admissible heuristic are left out, and closed states are not opened again.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.lattice.search import _goal_index, _pop, _push, is_covered


@kernel(inline=True)
def _direction(heuristic, cell, stride, look, sector):
    """The heading of steepest descent of the heuristic from a cell, and one more."""
    at = cell
    dx = 0
    dy = 0
    for _ in range(look):
        best = heuristic[u64(at)]
        step_x = 0
        step_y = 0
        for y in range(-1, 2):
            for x in range(-1, 2):
                h = heuristic[u64(at + y * stride + x)]
                if h >= 0 and h < best:
                    best = h
                    step_x = x
                    step_y = y
        if step_x == 0 and step_y == 0:
            break
        dx += step_x
        dy += step_y
        at += step_y * stride + step_x
    return sector[u64((dy + look) * (2 * look + 1) + dx + look)] + 1


@kernel()
def _entry(heuristic, start, stride, headings, look, sector, table, half, goal_y, goal_x):
    """What the heading of the goal costs more, where steepest descent from a start enters the square around the goal."""
    side = 2 * half + 1
    at = start
    moving = True
    while moving:
        y = at // stride - goal_y + half
        x = at - at // stride * stride - goal_x + half
        if x >= 0 and x < side and y >= 0 and y < side:
            towards = int(_direction(heuristic, at, stride, look, sector))
            least = 1 << 40
            for by in range(-1, 2):
                facing = (towards - 1 + by + headings) % headings
                least = min(least, int(table[u64((y * side + x) * headings + facing)]))
            if least < 1 << 40 and towards <= headings:
                return max(least - int(heuristic[u64(at)]), 0)
            return 0
        best = heuristic[u64(at)]
        to = at
        for dy in range(-1, 2):
            for dx in range(-1, 2):
                h = heuristic[u64(at + dy * stride + dx)]
                if h >= 0 and h < best:
                    best = h
                    to = at + dy * stride + dx
        moving = to != at
        at = to
    return 0


@kernel(out=("mark", "parent", "closed", "keys", "states", "toward", "count", "best"), of="closed", each=1000)
def greedy(
    wall, clear, heuristic, headings, first, offset, turned, cost, reach, inner, sweep_first, sweep,
    disc_first, disc, disc_radius, goals, ends, weight, most, limit, run, mark, parent, closed, keys, states, count, best,
    stride, look, sector, toward, around, table, half, goal, halt,
):  # fmt: skip
    """Search until a goal state is reached, nothing waits, or the budget is used.

    Parameters
    ----------
    wall, clear, heuristic, headings, first, offset, turned, cost, reach, inner, sweep_first, sweep, disc_first, disc,
        disc_radius, goals, ends, run, mark, parent, closed, keys, states, count, best : see
        :func:`lampyris.kernels.lattice.search.search`.
    weight : keys are cost + weight * estimate.
    most : greatest cost of the path.
    limit : greatest number of expansions.
    stride : cells of a row.
    look : steps of descent that give the direction at a cell.
    sector : int8 ((2 * look + 1) ** 2,): heading of each displacement (row, column); ``headings`` for none.
    toward : int8 (cells,): heading of the direction at each cell and one more; 0: not known yet.
    around : int64 (headings * (headings + 1),): what it costs more to depart in a direction with a heading.
    table : int64 (side * side * headings,): costs to the goal without walls from the cells of a square around it.
    half : the square has ``2 * half + 1`` cells a side.
    goal : the cell in its middle.

    Returns
    -------
    FOUND, EXHAUSTED, LIMIT or FULL of :mod:`lampyris.kernels.lattice.search`.
    """
    waiting = int(count[u64(0)])
    expanded = int(count[u64(2)])
    room = len(keys) - 128
    low = run << 47
    high = (run + 1) << 47
    pause = 512
    goal_y = goal // stride
    goal_x = goal - goal_y * stride
    side = 2 * half + 1
    entry = int(count[u64(3)])
    if expanded == 0:
        at = int(states[u64(0)]) // headings
        entry = _entry(heuristic, at, stride, headings, look, sector, table, half, goal_y, goal_x)
        count[u64(3)] = entry
    result = 1
    while waiting > 0:
        if limit >= 0 and expanded >= limit:
            result = 2
            break
        if waiting >= room:
            result = 3
            break
        pause -= 1
        if pause == 0:
            pause = 512
            if stopped(halt):
                break
        state = int(states[u64(0)])
        _pop(keys, states, waiting)
        waiting -= 1
        if closed[u64(state)] == 1:
            continue
        closed[u64(state)] = 1
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
            g_to = g + cost[u64(p)]
            if g_to + h > most:
                continue
            facing = turned[u64(p)]
            to = there * headings + facing
            old = mark[u64(to)]
            new = old < low or old >= high
            if not new and (closed[u64(to)] == 1 or old - low <= g_to):
                continue
            if room_here < reach[u64(p)] and not is_covered(clear, disc_first, disc, disc_radius, cell, p):
                open_ = True
                for k in range(sweep_first[u64(p)], sweep_first[u64(p + 1)]):
                    if wall[u64(cell + sweep[u64(k)])] != 0:
                        open_ = False
                        break
                if not open_:
                    continue
            mark[u64(to)] = low + g_to
            parent[u64(to)] = p
            closed[u64(to)] = 0
            k = _goal_index(goals, to)
            if k >= 0 and g_to + ends[u64(k)] <= most:
                best[u64(0)] = g_to + ends[u64(k)]
                best[u64(1)] = to
                result = 0
                break
            y = there // stride
            x = there - y * stride - goal_x + half
            y += half - goal_y
            estimate = 1 << 40
            if x >= 0 and x < side and y >= 0 and y < side:
                estimate = int(table[u64((y * side + x) * headings + facing)])
                if estimate < h:
                    estimate = int(h)
            if estimate == 1 << 40:
                towards = int(toward[u64(there)])
                if towards == 0:
                    towards = int(_direction(heuristic, there, stride, look, sector))
                    toward[u64(there)] = towards
                estimate = int(h) + entry + around[u64(facing * (headings + 1) + towards - 1)]
            _push(keys, states, waiting, g_to + int(weight * estimate), to)
            waiting += 1
        if result == 0:
            break
    count[u64(0)] = waiting
    count[u64(2)] = expanded
    return result
