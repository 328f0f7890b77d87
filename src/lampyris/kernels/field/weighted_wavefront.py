"""Wavefront over cells that weigh differently, without a heap; costs, then parents, over padded flat maps.

A step of kind k from a cell p into a cell n costs ``price[k] * (63 + terrain[n])`` (see
:class:`lampyris.model.grid.Grid`). The field is measured backwards, from the goal: every step that ends in n
pays for n alone. So a settled cell n of cost d offers one and the same cost to all its neighbours of a kind:
``d + price[k] * (63 + terrain[n])``. It has one *departure* for each kind, at a cost known when it settles.

Departures wait in a ring of buckets (a calendar queue: Brown, CACM 31(10), 1988; Dial, CACM 12(11), 1969).
A bucket spans no more than the least step, so no departure leads back into its own bucket: when all of one
bucket have left, every cell they touched is settled, at the least of the costs it was offered. A cell is
thus written to a list once for each kind of step and never moved: nothing is stale, nothing is taken out, and
the memory is known beforehand. The buckets are lists threaded through the order of settling (a cell's place
in it, not the cell itself, so that a bucket lies close together). The costliest step is five times the highest
price, so a ring of 16 buckets serves every step set of ours.

As in :mod:`.wavefront` every neighbour is written at the end of the list unconditionally and the end advances
by 0 or 1, and a border of walls spares all tests for the edge.

Roads not taken, by how much longer costs alone took on maps of 512 x 512 and 1024 x 1024 cells, open, with a
fifth of the cells blocked, and of rooms: cells (not departures) in doubly linked buckets, moved when a path
gets cheaper (1.4 to 1.8 times); a binary heap (4 to 6 times); one table of steps for all sets, without
:func:`settle` (2.5 to 4 times); buckets as arrays of cells and costs, each with room for the worst (1.0 to
1.9 times); no early fetch of the rows above and below (1.2 to 1.4 times).
"""

from __future__ import annotations

from lampyris.kernels._jit import fetch, kernel, stopped, u64

TERRAIN_UNIT = 63
"""What plain ground weighs."""


@kernel(out=("cost", "weight"), each=150)
def lay_out(free, terrain, cost, weight, width, pad, never, halt):
    """A map and its terrain into their frame.

    Parameters
    ----------
    free, terrain : uint8, (height * width inside the border,); 1 where a cell may be entered, and 0 to 252.
    cost : signed, (n,); becomes ``never`` in free cells, -1 in walls and border.
    weight : uint8, (n,); becomes the terrain, 0 in the border.
    width : of a padded row.
    pad : width of the border.
    never : more than any cost.
    """
    inside = u64(width - 2 * pad)
    at = u64(width * pad + pad)
    for i in range(at):
        cost[i] = -1
        weight[i] = 0
    seam = u64(2 * pad)
    for row in range(u64(0), u64(len(free)), inside):
        if stopped(halt):
            return
        for x in range(inside):
            cost[at + x] = never if free[row + x] else -1
        for x in range(inside):
            weight[at + x] = terrain[row + x]
        at += inside
        for x in range(seam):
            cost[at + x] = -1
            weight[at + x] = 0
        at += seam
    for i in range(at, u64(len(cost))):
        cost[i] = -1
        weight[i] = 0


@kernel(out=("cost", "order"), inline=True)
def _straights(cost, order, p, c, w, tail, never):
    """Offer ``c`` to what straight steps into ``p`` come from; the new end of the list."""
    one = u64(1)
    n = p - w
    old = cost[n]
    order[tail] = n
    tail = tail + one if old == never else tail
    cost[n] = old if old < c else c
    n = p - one
    old = cost[n]
    order[tail] = n
    tail = tail + one if old == never else tail
    cost[n] = old if old < c else c
    n = p + one
    old = cost[n]
    order[tail] = n
    tail = tail + one if old == never else tail
    cost[n] = old if old < c else c
    n = p + w
    old = cost[n]
    order[tail] = n
    tail = tail + one if old == never else tail
    cost[n] = old if old < c else c
    return tail


@kernel(out=("cost", "order"), inline=True)
def _diagonals(cost, order, p, c, w, guard, tail, never):
    """Offer ``c`` to what diagonals into ``p`` come from; the new end of the list."""
    one = u64(1)
    up = cost[p - w]
    left = cost[p - one]
    right = cost[p + one]
    down = cost[p + w]
    # Behind a shut corner a cell looks like a wall.
    n = p - w - one
    old = cost[n]
    seen = -1 if (old | ((up | left) & guard)) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p - w + one
    old = cost[n]
    seen = -1 if (old | ((up | right) & guard)) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p + w - one
    old = cost[n]
    seen = -1 if (old | ((down | left) & guard)) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p + w + one
    old = cost[n]
    seen = -1 if (old | ((down | right) & guard)) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    return tail


