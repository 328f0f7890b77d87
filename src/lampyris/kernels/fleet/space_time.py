"""Paths of one robot in space and time: among forbidden and demanded cells, and beside the paths of other robots.

The low level of conflict-based search. A state is a free cell at a tick. The open list
is that of focal search (J. Pearl, J. Kim 1982; for robots: M. Barer, G. Sharon, R. Stern, A. Felner, SoCS 2014): of the
states whose estimate is at most ``weight`` times the least estimate, the one with the fewest conflicts with other robots
is expanded. With weight 1 that is A* with conflicts as the tie-break. The estimate is exact on the bare map.

Paths of other robots are in tables: ``head``, (cells * horizon,), has the first robot on each cell at each tick, ``chain`` the
next one on the same cell for each robot and tick. All ticks of a cell are side by side, as a search that goes on from a cell
asks for few of them. After its last tick a robot is in ``settled`` instead. ``where`` has the cells of each robot tick by
tick; it and ``chain`` are (robots * horizon,).

From the tick on at which nothing changes any more, the first visit to a cell is the only one worth having, so that a
search without a path ends.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped
from lampyris.kernels.fleet.steps import beside

FOUND, NONE, HORIZON, ROOM = 0, 1, 2, 3

CELL, TIME, PARENT, HITS, LINK, CLOSED, NODE_WIDTH = range(7)
NOT_AT, NOT_STEP, MUST_AT, LONGER, AT_MOST, NOT_FROM = range(6)
ROW = 4
"""Of a constraint: its kind, cell, cell that a step leads to, tick (of the arrival)."""
COST, BOUND, EXPANDED, STATE_WIDTH = range(4)
VERTEX, SWAP, PASSES, IS_PASSED, CROSSING = range(5)
CONFLICT_WIDTH = 7
"""Of a conflict: its kind, the other robot, the cell, the cell that a step leads to, tick (of the arrival), and the cells of the
other robot's step."""
WAIT = 8
"""In place of the number of an edge."""
LATE = 1 << 30


@kernel(out=("head", "chain", "settled"))
def put(where, last, head, chain, settled, horizon, robot):
    """Enter a robot's path, which is in ``where`` and ``last``, into the tables."""
    base = robot * horizon
    for t in range(last[robot] + 1):
        at = where[base + t] * horizon + t
        chain[base + t] = head[at]
        head[at] = robot
    settled[where[base + last[robot]]] = robot


@kernel(out=("head", "chain", "settled"))
def take(where, last, head, chain, settled, horizon, robot):
    """Remove a robot's path from the tables."""
    base = robot * horizon
    for t in range(last[robot] + 1):
        at = where[base + t] * horizon + t
        r = head[at]
        if r == robot:
            head[at] = chain[base + t]
        else:
            while chain[r * horizon + t] != robot:
                r = chain[r * horizon + t]
            chain[r * horizon + t] = chain[base + t]
    settled[where[base + last[robot]]] = -1


@kernel()
def _hits(edge, wide, where, last, head, chain, settled, horizon, u, v, t):
    """How many robots collide with a step from ``u`` at tick ``t`` to ``v``, or a wait if they are equal."""
    n = 0
    r = head[v * horizon + t + 1]
    while r >= 0:
        n += 1
        r = chain[r * horizon + t + 1]
    r = settled[v]
    if r >= 0 and t + 1 > last[r]:
        n += 1
    if u != v:
        r = head[v * horizon + t]
        while r >= 0:
            if t < last[r] and where[r * horizon + t + 1] == u:
                n += 1
            r = chain[r * horizon + t]
        one = beside(edge, wide, u, v)
        if one >= 0:
            two = v - (one - u)
            for _ in range(2):
                r = head[one * horizon + t]
                while r >= 0:
                    if t < last[r] and where[r * horizon + t + 1] == two:
                        n += 1
                    r = chain[r * horizon + t]
                one, two = two, one
    return n


@kernel(out=("keys", "items"))
def _push(keys, items, n, key, item):
    """Add to a binary heap of ``n`` items."""
    i = n
    while i > 0:
        up = (i - 1) >> 1
        if keys[up] <= key:
            break
        keys[i] = keys[up]
        items[i] = items[up]
        i = up
    keys[i] = key
    items[i] = item


