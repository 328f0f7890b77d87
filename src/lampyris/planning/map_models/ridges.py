"""Ridges of clearance, and the safest path along them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import distinct
from lampyris._core.cancellation import checkpoint
from lampyris.kernels.field.wall_distances import wall_distances
from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT
from lampyris.kernels.map_models.ridge_walk import FAR, cheapest, connected, widest
from lampyris.kernels.map_models.thinning import thin
from lampyris.model.moves import Moves
from lampyris.model.plan import MapModel
from lampyris.planning.graph.grid_graph import SearchResult, check_cells
from lampyris.typing import BoolGrid, ByteGrid, Cell

_NEVER = 2**60
_LOOK = 1024
"""Cells between two cancellation checks."""
_AROUND = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1))
"""A cell's neighbours, those that share a side first."""
_Ints = NDArray[np.int64]


@dataclass(slots=True)
class KnownWalls:
    """The cells that are walls now; a session keeps it up to date."""

    blocked: BoolGrid


class RidgeSearch:
    """The safest path on one map; see :class:`lampyris.planning.map_models.voronoi.Voronoi`.

    Memory: 50 bytes a cell during a search.

    Parameters
    ----------
    free : bool (height, width); where the robot's centre may be.
    terrain : not considered.
    moves : the step set.
    walls : cells whose distance counts.
    border : whether that from the edge of the map does, too.
    """

    def __init__(
        self, free: BoolGrid, terrain: ByteGrid | None, moves: Moves, *, walls: KnownWalls, border: bool
    ) -> None:
        check_cells(free.size)
        self._free, self._walls, self._border = free, walls, border
        self._diagonals = any(dx and dy for dx, dy in moves.offsets)
        self._eight = self._diagonals and moves.corner_cutting
        # Straights and diagonals alone, in the costs of the moves.
        self._costs = {
            (dx, dy): cost
            for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True)
            if max(abs(dx), abs(dy)) == 1
        }

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape."""
        self._free = free
        return True

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """The safest path between two free cells while some cells (of the map) are closed."""
        value = self._clearance(closed)
        region, label = self._widest(value, start, goal)
        if region is None:
            return SearchResult(EXHAUSTED, min(int(np.count_nonzero(self._free)), budget or _NEVER), None)
        cells = int(np.count_nonzero(region))
        if budget is not None and cells > budget:
            return SearchResult(LIMIT, budget, None)
        ridge = self._thinned(region, value, start, goal)
        walk, crest = self._along(ridge, region, value, start, goal)
        y, x = np.nonzero(ridge)
        model = MapModel(
            "voronoi",
            points=np.stack((x, y), axis=1).astype(np.float64),
            clearance=_cells_of(label),
            ridge_clearance=_cells_of(crest),
            counts={"ridge cells": len(x), "region": cells},
        )
        return SearchResult(FOUND, cells, np.array(walk, dtype=np.int32), model=model)

    def _clearance(self, closed: Iterable[Cell]) -> _Ints:
        """Squared half cells to the nearest wall where the robot may be, else 0."""
        blocked, free = self._walls.blocked, self._free
        shut = list(closed)
        if shut:
            blocked, free = blocked.copy(), free.copy()
            x, y = np.array(shut, dtype=np.int64).T
            blocked[y, x], free[y, x] = True, False
        height, width = blocked.shape
        value = wall_distances(blocked, _NEVER, edge=True)
        if self._border:
            across, down = (2 * np.minimum(np.arange(n), np.arange(n)[::-1]) + 1 for n in (width, height))
            edge = np.minimum(across[None, :], down[:, None])
            value = np.minimum(value, edge * edge)
        return np.where(free, value, 0)

    def _widest(self, value: _Ints, start: Cell, goal: Cell) -> tuple[BoolGrid | None, int]:
        """The region of all cells with the greatest clearance that joins the ends, and that clearance."""
        ends = min(int(value[start[1], start[0]]), int(value[goal[1], goal[0]]))
        steps = distinct(value[(value > 0) & (value <= ends)])

        padded = np.pad(value, 1)
        flat, stride = padded.ravel(), padded.shape[1]
        jump = _jumps(stride, _AROUND[: 8 if self._eight else 4])
        queue = np.empty(flat.size, dtype=np.int32)

        def joined(least: int) -> BoolGrid | None:
            checkpoint()
            mark = np.zeros(flat.size, dtype=np.uint8)
            connected(flat, least, jump, (start[1] + 1) * stride + start[0] + 1, mark, queue)
            same: BoolGrid = mark.reshape(padded.shape)[1:-1, 1:-1] != 0
            return same if same[goal[1], goal[0]] else None

        region = joined(int(steps[0]))
        if region is None:
            return None, 0
        low, high = 0, len(steps)
        while high - low > 1:
            middle = (low + high) // 2
            better = joined(int(steps[middle]))
            if better is None:
                high = middle
            else:
                low, region = middle, better
        return region, int(steps[low])

    def _thinned(self, region: BoolGrid, value: _Ints, start: Cell, goal: Cell) -> BoolGrid:
        """The ridges of a region, both ends kept."""
        inside = np.pad(region, 1).astype(np.uint8)
        height, stride = inside.shape
        flat, n = inside.ravel(), inside.size
        ends = [(y + 1) * stride + x + 1 for x, y in (start, goal)]
        heap, place = np.zeros(n + 1, dtype=np.int32), np.zeros(n, dtype=np.int32)
        values, tie = np.pad(value, 1).ravel(), np.zeros(n, dtype=np.int64)
        thin(flat, values, tie, *ends, stride, int(self._eight), heap, place)
        ridge: BoolGrid = flat.reshape(height, stride)[1:-1, 1:-1] != 0
        return ridge

    def _along(
        self, ridge: BoolGrid, region: BoolGrid, value: _Ints, start: Cell, goal: Cell
    ) -> tuple[list[Cell], int]:
        """The safest, then shortest path along ridges, and its least clearance between its branchings."""
        steps = _Steps(ridge, region, self._costs, self._eight)
        ahead = _branch(steps, start, goal)
        if ahead[-1] == goal:
            # Ridges do not branch: diagonals cut the corners of the one path there is.
            only = np.zeros(ridge.shape, dtype=np.bool_)
            x, y = np.array(ahead, dtype=np.int64).T
            only[y, x] = True
            walk = _cheapest_along(steps, start, goal, only)
            return walk, min(int(value[y, x]) for x, y in walk)
        back = _branch(steps, goal, start)
        a, b = ahead[-1], back[-1]
        taken = np.zeros(ridge.shape, dtype=np.bool_)
        x, y = np.array([*ahead[:-1], *back[:-1]], dtype=np.int64).reshape(-1, 2).T
        taken[y, x] = True
        crest = _widest_along(steps, value, a, b, ~taken)
        return _cheapest_along(steps, start, goal, taken | (value >= crest)), crest


def _cells_of(squared: int) -> float | None:
    """A clearance in cells; None: there is no wall."""
    return None if squared >= _NEVER else sqrt(squared) / 2.0


class _Steps:
    """Legal steps from ridge cell to ridge cell; diagonals where the region has both cells beside them."""

    def __init__(self, ridge: BoolGrid, region: BoolGrid, costs: dict[Cell, int], eight: bool) -> None:
        self._ridge, self._region, self._costs, self._eight = ridge, region, costs, eight
        self._height, self._width = ridge.shape
        self._is_ridge = ridge.tobytes()  # single cells are read from bytes ten times as fast as from arrays

    def linked(self, cell: Cell) -> list[Cell]:
        """The ridge cells beside a cell, in the sense in which ridges are connected."""
        x, y = cell
        return [(i, j) for i, j in self._near(x, y) if self._eight or i == x or j == y]

    def _near(self, x: int, y: int) -> Iterator[Cell]:
        for i in range(max(0, x - 1), min(self._width, x + 2)):
            for j in range(max(0, y - 1), min(self._height, y + 2)):
                if self._is_ridge[j * self._width + i] and (i, j) != (x, y):
                    yield i, j

    def over(self, allowed: BoolGrid) -> StepBits:
        """The legal steps that end on ridge cells that are allowed."""
        ends = np.pad(self._ridge & allowed, 1)
        region = np.pad(self._region, 1)
        bits = np.zeros(ends.shape, dtype=np.uint8)
        inner = bits[1:-1, 1:-1]
        for k, (dx, dy) in enumerate(self._costs):
            may = self._ridge & _shifted(ends, dx, dy)
            if dx and dy and not self._eight:
                may &= _shifted(region, dx, 0) & _shifted(region, 0, dy)
            inner |= np.where(may, np.uint8(1 << k), np.uint8(0))
        stride = ends.shape[1]
        costs = np.array(list(self._costs.values()), dtype=np.int64)
        return StepBits(bits.ravel(), stride, _jumps(stride, list(self._costs)), costs)


@dataclass(frozen=True, slots=True, eq=False)
class StepBits:
    """Steps as kernels take them: see :mod:`lampyris.kernels.map_models.ridge_walk`.

    Parameters
    ----------
    steps : uint8 (n,), a bit for each step, over the map with a border.
    stride : cells in a row, border included.
    jump, cost : int64 (m,), of each step.
    """

    steps: NDArray[np.uint8]
    stride: int
    jump: _Ints
    cost: _Ints

    def flat(self, cell: Cell) -> int:
        """Flat index of a cell."""
        return (cell[1] + 1) * self.stride + cell[0] + 1

    def cell(self, flat: int) -> Cell:
        """The cell of a flat index."""
        y, x = divmod(flat, self.stride)
        return x - 1, y - 1


def _jumps(stride: int, offsets: Sequence[Cell]) -> _Ints:
    """Offsets as differences of flat indices."""
    return np.array([dy * stride + dx for dx, dy in offsets], dtype=np.int64)


def _shifted(padded: BoolGrid, dx: int, dy: int) -> BoolGrid:
    """For each cell what is at an offset from it; without the border."""
    height, width = padded.shape
    return padded[1 + dy : height - 1 + dy, 1 + dx : width - 1 + dx]


def _branch(steps: _Steps, end: Cell, other: Cell) -> list[Cell]:
    """The cells from an end to where ridges first branch, that cell included; or to the other end."""
    walk, seen = [end], {end}
    while walk[-1] != other:
        if len(walk) % _LOOK == 0:
            checkpoint()
        onward = [to for to in steps.linked(walk[-1]) if to not in seen]
        if len(onward) != 1:
            break
        walk.append(onward[0])
        seen.add(onward[0])
    return walk


def _widest_along(steps: _Steps, value: _Ints, a: Cell, b: Cell, allowed: BoolGrid) -> int:
    """The greatest least clearance of a path from a to b along ridges."""
    bits = steps.over(allowed)
    n = bits.steps.size
    worst = np.full(n, FAR, dtype=np.int64)
    heap, place = np.zeros(n + 1, dtype=np.int32), np.zeros(n, dtype=np.int32)
    values = np.pad(value, 1).ravel()
    found = int(widest(bits.steps, bits.jump, values, bits.flat(a), bits.flat(b), worst, heap, place))
    if found < 0:
        raise AssertionError("thinning keeps regions connected")
    return found


def _cheapest_along(steps: _Steps, a: Cell, b: Cell, allowed: BoolGrid) -> list[Cell]:
    """The cheapest path from a to b over the ridge cells allowed; equal costs are decided by x, then by y."""
    bits = steps.over(allowed)
    n = bits.steps.size
    rank = np.arange(n, dtype=np.int64).reshape(bits.stride, n // bits.stride).T.ravel()
    paid, before = np.full(n, FAR, dtype=np.int64), np.zeros(n, dtype=np.int32)
    heap, place = np.zeros(n + 1, dtype=np.int32), np.zeros(n, dtype=np.int32)
    first, last = bits.flat(a), bits.flat(b)
    cheapest(bits.steps, bits.jump, bits.cost, rank, first, last, paid, before, heap, place)
    walk = [last]
    while walk[-1] != first:
        walk.append(int(before[walk[-1]]))
    return [bits.cell(flat) for flat in reversed(walk)]
