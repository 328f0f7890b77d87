"""The walk of AD-GSO once more, for many runs on one field: what a jump does is remembered by its cell.

A jump depends on its cell, the field and the obstacles near. Where there are none near it is always the same,
so it is looked up. Of the path only what is asked for is written: who drives a few steps and asks again never
needs the rest, but what the rest costs has to be counted, and is.

The walk, its frames and its numbers are those of :mod:`lampyris.kernels.adgso.walk`.
"""

from __future__ import annotations

from lampyris.kernels._jit import PATH, kernel, stopped
from lampyris.kernels.adgso.walk import (
    ALLOWED,
    ARRIVED,
    AT,
    EXACT,
    FIRST,
    FULL,
    GOAL,
    HEMMED,
    JUMPS,
    LENGTH,
    LOOKED,
    OBSTACLE,
    RULE,
    SPENT,
    WALL,
    WIDTH,
    choose,
    follow,
    measure,
    open_window,
    trace,
    weigh,
)

NEXT, COST, REACH, STEPS, CHAIN, FROM = 0, 1, 2, 3, 4, 5
"""Places in ``known``, KNOWN a jump: the cell jumped to, window cells looked at, how far from
the cell the jump depends on what stands there, its steps, whether they are the chain of parents, the cell (0: none is
known here)."""
KNOWN = 6


@kernel()
def minds(at, reach, lower, width, luc, marks, count):
    """Whether one of ``count`` marked cells (x, y in ``marks``) is near enough to change a cell's jump.

    ``lower``: only cells of lower luciferin can.
    """
    y = at // width
    x = at - y * width
    for k in range(count):
        dx = marks[2 * k] - x
        dy = marks[2 * k + 1] - y
        if -reach <= dx <= reach and -reach <= dy <= reach:
            if lower == 0 or luc[marks[2 * k + 1] * width + marks[2 * k]] < luc[at]:
                return True
    return False


@kernel()
def extent(at, chosen, lower, width, cost, luc, step, far):
    """How far the chain of parents strays from a cell, as far as it is looked at for a jump; -1: do not ask.

    The chain may leave the window, and it may miss the chosen cell. -1 says that with ``lower`` a cell of it
    would be overlooked.
    """
    y = at // width
    x = at - y * width
    most = 0
    here = at
    while cost[here] > cost[chosen]:
        here += far[3 * step[here]]
        if lower != 0 and luc[here] >= luc[at]:
            return -1
        cy = here // width
        cx = here - cy * width
        most = max(most, abs(cx - x), abs(cy - y))
    return most


@kernel(
    out=("tally", "path", "wall", "toll", "mark", "dist", "queue", "queued", "sub_path", "known"),
    each=24_000,
    of=PATH,
)
def walk_known(
    cost, luc, step, shut, terrain, setup, tally, path,
    ring_dx, ring_dy, ring_at, near, far, price,
    wall, toll, mark, dist, queue, queued, sub_path,
    known, marks, marked, lower, wanted, halt,
):  # fmt: skip
    """As :func:`lampyris.kernels.adgso.walk.walk` without record, roulette and gates; return its reason.

    Parameters
    ----------
    known : see NEXT; zeros to begin with, for one field and one set of settings. Room for a power of two of jumps: those of
        cells that share a place take turns.
    marks, marked : x and y of every cell that bears OBSTACLE in ``shut``, and how many there are.
    lower : 1 if only cells of lower luciferin can be in the way: steps may cut corners.
    wanted : steps of the path after the first sub-path that must be in ``path``; further ones may be missing,
        and ``tally[LENGTH]`` counts them.
    """
    places = len(known) // KNOWN - 1
    while True:
        at = tally[AT]
        if at == setup[GOAL]:
            return ARRIVED
        if stopped(halt):
            return SPENT
        k = KNOWN * (at & places)
        done = tally[LENGTH] - 1
        write = tally[FIRST] == 0 or done < tally[FIRST] + wanted
        if write and done + len(sub_path) > len(path) - 1:
            return FULL
        if known[k + FROM] == at and not minds(at, known[k + REACH], lower, setup[WIDTH], luc, marks, marked):
            if not write or known[k + CHAIN] != 0:
                tally[LOOKED] += known[k + COST]
                if tally[LOOKED] > tally[ALLOWED]:
                    return SPENT
                if write:
                    here = at
                    for n in range(known[k + STEPS]):
                        here += far[3 * step[here]]
                        path[done + 1 + n] = here
                tally[JUMPS] += 1
                tally[LENGTH] += known[k + STEPS]
                tally[AT] = known[k]
                if tally[FIRST] == 0:
                    tally[FIRST] = known[k + STEPS]
                continue
        mask = WALL | OBSTACLE
        rings, accepted = open_window(
            luc, shut, mask, setup, at, ring_dx, ring_dy, ring_at, near, wall, mark, queue
        )
        looked = (2 * rings + 1) * (2 * rings + 1) - 1
        tally[LOOKED] += looked
        again = accepted == 0 and tally[LENGTH] > 1
        if again:
            mask = mask & WALL  # a plain 1 would be of another type, and the callee compiled twice
            rings, accepted = open_window(
                luc, shut, mask, setup, at, ring_dx, ring_dy, ring_at, near, wall, mark, queue
            )
            tally[LOOKED] += (2 * rings + 1) * (2 * rings + 1) - 1
        if tally[LOOKED] > tally[ALLOWED]:
            return SPENT
        if accepted == 0:
            return HEMMED
        if setup[RULE] == EXACT:
            weigh(terrain, setup, at, rings, ring_dx, ring_dy, ring_at, mark, toll)
            measure(mark, wall, toll, near, price, dist, queue, queued)
        c = choose(cost, luc, setup, at, 0.0, rings, ring_dx, ring_dy, ring_at, mark, dist)
        chosen = at + ring_dy[c] * setup[WIDTH] + ring_dx[c]
        steps = follow(cost, step, shut, mask, far, at, chosen, sub_path)
        chain = 1 if steps > 0 else 0
        if steps == 0:
            if setup[RULE] != EXACT:
                weigh(terrain, setup, at, rings, ring_dx, ring_dy, ring_at, mark, toll)
                measure(mark, wall, toll, near, price, dist, queue, queued)
            steps = trace(setup, at, ring_at[c], mark, wall, toll, near, price, dist, sub_path)
        if known[k + FROM] != at and not again:
            reach = extent(at, chosen, lower, setup[WIDTH], cost, luc, step, far)
            if reach >= 0 and not minds(at, max(reach, rings), lower, setup[WIDTH], luc, marks, marked):
                known[k] = chosen
                known[k + FROM] = at
                known[k + COST] = looked
                known[k + REACH] = max(reach, rings)
                known[k + STEPS] = steps
                known[k + CHAIN] = chain
        tally[JUMPS] += 1
        if write:
            for n in range(1, steps + 1):
                path[done + n] = sub_path[n]
        tally[LENGTH] += steps
        tally[AT] = chosen
        if tally[FIRST] == 0:
            tally[FIRST] = steps
