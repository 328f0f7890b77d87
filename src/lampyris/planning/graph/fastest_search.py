"""Which exact search suits a map, and the field as one of them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.graph.search import EXHAUSTED, FOUND
from lampyris.kernels.graph.trail import trail
from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.planning.field.solve import fill
from lampyris.planning.graph.grid_graph import SearchResult
from lampyris.planning.graph.jps_search import JumpSearch, PackedMap, can_jump
from lampyris.planning.graph.session import PathSearch
from lampyris.planning.graph.terrain_graph import search_of
from lampyris.typing import BoolGrid, ByteGrid, Cell

CROWDED = 1.22
"""Stops of runs for each free cell beyond which the field is quicker than jump points, corners not cut."""
CROWDED_CUTTING = 0.3
"""The same where corners may be cut, and then A* is quicker, too."""
NARROW = 0.55
"""Share of free cells below which a cluttered map is taken for one of narrow corridors, corners cut."""


def suited(free: BoolGrid, terrain: ByteGrid | None, moves: Moves) -> PathSearch:
    """The search that is quickest on such maps; see :class:`lampyris.planning.graph.fastest.Fastest`."""
    if terrain is not None or not can_jump(moves):
        return search_of(free, terrain, moves)
    jumps = JumpSearch(free, moves)
    stop_density = stops(jumps.packed) / max(1, int(np.count_nonzero(free)))
    if not moves.corner_cutting:
        return FieldSearch(free, moves, jumps) if stop_density > CROWDED else jumps
    if stop_density <= CROWDED_CUTTING:
        return jumps
    narrow = np.count_nonzero(free) < NARROW * free.size
    return FieldSearch(free, moves, jumps) if narrow else search_of(free, None, moves)


def stops(packed: PackedMap) -> int:
    """Free cells at which runs along rows stop, and those at which runs along columns do, added up."""
    count = 0
    for walls, onward, backward in packed.sheets:
        open_stops = (onward[1:-1] | backward[1:-1]) & ~walls[1:-1]
        count += int(_ones()[open_stops.view(np.uint16)].sum(dtype=np.int64))
    return count


@cache
def _ones() -> NDArray[np.uint8]:
    """Bits set in every 16-bit number."""
    ones = np.zeros(1, dtype=np.uint8)
    for _ in range(16):
        ones = np.concatenate((ones, ones + np.uint8(1)))
    return frozen(ones)


class FieldSearch:
    """Paths read off the field of the goal, solved as far as the start, at every call.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    moves : the step set.
    other : searches where the budget is too small for a field.
    """

    def __init__(self, free: BoolGrid, moves: Moves, other: JumpSearch) -> None:
        self._moves = moves
        self._other = other
        self._free = free
        self._cells = int(np.count_nonzero(free))
        self._path = np.empty(free.size, dtype=np.int32)

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has terrain."""
        if not self._other.take(free, terrain):
            return False
        self._free = free
        self._cells = int(np.count_nonzero(free))
        return True

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """Cheapest path between two free cells while some cells (of the map) are closed."""
        if budget is not None and budget < self._cells:
            return self._other.find_path(start, goal, budget, closed)
        open_now = self._free
        shut = np.array(list(closed), dtype=np.int64).reshape(-1, 2)
        if len(shut):
            open_now = self._free.copy()
            open_now[shut[:, 1], shut[:, 0]] = False
            frozen(open_now)  # to numba an array that can be written is of another type
        shares = (0.5, 0.5, float(self._moves.unit))  # Nobody looks at the luciferin.
        frame, (_, cost, step), count = fill(open_now, None, self._moves, goal, shares, stop=start)
        at = frame.index(start)
        if cost[at] < 0:
            return SearchResult(EXHAUSTED, count, None)
        jump, _, _ = frame.table(self._moves)
        length = trail(step, jump, at, self._path)
        y, x = np.divmod(self._path[:length], np.int32(frame.width))
        cells = np.stack((x, y), axis=1) - np.int32(frame.pad)
        return SearchResult(FOUND, count, cells)
