"""A binary heap of cells that knows where each cell is, for searches that change their minds.

A cell is in the heap at most once; a changed key moves it, and it can be taken out from anywhere. Keys are
pairs in two arrays of the map's size, compared first by ``first``, then by ``second``; a search with one key
gives the same array twice. So the heap is small (what waits, no stale copies of it), never outgrows the map,
and can be left as it is between two calls.

``heap`` holds its count at 0 and cells from 1 on; ``place`` says where each cell is, 0 for nowhere.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, u64


@kernel(out=("heap", "place"))
def put(heap, place, first, second, cell):
    """Add a cell, or move it to where its changed key belongs.

    Parameters
    ----------
    heap : int32, (cells + 1,).
    place : int32, (n,).
    first, second : (n,); the keys.
    """
    i = int(place[u64(cell)])
    if i == 0:
        i = int(heap[u64(0)]) + 1
        heap[u64(0)] = i
    a = first[u64(cell)]
    b = second[u64(cell)]
    while i > 1:
        above = heap[u64(i >> 1)]
        high = first[u64(above)]
        if high < a or (high == a and second[u64(above)] <= b):
            break
        heap[u64(i)] = above
        place[u64(above)] = i
        i >>= 1
    count = int(heap[u64(0)])
    while True:
        child = 2 * i
        if child > count:
            break
        below = heap[u64(child)]
        low = first[u64(below)]
        if child < count:
            other = heap[u64(child + 1)]
            least = first[u64(other)]
            if least < low or (least == low and second[u64(other)] < second[u64(below)]):
                child += 1
                below = other
                low = least
        if low > a or (low == a and second[u64(below)] >= b):
            break
        heap[u64(i)] = below
        place[u64(below)] = i
        i = child
    heap[u64(i)] = cell
    place[u64(cell)] = i


@kernel(out=("heap", "place"))
def take(heap, place, first, second, cell):
    """Take out a cell that is in the heap, wherever it is."""
    i = place[u64(cell)]
    count = int(heap[u64(0)])
    last = heap[u64(count)] + 0  # of the width that all cells have, so that `put` is compiled once
    heap[u64(0)] = count - 1
    place[u64(cell)] = 0
    if last != cell:
        place[u64(last)] = i
        put(heap, place, first, second, last)
