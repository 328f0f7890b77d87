"""Loops of :mod:`.descent` by operations on whole arrays, for where nothing is compiled: equal to them to the last bit.

They take the place of the plain forms, at a tenth of their time on 50 x 50 cells.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray


def parents8(
    cost: NDArray[Any], step: NDArray[np.int8], width: int, rows: int,
    straight: int, diagonal: int, guard: int, limit: int, halt: Any,
) -> None:  # fmt: skip
    """See :func:`.descent.parents8`."""
    map_ = cost[: rows * width].reshape(rows, width)
    c = map_[1:-1, 1:-1]
    near, far = c - straight, c - diagonal
    up, down = map_[:-2, 1:-1], map_[2:, 1:-1]
    left, right = map_[1:-1, :-2], map_[1:-1, 2:]
    found = np.full(c.shape, -1, dtype=step.dtype)
    for k, beside in ((7, down), (6, up), (5, right), (4, left)):
        found[beside == near] = k
    for k, corner, one, other in (
        (3, map_[2:, 2:], down, right),
        (2, map_[2:, :-2], down, left),
        (1, map_[:-2, 2:], up, right),
        (0, map_[:-2, :-2], up, left),
    ):
        hit = corner == far
        if guard:
            hit &= (one | other) >= 0
        found[hit] = k
    found[(c > limit) | (c <= 0)] = -1
    step[: rows * width].reshape(rows, width)[1:-1, 1:-1] = found
    map_[map_ > limit] = -1


def glow(
    order: NDArray[np.uint32], count: int, cost: NDArray[Any], step: NDArray[np.int8], jump: NDArray[np.int64],
    luciferin: NDArray[np.float64], nothing: float, keep: float, gamma: float, unit: int, halt: Any,
) -> None:  # fmt: skip
    """See :func:`.descent.glow`."""
    cells = order[1:count].astype(np.int64)
    parents = cells + jump[step[cells]]
    shares = gamma * (cost[cells] / unit)
    found = [nothing] * len(luciferin)
    found[order[0]] = 0.0
    # In the order of the list: each after its parent.
    for cell, parent, share in zip(cells.tolist(), parents.tolist(), shares.tolist(), strict=True):
        found[cell] = keep * found[parent] + share
    luciferin[:] = found
