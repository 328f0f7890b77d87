"""Read heads: cost-to-goal level by level, for step sets of few prices that are whole numbers.

Cells settle in rising cost, so one list holds them all, and one read head for each price walks it: the head
of price p spends such steps from the cells of cost d - p. The next level's cost is the least that any head
would come to. Every neighbour is written at the end of the list *unconditionally*, and the end advances by 0
or 1 (a branch mispredicted at every second neighbour would cost more than the work): clutter costs no more
than open floor. A byte a cell tells what nothing has touched yet, small enough to stay in the cache; all that
a level touches has that level's cost, which is written when the level is whole.

* :func:`one_head`: four moves.
* :func:`two_heads`: straights and diagonals, corners cut (``dissertation``).
* :func:`three_heads`: knight's moves besides, no corners cut (``sixteen-connected``).

Roads not taken, measured on maps of 512 x 512 cells: parents and luciferin in the same loop, one direction at
a time so that the first touch is the parent (as quick in the open, twice as slow in clutter, where levels are
short and every loop's end is mispredicted); luciferin when a cell is read again (half as slow again: stores
to far memory hold up all the others); a cost that marks its own cells and no byte (12 % slower, 18 % at
1024 x 1024); in mazes, where a level is a cell or two, one cell a turn without any branch (as slow or slower:
each turn waits for the stores of the last), or windows (a sixth quicker there, but who knows it is a maze);
one record a cell instead of three arrays, and four neighbours through one table look-up (no gain). So parents
and luciferin have passes of their own, in :mod:`.descent`.
"""

from __future__ import annotations

from lampyris.kernels._jit import fetch, kernel, stopped, u64


@kernel(out=("plan",))
def lay_out(free, plan, width, pad, open_cell, shut, halt):
    """A map into its frame: ``shut`` in walls and border, ``open_cell`` in free cells."""
    inside = u64(width - 2 * pad)
    at = u64(width * pad + pad)
    for i in range(at):
        plan[i] = shut
    seam = u64(2 * pad)
    for row in range(u64(0), u64(len(free)), inside):
        if stopped(halt):
            return
        for x in range(inside):
            plan[at + x] = open_cell if free[row + x] else shut
        at += inside
        for x in range(seam):
            plan[at + x] = shut
        at += seam
    for i in range(at, u64(len(plan))):
        plan[i] = shut


@kernel(out=("cost", "fresh", "order", "level_cost", "level_end"))
def one_head(free, cost, fresh, order, level_cost, level_end, width, goal, stop, straight, never, halt):
    """Settle every cell that can reach the goal by straight steps; arguments as for :func:`two_heads`."""
    lay_out(free, cost, width, 1, never, -1, halt)
    lay_out(free, fresh, width, 1, 1, 0, halt)
    w = u64(width)
    one = u64(1)
    ahead = u64(24)
    order[0] = goal
    cost[goal] = 0
    fresh[goal] = 0
    tail = one
    head = u64(0)
    levels = 1
    d = 0
    level_cost[0] = 0
    level_end[0] = 1
    # With the level of the goal all is done if that is where to stop.
    while head < tail and stop != goal:
        begin = tail
        if stopped(halt):
            return levels
        d += straight
        for i in range(head, begin):
            p = order[i]
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
        head = begin
        if tail > begin:
            for i in range(begin, tail):
                fetch(cost, order[i + ahead] + u64(0))
                cost[order[i]] = d
            level_cost[levels] = d
            level_end[levels] = tail
            levels += 1
            if stop > 0 and cost[stop] <= d:
                break
    return levels


