"""Searching a visibility graph: corners of obstacles first, then the cell centres that they leave."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.kernels.graph.any_angle import CUT, TOUCH, WIDE
from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT
from lampyris.kernels.map_models.visibility import (
    BESIDE,
    EDGE,
    FULL,
    NEVER,
    SHUT,
    SIDE_X,
    SIDE_Y,
    straight_paths,
)
from lampyris.model.moves import Moves
from lampyris.model.plan import MapModel
from lampyris.planning.field.connected import are_connected
from lampyris.planning.graph.any_angle_search import AnyAngleMap, AnyAngleSearch
from lampyris.planning.graph.grid_graph import SearchResult
from lampyris.typing import BoolGrid, ByteGrid, Cell, Floats

_Ints = NDArray[np.int64]
_Bytes = NDArray[np.uint8]

FINE = 8192
"""Squares in a row or column up to which slopes that differ do so by more than the kernel's EDGE, thrice."""
EDGES = 20_000
"""Pairs of corners kept for pictures, at most; on small maps twice as many as corners."""
TARGET, ROOT = 0, 1
"""The first two vertices: start and goal. Trees grow from the goal, since the way to it leads the search between cells."""
NEAR = (1.02, 1.1, 1.4, NEVER)
"""Within how many times the straight distance a path in the plane is looked for, one after the other: the more, the farther lines
of sight are followed."""
MANY = 10_000
"""Corners from which on it is asked whether there is a path at all before all of them are searched."""
LONGEST = 8.0
"""Half squares for each square of the map: more than a path through all of them is long."""
SHARE, MORE = 0.5, 0.4
"""Paths between centres are looked for first that are longer than the optimum in the plane by this share of what turning at cells
costs it, and half cells more. Where there is none twice as much is allowed, and so on."""


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


