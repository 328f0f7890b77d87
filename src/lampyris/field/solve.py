"""Solve: from free cells and a goal to the field (method.md section 2).

Everything is laid out once in a padded frame, a border of walls as wide as the longest step, so that the
kernels need no bounds. The Field's arrays are read-only views of the inside of that frame.
"""

from __future__ import annotations

import math
import threading
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import LimitError, SceneError, SettingError
from lampyris.field.gates import gate_mask
from lampyris.field.layers import free_space, moves_for
from lampyris.kernels import descent, wavefront
from lampyris.model.field import Field
from lampyris.model.grid import frozen
from lampyris.model.moves import MOVES, PELL_Q, Moves
from lampyris.model.scene import Scene
from lampyris.typing import BoolGrid, Cell, Floats

_EIGHT = MOVES["octile"].offsets
_AHEAD = 25
"""How far past the end of the list of cells the kernels may look ahead."""
_SCRATCH_BYTES = 64 << 20
"""Largest scratch kept from call to call: on some machines fresh memory costs more than the wavefront."""


def solve_field(scene: Scene, *, rho: float = 0.4, gamma: float = 0.6, gates: str = "ignore") -> Field:
    """The field of a scene: cost-to-goal, parent and luciferin of every cell that can reach the goal.

    Parameters
    ----------
    rho, gamma : luciferin decay, 0 < rho <= 1, and enhancement, > 0.
    gates : ``ignore``, or ``close`` to seal openings too narrow for the robot (never the start or the goal).

    Raises
    ------
    SettingError : a setting out of its range.
    """
    if gates not in ("ignore", "close"):
        raise SettingError("GATES", f"{gates!r}", where="gates", allowed="ignore, close")
    free = free_space(scene)
    if gates == "close":
        closed = gate_mask(scene.grid, scene.robot).copy()
        for x, y in (scene.start, scene.goal):
            closed[y, x] = False
        free = frozen(free & ~closed)
    return solve(free, moves_for(scene), scene.goal, rho=rho, gamma=gamma)


def solve(
    free: BoolGrid,
    moves: Moves,
    goal: Cell,
    *,
    rho: float = 0.4,
    gamma: float = 0.6,
    stop: Cell | None = None,
    revision: int = 0,
) -> Field:
    """The field over free cells. A blocked goal gives a field without a cost anywhere.

    Parameters
    ----------
    free : bool, (height, width); where the robot's centre may be. Copied unless it is read-only.
    moves : the step set; steps are legal as :class:`lampyris.model.moves.Moves` says.
    goal : x, y.
    rho, gamma : luciferin decay, 0 < rho <= 1, and enhancement, > 0. Luciferin is a float64 recursion along
        parents, of ``exact / moves.unit`` (for octile moves q + p sqrt 2 to within rounding: p / q differs
        from sqrt 2 by less).
    stop : a cell; the field then holds just the cells that cost no more than it. A cell that cannot be
        reached: all.
    revision : how many Changes went into ``free``.

    Raises
    ------
    SettingError : rho or gamma out of its range, a step set that no wavefront can serve.
    SceneError : a goal outside the map.
    LimitError : more cells than exact octile costs can tell apart.
    """
    _check(rho, gamma)
    free = _own(free)
    height, width = free.shape
    if not (0 <= goal[0] < width and 0 <= goal[1] < height):
        raise SceneError(
            "GOAL_OUTSIDE",
            f"goal {goal} is outside the map",
            allowed=f"x 0 to {width - 1}, y 0 to {height - 1}",
        )
    goal = (int(goal[0]), int(goal[1]))
    frame = _Frame(free, moves)
    # One block, not three: freed and asked for again it comes back without the pages being faulted in anew.
    n = frame.size
    _, (luciferin, cost, step) = _carve(None, (n, np.float64), (n, frame.dtype), (n, np.int8))
    step.fill(-1)
    count = 0
    if free[goal[1], goal[0]]:
        until = 0
        if stop is not None and 0 <= stop[0] < width and 0 <= stop[1] < height and free[stop[1], stop[0]]:
            until = frame.index(stop)
        count = _Wave(frame, free, moves, frame.index(goal), until).run(
            cost, step, luciferin, (1.0 - rho, float(gamma), float(moves.unit))
        )
    else:
        cost.fill(-1)
        luciferin.fill(np.inf)
    return Field(
        free=free,
        exact=frame.inside(cost),
        step=frame.inside(step),
        luciferin=frame.inside(luciferin),
        goal=goal,
        moves=moves,
        rho=rho,
        gamma=gamma,
        revision=revision,
        expansions=int(count),
    )


