"""Jump point search over one map: its bits, packed and repaired, and the arrays that a search needs."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels import loading
from lampyris.kernels.graph.bits import turn_bits
from lampyris.kernels.graph.jps import FOUND, FULL, jump, unroll
from lampyris.model.grid import frozen
from lampyris.model.moves import Moves
from lampyris.planning.graph.expanded import MOST_NS, Writes
from lampyris.planning.graph.grid_graph import ReadOnly, SearchResult, check_limits
from lampyris.planning.graph.session import PathSearch
from lampyris.planning.graph.terrain_graph import search_of
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells

_Words = NDArray[np.uint64]
_Ints = NDArray[np.int64]

_STEPS = ((1, 0), (0, 1), (-1, 0), (0, -1), (1, 1), (-1, 1), (-1, -1), (1, -1))
"""East, south, west, north, south-east, south-west, north-west, north-east: the kernel's directions."""

FIRST_NODES = 64
"""Room for so many jump points at first, and one in 8 cells. Few maps have more; a search that runs out of
room is run again. What is not used costs nothing when compiled; the plain form turns arrays into lists.
"""


def can_jump(moves: Moves) -> bool:
    """Whether the pruning rules hold: all eight unit steps, every one of a kind at one price, plain ground.

    The proof in :mod:`lampyris.kernels.graph.jps` needs a straight below a diagonal below two straights.
    """
    price = dict(zip(moves.offsets, moves.costs, strict=True))
    if set(price) != set(_STEPS) or moves.scale != 1:
        return False
    straight, diagonal = ({price[s] for s in some} for some in (_STEPS[:4], _STEPS[4:]))
    return len(straight) == len(diagonal) == 1 and min(straight) < min(diagonal) < 2 * min(straight)


class PackedMap:
    """Where runs have to stop, 64 cells a word, by row and by column, for one corner rule.

    Memory: 6 bits a cell, rows and columns rounded up to whole words.

    Parameters
    ----------
    free : bool (height, width).
    cutting : whether diagonals may cut corners.
    """

    def __init__(self, free: BoolGrid, cutting: bool) -> None:
        height, width = free.shape
        self._cutting = cutting
        in_row, in_column = _words_for(width), _words_for(height)
        row, column = (height + 2) * in_row, (width + 2) * in_column
        self.words: _Words = np.empty(3 * row + 2 * column, dtype=np.uint64)
        """Rows of walls, of stops to the east and west; then columns of stops to the south and north."""
        self.stride, self.rise = 64 * in_row, 64 * in_column
        self.east, self.west = 64 * row, 128 * row
        self.south, self.north = 192 * row, 192 * row + 64 * column
        self.columns: _Words = np.empty(column, dtype=np.uint64)
        """Columns of walls."""
        for sheets, cells in zip(self.sheets, (free, free.T), strict=True):
            sheets[0][:] = _packed(cells)
            self._mark(sheets, np.arange(1, len(sheets[0]) - 1))

    @property
    def sheets(self) -> tuple[list[_Words], list[_Words]]:
        """Rows, then columns: walls, stops onwards, stops backwards; a line is a row of the array. Views."""
        row, column = self.east // 64, len(self.columns)
        in_row, in_column = self.stride // 64, self.rise // 64
        rows = [self.words[k * row : (k + 1) * row].reshape(-1, in_row) for k in range(3)]
        behind = self.words[3 * row :]
        stops = [behind[k * column : (k + 1) * column].reshape(-1, in_column) for k in range(2)]
        return rows, [self.columns.reshape(-1, in_column), *stops]

    def _mark(self, sheets: list[_Words], lines: _Ints) -> None:
        """Find the stops of some lines again."""
        walls, onward, backward = sheets
        onward[lines] = backward[lines] = walls[lines]
        for beside in (walls[lines - 1], walls[lines + 1]):
            before, behind = _shifted(beside)
            if self._cutting:
                onward[lines] |= beside & ~behind
                backward[lines] |= beside & ~before
            else:
                onward[lines] |= before & ~beside
                backward[lines] |= behind & ~beside

    def edit(self, x: _Ints, y: _Ints) -> None:
        """Turn cells of the map, each named once, from blocked to free or from free to blocked.

        Stops are found again in the words that hold the cell or a neighbour of it, in its line and the two beside it.
        """
        turn_bits(
            self.words, self.columns, self.east, self.west, self.south, self.north, self.stride, self.rise,
            int(self._cutting), np.ascontiguousarray(x), np.ascontiguousarray(y),
        )  # fmt: skip


