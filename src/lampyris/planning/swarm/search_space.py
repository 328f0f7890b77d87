"""The ground that swarm planners walk on: one map with some cells closed, its exact field, and its steps,
looked up many at once.

Cells are flat indices into the map with a border of walls as wide as the longest step, so that no step needs
a bound. Costs stay whole numbers.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.planning.field.frame import PART, framed
from lampyris.planning.field.layers import clearance
from lampyris.planning.field.solve import exact_costs
from lampyris.planning.graph.grid_graph import rules_of
from lampyris.typing import BoolGrid, Cell, Cells, FloatGrid

Ints = NDArray[np.int64]
Flags = NDArray[np.bool_]

THOUSAND = 1000
"""Nearness to walls is kept in whole thousandths: sums of whole numbers are the same in any order."""

WIDE = 2.0
"""Distance to walls, in cells beyond the robot's radius, from which on more of it is worth nothing."""

_ROUND = ((1, 0), (2, 1), (1, 1), (1, 2))
"""A quarter of the sixteen directions in order; the others are these, turned."""


class SearchSpace:
    """A map with some cells closed, the exact costs on it, and tables for its steps.

    Parameters
    ----------
    scene : the map, the goal and the robot.
    moves : how the robot may step on it (:func:`lampyris.planning.field.layers.moves_for`).
    free : bool, (height, width), read-only; where the robot's centre may be, before anything is closed.
    closed : cells that count as walls here besides.

    Attributes
    ----------
    exact : exact costs to the goal, (height, width), read-only, -1: none; what D* would hold once it has taken in the
        closed cells.
    expansions : cells settled for them.
    stride, pad : cells in a row, border included; the border's width.
    free, shut : bool, flat; the border is neither.
    to_go, terrain : int64, flat; exact cost to the goal (-1: none), terrain value (None: plain everywhere).
    jump, price : int64 (steps,); what a step adds to a flat cell, and what it costs on plain ground.
    """

    def __init__(self, scene: Scene, moves: Moves, free: BoolGrid, closed: frozenset[Cell]) -> None:
        if closed:
            left = free.copy()
            for k, (x, y) in enumerate(closed):  # bits: each sets its own cell
                if k % 4096 == 0:
                    checkpoint()
                left[y, x] = False
            left.setflags(write=False)
            free = left
        self.scene = scene
        self.moves = moves
        self.open_cells = free
        self.exact, self.expansions = exact_costs(free, moves, scene.goal, terrain=scene.grid.terrain)
        self.pad = moves.reach
        self.stride = free.shape[1] + 2 * self.pad
        self.free: Flags = self._framed(free, False)
        self.shut: Flags = self._framed(~free, False)
        self.to_go: Ints = self._framed(self.exact, -1, np.int64)
        terrain = scene.grid.terrain
        self.terrain: Ints | None = None if terrain is None else self._framed(terrain, 0, np.int64)
        rules = rules_of(moves, False)
        line = np.array([1, self.stride], dtype=np.int64)
        self.jump: Ints = np.stack((rules.dx, rules.dy), axis=1) @ line  # bits: whole numbers
        self._via: Ints = rules.via @ line  # bits: whole numbers
        self._across: Ints = rules.across @ line  # bits: whole numbers
        self.price: Ints = rules.cost
        self.number = {offset: k for k, offset in enumerate(moves.offsets)}

    def _framed(self, inside: NDArray[Any], border: Any, kind: Any = None) -> NDArray[Any]:
        return framed(inside, self.pad, border, kind)

    # ---- cells --------------------

    def flat(self, cells: NDArray[Any]) -> Ints:
        """Cells (..., 2) as flat indices (...)."""
        xy = np.asarray(cells, dtype=np.int64)
        flat: Ints = (xy[..., 1] + self.pad) * self.stride + xy[..., 0] + self.pad
        return flat

    def cells(self, flat: Ints) -> Cells:
        """Flat indices (n,) as cells, int32 (n, 2)."""
        xy = np.stack((flat % self.stride, flat // self.stride), axis=-1) - self.pad
        return xy.astype(np.int32)

    # ---- steps --------------------

    def legal(self, at: Ints, step: Ints) -> Flags:
        """Whether each step (by number) may be made from each cell, which must be free itself; same shape."""
        paths: Flags = self.free[at + self.jump[step]] & self.free[at]
        paths &= self.free[at + self._via[step]]
        paths &= self.free[at + self._across[step]]
        return paths

    def plain(self, step: Ints) -> Ints:
        """Exact cost of steps on plain ground."""
        paid: Ints = self.price[step]
        return paid

    def toll(self, at: Ints, step: Ints) -> Ints:
        """Exact cost of steps that terrain adds to that."""
        if self.terrain is None:
            return np.zeros_like(at)
        added: Ints = self.price[step] // TERRAIN_UNIT * self.terrain[at + self.jump[step]]
        return added

    @property
    def tables(self) -> tuple[Ints, ...]:
        """What kernels ask of each step: its price and that of terrain, where it leads, the cells beside it, turns."""
        heavy = self.price // TERRAIN_UNIT
        return self.price, heavy, self.jump, self._via, self._across, self.turn.ravel()

    @cached_property
    def turn(self) -> Ints:
        """Sixteenths of a full turn between two steps, int64 (steps, steps), 0 to 8."""
        ring = list(_ROUND)
        for _ in range(3):
            ring += [(-dy, dx) for dx, dy in ring[-4:]]
        where = np.array([ring.index(o) for o in self.moves.offsets], dtype=np.int64)
        gap = np.abs(where[:, np.newaxis] - where)
        least: Ints = np.minimum(gap, 16 - gap)
        return least

    @cached_property
    def room(self) -> FloatGrid:
        """Distance from each cell's centre to the nearest wall, in cells, (height, width)."""
        metres, resolution = clearance(self.scene.grid), self.scene.grid.resolution
        if resolution == 1.0:
            return metres
        cells = np.empty_like(metres)
        part = max(1, PART // metres.shape[1])
        for y in range(0, len(metres), part):
            checkpoint()
            np.divide(metres[y : y + part], resolution, out=cells[y : y + part])
        return cells

    @cached_property
    def nearness(self) -> Ints:
        """How near walls are, in thousandths, int64, flat: 0 from :data:`WIDE` on, 1000 at a wall."""
        grid, robot = self.scene.grid, self.scene.robot
        reach = WIDE + robot.radius / grid.resolution
        height, width = self.open_cells.shape
        near: Ints = np.empty((height, width), dtype=np.int64)
        part = max(1, PART // width)
        for y in range(0, height, part):
            checkpoint()
            share = 1.0 - np.minimum(self.room[y : y + part], reach) / reach
            near[y : y + part] = np.rint(THOUSAND * share)
        return self._framed(near, 0)

    # ---- what the exact field says --------------------

    def shortest_path(self, start: Cell) -> Cells:
        """The cells from a cell that can reach the goal, along the field's parents; int32 (n, 2)."""
        return self._along_parents(self.to_go, start, self.scene.goal)

    def exact_between(self, start: Cell, end: Cell) -> tuple[Cells, int]:
        """A cheapest path between two cells of one region, and how many cells it took to find it."""
        moves, terrain = self.moves, self.scene.grid.terrain
        exact, settled = exact_costs(self.open_cells, moves, end, terrain=terrain, stop=start)
        return self._along_parents(self._framed(exact, -1, np.int64), start, end), settled

    def parent(self, at: int) -> int:
        """The number of the step that the field takes from a flat cell which can reach the goal and is not it."""
        return self._parent(self.to_go.data, at)

    @cached_property
    def _steps(self) -> list[tuple[int, int, int, int, int]]:
        """Number of each step, where it leads, the cells beside it, its price."""
        columns = (self.jump, self._via, self._across, self.price)
        return [(k, *row) for k, row in enumerate(zip(*(c.tolist() for c in columns), strict=True))]

    def _parent(self, cost: memoryview, at: int) -> int:
        """The local parent rule: the first step that leads to where the cost is less by exactly its own."""
        here, terrain = cost[at], self.terrain
        for k, jump, via, across, price in self._steps:
            there = cost[at + jump]
            if there < 0 or cost[at + via] < 0 or cost[at + across] < 0:
                continue
            if terrain is not None:
                price += price // TERRAIN_UNIT * int(terrain[at + jump])
            if there == here - price:
                return k
        raise AssertionError("a cell with a cost has a parent")

    def _along_parents(self, cost: Ints, start: Cell, goal: Cell) -> Cells:
        # Flat while it grows: a list of pairs takes ten times as long to become an array.
        at, end = self.flat(np.array((start, goal))).tolist()
        costs, jump, path = cost.data, self.jump.tolist(), [at]
        while at != end:
            if len(path) % 1024 == 0:
                checkpoint()
            at += jump[self._parent(costs, at)]
            path.append(at)
        return self.cells(np.array(path, dtype=np.int64))

    @cached_property
    def nearest(self) -> Ints:
        """For each flat cell the flat cell nearest to it from which the goal can be reached: in rings, and
        within a ring the first of the eight neighbours that knew one. -1 in the border."""
        to: Ints = np.empty(self.to_go.size, dtype=np.int64)
        inside = self._framed(np.ones(self.open_cells.shape, dtype=np.bool_), False)
        unknown = []
        for a in range(0, to.size, PART):
            checkpoint()
            known = self.to_go[a : a + PART]
            to[a : a + PART] = np.arange(a, a + known.size)
            other = a + np.flatnonzero(known < 0)
            to[other] = -1
            unknown.append(other[inside[other]])
        rest = np.concatenate(unknown)
        around = [dy * self.stride + dx for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy]
        any_known = int(self.to_go.max()) >= 0
        while rest.size and any_known:
            found = np.full(rest.size, -1, dtype=np.int64)
            for a in range(0, rest.size, PART):
                checkpoint()
                here, nearest = rest[a : a + PART], found[a : a + PART]
                for ahead in around:
                    nearest[:] = np.where(nearest < 0, to[here + ahead], nearest)
            to[rest] = found
            rest = rest[found < 0]
        return to