@kernel(out=("keys", "items"))
def _pop(keys, items, n):
    """Remove the first of ``n`` items, which the caller has read; ``n`` - 1 are left."""
    m = n - 1
    key = keys[m]
    item = items[m]
    i = 0
    while True:
        child = 2 * i + 1
        if child >= m:
            break
        if child + 1 < m and keys[child + 1] < keys[child]:
            child += 1
        if keys[child] >= key:
            break
        keys[i] = keys[child]
        items[i] = items[child]
        i = child
    keys[i] = key
    items[i] = item


@kernel(out=("keys", "items"))
def _admit(pool, keys, items, n, i, f, horizon):
    """Add the open states of a list, from state ``i`` on, to the heap of ``n`` focal ones; how many there are then."""
    while i >= 0:
        at = i * NODE_WIDTH
        if pool[at + CLOSED] == 0:
            _push(keys, items, n, ((int(pool[at + HITS]) << 20) + f << 20) + horizon - pool[at + TIME], i)
            n += 1
        i = pool[at + LINK]
    return n


@kernel()
def _allowed(barred, since, must, xy, wide, horizon, last_must, u, k, v, t):
    """Whether constraints allow the step from ``u`` over its edge ``k`` (or WAIT) to ``v`` at tick ``t``."""
    if barred[v * horizon + t] & 1 or since[v] <= t:
        return False
    if k < WAIT and barred[u * horizon + t] & (2 << k):
        return False
    if t <= last_must:
        there = must[2 * t]
        left = must[2 * t + 1] - t
        dx = xy[2 * there] - xy[2 * v]
        dy = xy[2 * there + 1] - xy[2 * v + 1]
        if (abs(dx) + abs(dy) if wide == 4 else max(abs(dx), abs(dy))) > left:
            return False
    return True


@kernel(out=("barred", "since", "must"))
def _constrain(edge, degree, rows, count, horizon, barred, since, must, on):
    """Enter the constraints into the tables, or remove them; the last tick at which a cell is demanded, or -1.

    ``must[2 * t:]`` are the next cell that is demanded from tick t on, and its tick.
    """
    last_must = -1
    wide = len(edge) // len(degree)
    for i in range(0, count * ROW, ROW):
        kind = rows[i]
        u = rows[i + 1]
        t = rows[i + 3]
        if kind == NOT_AT:
            barred[u * horizon + t] = (barred[u * horizon + t] & 1022) | on
        elif kind == NOT_STEP:
            for k in range(degree[u]):
                if edge[wide * u + k] == rows[i + 2]:
                    bit = 2 << k
                    barred[u * horizon + t] = (barred[u * horizon + t] & (1023 - bit)) | (bit * on)
        elif kind == NOT_FROM:
            since[u] = min(since[u], t) if on else LATE
        elif kind == MUST_AT:
            last_must = max(last_must, t)
    if on and last_must >= 0:
        for t in range(last_must + 1):
            must[2 * t + 1] = -1
        for i in range(0, count * ROW, ROW):
            if rows[i] == MUST_AT:
                t = rows[i + 3]
                if must[2 * t + 1] >= 0 and must[2 * t] != rows[i + 1]:
                    return -2  # two cells at once
                must[2 * t] = rows[i + 1]
                must[2 * t + 1] = t
        for t in range(last_must - 1, -1, -1):
            if must[2 * t + 1] < 0:
                must[2 * t] = must[2 * t + 2]
                must[2 * t + 1] = must[2 * t + 3]
    return last_must


