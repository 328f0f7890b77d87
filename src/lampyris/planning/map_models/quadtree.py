"""Quadtree: a path through square cells as large as obstacles leave them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.kernels.graph.search import FOUND
from lampyris.kernels.map_models.quadtree import leaf_search, pulled
from lampyris.model.moves import Moves
from lampyris.model.plan import MapModel
from lampyris.model.scene import Scene
from lampyris.planning.base import Traits
from lampyris.planning.graph.any_angle_search import AnyAngleSearch
from lampyris.planning.graph.grid_graph import SearchResult
from lampyris.planning.graph.session import GraphSession
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells


@dataclass(frozen=True, slots=True)
class Quadtree:
    """A* over the free leaves of a quadtree: large empty squares are one node each.

    Kambhampati, Davis, "Multiresolution path planning for mobile robots", IEEE Journal on Robotics and Automation
    2 (1986), 135-145.

    The map, in the upper left of a square of 2^k cells, is cut into four until each leaf is all free or all
    blocked; a leaf may be one cell, so nothing is lost: there is a path through leaves exactly where there is one
    by the moves. Leaves are joined by shared sides, and by shared corners where the moves may cut corners. The path
    passes through the middles of shared sides, and is then pulled straight over these points: the shortest path of
    lines of sight over them (those of ``theta-star``), ``Plan.waypoints``. It is not the shortest path of its kind:
    each leaf is entered at one cell only.

    ``Plan.expansions`` counts leaves; ``Plan.map_model`` has the leaves. Over terrain, which is not considered, the
    path is the walk alone.
    """

    name: ClassVar[str] = "quadtree"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary: ClassVar[str] = "Quadtree: A* over square cells as large as obstacles leave them."
    source: ClassVar[str] = (
        "Kambhampati and Davis 1986; the path pulled straight over its own points is ours."
    )

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> GraphSession:
        """Start a session. Nothing is drawn from ``rng`` and there is no per-iteration record."""
        make = partial(LeafSearch, wide=scene.robot.radius > 0)
        return GraphSession(scene, self.name, make, optimal=False)


_PART = 1 << 18
"""Cells of a map that are cut between two cancellation checks, rows of leaves at least."""


@dataclass(frozen=True, slots=True, eq=False)
class Leaves:
    """The leaves of a quadtree.

    Parameters
    ----------
    boxes : int32 (n, 4): x, y, side, and 1 if free; the free ones first, and none that is outside the map.
    free : how many are free.
    leaf : int32 (side, side): index of the free leaf of each cell, -1 elsewhere.
    """

    boxes: Cells
    free: int
    leaf: NDArray[np.int32]


def leaves_of(free: BoolGrid) -> Leaves:
    """Cut a map into squares of 2^k cells that are all free or all blocked, as large as they can be."""
    height, width = free.shape
    side = 1 << max(height - 1, width - 1).bit_length()
    whole = np.zeros((side, side), dtype=bool)
    whole[:height, :width] = free
    leaf = np.full((side, side), -1, dtype=np.int32)
    kinds: list[list[NDArray[np.int32]]] = [[], []]
    full: tuple[BoolGrid, ...] = (whole, ~whole)
    count, size = 0, 1
    while True:
        above: tuple[BoolGrid, ...] = tuple(
            _blocks(one) if size < side else np.zeros((1, 1), dtype=bool) for one in full
        )
        band = max(2, _PART // (size * side) & ~1)
        for kind, (one, parent) in enumerate(zip(full, above, strict=True)):
            for top in range(0, len(one), band):
                checkpoint()
                rows = one[top : top + band]
                covered = np.repeat(np.repeat(parent[top // 2 : (top + band) // 2], 2, 0), 2, 1)
                y, x = np.nonzero(rows & ~covered if size < side else rows)
                inside = (x * size < width) & ((y + top) * size < height)
                x, y = x[inside], y[inside]
                boxes_of = (x * size, (y + top) * size, np.full_like(x, size), np.full_like(x, 1 - kind))
                kinds[kind].append(np.stack(boxes_of, axis=1))
                if kind == 0 and len(x):
                    ids = np.full(rows.shape, -1, dtype=np.int32)
                    ids[y, x] = np.arange(count, count + len(x), dtype=np.int32)
                    count += len(x)
                    spread = np.repeat(np.repeat(ids, size, 0), size, 1)
                    there = leaf[top * size : (top + band) * size]
                    np.maximum(there, spread, out=there)
        if size == side:
            break
        full, size = above, 2 * size
    boxes = np.concatenate([one for kind in kinds for one in kind]).astype(np.int32)
    return Leaves(boxes, count, leaf)


def _blocks(whole: BoolGrid) -> BoolGrid:
    """Which squares of two by two are all true."""
    made: BoolGrid = whole[::2, ::2] & whole[1::2, ::2] & whole[::2, 1::2] & whole[1::2, 1::2]
    return made


class LeafSearch:
    """Paths through the leaves of one map.

    Memory: 65 bytes a cell.

    Parameters
    ----------
    free, moves, wide : as for :class:`lampyris.planning.graph.any_angle_search.AnyAngleSearch`.
    terrain : not considered; where there is any the answer has no lines.
    """

    def __init__(self, free: BoolGrid, terrain: ByteGrid | None, moves: Moves, *, wide: bool) -> None:
        self._lines = AnyAngleSearch(free, None, moves, wide=wide, lazy=0)
        self._corners = int(any(dx and dy for dx, dy in moves.offsets) and moves.corner_cutting)
        self._free, self._even = free, terrain is None
        self._leaves: Leaves | None = None

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape."""
        self._lines.take(free, None)
        self._free, self._even = free, terrain is None
        self._leaves = None
        return True

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """A path between two free cells while some cells (of the map) are closed."""
        shut = list(closed)
        if shut:
            free = self._free.copy()
            free[[y for _, y in shut], [x for x, _ in shut]] = False
            leaves = leaves_of(free)
        else:
            free = self._free
            leaves = self._leaves = self._leaves or leaves_of(free)
        m = leaves.free
        x, y, side = (leaves.boxes[:m, k].astype(np.int64) for k in range(3))
        f, h, g = np.zeros(m), np.zeros(m), np.full(m, -1.0)
        gate, chain = np.zeros(4 * m, dtype=np.int64), np.zeros(4 * m + 4, dtype=np.int64)
        come, place, heap = (np.zeros(n, dtype=np.int32) for n in (m, m, m + 1))
        result = np.zeros(3, dtype=np.int64)
        leaf_search(
            leaves.leaf.ravel(), leaves.leaf.shape[1], x, y, side, self._corners, *start, *goal,
            -1 if budget is None else budget,
            f, g, h, gate, come, np.zeros(m, dtype=np.uint8), heap, place, chain, result,
        )  # fmt: skip
        ending, expanded, count = result.tolist()
        if ending != FOUND:
            return SearchResult(ending, expanded, None)
        points = self._pulled(free, chain[: 2 * count].reshape(-1, 2)[::-1])
        walk, turns = self._lines.along(points, shut)
        model = MapModel(
            "quadtree",
            boxes=leaves.boxes,
            counts={"free leaves": m, "leaves": len(leaves.boxes), "expanded": expanded},
        )
        return SearchResult(FOUND, expanded, walk, waypoints=turns if self._even else None, model=model)

    def _pulled(self, free: BoolGrid, points: NDArray[np.int64]) -> Cells:
        """The shortest path of lines of sight over these cells, start first."""
        new = np.concatenate(([True], np.any(np.diff(points, axis=0) != 0, axis=1)))
        points = points[new]
        framed = np.pad(free, 1).astype(np.uint8)
        n = len(points)
        x, y = np.ascontiguousarray(points.T) + 1
        chain = np.zeros(n, dtype=np.int64)
        stride, weight = framed.shape[1], np.zeros(1, dtype=np.uint8)
        left = pulled(
            framed.ravel(),
            weight,
            stride,
            self._lines.rule,
            x,
            y,
            np.zeros(n),
            np.zeros(n, dtype=np.int64),
            chain,
        )
        return points[chain[:left][::-1]].astype(np.int32)
