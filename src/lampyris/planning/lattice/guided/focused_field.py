"""The heuristic of a goal where a path from one start can want it, with a cost that every path elsewhere exceeds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.lattice.ends.joined_end import JoinedEnd, excess, lowered
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
    start : index of a cell.
    heuristic : int64 (cells,): as :meth:`LatticeMap.heuristic` gives it, or lowered for a joined goal; negative where none leads,
        and in the cells left out.
    most : paths from the start through a cell left out cost more, with the curve at a joined goal, in units of the lattice; None:
        no cell is left out.
    """

    start: int
    heuristic: NDArray[np.int64]
    most: int | None

    def seen_from(
        self, starts: list[tuple[int, int]], costs: list[int], lattice_map: LatticeMap
    ) -> FocusedField:
        """The same for paths from any of some states (cell index, heading), with the costs of the curves to them."""
        if self.most is None:
            return self
        cells = tuple(cell for cell, _ in starts)
        away = _octile(lattice_map, cells, self.start) - np.array(costs, dtype=np.int64)
        return replace(self, most=self.most - int(away.max()))


def focused_field(
    lattice_map: LatticeMap, start: int, goals: tuple[int, ...], end: JoinedEnd | None = None
) -> FocusedField | None:
    """The field of some goals for paths from a start that cost up to :data:`FACTOR` times the least that the field allows.

    Parameters
    ----------
    start, goals : indices of cells.
    end : a joined goal, of whose states one is at the cell that is given; the field is :func:`lowered` for it. Then the result
        is None where the field is not known at all of its states.
    """
    focused = _focused(lattice_map, start, goals)
    if end is None:
        return focused
    heuristic, most = focused.heuristic, focused.most
    if any(heuristic[cell] < 0 for cell, _ in end.states):
        return None
    # From a cell left out to a state costs no less than the difference of the field.
    more = max(excess(heuristic, end), 0)
    return FocusedField(start, lowered(heuristic, end), None if most is None else most - more)


def _focused(lattice_map: LatticeMap, start: int, goals: tuple[int, ...]) -> FocusedField:
    straight, _ = lattice_map.steps
    beyond = 2.0 * (lattice_map.grid.width + lattice_map.grid.height)
    margin = MARGIN * lattice_map.border
    reach = FACTOR * FIRST * int(_octile(lattice_map, goals, start).min()) / straight + margin
    while reach < beyond:
        heuristic = lattice_map.flooded(goals, start, reach)
        known = int(heuristic[start])
        if known >= 0:
            wanted = FACTOR * known / straight + margin
            if wanted <= reach * (1 + 1e-9):
                return FocusedField(start, heuristic, int(reach * straight))
            reach = wanted
        else:
            reach *= 2.0
    return FocusedField(start, lattice_map.flooded(goals), None)


def _octile(lattice_map: LatticeMap, cells: tuple[int, ...], start: int) -> NDArray[np.int64]:
    """What the cheapest chain of steps costs without walls between a cell and each of some, in units of the lattice."""
    straight, diagonal = lattice_map.steps
    y, x = np.divmod(np.array(cells, dtype=np.int64), lattice_map.stride)
    down, across = np.abs(y - start // lattice_map.stride), np.abs(x - start % lattice_map.stride)
    whole: NDArray[np.int64] = straight * np.maximum(down, across) + (diagonal - straight) * np.minimum(
        down, across
    )
    return whole
