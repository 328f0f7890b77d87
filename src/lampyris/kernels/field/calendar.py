"""A calendar of cells: lists by cost, for waves that spread by short steps from wherever something changed.

A ring of ``RING`` lists, each for costs within ``1 << shift`` of each other, and a list for all that lies
beyond the ring, from which it is filled again when it is empty. Lists are threaded through two arrays, so
that a cell moves at once when it is had for less, nothing is stale, and each operation takes the same time.
With a ``shift`` that spans no more than the least step, no cell of a list bears on another in it (Brown,
"Calendar queues", CACM 31(10), 1988; Dial, CACM 12(11), 1969).

``after`` and ``before``, int32 (n + RING + 1,): each cell's neighbours in its list; at n and from there on,
the ends of the lists, each its own neighbour when the list is empty. ``before`` of a cell in no list is AWAY.
``last``, int64, holds at 0 the last bucket of the ring with anything in it.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64

RING = 1024
"""Lists in the ring; a power of two. A wave over a map of a thousand cells across fills it once."""
AWAY = -1


@kernel(out=("after", "before"))
def join(after, before, end, cell):
    """Append a cell to a list."""
    left = before[u64(end)]
    after[u64(left)] = cell
    before[u64(cell)] = left
    after[u64(cell)] = end
    before[u64(end)] = cell


@kernel(out=("after", "before"))
def leave(after, before, cell):
    """Take a cell out of its list."""
    left = before[u64(cell)]
    right = after[u64(cell)]
    after[u64(left)] = right
    before[u64(right)] = left
    before[u64(cell)] = AWAY


@kernel(out=("after", "before", "last"))
def file(after, before, n, first, bucket, cell, last):
    """Put a cell that is in no list into its bucket, or beyond the ring."""
    if bucket - first >= RING:
        join(after, before, n + RING, cell)
    else:
        join(after, before, n + (bucket & (RING - 1)), cell)
        if bucket > last[0]:
            last[0] = bucket


@kernel(out=("after", "before", "last"))
def refill(cost, after, before, n, shift, last):
    """Fill the empty ring from what lies beyond it; return its first bucket."""
    end = n + RING
    cell = after[u64(end)]
    first = cost[u64(cell)] >> shift
    while cell != end:
        bucket = cost[u64(cell)] >> shift
        if bucket < first:
            first = bucket
        cell = after[u64(cell)]
    last[0] = first
    cell = after[u64(end)]
    while cell != end:
        following = after[u64(cell)]
        bucket = cost[u64(cell)] >> shift
        if bucket - first < RING:
            leave(after, before, cell)
            file(after, before, n, first, bucket, cell, last)
        cell = following
    return first
