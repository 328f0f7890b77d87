"""Windows: cost-to-goal without a heap, for step costs too various for levels, over padded flat maps.

Every map here has a border of walls, so that no loop asks whether a neighbour is on the map; a cell is its
index in the padded map. A wavefront writes ``order``, the cells as they settle.

Within a window of costs as wide as the least step the order does not matter: no step leads from the window
into itself. As in :mod:`.bucket_wavefront`, a neighbour is written at the end of a list unconditionally.

* :func:`windows`: any two step costs a < b <= 2 a, with or without corner cutting (``octile``).
* :func:`ripple`: any step set with costs below three straights; moves from a table. For step sets of a
  caller's own: those of :mod:`lampyris.model.moves` have loops three to eight times as quick.
"""

from __future__ import annotations

from lampyris.kernels._jit import fetch, kernel, stopped, u64
from lampyris.kernels.field.bucket_wavefront import lay_out


@kernel(out=("cost", "order"), each=600)
def windows(free, cost, order, bench, width, goal, stop, straight, diagonal, guard, never, halt):
    """Settle every cell that can reach the goal, window by window of width ``straight``; return how many.

    Parameters
    ----------
    free, cost, width, never : as for :func:`.bucket_wavefront.two_heads`; with ``stop``, cells beyond it may hold a
        cost that is no more than an upper bound.
    order : uint32, (2 bench + 25,); from ``bench``, which is more than there are cells inside the border, lie
        cells that wait for the window after next.
    goal, stop : cells; what costs more than ``stop`` is not settled; 0 for never.
    guard : -1 if both side cells of a diagonal must be free, 0 if not.
    """
    lay_out(free, cost, width, 1, never, -1, halt)
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
        if stopped(halt):
            return head
        # Those that waited, less those that a cheaper path has brought in meanwhile.
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
            return _keep(order, cost, begin, head, cost[stop])
        end = tail
        hi = hi_next
    return head


@kernel(out=("cost", "order"), each=3000)
def ripple(
    free, cost, order, ends, bench, jump, side, other, price, width, pad, goal, stop, straight, never, halt
):
    """Settle every cell that can reach the goal by any step set, window by window; return how many.

    Parameters
    ----------
    free, cost, width, goal, stop, never : as for :func:`windows`.
    order : uint32, (3 n + 3,); from ``bench`` on the window after next waits, from twice ``bench`` on the
        one after that.
    ends : uint64, (3,); scratch, the ends of those three lists.
    jump : int64, (m,); index offset of each step.
    side, other : int64, (m,); offsets of the two cells that must be free besides (the end itself where
        there is none).
    pad : width of the border.
    price : exact costs, (m,); every one from ``straight`` to below three times that.
    """
    lay_out(free, cost, width, pad, never, -1, halt)
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
        if stopped(halt):
            return head
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
            return _keep(order, cost, begin, head, cost[stop])
        end = u64(ends[0])
        hi = hi_next
    return head


@kernel(out=("order",))
def _keep(order, cost, begin, end, limit):
    """Drop the cells of the last window that cost more than ``limit``; return how many are left in all."""
    one = u64(1)
    kept = begin
    for i in range(begin, end):
        order[kept] = order[i]
        kept = kept + one if cost[order[i]] <= limit else kept
    return kept
