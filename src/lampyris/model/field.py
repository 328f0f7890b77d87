"""Field: the cost-to-goal landscape, its parents, its luciferin. Gate: an opening to look at twice."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from lampyris._core.defaults import GAMMA, RHO
from lampyris._core.noun import Noun
from lampyris._core.values import Value
from lampyris.model.moves import Moves
from lampyris.typing import BoolGrid, Cell, FloatGrid, IntGrid, StepGrid


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Field(Value):
    """The cost-to-go field: cost, parent and luciferin of every cell. Arrays are (height, width) and read-only.

    Parameters
    ----------
    free : bool; where the robot's centre may be (inflated by its radius, gates closed if so asked).
    exact : exact integer cost to the goal (see :class:`Moves`), -1 where the goal cannot be reached.
    step : index into ``moves.offsets`` of ``parent - cell`` by the local rule; -1 at the goal and where
        there is no path.
    luciferin : ``luc(goal) = 0``, ``luc(cell) = (1 - rho) luc(parent) + gamma cost(cell)``; inf where
        there is none.
    goal : the goal cell.
    moves : the step set.
    rho, gamma : luciferin decay and enhancement.
    revision : how many Changes went into it.
    expansions : cells that were expanded for it.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> field = lampyris.solve_field(scene)
    >>> field.goal, field.exact.shape
    ((8, 2), (10, 10))
    """

    free: BoolGrid
    exact: IntGrid
    step: StepGrid
    luciferin: FloatGrid
    goal: Cell
    moves: Moves
    rho: float = RHO
    gamma: float = GAMMA
    revision: int = 0
    expansions: int = field(default=0)

    def _brief(self) -> str:
        rows, columns = self.exact.shape
        reached = int((self.exact >= 0).sum())
        return f"<Field to {self.goal}: {columns} x {rows} cells, {reached} reached, {self.moves.name} moves>"

    @property
    def cost(self) -> FloatGrid:
        """Cost to the goal in cells, infinity where there is none. Computed at each call."""
        return self.moves.values(self.exact)

    @property
    def parent(self) -> IntGrid:
        """Flat index (y * width + x) of each cell's parent, -1 where there is none. Computed at each call."""
        width = self.exact.shape[1]
        jump = np.array([dy * width + dx for dx, dy in self.moves.offsets] + [0], dtype=np.int64)
        flat = np.arange(self.exact.size, dtype=np.int64).reshape(self.exact.shape) + jump[self.step]
        return np.where(self.step < 0, np.int64(-1), flat)


@dataclass(frozen=True, slots=True, repr=False)
class Gate(Noun):
    """An opening between two walls that face each other, too narrow for the robot (method.md, "Gates").

    Parameters
    ----------
    cell : x, y.
    axis : ``x`` if its left and right neighbours are walls, ``y`` if upper and lower, ``xy`` if both.
    width_m : free width between the walls, metres.
    dead_end : whether it is a dead end: removing it disconnects only a dead end.

    Examples
    --------
    >>> import lampyris
    >>> gate = lampyris.Gate(cell=(4, 5), axis="x", width_m=1.0, dead_end=False)
    >>> gate.cell, gate.width_m
    ((4, 5), 1.0)
    """

    cell: Cell
    axis: str
    width_m: float
    dead_end: bool
