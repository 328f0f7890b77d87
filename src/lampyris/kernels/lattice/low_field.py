"""Costs to the goal in the projected graph: cells, joined by the displacements of a lattice's primitives.

A displacement from a cell can be driven if the sweep of any primitive with that displacement is free, at the cost
of the cheapest such primitive. Backward from the goals, so that the graph is the same as a search ahead sees.

Lists by cost (Denardo and Fox, "Shortest-route methods: 1. reaching, pruning, and buckets", Operations Research
27(1), 1979): a list spans no more than the least cost of a displacement, so that cells of one list cannot improve
each other, and no heap is needed. A displacement is put into a list before its sweeps are looked at; most cells
have a cost by the time their costlier displacements come up, which are then never looked at (lazy evaluation: Cohen,
Phillips, Likhachev, "Planning single-arm manipulations with n-arm robots", RSS 2014).
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64

DONE, EMPTY, FULL = 0, 1, 2
# Entries of ``count``.
LIST, FRESH, NEXT, UNUSED, SETTLED, CHECKED, WAITING = 0, 1, 2, 3, 4, 5, 6


@kernel(inline=True)
def is_free(wall, clear, reach, sweep_first, sweep, cell, primitive):
    """Whether the sweep of a primitive from a cell touches no wall."""
    if clear[u64(cell)] >= reach[u64(primitive)]:
        return True
    for k in range(sweep_first[u64(primitive)], sweep_first[u64(primitive + 1)]):
        if wall[u64(cell + sweep[u64(k)])] != 0:
            return False
    return True


@kernel(
    out=("costs", "by", "heads", "entry_cell", "entry_member", "entry_next", "fresh", "count"),
    of="costs",
    each=50_000,
)
def settle(
    wall, clear, inner, offset, price, reach, sweep_first, sweep, member, member_group, group_first, starts,
    span, beyond, costs, by, heads, entry_cell, entry_member, entry_next, fresh, count, halt,
):  # fmt: skip
    """Settle cells in rising cost until all starts have theirs and all costs up to ``beyond`` more are known.

    Parameters
    ----------
    wall, clear, inner, reach, sweep_first, sweep : see :func:`lampyris.kernels.lattice.search.search`.
    offset, price : int64 (primitives,): change of cell, cost.
    member : int32 (m,): primitives that move the base, those of one displacement together, cheap ones first.
    member_group : int32 (m,): the displacement of each.
    group_first : int32 (groups + 1,): where the members of a displacement begin.
    starts : int64 (s,): cells.
    span : int: the least cost of a displacement.
    beyond : int: how far past the costliest start to go on.
    costs : int64 (cells,): -1 where none is known.
    by : int16 (cells,): the primitive that leads on from each.
    heads : int32 (lists,): first entry of each list, -1: none. Enough lists for the costliest displacement and two.
    entry_cell, entry_member, entry_next : int32 (room,): the entries of the lists.
    fresh : int32 (room,): cells that have their cost and have not been expanded.
    count : int64 (7,): number of the list, cells in ``fresh``, the next of them, first unused entry, cells settled,
        sweeps looked at, entries in the lists.

    Returns
    -------
    0: done; 1: no list has an entry left; 2: no room.
    """
    lists = len(heads)
    groups = len(group_first) - 1
    at = int(count[u64(0)])
    fresh_n = int(count[u64(1)])
    i = int(count[u64(2)])
    unused = int(count[u64(3)])
    settled = int(count[u64(4)])
    checked = int(count[u64(5)])
    waiting = int(count[u64(6)])
    room = len(entry_cell)
    look = 256
    result = 1
    while True:
        # Expand the cells of this list.
        full = False
        while i < fresh_n:
            if waiting + groups >= room:
                full = True
                break
            look -= 1
            if look == 0:
                look = 256
                if stopped(halt):
                    full = True
                    break
            cell = int(fresh[u64(i)])
            i += 1
            settled += 1
            cost = costs[u64(cell)]
            for g in range(groups):
                m = int(group_first[u64(g)])
                p = int(member[u64(m)])
                there = cell - offset[u64(p)]
                if costs[u64(there)] >= 0 or clear[u64(there)] < inner:
                    continue
                to = max((cost + price[u64(p)]) // span, at + 1)
                k = to % lists
                entry = unused
                unused = int(entry_next[u64(entry)])
                entry_cell[u64(entry)] = there
                entry_member[u64(entry)] = m
                entry_next[u64(entry)] = heads[u64(k)]
                heads[u64(k)] = entry
                waiting += 1
        if full:
            result = 2
            break
        if waiting == 0:
            result = 1
            break
        # Whether all starts are settled, and what lies beyond them.
        last = 0
        for s in range(len(starts)):
            known = costs[u64(starts[u64(s)])]
            if known < 0:
                last = -1
                break
            last = max(last, known)
        if last >= 0 and (at + 1) * span > last + beyond:
            result = 0
            break
        # The next list.
        at += 1
        floor = at * span
        fresh_n = 0
        i = 0
        k = at % lists
        while heads[u64(k)] >= 0:
            entry = int(heads[u64(k)])
            heads[u64(k)] = entry_next[u64(entry)]
            entry_next[u64(entry)] = unused
            unused = entry
            waiting -= 1
            cell = int(entry_cell[u64(entry)])
            known = costs[u64(cell)]
            if known >= 0 and known < floor:
                continue
            m = int(entry_member[u64(entry)])
            g = int(member_group[u64(m)])
            end = int(group_first[u64(g + 1)])
            p = int(member[u64(m)])
            step = price[u64(p)]
            cost = costs[u64(cell + offset[u64(p)])] + step
            if known >= 0 and known <= cost:
                continue
            # Any primitive of this displacement and price will do.
            found = False
            while m < end:
                p = int(member[u64(m)])
                if price[u64(p)] != step:
                    break
                checked += 1
                if is_free(wall, clear, reach, sweep_first, sweep, cell, p):
                    found = True
                    break
                m += 1
            if found:
                if known < 0:
                    fresh[u64(fresh_n)] = cell
                    fresh_n += 1
                costs[u64(cell)] = cost
                by[u64(cell)] = p
            elif m < end:
                # The next costlier ones, when their time comes.
                to = max((cost - step + price[u64(p)]) // span, at)
                k2 = to % lists
                entry = unused
                unused = int(entry_next[u64(entry)])
                entry_cell[u64(entry)] = cell
                entry_member[u64(entry)] = m
                entry_next[u64(entry)] = heads[u64(k2)]
                heads[u64(k2)] = entry
                waiting += 1
    count[u64(0)] = at
    count[u64(1)] = fresh_n
    count[u64(2)] = i
    count[u64(3)] = unused
    count[u64(4)] = settled
    count[u64(5)] = checked
    count[u64(6)] = waiting
    return result
