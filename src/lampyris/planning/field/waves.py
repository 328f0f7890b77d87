"""Waves: which kernels fill a frame with costs, parents and luciferin, for which moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lampyris.errors import SettingError
from lampyris.kernels._jit import Kernel
from lampyris.kernels.field import bucket_wavefront, descent, wavefront, weighted_descent, weighted_wavefront
from lampyris.kernels.field.costs_alone import costs_alone
from lampyris.model.grid import TERRAIN_UNIT
from lampyris.model.moves import MOVES, Moves
from lampyris.planning.field.frame import AHEAD, SCRATCH, SPARING, WEIGHS_MOST, BorderedMap, Wanted
from lampyris.typing import BoolGrid, ByteGrid, Floats

_EIGHT = MOVES["octile"].offsets
_UNROLLED = {MOVES[name].offsets for name in ("four-connected", "octile", "sixteen-connected")}
_BY_HEADS = {
    (MOVES[name].offsets, MOVES[name].corner_cutting)
    for name in ("four-connected", "dissertation", "sixteen-connected")
}
_LOOPS = (bucket_wavefront.one_head, bucket_wavefront.two_heads, bucket_wavefront.three_heads)

ALONE = 2**20
"""Cells in a frame up to which costs that are wanted once are filled by the kernel that is compiled sooner."""

LastMap = Literal["cost", "step", "luciferin"]
"""The last map of a field that is filled: costs; steps (parents) too; luciferin too."""


@dataclass(frozen=True, slots=True)
class Wave:
    """One run of the wavefront that suits the moves, with parents and luciferin.

    Parameters
    ----------
    frame, free, moves : the map and the step set.
    goal, stop : indices in the frame; ``stop`` 0 for never.
    cost, step, luciferin : the three maps to fill, flat and padded.
    shares : 1 - rho, gamma, unit.
    sparing : whether lists lie where luciferin will, if they can; None for on large maps.
    last : the last of the three maps to be filled; the ones after it hold anything. With ``"cost"``, costs of cells
        that cannot reach the goal, or cost more than ``stop``, are of no use.
    """

    frame: BorderedMap
    free: BoolGrid
    moves: Moves
    goal: int
    stop: int
    cost: NDArray[Any]
    step: NDArray[np.int8]
    luciferin: Floats
    shares: tuple[float, float, float]
    sparing: bool | None = None
    last: LastMap = "luciferin"

    def run(self) -> int:
        """Fill the maps over plain ground; how many cells were settled.

        Raises
        ------
        SettingError : a step set that no wavefront can serve.
        """
        self._check(self.moves.costs)
        loop = self._loop
        if loop is None:
            return self._ripple()
        return self._windows() if loop is wavefront.windows else self._by_heads(loop)

    @property
    def _loop(self) -> Kernel | None:
        """The kernel that fills costs over plain ground; None: one of those for any step set."""
        moves = self.moves
        a, b = moves.unit, moves.diagonal
        if (
            self.frame.dtype is np.int32
            and (moves.offsets, moves.corner_cutting) in _BY_HEADS
            and self._one_price_a_length
        ):
            return _LOOPS[len(set(moves.costs)) - 1]
        return wavefront.windows if self._two_prices and a < b <= 2 * a else None

    def run_over(self, terrain: ByteGrid) -> int:
        """Fill the maps over terrain; how many cells were settled, 0 if costs outgrow the frame's.

        Raises
        ------
        SettingError : a step set that no wavefront can serve.
        """
        frame, moves, n, bench = self.frame, self.moves, self.frame.cells, self.frame.cells + 1
        prices = sorted({c // TERRAIN_UNIT for c in moves.costs})
        self._check(prices)
        # A bucket as wide as the greatest power of two in the least step; one shift finds a cost's bucket.
        shift = (TERRAIN_UNIT * prices[0]).bit_length() - 1
        ring = 1 << ((WEIGHS_MOST * max(moves.costs) >> shift) + 1).bit_length()
        order, toll, load, weight, links, firsts, near, far = self._lists(
            (n + AHEAD, np.uint32), (bench, frame.dtype), (bench, np.uint8), (frame.size, np.uint8),
            (len(prices) * bench, np.uint32), (len(prices) * ring, np.uint32),
            (3 * frame.width, frame.dtype), (3 * frame.width, frame.dtype),
        )  # fmt: skip
        weighted_wavefront.lay_out(
            self._rooms, terrain.ravel(), self.cost, weight, frame.width, frame.pad, frame.never
        )
        room = (weight, self.cost, order, toll, load, links, firsts, bench)
        last = (self.goal, self.stop)
        rest = (shift, ring - 1, frame.never)
        a, b, c = (price // TERRAIN_UNIT for price in (moves.unit, moves.diagonal, moves.knight))
        guard = 0 if moves.corner_cutting else -1
        if moves.offsets in _UNROLLED and self._one_price_a_length and not (c and moves.corner_cutting):
            count = weighted_wavefront.settle(*room, frame.width, *last, a, b, c, guard, *rest)
        else:
            count = weighted_wavefront.any_steps(*room, *self._by_price(prices), *last, *rest)
        if count == 0 or self.last == "cost":
            return int(count)
        if self._two_prices:
            weighted_descent.parents8(
                self.cost, weight, self.step, near, far, frame.width, frame.rows, a, b, guard, self._limit
            )
        else:
            each = np.array(moves.costs, dtype=np.int64) // TERRAIN_UNIT
            table = frame.table(moves)
            weighted_descent.parents(
                self.cost, weight, self.step, frame.width, frame.rows, frame.pad, *table, each, self._limit
            )
        self._glow(order, count)
        return int(count)

    def _by_price(self, prices: list[int]) -> tuple[NDArray[np.int64], ...]:
        """Where the steps of each price begin; the table of steps in that order, seen from the cell that they
        end in; the prices.
        """
        costs = np.array(self.moves.costs, dtype=np.int64) // TERRAIN_UNIT
        by = np.argsort(costs, kind="stable")
        first = np.searchsorted(costs[by], [*prices, prices[-1] + 1]).astype(np.int64)
        jump, side, other = (column[by] for column in self.frame.table(self.moves))
        return first, -jump, side - jump, other - jump, np.array(prices, dtype=np.int64)

    def _by_heads(self, loop: Kernel) -> int:
        """Costs level by level, for step sets of :data:`lampyris.model.moves.MOVES` in whole numbers."""
        frame, moves, n = self.frame, self.moves, self.frame.cells
        order, *levels = self._lists((n + AHEAD, np.uint32), (n + 1, np.uint32), (n + 1, np.uint32))
        # Parents come after costs: until then their memory says what is fresh.
        fresh = self.step.view(np.uint8)
        prices = sorted(set(moves.costs))
        room = (self._rooms, self.cost, fresh, order, *levels, frame.width, self.goal, self.stop)
        many = loop(*room, *prices, frame.never)
        if self.last == "cost":
            return int(levels[1][many - 1])
        self.step.fill(-1)
        if len(prices) == 2:
            self._parents8(prices[0], prices[1], 0, frame.never - 1)
        else:
            self._parents(frame.never - 1)
        count = int(levels[1][many - 1])
        self._glow(order, count)
        return count

    def _windows(self) -> int:
        frame, a, b, n = self.frame, self.moves.unit, self.moves.diagonal, self.frame.cells
        (order,) = self._lists((2 * n + 2 + AHEAD, np.uint32))
        guard = 0 if self.moves.corner_cutting else -1
        count = wavefront.windows(
            self._rooms, self.cost, order, n + 1, frame.width, self.goal, self.stop, a, b, guard, frame.never
        )
        if self.last == "cost":
            return int(count)
        self._parents8(a, b, guard, self._limit)
        self._glow(order, count)
        return int(count)

    def run_costs_alone(self) -> bool:
        """Fill the costs alone, over plain ground, where that has to be compiled or loaded and takes less time so; whether it
        is done: it is not where the kernel gives up."""
        frame = self.frame
        if frame.size > ALONE or self.stop or not (self._two_prices and self._mirrored):
            return False
        self._check(self.moves.costs)
        loop = self._loop
        if loop is None or loop.is_loaded or not loop.pays(self.cost):
            return False
        self.cost.fill(-1)
        pad = frame.pad
        inside = self.cost.reshape(frame.rows, frame.width)[pad : frame.rows - pad, pad : frame.width - pad]
        np.copyto(inside, frame.never, where=self.free)
        columns = (*frame.table(self.moves), np.array(self.moves.costs, dtype=np.int64))
        room = int(np.count_nonzero(self.free)) + 1
        queue, waits = self._lists((room, np.uint32), (frame.size, np.uint8))
        waits.fill(0)
        return bool(costs_alone(self.cost, queue, waits, np.stack(columns, axis=1).ravel(), self.goal))

    def _ripple(self) -> int:
        frame, n, costs = self.frame, self.frame.size, self.moves.costs
        if not self._mirrored:
            # The loop goes from the goal by the steps themselves, which must be worth their reverses.
            allowed = "on plain ground, steps whose reverse is there at the same cost"
            raise SettingError("MOVES", f"steps {self.moves.offsets} at {self.moves.costs}", allowed=allowed)
        lists = (3 * n + 3 + AHEAD, np.uint32)
        order, ends = SCRATCH.take(lists, (3, np.uint64))
        count = wavefront.ripple(
            self._rooms, self.cost, order, ends, n + 1, *self._table, frame.width, frame.pad, self.goal,
            self.stop, min(costs), frame.never,
        )  # fmt: skip
        if self.last == "cost":
            return int(count)
        self._parents(self._limit)
        self._glow(order, count)
        return int(count)

    def _parents8(self, a: int, b: int, guard: int, limit: int) -> None:
        """Parents by eight moves of two prices.

        The loop for them compares with a cell's cost less the diagonal. If that can be -1, as in a cell that
        costs 10 where diagonals cost 11, it is what walls hold; then the loop for any steps asks for walls.
        """
        frame = self.frame
        if (b - 1) % a:
            descent.parents8(self.cost, self.step, frame.width, frame.rows, a, b, guard, limit)
        else:
            self._parents(limit)

    def _parents(self, limit: int) -> None:
        frame = self.frame
        descent.parents(self.cost, self.step, frame.width, frame.rows, frame.pad, *self._table, limit)

    @property
    def _table(self) -> tuple[NDArray[Any], ...]:
        """The steps as the loops for any of them read them."""
        return (*self.frame.table(self.moves), np.array(self.moves.costs, dtype=self.frame.dtype))

    def _check(self, costs: Sequence[int]) -> None:
        """The spread is bounded by the lists of :func:`lampyris.kernels.field.wavefront.ripple`; elsewhere it might
        be greater, but a walk on the field relies on it.
        """
        least = min(costs)
        if not 0 < least <= max(costs) < 3 * least:
            allowed = "positive, the greatest below three times the least"
            raise SettingError("MOVES", f"costs {self.moves.costs}", allowed=allowed)
        if self.moves.unit <= 0:
            raise SettingError("MOVES", f"a unit of {self.moves.unit}", allowed="1 or more")

    @property
    def _sparing(self) -> bool:
        """Whether lists lie where luciferin will."""
        asked = self.frame.size >= SPARING if self.sparing is None else self.sparing
        return asked and self._mirrored

    @property
    def _mirrored(self) -> bool:
        """Whether every step has its reverse at the same cost."""
        costs = dict(zip(self.moves.offsets, self.moves.costs, strict=True))
        return all(costs.get((-dx, -dy)) == cost for (dx, dy), cost in costs.items())

    def _lists(self, *wanted: Wanted) -> list[NDArray[Any]]:
        """Scratch; on large maps as much of it as fits lies where luciferin will."""
        if self._sparing:
            return SCRATCH.within(self.luciferin, *wanted)
        return SCRATCH.take(*wanted)

    def _glow(self, order: NDArray[np.uint32], count: int) -> None:
        """Luciferin, along parents in the order in which cells settled; on large maps in that of their rows,
        for it may overwrite the list.
        """
        if self.last != "luciferin":
            return
        if self._sparing:
            self.shine()
            return
        descent.glow(order, count, self.cost, self.step, self._jump, self.luciferin, np.inf, *self.shares)

    def shine(self) -> None:
        """Luciferin, along parents in the order of their rows, where costs and steps are filled."""
        jump = np.zeros(128, dtype=np.int64)
        jump[: len(self._jump)] = self._jump
        rest = (jump, self.luciferin, self.frame.width, self.goal, np.inf, *self.shares)
        descent.shine(self.cost, self.step, *rest)

    @property
    def _two_prices(self) -> bool:
        """Whether these are the eight steps, all straights at one price and all diagonals at another."""
        moves = self.moves
        return moves.offsets == _EIGHT and moves.costs == (moves.diagonal,) * 4 + (moves.unit,) * 4

    @property
    def _one_price_a_length(self) -> bool:
        """Whether straights, diagonals and knight's moves rise in price and all of a length have one."""
        moves = self.moves
        by_length = [
            {c for (dx, dy), c in zip(moves.offsets, moves.costs, strict=True) if dx * dx + dy * dy == square}
            for square in (1, 2, 5)
        ]
        prices = [c for each in by_length for c in each]
        return all(len(each) <= 1 for each in by_length) and prices == sorted(set(prices))

    @property
    def _rooms(self) -> NDArray[np.uint8]:
        return self.free.view(np.uint8).ravel()

    @property
    def _jump(self) -> NDArray[np.int64]:
        return self.frame.table(self.moves)[0]

    @property
    def _limit(self) -> int:
        """The greatest cost that is final."""
        found, never = int(self.cost[self.stop]), self.frame.never
        return found if self.stop > 0 and found < never else never - 1
