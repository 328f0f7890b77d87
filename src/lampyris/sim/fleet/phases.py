"""Phases of constant acceleration of all robots, gathered for a trace."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris.model.grid import Grid
from lampyris.sim.fleet.execution import Stage
from lampyris.typing import Floats

_SAME = 1e-9
"""Metres a second by which velocities of one phase differ at the most."""


class Phases:
    """Rows of a trace: robot, t, duration, x, y, dx, dy, v, a."""

    def __init__(self, grid: Grid) -> None:
        self._grid = grid
        self._parts: list[Floats] = []

    def add_stage(self, stage: Stage) -> None:
        """The phases of a plan that was driven."""
        log, visits = stage.log, stage.visits
        whose = log[:, 0].astype(np.int64)
        row = visits.base[whose] + log[:, 1].astype(np.int64)
        if not len(row):
            return
        centres = self._grid.to_metres(visits.cells)
        step = centres[row + 1] - centres[row]
        length = np.sqrt((step * step).sum(axis=1))
        ahead = step / length[:, None]
        grid_step = (visits.cells[row + 1] - visits.cells[row]).astype(np.float64)
        long = self._grid.resolution * np.sqrt((grid_step * grid_step).sum(axis=1))
        behind = np.concatenate(([0.0], np.cumsum(_lengths(visits.cells, self._grid.resolution))))
        behind -= np.repeat(behind[visits.base[:-1]], index_array(np.diff(visits.base)))
        share = (log[:, 4] - behind[row]) / long
        at = centres[row] + share[:, None] * step
        columns = (
            log[:, 0],
            log[:, 2],
            log[:, 3],
            at[:, 0],
            at[:, 1],
            ahead[:, 0],
            ahead[:, 1],
            log[:, 5],
            log[:, 6],
        )
        self._parts.append(np.stack(columns, axis=1))

    def add_steps(self, xy: Floats, period: float) -> None:
        """Robots that drive straight and evenly between moments.

        Parameters
        ----------
        xy : float64 (steps + 1, n, 2), metres of the map frame.
        period : seconds between two moments.
        """
        moves = np.diff(xy, axis=0)
        speed = np.sqrt((moves * moves).sum(axis=2)) / period
        step, who = np.nonzero(speed > _SAME)
        v = speed[step, who]
        ahead = moves[step, who] / (v * period)[:, None]
        at = xy[:-1][step, who]
        columns = (
            who,
            step.astype(np.float64) * period,
            np.full(len(v), period),
            at[:, 0],
            at[:, 1],
            ahead[:, 0],
            ahead[:, 1],
            v,
            np.zeros(len(v)),
        )
        self._parts.append(np.stack(columns, axis=1))

    def columns(
        self,
    ) -> tuple[NDArray[np.int32], Floats, Floats, Floats, Floats, Floats, Floats, Floats, Floats]:
        """All rows, robot by robot in time."""
        rows = np.concatenate(self._parts) if self._parts else np.zeros((0, 9))
        rows = rows[np.lexsort((rows[:, 1], rows[:, 0]))]
        t, duration, x, y, dx, dy, v, a = (rows[:, k].copy() for k in range(1, 9))
        return rows[:, 0].astype(np.int32), t, duration, x, y, dx, dy, v, a


def _lengths(cells: NDArray[np.int32], resolution: float) -> Floats:
    """Metres between each cell and the next one of the table, 0 where that is another robot's."""
    step = cells[1:].astype(np.int64) - cells[:-1]
    square = (step * step).sum(axis=1)
    return np.where(square <= 2, resolution * np.sqrt(square.astype(np.float64)), 0.0)
