"""The distance tables of a fleet: steps from each free cell to each robot's goal."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import MEMORY
from lampyris.errors import SceneError
from lampyris.kernels.fleet.distances import distance_rows
from lampyris.model.fleet.fleet import FORGIVEN, Fleet, most_radius
from lampyris.planning.field.frame import framed
from lampyris.planning.field.layers import free_cells
from lampyris.planning.fleet.cell_graph import CellGraph, Numbers
from lampyris.typing import BoolGrid

MIB = 2**20
PER_CELL = 40
"""Bytes a free cell that the graph and the work arrays take."""


_WIDE = ContextVar("_WIDE", default=False)


@contextmanager
def wide_tables() -> Iterator[None]:
    """Within it tables take four bytes an entry, as on maps with long distances; for warming the kernels."""
    token = _WIDE.set(True)
    try:
        yield
    finally:
        _WIDE.reset(token)


@dataclass(frozen=True, slots=True, eq=False)
class FleetTables:
    """A fleet as the kernels read it.

    Parameters
    ----------
    graph : the free cells.
    starts, goals : int32, (robots,); numbers of cells.
    table : int16 or int32, (robots * cells,); steps to each robot's goal by cell, :attr:`never` where there is no path.
    distance : int32, (robots,); of each robot's start.
    radii : float64, (robots,); of the robots, in cells. Those that are smaller than the conflicts of the step set ask for are
        given what these ask for.
    is_small : whether none is larger than that.
    """

    graph: CellGraph
    starts: Numbers
    goals: Numbers
    table: NDArray[Any]
    distance: Numbers
    radii: NDArray[np.float64]
    is_small: bool

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


def tables_of(fleet: Fleet, moves: str = "four-connected") -> FleetTables:
    """The distance tables of a fleet; two bytes a robot and free cell, four where distances exceed 32,766 steps.

    A robot larger than a cell keeps away from walls by its radius (:func:`lampyris.planning.field.layers.free_cells`).

    Raises
    ------
    LimitError : ``MEMORY``: they would take more memory than is allowed.
    SceneError : ``START_OCCUPIED``, ``GOAL_OCCUPIED``: a robot reaches into a wall there.
    """
    cells = int(np.count_nonzero(~fleet.grid.blocked))
    _demand(fleet, cells, 2)
    graph = CellGraph.of(~fleet.grid.blocked, moves)
    starts, goals = graph.numbers(fleet.starts), graph.numbers(fleet.goals)
    table = None if _WIDE.get() else _filled(fleet, graph, goals, np.dtype(np.int16))
    if table is None:
        _demand(fleet, cells, 4)
        table = _filled(fleet, graph, goals, np.dtype(np.int32))
        assert table is not None  # there are fewer cells than it can count
    distance = table.reshape(len(goals), cells)[np.arange(len(goals)), starts].astype(np.int32)
    least = most_radius(moves)
    radii = fleet.radii
    is_small = bool((radii <= least * (1.0 + FORGIVEN)).all())
    return FleetTables(graph, starts, goals, table, distance, np.maximum(radii, least), is_small)


def _filled(fleet: Fleet, graph: CellGraph, goals: Numbers, kind: np.dtype[Any]) -> NDArray[Any] | None:
    """The table, in numbers of a type; None where a distance does not fit."""
    cells, width = graph.cells, fleet.grid.width + 2
    number = framed(graph.number, 1, -1)
    ends = ((graph.places[goals, 1] + 1) * width + graph.places[goals, 0] + 1).astype(np.int32)
    table: NDArray[Any] = np.empty(len(goals) * cells, dtype=kind)
    work = np.empty(cells + 9, dtype=np.uint32), np.empty(len(number), dtype=np.uint8)
    for radius, members in by_size(fleet):
        free = ~fleet.grid.blocked if radius == 0.0 else free_cells(fleet.grid, radius)
        if radius > 0.0:
            _check_ends(fleet, members, free)
        ground = framed(free, 1, False).view(np.uint8)
        whole = len(members) == len(goals)
        part = table if whole else np.empty(len(members) * cells, dtype=kind)
        if radius > 0.0:
            part[:] = _most(table)  # cells near walls
        end = np.ascontiguousarray(ends[members])
        # As tables of fields are: the same versions of the kernel serve both.
        unsigned = part.view(f"u{part.itemsize}")
        args = (ground, number, end, unsigned, *work, width, cells, _most(table), graph.wide > 4)
        if distance_rows(*args) < len(members):
            return None
        if not whole:
            table.reshape(-1, cells)[members] = part.reshape(-1, cells)
    return table


def by_size(fleet: Fleet) -> list[tuple[float, NDArray[np.int64]]]:
    """The robots' indices by radius in metres; those that any free cell will do for together, with radius 0."""
    sizes = np.array([0.0 if one.robot is None else one.robot.radius for one in fleet.robots])
    sizes[2.0 * sizes <= fleet.grid.resolution * (1.0 + FORGIVEN)] = 0.0
    return [(float(size), np.flatnonzero(sizes == size)) for size in np.unique(sizes)]


def _check_ends(fleet: Fleet, members: NDArray[np.int64], free: BoolGrid) -> None:
    for k in members.tolist():
        one = fleet.robots[k]
        for what, (x, y) in (("start", one.start), ("goal", one.goal)):
            if not free[y, x]:
                raise SceneError(
                    f"{what.upper()}_OCCUPIED", f"a robot of radius {one.robot.radius if one.robot else 0:g} m at {(x, y)} "
                    "reaches into a wall", where=f"robots[{k}].{what}", allowed="a cell farther from walls",
                )  # fmt: skip


def _most(table: NDArray[Any]) -> int:
    """The largest value of a table's type."""
    return int(np.iinfo(table.dtype).max)


def _demand(fleet: Fleet, cells: int, each: int) -> None:
    robots = len(fleet.robots)
    needed = -(-(robots * cells * each + PER_CELL * cells) // MIB)
    what = f"the distance table of {robots:,} robots on {cells:,} free cells"
    MEMORY.demand(needed, what, instead="take fewer robots or a smaller map")
