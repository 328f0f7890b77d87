"""Conflicts that a plan avoids: those of the same robots, if each drove as if it were alone."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from lampyris.model.fleet.fleet import Fleet
from lampyris.planning.fleet.distance_tables import FleetTables, tables_of
from lampyris.typing import Floats

LOOK: Final = 64
"""Ticks between two looks whether the job is cancelled."""


@dataclass(frozen=True, slots=True, eq=False)
class ConflictsAlone:
    """Conflicts of robots that take no notice of each other.

    Parameters
    ----------
    vertex : pairs of robots in one cell, summed over the ticks.
    swap : pairs of robots that exchange their cells, in the same way.
    where : float64 (height, width); conflicts by cell, a swap in each of its two cells.
    """

    vertex: int
    swap: int
    where: Floats


def conflicts_alone(fleet: Fleet, look: Callable[[], None] = lambda: None) -> ConflictsAlone | None:
    """What would happen if each robot drove one of its shortest paths without regard to the others, and stayed on its goal.

    Of the neighbours that are nearer to the goal the first of north, west, east and south is taken; ticks are
    counted until the last robot would have arrived. None: a goal cannot be reached.

    Raises
    ------
    LimitError : ``MEMORY``: as of :func:`lampyris.plan_fleet`.
    """
    tables = tables_of(fleet)
    if tables.cut_off is not None:
        return None
    cells = tables.graph.cells
    now, left = tables.starts.astype(np.int64), tables.distance.astype(np.int64)
    met, swapped = np.zeros(cells, dtype=np.int64), np.zeros(cells, dtype=np.int64)
    for tick in range(int(left.max(initial=0))):
        if tick % LOOK == 0:
            look()
        new = _next(tables, now, left)
        cell, many = np.unique(new, return_counts=True)
        met[cell] += many * (many - 1) // 2
        _add_swaps(now, new, cells, swapped)
        now, left = new, np.maximum(left - 1, 0)
    where = np.zeros(fleet.grid.blocked.shape)
    where[tables.graph.places[:, 1], tables.graph.places[:, 0]] = met + swapped
    return ConflictsAlone(int(met.sum()), int(swapped.sum()) // 2, where)


def _next(tables: FleetTables, now: NDArray[np.int64], left: NDArray[np.int64]) -> NDArray[np.int64]:
    """Where each robot is a tick later; who has arrived stays."""
    cells = tables.graph.cells
    edge = tables.graph.edge.reshape(-1, 4)[now].astype(np.int64)
    rows = np.arange(len(now))[:, None] * cells
    there = edge < cells
    steps: NDArray[Any] = np.where(there, tables.table[rows + np.where(there, edge, 0)], -1)
    nearer = there & (steps == (left - 1)[:, None])
    chosen = np.take_along_axis(edge, nearer.argmax(axis=1)[:, None], axis=1)[:, 0]
    return np.where((left > 0) & nearer.any(axis=1), chosen, now)


def _add_swaps(now: NDArray[np.int64], new: NDArray[np.int64], cells: int, into: NDArray[np.int64]) -> None:
    """Count for each cell the pairs of robots of which one leaves it for where the other comes from."""
    moved = new != now
    step, many = np.unique(now[moved] * cells + new[moved], return_counts=True)
    if not len(step):
        return
    back = step % cells * cells + step // cells
    at = np.minimum(np.searchsorted(step, back), len(step) - 1)
    met = step[at] == back
    np.add.at(into, step[met] // cells, many[met] * many[at[met]])
