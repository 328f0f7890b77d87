"""The cheapest path of one robot that collides with none of the others: A* over safe intervals.

M. Phillips, M. Likhachev, "SIPP: safe interval path planning for dynamic environments", ICRA 2011. A state is a free cell and
an interval of ticks in which no robot is on it; only the earliest arrival in it matters. ``busy`` has a bit for each cell
and tick, words of WORD ticks a cell side by side, so that an interval is found by looking for a bit. The tables of paths
are those of :mod:`lampyris.kernels.fleet.space_time`; they are asked only where two robots might change places.
"""

from __future__ import annotations

from lampyris.kernels._helpers import highest, lowest
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.fleet.space_time import (
    BOUND,
    CELL,
    CLOSED,
    COST,
    EXPANDED,
    FOUND,
    HITS,
    NODE_WIDTH,
    NONE,
    PARENT,
    ROOM,
    TIME,
    _pop,
    _push,
)

WORD = 32


@kernel(out=("busy",))
def _mark(busy, at, t, on):
    bit = 1 << (t % WORD)
    old = int(busy[at]) & ~bit
    busy[at] = old | bit if on else old


@kernel(out=("busy",))
def occupy(where, last, horizon, busy, words, robot, on):
    """Set the bits of a robot's path, and of its last cell from then on, or clear them."""
    base = robot * horizon
    for t in range(last[robot] + 1):
        at = where[base + t] * words + t // WORD
        _mark(busy, at, t, on)
    at = where[base + last[robot]] * words
    for t in range(last[robot] + 1, words * WORD):
        _mark(busy, at + t // WORD, t, on)


@kernel()
def _next_busy(busy, words, cell, t, end):
    """The first tick from ``t`` on at which a robot is on a cell; beyond the tables if there is none up to ``end``."""
    row = cell * words
    w = t // WORD
    if w < words:
        bits = int(busy[row + w]) >> (t % WORD)
        if bits != 0:
            return t + int(lowest(u64(bits)))
        for k in range(w + 1, min(end // WORD + 1, words)):
            bits = int(busy[row + k])
            if bits != 0:
                return k * WORD + int(lowest(u64(bits)))
    return words * WORD


@kernel()
def _since(busy, words, cell, t):
    """The first tick of the free interval of a cell that holds ``t``."""
    row = cell * words
    w = min(t // WORD, words - 1)
    bits = int(busy[row + w])
    if t < words * WORD:
        bits &= (1 << (t - w * WORD)) - 1
    if bits != 0:
        return w * WORD + int(highest(u64(bits))) + 1
    for k in range(w - 1, -1, -1):
        bits = int(busy[row + k])
        if bits != 0:
            return k * WORD + int(highest(u64(bits))) + 1
    return 0


@kernel()
def _swaps(where, last, head, chain, horizon, u, v, t):
    """Whether a robot goes from ``v`` to ``u``, to arrive at tick ``t``."""
    r = head[v * horizon + t - 1]
    while r >= 0:
        if t <= last[r] and where[r * horizon + t] == u:
            return True
        r = chain[r * horizon + t - 1]
    return False


@kernel(out=("pool", "keys", "items", "seen", "found", "state"), of="found", each=50_000)
def find_free(
    edge, degree, table, base, start, goal, where, last, head, chain, horizon, busy, words, latest, most_states, pool, keys,
    items, seen, found, state, halt,
):  # fmt: skip
    """A cheapest path that collides with no other robot: FOUND, NONE, or ROOM (it would need more states).

    Parameters
    ----------
    edge .. goal, where .. horizon, pool .. items, found, state : see :func:`lampyris.kernels.fleet.space_time.find`.
    busy, words : uint32, (cells * words,); see above.
    latest : the greatest cost that is allowed; less than ``horizon``.
    most_states : states to expand before giving up (NONE).
    seen : int32, (cells * horizon,), -1; left as it was found.
    """
    room = len(pool) // NODE_WIDTH
    never = words * WORD
    ending = NONE
    earliest = int(_since(busy, words, goal, never))
    least = max(int(table[base + start]), earliest)
    made = 0
    waits = 0
    expanded = 0
    if least <= latest and _next_busy(busy, words, start, 0, 0) > 0:
        pool[CELL] = start
        pool[TIME] = 0
        pool[PARENT] = -1
        pool[HITS] = 0
        pool[CLOSED] = 0
        seen[start * horizon] = 0
        keys[0] = (least << 20) + horizon
        items[0] = 0
        made = 1
        waits = 1
    while waits > 0:
        i = int(items[0])
        f = keys[0] >> 20
        t = horizon - int(keys[0] & 1048575)
        _pop(keys, items, waits)
        waits -= 1
        at = i * NODE_WIDTH
        if pool[at + CLOSED] == 1 or t != pool[at + TIME]:
            continue
        pool[at + CLOSED] = 1
        u = int(pool[at + CELL])
        if u == goal and t >= earliest:
            state[COST] = t
            end = t
            while i >= 0:
                u = int(pool[i * NODE_WIDTH + CELL])
                for tick in range(int(pool[i * NODE_WIDTH + TIME]), end + 1):
                    found[tick] = u
                end = int(pool[i * NODE_WIDTH + TIME]) - 1
                i = int(pool[i * NODE_WIDTH + PARENT])
            ending = FOUND
            break
        expanded += 1
        if expanded >= most_states or (expanded % 256 == 0 and stopped(halt)):
            break
        until = int(_next_busy(busy, words, u, t, latest))  # it may leave to arrive at this tick, not later
        for k in range(degree[u]):
            v = int(edge[4 * u + k])
            far = int(table[base + v])
            most = min(until, latest - far)
            arrival = t + 1
            while arrival <= most:
                to = int(_next_busy(busy, words, v, arrival, most))
                if to == arrival:
                    arrival += 1
                    continue
                # The interval holds arrival to - 1; a robot can come from v to u at tick ``until`` alone.
                if arrival == until and _swaps(where, last, head, chain, horizon, u, v, arrival):
                    break
                slot = v * horizon + int(_since(busy, words, v, arrival))
                j = int(seen[slot])
                f = max(arrival + far, earliest)
                if j < 0 or pool[j * NODE_WIDTH + TIME] > arrival:
                    if made + 1 > room or waits + 1 > len(keys):
                        ending = ROOM
                        break
                    if j < 0:
                        j = made
                        made += 1
                        seen[slot] = j
                        pool[j * NODE_WIDTH + CELL] = v
                        pool[j * NODE_WIDTH + HITS] = slot - v * horizon
                    there = j * NODE_WIDTH
                    pool[there + TIME] = arrival
                    pool[there + PARENT] = i
                    pool[there + CLOSED] = 0
                    _push(keys, items, waits, (f << 20) + horizon - arrival, j)
                    waits += 1
                arrival = to + 1
            if ending == ROOM:
                break
        if ending == ROOM:
            break
    for i in range(made):
        at = i * NODE_WIDTH
        seen[pool[at + CELL] * horizon + pool[at + HITS]] = -1
    state[BOUND] = least
    state[EXPANDED] = expanded
    return ending
