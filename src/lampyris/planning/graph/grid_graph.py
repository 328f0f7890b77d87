"""Searching a grid as a graph: step sets as the kernel reads them, and the arrays that one map keeps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import LimitError
from lampyris.kernels._jit import jit_disabled
from lampyris.kernels.graph.search import FOUND, SPAN, search
from lampyris.model.grid import MAX_TERRAIN, TERRAIN_UNIT, frozen
from lampyris.model.moves import PELL_P, Moves
from lampyris.model.plan import MapModel
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells, Floats

_Ints = NDArray[np.int64]

HEAVIEST = (TERRAIN_UNIT + MAX_TERRAIN) // TERRAIN_UNIT
"""What the heaviest terrain weighs, plain ground being 1."""
PLAIN_EXPANSIONS = 50_000
"""After so many in one session the compiled form pays: about half a second in the plain one."""


@dataclass(frozen=True, slots=True, eq=False)
class Rules:
    """A step set and a heuristic as the kernel reads them. Read-only.

    Parameters
    ----------
    dx, dy, cost : each step.
    via, across : int64 (steps, 2); the two cells a step touches on its way, as (dx, dy); (0, 0) for none.
    first, follow : the steps worth trying after each step, and last in the start; see the kernel.
    slope : coefficients of the heuristic, see :func:`lampyris.kernels.graph.search.search`.
    slot, shift, queues : from the raise of f to its queue.
    """

    dx: _Ints
    dy: _Ints
    cost: _Ints
    via: _Ints
    across: _Ints
    first: _Ints
    follow: _Ints
    slope: _Ints
    slot: _Ints
    shift: int
    queues: int


class ReadOnly(tuple[_Ints | int, ...]):
    """What a kernel reads of the rules: arrays that nobody writes into, and numbers.

    A copied planner shares them, and a pickled one has them read-only again: NumPy makes copied and pickled arrays
    writable, for which numba would compile the kernels once more.
    """

    __slots__ = ()

    def __deepcopy__(self, _: dict[int, Any]) -> ReadOnly:
        return self

    def __reduce__(self) -> tuple[Any, ...]:
        return _read_only, tuple(self)


def _read_only(*values: _Ints | int) -> ReadOnly:
    return ReadOnly(frozen(one) if isinstance(one, np.ndarray) else one for one in values)


@lru_cache(maxsize=32)
def rules_of(moves: Moves, informed: bool) -> Rules:
    """The rules of a step set, with the metric of its open plane as heuristic or with none."""
    touched = [_touched(dx, dy, moves.corner_cutting) for dx, dy in moves.offsets]
    following = following_of(moves)
    slope = metric_of(moves) if informed else (0, 0, 0, 0)
    raises = raises_of(moves, slope)
    if raises[0] < 0:
        # User-defined step costs, for which the metric is no bound: search without it.
        slope = (0, 0, 0, 0)
        raises = raises_of(moves, slope)
    # The widest shift that still tells all raises apart keeps the table small even for Pell numbers.
    shift = 0
    while len({r >> (shift + 1) for r in raises}) == len(raises) and raises[-1] >> shift:
        shift += 1
    slot = np.full((raises[-1] >> shift) + 1, -1, dtype=np.int64)
    for queue, r in enumerate(raises):
        slot[r >> shift] = queue

    def ints(values: object) -> _Ints:
        return frozen(np.array(values, dtype=np.int64))

    return Rules(
        dx=ints([o[0] for o in moves.offsets]),
        dy=ints([o[1] for o in moves.offsets]),
        cost=ints(moves.costs),
        via=ints([t[0] for t in touched]),
        across=ints([t[1] for t in touched]),
        first=ints(np.cumsum([0, *map(len, following)])),
        follow=ints([k for row in following for k in row]),
        slope=ints(slope),
        slot=frozen(slot),
        shift=shift,
        queues=len(raises),
    )


def _touched(dx: int, dy: int, corner_cutting: bool) -> tuple[Cell, Cell]:
    """The cells besides its ends that a step needs free."""
    if dx == 0 or dy == 0:
        return (0, 0), (0, 0)
    if abs(dx) == abs(dy):
        return ((0, 0), (0, 0)) if corner_cutting else ((dx, 0), (0, dy))
    # A knight's step leaves its cell through the middle of a side and arrives through the one opposite: the
    # segment touches the straight and the diagonal neighbour between the ends, and no others.
    sx, sy = (dx > 0) - (dx < 0), (dy > 0) - (dy < 0)
    return ((sx, 0) if abs(dx) > abs(dy) else (0, sy)), (sx, sy)


def following_of(moves: Moves) -> list[list[int]]:
    """Steps worth trying in a cell, by the step that led there; the last row is for the start, where all are.

    Two steps that come back to where they began, or that one step replaces at no more cost touching nothing
    that the two do not touch, are never needed: the cell before has already offered that one. Over terrain
    the one step pays for the last cell only, and must not cost more even where the cell between is plain
    ground and the last the heaviest.
    """
    lightest = 1 if moves.scale == 1 else HEAVIEST
    steps = list(zip(moves.offsets, moves.costs, strict=True))
    rows = []
    for (dx, dy), cost in steps:
        row = []
        for k, ((ex, ey), more) in enumerate(steps):
            through = {(0, 0), (dx, dy), *_touched(dx, dy, moves.corner_cutting)}
            through |= {(dx + x, dy + y) for x, y in _touched(ex, ey, moves.corner_cutting)}
            at_once = [
                c
                for (x, y), c in steps
                if (x, y) == (dx + ex, dy + ey) and through.issuperset(_touched(x, y, moves.corner_cutting))
            ]
            back = (dx + ex, dy + ey) == (0, 0)
            if not back and not any(lightest * c <= cost + lightest * more for c in at_once):
                row.append(k)
        rows.append(row)
    return [*rows, list(range(len(steps)))]


def metric_of(moves: Moves) -> tuple[int, int, int, int]:
    """Cost of the path between two cells of an open plane, as the greater of two linear forms in a >= b.

    a and b are the distances along the axes. The metric is a norm that no step is cheaper than, hence a
    consistent heuristic, and an exact one where there are no walls.
    """
    straight, diagonal, knight = moves.straight, moves.diagonal, moves.knight
    if knight:
        # Beyond two to one: knight's steps and straights; below: knight's steps and diagonals.
        return straight, knight - 2 * straight, knight - diagonal, 2 * diagonal - knight
    if diagonal:
        return straight, diagonal - straight, straight, diagonal - straight
    return straight, straight, straight, straight


def raises_of(moves: Moves, slope: tuple[int, int, int, int], around: int = 4) -> tuple[int, ...]:
    """Every amount by which a step can raise f = g + h, and 0, ascending.

    The forms are linear, so a raise depends only on the step and on which side of the lines a = b, a = 2b
    and the axes its ends lie; every case occurs within ``around`` steps' lengths of the goal.
    """

    def h(x: int, y: int) -> int:
        a, b = max(abs(x), abs(y)), min(abs(x), abs(y))
        return max(slope[0] * a + slope[1] * b, slope[2] * a + slope[3] * b)

    near = range(-around * moves.reach, around * moves.reach + 1)
    found = {0}
    for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True):
        found |= {cost + h(x + dx, y + dy) - h(x, y) for x in near for y in near}
    return tuple(sorted(found))


@dataclass(frozen=True, slots=True, eq=False)
class SearchResult:
    """What one search found.

    Parameters
    ----------
    ending : FOUND, EXHAUSTED or LIMIT of :mod:`lampyris.kernels.graph.search`.
    expansions : cells expanded.
    cells : int32 (n, 2), start first, or None if no path was found.
    waypoints : int32 or float64 (k, 2), the turning points of an any-angle path, both ends included, or None.
    pack_s : seconds spent on preparing the map since the answer before, where that is measured.
    model : the model of the map that was searched, where the planner shows one.
    """

    ending: int
    expansions: int
    cells: Cells | None
    waypoints: Cells | Floats | None = None
    pack_s: float | None = None
    model: MapModel | None = None


def check_limits(free: BoolGrid, moves: Moves) -> None:
    """Whether exact costs have room.

    Raises
    ------
    LimitError : more cells, or costlier steps, than that.
    """
    costliest = max(moves.costs) // moves.scale
    if free.size > MAX_CELLS or costliest > PELL_P:
        raise LimitError(
            "LIMIT",
            f"{free.size} cells with steps of {costliest}",
            allowed=f"at most {MAX_CELLS} cells and steps of {PELL_P}",
        )


def check_cells(cells: int) -> None:
    """Whether a map is no larger than planners are made for: they take 18 to 95 bytes a cell.

    Raises
    ------
    LimitError : it is.
    """
    if cells > MAX_CELLS:
        raise LimitError("LIMIT", f"{cells} cells", allowed=f"at most {MAX_CELLS} cells to plan on")


class PaddedMap:
    """A map in a border of blocked cells as wide as the longest step.

    Parameters
    ----------
    shape : height, width.
    reach : the longest step.
    """

    def __init__(self, shape: tuple[int, ...], reach: int) -> None:
        self._shape, self._pad = shape, reach
        self.stride = shape[1] + 2 * reach
        self.size = self.stride * (shape[0] + 2 * reach)
        self.free = np.zeros(self.size, dtype=np.uint8)

    def lay(self, values: NDArray[Any], flat: NDArray[Any]) -> None:
        """Write a whole map into its padded, flat form."""
        p, (height, width) = self._pad, self._shape
        flat.reshape(-1, self.stride)[p : p + height, p : p + width] = values

    def flat(self, cell: Cell) -> int:
        """Flat index of a cell."""
        return int((cell[1] + self._pad) * self.stride + cell[0] + self._pad)

    def cells(self, backwards: NDArray[np.int32]) -> Cells:
        """A path, goal first and flat, as cells, start first."""
        flat = backwards[::-1]
        return np.stack((flat % self.stride, flat // self.stride), axis=1) - np.int32(self._pad)

    @contextmanager
    def closing(self, cells: Iterable[Cell]) -> Iterator[None]:
        """Some cells (of the map) closed for a while."""
        indices = np.array([self.flat(c) for c in cells], dtype=np.int64)
        indices = indices[self.free[indices] != 0]
        self.free[indices] = 0
        try:
            yield
        finally:
            self.free[indices] = 1

    def steps(self, r: Rules) -> ReadOnly:
        """What every search reads of the rules: offset, via, across, dx, dy."""
        return _steps(r, self.stride)


def _steps(r: Rules, stride: int) -> ReadOnly:
    """See :meth:`PaddedMap.steps`."""
    jump = np.array([1, stride], dtype=np.int64)
    of = (np.stack((r.dx, r.dy), axis=1), r.via, r.across)
    at = [frozen(pairs @ jump) for pairs in of]  # bits: whole numbers
    return ReadOnly((*at, r.dx, r.dy))


@lru_cache(maxsize=32)
def _arguments(moves: Moves, informed: bool, stride: int) -> ReadOnly:
    """What :func:`lampyris.kernels.graph.search.search` reads of the rules."""
    r = rules_of(moves, informed)
    return ReadOnly((*_steps(r, stride), r.cost, r.first, r.follow, r.slope, r.slot, r.shift, r.queues))


class Reads(list[int]):
    """A list that writes down which of its values are read.

    Parameters
    ----------
    n : how many values it has, 0 each.
    """

    def __init__(self, n: int) -> None:
        super().__init__(bytes(n))
        self.seen: list[int] = []

    def __getitem__(self, k: Any) -> Any:
        self.seen.append(k)
        return super().__getitem__(k)

    def order(self, expansions: int) -> NDArray[np.int32]:
        """The cells expanded, last first: both kernels read the step into a cell twice when they expand it,
        and after that only along the path."""
        return np.array(self.seen[: 2 * expansions : 2][::-1], dtype=np.int32)


class GridSearch:
    """The arrays of one map, searched as often as one likes.

    Memory: 18 bytes a cell, of which a search touches only the cells that it meets.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    moves : the step set.
    informed : whether :meth:`find_path` is led by the metric of the open plane.

    Raises
    ------
    LimitError : more cells, or costlier steps, than exact costs have room for.
    """

    def __init__(self, free: BoolGrid, moves: Moves, *, informed: bool) -> None:
        check_limits(free, moves)
        self._board = PaddedMap(free.shape, moves.reach)
        n = self._board.size
        led, blind = rules_of(moves, informed), rules_of(moves, False)
        stride = self._board.stride
        self._led, self._blind = (_arguments(moves, one, stride) for one in (informed, False))
        ends = max(led.queues, blind.queues)
        self._after = np.empty(n + ends, dtype=np.int32)
        self._before = np.empty(n + ends, dtype=np.int32)
        self._f = np.zeros(n, dtype=np.int64)
        self._step = np.empty(n, dtype=np.int8)
        self._result = np.zeros(4, dtype=np.int64)
        self._base = 0
        self._spent = 0
        self.set_free(free)

    def set_free(self, free: BoolGrid) -> None:
        """Take a whole new free space of the same shape."""
        self._board.lay(free, self._board.free)

    def take(self, free: BoolGrid, terrain: ByteGrid | None) -> bool:
        """Take a new ground of the same shape; False, and nothing done, if it has terrain."""
        if terrain is None:
            self.set_free(free)
        return terrain is None

    def find_path(
        self, start: Cell, goal: Cell, budget: int | None = None, closed: Iterable[Cell] = ()
    ) -> SearchResult:
        """Cheapest path between two free cells while some cells (of the map) are closed."""
        with self._board.closing(closed):
            return self._run(self._led, self._board.flat(start), self._board.flat(goal), budget)

    def order(self, start: Cell, goal: Cell) -> Cells:
        """The cells that :meth:`find_path` expands, in its order; recomputed in plain Python."""
        board, n = self._board, self._board.size
        links = (np.empty_like(self._after), np.empty_like(self._after))
        step, result = Reads(n), np.zeros(4, dtype=np.int64)
        ends = (board.flat(start), board.flat(goal), -1, -SPAN)
        scratch = (*links, np.zeros(n, dtype=np.int64), step, result)
        search.run_plain(board.free, board.stride, *ends, *self._led, *scratch)
        return board.cells(step.order(int(result[1])))

    def region(self, cell: Cell, budget: int | None = None) -> SearchResult:
        """How many cells can be reached from a free cell, itself included: the expansions of the answer."""
        return self._run(self._blind, self._board.flat(cell), -1, budget)

    def _run(self, rules: ReadOnly, start: int, goal: int, budget: int | None) -> SearchResult:
        if self._base < -(2**63) + 2 * SPAN:
            self._f.fill(0)
            self._base = 0
        self._base -= SPAN
        if self._spent > PLAIN_EXPANSIONS and not jit_disabled():
            search.compiled()
        limit = -1 if budget is None else budget
        scratch = (self._after, self._before, self._f, self._step, self._result)
        board = self._board
        search(board.free, board.stride, start, goal, limit, self._base, *rules, *scratch)
        ending, expansions, length, _ = self._result.tolist()
        self._spent += expansions
        cells = board.cells(self._after[:length]) if ending == FOUND else None
        return SearchResult(ending, expansions, cells)
