"""Maps of many kinds, drawn: noise, blocks, rooms, long corridors; plain ground or rough."""

from __future__ import annotations

import numpy as np

from lampyris.typing import BoolGrid, ByteGrid

DENSEST = 0.5
ROUGHEST = 252


def walls(rng: np.random.Generator, width: int, height: int) -> BoolGrid:
    """Blocked cells, bool (height, width); at most about half of them."""
    style = int(rng.integers(5))
    if style == 0:
        return _blocks(rng, width, height)
    if style == 1:
        return _rooms(rng, width, height)
    if style == 2:
        return _corridors(rng, width, height)
    return rng.random((height, width)) < rng.random() * DENSEST


def _blocks(rng: np.random.Generator, width: int, height: int) -> BoolGrid:
    blocked = np.zeros((height, width), dtype=np.bool_)
    for _ in range(int(rng.integers(1, 30))):
        x, y = int(rng.integers(width)), int(rng.integers(height))
        w, h = (int(n) for n in rng.integers(1, 2 + min(width, height) // 4, size=2))
        blocked[y : y + h, x : x + w] = True
    return blocked


def _rooms(rng: np.random.Generator, width: int, height: int) -> BoolGrid:
    """Walls every few cells both ways, with doors; some rooms have none."""
    blocked = np.zeros((height, width), dtype=np.bool_)
    side = int(rng.integers(3, 10))
    blocked[side::side] = True
    blocked[:, side::side] = True
    blocked &= rng.random((height, width)) >= rng.choice([0.05, 0.2, 0.4])
    return blocked


def _corridors(rng: np.random.Generator, width: int, height: int) -> BoolGrid:
    """Every second or third row a wall with a gap or two: ways are many times as long as the map."""
    blocked = np.zeros((height, width), dtype=np.bool_)
    every = int(rng.integers(2, 4))
    for y in range(1, height, every):
        blocked[y] = True
        blocked[y, rng.integers(width, size=int(rng.integers(1, 3)))] = False
    turned: BoolGrid = blocked[:, ::-1] if rng.random() < 0.5 else blocked
    return turned


def terrain(rng: np.random.Generator, blocked: BoolGrid) -> ByteGrid | None:
    """What cells cost besides, 0 to 252: anything, patches, few values or two; None if it is 0 everywhere."""
    shape = blocked.shape
    style = int(rng.integers(4))
    if style == 0:
        values = rng.integers(0, ROUGHEST + 1, shape)
    elif style == 1:
        values = rng.integers(0, ROUGHEST + 1, shape) * (rng.random(shape) < 0.1)
    elif style == 2:
        values = ROUGHEST * (rng.random(shape) < 0.5)
    else:
        values = rng.integers(0, 3, shape)
    grades: ByteGrid = np.where(blocked, 0, values).astype(np.uint8)
    return grades if grades.any() else None