@kernel(out=("cost", "order"), inline=True)
def _leaps(cost, order, p, c, w, tail, never):
    """Offer ``c`` to what knight's moves into ``p`` come from; the new end of the list."""
    one = u64(1)
    up = cost[p - w]
    left = cost[p - one]
    right = cost[p + one]
    down = cost[p + w]
    # The diagonal cell that a leap passes, and the straight one: shut if either is.
    first = cost[p - w - one]
    second = cost[p - w + one]
    third = cost[p + w - one]
    fourth = cost[p + w + one]
    n = p - w - one - one
    old = cost[n]
    seen = -1 if (old | left | first) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p - w + one + one
    old = cost[n]
    seen = -1 if (old | right | second) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p + w - one - one
    old = cost[n]
    seen = -1 if (old | left | third) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p + w + one + one
    old = cost[n]
    seen = -1 if (old | right | fourth) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p - w - w - one
    old = cost[n]
    seen = -1 if (old | up | first) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p - w - w + one
    old = cost[n]
    seen = -1 if (old | up | second) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p + w + w - one
    old = cost[n]
    seen = -1 if (old | down | third) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    n = p + w + w + one
    old = cost[n]
    seen = -1 if (old | down | fourth) < 0 else old
    order[tail] = n
    tail = tail + one if seen == never else tail
    cost[n] = old if seen < c else c
    return tail


@kernel(out=("cost", "order", "toll", "load", "links", "heads"), each=800)
def settle(
    weight, cost, order, toll, load, links, heads, bench, width, goal, stop, straight, diagonal, knight,
    guard, shift, mask, never, halt,
):  # fmt: skip
    """Settle every cell that can reach the goal by four, eight or sixteen steps; return how many, 0 if costs
    outgrow ``never``.

    Parameters
    ----------
    weight, cost : as :func:`lay_out` leaves them; ``cost`` is the result, exact and at least 0 where the goal
        can be reached, ``never`` where not.
    order : uint32, (bench + 24,); the cells as they settled, bucket by bucket of rising cost.
    toll : as ``cost``, (bench,); the cost of each of them.
    load : uint8, (bench,); scratch, the terrain of each of them.
    links : uint32, (m bench,) for m prices; scratch, the next departure in a bucket, straight ones first.
    heads : uint32, (m (mask + 1),); scratch, the first departure of each bucket.
    bench : one more than there are cells inside the border.
    width : of a padded row; the border is one cell wide, with knight's moves two.
    goal, stop : cells; settling ends with the bucket of ``stop`` and the cells that cost no more than it; 0
        for never.
    straight, diagonal, knight : the prices, 0 for those of the last two that there are not; knight's moves
        go with diagonals.
    guard : -1 where the side cells of a diagonal must be free, 0 if not.
    shift, mask : costs ``c`` wait in bucket ``c >> shift & mask``; 1 << shift is at most the least step,
        mask one less than a power of two and with room for the costliest.
    never : more than any cost.
    """
    w = u64(width)
    zero = u64(0)
    one = u64(1)
    late = u64(bench)
    none = late - one
    ring = u64(mask) + one
    kinds = u64(1 + (1 if diagonal > 0 else 0) + (1 if knight > 0 else 0))
    for k in range(kinds * ring):
        heads[k] = none
    # Beyond it a departure could reach ``never``.
    costliest = never - 315 * max(straight, diagonal, knight)
    cost[goal] = 0
    order[0] = goal
    begin = zero
    tail = one
    bucket = 0
    waiting = zero
    while True:
        for i in range(begin, tail):
            n = order[i]
            # Its row is available, those above and below will be wanted when it departs.
            fetch(cost, n - w)
            fetch(cost, n + w)
            d = cost[n]
            load[i] = weight[n]
            toll[i] = d
            burden = TERRAIN_UNIT + weight[n]
            s = u64((d + straight * burden) >> shift) & u64(mask)
            links[i] = heads[s]
            heads[s] = i
            if diagonal > 0:
                s = (u64((d + diagonal * burden) >> shift) & u64(mask)) + ring
                links[late + i] = heads[s]
                heads[s] = i
            if knight > 0:
                s = (u64((d + knight * burden) >> shift) & u64(mask)) + ring + ring
                links[late + late + i] = heads[s]
                heads[s] = i
        waiting += (tail - begin) * kinds
        if stop > 0 and cost[stop] < never:
            return _keep(order, toll, begin, tail, cost[stop])
        begin = tail
        if waiting == zero:
            return tail
        bucket += 1
        if stopped(halt):
            return tail
        if (bucket + 1) << shift > costliest:
            return zero
        s = u64(bucket) & u64(mask)
        i = u64(heads[s])
        heads[s] = none
        while i != none:
            p = u64(order[i])
            c = toll[i] + straight * (TERRAIN_UNIT + load[i])
            i = u64(links[i])
            waiting -= one
            tail = _straights(cost, order, p, c, w, tail, never)
        if diagonal == 0:
            continue
        s += ring
        i = u64(heads[s])
        heads[s] = none
        while i != none:
            p = u64(order[i])
            c = toll[i] + diagonal * (TERRAIN_UNIT + load[i])
            i = u64(links[late + i])
            waiting -= one
            tail = _diagonals(cost, order, p, c, w, guard, tail, never)
        if knight == 0:
            continue
        s += ring
        i = u64(heads[s])
        heads[s] = none
        while i != none:
            p = u64(order[i])
            c = toll[i] + knight * (TERRAIN_UNIT + load[i])
            i = u64(links[late + late + i])
            waiting -= one
            tail = _leaps(cost, order, p, c, w, tail, never)


