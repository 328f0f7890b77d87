"""Any-angle search on cell centres: Theta* and lazy Theta*, lines of sight, and a walk along the lines.

Theta*: Nash, Daniel, Koenig, Felner, "Theta*: any-angle path planning on grids", AAAI 2007, 1177-1183.
Lazy: Nash, Koenig, Tovey, "Lazy Theta*: any-angle path planning and path length analysis in 3D", AAAI
2010, 147-154.

Lines of sight are exact, in integers. Which cells must be free is said by ``rule``:

* ``CUT``: those whose inside the line runs through; it may pass between two blocked cells that share a
  corner.
* ``TOUCH``: those that the line touches, if only at a corner. (For a diagonal step: its two side cells,
  which is the rule of moves without corner cutting; for a knight's step: the two cells between.)
* ``WIDE``: of every unit square *between four cell centres* whose inside the line runs through, all four.
  For a disc that is enough: take a point of the line and a blocked cell. The coordinate of that cell is a
  whole number on each axis, so along each axis one of the two nearest whole coordinates lies between the
  point and it, or at it; the point is at least as far from the blocked square along each axis as one of
  the four centres around the point, which has room for the disc. (The same reasoning as for diagonal
  steps in field.layers.moves_for.) It asks for more than a disc of exactly that radius needs, never for
  less.

Where cells weigh differently, a line of sight must also keep to cells of one weight: its price is then its
length times that weight, and never less than what the disc or point pays on it.

What Theta* guarantees: its path is never longer than the cheapest walk by its steps. Suppose a cell were
expanded at a cost above that of its cheapest walk. Take the first cell on that walk that has not been
expanded; the one before it was, at no more than its walk's cost, and has offered it one step more, or
less than that; so its f is below that of the cell supposed (the straight distance is consistent), and it
would have gone first. Lazy Theta* checks a line only when the cell at its end is about to be expanded. If
it is blocked the cell takes its best expanded neighbour for parent, and where it then goes back to wait
at that cost the same argument holds. Where it is expanded at once, as published, it does not.
"""

from __future__ import annotations

from math import sqrt

from lampyris.kernels._helpers import STRETCH
from lampyris.kernels._jit import PATH, kernel, stopped, u64
from lampyris.kernels.heap import put, take

FOUND, EXHAUSTED, LIMIT = 0, 1, 2
CUT, TOUCH, WIDE = 0, 1, 2

LOOK = 16
"""Cells expanded between two cancellation checks: each may look along eight lines across the map."""
EQUAL = 1e-9
"""Lengths that differ by less are the same: of two such paths the one with fewer turns is taken."""


@kernel()
def _open(free, weight, mask, value, at):
    """1 where a cell is free and of that weight."""
    return 1 if free[u64(at)] != 0 and weight[u64(at & mask)] == value else 0


@kernel()
def sees(free, weight, mask, stride, at, x, y, to_x, to_y, rule):
    """1 where the straight line between two cells is free, else 0. ``at`` is x, y as a flat index."""
    value = weight[u64(at & mask)]
    wide = abs(to_x - x)
    high = abs(to_y - y)
    right = 1 if to_x > x else -1
    down = stride if to_y > y else -stride
    i = 0
    if rule == WIDE and wide > 0 and high > 0:
        # From square to square between the centres. The next column of centres is met at (i + 1) / wide
        # of the segment, the next row at (j + 1) / high; the end is where both are met.
        over = high - wide
        while i < wide:
            if (
                _open(free, weight, mask, value, at)
                & _open(free, weight, mask, value, at + right)
                & _open(free, weight, mask, value, at + down)
                & _open(free, weight, mask, value, at + right + down)
            ) == 0:
                return 0
            late = over
            if late <= 0:
                i += 1
                at += right
                over += high
            if late >= 0:
                at += down
                over -= wide
        return 1
    # From cell to cell. The next column is entered at (2 i + 1) / (2 wide) of the segment, the next row
    # likewise.
    j = 0
    over = high - wide
    while i < wide or j < high:
        late = over
        if late == 0 and rule != CUT:
            if (
                _open(free, weight, mask, value, at + right) & _open(free, weight, mask, value, at + down)
                == 0
            ):
                return 0
        if late <= 0:
            i += 1
            at += right
            over += 2 * high
        if late >= 0:
            j += 1
            at += down
            over -= 2 * wide
        if _open(free, weight, mask, value, at) == 0:
            return 0
    return 1


