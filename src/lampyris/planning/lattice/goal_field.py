"""The octile field of a goal for the lattice's heuristic, repaired where cells have changed."""

from __future__ import annotations

import numpy as np

from lampyris.model.moves import Moves
from lampyris.planning.field.repair import FieldRepairer
from lampyris.typing import BoolGrid, Cell, FloatGrid


class GoalField:
    """Costs to one goal over free cells that change from call to call.

    Attributes
    ----------
    work : cells that were given a cost, or lost theirs, in all calls.
    """

    def __init__(self) -> None:
        self._repairer: FieldRepairer | None = None
        self._free: BoolGrid | None = None
        self.work = 0

    def cost(self, free: BoolGrid, moves: Moves, goal: Cell) -> FloatGrid:
        """The cost of every cell, equal to that of a field solved from scratch; float64, infinite where none leads."""
        repairer, before = self._repairer, self._free
        if repairer is None or before is None or before.shape != free.shape or repairer.field.goal != goal:
            self._repairer = repairer = FieldRepairer(free, moves, goal)
            self.work += repairer.field.expansions
        else:
            changed = free != before
            blocked, freed = (
                [(x, y) for y, x in np.argwhere(changed & now).tolist()] for now in (~free, free)
            )
            if blocked or freed:
                self.work += repairer.repair(blocked=blocked, freed=freed).expansions
        self._free = free
        return repairer.field.cost
