"""From cost to descent: each cell's parent, and the luciferin that falls along parents.

Maps are padded and flat, as :mod:`.wavefront` leaves them.
"""

from __future__ import annotations

from lampyris.kernels._helpers import STRETCH
from lampyris.kernels._jit import fetch, kernel, stopped, u64
from lampyris.kernels.field import descent_arrays


@kernel(out=("cost", "step"), arrays=descent_arrays.parents8)
def parents8(cost, step, width, rows, straight, diagonal, guard, limit, halt):
    """The local parent rule for eight moves; costs above ``limit`` become -1.

    For each cell the first offset, in the order (-1,-1) (1,-1) (-1,1) (1,1) (-1,0) (1,0) (0,-1) (0,1), at
    which a neighbour costs exactly one such step less (method.md, "The field"). The choices are made last
    first, each overwriting the one before, so that there is no branch and the compiler handles many cells
    at once.

    No multiple of ``straight`` may be one less than ``diagonal``: such a cell would take walls, which hold
    -1, for cells that cost a diagonal step less.

    Cells that lose their cost here cannot be missed as parents or side cells of those that keep theirs:
    both cost less.
    """
    w = u64(width)
    one = u64(1)
    two = u64(2)
    below = w + w
    for y in range(u64(rows - 2)):
        if stopped(halt):
            return
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


@kernel(out=("cost", "step"), each=1100)
def parents(cost, step, width, rows, pad, jump, side, other, price, limit, halt):
    """The local parent rule for any step set (arguments as for :func:`ripple`); costs above ``limit``
    become -1.

    Row by row, one step of the set at a time, the last first, for the same reason as in :func:`parents8`.
    """
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
            toll = price[k]
            for at in range(begin, end):
                c = cost[at]
                here = cost[at + ahead]
                hit = (here == c - toll) & ((here | cost[at + first] | cost[at + second]) >= 0) & (c <= limit)
                step[at] = k if hit else step[at]
    for y in range(u64(rows)):
        if stopped(halt):
            return
        for i in range(y * w, y * w + w):
            cost[i] = cost[i] if cost[i] <= limit else -1


@kernel(out=("luciferin",), each=300, arrays=descent_arrays.glow)
def glow(order, count, cost, step, jump, luciferin, nothing, keep, gamma, unit, halt):
    """Luciferin along parents: ``luc = keep luc(parent) + gamma (cost / unit)``, 0 at the goal.

    ``order`` has each cell after its parent. Sums are formed in exactly this order, cost divided first, so
    that both forms agree to the last bit. ``nothing`` is what cells get that were not reached.
    """
    stretch = u64(STRETCH)
    for begin in range(u64(0), u64(len(luciferin)), stretch):
        if stopped(halt):
            return
        for i in range(begin, min(begin + stretch, u64(len(luciferin)))):
            luciferin[i] = nothing
    luciferin[order[0]] = 0.0
    ahead = u64(24)
    for begin in range(u64(1), u64(count), stretch):
        if stopped(halt):
            return
        for i in range(begin, min(begin + stretch, u64(count))):
            fetch(luciferin, order[i + ahead] + u64(0))
            n = order[i]
            luciferin[n] = keep * luciferin[n + u64(jump[step[n]])] + gamma * (cost[n] / unit)


@kernel(out=("luciferin",))
def _climb(cost, step, jump, luciferin, cell, keep, gamma, unit, halt):
    """Luciferin of one cell whose parent has none yet: up to the first that has, and down again.

    On the way up each cell is left a number that says which one it was come to from: -2 for none, below that
    -3 minus an index, which a float64 holds exactly.
    """
    p = u64(cell)
    came = -2.0
    climbed = 0
    while luciferin[p] < 0.0:
        climbed += 1
        if climbed % STRETCH == 0 and stopped(halt):
            return
        luciferin[p] = came
        came = -3.0 - p
        p += u64(jump[step[p]])
    above = luciferin[p]
    while came < -2.0:
        climbed -= 1
        if climbed % STRETCH == 0 and stopped(halt):
            return
        p = u64(int(-3.0 - came))
        came = luciferin[p]
        above = keep * above + gamma * (cost[p] / unit)
        luciferin[p] = above


@kernel(out=("luciferin",))
def shine(cost, step, jump, luciferin, width, goal, nothing, keep, gamma, unit, halt):
    """Luciferin as :func:`glow` gives it, to the last bit, without the list of cells in their order.

    ``goal`` is a cell; ``cost`` and ``step`` are as :func:`parents8` or :func:`parents` leaves them; ``jump``
    is int64, (128,), 0 from the last step on, so that a cell without a step looks at itself. Rows are gone
    through from the goal's down and then up, each from the goal's column outwards: so the parent mostly has
    its luciferin already, and no branch asks. For the cells where it had not, a second look at the row climbs
    to one that has.

    For maps that no cache holds: on 4096 x 4096 it takes 2.3 to 7.5 ns a cell from open to 30 % clutter (10
    and 14; a third more with octile moves; 15 in a maze) where glow takes 8, and the list's memory is spared.
    On 512 x 512, 1.5 to 4, and glow 1 to 2. Asking by branches takes 10 at 30 %.
    """
    w = u64(width)
    one = u64(1)
    rows = u64(len(luciferin)) // w
    middle = u64(goal) // w
    across = u64(goal) - middle * w
    for y in range(rows):
        if stopped(halt):
            return
        for i in range(y * w, y * w + w):
            luciferin[i] = nothing if cost[i] < 0 else -1.0
    luciferin[goal] = 0.0
    for k in range(rows):
        if stopped(halt):
            return
        y = middle + k if middle + k < rows else rows - one - k
        row = y * w
        for i in range(row + across, row + w):
            own = luciferin[i]
            above = luciferin[i + u64(jump[step[i] & 127])]
            found = keep * above + gamma * (cost[i] / unit)
            luciferin[i] = found if (own < 0.0) & (above >= 0.0) else own
        for j in range(across):
            i = row + across - one - j
            own = luciferin[i]
            above = luciferin[i + u64(jump[step[i] & 127])]
            found = keep * above + gamma * (cost[i] / unit)
            luciferin[i] = found if (own < 0.0) & (above >= 0.0) else own
        for i in range(row, row + w):
            if luciferin[i] < 0.0:
                _climb(cost, step, jump, luciferin, i, keep, gamma, unit, halt)