@kernel()
def _length(stride, u, v):
    """Distance between the centres of two cells."""
    down = u // stride - v // stride
    right = (u - v) - down * stride
    return sqrt(float(right * right + down * down))


@kernel(out=("g", "parent"))
def _settle(free, weight, mask, stride, offset, via, across, dx, dy, rule, u, run, seen, g, parent):
    """Lazy Theta* finds out whether the line to u is free, and if not, takes the best expanded neighbour.

    Returns by how much the cost of u has risen.
    """
    p = parent[u64(u)] + 0
    y = u // stride
    x = u - y * stride
    above = p // stride
    if sees(free, weight, mask, stride, p, p - above * stride, above, x, y, rule) == 1:
        return 0.0
    best = -1.0
    factor = (63.0 + weight[u64(u & mask)]) / 63.0
    for k in range(len(offset)):
        v = u - offset[k]
        if free[u64(v)] == 0 or seen[u64(v)] != -run:
            continue
        if free[u64(v + via[k])] == 0 or free[u64(v + across[k])] == 0:
            continue
        through = g[u64(v)] + sqrt(float(dx[k] * dx[k] + dy[k] * dy[k])) * factor
        if best < 0.0 or through < best:
            best = through
            parent[u64(u)] = v
    rise = best - g[u64(u)]
    g[u64(u)] = best
    return rise


@kernel(out=("heap", "place", "f", "h", "g", "seen", "parent"))
def _offer(heap, place, f, h, g, seen, parent, stride, goal, run, v, reached, p):
    """Give a cell a cheaper path, over p."""
    if seen[u64(v)] != run:
        seen[u64(v)] = run
        h[u64(v)] = _length(stride, v, goal)
    g[u64(v)] = reached
    f[u64(v)] = reached + h[u64(v)]
    parent[u64(v)] = p
    put(heap, place, f, h, v)


