"""Costs to the goal alone, for a process that asks once: half as fast as :mod:`.wavefront`, and compiled in half the time."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64

LOOK = 1024
"""Places of the queue between two looks at the flag that stops it."""
LAPS = 4
"""Times that the queue is gone through at most: on most maps twice is enough, but where each of many detours has more steps and
a lower cost than the direct way, a cell is expanded once for each of those before it."""


@kernel(out=("cost", "queue", "waits"), each=900)
def costs_alone(cost, queue, waits, steps, goal, halt):
    """Lower costs cell by cell until no step lowers any, in the order of a queue; 1, or 0 where that takes too many expansions.

    Which cell comes first does not matter for what comes out. A cell that is lowered again is expanded again: on the
    published and the bundled maps 1.0 to 1.9 expansions a cell with octile moves, on random ones 35 % blocked up to 2.4.

    Parameters
    ----------
    cost : int32 or int64, (n,), padded; -1 in walls and border, more than any cost elsewhere.
    queue : uint32, one more than free cells; scratch. After LAPS times as many expansions it is given up.
    waits : uint8, (n,), 0; which cells are in the queue.
    steps : int64, (4 m,): of each step its offset, those of the two cells that must be free besides (the end itself where
        there is none), and its cost.
    goal : a cell that is free.
    """
    one = u64(1)
    room = u64(len(queue))
    cost[u64(goal)] = 0
    queue[u64(0)] = goal
    head = u64(0)
    tail = one
    laps = 0
    while head != tail:
        if head & u64(LOOK - 1) == u64(0) and stopped(halt):
            return 0
        p = u64(queue[head])
        head += one
        if head == room:
            head = u64(0)
            laps += 1
            if laps == LAPS:
                return 0
        waits[p] = 0
        d = cost[p]
        for k in range(0, len(steps), 4):
            n = p + u64(steps[u64(k)])
            c = d + steps[u64(k + 3)]
            if (
                c < cost[n]
                and cost[p + u64(steps[u64(k + 1)])] >= 0
                and cost[p + u64(steps[u64(k + 2)])] >= 0
            ):
                cost[n] = c
                if waits[n] == 0:
                    waits[n] = 1
                    queue[tail] = n
                    tail += one
                    if tail == room:
                        tail = u64(0)
    return 1
