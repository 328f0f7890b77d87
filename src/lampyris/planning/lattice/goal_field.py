"""The octile field of a goal for the lattice's heuristic, repaired where cells have changed."""

from __future__ import annotations

import numpy as np

from lampyris._core.defaults import GAMMA, RHO
from lampyris.model.moves import Moves
from lampyris.planning.field.frame import BorderedMap
from lampyris.planning.field.repair import FieldRepairer
from lampyris.planning.field.solve import Maps, checked, fill
from lampyris.typing import BoolGrid, Cell, FloatGrid


class GoalField:
    """Costs to one goal over free cells that change from call to call.

    Attributes
    ----------
    work : cells that were given a cost, or lost theirs, in all calls.
    """

    def __init__(self) -> None:
        self._repairer: FieldRepairer | None = None
        self._solved: tuple[BorderedMap, Maps, int] | None = None
        self._free: BoolGrid | None = None
        self._goal: Cell | None = None
        self.work = 0

    def is_of(self, goal: Cell) -> bool:
        """Whether the costs to a goal are known on a map that can be repaired."""
        return self._free is not None and self._goal == goal

    def cost(self, free: BoolGrid, moves: Moves, goal: Cell) -> FloatGrid:
        """The cost of every cell, equal to that of a field solved from scratch; float64, infinite where none leads."""
        before = self._free
        if before is None or before.shape != free.shape or self._goal != goal:
            return self._first(free, moves, goal)
        changed = free != before
        blocked, freed = ([(x, y) for y, x in np.argwhere(changed & now).tolist()] for now in (~free, free))
        if blocked or freed:
            if self._repairer is None:
                self._repairer = FieldRepairer(before, moves, goal, solved=self._solved)
                self._solved = None
            self.work += self._repairer.repair(blocked=blocked, freed=freed).expansions
        self._free = free
        if self._repairer is not None:
            return self._repairer.field.cost
        assert self._solved is not None
        return self._cost(moves, self._solved)

    def _first(self, free: BoolGrid, moves: Moves, goal: Cell) -> FloatGrid:
        """Of a new map or goal: costs alone; what a repair needs besides is worked out when the map changes."""
        own, _, goal = checked(free, None, moves, goal, RHO, GAMMA)
        self._solved = fill(own, None, moves, goal, (1.0 - RHO, GAMMA, float(moves.unit)), last="step")
        self._repairer, self._free, self._goal = None, free, goal
        self.work += self._solved[2]
        return self._cost(moves, self._solved)

    @staticmethod
    def _cost(moves: Moves, solved: tuple[BorderedMap, Maps, int]) -> FloatGrid:
        frame, (_, cost, _), _ = solved
        return moves.values(frame.inside(cost))