class VisibilitySearch:
    """Shortest paths of straight lines on one map.

    For a point a tree over corners is grown from the goal until it meets the start: that is the optimum in the plane. How long
    the shortest path between cell centres can be is then guessed (SHARE, MORE), the tree is grown to all corners on
    paths within that, and with it the distance in the plane from the centres of all cells on such paths. A* over these
    cells, led by that distance, finds the shortest path between centres if it is within the guess; if it is not, twice the
    gap is allowed. So the guess decides how long it takes and not what is found.

    Memory: for a point 95 bytes a cell, and 70 for each corner of the map: 123 a cell on random-512; for a disc 31 and 115.

    Parameters
    ----------
    free, moves, wide : as for :class:`lampyris.planning.graph.any_angle_search.AnyAngleMap`.
    """

    def __init__(self, free: BoolGrid, moves: Moves, *, wide: bool) -> None:
        self._lines = AnyAngleMap(free, moves, wide=wide)
        self._free = free

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has terrain."""
        if terrain is not None:
            return False
        self._lines.lay(free)
        self._free = free
        return True

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """The shortest path of straight lines between two free cells while some cells (of the map) are closed."""
        shut = list(closed)
        free = self._free
        if shut:
            free = free.copy()
            free[[y for _, y in shut], [x for x, _ in shut]] = False
        return _Query(self._lines, free, start, goal, budget, shut).answer()


class _Query:
    """One question."""

    def __init__(
        self,
        lines: AnyAngleMap,
        free: BoolGrid,
        start: Cell,
        goal: Cell,
        budget: int | None,
        closed: list[Cell],
    ) -> None:
        self._lines, self._free, self._closed = lines, free, closed
        self._wide = lines.rule == WIDE
        self._ends = (start, goal)
        self._spent = _Spent(budget)
        self._corners = self._corners_of()

    def answer(self) -> SearchResult:
        """The shortest lines; as a result of the search."""
        tree = _tree(self._corners, self._wide)
        straight, reach, ending = float(tree.h[ROOT]), 0.0, EXHAUSTED
        for near in NEAR:
            reach = near * straight + 4.0
            ending = tree.run(self._spent, reach)
            if ending != EXHAUSTED or (near == NEAR[0] and not self._may_be_joined()):
                break
            tree.forget()
        if ending != FOUND:
            return self._out(ending)
        if self._wide:
            return self._result(self._unwound(tree), tree)
        least = float(tree.g[TARGET])
        bound = least + SHARE * (self._snapped(tree) - least) + MORE
        while bound < LONGEST * len(self._corners.square):
            if bound > reach:
                tree.forget()
                reach = bound
            if tree.run(self._spent, bound, onward=True) == LIMIT:
                return self._out(LIMIT)
            between = self._between(tree, bound)
            ending = between.run(self._spent, bound)
            if ending == LIMIT:
                return self._out(LIMIT)
            if ending == FOUND:
                y, x = np.divmod(np.array(between.chain(), dtype=np.int32), np.int32(self._corners.stride))
                return self._result(np.stack((x, y), axis=1) - np.int32(1), tree)
            bound = least + 2.0 * (bound - least)
            tree.rest = _straight(self._corners)
        raise AssertionError("where there is a path in the plane there is one between cell centres")

    def _may_be_joined(self) -> bool:
        """Whether there may be a path; where looking at all corners takes long, whether there is one."""
        if len(self._corners.x) <= MANY:
            return True
        stride = self._free.shape[1] + 2
        free = np.pad(self._free, 1).ravel().astype(np.uint8)
        start, goal = ((y + 1) * stride + x + 1 for x, y in self._ends)
        return are_connected(free, stride, start, goal, corners=self._lines.rule == CUT)

    def _out(self, ending: int) -> SearchResult:
        return SearchResult(ending, self._spent.expansions, None)

    def _corners_of(self) -> CornerMap:
        """The corners of the map, after the ends."""
        made = _wide_corners(self._free) if self._wide else _corners(self._free, self._lines.rule == TOUCH)
        ends = np.array(self._ends, dtype=np.int64)
        ends = 2 * ends + (2 if self._wide else 3)
        zero = np.zeros(2, dtype=np.int64)
        return CornerMap(
            made.square, made.node, made.stride,
            np.concatenate((ends[:, 0], made.x)), np.concatenate((ends[:, 1], made.y)),
            np.concatenate((zero, made.qx)), np.concatenate((zero, made.qy)),
        )  # fmt: skip

    def _between(self, tree: _Search, bound: float) -> _Search:
        """The search between cell centres that leads to paths within a bound, to which the tree was grown."""
        m = self._corners
        n = len(m.square)
        start, goal = ((y + 1) * m.stride + x + 1 for x, y in self._ends)
        touching = self._lines.rule == TOUCH
        inset = 2.0 * EDGE if touching and max(m.stride, n // m.stride) <= FINE else -EDGE
        # A square that the tree does not reach within the bound is at least so far from the goal.
        rest = tree.rest
        np.subtract(bound, rest, out=rest)
        np.minimum(tree.to_go, rest, out=rest)
        none = np.zeros(1, dtype=np.int32)
        return _Search(
            m, (start, goal), tree.to_go, rest, np.zeros(1), none, tree.seen,
            shut=BESIDE if touching else SHUT, centres=1, wide=0, inset=inset, edges=0,
        )  # fmt: skip

    def _unwound(self, tree: _Search) -> NDArray[np.int32]:
        """The turning points of a tree's path, cells, for a disc."""
        m, at = self._corners, tree.chain()[::-1]
        xy = ((np.stack((m.x[at], m.y[at]), axis=1) - 2) // 2).astype(np.int32)
        # An end that is a corner, too, is in the tree twice.
        new = np.concatenate(([True], np.any(np.diff(xy, axis=0) != 0, axis=1)))
        return xy[new]

    def _snapped(self, tree: _Search) -> float:
        """How long the tree's path is if it turns at the free cells opposite the blocked cells of its corners."""
        m, at = self._corners, tree.chain()
        dx, dy = (np.diff(one[at].astype(np.float64)) for one in (m.x - m.qx, m.y - m.qy))
        return math.fsum(np.sqrt(dx * dx + dy * dy).tolist())

    def _result(self, points: NDArray[np.int32], tree: _Search) -> SearchResult:
        m = self._corners
        walk, turns = self._lines.along(points, self._closed)
        used = np.flatnonzero((tree.g < NEVER) & (tree.place == 0))
        places = (np.stack((m.x, m.y), axis=1) - (2 if self._wide else 3)) / 2.0
        edges = tree.edges[: 2 * tree.kept].reshape(-1, 2)
        model = MapModel(
            "visibility-graph",
            lines=np.concatenate((places[edges[:, 0]], places[edges[:, 1]]), axis=1),
            points=places[used],
            bound=float(tree.g[TARGET]) / 2.0,
            counts={"corners": len(m.x) - 2, "expanded": len(used)},
        )
        return SearchResult(FOUND, self._spent.expansions, walk, waypoints=turns, model=model)


class _Spent:
    """Points expanded by all searches of one question, and how many may be."""

    def __init__(self, budget: int | None) -> None:
        self._budget = budget
        self.expansions = 0

    def most(self, so_far: int) -> int:
        """How many a search may expand in all that has expanded some; -1: any number."""
        return -1 if self._budget is None else max(0, self._budget - self.expansions) + so_far


class _Search:
    """One search of the kernel, which can be continued: its arguments by their names there, and its results."""

    def __init__(
        self,
        m: CornerMap,
        ends: tuple[int, int],
        h: Floats,
        rest: Floats,
        to_go: Floats,
        vertex: NDArray[np.int32],
        seen: NDArray[np.int32],
        *,
        shut: int,
        centres: int,
        wide: int,
        inset: float,
        edges: int,
    ) -> None:
        n = len(h)
        self._map, self._ends, self._wide = m, ends, wide
        self._rules = (shut, m.x, m.y, m.qx, m.qy, centres, wide)
        self.h, self.rest, self.to_go, self.seen = h, rest, to_go, seen
        self._vertex, self._inset = vertex, inset
        self._f, self.g = np.full(n, NEVER), np.full(n, NEVER)
        self._parent, self.place = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
        self._heap = np.zeros(n + 1, dtype=np.int32)
        self.edges = np.zeros(2 * edges, dtype=np.int32)
        self._spans = np.zeros(4 * (m.stride + len(m.square) // m.stride))
        self._state = np.zeros(3, dtype=np.int64)
        self.kept = 0

    def run(self, spent: _Spent, bound: float, *, onward: bool = False) -> int:
        """Search until the target is met, or onward, for all paths within a bound; how it ended."""
        m = self._map
        while True:
            before = int(self._state[1])
            straight_paths(
                m.square, m.node, m.stride, *self._rules, *self._ends, bound, int(onward), spent.most(before),
                self._f, self.g, self.h, self._parent, self._heap, self.place, self.edges, self.rest, self.to_go,
                self._vertex, self._inset, np.zeros(8), self._spans, self.seen, self._state,
            )  # fmt: skip
            ending, expanded, self.kept = self._state.tolist()
            spent.expansions += expanded - before
            if ending != FULL:
                return int(ending)
            self.seen = np.zeros(2 * len(self.seen), dtype=np.int32)

    def forget(self) -> None:
        """Begin the search of a tree again."""
        for one in (self._f, self.g):
            one.fill(NEVER)
        if not self._wide:
            self.to_go.fill(NEVER)
        self.place.fill(0)
        self._heap[0] = 0
        self._state.fill(0)

    def chain(self) -> list[int]:
        """The points of the shortest path, root first."""
        root, target = self._ends
        at = [target]
        while at[-1] != root:
            at.append(int(self._parent[at[-1]]))
        return at[::-1]


def _tree(m: CornerMap, wide: bool) -> _Search:
    """A search for shortest paths over corners, from the goal."""
    n, cells = len(m.x), len(m.square)
    dx, dy = (one.astype(np.float64) - float(one[TARGET]) for one in (m.x, m.y))
    rest = _straight(m)
    checkpoint()
    vertex = np.full(cells, -1, dtype=np.int32)
    vertex[(m.y[2:] >> 1) * m.stride + (m.x[2:] >> 1)] = np.arange(2, n, dtype=np.int32)
    seen = np.zeros(cells + 16 * (m.stride + cells // m.stride), dtype=np.int32)
    to_go = np.zeros(cells) if wide else np.full(cells, NEVER)
    return _Search(
        m, (ROOT, TARGET), np.sqrt(dx * dx + dy * dy), rest, to_go, vertex, seen,
        shut=SHUT, centres=0, wide=int(wide), inset=-EDGE, edges=min(EDGES, 2 * n),
    )  # fmt: skip


def _straight(m: CornerMap) -> Floats:
    """How far the start is from the centre of each square."""
    across = 2.0 * np.arange(m.stride) + (1.0 - float(m.x[TARGET]))
    along = 2.0 * np.arange(len(m.square) // m.stride) + (1.0 - float(m.y[TARGET]))
    far = (along * along)[:, None] + across * across
    checkpoint()
    np.sqrt(far, out=far)
    return far.ravel()


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


def _single(four: tuple[BoolGrid, ...]) -> BoolGrid:
    """Corners of exactly one blocked square."""
    a, b, c, d = (one.view(np.uint8) for one in four)
    open_around = a + b
    open_around += c
    open_around += d
    checkpoint()
    single: BoolGrid = open_around == 3
    return single


def _made(
    square: _Bytes, node: _Bytes, corner: BoolGrid, single: BoolGrid, four: tuple[BoolGrid, ...]
) -> CornerMap:
    """The corners at which paths may turn, and on which side of single ones the blocked square lies."""
    checkpoint()
    y, x = (one.astype(np.int64) for one in np.nonzero(corner))
    checkpoint()
    a, b, c, d = (~one[y, x] for one in four)
    alone = single[y, x].astype(np.int64)
    qx = ((b | d).astype(np.int64) - (a | c)) * alone
    qy = ((c | d).astype(np.int64) - (a | b)) * alone
    return CornerMap(square.ravel(), node.ravel(), square.shape[1], 2 * x, 2 * y, qx, qy)


def _corners(free: BoolGrid, touching: bool) -> CornerMap:
    """Corners of blocked cells, for a point."""
    square, four = _around(free)
    a, b, c, d = four
    single = _single(four)
    pinch = (a & d & ~b & ~c) | (b & c & ~a & ~d)
    checkpoint()
    node = (b | d) * np.uint8(SIDE_X) + (c | d) * np.uint8(SIDE_Y)
    checkpoint()
    if touching:
        node += pinch * np.uint8(SHUT) + ~(a & b & c & d) * np.uint8(BESIDE)
    return _made(square, node.astype(np.uint8), single if touching else single | pinch, single, four)


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
    single = _single(four)
    checkpoint()
    diagonal = (a & d & ~b & ~c) | (b & c & ~a & ~d)
    # Lines with blocked squares on both sides: corridors one cell wide.
    right, left, below, above = right & ~(b | d), left & ~(a | c), below & ~(c | d), above & ~(a | b)
    checkpoint()
    across, along = right | left, below | above
    through = ((right & left & ~along) | (below & above & ~across)) & ~(a | b | c | d)
    checkpoint()
    turning = here & (single | diagonal | ((across | along) & ~through))
    return _made(square, node.astype(np.uint8), turning, single, four)
