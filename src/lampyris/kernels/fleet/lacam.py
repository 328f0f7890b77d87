"""LaCAM*: a search over whole configurations that asks PIBT for their successors and improves what it found.

K. Okumura, "LaCAM: search-based algorithm for quick multi-agent pathfinding", AAAI 2023; "Improving LaCAM for scalable
eventually optimal multi-agent pathfinding", IJCAI 2023; "Engineering LaCAM*: towards real-time, large-scale, and
near-optimal multi-agent pathfinding", AAMAS 2024.

A high-level node is a configuration, the cell of every robot. Each time a node is visited, the next node of its low-level
tree forces the cells of a few robots, in the order of their priorities, and PIBT decides the others. The tree comes to
all successors in the end, so the search is complete. The open list is a stack: the first solution comes by depth. Later
visits find cheaper ways to known configurations; their costs are propagated (a label-correcting Dijkstra).

The cost of a step is the number of robots that are not on their goal before and after it ("sum of loss"); the estimate
is the sum of the distances.

Growing memory is flat arrays, ``node`` (HASH .. STAMP, for each configuration), ``low`` (nodes of the low-level trees),
``link`` (steps that were found, as lists) and ``opened``; where one is full the kernel says so before it changes anything,
and goes on when it is called again with larger copies.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped
from lampyris.kernels.fleet.pibt import drawn, rearrange, step
from lampyris.kernels.fleet.steps import crosses

EXHAUSTED, IMPROVED, FULL, LIMIT = 0, 1, 2, 3

HASH, CHAIN, PARENT, COST, TO_GO, HEAD, TAIL, LINKS, QUEUED, STAMP = range(10)
NODE_WIDTH = 10
LOW_WIDTH = 4
"""Of a low-level node: its parent, the cell that it forces, its depth, the next one in the queue."""
LINK_WIDTH = 3
"""Of a step: the node it leads to, the next step from the same node, its cost."""
NODES, LOWS, LINK_COUNT, OPEN, GOAL, ITERATIONS, BEST, STATE_WIDTH = range(8)

RESTART = 4294967
"""Of 2**32 draws so many send a visit to a known configuration back to the start (0.001, as published)."""


@kernel()
def _mixed(robot, cell):
    """32 bits of a robot and its cell; those of a configuration are combined by exclusive or (Zobrist hashing)."""
    z = (robot * 2654435761 + cell * 2246822507 + 374761393) & 0xFFFFFFFF
    z ^= z >> 16
    z = (z * 2146121005) & 0xFFFFFFFF
    z ^= z >> 15
    z = (z * 739982445) & 0xFFFFFFFF
    return z ^ (z >> 16)


@kernel()
def _hash(cells, begin, robots):
    """The hash of a configuration."""
    found = 0
    for i in range(robots):
        found ^= _mixed(i, int(cells[begin + i]))
    return found


@kernel()
def _find(config, node, bucket, cells, hashed, robots):
    """The node with these cells, or -1."""
    h = bucket[hashed & (len(bucket) - 1)]
    while h >= 0:
        if node[h * NODE_WIDTH + HASH] == hashed:
            same = True
            base = h * robots
            for i in range(robots):
                if config[base + i] != cells[i]:
                    same = False
                    break
            if same:
                return int(h)
        h = node[h * NODE_WIDTH + CHAIN]
    return -1


@kernel()
def _value(table, cells_of_map, goals, now, following):
    """Cost of a step and the estimate after it, in one number: what is compared among samples is their sum."""
    cost = 0
    rest = 0
    for i in range(len(goals)):
        goal = goals[i]
        u = following[i]
        if u != goal or now[i] != goal:
            cost += 1
        rest += int(table[i * cells_of_map + u])
    return cost * 1099511627776 + rest


@kernel(out=("node", "link", "opened", "queue", "state"))
def _connect(node, link, opened, queue, state, source, target, cost):
    """Note a step, and propagate what it makes cheaper; nodes that became cheaper are opened again.

    ``queue`` : int32, one more than nodes; a ring.
    """
    at = state[LINK_COUNT]
    link[at * LINK_WIDTH] = target
    link[at * LINK_WIDTH + 1] = node[source * NODE_WIDTH + LINKS]
    link[at * LINK_WIDTH + 2] = cost
    node[source * NODE_WIDTH + LINKS] = at
    state[LINK_COUNT] = at + 1
    ring = len(queue)
    queue[0] = source
    head = 0
    tail = 1
    only = at  # the source itself has not changed: of its steps only the new one
    while head != tail:
        u = queue[head] * NODE_WIDTH
        head = (head + 1) % ring
        node[u + QUEUED] = 0
        k = node[u + LINKS] if only < 0 else only
        while k >= 0:
            v = int(link[k * LINK_WIDTH])
            there = v * NODE_WIDTH
            g = node[u + COST] + link[k * LINK_WIDTH + 2]
            if g < node[there + COST]:
                node[there + COST] = g
                node[there + PARENT] = u // NODE_WIDTH
                if node[there + QUEUED] == 0:
                    node[there + QUEUED] = 1
                    queue[tail] = v
                    tail = (tail + 1) % ring
                if (
                    state[GOAL] >= 0
                    and node[there + STAMP] != state[ITERATIONS]
                    and g + node[there + TO_GO] < node[state[GOAL] * NODE_WIDTH + COST]
                ):
                    node[there + STAMP] = state[ITERATIONS]
                    opened[state[OPEN]] = v
                    state[OPEN] += 1
            k = int(link[k * LINK_WIDTH + 1]) if only < 0 else -1
        only = -1


@kernel(out=("node", "low", "order", "random", "state", "key"))
def _branch(edge, degree, config, order, node, low, random, state, key, h, at, robots):
    """Append the children of low-level node ``at`` to the queue of node ``h``, in random order."""
    depth = low[at * LOW_WIDTH + 2] if at >= 0 else 0
    if depth >= robots:
        return
    i = order[h * robots + depth]
    here = int(config[h * robots + i])
    n = int(degree[here])
    for k in range(n):
        key[k] = edge[len(edge) // len(degree) * here + k]
    key[n] = here
    for k in range(n, 0, -1):
        random[0] = drawn(random[0])
        j = random[0] % (k + 1)
        u = key[k]
        key[k] = key[j]
        key[j] = u
    for k in range(n + 1):
        made = state[LOWS]
        state[LOWS] = made + 1
        low[made * LOW_WIDTH] = at
        low[made * LOW_WIDTH + 1] = key[k]
        low[made * LOW_WIDTH + 2] = depth + 1
        low[made * LOW_WIDTH + 3] = -1
        last = node[h * NODE_WIDTH + TAIL]
        if node[h * NODE_WIDTH + HEAD] < 0:
            node[h * NODE_WIDTH + HEAD] = made
        else:
            low[last * LOW_WIDTH + 3] = made
        node[h * NODE_WIDTH + TAIL] = made


@kernel(out=("following", "reserved"))
def _force(edge, wide, low, order, base, at, now, following, occupant, reserved):
    """Set the cells that a low-level node and its ancestors force; whether they collide with none of each other."""
    while at >= 0:
        i = int(order[base + int(low[at * LOW_WIDTH + 2]) - 1])
        u = int(low[at * LOW_WIDTH + 1])
        if reserved[u] != 0:
            return False
        a = occupant[u]
        if a >= 0 and a != i and following[a] == now[i]:
            return False
        if crosses(edge, wide, occupant, following, int(now[i]), u):
            return False
        following[i] = u
        reserved[u] = 1
        at = int(low[at * LOW_WIDTH])
    return True


@kernel(out=("config", "waited", "order", "node", "opened", "bucket", "state"))
def add(
    table, goals, distance, cells, config, waited, order, node, opened, bucket, state, parent, cost, hashed
):
    """Append a node for these cells and open it; its robots' order is made from the parent's."""
    robots = len(goals)
    many = len(table) // robots
    made = state[NODES]
    state[NODES] = made + 1
    base = made * robots
    old = parent * robots
    rest = 0
    for i in range(robots):
        u = cells[i]
        far = int(table[i * many + u])
        rest += far
        config[base + i] = u
        if parent >= 0:
            order[base + i] = order[old + i]
            waited[base + i] = waited[old + i] + 1 if far > 0 else 0
        else:
            order[base + i] = i
            waited[base + i] = 1 if far > 0 else 0
    rearrange(order, base, waited, base, distance)
    at = made * NODE_WIDTH
    node[at + HASH] = hashed
    node[at + CHAIN] = bucket[hashed & (len(bucket) - 1)]
    bucket[hashed & (len(bucket) - 1)] = made
    node[at + PARENT] = parent
    node[at + COST] = cost
    node[at + TO_GO] = rest
    node[at + HEAD] = -2  # the empty constraint
    node[at + TAIL] = -1
    node[at + LINKS] = -1
    node[at + QUEUED] = 0
    node[at + STAMP] = -1
    opened[state[OPEN]] = made
    state[OPEN] += 1
    return made


@kernel(
    out=(
        "config", "waited", "order", "node", "low", "link", "opened", "bucket", "queue", "now", "following", "best",
        "occupant", "reserved", "choice", "key", "turn", "partner", "stack", "random", "state",
    ),
    of="config",
    each=15_000,
)  # fmt: skip
def search(
    edge, degree, passing, table, goals, distance, config, waited, order, node, low, link, opened, bucket, queue,
    now, following, best, occupant, reserved, choice, key, turn, partner, stack, random, state,
    swapping, samples, most, halt,
):  # fmt: skip
    """Search until the best solution became better (IMPROVED), or one of the other endings.

    Parameters
    ----------
    edge, degree, passing, table, goals, now .. stack, random, swapping : as for :func:`lampyris.kernels.fleet.pibt.step`. ``now``
        holds the starts when nothing has been searched yet.
    distance : int32, (robots,); of the starts.
    config, waited, order : int32, (nodes, robots) each; the cells, the ticks off the goal, the robots by priority.
    node .. opened : see above; int64, int32, int32, int32. ``opened`` has room for four times as many as there are nodes.
    bucket : int32, a power of two; -1: the heads of the chains of the hash table.
    queue : int32, (nodes + 1,); scratch.
    best : int32, (robots,); scratch: the best of the samples.
    state : int64, (STATE_WIDTH,); counts, the node that is the goal (or -1), and its cost when it was last reported.
    samples : how many configurations are drawn for each step; the best is taken.
    most : iterations after which to return LIMIT.
    """
    robots = len(goals)
    cells = len(degree)
    wide = len(edge) // cells
    if state[NODES] == 0:
        hashed = _hash(now, 0, robots)
        add(table, goals, distance, now, config, waited, order, node, opened, bucket, state, -1, 0, hashed)
    while state[OPEN] > 0:
        if state[GOAL] >= 0 and node[state[GOAL] * NODE_WIDTH + COST] < state[BEST]:
            state[BEST] = node[state[GOAL] * NODE_WIDTH + COST]
            return IMPROVED
        if state[ITERATIONS] >= most or stopped(halt):
            return LIMIT
        if (
            (state[NODES] + 1) * robots > len(config)
            or (state[LOWS] + 10) * LOW_WIDTH > len(low)
            or (state[LINK_COUNT] + 1) * LINK_WIDTH > len(link)
            or state[OPEN] + state[NODES] + 2 > len(opened)
        ):
            return FULL
        h = int(opened[state[OPEN] - 1])
        at = h * NODE_WIDTH
        if state[GOAL] >= 0 and node[at + COST] + node[at + TO_GO] >= node[state[GOAL] * NODE_WIDTH + COST]:
            state[OPEN] -= 1
            continue
        if node[at + TO_GO] == 0:
            state[GOAL] = h
            continue
        forced = node[at + HEAD]
        if forced == -1:
            state[OPEN] -= 1
            continue
        state[ITERATIONS] += 1
        if forced == -2:
            forced = -1
            node[at + HEAD] = -1
        else:
            node[at + HEAD] = low[forced * LOW_WIDTH + 3]
        _branch(edge, degree, config, order, node, low, random, state, key, h, forced, robots)
        for i in range(robots):
            now[i] = config[h * robots + i]
            occupant[now[i]] = i
        least = -1
        for _ in range(samples):
            for i in range(robots):
                following[i] = -1
            legal = _force(edge, wide, low, order, h * robots, forced, now, following, occupant, reserved)
            if legal and step(
                edge, degree, passing, table, goals, order, h * robots, now, following, occupant, reserved, choice, key,
                turn, partner, stack, random, swapping, halt,
            ):  # fmt: skip
                value = _value(table, cells, goals, now, following)
                if least < 0 or value // 1099511627776 + value % 1099511627776 < least // 1099511627776 + (
                    least % 1099511627776
                ):
                    least = value
                    for i in range(robots):
                        best[i] = following[i]
            for i in range(robots):
                if following[i] >= 0:
                    reserved[following[i]] = 0
            if not legal or stopped(halt):
                break
        for i in range(robots):
            occupant[now[i]] = -1
        if least < 0:
            continue
        cost = least // 1099511627776
        hashed = _hash(best, 0, robots)
        known = _find(config, node, bucket, best, hashed, robots)
        if known < 0:
            made = add(
                table, goals, distance, best, config, waited, order, node, opened, bucket, state, h,
                node[at + COST] + cost, hashed,
            )  # fmt: skip
            _connect(node, link, opened, queue, state, h, made, cost)
            if state[GOAL] >= 0 and (
                node[made * NODE_WIDTH + COST] + node[made * NODE_WIDTH + TO_GO]
                >= node[state[GOAL] * NODE_WIDTH + COST]
            ):
                state[OPEN] -= 1
        else:
            _connect(node, link, opened, queue, state, h, known, cost)
            random[0] = drawn(random[0])
            again = 0 if random[0] < RESTART else known
            if state[GOAL] < 0 or (
                node[again * NODE_WIDTH + COST] + node[again * NODE_WIDTH + TO_GO]
                < node[state[GOAL] * NODE_WIDTH + COST]
            ):
                opened[state[OPEN]] = again
                state[OPEN] += 1
    if state[GOAL] >= 0 and node[state[GOAL] * NODE_WIDTH + COST] < state[BEST]:
        state[BEST] = node[state[GOAL] * NODE_WIDTH + COST]
        return IMPROVED
    return EXHAUSTED
