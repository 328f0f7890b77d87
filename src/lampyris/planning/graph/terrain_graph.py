"""Searching a grid as a graph where cells weigh differently: the same questions, answered over terrain."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from lampyris.kernels._jit import jit_disabled
from lampyris.kernels.graph.search import FOUND
from lampyris.kernels.graph.weighted_search import weighted_search
from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.planning.graph.grid_graph import (
    HEAVIEST,
    PLAIN_EXPANSIONS,
    GridSearch,
    PaddedMap,
    ReadOnly,
    Reads,
    Rules,
    SearchResult,
    check_limits,
    rules_of,
)
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells

_LOWEST = -(2**62)
"""Bases go no lower: costs, below 2^60, and h must still fit 64 bits on either side."""


class TerrainSearch:
    """The arrays of one map with terrain, searched as often as one likes; as
    :class:`lampyris.planning.graph.grid_graph.GridSearch`.

    Memory: 35 bytes a cell.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    terrain : uint8 (height, width); what cells cost to enter.
    moves : the step set, weighed.
    informed : whether :meth:`find_path` is led by the metric of the open plane of plain ground.

    Raises
    ------
    LimitError : more cells, or costlier steps, than exact costs have room for.
    """

    def __init__(self, free: BoolGrid, terrain: ByteGrid, moves: Moves, *, informed: bool) -> None:
        check_limits(free, moves)
        self._board = PaddedMap(free.shape, moves.reach)
        n = self._board.size
        self._scale = moves.scale
        self._led = self._arguments(rules_of(moves, informed))
        self._blind = self._arguments(rules_of(moves, False))
        self._weight = np.zeros(n, dtype=np.uint8)
        self._heap = (np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int32))
        self._place = np.empty(n, dtype=np.int32)
        self._g = np.zeros(n, dtype=np.int64)
        self._step = np.empty(n, dtype=np.int8)
        self._result = np.zeros(4, dtype=np.int64)
        self._span = HEAVIEST * max(moves.costs) * free.size + 1
        self._base = 0
        self._spent = 0
        self.set_ground(free, terrain)

    def _arguments(self, r: Rules) -> ReadOnly:
        return ReadOnly((*self._board.steps(r), frozen(r.cost // self._scale), r.first, r.follow, r.slope))

    def set_ground(self, free: BoolGrid, terrain: ByteGrid) -> None:
        """Take a whole new free space and terrain of the same shape."""
        self._board.lay(free, self._board.free)
        self._board.lay(terrain, self._weight)

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has no terrain."""
        if terrain is not None:
            self.set_ground(free, terrain)
        return terrain is not None

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """Cheapest path between two free cells while some cells (of the map) are closed."""
        with self._board.closing(closed):
            return self._run(self._led, self._board.flat(start), self._board.flat(goal), budget)

    def order(self, start: Cell, goal: Cell) -> Cells:
        """The cells that :meth:`find_path` expands, in its order; recomputed in plain Python."""
        board, n = self._board, self._board.size
        heap = tuple(np.empty_like(part) for part in self._heap)
        step, result = Reads(n), np.zeros(4, dtype=np.int64)
        ends = (board.flat(start), board.flat(goal), -1, -self._span, self._span)
        scratch = (*heap, np.empty_like(self._place), np.zeros(n, dtype=np.int64), step, result)
        ground = (board.free, self._weight, board.stride)
        weighted_search.run_plain(*ground, *ends, *self._led, *scratch)
        return board.cells(step.order(int(result[1])))

    def region(self, cell: Cell, budget: int | None = None) -> SearchResult:
        """How many cells can be reached from a free cell, itself included: the expansions of the answer."""
        return self._run(self._blind, self._board.flat(cell), -1, budget)

    def _run(self, rules: ReadOnly, start: int, goal: int, budget: int | None) -> SearchResult:
        if self._base - self._span < _LOWEST:
            self._g.fill(0)
            self._base = 0
        self._base -= self._span
        if self._spent > PLAIN_EXPANSIONS and not jit_disabled():
            weighted_search.compiled()
        limit = -1 if budget is None else budget
        board = self._board
        ground = (board.free, self._weight, board.stride)
        scratch = (*self._heap, self._place, self._g, self._step, self._result)
        weighted_search(*ground, start, goal, limit, self._base, self._span, *rules, *scratch)
        ending, expansions, length, _ = self._result.tolist()
        self._spent += expansions
        cells = board.cells(self._heap[2][:length]) if ending == FOUND else None
        return SearchResult(ending, expansions, cells)


def search_of(
    free: BoolGrid, terrain: ByteGrid | None, moves: Moves, *, informed: bool = True
) -> GridSearch | TerrainSearch:
    """The search that suits a map: by queues over plain ground, by a heap over terrain."""
    if terrain is None:
        return GridSearch(free, moves, informed=informed)
    return TerrainSearch(free, terrain, moves, informed=informed)
