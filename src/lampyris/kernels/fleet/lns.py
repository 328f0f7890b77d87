"""Large neighbourhood search: a few robots' paths are taken away and planned again, as long as that costs no more.

J. Li, Z. Chen, D. Harabor, P. Stuckey, S. Koenig, "Anytime multi-agent path finding via large neighborhood search", IJCAI
2021; written from the paper. Each robot is planned by A* over cells and ticks, with the distance tables as estimates, among
all other robots' paths. Ours: buckets of a stack each as the open list, and neighbourhoods of random size.

No path gets longer than the makespan that the search began with, so that all that is held fits in a table of cells
and ticks, ``held``. What is written is whole after every neighbourhood: a search that was stopped left a plan without conflicts.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped
from lampyris.kernels.fleet.pibt import drawn
from lampyris.kernels.fleet.steps import beside

ROUNDS, COST, STATES = range(3)


@kernel(out=("held",))
def hold(held, path, row, span, robot):
    """Write a robot (or -1) to all that it is on in the ``span`` ticks of ``path[row:]``."""
    for t in range(span):
        held[path[row + t] * span + t] = robot


@kernel(out=("state_cell", "state_tick", "state_from", "state_next", "bucket", "mark", "marked", "count"))
def _find(
    edge, degree, table, held, start, goal, robot, span, limit, state_cell, state_tick, state_from, state_next,
    bucket, mark, marked, stamp, shift, count,
):  # fmt: skip
    """The state that is the earliest arrival at the goal for good, at tick ``limit`` at the latest, or -1.

    A state is a cell at a tick; ``bucket[f]`` is the stack of those whose path arrives at tick f at the earliest. States
    are found again by a hash table: ``marked[h]`` is one of this search if ``mark[h]`` is its ``stamp``.
    """
    cells = len(degree)
    wide = len(edge) // cells
    row = robot * cells
    since = span
    while since > 0 and held[goal * span + since - 1] < 0:
        since -= 1
    first = max(int(table[row + start]), since)
    if first > limit:
        return -1
    for f in range(first, limit + 1):
        bucket[f] = -1
    mask = len(mark) - 1
    state_cell[0] = start
    state_tick[0] = 0
    state_from[0] = -1
    state_next[0] = -1
    bucket[first] = 0
    states = 1
    f = first
    while f <= limit:
        s = int(bucket[f])
        if s < 0:
            f += 1
            continue
        bucket[f] = state_next[s]
        u = int(state_cell[s])
        t = int(state_tick[s])
        if u == goal and t >= since:
            count[STATES] += states
            return s
        if t + 1 >= span or states + 10 > len(state_cell):
            if t + 1 >= span:
                continue
            break
        n = int(degree[u])
        for k in range(n + 1):
            # The wait first and the steps in turn: the last one is tried first.
            v = u if k == 0 else int(edge[wide * u + (k + shift) % n])
            if held[v * span + t + 1] >= 0:
                continue
            other = held[v * span + t]
            if other >= 0 and held[u * span + t + 1] == other:
                continue
            one = beside(edge, wide, u, v)
            if one >= 0:
                two = v - (one - u)
                other = held[one * span + t]
                if other >= 0 and held[two * span + t + 1] == other:
                    continue
                other = held[two * span + t]
                if other >= 0 and held[one * span + t + 1] == other:
                    continue
            value = max(t + 1 + int(table[row + v]), since)
            if value > limit:
                continue
            h = ((v * 2654435761 + (t + 1) * 40503) >> 7) & mask
            known = False
            while mark[h] == stamp:
                if state_cell[marked[h]] == v and state_tick[marked[h]] == t + 1:
                    known = True
                    break
                h = (h + 1) & mask
            if known:
                continue
            mark[h] = stamp
            marked[h] = states
            state_cell[states] = v
            state_tick[states] = t + 1
            state_from[states] = s
            state_next[states] = bucket[value]
            bucket[value] = states
            states += 1
            if value < f:
                f = value
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
        "held", "path", "length", "trial", "arrival", "member", "chosen", "state_cell", "state_tick", "state_from",
        "state_next", "bucket", "mark", "marked", "random", "count",
    ),
    of="path",
    each=150_000,
)  # fmt: skip
def improve(
    edge, degree, table, goals, distance, held, path, length, span, trial, arrival, member, chosen, state_cell,
    state_tick, state_from, state_next, bucket, mark, marked, random, count, size, most, halt,
):  # fmt: skip
    """Plan neighbourhoods again until ``count[ROUNDS]`` is ``most``, or no robot is later than its shortest path.

    Parameters
    ----------
    edge, degree, table, goals, distance : as for :func:`lampyris.kernels.fleet.pibt.run`.
    held : signed, (cells, span); the robot on each cell at each tick, or -1.
    path : int32, (robots, span); the cell of each robot at each tick.
    length : int32, (robots,); the tick from which each stays at its goal.
    trial, arrival, member : int32, (size, span), (size,), (size,); scratch. ``chosen`` : uint8, (robots,), 0.
    state_cell .. state_next : int32; as many states as a search may make.
    bucket : int32, (span + 1,). ``mark``, ``marked`` : int32, a power of two, at least twice as many as states; 0.
    count : int64, (3,); neighbourhoods, sum of costs, states made.
    size : robots of a neighbourhood at most.
    """
    robots = len(goals)
    least = 0
    for i in range(robots):
        least += int(distance[i])
    while count[ROUNDS] < most and count[COST] > least and not stopped(halt):
        count[ROUNDS] += 1
        random[0] = drawn(random[0])
        many = _choose(
            edge, degree, table, held, path, length, span, distance, member, random, chosen,
            1 + random[0] % size,
        )  # fmt: skip
        room = 0  # what the paths may cost beyond the shortest ones, together
        for k in range(many):
            i = int(member[k])
            hold(held, path, i * span, span, -1)
            room += int(length[i]) - int(distance[i])
        done = 0
        while done < many and not stopped(halt):
            i = int(member[done])
            random[0] = drawn(random[0])
            limit = min(int(distance[i]) + room, span - 1)
            s = _find(
                edge, degree, table, held, path[i * span], goals[i], i, span, limit, state_cell, state_tick,
                state_from, state_next, bucket, mark, marked, int(count[ROUNDS] * size + done + 1),
                random[0] % 8, count,
            )  # fmt: skip
            if s < 0:
                break
            arrival[done] = state_tick[s]
            room -= int(state_tick[s]) - int(distance[i])
            for t in range(int(state_tick[s]), span):
                trial[done * span + t] = goals[i]
            while s >= 0:
                trial[done * span + int(state_tick[s])] = state_cell[s]
                s = int(state_from[s])
            hold(held, trial, done * span, span, i)
            done += 1
        if done == many:
            count[COST] -= room
            for k in range(many):
                i = int(member[k])
                length[i] = arrival[k]
                for t in range(span):
                    path[i * span + t] = trial[k * span + t]
        else:
            for k in range(done):
                hold(held, trial, k * span, span, -1)
            for k in range(many):
                hold(held, path, int(member[k]) * span, span, member[k])
