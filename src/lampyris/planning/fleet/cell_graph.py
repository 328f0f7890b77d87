"""The free cells of a map as a graph: what the kernels of multi-robot planning walk on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.typing import BoolGrid, Cell, Cells

Numbers = NDArray[np.int32]
"""Numbers of free cells."""
_DIAGONALS = ((-1, -1), (1, -1), (-1, 1), (1, 1))


@dataclass(frozen=True, slots=True, eq=False)
class CellGraph:
    """Free cells, numbered row by row, and their neighbours.

    Parameters
    ----------
    number : int32, (height, width); the number of each free cell, -1 elsewhere.
    places : int32, (cells, 2); x and y by number.
    edge : int32; the neighbours of each cell, see :mod:`lampyris.kernels.fleet.steps`.
    degree : uint8, (cells,); how many neighbours there are.
    roomy : uint8, (cells,); whether three neighbours or more are no dead ends, as far as the kernels ask.
    """

    number: Numbers
    places: Cells
    edge: Numbers
    degree: NDArray[np.uint8]
    roomy: NDArray[np.uint8]

    @classmethod
    def of(cls, free: BoolGrid, moves: str = "four-connected") -> CellGraph:
        """The graph of the free cells, bool (height, width), with the steps of ``four-connected`` or ``octile``."""
        height, width = free.shape
        cells = int(np.count_nonzero(free))
        number = np.full((height, width), -1, dtype=np.int32)
        number[free] = np.arange(cells, dtype=np.int32)
        y, x = np.nonzero(free)
        padded = np.full((height + 2, width + 2), -1, dtype=np.int32)
        padded[1:-1, 1:-1] = number

        def at(dx: int, dy: int) -> Numbers:
            return padded[y + 1 + dy, x + 1 + dx]

        straight = [at(dx, dy) for dx, dy in ((0, -1), (-1, 0), (1, 0), (0, 1))]
        around, beside = straight, []
        if moves == "octile":
            diagonal = [
                np.where((at(dx, 0) >= 0) & (at(0, dy) >= 0), at(dx, dy), -1) for dx, dy in _DIAGONALS
            ]
            around = [*straight, *diagonal]
            beside = [*[np.full(cells, -1, dtype=np.int32)] * 4, *[at(dx, 0) for dx, _ in _DIAGONALS]]
        to = np.stack(around, axis=1)
        missing = to < 0
        order = np.argsort(missing, axis=1, kind="stable")
        edge = np.where(missing, cells, to)
        edge = np.take_along_axis(edge, order, axis=1)
        if beside:
            edge = np.concatenate((edge, np.take_along_axis(np.stack(beside, axis=1), order, axis=1)), axis=1)
        degree = (len(around) - missing.sum(axis=1)).astype(np.uint8)
        roomy = np.zeros(cells, dtype=np.uint8)
        if moves != "octile":
            padded[1:-1, 1:-1][free] = degree
            roomy[:] = np.sum([at(dx, dy) >= 2 for dx, dy in ((0, -1), (-1, 0), (1, 0), (0, 1))], axis=0) >= 3
        places = np.stack((x, y), axis=1).astype(np.int32)
        return cls(number, places, np.ascontiguousarray(edge.astype(np.int32).ravel()), degree, roomy)

    @property
    def cells(self) -> int:
        """How many free cells there are."""
        return len(self.degree)

    @property
    def wide(self) -> int:
        """Numbers of a row of ``edge``."""
        return len(self.edge) // self.cells

    @property
    def places_of_step(self) -> int:
        """How many cells a robot may be on after a tick: 5 with four-connected, 9 with octile moves."""
        return 5 if self.wide == 4 else 9

    def numbers(self, cells: tuple[Cell, ...]) -> Numbers:
        """The numbers of free cells (x, y)."""
        at = np.array(cells, dtype=np.int64).reshape(-1, 2)
        return np.ascontiguousarray(self.number[at[:, 1], at[:, 0]])
