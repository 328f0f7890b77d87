"""Searches over the cells of ridges: what is connected, the widest path, the cheapest path.

Maps are flat, with a border of cells that are in no region. Steps of a cell are bits: bit k is set where the step
``jump[k]`` may be made.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.heap import put, take

FAR = 2**62
"""What no path costs."""


@kernel(out=("mark", "queue"), each=500)
def connected(value, least, jump, start, mark, queue, halt):
    """Mark the region of cells of at least some value around a cell; how many they are.

    Parameters
    ----------
    value : int64 (n,); below ``least`` in the border.
    least : the value; ``start`` : flat index of a cell that has it.
    jump : int64 (m,); from a cell to its neighbours.
    mark : uint8 (n,), 0 before; 1 in the region.
    queue : int32 (n,); scratch.
    """
    mark[u64(start)] = 1
    queue[u64(0)] = start
    first = 0
    count = 1
    while first < count:
        if first % LOOK == 0 and stopped(halt):
            break
        at = queue[u64(first)] + 0
        first += 1
        for k in range(len(jump)):
            to = at + jump[u64(k)]
            if mark[u64(to)] == 0 and value[u64(to)] >= least:
                mark[u64(to)] = 1
                queue[u64(count)] = to
                count += 1
    return count


@kernel(out=("worst", "heap", "place"), each=2000)
def widest(steps, jump, value, start, goal, worst, heap, place, halt):
    """The greatest least value of a path; -1 where there is none.

    Parameters
    ----------
    steps : uint8 (n,); the steps of each cell. ``jump`` : int64 (m,), m <= 8.
    value : int64 (n,), >= 0.
    start, goal : flat indices.
    worst : int64 (n,), FAR before; scratch.
    heap, place : int32 (n + 1,) and (n,), 0 before; scratch.
    """
    worst[u64(start)] = -value[u64(start)]
    put(heap, place, worst, worst, start)
    turn = 0
    while heap[u64(0)] > 0:
        turn += 1
        if turn % LOOK == 0 and stopped(halt):
            break
        at = heap[u64(1)] + 0
        if at == goal:
            return -worst[u64(at)]
        take(heap, place, worst, worst, at)
        legal = int(steps[u64(at)])
        for k in range(len(jump)):
            if (legal >> k) & 1 == 0:
                continue
            to = at + jump[u64(k)]
            through = max(worst[u64(at)], -value[u64(to)])
            if through < worst[u64(to)]:
                worst[u64(to)] = through
                put(heap, place, worst, worst, to)
    return -1


@kernel(out=("paid", "before", "heap", "place"), each=2000)
def cheapest(steps, jump, cost, rank, start, goal, paid, before, heap, place, halt):
    """The cheapest path from a cell; of cells that cost the same the one of lower rank is settled first.

    Parameters
    ----------
    steps, jump, start, goal : see :func:`widest`.
    cost : int64 (m,), > 0; of each step.
    rank : int64 (n,); no two are equal.
    paid : int64 (n,), FAR before; afterwards the least cost of every cell that was settled.
    before : int32 (n,); the cell before it on the way from the start.
    heap, place : see :func:`widest`.
    """
    paid[u64(start)] = 0
    put(heap, place, paid, rank, start)
    turn = 0
    while heap[u64(0)] > 0:
        turn += 1
        if turn % LOOK == 0 and stopped(halt):
            break
        at = heap[u64(1)] + 0
        if at == goal:
            break
        take(heap, place, paid, rank, at)
        legal = int(steps[u64(at)])
        for k in range(len(jump)):
            if (legal >> k) & 1 == 0:
                continue
            to = at + jump[u64(k)]
            through = paid[u64(at)] + cost[u64(k)]
            if through < paid[u64(to)]:
                paid[u64(to)] = through
                before[u64(to)] = at
                put(heap, place, paid, rank, to)
    return turn