def _differing(one: BoolGrid, other: BoolGrid) -> _Ints:
    """Flat indices of the cells at which two maps of one shape differ: eight cells are compared at once."""
    one, other = (np.ascontiguousarray(free).reshape(-1) for free in (one, other))
    even = one.size & ~7
    words = np.flatnonzero(one[:even].view(np.uint64) != other[:even].view(np.uint64))
    if not len(words) and even == one.size:
        return words
    near = (8 * words[:, None] + np.arange(8)).ravel()
    near = np.concatenate((near, np.arange(even, one.size)))
    changed: _Ints = near[one[near] != other[near]]
    return changed


def _words_for(cells: int) -> int:
    """Words for a line of cells and its border."""
    return (cells + 2 + 63) // 64


def _packed(free: BoolGrid) -> _Words:
    """Lines of bits, 1 for blocked, within a border of ones; what is left of the last word is blocked."""
    lines, length = free.shape
    shut = np.ones((lines + 2, 64 * _words_for(length)), dtype=np.bool_)
    np.logical_not(free, out=shut[1:-1, 1 : length + 1])
    words: _Words = np.packbits(shut, axis=1, bitorder="little").view("<u8").astype(np.uint64, copy=False)
    return words


def _shifted(lines: _Words) -> tuple[_Words, _Words]:
    """For each bit the one before it, and the one behind it."""
    one, top = np.uint64(1), np.uint64(63)
    before, behind = lines << one, lines >> one
    before[:, 1:] |= lines[:, :-1] >> top
    behind[:, :-1] |= lines[:, 1:] << top
    return before, behind


