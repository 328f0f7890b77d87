"""Robots that avoid each other without a plan: optimal reciprocal collision avoidance (ORCA)."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import MEMORY
from lampyris.kernels.fleet_motion import orca as kernels
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.planning.fleet.distance_tables import FleetTables, tables_of
from lampyris.sim.fleet.phases import Phases
from lampyris.typing import Floats

_CHUNK = 200
"""Steps between two calls of ``progress``."""
_PER_BIN = 4
_MIB = 2**20
_EACH = 16 + 80
"""Bytes of a robot and a step: its place, and its phase."""
HOME = 0.5
"""Cells from its goal within which a robot has arrived; the drive ends when all are within half of that."""


@dataclass(slots=True, eq=False)
class Reactive:
    """What came of it: phases, arrivals (seconds, NaN: not at its goal at the end), the end, notes."""

    phases: Phases
    arrivals: Floats
    end: float
    notes: tuple[str, ...]


class OrcaRun:
    """Robots that can be driven on step by step.

    Parameters
    ----------
    fleet, robots, settings : see :func:`lampyris.simulate_fleet`.
    tables : of the fleet.
    last : steps at most.
    """

    def __init__(
        self,
        fleet: Fleet,
        robots: Sequence[Robot],
        settings: FleetDriveSettings,
        tables: FleetTables,
        last: int,
    ) -> None:
        grid, n, s = fleet.grid, len(robots), settings
        size = grid.resolution
        radius = np.array([one.radius for one in robots])
        top = np.array([one.v_max for one in robots])
        number = np.full((grid.height, grid.width), -1, dtype=np.int32)
        places = tables.graph.places
        number[places[:, 1], places[:, 0]] = np.arange(len(places), dtype=np.int32)
        blocked = np.ascontiguousarray(grid.blocked).view(np.uint8).ravel()
        reach = 2.0 * float(radius.max()) + s.robot_horizon * float(top.max())
        wide, high = grid.width * size, grid.height * size
        bins = max(64, _PER_BIN * n)
        side = max(reach / 3.0, math.sqrt(wide * high / bins), wide / bins, high / bins)
        columns, rows = max(1, math.ceil(wide / side)), max(1, math.ceil(high / side))
        goals = (np.array(fleet.goals, dtype=np.float64) + 0.5) * size
        starts = (np.array(fleet.starts, dtype=np.float64) + 0.5) * size
        self._grid, self._last, self._n = grid, last, n
        self.path = np.empty(last * n * 2)
        self._count = np.zeros(1, dtype=np.int64)
        close = _close(grid, float(radius.max()) + s.wall_horizon * float(top.max()))
        lines = 4 * (s.neighbours + kernels.WALLS + 1)
        self._args = (
            radius, top, blocked, close, grid.width, grid.height, size, number.ravel(), tables.table, tables.graph.cells,
            goals[:, 0].copy(), goals[:, 1].copy(), s.period, s.robot_horizon, s.wall_horizon, s.neighbours,
            float(radius.max()), side, columns, rows, starts[:, 0].copy(), starts[:, 1].copy(), np.zeros(n),
            np.zeros(n), np.zeros(n), np.zeros(n), np.full(n, -1, np.int64), np.zeros(n), np.zeros(n),
            np.zeros(s.neighbours, np.int64), np.zeros(s.neighbours), np.zeros(lines), np.zeros(lines), np.zeros(2),
            np.zeros(columns * rows + 1, np.int64), np.zeros(n, np.int64),
        )  # fmt: skip
        self._random = np.array([1], dtype=np.int64)
        self._starts, self._goals = starts, goals

    @property
    def done(self) -> int:
        """Steps done."""
        return int(self._count[0])

    def go_on(self, until: int) -> bool:
        """Drive to a step; whether all have arrived."""
        ending = kernels.steps(*self._args, self._random, self.path, self._count, min(until, self._last))
        return bool(ending == kernels.DONE)

    def places(self) -> Floats:
        """Where all were, float64 (steps + 1, n, 2), metres from the upper left corner, y down."""
        driven = self.path[: self.done * self._n * 2].reshape(self.done, self._n, 2)
        return np.concatenate((self._starts[None], driven))

    def arrivals(self, period: float) -> Floats:
        """Since when each has been at its goal, seconds."""
        gap = self.places() - self._goals[None]
        near = HOME * self._grid.resolution
        there = (gap * gap).sum(axis=2) <= near * near
        away = np.where(there, -1, np.arange(len(there))[:, None]).max(axis=0)
        return np.where(there[-1], (away + 1) * period, np.nan)


def _close(grid: Grid, reach: float) -> NDArray[np.uint8]:
    """Cells in which a robot may have a wall or the edge of the map within reach, metres; uint8 (cells,)."""
    free = np.pad(~grid.blocked, 1)
    # From the centre of a cell to that of the nearest wall: each may be half a diagonal nearer.
    from scipy import ndimage  # bits: a shortcut that changes no result

    far = ndimage.distance_transform_edt(free)[1:-1, 1:-1] - math.sqrt(2.0) - 1e-9
    return np.ascontiguousarray(far * grid.resolution < reach).view(np.uint8).ravel()


def drive_reactively(
    fleet: Fleet,
    robots: Sequence[Robot],
    settings: FleetDriveSettings,
    progress: Callable[[int, int], None] | None = None,
) -> Reactive:
    """Drive all robots from their starts until they have arrived, or to the time limit.

    Raises
    ------
    LimitError : ``MEMORY``: the distance tables or the trace would take more than is allowed.
    """
    tables = tables_of(fleet)
    s = settings
    finite = tables.distance[tables.distance != tables.never]
    limit = s.drive_limit
    if limit is None:
        slowest = min(one.v_max for one in robots)
        limit = 3.0 * float(finite.max(initial=0)) * fleet.grid.resolution / slowest + 60.0
    last = max(1, math.ceil(limit / s.period))
    needed = -(-last * len(robots) * _EACH // _MIB)
    MEMORY.demand(
        needed,
        f"the trace of {len(robots):,} robots and {last:,} steps",
        instead="take a shorter drive_limit",
    )
    run = OrcaRun(fleet, robots, s, tables, last)
    while not run.go_on(run.done + _CHUNK) and run.done < last:
        if progress is not None:
            progress(run.done, last)
    phases = Phases(fleet.grid)
    cells = run.places() / fleet.grid.resolution - 0.5
    phases.add_steps(fleet.grid.to_metres(cells), s.period)
    notes = ("robots with policy orca change their velocity at once: accelerations are not limited",)
    return Reactive(phases, run.arrivals(s.period), run.done * s.period, notes)
