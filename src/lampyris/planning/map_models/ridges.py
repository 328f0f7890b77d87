"""Ridges of clearance, and the safest path along them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from heapq import heappop, heappush
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.kernels.field.clearance import wall_distance
from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT
from lampyris.kernels.map_models.thinning import thin
from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.model.plan import MapModel
from lampyris.planning.graph.grid_graph import SearchResult, check_cells
from lampyris.typing import BoolGrid, ByteGrid, Cell

_NEVER = 2**60
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
            frozen(blocked)  # to numba an array that can be written is of another type
        height, width = blocked.shape
        squared = np.empty(blocked.size, dtype=np.int64)
        scratch = np.zeros((3, width), dtype=np.int64)
        cells = frozen(np.ascontiguousarray(blocked).view(np.uint8).ravel())
        wall_distance(cells, squared, *scratch, height, width, _NEVER, 1)
        value = squared.reshape(height, width)
        if self._border:
            across, down = (2 * np.minimum(np.arange(n), np.arange(n)[::-1]) + 1 for n in (width, height))
            edge = np.minimum(across[None, :], down[:, None])
            value = np.minimum(value, edge * edge)
        return np.where(free, value, 0)

    def _widest(self, value: _Ints, start: Cell, goal: Cell) -> tuple[BoolGrid | None, int]:
        """The region of all cells with the greatest clearance that joins the ends, and that clearance."""
        from scipy import ndimage  # bits: labels, whole numbers

        around = np.ones((3, 3), dtype=int) if self._eight else None
        ends = min(int(value[start[1], start[0]]), int(value[goal[1], goal[0]]))
        steps = np.unique(value[(value > 0) & (value <= ends)])

        def joined(least: int) -> BoolGrid | None:
            checkpoint()
            labels, _ = ndimage.label(value >= least, around)
            here = labels[start[1], start[0]]
            same: BoolGrid = labels == here
            return same if labels[goal[1], goal[0]] == here else None

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
            walk = _shortest(steps, start, goal, set(ahead).__contains__)
            return walk, min(int(value[y, x]) for x, y in walk)
        back = _branch(steps, goal, start)
        a, b = ahead[-1], back[-1]
        taken = {*ahead[:-1], *back[:-1]}
        crest = _least(steps, value, a, b, taken)

        def allowed(cell: Cell) -> bool:
            return cell in taken or bool(value[cell[1], cell[0]] >= crest)

        return _shortest(steps, start, goal, allowed), crest


def _cells_of(squared: int) -> float | None:
    """A clearance in cells; None: there is no wall."""
    return None if squared >= _NEVER else sqrt(squared) / 2.0


class _Steps:
    """Legal steps from ridge cell to ridge cell; diagonals where the region has both cells beside them."""

    def __init__(self, ridge: BoolGrid, region: BoolGrid, costs: dict[Cell, int], eight: bool) -> None:
        self._ridge, self._region, self._costs, self._eight = ridge, region, costs, eight
        self._height, self._width = ridge.shape

    def linked(self, cell: Cell) -> list[Cell]:
        """The ridge cells beside a cell, in the sense in which ridges are connected."""
        x, y = cell
        return [(i, j) for i, j in self._near(x, y) if self._eight or i == x or j == y]

    def _near(self, x: int, y: int) -> Iterator[Cell]:
        for i in range(max(0, x - 1), min(self._width, x + 2)):
            for j in range(max(0, y - 1), min(self._height, y + 2)):
                if (i, j) != (x, y) and self._ridge[j, i]:
                    yield i, j

    def from_cell(self, cell: Cell) -> Iterator[tuple[Cell, int]]:
        x, y = cell
        for (dx, dy), cost in self._costs.items():
            to = (x + dx, y + dy)
            if not (0 <= to[0] < self._width and 0 <= to[1] < self._height and self._ridge[to[1], to[0]]):
                continue
            if dx and dy and not self._eight and not (self._region[y, to[0]] and self._region[to[1], x]):
                continue
            yield to, cost


def _branch(steps: _Steps, end: Cell, other: Cell) -> list[Cell]:
    """The cells from an end to where ridges first branch, that cell included; or to the other end."""
    walk, seen = [end], {end}
    while walk[-1] != other:
        onward = [to for to in steps.linked(walk[-1]) if to not in seen]
        if len(onward) != 1:
            break
        walk.append(onward[0])
        seen.add(onward[0])
    return walk


def _least(steps: _Steps, value: _Ints, a: Cell, b: Cell, without: set[Cell]) -> int:
    """The greatest least clearance of a path from a to b along ridges."""
    heap = [(-int(value[a[1], a[0]]), a)]
    done: set[Cell] = set()
    while heap:
        checkpoint()
        worst, here = heappop(heap)
        if here == b:
            return -worst
        if here in done:
            continue
        done.add(here)
        for to, _ in steps.from_cell(here):
            if to not in done and to not in without:
                heappush(heap, (max(worst, -int(value[to[1], to[0]])), to))
    raise AssertionError("thinning keeps regions connected")


def _shortest(steps: _Steps, a: Cell, b: Cell, allowed: Callable[[Cell], bool]) -> list[Cell]:
    """The cheapest path from a to b over the ridge cells allowed."""
    best: dict[Cell, int] = {a: 0}
    before: dict[Cell, Cell] = {}
    heap = [(0, a)]
    done: set[Cell] = set()
    while heap:
        checkpoint()
        paid, here = heappop(heap)
        if here in done:
            continue
        done.add(here)
        if here == b:
            break
        for to, cost in steps.from_cell(here):
            if to not in done and allowed(to) and paid + cost < best.get(to, paid + cost + 1):
                best[to] = paid + cost
                before[to] = here
                heappush(heap, (paid + cost, to))
    walk = [b]
    while walk[-1] != a:
        walk.append(before[walk[-1]])
    return walk[::-1]
