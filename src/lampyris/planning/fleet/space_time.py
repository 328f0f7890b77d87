"""The paths of all robots in tables of cells and ticks, and new paths of single robots beside them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import MEMORY
from lampyris.kernels.fleet import space_time as kernels
from lampyris.planning.fleet.distance_tables import MIB, FleetTables

Constraint = tuple[int, int, int, int]
"""Kind (see :mod:`lampyris.kernels.fleet.space_time`), cell, cell that a step leads to, tick."""
Conflict = tuple[int, int, int, int, int, int, int]
"""Kind, the other robot, cell, cell that a step leads to, tick, and the two cells of the other robot."""
FIRST_STATES = 1 << 12
FIRST_LISTED = 256
PER_STATE = 10
"""Bytes of a cell at a tick."""


class FullError(Exception):
    """More memory would be taken than is allowed.

    Parameters
    ----------
    needed : MiB.
    """

    def __init__(self, needed: int) -> None:
        super().__init__(f"{needed:,} MiB")
        self.needed = needed


@dataclass(frozen=True, slots=True, eq=False)
class TimedPath:
    """A path of one robot.

    Parameters
    ----------
    cells : numbers of cells by tick.
    bound : no path that the same constraints allow costs less.
    single : for each tick up to the bound the only cell of all cheapest paths, or -1.
    """

    cells: list[int]
    bound: int
    single: list[int]

    @property
    def cost(self) -> int:
        """The tick of the arrival."""
        return len(self.cells) - 1

    def at(self, tick: int) -> int:
        """The cell at a tick."""
        return self.cells[min(tick, len(self.cells) - 1)]

    def visits(self, cell: int, since: int) -> bool:
        """Whether it is on a cell at some tick from ``since`` on."""
        return self.cells[-1] == cell or cell in self.cells[since:]

    def must_pass(self, u: int, v: int, tick: int) -> bool:
        """Whether every cheapest path goes from ``u`` to ``v`` at this tick, or is on the cell if they are equal."""
        single, end = self.single, len(self.single) - 1
        if not single or single[min(tick, end)] != v:
            return False
        return u == v or single[min(tick - 1, end)] == u


class SpaceTime:
    """Tables that hold one path of each robot.

    Parameters
    ----------
    tables : the fleet.
    horizon : ticks to begin with; they grow as paths with constraints need it.
    weight : see :func:`lampyris.kernels.fleet.space_time.find`.
    """

    def __init__(self, tables: FleetTables, horizon: int, *, weight: float = 1.0) -> None:
        self.tables, self.weight = tables, weight
        self.expansions = 0
        self.paths: list[TimedPath | None] = [None] * len(tables.goals)
        self._xy = np.ascontiguousarray(tables.graph.places.ravel())
        self._starts, self._goals = tables.starts.tolist(), tables.goals.tolist()
        self._state = np.zeros(kernels.STATE_WIDTH, dtype=np.int64)
        self._since = np.full(tables.graph.cells, kernels.LATE, dtype=np.int32)
        self._listed = np.empty(FIRST_LISTED * kernels.CONFLICT_WIDTH, dtype=np.int32)
        self._rows = np.empty(64 * kernels.ROW, dtype=np.int32)
        self._make_pool(FIRST_STATES)
        self._make_tables(horizon)

    def _make_tables(self, horizon: int) -> None:
        robots, cells = len(self.paths), self.tables.graph.cells
        needed = self.tables.mebibytes + -(-(PER_STATE * horizon * cells + 8 * horizon * robots) // MIB)
        if needed > MEMORY.allowed:
            raise FullError(needed)
        self.horizon, self.mebibytes = horizon, needed
        self.where, self.chain = (np.zeros(horizon * robots, dtype=np.int32) for _ in range(2))
        self.last = np.zeros(robots, dtype=np.int32)
        self.head = np.full(horizon * cells, -1, dtype=np.int32)
        self.settled = np.full(cells, -1, dtype=np.int32)
        self._seen = np.full(horizon * cells, -1, dtype=np.int32)
        self._barred = np.zeros(horizon * cells, dtype=np.uint16)
        self._must = np.zeros(2 * horizon, dtype=np.int32)
        self._bucket, self._waiting = (np.zeros(2 * horizon + 2, dtype=np.int32) for _ in range(2))
        self._found, self._single = (np.zeros(horizon, dtype=np.int32) for _ in range(2))

    def _make_pool(self, states: int) -> None:
        if states * (4 * kernels.NODE_WIDTH + 24) > MEMORY.allowed * MIB:
            raise FullError(states * (4 * kernels.NODE_WIDTH + 24) // MIB)
        self._pool = np.empty(states * kernels.NODE_WIDTH, dtype=np.int32)
        self._keys, self._items = np.empty(2 * states, dtype=np.int64), np.empty(2 * states, dtype=np.int32)

    def grow(self, horizon: int) -> None:
        """Make room for more ticks.

        Raises
        ------
        FullError : they would take more memory than is allowed.
        """
        paths, self.paths = self.paths, [None] * len(self.paths)
        self._make_tables(horizon)
        for k, path in enumerate(paths):
            if path is not None:
                self.put(k, path)

    @property
    def longest(self) -> int:
        """The last tick of the paths in the tables."""
        return int(self.last.max())

    def put(self, robot: int, path: TimedPath) -> None:
        """Enter a path, in place of the one there is."""
        if len(path.cells) + 2 > self.horizon:
            self.grow(2 * len(path.cells) + 2)
        self.take(robot)
        base = robot * self.horizon
        self.where[base : base + len(path.cells)] = path.cells
        self.last[robot] = path.cost
        kernels.put(*self._arrays, self.horizon, robot)
        self.paths[robot] = path

    def take(self, robot: int) -> None:
        """Remove a path, if there is one."""
        if self.paths[robot] is not None:
            kernels.take(*self._arrays, self.horizon, robot)
            self.paths[robot] = None
            self.last[robot] = 0

    @property
    def _arrays(self) -> tuple[NDArray[Any], ...]:
        return self.where, self.last, self.head, self.chain, self.settled

    def find(
        self,
        robot: int,
        constraints: Sequence[Constraint] = (),
    ) -> TimedPath | None:
        """A path of a robot that is not in the tables, with few conflicts with those that are; None: there is none.

        Parameters
        ----------
        robot : its index.
        constraints : what it must keep to.

        Raises
        ------
        FullError : it would take more memory than is allowed.
        """
        graph, table = self.tables.graph, self.tables.table
        count = len(constraints)
        if count * kernels.ROW > len(self._rows):
            self._rows = np.empty(2 * count * kernels.ROW, dtype=np.int32)
        for i, row in enumerate(constraints):
            self._rows[i * kernels.ROW : (i + 1) * kernels.ROW] = row
            if row[3] + 3 > self.horizon:
                self.grow(2 * row[3] + 3)
        while True:
            ending = kernels.find(
                graph.edge, graph.degree, self._xy, table, robot * graph.cells, self._starts[robot], self._goals[robot],
                self._rows, count, *self._arrays, self.horizon, self.longest, self.weight,
                self._barred, self._since, self._must, self._pool, self._keys, self._items, self._bucket,
                self._waiting, self._seen, self._found, self._single, self._state,
            )  # fmt: skip
            self.expansions += int(self._state[kernels.EXPANDED])
            if ending == kernels.NONE:
                return None
            if ending == kernels.FOUND:
                cost, bound = int(self._state[kernels.COST]), int(self._state[kernels.BOUND])
                single = self._single[: bound + 1].tolist()
                return TimedPath(self._found[: cost + 1].tolist(), bound, single)
            if ending == kernels.HORIZON:
                self.grow(2 * self.horizon)
            else:
                self._make_pool(2 * (len(self._pool) // kernels.NODE_WIDTH))

    def conflicts(self, robot: int) -> list[Conflict]:
        """The conflicts of a robot's path with all others in the tables."""
        graph = self.tables.graph
        while True:
            n = kernels.conflicts(
                graph.edge, graph.wide, *self._arrays, self.horizon, self.longest, robot, self._listed
            )
            if n >= 0:
                rows = self._listed[: n * kernels.CONFLICT_WIDTH].reshape(-1, kernels.CONFLICT_WIDTH)
                return [(kind, other, u, v, tick, p, q) for kind, other, u, v, tick, p, q in rows.tolist()]
            self._listed = np.empty(2 * len(self._listed), dtype=np.int32)
