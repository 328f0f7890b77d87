"""Wavefronts: cost-to-goal without a heap, then parents and luciferin, over padded flat maps.

Every map here has a border of walls, so that no loop asks whether a neighbour is on the map; a cell is its
index in the padded map. A wavefront writes ``order``, the cells as they settle.

Three wavefronts share one trick (a branch mispredicted at every second neighbour would cost more than the
work): each neighbour is written at the end of a list *unconditionally* and the end advances by 0 or 1. So
clutter costs no more than open floor.

* :func:`two_heads`: two step costs and corner cutting (``dissertation``). Cells settle in rising cost, so one
  list holds them all and two read heads walk it: one spends straight steps from the cells of cost d - a, one
  diagonal steps from those of cost d - b. A byte a cell tells what is fresh, small enough to stay in the
  cache; all that a level touches has that level's cost, which is written when the level is whole.
* :func:`windows`: any two step costs a < b <= 2 a, with or without corner cutting (``octile``). Costs are too
  various for levels, but within a window of width a the order does not matter: no step leads from the window
  into itself.
* :func:`ripple`: any step set with costs below three straights (``four``, ``sixteen``); the same windows,
  moves from a table.

Roads not taken, measured on maps of 512 x 512 cells: parents and luciferin in the same loop, one direction at
a time so that the first touch is the parent (as quick in the open, twice as slow in clutter, where levels are
short and every loop's end is mispredicted); luciferin when a cell is read again (half as slow again: stores
to far memory hold up all the others); a cost that marks its own cells and no byte (12 % slower, 18 % at
1024 x 1024); one record a cell instead of three arrays, and four neighbours through one table look-up (no
gain). So parents and luciferin have passes of their own, in :mod:`.descent`.
"""

from __future__ import annotations

from lampyris.kernels._jit import fetch, kernel, u64


@kernel(out=("plan",))
def _lay_out(free, plan, width, pad, open_cell, shut):
    """A map into its frame: ``shut`` in walls and border, ``open_cell`` in free cells."""
    inside = u64(width - 2 * pad)
    at = u64(width * pad + pad)
    for i in range(at):
        plan[i] = shut
    seam = u64(2 * pad)
    for row in range(u64(0), u64(len(free)), inside):
        for x in range(inside):
            plan[at + x] = open_cell if free[row + x] else shut
        at += inside
        for x in range(seam):
            plan[at + x] = shut
        at += seam
    for i in range(at, u64(len(plan))):
        plan[i] = shut


@kernel(out=("cost", "fresh", "order", "level_cost", "level_end"))
def two_heads(free, cost, fresh, order, level_cost, level_end, width, goal, stop, straight, diagonal, never):
    """Settle every cell that can reach the goal, corners cut, level by level; return how many levels.

    Parameters
    ----------
    free : uint8, (height * width inside the border,); 1 where a cell may be entered.
    cost : signed, (n,); the result: exact cost, -1 in walls and border, ``never`` in cells that were not
        reached.
    fresh : uint8, (n,); scratch: 1 in free cells that nothing has touched yet.
    order : uint32, (n + 25,); the cells as they settled.
    level_cost, level_end : uint32, (n + 1,); the cost of each level, and where in ``order`` it ends.
    width : of a padded row; the border is one cell wide.
    goal, stop : cells; expansion ends with the level of ``stop``, 0 for never.
    never : more than any cost.
    """
    _lay_out(free, cost, width, 1, never, -1)
    _lay_out(free, fresh, width, 1, 1, 0)
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
    while far_level < levels:
        by_diagonal = int(level_cost[far_level]) + diagonal
        by_straight = int(level_cost[near_level]) + straight if near_level < levels else by_diagonal + 1
        d = min(by_straight, by_diagonal)
        begin = tail
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


