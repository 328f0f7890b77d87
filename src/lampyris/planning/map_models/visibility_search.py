"""Searching a visibility graph: corners of obstacles first, then the cell centres that they leave."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.graph.any_angle import TOUCH, WIDE
from lampyris.kernels.graph.search import FOUND, LIMIT
from lampyris.kernels.map_models.visibility import (
    EDGE,
    NEVER,
    SHUT,
    SIDE_X,
    SIDE_Y,
    cells_within,
    corner_tree,
    straightest,
)
from lampyris.model.moves import Moves
from lampyris.model.plan import MapModel
from lampyris.planning.graph.any_angle_search import AnyAngleSearch
from lampyris.planning.graph.grid_graph import SearchResult
from lampyris.typing import BoolGrid, ByteGrid, Cell, Floats

_Ints = NDArray[np.int64]
_Bytes = NDArray[np.uint8]

EDGES = 20_000
"""Pairs of corners kept for pictures, at most."""
_OFF = 2.83
"""Half cells: twice what a point of a cell is from the cell's centre, at most."""


def searching(
    free: BoolGrid, terrain: ByteGrid | None, moves: Moves, *, wide: bool
) -> VisibilitySearch | AnyAngleSearch:
    """The search for such a map: Theta* where it has terrain."""
    if terrain is not None:
        return AnyAngleSearch(free, terrain, moves, wide=wide, lazy=0)
    return VisibilitySearch(free, moves, wide=wide)


@dataclass(frozen=True, slots=True, eq=False)
class CornerMap:
    """Squares that are free or not, and the corners at which paths may turn; see the kernel for units.

    Parameters
    ----------
    square, node : uint8, flat; see :func:`lampyris.kernels.map_models.visibility.sight`.
    stride : squares in a row.
    x, y, qx, qy : int64 (v,); corners, and on which side of them the blocked square lies.
    """

    square: _Bytes
    node: _Bytes
    stride: int
    x: _Ints
    y: _Ints
    qx: _Ints
    qy: _Ints


@dataclass(frozen=True, slots=True, eq=False)
class CornerTree:
    """Lengths from one end to all corners that matter."""

    length: Floats
    closed: _Bytes
    parent: NDArray[np.int32]
    edges: NDArray[np.int32]
    ending: int
    expanded: int


