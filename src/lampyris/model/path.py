"""Path: where to drive."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.typing import Cells, Floats


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """A walk from cell to cell by single steps of ``moves``.

    Parameters
    ----------
    cells : int32, (n, 2), x and y, start first, goal last; n >= 1.
    moves : the step set.
    steps : how many straights and diagonals (and knight's steps, for ``sixteen``): the exact cost.
    """

    cells: Cells
    moves: Moves
    steps: tuple[int, ...]

    def __post_init__(self) -> None:
        object.__setattr__(
            self, "cells", frozen(np.array(self.cells, dtype=np.int32, copy=True).reshape(-1, 2))
        )

    @property
    def exact(self) -> int:
        """Exact integer cost."""
        return self.moves.exact(self.steps)

    @property
    def cost(self) -> float:
        """Cost in cells, the steps' costs summed."""
        return self.moves.value(self.exact)

    @property
    def arc(self) -> Floats:
        """Distance along the path at each node, in cells, shape (n,); a diagonal is sqrt 2 here, always."""
        d = np.diff(self.cells.astype(np.float64), axis=0)
        return np.concatenate(([0.0], np.cumsum(np.sqrt(d[:, 0] ** 2 + d[:, 1] ** 2))))

    @property
    def heading(self) -> Floats:
        """Heading of the step that leaves each node (the last keeps its own), radians, y up; shape (n,)."""
        if len(self.cells) == 1:
            return np.zeros(1)
        d = np.diff(self.cells, axis=0)
        h = [math.atan2(-int(dy), int(dx)) for dx, dy in d]
        return np.array([*h, h[-1]])


def count_steps(cells: Cells, moves: Moves) -> tuple[int, ...]:
    """How many straights, diagonals (and knight's steps, where the moves have them) a walk takes."""
    d = np.abs(np.diff(np.asarray(cells, dtype=np.int64).reshape(-1, 2), axis=0))
    product = d[:, 0] * d[:, 1]
    counts = tuple(int(np.count_nonzero(product == k)) for k in (0, 1, 2))
    return counts if moves.knight else counts[:2]


def path_of(cells: Cells, moves: Moves) -> Path:
    """A Path from its cells."""
    return Path(cells, moves, count_steps(cells, moves))
