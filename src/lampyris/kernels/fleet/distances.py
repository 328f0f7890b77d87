"""Distance tables: the number of four-connected steps from every free cell to each robot's goal.

Multi-robot planners look up a few cells of every robot's table at every tick, so the tables hold free cells only
(a cell's number is its rank among the free cells, row by row), a row a robot, in the smallest type that fits. The
wave is that of :mod:`lampyris.kernels.field.bucket_wavefront`: neighbours are appended unconditionally and the end of
the list advances by 0 or 1. That kernel writes a padded map, levels and costs of one goal a call; on 28,000 free
cells this one takes about two thirds of its time and half of its memory, for all goals in one call.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64


@kernel(out=("table", "order", "fresh"), of="table", each=900)
def distance_rows(edge, goals, table, order, fresh, never, halt):
    """Fill a row of ``table`` for each goal; how many rows are done: fewer than goals if a distance does not fit.

    Parameters
    ----------
    edge : int32, (4 * cells,); the neighbours of each free cell, ``cells`` where there is none.
    goals : int32, (rows,); cells.
    table : signed, (rows * cells,); the result, ``never`` in cells that cannot reach the goal.
    order : uint32, (cells + 5,); scratch.
    fresh : uint8, (cells + 1,); scratch.
    never : the largest value of the table's type.
    """
    cells = u64(len(fresh) - 1)
    row = u64(0)
    for k in range(len(goals)):
        for i in range(cells):
            fresh[i] = 1
            table[row + i] = never
        fresh[cells] = 0
        goal = u64(goals[k])
        order[0] = goal
        fresh[goal] = 0
        table[row + goal] = 0
        head = u64(0)
        tail = u64(1)
        d = 0
        while head < tail:
            begin = tail
            d += 1
            if stopped(halt) or d >= never:
                return k
            for i in range(head, begin):
                at = u64(order[i]) * u64(4)
                for j in range(u64(4)):
                    n = u64(edge[at + j])
                    order[tail] = n
                    tail += u64(fresh[n])
                    fresh[n] = 0
            for i in range(begin, tail):
                table[row + u64(order[i])] = d
            head = begin
        row += cells
    return len(goals)
