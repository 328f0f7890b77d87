"""Costs to goals over the cells of a map, in units of a lattice, no farther than paths from one start can want them.

The windows are those of :func:`lampyris.kernels.field.wavefront.windows`, where corners may be cut; a cell through which every
chain from the start to a goal costs more than is asked for counts as a wall.
"""

from __future__ import annotations

from lampyris.kernels._jit import fetch, kernel, stopped, u64
from lampyris.kernels.field.bucket_wavefront import lay_out


@kernel(out=("cost", "order"), each=800)
def flood(free, cost, order, bench, width, pad, goals, start, most, straight, diagonal, never, halt):
    """Write the cost from each cell to the nearest goal, window by window; returns how many cells were expanded.

    Parameters
    ----------
    free : uint8 (height * width inside the border,): 1 where a cell may be entered.
    cost : int64 (cells,): the result; -1 where no chain leads, and in cells that are left out.
    order : uint32 (2 bench + 25,): room; ``bench`` is more than there are cells inside the border.
    width, pad : of a row with its border; cells of the border on each side.
    goals : int64 (g,): indices of cells.
    start : index of a cell.
    most : cells c are left out where cost and octile distance from c to the start come to more; negative: none is.
    straight, diagonal : whole costs of the steps, of which the second is the greater, and at most twice the first.
    never : more than any cost.
    """
    lay_out(free, cost, width, pad, never, -1, halt)
    w = u64(width)
    one = u64(1)
    ahead = u64(24)
    late = u64(bench)
    waiting = late
    start_y = start // width
    start_x = start - start_y * width
    extra = diagonal - straight
    tail = u64(0)
    for k in range(len(goals)):
        goal = u64(goals[u64(k)])
        if cost[goal] == never:
            cost[goal] = 0
            order[tail] = goal
            tail += one
    head = u64(0)
    end = tail
    hi = straight
    expanded = 0
    while head < end or waiting > late:
        hi_next = hi + straight
        if stopped(halt):
            return expanded
        # Those that waited, less those that a cheaper chain has brought in meanwhile.
        for i in range(late, waiting, one):
            order[tail] = order[i]
            tail = tail + one if cost[order[i]] >= hi else tail
        waiting = late
        while head < end:
            far = order[head + ahead]
            fetch(cost, far - w)
            fetch(cost, far + w)
            p = u64(order[head])
            d = cost[p]
            head += one
            if most >= 0:
                y = int(p) // width
                x = abs(int(p) - y * width - start_x)
                y = abs(y - start_y)
                if d + straight * max(x, y) + extra * min(x, y) > most:
                    cost[p] = -1
                    continue
            expanded += 1
            up = p - w
            down = p + w
            c = d + straight
            for n in (up, p - one, p + one, down):
                old = cost[n]
                order[tail] = n
                tail = tail + one if old >= hi_next else tail
                cost[n] = old if old < c else c
            c = d + diagonal
            soon = c < hi_next
            t = tail if soon else waiting
            bar = hi_next if soon else hi_next + straight
            for n in (up - one, up + one, down - one, down + one):
                old = cost[n]
                order[t] = n
                t = t + one if old >= bar else t
                cost[n] = old if old < c else c
            tail = t if soon else tail
            waiting = waiting if soon else t
        end = tail
        hi = hi_next
    for i in range(u64(0), u64(len(cost)), one):
        cost[i] = -1 if cost[i] == never else cost[i]
    return expanded
