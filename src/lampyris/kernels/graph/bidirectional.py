"""Bidirectional A*: one search from the start, one from the goal, each cell expanded by one of them at most.

Pijls and Post, "Yet another bidirectional algorithm for finding the shortest path", Econometric Institute
report 2009-10, Erasmus University Rotterdam; the proof below is ours.

Side 1 searches from the start s, side 2 from the goal t against the steps. ``M`` are the cells that
neither has expanded; g1, g2 the least costs found so far, h1(v) a consistent lower bound of the cost from
v to t, h2(v) one from s to v, f = g + h. ``best`` is the least g1(v) + g2(v) met while v was in M. A
round takes one side, say 1, and the cell u of M with the least f1; u leaves M. If g1(u) + F2 - h2(u) >=
best, where F2 is at most the least f2 in M, u is dropped; else its neighbours *in M* are offered g1(u) +
step. Over when a side has nothing left in M, or its least f is at least ``best``.

Why ``best`` is then the least cost
-----------------------------------
Claim: while best > C, the cost of a cheapest path, there is a cheapest path v0 = s .. vk = t and a < b so that
v0 .. va were expanded (not dropped) by side 1 with exact g1, vb .. vk by side 2 with exact g2, and the cells
between are all in M; and there is at least one such cell. At the beginning all are (a = -1, b = k + 1).

* *Then neither side is empty or stopped by its f*: v(a+1) was in M when va was expanded, so g1(v(a+1)) is
  exact (if a = -1 it is s, at cost 0), f1(v(a+1)) <= C < best. Likewise f2(v(b-1)) <= C.
* *Side 1 takes a cell u that is not between*: the path stays as it is.
* *Side 1 takes u = vm, a < m < b.* By consistency f1(v(a+1)) <= g1*(vm) + h1(vm) <= f1(vm), the least, so
  all three are equal and g1(u) is exact (* marks exact values). u is not dropped: F2 <= f2(v(b-1)) =
  g2*(v(b-1)) + h2(v(b-1)) and h2(v(b-1)) <= h2(u) + cost(u .. v(b-1)), so g1(u) + F2 - h2(u) <= g1*(u) +
  g2*(u) = C < best. The cells on the chain of predecessors of u were all expanded by side 1, with exact
  g1, or a shorter path to u would follow. Put that chain in place of v0 .. vm: the path is still a cheapest
  one, with m for a. If no cell is left between, m = b - 1, so g2(u) is exact as well, and both were known
  while u was in M: best = C.
* *Side 2*: the same from the other end.

So at the end best = C; it is infinite only where there is no path. Nothing here asks for the same cost in
both directions: side 2 prices a step by the cell that the *robot* enters. If s = t, best is 0 from the
beginning.

The side with fewer open cells goes next (Pohl's cardinality rule); with equal f the cell nearer to its
target goes first.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK, STRETCH
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.heap import put, take

FOUND, EXHAUSTED, LIMIT = 0, 1, 2

NEVER = 2**62

SPAN = 2**51
"""More than any f of a map on plain ground; see :mod:`lampyris.kernels.graph.search`."""


@kernel()
def _bound(major0, minor0, major1, minor1, a, b):
    """Least cost of a path over these distances along the axes: the metric of the open plane."""
    a = abs(a)
    b = abs(b)
    if a < b:
        a, b = b, a
    return max(major0 * a + minor0 * b, major1 * a + minor1 * b)


@kernel(out=("heap", "place", "f", "h", "seen", "step", "state"))
def _expand(
    free, terrain, scale, stride, offset, via, across, dx, dy, price, slope, sign, u, g, to_x, to_y, run,
    heap, place, f, h, seen, step, row, other_f, other_h, other_seen, state,
):  # fmt: skip
    """Offer the neighbours of u its cost g and a step; ``sign`` is 1 along the steps, -1 against them."""
    y = u // stride
    x = u - y * stride
    for k in range(len(offset)):
        v = u + sign * offset[k]
        # A step against its direction begins in v and enters u.
        tail = u if sign > 0 else v
        enters = v if sign > 0 else u
        if free[u64(v)] == 0 or free[u64(tail + via[k])] == 0 or free[u64(tail + across[k])] == 0:
            continue
        known = seen[u64(v)]
        if known == -run:
            continue
        reached = g + price[k] * (scale + int(terrain[u64(enters)]))
        if known != run:
            seen[u64(v)] = run
            h[u64(v)] = _bound(
                slope[0], slope[1], slope[2], slope[3], x + sign * dx[k] - to_x, y + sign * dy[k] - to_y
            )
        elif reached >= f[u64(v)] - h[u64(v)]:
            continue
        f[u64(v)] = reached + h[u64(v)]
        step[u64(row + v)] = k
        put(heap, place, f, h, v)
        if other_seen[u64(v)] == run:
            whole = reached + other_f[u64(v)] - other_h[u64(v)]
            if whole < state[0]:
                state[0] = whole
                state[1] = v


@kernel(out=("heap", "place"))
def _clear(heap, place):
    """Empty a heap."""
    for i in range(1, heap[0] + 1):
        place[u64(heap[u64(i)])] = 0
    heap[0] = 0


@kernel(out=("state", "path"))
def _finish(offset, start, goal, ending, expansions, step, n, state, path, halt):
    """Write down the path over the cell where the sides met, goal first, and what there is to say."""
    best = state[0]
    length = 0
    if ending == EXHAUSTED and best < NEVER:
        ending = FOUND
        cell = state[1]
        while cell != goal:
            path[length] = cell
            length += 1
            if length % STRETCH == 0 and stopped(halt):
                break
            cell += offset[step[n + cell]]
        path[length] = goal
        length += 1
        for k in range(length // 2):
            swap = path[k]
            path[k] = path[length - 1 - k]
            path[length - 1 - k] = swap
        cell = state[1]
        while cell != start:
            cell -= offset[step[cell]]
            path[length] = cell
            length += 1
            if length % STRETCH == 0 and stopped(halt):
                break
    state[0] = ending
    state[1] = expansions
    state[2] = length
    state[3] = best if ending == FOUND else -1


@kernel(
    out=(
        "heap1",
        "place1",
        "f1",
        "h1",
        "seen1",
        "heap2",
        "place2",
        "f2",
        "h2",
        "seen2",
        "step",
        "state",
        "path",
    ),
    each=3000,
)
def meet(
    free, terrain, scale, stride, start, goal, budget, run, offset, via, across, dx, dy, price, slope,
    heap1, place1, f1, h1, seen1, heap2, place2, f2, h2, seen2, step, state, path, halt,
):  # fmt: skip
    """Cheapest path from start to goal.

    Parameters
    ----------
    free : uint8, (n,), padded as for :func:`lampyris.kernels.graph.search.search`; 1 where the robot may be.
    terrain, scale : uint8, (n,); entering v by step k costs ``price[k] * (scale + terrain[v])``.
    stride : length of a padded row.
    start, goal : flat indices.
    budget : greatest number of expansions; -1: no limit.
    run : the number of this search, from 1, never used twice with the same arrays.
    offset, via, across, dx, dy : the steps; see :func:`lampyris.kernels.graph.search.search`.
    slope : int64, (4,); see there. Must be consistent.
    heap1, heap2 : int32, (n + 1,); empty before and after.
    place1, place2 : int32, (n,); zeros before and after.
    f1, h1, f2, h2 : int64, (n,); scratch.
    seen1, seen2 : int32, (n,); scratch: run where met by that side, -run where expanded by either.
    step : int8, (2 n,); scratch: the last step of the path from the start, then the first of that to the
        goal.
    state : int64, (4,); the ending, expansions, cells of the path, its exact cost (or -1).
    path : int32, (n,); the path, goal first.
    """
    n = len(free)
    start_y = start // stride
    start_x = start - start_y * stride
    goal_y = goal // stride
    goal_x = goal - goal_y * stride
    f1[start] = h1[start] = f2[goal] = h2[goal] = _bound(
        slope[0], slope[1], slope[2], slope[3], start_x - goal_x, start_y - goal_y
    )
    seen1[start] = seen2[goal] = run
    put(heap1, place1, f1, h1, start)
    put(heap2, place2, f2, h2, goal)
    state[0] = 0 if start == goal else NEVER
    state[1] = start
    expansions = 0
    ending = EXHAUSTED
    while heap1[0] > 0 and heap2[0] > 0:
        if f1[heap1[1]] >= state[0] or f2[heap2[1]] >= state[0]:
            break
        if expansions == budget or (expansions % LOOK == 0 and stopped(halt)):
            ending = LIMIT
            break
        expansions += 1
        if heap1[0] <= heap2[0]:
            u = int(heap1[1])
            take(heap1, place1, f1, h1, u)
            if place2[u64(u)] > 0:
                take(heap2, place2, f2, h2, u)
            seen1[u64(u)] = seen2[u64(u)] = -run
            y = u // stride
            g = f1[u64(u)] - h1[u64(u)]
            beyond = _bound(slope[0], slope[1], slope[2], slope[3], u - y * stride - start_x, y - start_y)
            if heap2[0] == 0 or g + f2[heap2[1]] - beyond >= state[0]:
                continue
            _expand(
                free, terrain, scale, stride, offset, via, across, dx, dy, price, slope, 1, u, g, goal_x,
                goal_y, run, heap1, place1, f1, h1, seen1, step, 0, f2, h2, seen2, state,
            )  # fmt: skip
        else:
            u = int(heap2[1])
            take(heap2, place2, f2, h2, u)
            if place1[u64(u)] > 0:
                take(heap1, place1, f1, h1, u)
            seen1[u64(u)] = seen2[u64(u)] = -run
            y = u // stride
            g = f2[u64(u)] - h2[u64(u)]
            beyond = _bound(slope[0], slope[1], slope[2], slope[3], u - y * stride - goal_x, y - goal_y)
            if heap1[0] == 0 or g + f1[heap1[1]] - beyond >= state[0]:
                continue
            _expand(
                free, terrain, scale, stride, offset, via, across, dx, dy, price, slope, -1, u, g, start_x,
                start_y, run, heap2, place2, f2, h2, seen2, step, n, f1, h1, seen1, state,
            )  # fmt: skip
    _clear(heap1, place1)
    _clear(heap2, place2)
    _finish(offset, start, goal, ending, expansions, step, n, state, path, halt)


@kernel(out=("after", "before"))
def _unlink(after, before, base, at):
    """Take an entry out of its list."""
    left = before[u64(base + at)]
    right = after[u64(base + at)]
    after[u64(base + left)] = right
    before[u64(base + right)] = left


@kernel(out=("after", "before"))
def _link(after, before, base, n, queue, at):
    """Put an entry at the end of a queue; of queue 0, a stack, at the beginning."""
    left = n if queue == 0 else before[u64(base + n + queue)]
    right = after[u64(base + n)] if queue == 0 else n + queue
    after[u64(base + at)] = right
    before[u64(base + at)] = left
    after[u64(base + left)] = at
    before[u64(base + right)] = at


@kernel(out=("state",))
def _first(after, f, n, queues, side, unseen, state):
    """The open cell of least f of a side, or -1; ``state`` keeps its level of f and the queue looked at."""
    level = state[2 + side]
    queue = state[4 + side]
    base = side * (n + queues)
    row = side * n
    cell = n
    while level != unseen:
        cell = int(after[u64(base + n)])
        while cell >= n and queue < queues:
            cell = int(after[u64(base + n + queue)])
            if cell >= n or f[u64(row + cell)] != level:
                cell = n
                queue += 1
        if cell < n:
            break
        level = unseen
        for k in range(1, queues):
            head = int(after[u64(base + n + k)])
            if head < n and f[u64(row + head)] < level:
                level = f[u64(row + head)]
        queue = 1
    state[2 + side] = level
    state[4 + side] = queue
    return cell if cell < n else -1


@kernel(out=("after", "before", "f", "step", "state", "path"), each=700)
def meet_even(
    free, stride, start, goal, budget, base, offset, via, across, dx, dy, cost, slope, slot, shift, queues,
    after, before, f, step, state, path, halt,
):  # fmt: skip
    """As :func:`meet`, on plain ground: with a queue for each raise of f instead of heaps.

    Parameters
    ----------
    free, stride, start, goal, budget, offset, via, across, dx, dy, cost, slope, slot, shift, queues : as for
        :func:`lampyris.kernels.graph.search.search`.
    base : what every f of this search is counted from: at least ``SPAN`` below that of the search before.
        A cell that has left M has it for f on either side.
    after, before : int32, (2 (n + queues),); scratch: one side, then the other.
    f : int64, (2 n,); base + 1 + g + h of the cells met; anything else is at least base + SPAN.
    step : int8, (2 n,); scratch.
    state : int64, (8,); see :func:`meet`.
    path : int32, (n,); the path, goal first.
    """
    n = len(free)
    major0 = slope[0]
    minor0 = slope[1]
    major1 = slope[2]
    minor1 = slope[3]
    unseen = base + SPAN
    zero = base + 1
    gate_y = start // stride
    gate_x = start - gate_y * stride
    far_y = goal // stride
    far_x = goal - far_y * stride
    for side in range(2):
        ends = side * (n + queues)
        for k in range(n, n + queues):
            after[ends + k] = k
            before[ends + k] = k
        cell = goal if side == 1 else start
        state[2 + side] = zero + _bound(major0, minor0, major1, minor1, gate_x - far_x, gate_y - far_y)
        state[4 + side] = 1
        state[6 + side] = 1
        f[side * n + cell] = state[2 + side]
        _link(after, before, ends, n, 0, cell)
    state[0] = 0 if start == goal else NEVER
    state[1] = start
    rows = 1.0 / stride
    expansions = 0
    ending = EXHAUSTED
    while True:
        side = 0 if state[6] <= state[7] else 1
        u = _first(after, f, n, queues, side, unseen, state)
        level = state[u64(2 + side)]
        if u < 0 or level - zero >= state[0]:
            break
        if expansions == budget or (expansions % LOOK == 0 and stopped(halt)):
            ending = LIMIT
            break
        expansions += 1
        other = 1 - side
        mine = side * n
        theirs = other * n
        ends = side * (n + queues)
        _unlink(after, before, ends, u)
        state[u64(6 + side)] -= 1
        if f[u64(theirs + u)] < unseen:
            _unlink(after, before, other * (n + queues), u)
            state[u64(6 + other)] -= 1
        f[u64(u)] = base
        f[u64(n + u)] = base
        to_x = far_x if side == 0 else gate_x
        to_y = far_y if side == 0 else gate_y
        from_x = gate_x if side == 0 else far_x
        from_y = gate_y if side == 0 else far_y
        y = int((u + 0.5) * rows)
        x = u - y * stride
        paid = level - _bound(major0, minor0, major1, minor1, x - to_x, y - to_y)
        if (
            paid
            - zero
            + state[u64(2 + other)]
            - zero
            - _bound(major0, minor0, major1, minor1, x - from_x, y - from_y)
            >= state[0]
        ):
            continue
        sign = 1 - 2 * side
        for k in range(len(offset)):
            v = u + sign * offset[u64(k)]
            # A step against its direction begins in v. Every cell that has left M has a lower f.
            tail = v if side == 1 else u
            if free[u64(v)] == 0 or f[u64(mine + v)] <= level:
                continue
            if free[u64(tail + via[u64(k)])] == 0 or free[u64(tail + across[u64(k)])] == 0:
                continue
            there_x = x + sign * dx[u64(k)]
            there_y = y + sign * dy[u64(k)]
            reached = (
                paid + cost[u64(k)] + _bound(major0, minor0, major1, minor1, there_x - to_x, there_y - to_y)
            )
            if f[u64(mine + v)] <= reached:
                continue
            if f[u64(mine + v)] < unseen:
                _unlink(after, before, ends, v)
            else:
                state[u64(6 + side)] += 1
            f[u64(mine + v)] = reached
            step[u64(mine + v)] = k
            _link(after, before, ends, n, slot[u64((reached - level) >> shift)], v)
            if f[u64(theirs + v)] < unseen:
                whole = paid + cost[u64(k)] - zero + f[u64(theirs + v)] - zero
                whole -= _bound(major0, minor0, major1, minor1, there_x - from_x, there_y - from_y)
                if whole < state[0]:
                    state[0] = whole
                    state[1] = v
    _finish(offset, start, goal, ending, expansions, step, n, state, path, halt)