@kernel(out=("pool", "seen", "single"))
def _levels(
    edge, degree, xy, table, base, start, goal, barred, since, must, last_must, horizon, cost, pool, room, seen, single
):  # fmt: skip
    """The cells that all paths of this cost share: ``single[t]``, or -1; whether there is a path of this cost.

    The levels of the multi-valued decision diagram (G. Sharon, R. Stern, M. Goldenberg, A. Felner 2013), forwards, and then
    backwards without what leads nowhere.
    """
    wide = len(edge) // len(degree)
    for t in range(cost + 1):
        single[t] = -1
    pool[CELL] = start
    pool[TIME] = 0
    pool[CLOSED] = 0
    made = 1
    done = 0
    fits = True
    while done < made:
        at = done * NODE_WIDTH
        u = pool[at + CELL]
        t = pool[at + TIME] + 1
        done += 1
        if t > cost:
            continue
        if made + 10 > room:
            fits = False
            break
        n = degree[u]
        for k in range(n + 1):
            v = edge[wide * u + k] if k < n else u
            if t + table[base + v] > cost or seen[v * horizon + t] >= 0:
                continue
            if not _allowed(barred, since, must, xy, wide, horizon, last_must, u, k if k < n else WAIT, v, t):
                continue
            seen[v * horizon + t] = made
            pool[made * NODE_WIDTH + CELL] = v
            pool[made * NODE_WIDTH + TIME] = t
            pool[made * NODE_WIDTH + CLOSED] = 0
            made += 1
    reached = not fits
    if fits:
        for i in range(made - 1, -1, -1):
            at = i * NODE_WIDTH
            u = pool[at + CELL]
            t = pool[at + TIME]
            alive = t == cost and u == goal
            if t < cost:
                n = degree[u]
                for k in range(n + 1):
                    v = edge[wide * u + k] if k < n else u
                    j = seen[v * horizon + t + 1]
                    if (
                        j >= 0
                        and pool[j * NODE_WIDTH + CLOSED] == 1
                        and _allowed(
                            barred,
                            since,
                            must,
                            xy,
                            wide,
                            horizon,
                            last_must,
                            u,
                            k if k < n else WAIT,
                            v,
                            t + 1,
                        )
                    ):
                        alive = True
                        break
            if alive:
                pool[at + CLOSED] = 1
                single[t] = u if single[t] == -1 else -2
        reached = pool[CLOSED] == 1
        for t in range(cost + 1):
            single[t] = max(single[t], -1)
    for i in range(1, made):
        seen[pool[i * NODE_WIDTH + CELL] * horizon + pool[i * NODE_WIDTH + TIME]] = -1
    return reached


