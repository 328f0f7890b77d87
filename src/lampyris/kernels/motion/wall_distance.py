"""How near the nearest wall is to points anywhere between the cells' centres, a bit for every cell.

Kept apart from :mod:`lampyris.kernels.motion.nearest_wall`, which answers for centres in whole numbers. A row of the map is
64 cells a word, so that one row beside a point takes two instructions however far its walls are; looking at
every cell of the rings around it instead took 1,600 cells for a reach of 20.
"""

from __future__ import annotations

from math import floor

from lampyris.kernels._jit import highest, kernel, lowest, u64


@kernel(inline=True)
def _aside(words, at, stride, px, column, flat, best):
    """Squared distance to the nearest wall of one row, or ``best`` where no wall of it is that near."""
    zero = u64(0)
    word = column >> 6
    bit = u64(column & 63)
    own = words[u64(at + word)]
    right = own >> bit
    left = own & ((u64(2) << bit) - u64(1))
    if right != zero:
        gap = abs(column + lowest(right) - px) - 0.5
        d = (gap * gap if gap > 0.0 else 0.0) + flat
        best = d if d < best else best
    else:
        k = word + 1
        while k < stride:
            gap = 64 * k - px - 0.5
            if gap * gap + flat >= best:
                break
            own = words[u64(at + k)]
            if own != zero:
                gap += lowest(own)
                d = gap * gap + flat
                best = d if d < best else best
                break
            k += 1
    if left != zero:
        gap = abs(64 * word + highest(left) - px) - 0.5
        d = (gap * gap if gap > 0.0 else 0.0) + flat
        best = d if d < best else best
    else:
        k = word - 1
        while k >= 0:
            gap = px - 0.5 - (64 * k + 63)
            if gap * gap + flat >= best:
                break
            own = words[u64(at + k)]
            if own != zero:
                gap += 63 - highest(own)
                d = gap * gap + flat
                best = d if d < best else best
                break
            k -= 1
    return best


@kernel(out=("squared",))
def nearest_walls(words, bands, stride, width, height, xs, ys, squared):
    """Squared distance in cells from each point to the nearest blocked square; 0 within one.

    Parameters
    ----------
    words : uint64 (height * stride,), rows of the map, the lowest bit of a word its leftmost cell.
    bands : uint64, every 8 rows of ``words`` laid over each other.
    stride : words a row.
    width, height : of the map, cells; what lies outside is not a wall.
    xs, ys : float64 (n,), cells; the centre of cell (x, y) is at (x, y).
    squared : out, float64 (n,). Given: how far to look, squared; it stays where no wall is nearer.

    Row by row away from the point, as long as a row is nearer than the nearest wall so far; eight rows at
    once where even all of them laid into the nearest one hold nothing nearer (open ground: three times as
    fast).
    """
    for i in range(len(xs)):
        px = xs[i]
        py = ys[i]
        column = floor(px + 0.5)
        column = 0 if column < 0 else (width - 1 if column >= width else column)
        middle = floor(py + 0.5)
        middle = 0 if middle < 0 else (height - 1 if middle >= height else middle)
        best = squared[i]
        for half in range(2):
            y = middle - half
            step = 1 - 2 * half
            while 0 <= y < height:
                gap = abs(y - py) - 0.5
                flat = gap * gap if gap > 0.0 else 0.0
                if flat >= best:
                    break
                if (
                    y & 7 == 7 * half
                    and _aside(bands, (y >> 3) * stride, stride, px, column, flat, best) >= best
                ):
                    y += 8 * step
                    continue
                best = _aside(words, y * stride, stride, px, column, flat, best)
                y += step
        squared[i] = best
