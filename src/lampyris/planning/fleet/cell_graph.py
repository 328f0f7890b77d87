"""The free cells of a map as a graph: what the kernels of multi-robot planning walk on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.typing import BoolGrid, Cell, Cells

Numbers = NDArray[np.int32]
"""Numbers of free cells."""


@dataclass(frozen=True, slots=True, eq=False)
class CellGraph:
    """Free cells, numbered row by row, and their four-connected neighbours.

    Parameters
    ----------
    number : int32, (height, width); the number of each free cell, -1 elsewhere.
    places : int32, (cells, 2); x and y by number.
    edge : int32, (4 * cells,); the neighbours of each cell, those that exist first, then ``cells``.
    degree : uint8, (cells,); how many exist.
    """

    number: Numbers
    places: Cells
    edge: Numbers
    degree: NDArray[np.uint8]

    @classmethod
    def of(cls, free: BoolGrid) -> CellGraph:
        """The graph of the free cells, bool (height, width)."""
        height, width = free.shape
        cells = int(np.count_nonzero(free))
        number = np.full((height, width), -1, dtype=np.int32)
        number[free] = np.arange(cells, dtype=np.int32)
        y, x = np.nonzero(free)
        padded = np.full((height + 2, width + 2), -1, dtype=np.int32)
        padded[1:-1, 1:-1] = number
        around = np.stack(
            [padded[y + 1 + dy, x + 1 + dx] for dx, dy in ((0, -1), (-1, 0), (1, 0), (0, 1))], axis=1
        )
        missing = around < 0
        edge = np.take_along_axis(around, np.argsort(missing, axis=1, kind="stable"), axis=1)
        edge[edge < 0] = cells
        degree = (4 - missing.sum(axis=1)).astype(np.uint8)
        places = np.stack((x, y), axis=1).astype(np.int32)
        return cls(number, places, np.ascontiguousarray(edge.ravel()), degree)

    @property
    def cells(self) -> int:
        """How many free cells there are."""
        return len(self.degree)

    def numbers(self, cells: tuple[Cell, ...]) -> Numbers:
        """The numbers of free cells (x, y)."""
        at = np.array(cells, dtype=np.int64).reshape(-1, 2)
        return np.ascontiguousarray(self.number[at[:, 1], at[:, 0]])