@kernel(out=("cost", "order", "toll", "load", "links", "heads"), each=2500)
def any_steps(
    weight, cost, order, toll, load, links, heads, bench, first, jump, side, other, price, goal, stop, shift,
    mask, never, halt,
):  # fmt: skip
    """Settle every cell that can reach the goal by any step set; return how many, 0 if costs outgrow
    ``never``.

    Parameters
    ----------
    weight, cost, order, toll, load, bench, goal, stop, shift, mask, never : as for :func:`settle`.
    links, heads : uint32, (m bench,) and (m (mask + 1),) for m different prices.
    first : int64, (m + 1,); the steps of price j are those from ``first[j]`` to before ``first[j + 1]``.
    jump, side, other : int64; where each step comes from, and the two cells that must be free besides (the
        end itself where there is none), as index offsets from its end.
    price : int64, (m,); the different prices, rising.
    """
    zero = u64(0)
    one = u64(1)
    late = u64(bench)
    none = late - one
    kinds = u64(len(price))
    ring = u64(mask) + one
    for k in range(kinds * ring):
        heads[k] = none
    costliest = never - 315 * price[kinds - one]
    cost[goal] = 0
    order[0] = goal
    begin = zero
    tail = one
    bucket = 0
    waiting = zero
    while True:
        for i in range(begin, tail):
            n = order[i]
            d = cost[n]
            load[i] = weight[n]
            toll[i] = d
            burden = TERRAIN_UNIT + weight[n]
            for j in range(kinds):
                s = (u64((d + price[j] * burden) >> shift) & u64(mask)) + j * ring
                links[j * late + i] = heads[s]
                heads[s] = i
        waiting += (tail - begin) * kinds
        if stop > 0 and cost[stop] < never:
            return _keep(order, toll, begin, tail, cost[stop])
        begin = tail
        if waiting == zero:
            return tail
        bucket += 1
        if stopped(halt):
            return tail
        if (bucket + 1) << shift > costliest:
            return zero
        for j in range(kinds):
            s = (u64(bucket) & u64(mask)) + j * ring
            i = u64(heads[s])
            heads[s] = none
            while i != none:
                p = u64(order[i])
                c = toll[i] + price[j] * (TERRAIN_UNIT + load[i])
                i = u64(links[j * late + i])
                waiting -= one
                for k in range(u64(first[j]), u64(first[j + one])):
                    n = p + u64(jump[k])
                    old = cost[n]
                    seen = -1 if (old | cost[p + u64(side[k])] | cost[p + u64(other[k])]) < 0 else old
                    order[tail] = n
                    tail = tail + one if seen == never else tail
                    cost[n] = old if seen < c else c


@kernel(out=("order", "toll"))
def _keep(order, toll, begin, end, limit):
    """Drop the cells of the last bucket that cost more than ``limit``; return how many are left in all."""
    one = u64(1)
    kept = begin
    for i in range(begin, end):
        order[kept] = order[i]
        toll[kept] = toll[i]
        kept = kept + one if toll[i] <= limit else kept
    return kept
