"""Which robots are in each other's way: the neighbourhoods of large neighbourhood search.

J. Li, Z. Chen, D. Harabor, P. J. Stuckey, S. Koenig, "Anytime multi-agent path finding via large neighborhood search",
IJCAI 2021. The tables of paths are those of :mod:`lampyris.kernels.fleet.space_time`.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel
from lampyris.kernels.fleet.pibt import drawn


@kernel(out=("chosen", "is_chosen"))
def _gather(head, chain, settled, last, horizon, u, t, chosen, is_chosen, n, most):
    """Add the robots that are on a cell at a tick to the ``n`` chosen ones; how many there are then."""
    r = head[u * horizon + t]
    while r >= 0 and n < most:
        if is_chosen[r] == 0:
            is_chosen[r] = 1
            chosen[n] = r
            n += 1
        r = chain[r * horizon + t]
    r = settled[u]
    if r >= 0 and n < most and t > last[r] and is_chosen[r] == 0:
        is_chosen[r] = 1
        chosen[n] = r
        n += 1
    return n


@kernel(out=("chosen", "is_chosen", "random"), of="chosen", each=100_000)
def around_robot(
    edge, degree, table, where, last, head, chain, settled, horizon, longest, robot, most, walks, chosen, is_chosen,
    random,
):  # fmt: skip
    """Collect the robots that keep one robot from a shorter path; how many, itself among them.

    It leaves its path at a random tick and walks at random over cells from which it would come to its goal sooner than it
    does now; those who are there are collected.

    Parameters
    ----------
    edge, degree, table : see :mod:`.distances`.
    where .. longest : see :func:`lampyris.kernels.fleet.space_time.find`.
    robot : its index.
    most : robots to collect.
    walks : walks that are tried.
    chosen : int32, (most,); the result.
    is_chosen : uint8, (robots,), zeros; left as it was found.
    random : int64, (1,); state of the generator.
    """
    cells = len(degree)
    base = robot * cells
    chosen[0] = robot
    is_chosen[robot] = 1
    n = 1
    for _ in range(walks):
        if n >= most or last[robot] == 0:
            break
        random[0] = drawn(random[0])
        t = random[0] % last[robot]
        u = int(where[robot * horizon + t])
        while n < most and t + 1 < horizon:
            # One of the cells from which it is still sooner, or where it is.
            count = 0
            on = u
            for k in range(degree[u] + 1):
                v = int(edge[4 * u + k]) if k < degree[u] else u
                if t + 1 + table[base + v] < last[robot]:
                    count += 1
                    random[0] = drawn(random[0])
                    if random[0] % count == 0:
                        on = v
            if count == 0:
                break
            t += 1
            n = _gather(head, chain, settled, last, horizon, on, t, chosen, is_chosen, n, most)
            if on != u:
                n = _gather(head, chain, settled, last, horizon, on, t - 1, chosen, is_chosen, n, most)
            u = on
    for i in range(n):
        is_chosen[chosen[i]] = 0
    return n


@kernel(out=("chosen", "is_chosen", "queue", "seen", "random"), of="chosen", each=200_000)
def around_cell(
    edge, degree, where, last, head, chain, settled, horizon, longest, cell, most, visits, chosen, is_chosen, queue, seen,
    random,
):  # fmt: skip
    """Collect the robots that come by a crossing, at first nearest in space, from a random tick on; how many.

    Parameters
    ----------
    edge .. longest, most, chosen, is_chosen, random : as for :func:`around_robot`.
    cell : where to begin; cells are visited by distance, those with three neighbours or more are looked at.
    visits : cells that are visited at the most.
    queue : int32, (cells,); scratch.
    seen : uint8, (cells,), zeros; left as it was found.
    """
    queue[0] = cell
    seen[cell] = 1
    head_ = 0
    tail = 1
    n = 0
    while head_ < tail and head_ < visits and n < most:
        u = int(queue[head_])
        head_ += 1
        if degree[u] >= 3 or head_ == 1:
            random[0] = drawn(random[0])
            begin = random[0] % (longest + 1)
            for i in range(longest + 1):
                if n >= most:
                    break
                t = begin + i
                if t > longest:
                    t -= longest + 1
                n = _gather(head, chain, settled, last, horizon, u, t, chosen, is_chosen, n, most)
        for k in range(degree[u]):
            v = int(edge[4 * u + k])
            if seen[v] == 0:
                seen[v] = 1
                queue[tail] = v
                tail += 1
    for i in range(tail):
        seen[queue[i]] = 0
    for i in range(n):
        is_chosen[chosen[i]] = 0
    return n