@kernel(out=("heap", "place", "f", "h", "g", "seen", "parent", "chain", "result"), each=4300)
def theta(
    free, weight, mask, stride, start, goal, budget, run, offset, via, across, dx, dy, rule, lazy,
    heap, place, f, h, g, seen, parent, chain, result, halt,
):  # fmt: skip
    """A short path of straight lines between cell centres.

    Parameters
    ----------
    free : uint8, (n,), padded as for :func:`lampyris.kernels.graph.search.search`; 1 where the robot may be.
    weight, mask : uint8; cell v weighs ``(63 + weight[v & mask]) / 63``; mask is -1, or 0 where all weigh
        alike.
    stride : length of a padded row.
    start, goal : flat indices.
    budget : greatest number of expansions; -1: no limit.
    run : the number of this search, from 1, never used twice with the same ``seen``.
    offset, via, across, dx, dy : the steps by which cells are met; see
        :func:`lampyris.kernels.graph.search.search`.
    rule : CUT, TOUCH or WIDE.
    lazy : 0 for Theta*; 1 for lazy Theta*; 2 where in addition a cell whose line proves blocked waits
        again at the cost that it has then.
    heap, place : int32, (n + 1,) and (n,); empty and zeros before and after.
    f, h, g : float64, (n,); scratch.
    seen : int32, (n,); run in cells met, -run in cells expanded.
    parent : int32, (n,); scratch.
    chain : int32, (n,); the turning points, goal first.
    result : int64, (3,); the ending, expansions, turning points.
    """
    seen[start] = 0
    _offer(heap, place, f, h, g, seen, parent, stride, goal, run, start, 0.0, start)
    expansions = 0
    turns = 0
    ending = EXHAUSTED
    while heap[0] > 0:
        u = heap[1] + 0
        turns += 1
        if (u != goal and expansions == budget) or (turns % LOOK == 0 and stopped(halt)):
            ending = LIMIT
            break
        take(heap, place, f, h, u)
        if lazy > 0:
            risen = _settle(
                free, weight, mask, stride, offset, via, across, dx, dy, rule, u, run, seen, g, parent
            )
            if lazy == 2 and risen > 0.0:
                f[u64(u)] = g[u64(u)] + h[u64(u)]
                put(heap, place, f, h, u)
                continue
        seen[u64(u)] = -run
        if u == goal:
            ending = FOUND
            break
        expansions += 1
        p = parent[u64(u)] + 0
        above = p // stride
        aside = p - above * stride
        y = u // stride
        x = u - y * stride
        for k in range(len(offset)):
            v = u + offset[k]
            if free[u64(v)] == 0 or seen[u64(v)] == -run:
                continue
            if free[u64(u + via[k])] == 0 or free[u64(u + across[k])] == 0:
                continue
            factor = (63.0 + weight[u64(v & mask)]) / 63.0
            known = g[u64(v)] if seen[u64(v)] == run else -1.0
            by_step = g[u64(u)] + sqrt(float(dx[k] * dx[k] + dy[k] * dy[k])) * factor
            to_x = x + dx[k]
            to_y = y + dy[k]
            in_line = (
                g[u64(p)]
                + sqrt(float((to_x - aside) * (to_x - aside) + (to_y - above) * (to_y - above))) * factor
            )
            like = weight[u64(p & mask)] == weight[u64(v & mask)]
            if like and in_line <= by_step + EQUAL and (known < 0.0 or in_line < known):
                if lazy > 0 or sees(free, weight, mask, stride, p, aside, above, to_x, to_y, rule):
                    _offer(heap, place, f, h, g, seen, parent, stride, goal, run, v, in_line, p)
                    continue
            if known < 0.0 or by_step < known:
                _offer(heap, place, f, h, g, seen, parent, stride, goal, run, v, by_step, u)
    for i in range(1, heap[0] + 1):
        place[u64(heap[u64(i)])] = 0
    heap[0] = 0
    points = 0
    if ending == FOUND:
        u = goal
        chain[0] = goal
        points = 1
        while u != start:
            u = int(parent[u])
            chain[points] = u
            points += 1
            if points % STRETCH == 0 and stopped(halt):
                break
    result[0] = ending
    result[1] = expansions
    result[2] = points


@kernel(out=("path",), each=2000, of=PATH)
def follow(free, stride, x, y, diagonals, path, halt):
    """A walk by single steps along straight lines of sight, start first; return how many cells.

    In each column (or row, on a steep line) the cell on the line, or the farther one where it passes
    between two. A diagonal from one to the next runs beside one cell that the line touches and one that
    it may not: if that is blocked the walk goes over the other, in two steps. (Under ``CUT`` both may be,
    and neither matters.)

    Parameters
    ----------
    free : uint8, (n,), padded; 1 where the robot may be.
    stride : length of a padded row.
    x, y : int64; the turning points, padded.
    diagonals : 2 where diagonals may cut corners, 1 where both side cells must be free, 0 where there are
        none.
    path : int32, (m,); flat cells; m may be 1 and the sum of all distances along the axes.
    """
    at = int(y[0] * stride + x[0])
    path[0] = at
    count = 1
    for leg in range(len(x) - 1):
        wide = abs(x[leg + 1] - x[leg])
        high = abs(y[leg + 1] - y[leg])
        # ``on`` is a step along the longer axis, ``off`` one along the other.
        on = 1 if x[leg + 1] > x[leg] else -1
        off = stride if y[leg + 1] > y[leg] else -stride
        if high > wide:
            wide, high = high, wide
            on, off = off, on
        j = 0
        for i in range(wide):
            if i % STRETCH == 0 and stopped(halt):
                return count
            if (2 * (i + 1) * high + wide) // (2 * wide) > j:
                # The line enters the next row before, with or after the next column.
                late = (2 * j + 1) * wide - (2 * i + 1) * high
                slant = diagonals == 2 or (
                    diagonals == 1 and free[u64(at + on)] != 0 and free[u64(at + off)] != 0
                )
                if not slant:
                    path[count] = at + (off if late < 0 else on)
                    count += 1
                at += off
                j += 1
            at += on
            path[count] = at
            count += 1
    return count
