"""Any-angle search over one map: straight lines between cell centres, and a walk along them."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.graph.any_angle import CUT, FOUND, TOUCH, WIDE, follow, theta
from lampyris.model.moves import Moves
from lampyris.planning.graph.expanded import MOST_NS, Writes
from lampyris.planning.graph.grid_graph import PaddedMap, SearchResult, check_limits, rules_of
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells


class AnyAngleMap:
    """Straight lines between cell centres on one map, and walks along them.

    ``rule`` says what its lines of sight need: CUT, TOUCH or WIDE.

    Memory: 1 byte a cell.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    moves : the step set.
    wide : whether the robot has a size, so that lines need room on either side.

    Raises
    ------
    LimitError : more cells, or costlier steps, than exact costs have room for.
    """

    def __init__(self, free: BoolGrid, moves: Moves, *, wide: bool) -> None:
        check_limits(free, moves)
        self._board = PaddedMap(free.shape, moves.reach)
        slanting = any(dx and dy for dx, dy in moves.offsets)
        cutting = slanting and moves.corner_cutting
        self.rule = WIDE if wide else CUT if cutting else TOUCH
        self._diagonals = 2 if cutting else int(slanting)
        self.lay(free)

    def lay(self, free: BoolGrid) -> None:
        """Take other free cells of the same shape."""
        self._board.lay(free, self._board.free)

    def along(self, points: Cells, closed: Iterable[Cell] = ()) -> tuple[Cells, Cells]:
        """The walk along lines of sight between cells, start first, and the cells at which the lines turn."""
        board = self._board
        chain = np.array([board.flat((int(x), int(y))) for x, y in points[::-1].tolist()], dtype=np.int32)
        with board.closing(closed):
            walk = board.cells(self._walk(chain)[::-1])
        return walk, _turns(points)

    def _walk(self, chain: NDArray[np.int32]) -> NDArray[np.int32]:
        """Flat cells, start first, along the lines of a chain, goal first."""
        board = self._board
        y, x = np.divmod(chain[::-1].astype(np.int64), board.stride)
        room = 1 + int(np.abs(np.diff(x)).sum() + np.abs(np.diff(y)).sum())
        path = np.empty(room, dtype=np.int32)
        count = int(follow(board.free, board.stride, x, y, self._diagonals, path))
        return path[:count]


class AnyAngleSearch(AnyAngleMap):
    """The arrays of one map, searched as often as one likes.

    Memory: 45 bytes a cell.

    Parameters
    ----------
    free, moves, wide : see :class:`AnyAngleMap`; the moves are weighed where there is terrain.
    terrain : uint8 (height, width), or None.
    lazy : 0 to look along lines at once, 1 when their ends are expanded, 2 to put those ends back that
        are not seen; see :func:`lampyris.kernels.graph.any_angle.theta`.

    Raises
    ------
    LimitError : more cells, or costlier steps, than exact costs have room for.
    """

    def __init__(
        self, free: BoolGrid, terrain: ByteGrid | None, moves: Moves, *, wide: bool, lazy: int
    ) -> None:
        super().__init__(free, moves, wide=wide)
        n = self._board.size
        self._steps = self._board.steps(rules_of(moves, informed=False))
        self._lazy = lazy
        self._even = terrain is None
        self._weight = np.zeros(1 if terrain is None else n, dtype=np.uint8)
        self._heap = np.zeros(n + 1, dtype=np.int32)
        self._place = np.zeros(n, dtype=np.int32)
        self._costs = [np.empty(n, dtype=np.float64) for _ in range(3)]
        self._seen = np.zeros(n, dtype=np.int32)
        self._parent = np.empty(n, dtype=np.int32)
        self._chain = np.empty(n, dtype=np.int32)
        self._result = np.zeros(3, dtype=np.int64)
        self._runs = 0
        if terrain is not None:
            self._board.lay(terrain, self._weight)

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if terrain has come or gone."""
        if (terrain is None) != self._even:
            return False
        self.lay(free)
        if terrain is not None:
            self._board.lay(terrain, self._weight)
        return True

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """A short path between two free cells while some cells (of the map) are closed."""
        if self._runs == 2**31 - 1:
            self._seen.fill(0)
            self._runs = 0
        self._runs += 1
        board = self._board
        ground = (board.free, self._weight, 0 if self._even else -1, board.stride)
        ends = (board.flat(start), board.flat(goal), -1 if budget is None else budget, self._runs)
        rules = (*self._steps, self.rule, self._lazy)
        scratch = (self._heap, self._place, *self._costs, self._seen, self._parent, self._chain, self._result)
        with board.closing(closed):
            theta(*ground, *ends, *rules, *scratch)
            ending, expansions, points = self._result.tolist()
            if ending != FOUND:
                return SearchResult(ending, expansions, None)
            chain = self._chain[:points]
            cells = board.cells(self._walk(chain)[::-1])
        turns = board.cells(chain)
        return SearchResult(ending, expansions, cells, waypoints=_turns(turns) if self._even else turns)

    def order(self, start: Cell, goal: Cell) -> Cells | None:
        """The cells that :meth:`find_path` expands, in its order; recomputed in plain Python. None: it would take too long."""
        board, n = self._board, self._board.size
        if theta.each * n > MOST_NS:
            return None
        seen, result = Writes(bytes(n), -1), np.zeros(3, dtype=np.int64)
        ground = (board.free, self._weight, 0 if self._even else -1, board.stride)
        ends = (board.flat(start), board.flat(goal), -1, 1)
        scratch = (np.zeros_like(self._heap), np.zeros_like(self._place), *(np.zeros(n) for _ in range(3)))
        kept = (np.zeros_like(self._parent), np.zeros_like(self._chain), result)
        theta.run_plain(*ground, *ends, *self._steps, self.rule, self._lazy, *scratch, seen, *kept)
        # The goal is marked as well when it is taken, but not expanded.
        return board.cells(seen.order()[: int(result[1])][::-1].astype(np.int32))


def _turns(points: NDArray[np.int32]) -> NDArray[np.int32]:
    """The same lines without points at which they go straight on."""
    if len(points) < 3:
        return points
    d = points[1:].astype(np.int64) - points[:-1]
    before, after = d[:-1], d[1:]
    corners = before[:, 0] * after[:, 1] != before[:, 1] * after[:, 0]
    return points[np.concatenate(([True], corners, [True]))]
