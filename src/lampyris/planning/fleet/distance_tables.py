"""The distance tables of a fleet: steps from each free cell to each robot's goal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import MEMORY
from lampyris.kernels.fleet.distances import distance_rows
from lampyris.model.fleet.fleet import Fleet
from lampyris.planning.field.frame import framed
from lampyris.planning.fleet.cell_graph import CellGraph, Numbers

MIB = 2**20
PER_CELL = 40
"""Bytes a free cell that the graph and the work arrays take."""


@dataclass(frozen=True, slots=True, eq=False)
class FleetTables:
    """A fleet as the kernels read it.

    Parameters
    ----------
    graph : the free cells.
    starts, goals : int32, (robots,); numbers of cells.
    table : int16 or int32, (robots * cells,); steps to each robot's goal by cell, :attr:`never` where there is no path.
    distance : int32, (robots,); of each robot's start.
    """

    graph: CellGraph
    starts: Numbers
    goals: Numbers
    table: NDArray[Any]
    distance: Numbers

    @property
    def never(self) -> int:
        """The entry of a cell from which a goal cannot be reached."""
        return _most(self.table)

    @property
    def cut_off(self) -> int | None:
        """The first robot that cannot reach its goal on the bare map, or None."""
        lost = np.flatnonzero(self.distance == self.never)
        return int(lost[0]) if len(lost) else None

    @property
    def mebibytes(self) -> int:
        """What they take."""
        return -(-(self.table.nbytes + PER_CELL * self.graph.cells) // MIB)


def tables_of(fleet: Fleet) -> FleetTables:
    """The distance tables of a fleet; two bytes a robot and free cell, four where distances exceed 32,766 steps.

    Raises
    ------
    LimitError : ``MEMORY``: they would take more memory than is allowed.
    """
    cells = int(np.count_nonzero(~fleet.grid.blocked))
    _demand(fleet, cells, 2)
    graph = CellGraph.of(~fleet.grid.blocked)
    starts, goals = graph.numbers(fleet.starts), graph.numbers(fleet.goals)
    ground = framed(~fleet.grid.blocked, 1, False).view(np.uint8)
    number = framed(graph.number, 1, -1)
    width = fleet.grid.width + 2
    ends = ((graph.places[goals, 1] + 1) * width + graph.places[goals, 0] + 1).astype(np.int32)
    work = np.empty(cells + 5, dtype=np.uint32), np.empty(len(ground), dtype=np.uint8)
    table: NDArray[Any] = np.empty(len(goals) * cells, dtype=np.int16)
    if distance_rows(ground, number, ends, table, *work, width, cells, _most(table)) < len(goals):
        del table
        _demand(fleet, cells, 4)
        table = np.empty(len(goals) * cells, dtype=np.int32)
        distance_rows(ground, number, ends, table, *work, width, cells, _most(table))
    distance = table.reshape(len(goals), cells)[np.arange(len(goals)), starts].astype(np.int32)
    return FleetTables(graph, starts, goals, table, distance)


def _most(table: NDArray[Any]) -> int:
    """The largest value of a table's type."""
    return int(np.iinfo(table.dtype).max)


def _demand(fleet: Fleet, cells: int, each: int) -> None:
    robots = len(fleet.robots)
    needed = -(-(robots * cells * each + PER_CELL * cells) // MIB)
    what = f"the distance tables of {robots:,} robots on {cells:,} free cells"
    MEMORY.demand(needed, what, instead="take fewer robots or a smaller map")
