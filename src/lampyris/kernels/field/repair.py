"""Repairing a field after some cells changed: costs, parents and luciferin, and no cell that need not be seen.

What changes is found in four sweeps, in rising cost, as Ramalingam and Reps order theirs ("An incremental
algorithm for a generalization of the shortest-path problem", J. Algorithms 21, 1996; here for a batch of
changes, and every step costs more than nothing):

* :func:`_lose`: cells that nothing supports any more at their old cost lose it, and then those that relied on
  them alone. A cell with another support keeps its cost: on a grid most cells have several.
* :func:`_settle`: the losers are offered what the cells around them have, the gainers what the change gave
  them, and a wave goes on from there.
* :func:`_choose`: parents by the local rule where a cost, or a step, changed next door.
* :func:`_glow`: luciferin down the tree from there, as far as it changes. A cell has 1 - rho of its parent's,
  so a difference is lost in rounding after some seventy steps.

Cost, parent and luciferin are then those of a field solved from scratch, to the last bit: the costs because
they are integers, the parents because their rule looks at nothing else, luciferin because it is formed along
the same parents by the same operations in the same order.

Cells wait in a calendar (:mod:`.calendar`) whose lists each hold costs within one step's length, so that no
cell of a list bears on another. A binary heap in its place took 1.6 times as long.

Maps are padded and flat, as :mod:`.wavefront` leaves them. Steps come in pairs, there and back.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.field.calendar import AWAY, RING, file, join, leave, refill

LISTED, MOVED = 1, 2
"""Bits of ``mark``: in the list of cells to look at; with another cost than before, or with none."""

LAST, ENOUGH, LOST, SETTLED, LOOKED, GLOWED = 0, 1, 2, 3, 4, 5
"""Places in ``work``: the calendar's last bucket; 1 if the field has to be solved from scratch; cells that lost their
cost, cells that a wave left from, parents looked at, luciferin formed."""


@kernel(out=("free", "weight", "cost", "step", "luciferin", "after", "before", "mark", "seen", "work"))
def repair(
    free, weight, cost, step, luciferin, after, before, mark, seen, turned, now_free, graded, now_weight,
    jump, side, other, price, ground, mask, goal, shift, hopeless, most, never, keep, gamma, unit, work,
    halt,
):  # fmt: skip
    """Take in changed cells and repair the field; return 0 if it has to be solved from scratch instead.

    That is so when the goal is a wall, or was; when the changed cells and their neighbours alone are more
    than ``hopeless``; and when more than ``most`` cells have been seen. The map is then as it should be, the
    field is not.

    Parameters
    ----------
    free : uint8, (n,); 1 where a cell may be entered. Changed here.
    weight : uint8; terrain, (n,), or a single 0. Changed here.
    cost : signed, (n,); exact, -1 where the goal cannot be reached.
    step : int8, (n,); the step to the parent, -1 where there is none.
    luciferin : float64, (n,); infinite where there is none.
    after, before : int32, (n + RING + 1,); the lists, all empty before and after: an end is its own
        neighbour, a cell's ``before`` is AWAY.
    mark : uint8, (n,); zeros before and after.
    seen : int32, (n,); scratch.
    turned, now_free : int32, uint8, (a,); cells and whether they are free now. Named twice: the last counts,
        and may make a wall of what the first made free, not the other way round.
    graded, now_weight : int32, uint8, (b,); cells and their terrain now.
    jump, side, other : int64, (m,); offsets of each step's end and of the two cells that must be free besides
        (the end itself where there is none).
    price : int64, (m,); a step into cell v costs ``price * (ground + weight[v & mask])``.
    goal : the goal cell.
    shift : 1 << shift is at most the least that a step costs.
    hopeless, most : see above.
    never : a cost too great for ``cost``; to come to it is another reason to solve from scratch.
    keep, gamma, unit : see :func:`lampyris.kernels.field.descent.glow`.
    work : int64, (6,); what was done, see above.
    """
    for k in range(6):
        work[k] = 0
    count = _write(free, weight, cost, mark, seen, turned, now_free, graded, now_weight, mask)
    if free[u64(goal)] == 0 or cost[u64(goal)] != 0 or count > hopeless:
        work[ENOUGH] = 1
    else:
        count = _doubt(
            free, weight, cost, step, after, before, mark, seen, count,
            jump, side, other, price, ground, mask, halt,
        )  # fmt: skip
        if count > hopeless:
            work[ENOUGH] = 1
    if work[ENOUGH] == 0:
        count = _lose(
            free, weight, cost, step, after, before, mark, seen, count,
            jump, side, other, price, ground, mask, shift, most, work, halt,
        )  # fmt: skip
    if work[ENOUGH] == 0:
        count = _settle(
            free, weight, cost, after, before, mark, seen, count,
            jump, side, other, price, ground, mask, shift, most, never, work, halt,
        )  # fmt: skip
    if work[ENOUGH] == 0:
        count = _choose(
            free, weight, cost, step, luciferin, after, before, mark, seen, count,
            jump, side, other, price, ground, mask, halt,
        )  # fmt: skip
        work[LOOKED] = count
        if stopped(halt):
            return 0  # some parents are not chosen yet
        _glow(cost, step, luciferin, after, before, jump, shift, keep, gamma, unit, work, halt)
    for i in range(count):
        mark[u64(seen[i])] = 0
    if work[ENOUGH] == 0:
        return 1
    for end in range(len(free), len(after)):
        while after[u64(end)] != end:
            leave(after, before, after[u64(end)])
    return 0


@kernel(out=("free", "weight", "cost", "mark", "seen"))
def _write(free, weight, cost, mark, seen, turned, now_free, graded, now_weight, mask):
    """Write the changes into the map; list the cells that are other than before, and return how many."""
    count = 0
    for i in range(len(turned)):
        f = u64(turned[i])
        if free[f] == now_free[i]:
            continue
        free[f] = now_free[i]
        if mark[f] == 0:
            seen[count] = turned[i]
            count += 1
        mark[f] |= LISTED
        if now_free[i] == 0 and cost[f] >= 0:
            cost[f] = -1
            mark[f] |= MOVED
    for i in range(len(graded)):
        f = u64(graded[i])
        if weight[f & u64(mask)] == now_weight[i]:
            continue
        weight[f & u64(mask)] = now_weight[i]
        if mark[f] == 0:
            seen[count] = graded[i]
            count += 1
        mark[f] |= LISTED
    return count


@kernel(out=("after", "before", "mark", "seen"))
def _doubt(
    free, weight, cost, step, after, before, mark, seen, count, jump, side, other, price, ground, mask, halt
):
    """List the neighbours of the changed cells too; those that may lose their cost wait afterwards.

    These are all whose steps can have changed: a diagonal or a knight's step past a cell begins next to it.
    """
    last = count
    for i in range(count):
        if i % LOOK == 0 and stopped(halt):
            break
        f = u64(seen[i])
        for k in range(len(jump)):
            u = f + u64(jump[k])
            if free[u] != 0 and mark[u] == 0:
                mark[u] = LISTED
                seen[last] = u
                last += 1
    for i in range(last):
        u = u64(seen[i])
        if cost[u] > 0:
            # Is the path by its parent still there, and no costlier?
            k = step[u]
            v = u + u64(jump[k])
            held = free[v] != 0 and free[u + u64(side[k])] != 0 and free[u + u64(other[k])] != 0
            if not held or cost[v] + price[k] * (ground + weight[v & u64(mask)]) > cost[u]:
                join(after, before, len(free) + RING, seen[i])
    return last


@kernel(out=("cost", "after", "before", "mark", "seen", "work"))
def _lose(
    free, weight, cost, step, after, before, mark, seen, count,
    jump, side, other, price, ground, mask, shift, most, work, halt,
):  # fmt: skip
    """Take the cost from all waiting cells, and from those that rely on them, that nothing supports."""
    n = len(free)
    turns = 0
    while after[u64(n + RING)] != n + RING:
        first = refill(cost, after, before, n, shift, work)
        bucket = first
        while bucket <= work[LAST] and count <= most:
            turns += 1
            if turns % LOOK == 0 and stopped(halt):
                work[ENOUGH] = 1
                return count
            end = n + (bucket & (RING - 1))
            cell = after[u64(end)]
            if cell == end:
                bucket += 1
                continue
            leave(after, before, cell)
            u = u64(cell)
            c = cost[u]
            supported = False
            for k in range(len(jump)):
                v = u + u64(jump[k])
                # A cell that has lost its cost has -1, as walls have.
                d = cost[v]
                if d < 0 or d >= c or free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0:
                    continue
                if d + price[k] * (ground + weight[v & u64(mask)]) <= c:
                    supported = True
                    break
            if supported:
                continue
            for k in range(len(jump)):
                x = u + u64(jump[k])
                if cost[x] > c and before[x] == AWAY and x + u64(jump[step[x]]) == u:
                    file(after, before, n, first, cost[x] >> shift, cell + jump[k], work)
            cost[u] = -1
            work[LOST] += 1
            if mark[u] & LISTED == 0:
                seen[count] = cell
                count += 1
            mark[u] = LISTED | MOVED
        if count > most:
            work[ENOUGH] = 1
            break
    return count


@kernel(out=("cost", "after", "before", "mark", "seen", "work"))
def _settle(
    free, weight, cost, after, before, mark, seen, count,
    jump, side, other, price, ground, mask, shift, most, never, work, halt,
):  # fmt: skip
    """Offer all cells seen so far what their neighbours have, and let a wave go on from there.

    Every cost that is left is one that can be had, so it may be offered at once, final or not.
    """
    n = len(free)
    turns = 0
    for i in range(count):
        if i % LOOK == 0 and stopped(halt):
            work[ENOUGH] = 1
            return count
        u = u64(seen[i])
        if free[u] == 0 or cost[u] == 0:
            continue
        best = cost[u]
        for k in range(len(jump)):
            v = u + u64(jump[k])
            d = cost[v]
            if d < 0 or free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0:
                continue
            d += price[k] * (ground + weight[v & u64(mask)])
            if (best < 0 or d < best) and d < never:
                best = d
        if best != cost[u]:
            cost[u] = best
            mark[u] |= MOVED
            join(after, before, n + RING, seen[i])
    while after[u64(n + RING)] != n + RING:
        first = refill(cost, after, before, n, shift, work)
        bucket = first
        while bucket <= work[LAST]:
            turns += 1
            if turns % LOOK == 0 and stopped(halt):
                work[ENOUGH] = 1
                return count
            end = n + (bucket & (RING - 1))
            cell = after[u64(end)]
            if cell == end:
                bucket += 1
                continue
            leave(after, before, cell)
            work[SETTLED] += 1
            u = u64(cell)
            c = cost[u]
            burden = ground + weight[u & u64(mask)]
            for k in range(len(jump)):
                x = u + u64(jump[k])
                d = c + price[k] * burden
                old = cost[x]
                if 0 <= old <= d or free[x] == 0:
                    continue
                if free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0:
                    continue
                if count > most or d >= never:
                    work[ENOUGH] = 1
                    return count
                cost[x] = d
                if before[x] != AWAY:
                    leave(after, before, cell + jump[k])
                file(after, before, n, first, d >> shift, cell + jump[k], work)
                if mark[x] & LISTED == 0:
                    seen[count] = x
                    count += 1
                mark[x] = LISTED | MOVED
    return count


@kernel(out=("step", "luciferin", "after", "before", "mark", "seen"))
def _choose(
    free, weight, cost, step, luciferin, after, before, mark, seen, count,
    jump, side, other, price, ground, mask, halt,
):  # fmt: skip
    """Parents of all cells seen, and of their neighbours whose parent may be another now; what changed waits
    beyond the ring afterwards. Returns how many were looked at."""
    beyond = len(free) + RING
    last = count
    for i in range(count):
        if i % LOOK == 0 and stopped(halt):
            return last
        u = u64(seen[i])
        if mark[u] & MOVED == 0:
            continue
        c = cost[u]
        burden = ground + weight[u & u64(mask)]
        for k in range(len(jump)):
            x = u + u64(jump[k])
            d = cost[x]
            if d <= 0 or mark[x] & LISTED != 0:
                continue
            # Its parent was this cell, or this cell offers as much as its parent.
            if x + u64(jump[step[x]]) == u or (c >= 0 and c + price[k] * burden == d):
                mark[x] |= LISTED
                seen[last] = x
                last += 1
    for i in range(last):
        if i % LOOK == 0 and stopped(halt):
            return last
        u = u64(seen[i])
        c = cost[u]
        if c <= 0:
            if c < 0:
                step[u] = -1
                luciferin[u] = float("inf")
            continue
        for k in range(len(jump)):
            v = u + u64(jump[k])
            d = cost[v]
            if d < 0 or d >= c or free[u + u64(side[k])] == 0 or free[u + u64(other[k])] == 0:
                continue
            if d + price[k] * (ground + weight[v & u64(mask)]) == c:
                if k != step[u] or mark[u] & MOVED != 0:
                    step[u] = k
                    join(after, before, beyond, seen[i])
                break
    return last


@kernel(out=("luciferin", "after", "before", "work"))
def _glow(cost, step, luciferin, after, before, jump, shift, keep, gamma, unit, work, halt):
    """Luciferin of the waiting cells, and of all below them in the tree as far as it changes."""
    n = len(cost)
    turns = 0
    while after[u64(n + RING)] != n + RING:
        first = refill(cost, after, before, n, shift, work)
        bucket = first
        while bucket <= work[LAST]:
            turns += 1
            if turns % LOOK == 0 and stopped(halt):
                return
            end = n + (bucket & (RING - 1))
            cell = after[u64(end)]
            if cell == end:
                bucket += 1
                continue
            leave(after, before, cell)
            work[GLOWED] += 1
            u = u64(cell)
            c = cost[u]
            glow = keep * luciferin[u + u64(jump[step[u]])] + gamma * (c / unit)
            if glow == luciferin[u]:
                continue
            luciferin[u] = glow
            for k in range(len(jump)):
                x = u + u64(jump[k])
                if cost[x] > c and before[x] == AWAY and x + u64(jump[step[x]]) == u:
                    file(after, before, n, first, cost[x] >> shift, cell + jump[k], work)