class _Frame:
    """A map with its border of walls: sizes, indices and views."""

    def __init__(self, free: BoolGrid, moves: Moves) -> None:
        self.pad = moves.reach
        self.rows: int = free.shape[0] + 2 * self.pad
        self.width: int = free.shape[1] + 2 * self.pad
        self.size = self.width * self.rows
        most = max(moves.costs)
        if moves.unit == PELL_Q and free.size >= PELL_Q:
            raise LimitError("LIMIT", f"{free.size} cells", allowed=f"fewer than {PELL_Q} with octile moves")
        # A path visits a cell once, so no cost exceeds the longest step at every cell.
        self.never: int = 2**30 if most * self.size < 2**30 else 2**62
        self.dtype: Any = np.int32 if self.never == 2**30 else np.int64

    def index(self, cell: Cell) -> int:
        """Index of a cell in the padded map."""
        return (cell[1] + self.pad) * self.width + cell[0] + self.pad

    def inside(self, flat: NDArray[Any]) -> NDArray[Any]:
        """The map without its border, read-only."""
        p = self.pad
        return frozen(flat.reshape(self.rows, self.width)[p : self.rows - p, p : self.width - p])

    def table(self, moves: Moves) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
        """Index offsets of each step's end and of the two cells that must be free besides."""
        return _table(moves.offsets, moves.corner_cutting, self.width)