@kernel(
    out=(
        "barred", "since", "must", "pool", "keys", "items", "bucket", "waiting", "seen", "found", "single", "state",
    ),
    of="found",
    each=50_000,
)  # fmt: skip
def find(
    edge, degree, xy, table, base, start, goal, rows, count, where, last, head, chain, settled, horizon, longest,
    weight, barred, since, must, pool, keys, items, bucket, waiting, seen, found, single, state,
    halt,
):  # fmt: skip
    """A path of one robot: FOUND, or NONE, HORIZON (it would need more ticks), ROOM (more states).

    Parameters
    ----------
    edge, degree, table : see :mod:`.distances`; ``base`` is where the robot's row begins.
    xy : int32, (2 * cells,); the place of each cell.
    start, goal : cells.
    rows, count : int32; constraints, ROW numbers each.
    where .. settled : the other robots; see above. The robot itself is not among them.
    horizon : ticks of the tables.
    longest : the last tick at which another robot comes to its goal.
    weight : how many times the least estimate an estimate may be, >= 1.
    barred : uint16, (cells * horizon,), zeros. ``since`` : int32, (cells,), LATE. Both are left as they were found.
    must : int32, (2 * horizon,); scratch.
    pool, keys, items : int32, (states * NODE_WIDTH,); int64 and int32, (2 * states,); scratch.
    bucket, waiting : int32, (2 * horizon + 2,) each; scratch: how many open states have each estimate, and those that are
        not focal yet.
    seen : int32, (cells * horizon,), -1; left as it was found.
    found : int32, (horizon,); the result.
    single : int32, (horizon,); for each tick up to the bound the only cell of all cheapest paths, or -1.
    state : int64, (STATE_WIDTH,); the result's cost, the lower bound, states expanded.
    """
    room = len(pool) // NODE_WIDTH
    wide = len(edge) // len(degree)
    ending = NONE
    static = longest
    earliest = 0
    latest = LATE
    for i in range(0, count * ROW, ROW):
        kind = rows[i]
        u = rows[i + 1]
        t = rows[i + 3]
        static = max(static, t)
        if kind == LONGER or (kind == NOT_AT and u == goal):
            earliest = max(earliest, t + 1)
        elif kind == MUST_AT and u != goal:
            earliest = max(earliest, t + int(table[base + u]))
        elif kind == AT_MOST:
            latest = min(latest, t)
    static = max(static, earliest) + 1
    if static >= horizon:
        return HORIZON
    last_must = _constrain(edge, degree, rows, count, horizon, barred, since, must, 1)
    least = max(int(table[base + start]), earliest)
    origin = least
    focal = int(weight * least + 1e-9)
    made = 0
    waits = 0
    expanded = 0
    if last_must > -2 and least <= latest:
        for f in range(len(bucket)):
            bucket[f] = 0
            waiting[f] = -1
        pool[CELL] = start
        pool[TIME] = 0
        pool[PARENT] = -1
        pool[HITS] = 0
        pool[CLOSED] = 0
        made = 1
        seen[start * horizon] = 0
        bucket[0] = 1
        keys[0] = 0
        items[0] = 0
        waits = 1
        opened = 1
        while opened > 0:
            # The least estimate, and what it lets become focal.
            while bucket[least - origin] == 0:
                least += 1
            bound = int(weight * least + 1e-9)
            while focal < bound:
                focal += 1
                i = waiting[focal - origin] if focal - origin < len(waiting) else -1
                waits = _admit(pool, keys, items, waits, i, focal, horizon)
            i = items[0]
            hits = keys[0] >> 40
            _pop(keys, items, waits)
            waits -= 1
            at = i * NODE_WIDTH
            if pool[at + CLOSED] == 1 or hits != pool[at + HITS]:
                continue
            pool[at + CLOSED] = 1
            u = pool[at + CELL]
            t = pool[at + TIME]
            opened -= 1
            bucket[max(t + int(table[base + u]), earliest) - origin] -= 1
            if u == goal and t >= earliest:
                state[COST] = t
                while i >= 0:
                    found[pool[i * NODE_WIDTH + TIME]] = pool[i * NODE_WIDTH + CELL]
                    i = pool[i * NODE_WIDTH + PARENT]
                ending = FOUND
                break
            expanded += 1
            if expanded % 256 == 0 and stopped(halt):
                break
            t += 1
            if t > latest:
                continue
            if t >= horizon - 1:
                ending = HORIZON
                break
            if made + 10 > room or waits + 11 > len(keys):
                ending = ROOM
                break
            n = degree[u]
            for k in range(n + 1):
                v = edge[wide * u + k] if k < n else u
                f = max(t + int(table[base + v]), earliest)
                if f > latest:
                    continue
                if count > 0 and not _allowed(
                    barred, since, must, xy, wide, horizon, last_must, u, k if k < n else WAIT, v, t
                ):
                    continue
                hits = _hits(edge, wide, where, last, head, chain, settled, horizon, u, v, t - 1)
                hits += pool[at + HITS]
                if v == goal and t >= earliest:
                    for later in range(t + 1, longest + 1):
                        if head[goal * horizon + later] >= 0:
                            hits += 1
                hits = min(hits, 4095)
                slot = v * horizon + min(t, static)
                j = seen[slot]
                if j >= 0:
                    there = j * NODE_WIDTH
                    if pool[there + TIME] == t:
                        if pool[there + CLOSED] == 1 or pool[there + HITS] <= hits:
                            continue
                        pool[there + HITS] = hits
                        pool[there + PARENT] = i
                        if f <= focal:
                            _push(keys, items, waits, (((hits << 20) + f) << 20) + horizon - t, j)
                            waits += 1
                        continue
                    if pool[there + TIME] < t:
                        continue
                    if pool[there + CLOSED] == 0:  # later: of no use any more
                        pool[there + CLOSED] = 1
                        opened -= 1
                        bucket[max(pool[there + TIME] + int(table[base + v]), earliest) - origin] -= 1
                j = made
                made += 1
                seen[slot] = j
                there = j * NODE_WIDTH
                pool[there + CELL] = v
                pool[there + TIME] = t
                pool[there + PARENT] = i
                pool[there + HITS] = hits
                pool[there + CLOSED] = 0
                opened += 1
                bucket[f - origin] += 1
                if f <= focal:
                    _push(keys, items, waits, (((hits << 20) + f) << 20) + horizon - t, j)
                    waits += 1
                else:
                    pool[there + LINK] = waiting[f - origin]
                    waiting[f - origin] = j
        for i in range(made):
            at = i * NODE_WIDTH
            seen[pool[at + CELL] * horizon + min(int(pool[at + TIME]), static)] = -1
    state[BOUND] = least
    state[EXPANDED] = expanded
    if ending == FOUND:
        while not _levels(
            edge, degree, xy, table, base, start, goal, barred, since, must, last_must, horizon, least, pool, room, seen,
            single,
        ):  # fmt: skip
            least += 1
        state[BOUND] = least
    _constrain(edge, degree, rows, count, horizon, barred, since, must, 0)
    return ending


