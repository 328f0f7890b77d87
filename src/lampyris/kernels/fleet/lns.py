"""Large neighbourhood search: a few robots' paths are taken away and planned again, as long as that costs no more.

J. Li, Z. Chen, D. Harabor, P. Stuckey, S. Koenig, "Anytime multi-agent path finding via large neighborhood search", IJCAI
2021; written from the paper. Each robot is planned over cells and safe intervals, with the distance tables as estimates, among
all other robots' paths. Ours: buckets of a stack each as the open list, and neighbourhoods of random size.

No path gets longer than the makespan that the search began with, so that all that is held fits in a table of cells
and ticks, ``held``. ``busy`` has the same as bits, so that intervals are found 64 ticks at a time. What is written is whole after
every neighbourhood: a search that was stopped left a plan without conflicts.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, lowest, stopped, u64
from lampyris.kernels.fleet.pibt import drawn
from lampyris.kernels.fleet.steps import beside

ROUNDS, COST, STATES, FALLS = range(4)


@kernel(out=("held", "busy"))
def hold(held, busy, path, row, span, robot):
    """Write a robot (or -1) to all that it is on in the ``span`` ticks of ``path[row:]``."""
    words = span // 64 + 1
    for t in range(span):
        u = path[row + t]
        held[u * span + t] = robot
        k = u * words + (t >> 6)
        one = u64(1) << u64(t & 63)
        busy[k] |= one
        if robot < 0:
            busy[k] ^= one


@kernel()
def _next_busy(busy, base, at):
    """The first tick from ``at`` on at which a cell is taken, or the one behind the last; its bits begin at ``busy[base]``."""
    k = base + (at >> 6)
    word = busy[k] >> u64(at & 63)
    if word != u64(0):
        return at + int(lowest(word))
    at = (at | 63) + 1
    k += 1
    while busy[k] == u64(0):
        at += 64
        k += 1
    return at + int(lowest(busy[k]))


@kernel()
def _next_free(busy, base, words, at):
    """The first tick from ``at`` on at which a cell is free; one behind the last if there is none."""
    k = base + (at >> 6)
    while k < base + words:
        word = (busy[k] ^ u64(0xFFFF_FFFF_FFFF_FFFF)) >> u64(at & 63)
        if word != u64(0):
            return at + int(lowest(word))
        at = (at | 63) + 1
        k += 1
    return at


@kernel()
def _collides(held, span, u, v, t, one):
    """Whether a step from ``u`` to ``v`` that ends at tick ``t`` is a swap with another robot, or crosses one."""
    other = held[v * span + t - 1]
    if other >= 0 and held[u * span + t] == other:
        return True
    if one >= 0:
        two = v - (one - u)
        other = held[one * span + t - 1]
        if other >= 0 and held[two * span + t] == other:
            return True
        other = held[two * span + t - 1]
        if other >= 0 and held[one * span + t] == other:
            return True
    return False


@kernel(
    out=(
        "state_cell", "state_tick", "state_end", "state_from", "state_next", "bucket", "mark", "marked", "count",
    )
)  # fmt: skip
def _find(
    edge, degree, table, held, busy, start, goal, robot, span, limit, state_cell, state_tick, state_end, state_from,
    state_next, bucket, mark, marked, stamp, shift, haste, count,
):  # fmt: skip
    """The state that is the earliest arrival at the goal permanently, at tick ``limit`` at the latest, or -1.

    Safe interval path planning (M. Phillips, M. Likhachev, ICRA 2011): a state is a cell and an interval in which nobody else is
    there, with the earliest arrival. ``bucket[f]`` is the stack of those whose path arrives at tick f at the earliest.
    States are found again by a hash table of cells and ends of intervals: ``marked[h]`` is one of this search if ``mark[h]`` is
    its ``stamp``. ``haste`` : eighths by which distances weigh more; with 0 the arrival is the earliest, with more the search
    is quicker. Of a state that was improved the end is -1.
    """
    cells = len(degree)
    wide = len(edge) // cells
    words = span // 64 + 1
    row = robot * cells
    since = span
    while since > 0 and held[goal * span + since - 1] < 0:
        since -= 1
    first = max(int(table[row + start]), since)
    if first > limit:
        return -1
    highest = limit + (limit * haste >> 3)
    for f in range(first, highest + 1):
        bucket[f] = -1
    mask = len(mark) - 1
    state_cell[0] = start
    state_tick[0] = 0
    state_end[0] = _next_busy(busy, start * words, 0) - 1
    state_from[0] = -1
    state_next[0] = -1
    f = first + (int(table[row + start]) * haste >> 3)
    bucket[f] = 0
    states = 1
    while f <= highest:
        s = int(bucket[f])
        if s < 0:
            f += 1
            continue
        bucket[f] = state_next[s]
        end = int(state_end[s])
        if end < 0:
            continue
        t = int(state_tick[s])
        u = int(state_cell[s])
        if u == goal and end == span - 1:
            count[STATES] += states
            return s
        n = int(degree[u])
        for k in range(n):
            # The last one is tried first.
            v = int(edge[wide * u + (k + shift) % n])
            far = int(table[row + v])
            most = min(end + 1, limit - far)
            one = beside(edge, wide, u, v)
            a = t + 1
            while a <= most:
                a = _next_free(busy, v * words, words, a)
                if a > most:
                    break
                last = _next_busy(busy, v * words, a) - 1
                latest = min(last, most)
                if one < 0:
                    # A swap: only where both cells change hands.
                    if a > end and _collides(held, span, u, v, a, one):
                        break
                else:
                    while a <= latest and _collides(held, span, u, v, a, one):
                        a += 1
                if a <= latest:
                    h = ((v * 2654435761 + last * 40503) >> 7) & mask
                    known = -1
                    while mark[h] == stamp:
                        i = marked[h]
                        if state_cell[i] == v and state_end[i] == last:
                            known = int(i)
                            break
                        h = (h + 1) & mask
                    if known < 0 or state_tick[known] > a:
                        if states >= len(state_cell):
                            count[STATES] += states
                            return -1
                        if known >= 0:
                            state_end[known] = -1
                        mark[h] = stamp
                        marked[h] = states
                        value = max(a + far, since) + (far * haste >> 3)
                        f = min(f, value)
                        state_cell[states] = v
                        state_tick[states] = a
                        state_end[states] = last
                        state_from[states] = s
                        state_next[states] = bucket[value]
                        bucket[value] = states
                        states += 1
                a = last + 2
    count[STATES] += states
    return -1


@kernel(out=("member", "random", "chosen"))
def _choose(edge, degree, table, held, path, length, span, distance, member, random, chosen, size):
    """Write a neighbourhood to ``member``; how many robots it has.

    The late robot of a few that are drawn, and those that are in its way: they are met by walks from places of its path
    towards its goal on which it would come earlier. One time in four the others are drawn at random.
    """
    robots = len(length)
    cells = len(degree)
    wide = len(edge) // cells
    seed = -1
    for _ in range(6):
        random[0] = drawn(random[0])
        i = random[0] % robots
        if length[i] > distance[i] and (seed < 0 or length[i] - distance[i] > length[seed] - distance[seed]):
            seed = i
    if seed < 0:
        random[0] = drawn(random[0])
        seed = random[0] % robots
    member[0] = seed
    chosen[seed] = 1
    count = 1
    random[0] = drawn(random[0])
    walks = 0 if random[0] % 4 == 0 else 8
    while walks > 0 and count < size and length[seed] > 0:
        walks -= 1
        random[0] = drawn(random[0])
        t = int(random[0] % int(length[seed]))
        u = int(path[seed * span + t])
        while t + 1 < span and count < size:
            random[0] = drawn(random[0])
            n = int(degree[u])
            shift = random[0] % n if n > 0 else 0
            ahead = -1
            for k in range(n):
                v = int(edge[wide * u + (k + shift) % n])
                if t + 1 + int(table[seed * cells + v]) < length[seed]:
                    ahead = v
                    break
            if ahead < 0:
                break
            for other in (int(held[ahead * span + t + 1]), int(held[ahead * span + t])):
                if other >= 0 and chosen[other] == 0 and count < size:
                    chosen[other] = 1
                    member[count] = other
                    count += 1
            u = ahead
            t += 1
    tries = 2 * size if walks <= 0 and count == 1 else 0
    while tries > 0 and count < size:
        tries -= 1
        random[0] = drawn(random[0])
        i = random[0] % robots
        if chosen[i] == 0:
            chosen[i] = 1
            member[count] = i
            count += 1
    for k in range(count):
        chosen[member[k]] = 0
    for k in range(count - 1, 0, -1):
        random[0] = drawn(random[0])
        j = random[0] % (k + 1)
        i = member[k]
        member[k] = member[j]
        member[j] = i
    return count


@kernel(
    out=(
        "held", "busy", "path", "length", "trial", "arrival", "member", "chosen", "state_cell", "state_tick", "state_end",
        "state_from", "state_next", "bucket", "mark", "marked", "random", "fell", "count",
    ),
    of="path",
    each=150_000,
)  # fmt: skip
def improve(
    edge, degree, table, goals, distance, held, busy, path, length, span, trial, arrival, member, chosen, state_cell,
    state_tick, state_end, state_from, state_next, bucket, mark, marked, random, fell, count, size, most, halt,
):  # fmt: skip
    """Plan neighbourhoods again until ``count[ROUNDS]`` is ``most``, or no robot is later than its shortest path.

    Parameters
    ----------
    edge, degree, table, goals, distance : as for :func:`lampyris.kernels.fleet.pibt.run`.
    held : signed, (cells, span); the robot on each cell at each tick, or -1.
    busy : uint64, (cells, span // 64 + 1); a bit a tick, the lowest first: whether there is one. Those behind the last are set.
    path : int32, (robots, span); the cell of each robot at each tick.
    length : int32, (robots,); the tick from which each stays at its goal.
    trial, arrival, member : int32, (size, span), (size,), (size,); scratch. ``chosen`` : uint8, (robots,), 0.
    state_cell .. state_next : int32; as many states as a search may make.
    bucket : int32, (2 * span + 2,). ``mark``, ``marked`` : int32, a power of two, at least twice as many as states; 0.
    fell : int64, (rows, 2); the neighbourhoods after which the plan cost less, and the sum of costs then. It returns when the
        rows are used up.
    count : int64, (4,); neighbourhoods, sum of costs, states made, rows of ``fell``.
    size : robots of a neighbourhood at most.
    """
    robots = len(goals)
    least = 0
    for i in range(robots):
        least += int(distance[i])
    rows = len(fell) // 2
    while count[ROUNDS] < most and count[COST] > least and count[FALLS] < rows and not stopped(halt):
        count[ROUNDS] += 1
        random[0] = drawn(random[0])
        many = _choose(
            edge, degree, table, held, path, length, span, distance, member, random, chosen,
            1 + random[0] % size,
        )  # fmt: skip
        room = 0  # what the paths may cost beyond the shortest ones, together
        for k in range(many):
            i = int(member[k])
            hold(held, busy, path, i * span, span, -1)
            room += int(length[i]) - int(distance[i])
        done = 0
        random[0] = drawn(random[0])
        haste = int(random[0] % 4)
        haste = (0, 2, 4, 8)[haste]
        while done < many and not stopped(halt):
            i = int(member[done])
            random[0] = drawn(random[0])
            limit = min(int(distance[i]) + room, span - 1)
            s = _find(
                edge, degree, table, held, busy, path[i * span], goals[i], i, span, limit, state_cell, state_tick,
                state_end, state_from, state_next, bucket, mark, marked, int(count[ROUNDS] * size + done + 1),
                random[0] % 8, haste, count,
            )  # fmt: skip
            if s < 0:
                break
            arrival[done] = state_tick[s]
            room -= int(state_tick[s]) - int(distance[i])
            until = span
            while s >= 0:
                for t in range(int(state_tick[s]), until):
                    trial[done * span + t] = state_cell[s]
                until = int(state_tick[s])
                s = int(state_from[s])
            hold(held, busy, trial, done * span, span, i)
            done += 1
        if done == many:
            if room > 0:
                count[COST] -= room
                fell[2 * count[FALLS]] = count[ROUNDS]
                fell[2 * count[FALLS] + 1] = count[COST]
                count[FALLS] += 1
            for k in range(many):
                i = int(member[k])
                length[i] = arrival[k]
                for t in range(span):
                    path[i * span + t] = trial[k * span + t]
        else:
            for k in range(done):
                hold(held, busy, trial, k * span, span, -1)
            for k in range(many):
                hold(held, busy, path, int(member[k]) * span, span, member[k])
