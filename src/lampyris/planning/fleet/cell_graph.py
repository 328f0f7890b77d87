"""The free cells of a map as a graph: what the kernels of multi-robot planning walk on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.typing import BoolGrid, Cell, Cells

Numbers = NDArray[np.int32]
"""Numbers of free cells."""
_STRAIGHT = ((0, -1), (-1, 0), (1, 0), (0, 1))
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
    passing : uint8, (cells,); whether three neighbours or more are no dead ends, as far as the kernels ask.
    """

    number: Numbers
    places: Cells
    edge: Numbers
    degree: NDArray[np.uint8]
    passing: NDArray[np.uint8]

    @classmethod
    def of(cls, free: BoolGrid, moves: str = "four-connected") -> CellGraph:
        """The graph of the free cells, bool (height, width), with the steps of ``four-connected`` or ``octile``."""
        cells = int(np.count_nonzero(free))
        inside = np.zeros((free.shape[0] + 2, free.shape[1] + 2), dtype=bool)
        inside[1:-1, 1:-1] = free
        at = np.flatnonzero(inside)
        across = inside.shape[1]
        numbers = np.full(inside.size, -1, dtype=np.int32)
        numbers[at] = np.arange(cells, dtype=np.int32)
        offsets = [dx + across * dy for dx, dy in _STRAIGHT]
        to = np.empty((cells, 8 if moves == "octile" else 4), dtype=np.int32)
        for k, offset in enumerate(offsets):
            to[:, k] = numbers[at + offset]
        beside = np.full((cells, 8), -1, dtype=np.int32)
        passing = np.zeros(cells, dtype=np.uint8)
        if moves == "octile":
            for k, (dx, dy) in enumerate(_DIAGONALS, 4):
                beside[:, k] = numbers[at + dx]
                is_open = (beside[:, k] >= 0) & (numbers[at + across * dy] >= 0)
                to[:, k] = np.where(is_open, numbers[at + dx + across * dy], -1)
        degree = np.count_nonzero(to >= 0, axis=1).astype(np.uint8)
        some = np.flatnonzero(degree < to.shape[1])
        order = np.argsort(to[some] < 0, axis=1, kind="stable")
        to[some] = np.take_along_axis(np.where(to[some] < 0, cells, to[some]), order, axis=1)
        if moves == "octile":
            beside[some] = np.take_along_axis(beside[some], order, axis=1)
            to = np.concatenate((to, beside), axis=1)
        else:
            leads_on = np.zeros(inside.size, dtype=np.uint8)
            leads_on[at] = degree >= 2
            for offset in offsets:
                passing += leads_on[at + offset]
            passing = (passing >= 3).astype(np.uint8)
        y, x = np.divmod(at.astype(np.int32), np.int32(across))
        places = np.stack((x - 1, y - 1), axis=1)
        number = np.ascontiguousarray(numbers.reshape(inside.shape)[1:-1, 1:-1])
        return cls(number, places, to.ravel(), degree, passing)

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