@kernel(out=("cost", "order", "toll"))
def windows(free, cost, order, toll, bench, width, goal, stop, straight, diagonal, guard, never):
    """Settle every cell that can reach the goal, window by window of width ``straight``; return how many.

    Parameters
    ----------
    free, cost, width, never : as for :func:`two_heads`; with ``stop``, cells beyond it may hold a cost that
        is no more than an upper bound.
    order : uint32, (2 n + 2,); from ``bench`` (>= n + 1) on lie cells that wait for the window after next.
    toll : as ``cost``, (n + 1,).
    goal, stop : cells; what costs more than ``stop`` is not settled; 0 for never.
    guard : -1 if both side cells of a diagonal must be free, 0 if not.
    """
    _lay_out(free, cost, width, 1, never, -1)
    w = u64(width)
    one = u64(1)
    ahead = u64(24)
    late = u64(bench)
    waiting = late
    cost[goal] = 0
    order[0] = goal
    head = u64(0)
    begin = head
    end = one
    tail = one
    hi = straight
    # Where corners may be cut the next window can be empty while diagonals wait beyond it.
    while head < end or waiting > late:
        hi_next = hi + straight
        # Those that waited, less those that a cheaper way has brought in meanwhile.
        for i in range(late, waiting):
            order[tail] = order[i]
            tail = tail + one if cost[order[i]] >= hi else tail
        waiting = late
        begin = head
        while head < end:
            far = order[head + ahead]
            fetch(cost, far - w)
            fetch(cost, far + w)
            fetch(cost, far - one)
            fetch(cost, far + one)
            p = order[head]
            d = cost[p]
            toll[head] = d
            head += one
            up = p - w
            left = p - one
            right = p + one
            down = p + w
            # A straight step always lands in the next window.
            c = d + straight
            old_up = cost[up]
            order[tail] = up
            tail = tail + one if old_up >= hi_next else tail
            cost[up] = old_up if old_up < c else c
            old_left = cost[left]
            order[tail] = left
            tail = tail + one if old_left >= hi_next else tail
            cost[left] = old_left if old_left < c else c
            old_right = cost[right]
            order[tail] = right
            tail = tail + one if old_right >= hi_next else tail
            cost[right] = old_right if old_right < c else c
            old_down = cost[down]
            order[tail] = down
            tail = tail + one if old_down >= hi_next else tail
            cost[down] = old_down if old_down < c else c
            # A diagonal lands in the next window or the one after, the same for all four: one list end
            # serves. Behind a shut corner a cell looks like a wall.
            c = d + diagonal
            soon = c < hi_next
            t = tail if soon else waiting
            bar = hi_next if soon else hi_next + straight
            n = up - one
            old = cost[n]
            seen = -1 if (old | ((old_up | old_left) & guard)) < 0 else old
            order[t] = n
            t = t + one if seen >= bar else t
            cost[n] = old if seen < c else c
            n = up + one
            old = cost[n]
            seen = -1 if (old | ((old_up | old_right) & guard)) < 0 else old
            order[t] = n
            t = t + one if seen >= bar else t
            cost[n] = old if seen < c else c
            n = down - one
            old = cost[n]
            seen = -1 if (old | ((old_down | old_left) & guard)) < 0 else old
            order[t] = n
            t = t + one if seen >= bar else t
            cost[n] = old if seen < c else c
            n = down + one
            old = cost[n]
            seen = -1 if (old | ((old_down | old_right) & guard)) < 0 else old
            order[t] = n
            t = t + one if seen >= bar else t
            cost[n] = old if seen < c else c
            tail = t if soon else tail
            waiting = waiting if soon else t
        if stop > 0 and cost[stop] < hi:
            return _keep(order, toll, begin, head, cost[stop])
        end = tail
        hi = hi_next
    return head


@kernel(out=("cost", "order", "toll"))
def ripple(
    free, cost, order, toll, ends, bench, jump, side, other, price, width, pad, goal, stop, straight, never
):
    """Settle every cell that can reach the goal by any step set, window by window; return how many.

    Parameters
    ----------
    free, cost, toll, width, goal, stop, never : as for :func:`windows`.
    order : uint32, (3 n + 3,); from ``bench`` on the window after next waits, from twice ``bench`` on the
        one after that.
    ends : uint64, (3,); scratch, the ends of those three lists.
    jump : int64, (m,); index offset of each step.
    side, other : int64, (m,); offsets of the two cells that must be free besides (the end itself where
        there is none).
    pad : width of the border.
    price : exact costs, (m,); every one from ``straight`` to below three times that.
    """
    _lay_out(free, cost, width, pad, never, -1)
    late = u64(bench)
    later = late + late
    one = u64(1)
    cost[goal] = 0
    order[0] = goal
    head = u64(0)
    begin = head
    end = one
    ends[0] = one
    ends[1] = late
    ends[2] = later
    hi = straight
    # Up to two windows in a row may be empty while a long step is on its way.
    while head < end or ends[1] > late or ends[2] > later:
        hi_next = hi + straight
        hi_after = hi_next + straight
        tail = end
        for i in range(late, u64(ends[1])):
            order[tail] = order[i]
            tail = tail + one if cost[order[i]] >= hi else tail
        ends[0] = tail
        ends[1] = late
        for i in range(later, u64(ends[2])):
            order[i - late] = order[i]
            ends[1] = i - late + one
        ends[2] = later
        begin = head
        while head < end:
            p = order[head]
            d = cost[p]
            toll[head] = d
            head += one
            for k in range(len(jump)):
                n = p + u64(jump[k])
                old = cost[n]
                c = d + price[k]
                seen = -1 if (old | cost[p + u64(side[k])] | cost[p + u64(other[k])]) < 0 else old
                lane = (1 if c >= hi_next else 0) + (1 if c >= hi_after else 0)
                t = ends[lane]
                order[t] = n
                ends[lane] = t + one if seen >= hi_next + lane * straight else t
                cost[n] = old if seen < c else c
        if stop > 0 and cost[stop] < hi:
            return _keep(order, toll, begin, head, cost[stop])
        end = u64(ends[0])
        hi = hi_next
    return head


@kernel(out=("order", "toll"))
def _keep(order, toll, begin, end, limit):
    """Drop the cells of the last window that cost more than ``limit``; return how many are left in all."""
    one = u64(1)
    kept = begin
    for i in range(begin, end):
        order[kept] = order[i]
        toll[kept] = toll[i]
        kept = kept + one if toll[i] <= limit else kept
    return kept