class JumpSearch:
    """The arrays of one map, searched as often as one likes, by moves that :func:`can_jump`.

    Memory: 4 bytes a cell, 64 for each jump point of the largest search, and see :class:`PackedMap`.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    moves : the step set.
    """

    def __init__(self, free: BoolGrid, moves: Moves) -> None:
        check_limits(free, moves)
        self._moves = moves
        height, width = free.shape
        n = (height + 2) * (width + 2)
        sides = moves.corner_cutting
        self._cutting = int(sides)
        price = dict(zip(moves.offsets, moves.costs, strict=True))
        self._prices = (price[_STEPS[0]], price[_STEPS[4]])
        self._tables = ReadOnly((frozen(np.array(_STEPS, dtype=np.int64).ravel()), _turns(sides)))
        self._found = np.empty(36 + (64 if sides else 32) * min(free.shape), dtype=np.int64)
        self._node = np.empty(n, dtype=np.int32)
        self._state = np.zeros(5, dtype=np.int64)
        self._room(min(n, FIRST_NODES + n // 8))
        began = loading.wall()
        self._free = free
        self.packed = PackedMap(free, sides)
        self._pack_s = loading.wall() - began

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has terrain.

        Cells that differ are repaired; many are packed again.
        """
        if terrain is not None:
            return False
        began = loading.wall()
        changed = _differing(free, self._free)
        self._free = free
        if len(changed) > sum(free.shape):
            self.packed = PackedMap(free, self._moves.corner_cutting)
        elif len(changed):
            y, x = np.divmod(changed, free.shape[1])
            self.packed.edit(x, y)
        self._pack_s += loading.wall() - began
        return True

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """Cheapest path between two free cells while some cells (of the map) are closed.

        ``expansions`` are jump points, ``pack_s`` what packing and repairing took since the answer before.
        """
        shut = sorted({c for c in closed if self._free[c[1], c[0]]})
        self._turn(shut)
        try:
            return self._run(start, goal, budget)
        finally:
            self._turn(shut)

    def order(self, start: Cell, goal: Cell) -> Cells | None:
        """The jump points that :meth:`find_path` expands, in its order; recomputed in plain Python.
        None: it would take too long."""
        m, (height, width) = self.packed, self._free.shape
        n = (height + 2) * (width + 2)
        if jump.each * n > MOST_NS:
            return None
        # A node that leaves the heap has no place in it any more: -1 as its last number. As many nodes as cells are enough.
        nodes = Writes([-1] * (6 * n), -1)
        ends = (start[0] + 1, start[1] + 1, goal[0] + 1, goal[1] + 1, -1)
        kept = (
            np.zeros_like(self._found),
            np.zeros_like(self._node),
            nodes,
            np.zeros(2 * n, dtype=np.int64),
            np.zeros_like(self._state),
        )
        jump.run_plain(
            m.words, m.east, m.south, m.west, m.north, m.stride, m.rise, width + 2, *ends, *self._prices,
            self._cutting, *self._tables, *kept,
        )  # fmt: skip
        taken = [k - 5 for k in nodes.changed if k % 6 == 5]
        return np.array([(nodes[k] - 1, nodes[k + 1] - 1) for k in taken], dtype=np.int32).reshape(-1, 2)

    def _turn(self, cells: list[Cell]) -> None:
        """Make free cells blocked, or those free again."""
        if cells:
            began = loading.wall()
            x, y = np.array(cells, dtype=np.int64).T
            self.packed.edit(x, y)
            self._pack_s += loading.wall() - began

    def _room(self, nodes: int) -> None:
        """Make room for so many jump points."""
        self._nodes = np.empty(6 * nodes, dtype=np.int64)
        self._heap = np.empty(2 * nodes, dtype=np.int64)

    def _run(self, start: Cell, goal: Cell, budget: int | None) -> SearchResult:
        m = self.packed
        height, width = self._free.shape
        ends = (start[0] + 1, start[1] + 1, goal[0] + 1, goal[1] + 1, -1 if budget is None else budget)
        while True:
            jump(
                m.words, m.east, m.south, m.west, m.north, m.stride, m.rise, width + 2, *ends, *self._prices,
                self._cutting, *self._tables, self._found, self._node, self._nodes, self._heap, self._state,
            )  # fmt: skip
            ending, expansions, length, _, last = self._state.tolist()
            if ending != FULL:
                break
            # As many as there are cells are always enough.
            self._room(min((height + 2) * (width + 2), len(self._nodes)))
        pack_s, self._pack_s = self._pack_s, 0.0
        if ending != FOUND:
            return SearchResult(ending, expansions, None, pack_s=pack_s)
        path = np.empty(2 * length, dtype=np.int32)
        unroll(self._nodes, ends[2], ends[3], last, path)
        return SearchResult(ending, expansions, path.reshape(-1, 2)[::-1], pack_s=pack_s)


def _turns(cutting: bool) -> _Ints:
    """Which directions a straight run has to follow when it meets a turn, on either of its sides, as bits.

    First the turn to the south or east, then that to the north or west, for each straight. The diagonal
    always; where corners may not be cut also the straight across.
    """
    bits = []
    for dx, dy in _STEPS[:4]:
        for side in (1, -1):
            across = (0, side) if dx else (side, 0)
            slant = (dx + across[0], dy + across[1])
            bits.append(1 << _STEPS.index(slant) | (0 if cutting else 1 << _STEPS.index(across)))
    return frozen(np.array(bits, dtype=np.int64))


def jump_search(free: BoolGrid, terrain: ByteGrid | None, moves: Moves) -> PathSearch:
    """Jump point search where it can be, A* elsewhere."""
    if terrain is None and can_jump(moves):
        return JumpSearch(free, moves)
    return search_of(free, terrain, moves)
