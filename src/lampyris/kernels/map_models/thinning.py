"""Thinning: a region is worn away from its lowest cells on until ridges one cell wide are left.

A cell may go when the region stays connected as it is and no hole opens or closes (a *simple* cell: its crossing
number, after Yokoi, Toriwaki, Fukumura, Computer Graphics and Image Processing 4 (1975), 63-73, is 1). Cells go in
the order of their values, so that what is left runs along the crests.
"""

from __future__ import annotations

from lampyris.kernels._helpers import LOOK
from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.heap import put, take


@kernel()
def _simple(inside, stride, eight, at):
    """Whether the crossing number of a cell is 1."""
    e = inside[u64(at + 1)] != 0
    ne = inside[u64(at + 1 - stride)] != 0
    n = inside[u64(at - stride)] != 0
    nw = inside[u64(at - 1 - stride)] != 0
    w = inside[u64(at - 1)] != 0
    sw = inside[u64(at - 1 + stride)] != 0
    s = inside[u64(at + stride)] != 0
    se = inside[u64(at + 1 + stride)] != 0
    if eight == 1:
        # Connected by corners: count what lies around the cell in the complement.
        e, ne, n, nw, w, sw, s, se = not e, not ne, not n, not nw, not w, not sw, not s, not se
    count = 0
    if e and not (ne and n):
        count += 1
    if n and not (nw and w):
        count += 1
    if w and not (sw and s):
        count += 1
    if s and not (se and e):
        count += 1
    return count == 1


@kernel(out=("inside", "heap", "place", "tie"), each=7000)
def thin(inside, value, tie, kept_a, kept_b, stride, eight, heap, place, halt):
    """Wear a region away to its ridges; return how many cells went.

    Parameters
    ----------
    inside : uint8 (n,), padded by a border of zeros; 1 in the region. Afterwards 1 on the ridges.
    value : int64 (n,); lower cells go first.
    tie : int64 (n,), 0: set to when a cell came up, so that among equals those go first that came up first.
    kept_a, kept_b : flat indices of two cells that stay.
    stride : cells in a row.
    eight : 1 where cells that share a corner are connected, 0 where only those that share a side are.
    heap, place : int32 (n + 1,) and (n,), 0.
    """
    came = 0
    for at in range(len(inside)):
        if inside[u64(at)] != 0 and at != kept_a and at != kept_b and _simple(inside, stride, eight, at):
            came += 1
            tie[u64(at)] = came
            put(heap, place, value, tie, at)
    gone = 0
    looked = 0
    while heap[0] > 0:
        looked += 1
        if looked % LOOK == 0 and stopped(halt):
            break
        u = heap[1] + 0
        take(heap, place, value, tie, u)
        if not _simple(inside, stride, eight, u):
            continue
        inside[u64(u)] = 0
        gone += 1
        for k in range(9):
            v = u + (k // 3 - 1) * stride + k % 3 - 1
            if inside[u64(v)] == 0 or place[u64(v)] != 0 or v == kept_a or v == kept_b:
                continue
            if _simple(inside, stride, eight, v):
                came += 1
                tie[u64(v)] = came
                put(heap, place, value, tie, v)
    return gone
