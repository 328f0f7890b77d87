"""Distance tables: the number of steps, four-connected or octile, from every free cell to each robot's goal.

Multi-robot planners look up a few cells of every robot's table at every tick, so the tables hold free cells only
(a cell's number is its rank among the free cells, row by row), a row a robot, in the smallest type that fits. The
wave is that of :func:`lampyris.kernels.field.bucket_wavefront.one_head`, on the padded map: neighbours are appended
unconditionally and the end of the list advances by 0 or 1. That kernel lays out a map and writes costs and levels of
one goal a call; this one writes the rows of all goals.

Rejected, measured with 1,000 goals on maps of 22,000 to 48,000 free cells: the wave on the graph of free cells (16
bytes of neighbours a cell, which do not fit in the cache, where the padded map has 4: 1.3 to 1.8 times the time).
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64


@kernel(out=("table", "order", "fresh"), of="table", each=900)
def distance_rows(ground, number, goals, table, order, fresh, width, cells, never, diagonal, halt):
    """Fill a row of ``table`` for each goal; how many rows are done: fewer than goals if a distance does not fit.

    Parameters
    ----------
    ground : uint8, (n,), padded; 1 in free cells.
    number : int32, (n,), padded; the number of each free cell.
    goals : int32, (rows,); free cells, padded indices.
    table : unsigned, (rows * cells,); the result, ``never`` in cells that cannot reach the goal.
    order : uint32, (cells + 9,); scratch.
    fresh : uint8, (n,); scratch.
    width : of a padded row; the border is one cell wide.
    cells : how many are free.
    never : no number of steps comes to it; at most the largest value of the table's type.
    diagonal : whether a diagonal step, between free cells, takes a step, too.
    """
    w = u64(width)
    one = u64(1)
    many = u64(cells)
    row = u64(0)
    for k in range(len(goals)):
        for i in range(u64(len(ground))):
            fresh[i] = ground[i]
        goal = u64(goals[k])
        order[0] = goal
        fresh[goal] = 0
        table[row + u64(number[goal])] = 0
        head = u64(0)
        tail = one
        d = 0
        while head < tail:
            begin = tail
            d += 1
            if stopped(halt) or d >= never:
                return k
            for i in range(head, begin):
                p = u64(order[i])
                n = p - w
                order[tail] = n
                tail += u64(fresh[n])
                fresh[n] = 0
                n = p - one
                order[tail] = n
                tail += u64(fresh[n])
                fresh[n] = 0
                n = p + one
                order[tail] = n
                tail += u64(fresh[n])
                fresh[n] = 0
                n = p + w
                order[tail] = n
                tail += u64(fresh[n])
                fresh[n] = 0
            if diagonal:
                for i in range(head, begin):
                    p = u64(order[i])
                    up = ground[p - w]
                    down = ground[p + w]
                    left = ground[p - one]
                    right = ground[p + one]
                    n = p - w - one
                    order[tail] = n
                    is_new = fresh[n] & up & left
                    tail += u64(is_new)
                    fresh[n] ^= is_new
                    n = p - w + one
                    order[tail] = n
                    is_new = fresh[n] & up & right
                    tail += u64(is_new)
                    fresh[n] ^= is_new
                    n = p + w - one
                    order[tail] = n
                    is_new = fresh[n] & down & left
                    tail += u64(is_new)
                    fresh[n] ^= is_new
                    n = p + w + one
                    order[tail] = n
                    is_new = fresh[n] & down & right
                    tail += u64(is_new)
                    fresh[n] ^= is_new
            for i in range(begin, tail):
                table[row + u64(number[order[i]])] = d
            head = begin
        if tail < many:
            for i in range(u64(len(ground))):
                if fresh[i] != 0:
                    table[row + u64(number[i])] = never
        row += many
    return len(goals)
