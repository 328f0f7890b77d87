"""From cost to descent over terrain: each cell's parent, the cost of a step depending on the cell it ends in.

Maps are padded and flat, as :mod:`.weighted_wavefront` leaves them.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.field.weighted_wavefront import TERRAIN_UNIT


@kernel(out=("cost", "step", "near", "far"), each=600)
def parents8(cost, weight, step, near, far, width, rows, straight, diagonal, guard, limit, halt):
    """The local parent rule for eight moves over terrain; costs above ``limit`` become -1.

    For each cell the first offset, in the order (-1,-1) (1,-1) (-1,1) (1,1) (-1,0) (1,0) (0,-1) (0,1), at
    which a neighbour's cost and the step into it make exactly the cell's own. What a departure from each cell
    of three rows comes to is kept in ``near`` and ``far``, (3 width,) each, row y in place y % 3.
    """
    w = u64(width)
    one = u64(1)
    two = u64(2)
    a = u64(0)
    b = w
    c = w + w
    _departures(cost, weight, near, far, u64(0), a, w, straight, diagonal)
    _departures(cost, weight, near, far, w, b, w, straight, diagonal)
    for y in range(u64(rows - 2)):
        if stopped(halt):
            return
        begin = y * w
        _departures(cost, weight, near, far, begin + w + w, c, w, straight, diagonal)
        here = begin + w + one
        if guard == 0:
            for x in range(w - two):
                d = cost[here + x]
                k = 7 if near[c + x + one] == d else -1
                k = 6 if near[a + x + one] == d else k
                k = 5 if near[b + x + two] == d else k
                k = 4 if near[b + x] == d else k
                k = 3 if far[c + x + two] == d else k
                k = 2 if far[c + x] == d else k
                k = 1 if far[a + x + two] == d else k
                k = 0 if far[a + x] == d else k
                step[here + x] = k if (d <= limit) & (d > 0) else -1
        else:
            for x in range(w - two):
                d = cost[here + x]
                up = near[a + x + one]
                left = near[b + x]
                right = near[b + x + two]
                down = near[c + x + one]
                k = 7 if down == d else -1
                k = 6 if up == d else k
                k = 5 if right == d else k
                k = 4 if left == d else k
                k = 3 if (far[c + x + two] == d) & ((down | right) >= 0) else k
                k = 2 if (far[c + x] == d) & ((down | left) >= 0) else k
                k = 1 if (far[a + x + two] == d) & ((up | right) >= 0) else k
                k = 0 if (far[a + x] == d) & ((up | left) >= 0) else k
                step[here + x] = k if (d <= limit) & (d > 0) else -1
        for i in range(begin, begin + w):
            cost[i] = cost[i] if cost[i] <= limit else -1
        a, b, c = b, c, a
    for i in range(u64(rows - 2) * w, u64(rows) * w):
        cost[i] = cost[i] if cost[i] <= limit else -1


@kernel(out=("near", "far"))
def _departures(cost, weight, near, far, row, place, width, straight, diagonal):
    """What a straight and a diagonal departure from each cell of a row come to; -1 in walls."""
    for x in range(u64(width)):
        d = cost[row + x]
        burden = TERRAIN_UNIT + weight[row + x]
        near[place + x] = d + straight * burden if d >= 0 else -1
        far[place + x] = d + diagonal * burden if d >= 0 else -1


@kernel(out=("cost", "step"), each=1700)
def parents(cost, weight, step, width, rows, pad, jump, side, other, price, limit, halt):
    """The same for any step set (``price``: of each step, in the order of ``step``)."""
    w = u64(width)
    for y in range(u64(pad), u64(rows - pad)):
        if stopped(halt):
            return
        begin = y * w + u64(pad)
        end = begin + w - u64(2 * pad)
        for j in range(len(jump)):
            k = len(jump) - 1 - j
            ahead = u64(jump[k])
            first = u64(side[k])
            second = u64(other[k])
            base = price[k]
            for at in range(begin, end):
                c = cost[at]
                here = cost[at + ahead]
                offered = here + base * (TERRAIN_UNIT + weight[at + ahead])
                free = (here | cost[at + first] | cost[at + second]) >= 0
                step[at] = k if (offered == c) & free & (c <= limit) else step[at]
    for y in range(u64(rows)):
        if stopped(halt):
            return
        for i in range(y * w, y * w + w):
            cost[i] = cost[i] if cost[i] <= limit else -1
