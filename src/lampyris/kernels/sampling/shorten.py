"""A path of straight lines made shorter: the best sequence of free lines between some of its points."""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64
from lampyris.kernels.sampling.draws import length
from lampyris.kernels.sampling.lines import line_free
from lampyris.kernels.sampling.tree import EQUAL


@kernel(out=("best", "before"), of="best", each=50_000)
def shorten(free, even, stride, rule, x, y, best, before, halt):
    """For each point the shortest path of free lines from the first through earlier points.

    The line from each point to the next is taken to be free only where it is, too; where it is not, ``best`` has another way.

    Parameters
    ----------
    free, even, stride, rule : see :func:`lampyris.kernels.sampling.lines.line_free`.
    x, y : int64 (k,): the points, padded, in order.
    best : float64 (k,): lengths; negative: no way.
    before : int64 (k,): the point before each.
    """
    best[0] = 0.0
    before[0] = -1
    for j in range(1, len(x)):
        if stopped(halt):
            return
        best[u64(j)] = -1.0
        before[u64(j)] = -1
        for i in range(j):
            if best[u64(i)] < 0.0:
                continue
            through = best[u64(i)] + length(x[u64(i)], y[u64(i)], x[u64(j)], y[u64(j)])
            if best[u64(j)] < 0.0 or through < best[u64(j)] - EQUAL:
                if line_free(free, even, stride, x[u64(i)], y[u64(i)], x[u64(j)], y[u64(j)], rule):
                    best[u64(j)] = through
                    before[u64(j)] = i
