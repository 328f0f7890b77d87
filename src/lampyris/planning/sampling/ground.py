"""A map as planners that sample read it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.graph.any_angle import CUT, TOUCH, WIDE, follow
from lampyris.kernels.sampling.buckets import BITS
from lampyris.kernels.sampling.lines import line_free
from lampyris.kernels.sampling.shorten import lay, shorten
from lampyris.model.moves import Moves
from lampyris.planning.field.connected import are_connected
from lampyris.planning.graph.grid_graph import PaddedMap, check_limits
from lampyris.typing import BoolGrid, Cell, Cells, Floats

Chain = NDArray[np.int32]
"""Flat cells of the vertices of a path, start first."""
EVEN = np.zeros(1, dtype=np.uint8)
_POINTS = 64
"""Points of a path between which shorter lines are looked for, about."""
_MANY = 400
"""Vertices of a path above which no points are put between them."""
_GAP = 4
"""Cells from one wall to another with fewer than so many free cells between them are a narrow place."""
_LAST_NUMBER = 2**30


@dataclass(frozen=True, slots=True)
class Lines:
    """A path of straight lines.

    Parameters
    ----------
    turns : int32 (k, 2): cells at which it turns, both ends included; float64: places between cell centres.
    walk : int32 (n, 2): cells of a walk by single steps along the lines.
    """

    turns: Cells | Floats
    walk: Cells


class SamplingMap:
    """The free cells of one map, and buckets for the nodes of trees.

    Memory: about 7 bytes a cell.

    Parameters
    ----------
    free : bool (height, width); where the robot's centre may be.
    moves : the step set, by which corners may be cut or not.
    wide : whether the robot has a size, so that lines need room on either side.

    Raises
    ------
    LimitError : more cells, or costlier steps, than exact costs have room for.
    """

    def __init__(self, free: BoolGrid, moves: Moves, *, wide: bool) -> None:
        check_limits(free, moves)
        self._pad = moves.reach
        self.board = PaddedMap(free.shape, moves.reach)
        self.board.lay(free, self.board.free)
        slanting = any(dx and dy for dx, dy in moves.offsets)
        cutting = slanting and moves.corner_cutting
        self.rule = WIDE if wide else CUT if cutting else TOUCH
        self.diagonals = 2 if cutting else int(slanting)
        self.cells = np.flatnonzero(self.board.free).astype(np.int32)
        self.stride, self.rows = self.board.stride, self.board.size // self.board.stride
        self.narrow = self._narrow()
        self.wide, self.high = ((n >> BITS) + 1 for n in (self.stride, self.rows))
        self._bucket = np.zeros(self.wide * self.high, dtype=np.int32)
        self._next = 1
        self._scratch: dict[type[np.generic], list[NDArray[Any]]] = {}

    def _narrow(self) -> Chain:
        """Flat free cells between two blocked ones that are at most so many cells apart, along a row or a column."""
        free = self.board.free.astype(bool)
        narrow = np.zeros(free.size, dtype=bool)
        for step in (1, self.stride):
            wall = [~np.roll(free, k * step) for k in range(-_GAP, _GAP + 1)]
            for before in range(1, _GAP):
                narrow |= wall[_GAP - before] & np.logical_or.reduce(wall[_GAP + 1 : 2 * _GAP - before + 1])
        return np.flatnonzero(narrow & free).astype(np.int32)

    def buckets(self, nodes: int) -> tuple[NDArray[np.int32], int]:
        """Buckets for so many nodes at most, and the number that stands for node 0 in them."""
        base = self._next
        self._next += nodes
        if self._next > _LAST_NUMBER:
            self._bucket.fill(0)
            base, self._next = 1, 1 + nodes
        return self._bucket, base

    def scratch(self, rows: int, length: int, kind: type[np.generic]) -> list[NDArray[Any]]:
        """Arrays for one search, of any contents, the same for each: a search that is over needs them no more.

        Fresh memory for every search would be the greater part of the time of an easy one.
        """
        held = self._scratch.setdefault(kind, [])
        for k in range(rows):
            if k == len(held):
                held.append(np.empty(length, dtype=kind))
            elif len(held[k]) < length:
                held[k] = np.empty(length, dtype=kind)
        return [one[:length] for one in held[:rows]]

    def diagonal(self) -> float:
        """Length of the map's diagonal, cells."""
        return math.sqrt(float(self.stride * self.stride + self.rows * self.rows))

    def distance(self, a: int, b: int) -> float:
        """Distance between two flat cells."""
        (ay, ax), (by, bx) = divmod(a, self.stride), divmod(b, self.stride)
        return math.sqrt(float((ax - bx) * (ax - bx) + (ay - by) * (ay - by)))

    def straight(self, a: int, b: int) -> bool:
        """Whether a free line leads from one flat cell to another. In plain form: no kernel is loaded for one line."""
        (ay, ax), (by, bx) = divmod(a, self.stride), divmod(b, self.stride)
        return bool(line_free.linked()(self.board.free.data, EVEN, self.stride, ax, ay, bx, by, self.rule))

    def joined(self, a: int, b: int) -> bool:
        """Whether single steps through cells that are free now lead from one flat cell to another."""
        return are_connected(self.board.free, self.stride, a, b, corners=self.rule == CUT)

    def flat(self, cell: Cell) -> int:
        """Flat index of a cell."""
        return self.board.flat(cell)

    def lines(self, chain: Chain, *, shorter: bool) -> Lines:
        """The path of a chain of vertices with free lines between them.

        Parameters
        ----------
        shorter : whether free lines between any of its points, and some points between these, may replace parts of it.
        """
        y, x = np.divmod(chain.astype(np.int64), self.stride)
        if shorter:
            for dense in (False, True):
                x, y = self._shortened(x, y, dense=dense)
        turn_x, turn_y = np.empty((2, len(x)), dtype=np.int64)
        turns, count = np.empty(2 * len(x), dtype=np.int32), np.zeros(2, dtype=np.int64)
        room = 4 * (self.stride + self.rows)
        while True:
            (path,) = self.scratch(1, room, np.int32)
            walk = np.empty(2 * room, dtype=np.int32)
            board = (self.board.free, self.stride, self._pad)
            lay(*board, x, y, self.diagonals, turn_x, turn_y, path, turns, walk, count)
            many, steps = count.tolist()
            if steps >= 0:
                return Lines(turns[: 2 * many].reshape(-1, 2), walk[: 2 * steps].copy().reshape(-1, 2))
            room = -steps

    def along(self, chain: Chain) -> Chain:
        """Flat cells at equal distances, at most one cell apart, along the lines of a chain of vertices."""
        y, x = np.divmod(chain.astype(np.int64), self.stride)
        parts = np.maximum(np.maximum(np.abs(np.diff(x)), np.abs(np.diff(y))), 1)
        line = np.repeat(np.arange(len(parts)), parts)
        k = np.arange(len(line)) - np.repeat(np.cumsum(parts) - parts, parts)
        half, some = parts[line] // 2, parts[line]
        at_x, at_y = (v[:-1][line] + (k * np.diff(v)[line] + half) // some for v in (x, y))
        cells: Chain = np.append(at_y * self.stride + at_x, chain[-1]).astype(np.int32)
        return cells

    def pulled(self, walk: NDArray[np.int64]) -> Chain:
        """Vertices of the shortest sequence of free lines between turning points of a walk: flat cells, as the walk is."""
        step = np.diff(walk)
        turns = walk[np.concatenate(([True], step[1:] != step[:-1], [True]))] if len(walk) > 2 else walk
        y, x = np.divmod(turns, self.stride)
        x, y = self._shortened(x, y, dense=False)
        chain: Chain = (y * self.stride + x).astype(np.int32)
        return chain

    def _shortened(
        self, x: NDArray[np.int64], y: NDArray[np.int64], *, dense: bool
    ) -> tuple[NDArray[np.int64], ...]:
        if dense and 2 <= len(x) <= _MANY:
            x, y = self._with_points_between(x, y)
        if len(x) < 3:
            return x, y
        best, before = np.zeros(len(x)), np.zeros(len(x), dtype=np.int64)
        shorten(self.board.free, EVEN, self.stride, self.rule, x, y, best, before)
        kept = [len(x) - 1]
        while kept[-1] > 0:
            kept.append(int(before[kept[-1]]))
        return x[kept[::-1]], y[kept[::-1]]

    def _with_points_between(
        self, x: NDArray[np.int64], y: NDArray[np.int64]
    ) -> tuple[NDArray[np.int64], ...]:
        """The points, and cells of the walk along their lines at about equal distances."""
        path = np.empty(1 + int(np.abs(np.diff(x)).sum() + np.abs(np.diff(y)).sum()), dtype=np.int32)
        count = int(follow(self.board.free, self.stride, x, y, self.diagonals, path))
        vertex, at, k = np.zeros(count, dtype=bool), (y * self.stride + x).tolist(), 0
        for i, cell in enumerate(path[:count].tolist()):
            if k < len(at) and cell == at[k]:
                vertex[i], k = True, k + 1
        vertex[:: max(1, -(-count // _POINTS))] = True
        some_y, some_x = np.divmod(path[:count][vertex].astype(np.int64), self.stride)
        return some_x, some_y


def neighbourhood(free: float, nodes: int, factor: float) -> float:
    """Radius within which nodes are joined, cells: so large that paths tend to the shortest as nodes are added.

    Karaman and Frazzoli 2011, theorem 38, for two dimensions; the logarithm is rounded up, to one of a power of two.

    Parameters
    ----------
    free : cells that are drawn from.
    nodes : of the tree.
    factor : by which it is greater than the least for which that is proven.
    """
    count = max(nodes, 2)
    log = (count - 1).bit_length() * 0.6931471805599453
    return factor * 2.0 * math.sqrt(1.5) * math.sqrt(free / 3.141592653589793 * log / count)