class VisibilitySearch:
    """Shortest paths of straight lines on one map.

    Memory: 60 bytes a cell, and 350 for each corner that lies near the path: 204 a cell on random-512.

    Parameters
    ----------
    free, moves, wide : as for :class:`lampyris.planning.graph.any_angle_search.AnyAngleSearch`.
    """

    def __init__(self, free: BoolGrid, moves: Moves, *, wide: bool) -> None:
        self._theta = AnyAngleSearch(free, None, moves, wide=wide, lazy=0)
        self._free = free

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has terrain."""
        if not self._theta.take(free, terrain):
            return False
        self._free = free
        return True

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """The shortest path of straight lines between two free cells while some cells (of the map) are closed."""
        shut = list(closed)
        known = self._theta.find_path(start, goal, budget, shut)
        if known.waypoints is None or known.cells is None:
            return known
        free = self._free
        if shut:
            free = free.copy()
            free[[y for _, y in shut], [x for x, _ in shut]] = False
        return _Query(self._theta, free, start, goal, known, budget, shut).answer()


class _Query:
    """One question: Theta*'s answer, and what is found to be shorter."""

    def __init__(
        self,
        theta: AnyAngleSearch,
        free: BoolGrid,
        start: Cell,
        goal: Cell,
        known: SearchResult,
        budget: int | None,
        closed: list[Cell],
    ) -> None:
        self._theta, self._free, self._known, self._budget, self._closed = theta, free, known, budget, closed
        self._wide = theta.rule == WIDE
        self._ends = (start, goal)
        self._spent = known.expansions
        assert known.waypoints is not None
        d = np.diff(known.waypoints.astype(np.float64), axis=0)
        self._bound = 2.0 * float(math.fsum(np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]).tolist())) + EDGE

    def answer(self) -> SearchResult:
        """The shortest lines; as a result of the search."""
        reach = self._bound if self._wide else self._bound + _OFF
        corners = self._corners(reach)
        ahead = self._tree(corners, 0, 1, reach)
        if ahead.ending == LIMIT:
            return self._out()
        if self._wide:
            return self._result(self._unwound(corners, ahead), corners, ahead)
        back = self._tree(corners, 1, 0, reach)
        if back.ending == LIMIT:
            return self._out()
        points = self._between(corners, ahead, back, reach)
        return self._out() if points is None else self._result(points, corners, ahead)

    def _out(self) -> SearchResult:
        return SearchResult(LIMIT, self._spent, None)

    def _left(self) -> int:
        return -1 if self._budget is None else max(0, self._budget - self._spent)

    def _corners(self, reach: float) -> CornerMap:
        """Those corners that are not too far from both ends together, after the ends."""
        made = _wide_corners(self._free) if self._wide else _corners(self._free, self._theta.rule == TOUCH)
        ends = np.array(self._ends, dtype=np.int64)
        ends = 2 * ends + (2 if self._wide else 3)
        self._corners_in_map = len(made.x)
        near = _far(made, ends[0]) + _far(made, ends[1]) <= reach
        zero = np.zeros(2, dtype=np.int64)
        return CornerMap(
            made.square, made.node, made.stride,
            np.concatenate((ends[:, 0], made.x[near])), np.concatenate((ends[:, 1], made.y[near])),
            np.concatenate((zero, made.qx[near])), np.concatenate((zero, made.qy[near])),
        )  # fmt: skip

    def _tree(self, m: CornerMap, root: int, target: int, reach: float) -> CornerTree:
        n = len(m.x)
        f, g = (np.full(n, NEVER) for _ in range(2))
        dx, dy = (m.x - m.x[target]).astype(np.float64), (m.y - m.y[target]).astype(np.float64)
        h = np.sqrt(dx * dx + dy * dy)
        parent, closed = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.uint8)
        heap, place = np.zeros(n + 1, dtype=np.int32), np.zeros(n, dtype=np.int32)
        edges = np.zeros(2 * EDGES, dtype=np.int32)
        result = np.zeros(3, dtype=np.int64)
        looking = _looking(m.square, m.stride, m.x, m.y)
        corner_tree(
            m.square, m.node, m.stride, m.x, m.y, m.qx, m.qy, root, target, reach, self._left(),
            f, g, h, parent, closed, heap, place, edges, *looking, result,
        )  # fmt: skip
        ending, expanded, kept = result.tolist()
        self._spent += expanded
        return CornerTree(g, closed, parent, edges[: 2 * kept].reshape(-1, 2), ending, expanded)

    def _unwound(self, m: CornerMap, tree: CornerTree) -> NDArray[np.int32]:
        """The turning points of the tree's path to the goal, cells."""
        at = [1]
        while at[-1] != 0:
            at.append(int(tree.parent[at[-1]]))
        xy = ((np.stack((m.x[at[::-1]], m.y[at[::-1]]), axis=1) - 2) // 2).astype(np.int32)
        # An end that is a corner, too, is in the tree twice.
        new = np.concatenate(([True], np.any(np.diff(xy, axis=0) != 0, axis=1)))
        return xy[new]

    def _between(
        self, m: CornerMap, ahead: CornerTree, back: CornerTree, reach: float
    ) -> NDArray[np.int32] | None:
        """The turning points of the shortest path between cell centres; None: the budget is used."""
        n = len(m.square)
        (sx, sy), (gx, gy) = self._ends
        cells, to_go = np.zeros(n, dtype=np.int32), np.zeros(n)
        queue, mark = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.uint8)
        result = np.zeros(1, dtype=np.int64)
        on = (ahead.closed | back.closed) != 0
        vertices = [one[on] for one in (m.x, m.y, m.qx, m.qy)]
        trees = (ahead.length[on], ahead.closed[on], back.length[on], back.closed[on])
        count = cells_within(
            m.square, m.node, m.stride, *vertices, *trees,
            (sy + 1) * m.stride + sx + 1, self._bound, reach, cells, to_go, queue, mark,
            *_looking(m.square, m.stride, vertices[0], vertices[1]), result,
        )  # fmt: skip
        cells, to_go = cells[:count].copy(), to_go[:count].copy()
        goal = int(np.flatnonzero(cells == (gy + 1) * m.stride + gx + 1)[0])
        f, g = (np.full(count, NEVER) for _ in range(2))
        parent, chain = (np.zeros(count, dtype=np.int32) for _ in range(2))
        heap, place = np.zeros(count + 1, dtype=np.int32), np.zeros(count, dtype=np.int32)
        ended = np.zeros(3, dtype=np.int64)
        number = np.full(n, -1, dtype=np.int32)
        number[cells] = np.arange(count, dtype=np.int32)
        straightest(
            m.square, np.zeros(1, dtype=np.uint8), m.stride, self._theta.rule, cells, to_go, goal, self._bound,
            self._left(), f, g, parent, np.zeros(count, dtype=np.uint8), heap, place, chain,
            number, _spans(m.square, m.stride), np.zeros(count, dtype=np.int32), ended,
        )  # fmt: skip
        ending, expanded, points = ended.tolist()
        self._spent += expanded
        if ending == LIMIT:
            return None
        y, x = np.divmod(cells[chain[:points][::-1]], np.int32(m.stride))
        return np.stack((x, y), axis=1) - np.int32(1)

    def _result(self, points: NDArray[np.int32], m: CornerMap, tree: CornerTree) -> SearchResult:
        walk, turns = self._theta.along(points, self._closed)
        used = np.flatnonzero(tree.closed)
        places = (np.stack((m.x, m.y), axis=1) - (2 if self._wide else 3)) / 2.0
        model = MapModel(
            "visibility-graph",
            lines=np.concatenate((places[tree.edges[:, 0]], places[tree.edges[:, 1]]), axis=1),
            points=places[used],
            bound=float(tree.length[1]) / 2.0,
            counts={"corners": self._corners_in_map, "expanded": len(used)},
        )
        return SearchResult(FOUND, self._spent, walk, waypoints=turns, model=model)