@kernel(out=("cost", "fresh", "order", "level_cost", "level_end"), each=900)
def two_heads(
    free, cost, fresh, order, level_cost, level_end, width, goal, stop, straight, diagonal, never, halt
):
    """Settle every cell that can reach the goal, corners cut, level by level; return how many levels.

    Parameters
    ----------
    free : uint8, (height * width inside the border,); 1 where a cell may be entered.
    cost : signed, (n,); the result: exact cost, -1 in walls and border, ``never`` in cells that were not
        reached.
    fresh : uint8, (n,); scratch: 1 in free cells that nothing has touched yet.
    order : uint32, (cells inside + 25,); the cells as they settled.
    level_cost, level_end : uint32, (cells inside + 1,); the cost of each level, and where in
        ``order`` it ends.
    width : of a padded row; the border is one cell wide.
    goal, stop : cells; expansion ends with the level of ``stop``, 0 for never.
    never : more than any cost.
    """
    lay_out(free, cost, width, 1, never, -1, halt)
    lay_out(free, fresh, width, 1, 1, 0, halt)
    w = u64(width)
    one = u64(1)
    ahead = u64(24)
    order[0] = goal
    cost[goal] = 0
    fresh[goal] = 0
    tail = one
    near = u64(0)
    far = u64(0)
    near_level = 0
    far_level = 0
    levels = 1
    level_cost[0] = 0
    level_end[0] = 1
    # The far head lags: when it has no level left, the near one has none either.
    while far_level < levels and stop != goal:
        by_diagonal = int(level_cost[far_level]) + diagonal
        by_straight = int(level_cost[near_level]) + straight if near_level < levels else by_diagonal + 1
        d = min(by_straight, by_diagonal)
        begin = tail
        if stopped(halt):
            return levels
        if by_diagonal == d:
            end = u64(level_end[far_level])
            for i in range(far, end):
                up = order[i] - w
                down = order[i] + w
                n = up - one
                order[tail] = n
                tail += u64(fresh[n])
                fresh[n] = 0
                n = up + one
                order[tail] = n
                tail += u64(fresh[n])
                fresh[n] = 0
                n = down - one
                order[tail] = n
                tail += u64(fresh[n])
                fresh[n] = 0
                n = down + one
                order[tail] = n
                tail += u64(fresh[n])
                fresh[n] = 0
            far = end
            far_level += 1
        if by_straight == d:
            end = u64(level_end[near_level])
            for i in range(near, end):
                p = order[i]
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
            near = end
            near_level += 1
        if tail > begin:
            for i in range(begin, tail):
                fetch(cost, order[i + ahead] + u64(0))
                cost[order[i]] = d
            level_cost[levels] = d
            level_end[levels] = tail
            levels += 1
            if stop > 0 and cost[stop] <= d:
                break
    return levels


@kernel(out=("order", "fresh"), inline=True)
def _leaps(order, fresh, p, w, tail):
    """Touch what knight's moves from ``p`` come to; the new end of the list."""
    one = u64(1)
    two = u64(2)
    up = p - w
    down = p + w
    # What may be passed on the way: bit 1 of the two cells between the ends of a leap.
    north = fresh[up] >> 1
    south = fresh[down] >> 1
    west = fresh[p - one] >> 1
    east = fresh[p + one] >> 1
    nw = fresh[up - one] >> 1
    ne = fresh[up + one] >> 1
    sw = fresh[down - one] >> 1
    se = fresh[down + one] >> 1
    n = up - two
    order[tail] = n
    ok = west & nw & fresh[n] & 1
    tail += u64(ok)
    fresh[n] -= ok
    n = up + two
    order[tail] = n
    ok = east & ne & fresh[n] & 1
    tail += u64(ok)
    fresh[n] -= ok
    n = down - two
    order[tail] = n
    ok = west & sw & fresh[n] & 1
    tail += u64(ok)
    fresh[n] -= ok
    n = down + two
    order[tail] = n
    ok = east & se & fresh[n] & 1
    tail += u64(ok)
    fresh[n] -= ok
    n = up - w - one
    order[tail] = n
    ok = north & nw & fresh[n] & 1
    tail += u64(ok)
    fresh[n] -= ok
    n = up - w + one
    order[tail] = n
    ok = north & ne & fresh[n] & 1
    tail += u64(ok)
    fresh[n] -= ok
    n = down + w - one
    order[tail] = n
    ok = south & sw & fresh[n] & 1
    tail += u64(ok)
    fresh[n] -= ok
    n = down + w + one
    order[tail] = n
    ok = south & se & fresh[n] & 1
    tail += u64(ok)
    fresh[n] -= ok
    return tail


