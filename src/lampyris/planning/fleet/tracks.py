"""From the cells of all robots at all ticks to the paths of a plan."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.planning.fleet.cell_graph import Numbers
from lampyris.typing import Cells


def arrivals(track: NDArray[Any], goals: Numbers) -> NDArray[np.int64]:
    """The tick from which each robot stays at its goal; the last tick for one that is not there.

    Parameters
    ----------
    track : (ticks, robots); the cell of each robot at each tick.
    goals : (robots,).
    """
    away = track != goals
    last = len(track) - 1
    latest = last - away[::-1].argmax(axis=0)  # the last tick away from the goal
    return np.where(away.any(axis=0), np.minimum(latest + 1, last), 0)


def paths_of(track: NDArray[Any], goals: Numbers, places: Cells) -> tuple[Cells, ...]:
    """Each robot's cells (x, y) from tick 0 to its arrival."""
    arrived = arrivals(track, goals)
    moving = int(arrived.sum(dtype=np.int64)) + len(arrived)
    ends = arrived.tolist()
    if track.size > 2 * moving:  # a few late robots: leave out the waits of the others
        return tuple(places[track[: end + 1, i]] for i, end in enumerate(ends))
    xy = places[np.ascontiguousarray(track.T)]
    return tuple(xy[i, : end + 1] for i, end in enumerate(ends))
