"""The frame: a map laid out once with a border of walls as wide as the longest step, so that the kernels need
no bounds; and the memory that the field's passes work in.
"""

from __future__ import annotations

import math
import threading
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.errors import LimitError
from lampyris.model.grid import frozen
from lampyris.model.moves import PELL_Q, Moves
from lampyris.typing import BoolGrid, Cell

AHEAD = 25
"""How far past the end of the list of cells the kernels may look ahead."""
WEIGHS_MOST = 5
"""A step over the heaviest terrain costs so many times what it costs over plain ground."""
_NARROW, _WIDE = 2**30, 2**62
MOST = 2**31
"""Cells have numbers of 32 bits, the border's too."""
PART = 1 << 18
"""Cells of a map that NumPy works on between two cancellation checks."""
SPARING = 2**23
"""Frames of so many cells or more are worked in as little memory as can be: lists lie in what the results
will fill. That it takes longer shows on smaller maps only, and there 4 to 8 bytes a cell are nothing."""
_SCRATCH_BYTES = 64 << 20
"""Largest scratch kept from call to call: on some machines fresh memory costs more than the wavefront."""


def framed(inside: NDArray[Any], pad: int, border: Any, kind: Any = None) -> NDArray[Any]:
    """A map in a border of one value, flat; part by part, with a cancellation check before each.

    Parameters
    ----------
    inside : (height, width).
    pad : width of the border.
    border : what is in it.
    kind : element type; None for that of the map.
    """
    height, width = inside.shape
    out = np.empty((height + 2 * pad, width + 2 * pad), dtype=kind or inside.dtype)
    out[:pad] = out[height + pad :] = border
    part = max(1, PART // width)
    for y in range(0, height, part):
        checkpoint()
        rows = out[pad + y : pad + min(y + part, height)]
        rows[:, :pad] = rows[:, pad + width :] = border
        rows[:, pad : pad + width] = inside[y : y + part]
    return out.ravel()


class BorderedMap:
    """A map with its border of walls: sizes, indices and views.

    Parameters
    ----------
    free : bool, (height, width).
    moves : the step set; weighed ones where the map has terrain.
    terrain : whether it has.
    wide : whether costs need 64 bits though they usually do not.

    Raises
    ------
    LimitError : more cells, or costlier steps, than exact costs have room for.
    """

    def __init__(self, free: BoolGrid, moves: Moves, *, terrain: bool = False, wide: bool = False) -> None:
        self.pad = moves.reach
        self.rows: int = free.shape[0] + 2 * self.pad
        self.width: int = free.shape[1] + 2 * self.pad
        self.size: int = self.width * self.rows
        self.cells: int = free.size
        if self.size >= MOST:
            raise LimitError(
                "LIMIT", f"{free.shape[1]:,} x {free.shape[0]:,} cells", allowed=f"fewer than {MOST:,} in all"
            )
        most = max(moves.costs)
        if moves.unit == PELL_Q * moves.scale and free.size >= PELL_Q:
            raise LimitError("LIMIT", f"{free.size} cells", allowed=f"fewer than {PELL_Q} with octile moves")
        if terrain:
            if WEIGHS_MOST * most * self.size >= _WIDE // 2:
                raise LimitError("LIMIT", f"{free.size} cells with steps of {most}", allowed="less in all")
            # The bound of plain ground is far above what real maps come to. 32 bits are tried wherever they
            # hold a path of a thousand steps at the least, and the kernel says so if they are too few.
            narrow = not wide and 1000 * WEIGHS_MOST * most < _NARROW
        else:
            # A path visits a cell once, so no cost exceeds the longest step at every cell.
            narrow = most * self.size < _NARROW
        self.never: int = _NARROW if narrow else _WIDE
        self.dtype: Any = np.int32 if narrow else np.int64

    def index(self, cell: Cell) -> int:
        """Index of a cell in the padded map."""
        return (cell[1] + self.pad) * self.width + cell[0] + self.pad

    def inside(self, flat: NDArray[Any]) -> NDArray[Any]:
        """The map without its border, read-only."""
        p = self.pad
        return frozen(flat.reshape(self.rows, self.width)[p : self.rows - p, p : self.width - p])

    def lay(self, values: NDArray[Any], dtype: Any) -> NDArray[Any]:
        """A map copied into the frame, flat, with zeros around it."""
        flat = np.zeros(self.size, dtype=dtype)
        p = self.pad
        flat.reshape(self.rows, self.width)[p : self.rows - p, p : self.width - p] = values
        return flat

    def table(self, moves: Moves) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Index offsets of each step's end and of the two cells that must be free besides."""
        return _table(moves.offsets, moves.corner_cutting, self.width)


@lru_cache(maxsize=64)
def _table(
    offsets: tuple[tuple[int, int], ...], cutting: bool, width: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """See :meth:`BorderedMap.table`.

    The segment of a knight's step (2, 1) leaves its cell through the middle half of one side, crosses the
    border between the straight cell (1, 0) and the diagonal cell (1, 1) at its midpoint, and enters the
    last cell likewise: it touches those two cells, no corner and nothing else.
    """
    jump, side, other = [], [], []
    for dx, dy in offsets:
        end = dy * width + dx
        if abs(dx * dy) == 2:
            x, y = int(math.copysign(1, dx)), int(math.copysign(1, dy))
            first = x if abs(dx) == 2 else y * width
            sides = (first, y * width + x)
        elif dx and dy and not cutting:
            sides = (dx, dy * width)
        else:
            sides = (end, end)
        jump.append(end)
        side.append(sides[0])
        other.append(sides[1])
    return np.array(jump, np.int64), np.array(side, np.int64), np.array(other, np.int64)


Wanted = tuple[int, Any]
"""Length and element type of an array."""


def carve(block: NDArray[np.uint8] | None, *wanted: Wanted) -> tuple[NDArray[np.uint8], list[NDArray[Any]]]:
    """The block, a new one if the given one is too small, and uninitialised arrays side by side in it."""
    sizes = [length * np.dtype(kind).itemsize for length, kind in wanted]
    total = sum(-(-size // 64) * 64 for size in sizes)  # bits: whole numbers
    if block is None or block.size < total:
        block = np.empty(total, dtype=np.uint8)
    at, out = 0, []
    for size, (_, kind) in zip(sizes, wanted, strict=True):
        out.append(block[at : at + size].view(kind))
        at += -(-size // 64) * 64
    return block, out


class Scratch(threading.local):
    """Memory for what only lives during one call, kept from call to call, one block for each thread.

    Nothing is ever read from it that the same call has not written.
    """

    block: NDArray[np.uint8] | None = None

    def take(self, *wanted: Wanted) -> list[NDArray[Any]]:
        """Uninitialised arrays, valid until the next call in this thread."""
        block, arrays = carve(self.block, *wanted)
        self.block = block if block.size <= _SCRATCH_BYTES else None
        return arrays

    def shrink(self, size: int) -> None:
        """Let go of this thread's block if it has more bytes than that."""
        if self.block is not None and self.block.size > size:
            self.block = None

    def within(self, host: NDArray[Any], *wanted: Wanted) -> list[NDArray[Any]]:
        """The same, those for which there is room in the memory of another array there, the largest first."""
        sizes = [-(-length * np.dtype(kind).itemsize // 64) * 64 for length, kind in wanted]
        room, lent = host.nbytes, []
        for k in sorted(range(len(wanted)), key=lambda k: -sizes[k]):
            if sizes[k] <= room:
                lent.append(k)
                room -= sizes[k]
        own = [k for k in range(len(wanted)) if k not in lent]
        arrays = carve(host.view(np.uint8), *(wanted[k] for k in lent))[1]
        arrays += self.take(*(wanted[k] for k in own)) if own else []
        return [arrays[(lent + own).index(k)] for k in range(len(wanted))]


SCRATCH = Scratch()
