"""Bits in lines, 64 in a word, the lowest first: what one is, and how far the next one set is."""

from __future__ import annotations

from lampyris.kernels._jit import highest, kernel, lowest, u64


@kernel()
def ahead(words, at):
    """Distance from a bit to the next one set."""
    place = at + 1
    k = u64(place) >> u64(6)
    word = words[k] >> (u64(place) & u64(63))
    if word != u64(0):
        return lowest(word) + 1
    reach = 65 - (place & 63)
    k += u64(1)
    word = words[k]
    while word == u64(0):
        reach += 64
        k += u64(1)
        word = words[k]
    return reach + lowest(word)


@kernel()
def back(words, at):
    """Distance from a bit to the one set before it."""
    place = at - 1
    k = u64(place) >> u64(6)
    word = (words[k] << u64(63 - (place & 63))) & u64(0xFFFF_FFFF_FFFF_FFFF)
    if word != u64(0):
        return 64 - highest(word)
    reach = 65 + (place & 63)
    k -= u64(1)
    word = words[k]
    while word == u64(0):
        reach += 64
        k -= u64(1)
        word = words[k]
    return reach - highest(word)


@kernel()
def bit(words, at):
    """1 where a bit is set, else 0."""
    return 1 if (words[u64(at) >> u64(6)] >> (u64(at) & u64(63))) & u64(1) != u64(0) else 0


@kernel(out=("stops",))
def _find_stops(walls, stops, onward, backward, line, word, in_line, cutting):
    """Find the stops of a word of a line again, from the walls of its line and the two beside it."""
    at = line * in_line + word
    on = walls[u64(at)]
    behind_on = on
    for side in range(2):
        k = at - in_line if side == 0 else at + in_line
        shut = walls[u64(k)]
        before = (shut << u64(1)) & u64(0xFFFF_FFFF_FFFF_FFFF)
        if word > 0:
            before |= walls[u64(k - 1)] >> u64(63)
        behind = shut >> u64(1)
        if word < in_line - 1:
            behind |= (walls[u64(k + 1)] << u64(63)) & u64(0xFFFF_FFFF_FFFF_FFFF)
        if cutting != 0:
            on |= shut & ~behind
            behind_on |= shut & ~before
        else:
            on |= before & ~shut
            behind_on |= behind & ~shut
    stops[u64(onward + at)] = on
    stops[u64(backward + at)] = behind_on


@kernel(out=("words", "columns"), each=60000, of="x")
def turn_bits(words, columns, east, west, south, north, stride, rise, cutting, x, y):
    """Turn cells of a packed map from blocked to free or back, and find the stops near them again.

    Parameters
    ----------
    words .. rise : as for :func:`lampyris.kernels.graph.jps.jump`; bits at which parts begin, bits of a line.
    columns : uint64; the walls by column, which ``words`` has not.
    cutting : 1 where diagonals may cut corners, else 0.
    x, y : int64 (k,), the cells, counted from 0; each named once.
    """
    in_row = stride >> 6
    in_column = rise >> 6
    for k in range(len(x)):
        c = x[k] + 1
        r = y[k] + 1
        row_at = u64(r * in_row + (c >> 6))
        words[row_at] = words[row_at] ^ (u64(1) << u64(c & 63))
        column_at = u64(c * in_column + (r >> 6))
        columns[column_at] = columns[column_at] ^ (u64(1) << u64(r & 63))
    # The rows end with a line of border, and so do the columns.
    last_row = (east >> 6) // in_row - 1
    last_column = len(columns) // in_column - 1
    for k in range(len(x)):
        c = x[k] + 1
        r = y[k] + 1
        for line in range(max(r - 1, 1), min(r + 2, last_row)):
            for word in range((c - 1) >> 6, ((c + 1) >> 6) + 1):
                _find_stops(words, words, east >> 6, west >> 6, line, word, in_row, cutting)
        for line in range(max(c - 1, 1), min(c + 2, last_column)):
            for word in range((r - 1) >> 6, ((r + 1) >> 6) + 1):
                _find_stops(columns, words, south >> 6, north >> 6, line, word, in_column, cutting)
