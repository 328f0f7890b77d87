"""Random numbers by counter, and random cells.

The number of a draw and a key give 32 bits, by a hash with two multiplications (C. Wellons, "Prospecting for hash
functions", 2018, the function lowbias32), applied twice. Nothing is kept between two draws but their number, so that a
search that goes on draws what it would have drawn in one piece. Both forms compute with whole numbers alone.
"""

from __future__ import annotations

from math import floor, sqrt

from lampyris.kernels._jit import kernel, u64

MASK = 0xFFFFFFFF
WHOLE = 4294967296.0
# Entries of ``whole``, the array of whole numbers that trees in the plane are given.
(
    STRIDE,
    RULE,
    WIDE,
    HIGH,
    BASE,
    START,
    GOAL,
    KEY,
    SAMPLES,
    STAR,
    INFORMED,
    ANCESTORS,
    BIAS,
    NARROW,
    REACH,
    NEAR,
) = range(16)

TRIES = 64
"""Draws of a cell at most for one sample: of those within an ellipse some lie in walls."""


@kernel()
def _mixed(x):
    """A hash of 32 bits."""
    x ^= x >> 16
    x = (x * 0x7FEB352D) & MASK
    x ^= x >> 15
    x = (x * 0x846CA68B) & MASK
    return x ^ (x >> 16)


@kernel()
def drawn(key, number):
    """32 random bits: the draw of that number under a key of 32 bits."""
    return _mixed(_mixed(number & MASK) ^ key)


@kernel(out=("count",), inline=True)
def next_draw(key, count, at):
    """The draw whose number is ``count[at]``, which then is the next."""
    number = count[u64(at)] + 0
    count[u64(at)] = number + 1
    return drawn(key, number)


@kernel()
def length(ax, ay, bx, by):
    """Distance between two cells."""
    return sqrt(float((bx - ax) * (bx - ax) + (by - ay) * (by - ay)))


@kernel(out=("count",))
def _drawn_beside(free, trail, whole, count, at):
    """A random cell near a random one of the best path, flat; -1: it is not free."""
    stride = whole[STRIDE]
    first = next_draw(whole[KEY], count, at)
    second = next_draw(whole[KEY], count, at)
    cell = int(trail[u64((first * len(trail)) >> 32)])
    far = 1 << (second >> 30)
    y = cell // stride
    x = cell - y * stride + (((second & 0x7FFF) * (2 * far + 1)) >> 15) - far
    y += ((((second >> 15) & 0x7FFF) * (2 * far + 1)) >> 15) - far
    cell = y * stride + x
    if x < 0 or x >= stride or cell < 0 or cell >= len(free) or free[u64(cell)] == 0:
        return -1
    return cell


@kernel(out=("count",))
def drawn_cell(free, cells, narrow, trail, whole, best, count, at):
    """A random free cell, flat; -1: none of :data:`TRIES` lay in the ellipse and in free cells.

    Each free cell is as likely as any other, but for a share of samples that are narrow places; once a path is known, each
    free cell through which a shorter one may lead.
    Those lie in an ellipse around start and goal (Gammell, Srinivasa, Barfoot 2014). Where it is smaller than
    the free space a point of it is drawn, and the cell around that is taken.

    Parameters
    ----------
    free : uint8 (n,), padded.
    cells, narrow : int32: the free cells, and those of them in narrow places, flat.
    trail : int32: the cells of the best path, flat.
    whole : int64 (16,): ``STRIDE``: length of a padded row. ``NARROW``, ``NEAR``: of 2**32 samples so many are in narrow
        places, or near the best path.
        ``KEY``: of the draws. ``START``, ``GOAL``: flat cells.
    best : length of the best path; negative: none is known, or the whole map is to be drawn from.
    count : int64: the number of the next draw is ``count[at]``.
    """
    stride = whole[STRIDE]
    key = whole[KEY]
    start = whole[START]
    goal = whole[GOAL]
    if whole[NEAR] > 0 and len(trail) > 0:
        bits = next_draw(key, count, at)
        if bits < whole[NEAR]:
            return _drawn_beside(free, trail, whole, count, at)
    bits = next_draw(key, count, at)
    if bits < whole[NARROW] and len(narrow) > 0:
        bits = next_draw(key, count, at)
        cell = int(narrow[u64((bits * len(narrow)) >> 32)])
        if best < 0.0:
            return cell
        y = cell // stride
        x = cell - y * stride
        by = start // stride
        to = goal // stride
        there = length(start - by * stride, by, x, y) + length(x, y, goal - to * stride, to)
        return cell if there < best else -1
    if best < 0.0:
        bits = next_draw(key, count, at)
        return int(cells[u64((bits * len(cells)) >> 32)])
    sy = start // stride
    sx = start - sy * stride
    gy = goal // stride
    gx = goal - gy * stride
    least = length(sx, sy, gx, gy)
    half = best / 2.0
    side = sqrt(max(best * best - least * least, 0.0)) / 2.0
    ux = 1.0
    uy = 0.0
    if least > 0.0:
        ux = (gx - sx) / least
        uy = (gy - sy) / least
    small = 3.15 * half * side < len(cells)
    for _ in range(TRIES):
        first = next_draw(key, count, at)
        if not small:
            cell = int(cells[u64((first * len(cells)) >> 32)])
            y = cell // stride
            x = cell - y * stride
        else:
            second = next_draw(key, count, at)
            a = first / WHOLE * 2.0 - 1.0
            b = second / WHOLE * 2.0 - 1.0
            if a * a + b * b > 1.0:
                continue
            a *= half
            b *= side
            x = floor((sx + gx) / 2.0 + a * ux - b * uy + 0.5)
            y = floor((sy + gy) / 2.0 + a * uy + b * ux + 0.5)
            cell = y * stride + x
            if x < 0 or x >= stride or cell < 0 or cell >= len(free) or free[u64(cell)] == 0:
                continue
        if length(sx, sy, x, y) + length(x, y, gx, gy) < best:
            return cell
    return -1
