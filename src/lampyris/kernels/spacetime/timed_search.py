"""Searching space and time: SIPP and space-time A* among obstacles whose places are known tick by tick.

Obstacles are given by what they forbid a point robot, cell by cell; only cells that something ever happens in
have a *slot*, all others are safe forever:

* ``begin[i], end[i]`` for i in ``first[s]:first[s + 1]`` are the safe intervals of slot s: the ticks, both
  included, at which the robot may stand there;
* ``ban[j]`` for j in ``barred[s]:barred[s + 1]``, ascending, are steps out of there that would swap places
  with an obstacle or cross it: ``tick * steps + k`` for step k that ends at that tick.

Both searches find the earliest arrival. Among states reached at the same tick the cheaper path is kept, and
among equal ``tick + steps to go`` the one with the least cost so far and to go is expanded first; so the path
is one of the earliest, and not needlessly long, though not always the cheapest of them.

Every step takes one tick (:mod:`lampyris.sim.grid.loop`), so the least number of steps to the goal on the bare map
is a consistent bound of the ticks that are left.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK, STRETCH
from lampyris.kernels._jit import PATH, kernel, stopped
from lampyris.kernels.heap import put, take

FOUND, EXHAUSTED, LIMIT, FULL = 0, 1, 2, 3

NEVER = 2**40
"""Later than any tick."""


@kernel(out=("steps", "queue"))
def steps_to_go(free, offset, via, across, goal, steps, queue, halt):
    """Least number of steps from each cell to the goal, by a breadth-first wave; how many cells it reached.

    Parameters
    ----------
    free : uint8, (n,), padded.
    offset, via, across : int64, (m,); where each step leads and the two cells it touches on its way.
    goal : flat index of a free cell.
    steps : int32, (n,); -1 where the goal cannot be reached.
    queue : int32, (n,); scratch.
    """
    for i in range(len(steps)):
        steps[i] = -1
    steps[goal] = 0
    queue[0] = goal
    head = 0
    tail = 1
    while head < tail:
        if head % STRETCH == 0 and stopped(halt):
            break
        u = queue[head]
        head += 1
        for k in range(len(offset)):
            v = u + offset[k]
            if free[v] != 0 and steps[v] < 0 and free[u + via[k]] != 0 and free[u + across[k]] != 0:
                steps[v] = steps[u] + 1
                queue[tail] = v
                tail += 1
    return tail


@kernel()
def _is_banned(ban, low, high, code):
    """Whether ``code`` is among the ascending ``ban[low:high]``."""
    stop = high
    while low < high:
        middle = (low + high) // 2
        if ban[middle] < code:
            low = middle + 1
        else:
            high = middle
    return low < stop and ban[low] == code


@kernel()
def _is_safe(begin, end, low, high, tick):
    """Whether a tick lies in one of the ascending intervals ``low:high``."""
    stop = high
    while low < high:
        middle = (low + high) // 2
        if end[middle] < tick:
            low = middle + 1
        else:
            high = middle
    return low < stop and begin[low] <= tick


@kernel(out=("arrive", "paid", "came", "done", "heap", "place", "key", "tie", "result"))
def sipp(
    free, offset, via, across, price, toll, steps, rest, slot, first, begin, end, owner, barred, ban,
    start, goal, tick, stay, horizon, budget,
    arrive, paid, came, done, heap, place, key, tie, result, halt,
):  # fmt: skip
    """Safe interval path planning (Phillips and Likhachev, ICRA 2011): the earliest arrival at the goal.

    A state is a cell and one of its safe intervals, and of all paths into it only the earliest matters: who
    comes earlier can wait. States are the cells without a slot, then the intervals, and last the start.

    Parameters
    ----------
    free, offset, via, across : as for :func:`steps_to_go`.
    price, toll : int64, (m,) and (n,); a step of kind k into a cell costs ``price[k] * toll[cell]``.
    steps, rest : int32 and int64, (n,); steps and cost from each cell to the goal on the bare map.
    slot : int32, (n,); -1 for none. ``first`` .. ``ban``: see above; ``owner``: the cell of each interval.
    start, goal, tick : where the robot is, where it goes, and when it is there.
    stay : the last tick at which it may still stand on the start.
    horizon : arrivals after this tick are not considered; NEVER: all are.
    budget : most states to expand, -1 for no limit.
    arrive, paid, came, done : int64, int64, int32, uint8, (states,); ``arrive`` NEVER and ``done`` 0 to begin
        with.
    heap, place, key, tie : the open list (:mod:`lampyris.kernels.heap`), empty; ``heap`` has one place more than there are
        states. :func:`clean` makes them and the above as they were.
    result : int64, (5,) or more: ending, states expanded, the state that is the goal, whether ``horizon`` cut a path, cells of
        the path (0: none was found). The cells and when each is entered are then the first of ``key`` and ``tie``.
    """
    n = len(free)
    root = len(arrive) - 1
    arrive[root] = tick
    paid[root] = 0
    came[root] = -1
    key[root] = tick + steps[start]
    tie[root] = rest[start]
    put(heap, place, key, tie, root)
    expansions = 0
    ending = EXHAUSTED
    cut = 0
    final = -1
    while heap[0] > 0:
        node = heap[1]
        if node == root:
            u = start
            leave = stay
        elif node < n:
            u = node
            leave = NEVER
        else:
            u = owner[node - n]
            leave = end[node - n]
        if u == goal:
            ending = FOUND
            final = node
            break
        if expansions == budget or (expansions % LOOK == 0 and stopped(halt)):
            ending = LIMIT
            break
        expansions += 1
        take(heap, place, key, tie, node)
        done[node] = 1
        heap[len(heap) - expansions] = node  # behind the list, which has room for all states
        s = slot[u]
        bans = barred[s] if s >= 0 else 0
        bans_end = barred[s + 1] if s >= 0 else 0
        soon = arrive[node] + 1
        for k in range(len(offset)):
            v = u + offset[k]
            if free[v] == 0 or free[u + via[k]] == 0 or free[u + across[k]] == 0:
                continue
            w = slot[v]
            i = first[w] if w >= 0 else 0
            stop = first[w + 1] if w >= 0 else 1
            if w >= 0:
                while i < stop and end[i] < soon:
                    i += 1
            while i < stop:
                t = soon
                last = leave + 1
                state = v
                if w >= 0:
                    if begin[i] > last:
                        break  # and so do all later ones
                    t = max(t, begin[i])
                    last = min(last, end[i])
                    state = n + i
                i += 1
                while bans < bans_end and t <= last and _is_banned(ban, bans, bans_end, t * len(offset) + k):
                    t += 1
                if t > last or done[state] != 0:
                    continue
                if t > horizon:
                    cut = 1
                    continue
                cost = paid[node] + price[k] * toll[v]
                if t < arrive[state] or (t == arrive[state] and cost < paid[state]):
                    arrive[state] = t
                    paid[state] = cost
                    came[state] = node
                    key[state] = t + steps[v]
                    tie[state] = cost + rest[v]
                    put(heap, place, key, tie, state)
    result[0] = ending
    result[1] = expansions
    result[2] = final
    result[3] = cut
    cells = 0
    node = final
    while node >= 0:
        cells += 1
        node = came[node]
    result[4] = cells
    # The keys have been compared for the last time.
    node = final
    for k in range(cells - 1, -1, -1):
        if node == root:
            key[k] = start
        elif node < n:
            key[k] = node
        else:
            key[k] = owner[node - n]
        tie[k] = arrive[node]
        node = came[node]


def _clean_at_once(arrive, done, heap, place, expansions):
    """:func:`clean` by operations on whole arrays."""
    waiting, expanded = heap[1 : heap[0] + 1], heap[len(heap) - expansions :]
    arrive[waiting] = NEVER
    place[waiting] = 0
    arrive[expanded] = NEVER
    done[expanded] = 0
    heap[0] = 0


@kernel(out=("arrive", "done", "heap", "place"), of=PATH, arrays=_clean_at_once)
def clean(arrive, done, heap, place, expansions):
    """Make the room of :func:`sipp` as it was, state by state that the search has come upon; ``expansions``: how many it
    expanded."""
    for k in range(1, heap[0] + 1):
        arrive[heap[k]] = NEVER
        place[heap[k]] = 0
    for k in range(len(heap) - expansions, len(heap)):
        arrive[heap[k]] = NEVER
        done[heap[k]] = 0
    heap[0] = 0


@kernel(out=("table", "cell", "arrive", "paid", "came", "done", "heap", "place", "key", "tie", "result"))
def space_time(
    free, offset, via, across, price, toll, steps, rest, slot, first, begin, end, barred, ban,
    start, goal, tick, still, horizon, budget,
    table, cell, arrive, paid, came, done, heap, place, key, tie, result, halt,
):  # fmt: skip
    """A* over cells and ticks (Silver, AIIDE 2005, for one robot): the earliest arrival at the goal.

    Where nothing changes any more, after the tick ``still``, cells alone are states: waiting is no use there
    and who comes first is best.

    Parameters
    ----------
    free .. ban, start, goal, tick, horizon, budget : as for :func:`sipp`.
    still : the last tick at which anything changes; NEVER if that never ends.
    table : int32, a power of two; -1 everywhere. A hash table of states, probed in a line.
    cell, arrive, paid, came, done : int32, int64, int64, int32, uint8, at most half as many; the states.
    heap, place, key, tie : the open list, empty; it is left as it is in the end.
    result : as for :func:`sipp`; the ending FULL says that there was no room for all states.
    """
    n = len(free)
    mask = len(table) - 1
    room = len(cell) - 1
    plane = min(tick, still + 1)
    code = plane * n + start
    table[(code * 2654435761) & mask] = 0
    cell[0] = start
    arrive[0] = tick
    paid[0] = 0
    came[0] = -1
    key[0] = tick + steps[start]
    tie[0] = rest[start]
    put(heap, place, key, tie, 0)
    states = 1
    expansions = 0
    ending = EXHAUSTED
    cut = 0
    final = -1
    while heap[0] > 0:
        node = heap[1]
        u = cell[node]
        if u == goal:
            ending = FOUND
            final = node
            break
        if expansions == budget or (expansions % LOOK == 0 and stopped(halt)):
            ending = LIMIT
            break
        if states + len(offset) + 1 > room:
            ending = FULL
            break
        expansions += 1
        take(heap, place, key, tie, node)
        done[node] = 1
        t = arrive[node] + 1
        if t > horizon:
            cut = 1
            continue
        plane = min(t, still + 1)
        s = slot[u]
        for k in range(len(offset) + 1):
            v = u
            cost = paid[node]
            if k < len(offset):
                v = u + offset[k]
                if free[v] == 0 or free[u + via[k]] == 0 or free[u + across[k]] == 0:
                    continue
                if s >= 0 and _is_banned(ban, barred[s], barred[s + 1], t * len(offset) + k):
                    continue
                cost += price[k] * toll[v]
            elif t > still:
                continue
            w = slot[v]
            if w >= 0 and not _is_safe(begin, end, first[w], first[w + 1], t):
                continue
            code = plane * n + v
            at = (code * 2654435761) & mask
            state = table[at]
            while state >= 0 and (cell[state] != v or min(arrive[state], still + 1) != plane):
                at = (at + 1) & mask
                state = table[at]
            if state < 0:
                state = states
                states += 1
                table[at] = state
                cell[state] = v
            elif done[state] != 0 or arrive[state] < t or (arrive[state] == t and paid[state] <= cost):
                continue
            arrive[state] = t
            paid[state] = cost
            came[state] = node
            key[state] = t + steps[v]
            tie[state] = cost + rest[v]
            put(heap, place, key, tie, state)
    result[0] = ending
    result[1] = expansions
    result[2] = final
    result[3] = cut
