"""From cost to descent: each cell's parent, and the luciferin that falls along parents.

Maps are padded and flat, as :mod:`.wavefront` leaves them.
"""

from __future__ import annotations

from lampyris.kernels._jit import fetch, kernel, u64


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
    for y in range(u64(rows - 2)):
        begin = y * w
        end = begin + w - two
        if guard == 0:
            # Without the corner rule half of the work falls away.
            for i in range(begin, end):
                c = cost[i + w + one]
                near = c - straight
                far = c - diagonal
                k = 7 if cost[i + below + one] == near else -1
                k = 6 if cost[i + one] == near else k
                k = 5 if cost[i + w + two] == near else k
                k = 4 if cost[i + w] == near else k
                k = 3 if cost[i + below + two] == far else k
                k = 2 if cost[i + below] == far else k
                k = 1 if cost[i + two] == far else k
                k = 0 if cost[i] == far else k
                step[i + w + one] = k if (c <= limit) & (c > 0) else -1
        else:
            for i in range(begin, end):
                c = cost[i + w + one]
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
                k = 3 if (cost[i + below + two] == far) & ((down | right) >= 0) else k
                k = 2 if (cost[i + below] == far) & ((down | left) >= 0) else k
                k = 1 if (cost[i + two] == far) & ((up | right) >= 0) else k
                k = 0 if (cost[i] == far) & ((up | left) >= 0) else k
                step[i + w + one] = k if (c <= limit) & (c > 0) else -1
        # The row above is done with, and still in the cache. In the loop before this one it could not be
        # written: a map that is read at eight offsets while it is written cannot be handled many cells at
        # once.
        for i in range(begin, begin + w):
            cost[i] = cost[i] if cost[i] <= limit else -1
    for i in range(u64(rows - 2) * w, u64(rows) * w):
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
def glow(order, count, cost, step, jump, luciferin, nothing, keep, gamma, unit):
    """Luciferin along parents: ``luc = keep luc(parent) + gamma (cost / unit)``, 0 at the goal.

    ``order`` has each cell after its parent. Sums are formed in exactly this order, cost divided first, so
    that both forms agree to the last bit. ``nothing`` is what cells get that were not reached.
    """
    for i in range(u64(len(luciferin))):
        luciferin[i] = nothing
    luciferin[order[0]] = 0.0
    ahead = u64(24)
    for i in range(u64(1), u64(count)):
        fetch(luciferin, order[i + ahead] + u64(0))
        n = order[i]
        luciferin[n] = keep * luciferin[n + u64(jump[step[n]])] + gamma * (cost[n] / unit)
