"""Robots sorted by square bins of the map, so that those near one are found without a look at all."""

from __future__ import annotations

from lampyris.kernels._jit import kernel


@kernel(out=("first", "member"), each=600, of="x")
def fill_bins(x, y, side, columns, rows, first, member):
    """Sort robots by bin, within a bin by number.

    Parameters
    ----------
    x, y : float64 (n,): metres from the upper left corner of the map, y down.
    side, columns, rows : of the bins.
    first : out, int64 (columns * rows + 1,): where the robots of each bin begin in ``member``.
    member : out, int64 (n,).
    """
    bins = columns * rows
    for b in range(bins + 1):
        first[b] = 0
    for i in range(len(x)):
        column = min(max(int(x[i] / side), 0), columns - 1)
        row = min(max(int(y[i] / side), 0), rows - 1)
        first[row * columns + column] += 1
    total = 0
    for b in range(bins + 1):
        count = first[b]
        first[b] = total
        total += count
    for i in range(len(x)):
        column = min(max(int(x[i] / side), 0), columns - 1)
        row = min(max(int(y[i] / side), 0), rows - 1)
        b = row * columns + column
        member[first[b]] = i
        first[b] += 1
    for b in range(bins, 0, -1):
        first[b] = first[b - 1]
    first[0] = 0