def _spans(square: _Bytes, stride: int) -> Floats:
    """Room for what lines of sight leave free of a column or row, twice."""
    return np.zeros(4 * (stride + len(square) // stride))


def _looking(
    square: _Bytes, stride: int, x: _Ints, y: _Ints
) -> tuple[NDArray[np.int32], NDArray[np.int32], Floats, NDArray[np.int32], NDArray[np.int32]]:
    """The arguments vertex, tried, spans, squares and seen of the kernels, for two ends and the corners after them."""
    n = len(x)
    vertex = np.full(len(square), -1, dtype=np.int32)
    vertex[(y[2:] >> 1) * stride + (x[2:] >> 1)] = np.arange(2, n, dtype=np.int32)
    # Where more squares than corners are in sight it is quicker to look at all corners.
    tried, squares, seen = (
        np.zeros(n, dtype=np.int32),
        np.zeros(n, dtype=np.int32),
        np.zeros(n, dtype=np.int32),
    )
    return vertex, tried, _spans(square, stride), squares, seen


def _far(m: CornerMap, point: _Ints) -> Floats:
    """Distance of each corner to a lattice point."""
    dx, dy = (m.x - point[0]).astype(np.float64), (m.y - point[1]).astype(np.float64)
    far: Floats = np.sqrt(dx * dx + dy * dy)
    return far


def _around(free: BoolGrid) -> tuple[_Bytes, tuple[BoolGrid, ...]]:
    """Squares in a frame of blocked ones, and, for each corner, whether the four squares around it are free.

    Both (height + 3, width + 3): square and corner of one index share their upper left corner. The order of the
    four: upper left, upper right, lower left, lower right.
    """
    height, width = free.shape
    square = np.zeros((height + 3, width + 3), dtype=np.uint8)
    square[1 : height + 1, 1 : width + 1] = free
    frame = np.zeros((height + 4, width + 4), dtype=bool)
    frame[1:, 1:] = square
    return square, (frame[:-1, :-1], frame[:-1, 1:], frame[1:, :-1], frame[1:, 1:])


def _single(four: tuple[BoolGrid, ...]) -> tuple[BoolGrid, NDArray[np.int64], NDArray[np.int64]]:
    """Corners of exactly one blocked square, and on which side of them it lies."""
    open_around = np.sum([one.astype(np.int8) for one in four], axis=0)
    single = open_around == 3
    a, b, c, d = (~one for one in four)
    qx = np.where(single, (b | d).astype(np.int64) - (a | c), 0)
    qy = np.where(single, (c | d).astype(np.int64) - (a | b), 0)
    return single, qx, qy


def _made(square: _Bytes, node: _Bytes, corner: BoolGrid, qx: _Ints, qy: _Ints) -> CornerMap:
    y, x = np.nonzero(corner)
    return CornerMap(
        square.ravel(), node.ravel(), square.shape[1],
        2 * x.astype(np.int64), 2 * y.astype(np.int64), qx[y, x], qy[y, x],
    )  # fmt: skip


def _corners(free: BoolGrid, touching: bool) -> CornerMap:
    """Corners of blocked cells, for a point."""
    square, four = _around(free)
    a, b, c, d = four
    single, qx, qy = _single(four)
    pinch = (a & d & ~b & ~c) | (b & c & ~a & ~d)
    node = (b | d) * np.uint8(SIDE_X) + (c | d) * np.uint8(SIDE_Y)
    if touching:
        node += pinch * np.uint8(SHUT)
    return _made(square, node.astype(np.uint8), single if touching else single | pinch, qx, qy)


def _wide_corners(free: BoolGrid) -> CornerMap:
    """Corners of what a disc's lines keep to: squares between four centres, and lines along rows and columns.

    Corner (i, j) of the map is the centre of cell (i - 1, j - 1).
    """
    quads = free[:-1, :-1] & free[:-1, 1:] & free[1:, :-1] & free[1:, 1:]
    height, width = free.shape
    square = np.zeros((height + 3, width + 3), dtype=np.uint8)
    square[1:height, 1:width] = quads
    frame = np.zeros((height + 4, width + 4), dtype=bool)
    frame[1:, 1:] = square
    a, b, c, d = four = (frame[:-1, :-1], frame[:-1, 1:], frame[1:, :-1], frame[1:, 1:])
    centre = np.zeros((height + 4, width + 4), dtype=bool)
    centre[1 : height + 1, 1 : width + 1] = free
    here = centre[:-1, :-1]
    right, below = here & centre[:-1, 1:], here & centre[1:, :-1]
    left, above = np.zeros_like(right), np.zeros_like(below)
    left[:, 1:], above[1:] = right[:, :-1], below[:-1]
    node = right * np.uint8(SIDE_X) + below * np.uint8(SIDE_Y)
    single, qx, qy = _single(four)
    diagonal = (a & d & ~b & ~c) | (b & c & ~a & ~d)
    # Lines with blocked squares on both sides: corridors one cell wide.
    thin = (right & ~(b | d), left & ~(a | c), below & ~(c | d), above & ~(a | b))
    lines = np.sum([one.astype(np.int8) for one in thin], axis=0)
    through = (lines == 2) & ((thin[0] & thin[1]) | (thin[2] & thin[3])) & ~(a | b | c | d)
    turning = here & (single | diagonal | ((lines > 0) & ~through))
    return _made(square, node.astype(np.uint8), turning, qx, qy)
