"""Rules of obstacles of one cell that ticks and drives share.

Cells are numbers in the map with a border one cell wide: ``(y + 1) * stride + x + 1``, where ``stride = width + 2``.
"""

from __future__ import annotations

from lampyris.kernels._jit import kernel


@kernel()
def crosses(cell, dx, dy, stride, left, step_x, step_y):
    """Whether a diagonal step from a cell crosses a diagonal driven in this tick."""
    obstacle = left[cell + dx] - 1
    if obstacle >= 0 and step_x[obstacle] == -dx and step_y[obstacle] == dy:
        return True
    obstacle = left[cell + dy * stride] - 1
    return obstacle >= 0 and step_x[obstacle] == dx and step_y[obstacle] == -dy


@kernel()
def rank(cell, turn):
    """The rank of a cell in a random order; :func:`lampyris.sim.traffic.obstacle_draws.ranks` has the same numbers."""
    x = (cell * 0x9E3779B1 + turn) & 0x7FFFFFFF
    x = ((x ^ (x >> 16)) * 0x45D9F3B) & 0x7FFFFFFF
    x = ((x ^ (x >> 15)) * 0x45D9F3B) & 0x7FFFFFFF
    return x ^ (x >> 16)