@kernel(out=("cost", "fresh", "order", "level_cost", "level_end"), each=2200)
def three_heads(
    free,
    cost,
    fresh,
    order,
    level_cost,
    level_end,
    width,
    goal,
    stop,
    straight,
    diagonal,
    knight,
    never,
    halt,
):
    """Settle every cell that can reach the goal by straights, diagonals and knight's moves, no corner cut.

    Arguments as for :func:`two_heads`, with a border two cells wide. ``fresh`` holds 2 in free cells
    and 1 more while nothing has touched them: both tests of a step are bits of one byte. A step's legality
    is that of its reverse, so that steps are looked at from the cell they come to.
    """
    lay_out(free, cost, width, 2, never, -1, halt)
    lay_out(free, fresh, width, 2, 3, 0, halt)
    w = u64(width)
    one = u64(1)
    ahead = u64(24)
    order[0] = goal
    cost[goal] = 0
    fresh[goal] = 2
    tail = one
    near = u64(0)
    far = u64(0)
    leap = u64(0)
    near_level = 0
    far_level = 0
    leap_level = 0
    levels = 1
    level_cost[0] = 0
    level_end[0] = 1
    # The leaping head lags: when it has no level left, the others have none either.
    while leap_level < levels and stop != goal:
        by_knight = int(level_cost[leap_level]) + knight
        by_diagonal = int(level_cost[far_level]) + diagonal if far_level < levels else by_knight + 1
        by_straight = int(level_cost[near_level]) + straight if near_level < levels else by_knight + 1
        d = min(by_straight, by_diagonal, by_knight)
        begin = tail
        if stopped(halt):
            return levels
        if by_knight == d:
            end = u64(level_end[leap_level])
            for i in range(leap, end):
                tail = _leaps(order, fresh, u64(order[i]), w, tail)
            leap = end
            leap_level += 1
        if by_diagonal == d:
            end = u64(level_end[far_level])
            for i in range(far, end):
                p = order[i]
                up = p - w
                down = p + w
                north = fresh[up] >> 1
                south = fresh[down] >> 1
                west = fresh[p - one] >> 1
                east = fresh[p + one] >> 1
                n = up - one
                order[tail] = n
                ok = north & west & fresh[n] & 1
                tail += u64(ok)
                fresh[n] -= ok
                n = up + one
                order[tail] = n
                ok = north & east & fresh[n] & 1
                tail += u64(ok)
                fresh[n] -= ok
                n = down - one
                order[tail] = n
                ok = south & west & fresh[n] & 1
                tail += u64(ok)
                fresh[n] -= ok
                n = down + one
                order[tail] = n
                ok = south & east & fresh[n] & 1
                tail += u64(ok)
                fresh[n] -= ok
            far = end
            far_level += 1
        if by_straight == d:
            end = u64(level_end[near_level])
            for i in range(near, end):
                p = order[i]
                n = p - w
                order[tail] = n
                ok = fresh[n] & 1
                tail += u64(ok)
                fresh[n] -= ok
                n = p - one
                order[tail] = n
                ok = fresh[n] & 1
                tail += u64(ok)
                fresh[n] -= ok
                n = p + one
                order[tail] = n
                ok = fresh[n] & 1
                tail += u64(ok)
                fresh[n] -= ok
                n = p + w
                order[tail] = n
                ok = fresh[n] & 1
                tail += u64(ok)
                fresh[n] -= ok
            near = end
            near_level += 1
        if tail > begin:
            for i in range(begin, tail):
                fetch(cost, order[i + ahead] + u64(0))
                cost[order[i]] = d
            level_cost[levels] = d
            level_end[levels] = tail
            levels += 1
            if stop > 0 and cost[stop] <= d:
                break
    return levels