@kernel(out=("listed",))
def _note(listed, n, kind, other, u, v, tick, p, q):
    """Write a conflict, the ``n``-th."""
    at = n * CONFLICT_WIDTH
    listed[at] = kind
    listed[at + 1] = other
    listed[at + 2] = u
    listed[at + 3] = v
    listed[at + 4] = tick
    listed[at + 5] = p
    listed[at + 6] = q


@kernel(out=("listed",), of="last", each=20_000)
def conflicts(edge, wide, where, last, head, chain, settled, horizon, longest, robot, listed):
    """List the conflicts of a robot with all others, its own path in the tables; how many, or -1: no room.

    Of conflicts of one robot that stands on its goal, and one that passes there, only the first is listed.
    """
    base = robot * horizon
    end = last[robot]
    n = 0
    for t in range(longest + 1):
        if (n + 8) * CONFLICT_WIDTH > len(listed):
            return -1
        u = where[base + min(t, end)]
        first = n
        r = head[u * horizon + t]
        while r >= 0:
            if r != robot:
                if (n + 8) * CONFLICT_WIDTH > len(listed):
                    return -1
                kind = VERTEX
                if t >= end:
                    kind = IS_PASSED
                elif t == last[r]:
                    kind = PASSES
                _note(listed, n, kind, r, u, u, t, u, u)
                n += 1
            r = chain[r * horizon + t]
        r = settled[u]
        if r >= 0 and r != robot and t > last[r]:
            _note(listed, n, PASSES, r, u, u, t, u, u)
            n += 1
        if 0 < t <= end and where[base + t - 1] != u:
            back = where[base + t - 1]
            r = head[u * horizon + t - 1]
            while r >= 0:
                if t <= last[r] and where[r * horizon + t] == back:
                    if (n + 8) * CONFLICT_WIDTH > len(listed):
                        return -1
                    _note(listed, n, SWAP, r, back, u, t, u, back)
                    n += 1
                r = chain[r * horizon + t - 1]
            one = beside(edge, wide, back, u)
            if one >= 0:
                two = u - (one - back)
                for _ in range(2):
                    r = head[one * horizon + t - 1]
                    while r >= 0:
                        if t <= last[r] and where[r * horizon + t] == two:
                            if (n + 8) * CONFLICT_WIDTH > len(listed):
                                return -1
                            _note(listed, n, CROSSING, r, back, u, t, one, two)
                            n += 1
                        r = chain[r * horizon + t - 1]
                    one, two = two, one
        # Of those at a goal, leave out what is listed already.
        k = first
        while k < n:
            at = k * CONFLICT_WIDTH
            known = False
            if listed[at] == PASSES or listed[at] == IS_PASSED:
                for j in range(0, first * CONFLICT_WIDTH, CONFLICT_WIDTH):
                    if listed[j] == listed[at] and listed[j + 1] == listed[at + 1]:
                        known = True
                        break
            if known:
                n -= 1
                for j in range(CONFLICT_WIDTH):
                    listed[at + j] = listed[n * CONFLICT_WIDTH + j]
            else:
                k += 1
    return n
