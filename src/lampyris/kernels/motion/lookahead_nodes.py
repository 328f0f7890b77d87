"""The first node of a path that is at least a given distance away, for every node."""

from __future__ import annotations

from lampyris.kernels._helpers import stopped
from lampyris.kernels._jit import kernel

BLOCK = 64
"""Nodes of a block; BLOCK blocks are a block of the next level."""


@kernel(out=("low_x", "low_y", "high_x", "high_y"), each=1_000)
def bound_blocks(x, y, low_x, low_y, high_x, high_y):
    """The bounding box of each block of BLOCK elements.

    Parameters
    ----------
    x, y : float64 (n,).
    low_x, low_y, high_x, high_y : out, float64 (ceil(n / BLOCK),).
    """
    n = len(x)
    for block in range(len(low_x)):
        first = block * BLOCK
        low_x[block] = high_x[block] = x[first]
        low_y[block] = high_y[block] = y[first]
        for i in range(first + 1, min(first + BLOCK, n)):
            low_x[block] = min(low_x[block], x[i])
            high_x[block] = max(high_x[block], x[i])
            low_y[block] = min(low_y[block], y[i])
            high_y[block] = max(high_y[block], y[i])


@kernel()
def _is_within(px, py, low_x, low_y, high_x, high_y, square):
    """Whether every point of a box is nearer to a point than the square root of ``square``.

    Rounding is monotone: no node within the box is judged otherwise by itself.
    """
    dx = max(abs(low_x - px), abs(high_x - px))
    dy = max(abs(low_y - py), abs(high_y - py))
    return dx * dx + dy * dy < square


@kernel(out=("node",), each=150_000)  # 2.5 us on a straight path, a millisecond within a coil
def advance_to_distance(
    x, y, distance, node,
    low_x, low_y, high_x, high_y, wide_low_x, wide_low_y, wide_high_x, wide_high_y, halt,
):  # fmt: skip
    """Advance ``node[i]`` to the first node that is at least ``distance`` from node i, or to the last node.

    Parameters
    ----------
    x, y : float64 (n,), metres.
    node : in and out, int64 (n,): where the search begins.
    low_x, ..., wide_high_y : the boxes of blocks, and of blocks of blocks, by :func:`bound_blocks`. A path that
        stays near a point for long is passed in blocks. Quadratic, with a small factor, is only a path that stays
        within ``distance`` while the box around it does not.
    """
    n = len(x)
    square = distance * distance
    for i in range(n):
        if i % 256 == 0 and stopped(halt):
            return
        px = x[i]
        py = y[i]
        j = node[i]
        while j < n - 1:
            if j % (BLOCK * BLOCK) == 0 and j + BLOCK * BLOCK < n:
                k = j // (BLOCK * BLOCK)
                if _is_within(px, py, wide_low_x[k], wide_low_y[k], wide_high_x[k], wide_high_y[k], square):
                    j += BLOCK * BLOCK
                    continue
            if j % BLOCK == 0 and j + BLOCK < n:
                k = j // BLOCK
                if _is_within(px, py, low_x[k], low_y[k], high_x[k], high_y[k], square):
                    j += BLOCK
                    continue
            dx = x[j] - px
            dy = y[j] - py
            if dx * dx + dy * dy >= square:
                break
            j += 1
        node[i] = j