@lru_cache(maxsize=64)
def _table(
    offsets: tuple[tuple[int, int], ...], cutting: bool, width: int
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """See :meth:`_Frame.table`.

    The segment of a knight's step (2, 1) leaves its cell through the middle half of one side, crosses the
    border between the straight cell (1, 0) and the diagonal cell (1, 1) at its midpoint, and enters the
    last cell likewise: it touches those two cells, no corner and nothing else.
    """
    jump, side, other = [], [], []
    for dx, dy in offsets:
        end = dy * width + dx
        if abs(dx * dy) == 2:
            x, y = int(math.copysign(1, dx)), int(math.copysign(1, dy))
            first = x if abs(dx) == 2 else y * width
            sides = (first, y * width + x)
        elif dx and dy and not cutting:
            sides = (dx, dy * width)
        else:
            sides = (end, end)
        jump.append(end)
        side.append(sides[0])
        other.append(sides[1])
    return np.array(jump, np.int64), np.array(side, np.int64), np.array(other, np.int64)


@dataclass(frozen=True, slots=True)
class _Wave:
    """One run of the wavefront that suits the moves, with parents and luciferin. ``stop``: 0 for never."""

    frame: _Frame
    free: BoolGrid
    moves: Moves
    goal: int
    stop: int

    def run(
        self,
        cost: NDArray[Any],
        step: NDArray[np.int8],
        luciferin: Floats,
        shares: tuple[float, float, float],
    ) -> int:
        """Fill the three maps; how many cells were settled. ``shares``: 1 - rho, gamma, unit."""
        moves = self.moves
        a, b = moves.unit, moves.diagonal
        if moves.offsets != _EIGHT or moves.costs != (b,) * 4 + (a,) * 4 or not a < b <= 2 * a:
            return self._ripple(cost, step, luciferin, shares)
        if moves.corner_cutting and self.frame.dtype is np.int32:
            return self._two_heads(cost, step, luciferin, shares)
        return self._windows(cost, step, luciferin, shares)

    def _two_heads(
        self,
        cost: NDArray[Any],
        step: NDArray[np.int8],
        luciferin: Floats,
        shares: tuple[float, float, float],
    ) -> int:
        frame, a, b, n = self.frame, self.moves.unit, self.moves.diagonal, self.frame.size
        fresh, order, *levels = _SCRATCH.take(
            (n, np.uint8), (n + _AHEAD, np.uint32), (n + 1, np.uint32), (n + 1, np.uint32)
        )
        width, rows = frame.width, frame.rows
        many = wavefront.two_heads(
            self._rooms, cost, fresh, order, *levels, width, self.goal, self.stop, a, b, frame.never
        )
        descent.parents8(cost, step, width, rows, a, b, 0, frame.never - 1)
        descent.glow_levels(order, *levels, many, step, self._jump, luciferin, np.inf, *shares)
        return int(levels[1][many - 1])

    def _windows(
        self,
        cost: NDArray[Any],
        step: NDArray[np.int8],
        luciferin: Floats,
        shares: tuple[float, float, float],
    ) -> int:
        frame, a, b, n = self.frame, self.moves.unit, self.moves.diagonal, self.frame.size
        order, toll = _SCRATCH.take((2 * n + 2 + _AHEAD, np.uint32), (n + 1, frame.dtype))
        guard = 0 if self.moves.corner_cutting else -1
        width, rows = frame.width, frame.rows
        count = wavefront.windows(
            self._rooms, cost, order, toll, n + 1, width, self.goal, self.stop, a, b, guard, frame.never
        )
        descent.parents8(cost, step, width, rows, a, b, guard, self._limit(cost))
        descent.glow(order, toll, count, step, self._jump, luciferin, np.inf, *shares)
        return int(count)

    def _ripple(
        self,
        cost: NDArray[Any],
        step: NDArray[np.int8],
        luciferin: Floats,
        shares: tuple[float, float, float],
    ) -> int:
        frame, n, costs = self.frame, self.frame.size, self.moves.costs
        least = min(costs)
        if not 0 < least <= max(costs) < 3 * least:
            allowed = "positive, the greatest below three times the least"
            raise SettingError("MOVES", f"costs {costs}", allowed=allowed)
        lists = (3 * n + 3 + _AHEAD, np.uint32)
        order, toll, ends = _SCRATCH.take(lists, (n + 1, frame.dtype), (3, np.uint64))
        table = (*frame.table(self.moves), np.array(costs, dtype=frame.dtype))
        width, rows, pad = frame.width, frame.rows, frame.pad
        count = wavefront.ripple(
            self._rooms, cost, order, toll, ends, n + 1, *table, width, pad, self.goal, self.stop, least,
            frame.never,
        )  # fmt: skip
        descent.parents(cost, step, width, rows, pad, *table, self._limit(cost))
        descent.glow(order, toll, count, step, self._jump, luciferin, np.inf, *shares)
        return int(count)

    @property
    def _rooms(self) -> NDArray[np.uint8]:
        return self.free.view(np.uint8).ravel()

    @property
    def _jump(self) -> NDArray[np.int64]:
        return self.frame.table(self.moves)[0]

    def _limit(self, cost: NDArray[Any]) -> int:
        """The greatest cost that is final."""
        found, never = int(cost[self.stop]), self.frame.never
        return found if self.stop > 0 and found < never else never - 1


Wanted = tuple[int, Any]
"""Length and element type of an array."""


def _carve(block: NDArray[np.uint8] | None, *wanted: Wanted) -> tuple[NDArray[np.uint8], list[NDArray[Any]]]:
    """The block, a new one if the given one is too small, and uninitialised arrays side by side in it."""
    sizes = [length * np.dtype(kind).itemsize for length, kind in wanted]
    total = sum(-(-size // 64) * 64 for size in sizes)
    if block is None or block.size < total:
        block = np.empty(total, dtype=np.uint8)
    at, out = 0, []
    for size, (_, kind) in zip(sizes, wanted, strict=True):
        out.append(block[at : at + size].view(kind))
        at += -(-size // 64) * 64
    return block, out


class _Scratch(threading.local):
    """Memory for what only lives during one call, kept from call to call, one block for each thread.

    Nothing is ever read from it that the same call has not written.
    """

    block: NDArray[np.uint8] | None = None

    def take(self, *wanted: Wanted) -> list[NDArray[Any]]:
        """Uninitialised arrays, valid until the next call in this thread."""
        block, arrays = _carve(self.block, *wanted)
        self.block = block if block.size <= _SCRATCH_BYTES else None
        return arrays


_SCRATCH = _Scratch()


def _own(free: BoolGrid) -> BoolGrid:
    """The same cells as a read-only array that nobody else can write to."""
    array = np.asarray(free)
    if array.ndim != 2 or array.size == 0 or array.dtype != np.bool_:
        raise SettingError(
            "GRID_SHAPE",
            f"free has shape {array.shape} of {array.dtype}",
            allowed="bool, (height, width), not empty",
        )
    if array.flags.writeable or not array.flags.c_contiguous:
        array = frozen(np.array(array, order="C"))
    return array


def _check(rho: float, gamma: float) -> None:
    if isinstance(rho, bool) or not isinstance(rho, int | float) or not 0 < rho <= 1:
        raise SettingError("RHO", f"{rho!r}", where="rho", allowed="0 < rho <= 1")
    if isinstance(gamma, bool) or not isinstance(gamma, int | float) or not 0 < gamma < math.inf:
        raise SettingError("GAMMA", f"{gamma!r}", where="gamma", allowed="a finite number > 0")
