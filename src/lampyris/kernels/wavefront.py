"""Wavefronts: cost-to-goal without a heap, then parents and luciferin, over padded flat maps.

Every map here has a border of walls, so that no loop asks whether a neighbour is on the map; a cell is its
index in the padded map. A wavefront writes ``order``, the cells as they settle, and ``toll``, the exact
cost of each of them.

Three wavefronts share one trick (a branch mispredicted at every second neighbour would cost more than the
work): each neighbour is written at the end of a list *unconditionally* and the end advances by 0 or 1. So
clutter costs no more than open floor.

* :func:`two_heads`: two step costs and corner cutting (``dissertation``). Cells settle in rising cost, so
  one list holds them all and two read heads walk it: one spends straight steps from the cells of cost d -
  a, one diagonal steps from those of cost d - b. No cell is touched before its cost is known, so a byte a
  cell is all that the inner loop reads.
* :func:`windows`: any two step costs a < b <= 2 a, with or without corner cutting (``octile``). Costs are
  too various for levels, but within a window of width a the order does not matter: no step leads from the
  window into itself.
* :func:`ripple`: any step set with costs below three straights (``four``, ``sixteen``); the same windows,
  moves from a table.

The parents come from a pass of their own that compares eight shifted maps at once, the luciferin from
another in settling order. Roads not taken, measured on 512 x 512 cells: all in the first loop, one
direction at a time so that the first touch is the parent (level in the open, twice as slow in clutter,
where levels are short and every loop's end is mispredicted); one record a cell instead of three arrays (no
gain); four neighbours through one table look-up (10 % gain, needs vector code).
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64


@kernel(out=("cost", "fresh", "order", "toll"))
def two_heads(cost, fresh, order, toll, ring_cost, ring_end, width, goal, stop, straight, diagonal):
    """Settle every cell that can reach the goal, corner cutting allowed; return how many.

    Parameters
    ----------
    cost : signed, (n,); -1 everywhere on entry. Exact costs on return.
    fresh : uint8, (n,); 1 where a cell may be entered, 0 at walls. All reached cells are 0 on return.
    order : uint32, (n + 1,); the cells as they settled.
    toll : as ``cost``, (n + 1,); what each of them costs.
    ring_cost, ring_end : int64, (16,); scratch. Of the levels from d - diagonal to d each may be waiting
        for a head, so ``diagonal`` must be below 16.
    width : of a padded row.
    goal, stop : cells; expansion ends with the level of ``stop``, 0 for never.
    """
    w = u64(width)
    one = u64(1)
    order[0] = goal
    toll[0] = 0
    cost[goal] = 0
    fresh[goal] = 0
    tail = one
    near = u64(0)
    far = u64(0)
    near_level = 0
    far_level = 0
    levels = 1
    ring_cost[0] = 0
    ring_end[0] = 1
    # The far head lags: when it has no level left, the near one has none either.
    while far_level < levels:
        by_diagonal = ring_cost[far_level & 15] + diagonal
        by_straight = ring_cost[near_level & 15] + straight if near_level < levels else by_diagonal + 1
        d = min(by_straight, by_diagonal)
        begin = tail
        if by_diagonal == d:
            end = u64(ring_end[far_level & 15])
            for i in range(far, end):
                up = order[i] - w
                down = order[i] + w
                n = up - one
                order[tail] = n
                tail += fresh[n]
                fresh[n] = 0
                n = up + one
                order[tail] = n
                tail += fresh[n]
                fresh[n] = 0
                n = down - one
                order[tail] = n
                tail += fresh[n]
                fresh[n] = 0
                n = down + one
                order[tail] = n
                tail += fresh[n]
                fresh[n] = 0
            far = end
            far_level += 1
        if by_straight == d:
            end = u64(ring_end[near_level & 15])
            for i in range(near, end):
                p = order[i]
                n = p - w
                order[tail] = n
                tail += fresh[n]
                fresh[n] = 0
                n = p - one
                order[tail] = n
                tail += fresh[n]
                fresh[n] = 0
                n = p + one
                order[tail] = n
                tail += fresh[n]
                fresh[n] = 0
                n = p + w
                order[tail] = n
                tail += fresh[n]
                fresh[n] = 0
            near = end
            near_level += 1
        if tail > begin:
            for i in range(begin, tail):
                cost[order[i]] = d
                toll[i] = d
            ring_cost[levels & 15] = d
            ring_end[levels & 15] = tail
            levels += 1
            if stop > 0 and cost[stop] >= 0:
                break
    return tail


@kernel(out=("cost", "order", "toll"))
def windows(cost, order, toll, bench, width, goal, stop, straight, diagonal, guard):
    """Settle every cell that can reach the goal, window by window of width ``straight``; return how many.

    Parameters
    ----------
    cost : signed, (n,); -1 at walls, elsewhere more than any cost, on entry. Exact for settled cells on
        return; with ``stop``, cells beyond it may hold a cost that is no more than an upper bound.
    order : uint32, (2 n + 2,); from ``bench`` (>= n + 1) on lie cells that wait for the window after next.
    toll : as ``cost``, (n + 1,).
    goal, stop : cells; what costs more than ``stop`` is not settled; 0 for never.
    guard : -1 if both side cells of a diagonal must be free, 0 if not.
    """
    w = u64(width)
    one = u64(1)
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
def ripple(cost, order, toll, ends, bench, jump, side, other, price, goal, stop, straight):
    """Settle every cell that can reach the goal by any step set, window by window; return how many.

    Parameters
    ----------
    cost, toll, goal, stop : as for :func:`windows`.
    order : uint32, (3 n + 3,); from ``bench`` on the window after next waits, from twice ``bench`` on the
        one after that.
    ends : uint64, (3,); scratch, the ends of those three lists.
    jump : int64, (m,); index offset of each step.
    side, other : int64, (m,); offsets of the two cells that must be free besides (the end itself where
        there is none).
    price : exact costs, (m,); every one from ``straight`` to below three times that.
    """
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


@kernel(out=("cost", "step"))
def parents8(cost, step, width, rows, straight, diagonal, guard, limit):
    """The local parent rule for eight moves; costs above ``limit`` become -1.

    For each cell the first offset, in the order (-1,-1) (1,-1) (-1,1) (1,1) (-1,0) (1,0) (0,-1) (0,1), at
    which a neighbour costs exactly one such step less (method.md section 2). The choices are made last
    first, each overwriting the one before, so that there is no branch and the compiler handles many cells
    at once.

    Cells that lose their cost here cannot be missed as parents or side cells of those that keep theirs:
    both cost less.
    """
    w = u64(width)
    one = u64(1)
    two = u64(2)
    below = w + w
    for i in range(u64(width * (rows - 2) - 2)):
        at = i + w + one
        c = cost[at]
        near = c - straight
        far = c - diagonal
        up = cost[i + one]
        left = cost[i + w]
        right = cost[i + w + two]
        down = cost[i + below + one]
        k = 7 if down == near else -1
        k = 6 if up == near else k
        k = 5 if right == near else k
        k = 4 if left == near else k
        k = 3 if (cost[i + below + two] == far) & (((down | right) & guard) >= 0) else k
        k = 2 if (cost[i + below] == far) & (((down | left) & guard) >= 0) else k
        k = 1 if (cost[i + two] == far) & (((up | right) & guard) >= 0) else k
        k = 0 if (cost[i] == far) & (((up | left) & guard) >= 0) else k
        step[at] = k if (c <= limit) & (c > 0) else -1
    # A loop of its own: a map that is read at eight offsets while it is written cannot be handled many
    # cells at once.
    for i in range(u64(len(cost))):
        cost[i] = cost[i] if cost[i] <= limit else -1


@kernel(out=("cost", "step"))
def parents(cost, step, width, rows, pad, jump, side, other, price, limit):
    """The local parent rule for any step set (arguments as for :func:`ripple`); costs above ``limit``
    become -1.

    Row by row, one step of the set at a time, the last first, for the same reason as in :func:`parents8`.
    """
    w = u64(width)
    for y in range(u64(pad), u64(rows - pad)):
        begin = y * w + u64(pad)
        end = begin + w - u64(2 * pad)
        for j in range(len(jump)):
            k = len(jump) - 1 - j
            ahead = u64(jump[k])
            first = u64(side[k])
            second = u64(other[k])
            toll = price[k]
            for at in range(begin, end):
                c = cost[at]
                here = cost[at + ahead]
                hit = (here == c - toll) & ((here | cost[at + first] | cost[at + second]) >= 0) & (c <= limit)
                step[at] = k if hit else step[at]
    for i in range(u64(len(cost))):
        cost[i] = cost[i] if cost[i] <= limit else -1


@kernel(out=("luciferin",))
def glow(order, toll, count, step, jump, luciferin, keep, gamma, unit):
    """Luciferin along parents, in settling order: ``luc = keep luc(parent) + gamma (cost / unit)``, 0 at
    the goal.

    Sums are formed in exactly this order, cost divided first, so that both forms agree to the last bit.
    """
    luciferin[order[0]] = 0.0
    for i in range(u64(1), u64(count)):
        n = order[i]
        luciferin[n] = keep * luciferin[n + u64(jump[step[n]])] + gamma * (toll[i] / unit)
