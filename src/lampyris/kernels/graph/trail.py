"""The path from a cell to the goal of a field, parent by parent."""

from __future__ import annotations

from lampyris.kernels._helpers import STRETCH
from lampyris.kernels._jit import PATH, kernel, stopped, u64


@kernel(out=("path",), each=2000, of=PATH)
def trail(step, jump, cell, path, halt):
    """Write down the cells from one to the goal; return how many.

    Parameters
    ----------
    step : int8, (n,); index into ``jump`` of the path to the parent, -1 at the goal.
    jump : int64; offsets of flat cells.
    cell : where to begin; it must reach the goal.
    path : int32, (n,); the cells, the goal last.
    """
    count = 0
    path[count] = cell
    k = int(step[u64(cell)])
    while k >= 0:
        if count % STRETCH == 0 and stopped(halt):
            break
        cell += jump[u64(k)]
        count += 1
        path[u64(count)] = cell
        k = int(step[u64(cell)])
    return count + 1
