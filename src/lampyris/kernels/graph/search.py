"""A* and Dijkstra over a grid with exact integer costs, without a heap.

With a consistent heuristic the cells leave the open list in never falling ``f = g + h``, and a step raises
f by one of very few amounts: six for the octile metric (0, 2q-p, 2p-2q, p, 2q and 2p for a straight step q
and a diagonal p), one for each step cost when h = 0. What is pushed with one and the same raise therefore
arrives already in order, so a first-in, first-out queue for each raise, and a look at their heads, *is* the
priority queue: every operation takes constant time, the order is exact, and ties are settled by order of
arrival, the same in every run. It is the idea of Dial's buckets (Dial, CACM 12(11), 1969) with a bucket for
each raise instead of each cost, which is why 64-bit costs do no harm. A binary heap in the same loop took 2
to 3 times as long on 512x512 maps (170 to 210 ns an expansion with the heuristic, against 57 to 68); buckets
of f need a window that A* does not have, since its raises may be 0.

The queues are lists threaded through two arrays, so a cell is in one queue at most and leaves it when a
better path is found: no stale entries, and memory does not grow with the number of queues. The raise of 0 is
a stack: along equal f the newest cell is the deepest, and the search dives to the goal.

Layout: row after row, padded on each side by as many blocked cells as the longest step is long, so no step
needs a test for the edge of the map. Nothing is cleared between two searches: each counts from a base that
lies ``SPAN`` lower than the last, so that everything older looks costlier than anything new, and one
comparison asks for both.

A step is not tried where the cell before offered one at least as good: after a step east, for example,
never the three towards the west (see ``first`` and ``follow``). This is the part of canonical pruning
(Harabor and Grastien, AAAI 2011) that needs no look at the map.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK, STRETCH
from lampyris.kernels._jit import kernel, stopped, u64

FOUND, EXHAUSTED, LIMIT = 0, 1, 2

SPAN = 2**51
"""More than any f of a map: 2^24 cells times sqrt 2 in Pell units is below 2^50, and h at most doubles it."""


@kernel(inline=True)
def _least_to(x, y, gx, gy, major0, minor0, major1, minor1):
    """The heuristic of a cell; see ``slope`` of :func:`search`."""
    a = abs(x - gx)
    b = abs(y - gy)
    high = a if a > b else b
    low = b if a > b else a
    one = major0 * high + minor0 * low
    other = major1 * high + minor1 * low
    return one if one > other else other


@kernel(out=("after", "f", "result"), each=1500)
def search(
    free, stride, start, goal, budget, base,
    offset, via, across, dx, dy, cost, first, follow, slope, slot, shift, queues,
    after, before, f, step, result, halt,
):  # fmt: skip
    """Cheapest path from start to goal; or, without a goal, everything that can be reached.

    Parameters
    ----------
    free : uint8, (n,), padded; 1 where the robot may be.
    stride : length of a padded row.
    start, goal : flat indices; goal -1: none (``slope`` must then be zero).
    budget : greatest number of expansions; -1: no limit.
    base : what every f of this search is counted from: at least ``SPAN`` below the base of the search before.
    offset, via, across : int64, (steps,); where each step leads, and the two cells it touches on its way
        (0: none).
    dx, dy, cost : int64, (steps,); the same steps in cells, and their exact costs.
    first, follow : int64; the steps worth trying in a cell entered by step k are ``follow[first[k]:first[k
        + 1]]``, and in the start those of k = steps.
    slope : int64, (4,); h = max(slope[0] a + slope[1] b, slope[2] a + slope[3] b) for a >= b, the distances
        to the goal along the axes. Must be consistent.
    slot, shift : ``slot[raise >> shift]`` is the queue for that raise of f; queue 0 takes the raise 0 and
        no other.
    queues : how many.
    after, before : int32, (n + queues,); scratch. ``after`` holds the path at the end, goal first.
    f : int64, (n,); base + g + h of the cells met; anything else is at least base + SPAN.
    step : int8, (n,); scratch.
    result : int64, (4,); the ending (FOUND, EXHAUSTED, LIMIT), expansions, cells of the path, its exact
        cost (or -1).
    """
    n = len(free)
    major0 = slope[0]
    minor0 = slope[1]
    major1 = slope[2]
    minor1 = slope[3]
    for k in range(n, n + queues):
        after[k] = k
        before[k] = k
    # Flat index to row by a product: exact below 2^50 cells thanks to the half, and quicker than a 64-bit
    # division.
    rows = 1.0 / stride
    gy = goal // stride
    gx = goal - gy * stride
    level = base + _least_to(start % stride, start // stride, gx, gy, major0, minor0, major1, minor1)
    unseen = base + SPAN
    f[start] = level
    step[start] = len(offset)
    after[n] = start
    before[n] = start
    after[start] = n
    before[start] = n
    queue = 1
    expansions = 0
    ending = EXHAUSTED
    while True:
        # The next cell of this level: the stack first (what it holds has the f of the cell just expanded),
        # then the queues in turn. Links at or above n are the queues' own ends.
        cell = after[u64(n)]
        while cell >= n and queue < queues:
            cell = after[u64(n + queue)]
            if cell >= n or f[u64(cell)] != level:
                cell = n
                queue += 1
        if cell >= n:
            level = unseen
            for k in range(1, queues):
                cell = after[u64(n + k)]
                if cell < n and f[u64(cell)] < level:
                    level = f[u64(cell)]
            if level == unseen:
                break
            queue = 1
            continue
        if cell == goal:
            ending = FOUND
            break
        if expansions == budget or (expansions % LOOK == 0 and stopped(halt)):
            ending = LIMIT
            break
        expansions += 1
        u = u64(cell)
        left = before[u]
        right = after[u]
        after[u64(left)] = right
        before[u64(right)] = left
        y = int((cell + 0.5) * rows)
        x = cell - y * stride
        paid = level - _least_to(x, y, gx, gy, major0, minor0, major1, minor1)
        for i in range(first[u64(step[u])], first[u64(step[u] + 1)]):
            k = u64(follow[u64(i)])
            v = u + u64(offset[k])
            # A wall, or a cell that cannot be had for less; every closed cell is such.
            if free[v] == 0 or f[v] <= level:
                continue
            if free[u + u64(via[k])] == 0 or free[u + u64(across[k])] == 0:
                continue
            reached = paid + cost[k] + _least_to(x + dx[k], y + dy[k], gx, gy, major0, minor0, major1, minor1)
            if f[v] <= reached:
                continue
            if f[v] < unseen:
                left = before[v]
                right = after[v]
                after[u64(left)] = right
                before[u64(right)] = left
            f[v] = reached
            step[v] = k
            # Append to its queue; the stack takes it at the other end.
            right = n + slot[u64((reached - level) >> shift)]
            left = before[u64(right)]
            if right == n:
                left = n
                right = after[u64(n)]
            after[v] = right
            before[v] = left
            # This is v as a signed number, which is what the links hold.
            after[u64(left)] = cell + offset[k]
            before[u64(right)] = cell + offset[k]
    length = 0
    if ending == FOUND:
        cell = goal
        after[0] = goal
        length = 1
        while cell != start:
            cell = cell - offset[step[cell]]
            after[length] = cell
            length += 1
            if length % STRETCH == 0 and stopped(halt):
                break
    result[0] = ending
    result[1] = expansions
    result[2] = length
    result[3] = level - base if ending == FOUND else -1
