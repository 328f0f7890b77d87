"""Distance to the nearest wall, exactly, in two passes over a flat map.

The distance runs from a cell's centre to the nearest *point of a blocked cell's square*: squared, in half
cells, ``f(dx) + f(dy)`` with ``f(d) = max(2 |d| - 1, 0)^2``; or to its centre, with ``f(d) = (2 d)^2``.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel, stopped, u64


@kernel(out=("squared",))
def wall_distance(blocked, squared, centre, peak, start, height, width, never, edge, halt):
    """Squared distance to the nearest wall in half cells; ``never`` where the map has no wall.

    Parameters
    ----------
    blocked : uint8, (height * width,).
    squared : int64, same length; the result.
    centre, peak, start : int64, (width,); scratch: column, height and first place of each curve on the
        envelope.
    never : more than any squared distance.
    edge : 1: to the nearest point of a blocked cell; 0: to the centre of one.

    Down and up each column first, by counting cells. Along each row then: a wall in column u, at F(u)
    already from its row, gives cell x ``F(u) + (2 x - 1 - 2 u)^2`` from the left or ``F(u) + (2 x + 1 - 2
    u)^2`` from the right. That is one family of parabolas with centres 2 u, asked at the odd places on both
    sides of x; on its wrong side a parabola only says too much, so no side need be looked at. Their lower
    envelope is built from left to right and read off in one walk, as Felzenszwalb and Huttenlocher (Theory
    of Computing 8, 2012) do for the distance between centres.
    """
    w = u64(width)
    one = u64(1)
    for i in range(w):
        squared[i] = 0 if blocked[i] else never
    for y in range(one, u64(height)):
        if stopped(halt):
            return
        for i in range(y * w, y * w + w):
            above = squared[i - w] + 1
            far = above if above < never else never
            squared[i] = 0 if blocked[i] else far
    for y in range(one, u64(height)):
        if stopped(halt):
            return
        row = (u64(height) - one - y) * w
        for i in range(row, row + w):
            below = squared[i + w] + 1
            squared[i] = squared[i] if squared[i] < below else below
    for y in range(u64(height)):
        if stopped(halt):
            return
        row = y * w
        top = -1
        for u in range(width):
            cells = squared[row + u64(u)]
            if cells >= never:
                continue
            own = (2 * cells - edge) * (2 * cells - edge) if cells > 0 else 0
            squared[row + u64(u)] = own
            begin = -never
            while top >= 0:
                v = centre[top]
                begin = (own - peak[top] + 4 * (u * u - v * v)) // (4 * (u - v)) + 1
                if begin > start[top]:
                    break
                top -= 1
                begin = -never
            top += 1
            centre[top] = u
            peak[top] = own
            start[top] = begin
        if top < 0:
            continue
        k = 0
        left = peak[0] + (edge + 2 * centre[0]) * (edge + 2 * centre[0])
        for x in range(width):
            place = 2 * x + edge
            while k < top and start[k + 1] <= place:
                k += 1
            right = peak[k] + (place - 2 * centre[k]) * (place - 2 * centre[k])
            best = left if edge == 1 and left < right else right
            own = squared[row + u64(x)]
            squared[row + u64(x)] = own if own < best else best
            left = right
