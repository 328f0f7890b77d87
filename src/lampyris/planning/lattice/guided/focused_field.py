"""The heuristic of a goal where a path from one start can want it, with a cost that every path elsewhere exceeds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.map import LatticeMap

FIRST = 1.15
"""Times the octile distance that the cheapest chain of cells is first taken to cost."""
FACTOR = 1.5
"""Times the cost of the cheapest chain that chains through the cells may cost."""
MARGIN = 4.0
"""Borders of the map, in which the longest motion and the footprint have room, added to that: for turning round."""


@dataclass(frozen=True, slots=True, eq=False)
class FocusedField:
    """The heuristic in the cells through which a chain from the start to a goal costs little enough.

    Parameters
    ----------
    goals : indices of cells, rising.
    start : index of a cell.
    heuristic : int64 (cells,): as :meth:`LatticeMap.heuristic` gives it; negative where none leads, and in the cells left out.
    most : paths of the lattice from the start through a cell left out cost more, in its units; None: no cell is left out.
    """

    goals: tuple[int, ...]
    start: int
    heuristic: NDArray[np.int64]
    most: int | None

    def seen_from(self, start: int, lattice_map: LatticeMap) -> FocusedField:
        """The same for paths from another cell."""
        if self.most is None or start == self.start:
            return self
        away = _octile(lattice_map, (self.start,), start)
        return replace(self, start=start, most=self.most - away)


def focused_field(lattice_map: LatticeMap, start: int, goals: tuple[int, ...]) -> FocusedField:
    """The field of some goals for paths from a start that cost up to :data:`FACTOR` times the least that the field allows.

    Parameters
    ----------
    start, goals : indices of cells.
    """
    straight, _ = lattice_map.steps
    beyond = 2.0 * (lattice_map.grid.width + lattice_map.grid.height)
    margin = MARGIN * lattice_map.border
    reach = FACTOR * FIRST * _octile(lattice_map, goals, start) / straight + margin
    while reach < beyond:
        heuristic = lattice_map.flooded(goals, start, reach)
        known = int(heuristic[start])
        if known >= 0:
            wanted = FACTOR * known / straight + margin
            if wanted <= reach * (1 + 1e-9):
                return FocusedField(goals, start, heuristic, int(reach * straight))
            reach = wanted
        else:
            reach *= 2.0
    return FocusedField(goals, start, lattice_map.flooded(goals), None)


def _octile(lattice_map: LatticeMap, goals: tuple[int, ...], start: int) -> int:
    """What the cheapest chain of steps costs without walls from a cell to the nearest of some, in units of the lattice."""
    straight, diagonal = lattice_map.steps
    y, x = np.divmod(np.array(goals), lattice_map.stride)
    down, across = np.abs(y - start // lattice_map.stride), np.abs(x - start % lattice_map.stride)
    return int((straight * np.maximum(down, across) + (diagonal - straight) * np.minimum(down, across)).min())
