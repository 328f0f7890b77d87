"""Path: where to drive."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core import elementary
from lampyris._core.arrays import cells_of
from lampyris._core.values import Value
from lampyris.errors import SettingError, shown
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.moves import Moves
from lampyris.typing import ByteGrid, Cells, Floats


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Path(Value):
    """A walk from cell to cell by single steps of ``moves``.

    Parameters
    ----------
    cells : int32, (n, 2), x and y, start first, goal last; n >= 1.
    moves : the step set.
    steps : how many straights and diagonals (and knight's steps, for ``sixteen-connected``).
    paid : exact cost where the cells entered weigh differently (terrain); None: what the steps cost.
    """

    cells: Cells
    moves: Moves
    steps: tuple[int, ...]
    paid: int | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "cells", cells_of("path", "cells", self.cells))
        if not isinstance(self.moves, Moves):
            raise SettingError("TYPE", shown(self.moves), where="path.moves", allowed="Moves")

    def _brief(self) -> str:
        ends = (
            [(x, y) for x, y in self.cells[[0, -1]].tolist()] if len(self.cells) else ["nowhere", "nowhere"]
        )
        return f"<Path of {len(self.cells)} cells from {ends[0]} to {ends[1]}, cost {self.cost:.6g}>"

    @property
    def exact(self) -> int:
        """Exact integer cost."""
        return self.moves.exact(self.steps) if self.paid is None else self.paid

    @property
    def cost(self) -> float:
        """Cost in cells of plain ground, the steps' costs summed."""
        return self.moves.value(self.exact)

    @property
    def arc(self) -> Floats:
        """Distance along the path at each node, in cells, shape (n,); a diagonal is sqrt 2 here, always."""
        d = np.diff(self.cells.astype(np.float64), axis=0)
        return np.concatenate(([0.0], np.cumsum(np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]))))

    @property
    def heading(self) -> Floats:
        """Heading of the step that leaves each node (the last keeps its own), radians, y up; shape (n,)."""
        if len(self.cells) == 1:
            return np.zeros(1)
        d = np.diff(self.cells.astype(np.int64), axis=0)
        h = elementary.atan2(-d[:, 1], d[:, 0])
        return np.append(h, h[-1])


def count_steps(cells: Cells, moves: Moves) -> tuple[int, ...]:
    """How many straights, diagonals (and knight's steps, where the moves have them) a walk takes."""
    walk = np.asarray(cells).reshape(-1, 2)
    d = walk[1:] - walk[:-1]
    product = d[:, 0] * d[:, 1]
    oblique = int(np.count_nonzero(product))
    straight = len(product) - oblique
    if not moves.knight:
        return straight, oblique
    knights = int(np.count_nonzero(np.abs(product) == 2))
    return straight, oblique - knights, knights


def path_of(cells: Cells, moves: Moves, terrain: ByteGrid | None = None) -> Path:
    """A Path from its cells, on a map of that terrain (then with :meth:`Moves.weighed` moves)."""
    steps = count_steps(cells, moves)
    if terrain is None:
        return Path(cells, moves, steps)
    return Path(cells, moves, steps, int(step_costs(cells, moves, terrain).sum()))


def step_costs(cells: Cells, moves: Moves, terrain: ByteGrid | None = None) -> NDArray[np.int64]:
    """Exact cost of each step of a walk, int64, (n - 1,)."""
    walk = np.asarray(cells, dtype=np.int64).reshape(-1, 2)
    d = np.abs(np.diff(walk, axis=0))
    prices = np.array([moves.straight, moves.diagonal, moves.knight], dtype=np.int64)
    exact: NDArray[np.int64] = prices[d[:, 0] * d[:, 1]]
    if terrain is None:
        return exact
    entered = terrain[walk[1:, 1], walk[1:, 0]].astype(np.int64)
    weighed: NDArray[np.int64] = exact // TERRAIN_UNIT * (TERRAIN_UNIT + entered)
    return weighed
