"""From the pixels of a photograph to the cells of a grid: each cell is what most of its pixels are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from lampyris.model.photos.segmented_photo import LEVELS
from lampyris.typing import BoolGrid, ByteGrid


def cells_of(
    levels: ByteGrid,
    clear: BoolGrid | None,
    thresholds: Sequence[int],
    free: Sequence[int],
    cell: int,
    free_share: float,
) -> tuple[BoolGrid, BoolGrid]:
    """Which cells are blocked and which of these are unknown; bool (rows, columns) both.

    A cell is a square of ``cell`` pixels a side. It is free if more than half of its pixels are of a free class, and
    ``free_share`` of them at least; blocked if more than half are of another class; else unknown. Pixels that are not
    wholly opaque, and those of a cell that reach beyond the photograph, are of no class.
    """
    is_free, is_other = _votes(levels, clear, thresholds, free)
    pixels = cell * cell
    yes, no = (_counts(mask, cell) for mask in (is_free, is_other))
    open_cell = (2 * yes > pixels) & (yes >= free_share * pixels)
    wall = 2 * no > pixels
    return ~open_cell, ~(open_cell | wall)


def _votes(
    levels: ByteGrid, clear: BoolGrid | None, thresholds: Sequence[int], free: Sequence[int]
) -> tuple[BoolGrid, BoolGrid]:
    """Which pixels are of a free class and which are of another."""
    number = np.searchsorted(np.array(thresholds), np.arange(LEVELS))
    is_free: BoolGrid = np.isin(number, np.array(free))[levels]
    is_other: BoolGrid = ~is_free
    if clear is not None:
        is_free = is_free & ~clear
        is_other = is_other & ~clear
    return is_free, is_other


def _counts(mask: BoolGrid, cell: int) -> NDArray[np.int64]:
    """True pixels of each cell, int64 (rows, columns)."""
    if cell == 1:
        return mask.astype(np.int64)
    height, width = mask.shape
    rows, columns = -(-height // cell), -(-width // cell)
    padded = np.pad(mask, ((0, rows * cell - height), (0, columns * cell - width)))
    # bits: whole numbers, which add up alike in any order
    counts: NDArray[np.int64] = padded.reshape(rows, cell, columns, cell).sum(axis=(1, 3), dtype=np.int64)
    return counts
