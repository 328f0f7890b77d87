"""Bidirectional search over one map, with or without terrain."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.graph.bidirectional import FOUND, SPAN, meet, meet_even
from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.planning.graph.expanded import MOST_NS, Writes
from lampyris.planning.graph.grid_graph import PaddedMap, ReadOnly, SearchResult, check_limits, rules_of
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells

_Ints = NDArray[np.int64]


class TwoSearches:
    """The arrays of one map on plain ground, searched from both ends as often as one likes.

    Memory: 39 bytes a cell.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    moves : the step set.

    Raises
    ------
    LimitError : more cells, or costlier steps, than exact costs have room for.
    """

    def __init__(self, free: BoolGrid, moves: Moves) -> None:
        check_limits(free, moves)
        self._board = PaddedMap(free.shape, moves.reach)
        n = self._board.size
        r = rules_of(moves, informed=True)
        self._rules = ReadOnly((*self._board.steps(r), r.cost, r.slope, r.slot, r.shift, r.queues))
        self._after = np.empty(2 * (n + r.queues), dtype=np.int32)
        self._before = np.empty(2 * (n + r.queues), dtype=np.int32)
        self._f = np.zeros(2 * n, dtype=np.int64)
        self._step = np.empty(2 * n, dtype=np.int8)
        self._state = np.zeros(8, dtype=np.int64)
        self._path = np.empty(n, dtype=np.int32)
        self._base = 0
        self.take(free, None)

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has terrain."""
        if terrain is None:
            self._board.lay(free, self._board.free)
        return terrain is None

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """Cheapest path between two free cells while some cells (of the map) are closed."""
        if self._base < -(2**63) + 2 * SPAN:
            self._f.fill(0)
            self._base = 0
        self._base -= SPAN
        board = self._board
        ends = (board.flat(start), board.flat(goal), -1 if budget is None else budget, self._base)
        scratch = (self._after, self._before, self._f, self._step, self._state, self._path)
        with board.closing(closed):
            meet_even(board.free, board.stride, *ends, *self._rules, *scratch)
        ending, expansions, length = self._state[:3].tolist()
        cells = board.cells(self._path[:length]) if ending == FOUND else None
        return SearchResult(ending, expansions, cells)

    def order(self, start: Cell, goal: Cell) -> Cells | None:
        """The cells that :meth:`find_path` expands from either end, in its order; recomputed in plain Python.
        None: it would take too long."""
        board, n = self._board, self._board.size
        if meet_even.each * n > MOST_NS:
            return None
        f, ends = Writes(bytes(2 * n), -SPAN), (board.flat(start), board.flat(goal), -1, -SPAN)
        links = (np.empty_like(self._after), np.empty_like(self._before))
        kept = (np.empty_like(self._step), np.zeros_like(self._state), np.empty_like(self._path))
        meet_even.run_plain(board.free, board.stride, *ends, *self._rules, *links, f, *kept)
        taken = f.order()  # a cell that leaves is marked on both sides
        return board.cells(taken[taken < n][::-1].astype(np.int32))


class TwoTerrainSearches:
    """The same over terrain.

    Memory: 65 bytes a cell.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    terrain : uint8 (height, width); what cells cost to enter.
    moves : the step set, weighed.
    """

    def __init__(self, free: BoolGrid, terrain: ByteGrid, moves: Moves) -> None:
        check_limits(free, moves)
        self._scale = moves.scale
        self._board = PaddedMap(free.shape, moves.reach)
        n = self._board.size
        r = rules_of(moves, informed=True)
        self._rules = ReadOnly((*self._board.steps(r), frozen(r.cost // moves.scale), r.slope))
        self._weight = np.zeros(n, dtype=np.uint8)
        self._heaps = [(np.zeros(n + 1, dtype=np.int32), np.zeros(n, dtype=np.int32)) for _ in range(2)]
        self._costs = [(np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)) for _ in range(2)]
        self._seen = [np.zeros(n, dtype=np.int32) for _ in range(2)]
        self._step = np.empty(2 * n, dtype=np.int8)
        self._state = np.zeros(4, dtype=np.int64)
        self._path = np.empty(n, dtype=np.int32)
        self._runs = 0
        self.take(free, terrain)

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has no terrain."""
        if terrain is not None:
            self._board.lay(free, self._board.free)
            self._board.lay(terrain, self._weight)
        return terrain is not None

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """Cheapest path between two free cells while some cells (of the map) are closed."""
        if self._runs == 2**31 - 1:
            for seen in self._seen:
                seen.fill(0)
            self._runs = 0
        self._runs += 1
        board = self._board
        ground = (board.free, self._weight, self._scale, board.stride)
        ends = (board.flat(start), board.flat(goal), -1 if budget is None else budget, self._runs)
        one, two = zip(self._heaps, self._costs, self._seen, strict=True)
        sides = (*one[0], *one[1], one[2], *two[0], *two[1], two[2])
        with board.closing(closed):
            meet(*ground, *ends, *self._rules, *sides, self._step, self._state, self._path)
        ending, expansions, length, _ = self._state.tolist()
        cells = board.cells(self._path[:length]) if ending == FOUND else None
        return SearchResult(ending, expansions, cells)

    def order(self, start: Cell, goal: Cell) -> Cells | None:
        """The cells that :meth:`find_path` expands from either end, in its order; recomputed in plain Python.
        None: it would take too long."""
        board, n = self._board, self._board.size
        if meet.each * n > MOST_NS:
            return None
        ground = (board.free, self._weight, self._scale, board.stride)
        ends, seen = (board.flat(start), board.flat(goal), -1, 1), Writes(bytes(n), -1)
        sides = [
            [np.zeros_like(a) for a in (*heap, *costs)]
            for heap, costs in zip(self._heaps, self._costs, strict=True)
        ]
        kept = (np.empty_like(self._step), np.zeros_like(self._state), np.empty_like(self._path))
        meet.run_plain(
            *ground, *ends, *self._rules, *sides[0], seen, *sides[1], np.zeros_like(self._seen[1]), *kept
        )
        return board.cells(seen.order()[::-1].astype(np.int32))


def both_ends(free: BoolGrid, terrain: ByteGrid | None, moves: Moves) -> TwoSearches | TwoTerrainSearches:
    """The search from both ends that suits a map: by queues over plain ground, by heaps over terrain."""
    return TwoSearches(free, moves) if terrain is None else TwoTerrainSearches(free, terrain, moves)
