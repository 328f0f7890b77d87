"""Searching a mesh of rectangles: its making, the search, and the lines and the walk that come of it."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels import loading
from lampyris.kernels.graph.any_angle import CUT, TOUCH, WIDE
from lampyris.kernels.map_models.corner_flags import TOWARDS_X, TOWARDS_Y, TURN
from lampyris.kernels.map_models.polyanya import FIELDS, FOUND, FULL, polyanya, walk_along
from lampyris.kernels.map_models.rectangle_mesh import cover, exits_of, list_sides
from lampyris.kernels.map_models.rectangle_mesh_arrays import count_ports, count_sides, mark_corners
from lampyris.model.moves import Moves
from lampyris.model.plan import MapModel
from lampyris.planning.graph.any_angle_search import AnyAngleSearch
from lampyris.planning.graph.grid_graph import SearchResult, check_limits
from lampyris.typing import BoolGrid, ByteGrid, Cell

_Ints = NDArray[np.int64]

UNITS = 2**16
"""Units in a cell, for lines that keep one unit away from corners.

A corner that a line between two others does not touch is farther from it than 1 / (4 length): on maps of less than 8,192
cells from corner to corner more than the two units by which a line is moved at most.
"""
FAR = 8192
"""Cells from corner to corner of maps that are searched for a point."""
FIRST_NODES = 512
"""Room for so many search nodes at first; a search that needs more is run again with four times as much."""


def searching(
    free: BoolGrid, terrain: ByteGrid | None, moves: Moves, *, wide: bool
) -> PolyanyaSearch | AnyAngleSearch:
    """The search for such a map: Theta* where it has terrain, or no line of a point may be that long."""
    height, width = free.shape
    if terrain is not None or (not wide and height * height + width * width >= FAR * FAR):
        return AnyAngleSearch(free, terrain, moves, wide=wide, lazy=0)
    return PolyanyaSearch(free, moves, wide=wide)


class Mesh:
    """Rectangles of free squares, and where paths may turn; see :mod:`lampyris.kernels.map_models.rectangle_mesh`.

    Memory: 7 bytes a cell, and 60 to 150 a rectangle.

    Parameters
    ----------
    free : bool (height, width).
    rule : CUT, TOUCH or WIDE. With WIDE squares lie between four cell centres.
    """

    def __init__(self, free: BoolGrid, rule: int) -> None:
        height, width = free.shape
        shape = (height + 3, width + 3)
        square = np.zeros(shape, dtype=np.uint8)
        centre = np.zeros(1, dtype=np.uint8)
        if rule == WIDE:
            square[1:height, 1:width] = free[:-1, :-1] & free[:-1, 1:] & free[1:, :-1] & free[1:, 1:]
            framed = np.zeros(shape, dtype=np.uint8)
            framed[1 : height + 1, 1 : width + 1] = free
            centre = framed.ravel()
        else:
            square[1 : height + 1, 1 : width + 1] = free
        self.square, self.stride = square.ravel(), shape[1]
        self.owner = np.full(square.size, -1, dtype=np.int32)
        rects = np.empty(4 * int(np.count_nonzero(square)), dtype=np.int32)
        many = int(cover(self.square, self.stride, self.owner, rects))
        self.rects = rects[: 4 * many].copy()
        self.corner = mark_corners(self.square, centre, self.stride, rule != TOUCH)
        sides = count_sides(self.owner, self.stride)
        ports = count_ports(self.corner, self.owner, self.stride)
        self.first, self.port_first = (np.zeros(many + 1, dtype=np.int32) for _ in range(2))
        self.sides = np.zeros(max(5 * sides, 1), dtype=np.int32)
        self.ports = np.zeros(max(ports, 1), dtype=np.int32)
        mesh = (self.corner, self.stride, self.owner, self.rects)
        list_sides(*mesh, self.first, self.sides, self.port_first, self.ports)
        self.out = np.full(max(many, 1), -1, dtype=np.int32)
        self.open_to = np.zeros(max(many, 1), dtype=np.int32)
        doors_of = np.diff(self.first)
        single = np.flatnonzero((doors_of == 1) & (np.diff(self.port_first) == 0)).astype(np.int32)
        exits_of(single, self.first, self.sides, self.port_first, self.out, doors_of)


class PolyanyaSearch:
    """Shortest paths in the plane on one map.

    Memory: 31 bytes a cell, 131 a node of the largest search, and see :class:`Mesh`.

    Parameters
    ----------
    free, moves, wide : as for :class:`lampyris.planning.graph.any_angle_search.AnyAngleSearch`.
    """

    def __init__(self, free: BoolGrid, moves: Moves, *, wide: bool) -> None:
        check_limits(free, moves)
        slanting = any(dx and dy for dx, dy in moves.offsets)
        cutting = slanting and moves.corner_cutting
        self._moves = moves
        self._rule = WIDE if wide else CUT if cutting else TOUCH
        self._diagonals = 2 if cutting else int(slanting)
        self._theta: AnyAngleSearch | None = None
        n = (free.shape[0] + 3) * (free.shape[1] + 3)
        self._best, self._port_best = np.empty(n), np.empty(n)
        self._seen, self._port_seen = np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int32)
        self._runs = 0
        self._state = np.zeros(5, dtype=np.int64)
        self._room(FIRST_NODES)
        self._pack_s = 0.0
        self._lay(free)

    def _room(self, nodes: int) -> None:
        self._nodes = np.empty(FIELDS * nodes, dtype=np.int64)
        self._points = np.empty(2 * nodes, dtype=np.int64)
        self._keys = [np.empty(nodes) for _ in range(3)]
        self._heap, self._place = np.zeros(nodes + 1, dtype=np.int32), np.zeros(nodes, dtype=np.int32)

    def _lay(self, free: BoolGrid) -> None:
        began = loading.wall()
        self._free = free
        self.mesh = Mesh(free, self._rule)
        self._pack_s += loading.wall() - began

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has terrain."""
        if terrain is not None:
            return False
        if self._theta is not None:
            self._theta.take(free, None)
        self._lay(free)
        return True

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """The shortest path in the plane between two free cells while some cells (of the map) are closed.

        ``expansions`` are search nodes, ``pack_s`` what making the mesh took since the answer before.
        """
        shut = list(closed)
        if not shut:
            return self._find(start, goal, budget, shut)
        free = self._free
        without = free.copy()
        without[[y for _, y in shut], [x for x, _ in shut]] = False
        mesh = self.mesh
        try:
            self._lay(without)
            return self._find(start, goal, budget, shut)
        finally:
            self._free, self.mesh = free, mesh

    def turning_points(
        self, start: Cell, goal: Cell, budget: int | None = None
    ) -> tuple[int, int, _Ints | None]:
        """How the search ended, nodes expanded, and the points at which the path turns, ends included: int64 (k, 2),
        lattice (see :mod:`lampyris.kernels.map_models.polyanya`)."""
        m = self.mesh
        off = 2 if self._rule == WIDE else 3
        ends = (2 * start[0] + off, 2 * start[1] + off, 2 * goal[0] + off, 2 * goal[1] + off)
        while True:
            if self._runs == 2**31 - 1:
                self._seen.fill(0)
                self._port_seen.fill(0)
                m.open_to.fill(0)
                self._runs = 0
            self._runs += 1
            polyanya(
                m.owner, m.corner, m.stride, m.rects, m.first, m.sides, m.port_first, m.ports, m.out, m.open_to, *ends,
                -1 if budget is None else budget, self._runs, self._best, self._seen, self._port_best,
                self._port_seen, self._nodes, *self._keys, self._heap, self._place, self._points, self._state,
            )  # fmt: skip
            _, turns, ending, expanded, _ = self._state.tolist()
            if ending != FULL:
                break
            self._room(4 * len(self._place))
        if ending != FOUND:
            return ending, expanded, None
        points: _Ints = self._points[: 2 * turns].reshape(-1, 2)[::-1].copy()
        return ending, expanded, points

    def _find(self, start: Cell, goal: Cell, budget: int | None, shut: list[Cell]) -> SearchResult:
        ending, expanded, points = self.turning_points(start, goal, budget)
        pack_s, self._pack_s = self._pack_s, 0.0
        if points is None:
            return SearchResult(ending, expanded, None, pack_s=pack_s)
        off = 2 if self._rule == WIDE else 3
        places = (points - off) / 2.0
        d = np.diff(places, axis=0)
        model = MapModel(
            "polyanya",
            points=places[1:-1],
            bound=math.fsum(np.sqrt(d[:, 0] * d[:, 0] + d[:, 1] * d[:, 1]).tolist()),
            counts={"rectangles": len(self.mesh.rects) // 4, "expanded": expanded},
        )
        if self._rule == WIDE:
            if self._theta is None:
                self._theta = AnyAngleSearch(self._free, None, self._moves, wide=True, lazy=0)
            walk, turns = self._theta.along(((points - 2) // 2).astype(np.int32), shut)
            return SearchResult(FOUND, expanded, walk, waypoints=turns, model=model, pack_s=pack_s)
        clear = self._clear(points)
        cells = self._walk(clear)
        if self._rule == TOUCH:
            places = _straight(clear) / UNITS - 1.5
        return SearchResult(FOUND, expanded, cells, waypoints=places, model=model, pack_s=pack_s)

    def _clear(self, points: _Ints) -> _Ints:
        """The same path, one unit away from all corners that it touches; units."""
        made: list[_Ints] = []
        half = UNITS // 2
        for (ax, ay), (bx, by) in zip(points[:-1].tolist(), points[1:].tolist(), strict=True):
            g = math.gcd(bx - ax, by - ay)
            along = np.arange(g, dtype=np.int64)
            xy = np.stack((ax + along * ((bx - ax) // g), ay + along * ((by - ay) // g)), axis=1)
            made.append(xy)
        made.append(points[-1:])
        xy = np.concatenate(made)
        flags = self.mesh.corner[(xy[:, 1] >> 1) * self.mesh.stride + (xy[:, 0] >> 1)]
        even = ((xy[:, 0] | xy[:, 1]) & 1) == 0
        turn = even & ((flags & TURN) != 0)
        # Between two blocked cells that share a corner a line has no room to move.
        kept = turn | (even & (flags != 0))
        kept[[0, -1]] = True
        moved = xy * half
        moved[:, 0] += np.where(turn, np.where(flags & TOWARDS_X, -1, 1), 0)
        moved[:, 1] += np.where(turn, np.where(flags & TOWARDS_Y, -1, 1), 0)
        clear: _Ints = moved[kept]
        return clear

    def _walk(self, points: _Ints) -> NDArray[np.int32]:
        """The walk along lines, cells."""
        x, y = (np.ascontiguousarray(points[:, k]) for k in range(2))
        room = 1 + int((np.abs(np.diff(x)).sum() + np.abs(np.diff(y)).sum()) // UNITS) + 6 * len(x)
        path = np.empty(room, dtype=np.int32)
        count = int(walk_along(self.mesh.square, self.mesh.stride, UNITS, x, y, self._diagonals, path))
        row, column = np.divmod(path[: max(count, 1)], np.int32(self.mesh.stride))
        if not count:
            column, row = (points[:1] // UNITS).astype(np.int32).T
        return np.stack((column, row), axis=1) - np.int32(1)


def _straight(points: _Ints) -> _Ints:
    """The same lines without points at which they go straight on."""
    if len(points) < 3:
        return points
    d = np.diff(points, axis=0)
    bend = d[:-1, 0] * d[1:, 1] != d[:-1, 1] * d[1:, 0]
    return points[np.concatenate(([True], bend, [True]))]
