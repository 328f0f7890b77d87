"""Repair: a field kept up to date while its map changes, at the cost of what changed.

A repaired field equals one solved from scratch on the changed map to the last bit: cost, parent and luciferin
(see :mod:`lampyris.kernels.field.repair`). Where too much changes, solving from scratch is quicker, and is done instead.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris._core.defaults import GAMMA, RHO
from lampyris._core.exclusive import Exclusive, one_call
from lampyris.errors import SceneError, SettingError
from lampyris.kernels.field import calendar, repair
from lampyris.model.field import Field
from lampyris.model.grid import MAX_TERRAIN, TERRAIN_UNIT, frozen
from lampyris.model.moves import Moves
from lampyris.planning.field.frame import BorderedMap
from lampyris.planning.field.solve import Maps, checked, fill
from lampyris.planning.field.waves import Wave
from lampyris.typing import BoolGrid, ByteGrid, Cell, Floats

GIVE_UP = 24
"""A repair that has seen one cell in so many is given up for solving from scratch: a cell costs some twenty to thirty
times as much to repair as to solve (``make bench``)."""
HOPELESS = 4
"""It is not even begun where the changed cells and their neighbours are more than that share of it."""

_SPACES = np.array([1, 0], dtype=np.uint8)


@dataclass(frozen=True, slots=True, eq=False)
class Padded:
    """A repaired field as kernels take it: flat, with its border of walls, read-only. Views, like the Field's.

    Parameters
    ----------
    frame : sizes and indices.
    cost, luciferin, step : what :class:`Field` calls ``exact``, ``luciferin`` and ``step``.
    free : uint8; 1 where a cell may be entered.
    terrain : uint8; empty if the field has none.
    """

    frame: BorderedMap
    cost: NDArray[Any]
    luciferin: Floats
    step: NDArray[np.int8]
    free: NDArray[np.uint8]
    terrain: NDArray[np.uint8]


class FieldRepairer(Exclusive):
    """Keeps the field of one goal on a map that changes; for one call at a time (:mod:`lampyris._core.exclusive`).

    Memory besides the field: one or two bytes a cell, 15 from the first repair on.

    Parameters
    ----------
    free : bool, (height, width); where the robot's centre may be. Copied.
    moves : the step set; every step has its opposite.
    goal : x, y.
    terrain : uint8, (height, width), with weighed moves, or None; see :func:`lampyris.planning.field.solve.solve`.
        Copied.
    rho, gamma : luciferin decay, 0 < rho <= 1, and enhancement, > 0.
    solved : what :func:`lampyris.planning.field.solve.fill` made of the same map without luciferin, which is then worked out
        here. Its arrays become those of this object.

    Raises
    ------
    SettingError, SceneError, LimitError : as :func:`lampyris.planning.field.solve.solve` does.
    """

    def __init__(
        self,
        free: BoolGrid,
        moves: Moves,
        goal: Cell,
        *,
        terrain: ByteGrid | None = None,
        rho: float = RHO,
        gamma: float = GAMMA,
        solved: tuple[BorderedMap, Maps, int] | None = None,
    ) -> None:
        if any((-dx, -dy) not in moves.offsets for dx, dy in moves.offsets):
            raise SettingError(
                "MOVES", f"{moves.name}: a step without its opposite", allowed="steps in pairs"
            )
        free, terrain, self._goal = checked(free, terrain, moves, goal, rho, gamma)
        self._shape = free.shape
        self._moves, self._rho, self._gamma = moves, rho, gamma
        self._shares = (1.0 - rho, float(gamma), float(moves.unit))
        if solved is None:
            solved = fill(free, terrain, moves, self._goal, self._shares)
        elif free[self._goal[1], self._goal[0]]:
            frame, (luciferin, cost, step), _ = solved
            Wave(frame, free, moves, frame.index(self._goal), 0, cost, step, luciferin, self._shares).shine()
        else:
            solved[1][0].fill(np.inf)
        self._frame, self._maps, count = solved
        self._free = self._frame.lay(free, np.uint8)
        self._weight = np.zeros(1, np.uint8) if terrain is None else self._frame.lay(terrain, np.uint8)
        # On plain ground all cells share the one weight of 0, and a step costs its price times 1.
        ground, mask = (1, 0) if terrain is None else (TERRAIN_UNIT, -1)
        prices = np.array(moves.costs, dtype=np.int64) // ground
        # The least step, rounded down to a power of two, is what one list of the calendar spans.
        shift = min(moves.costs).bit_length() - 1
        goal_at = self._frame.index(self._goal)
        self._steps = (*self._frame.table(moves), prices, ground, mask, goal_at, shift)
        self._has_terrain = terrain is not None
        self._lists: tuple[NDArray[Any], ...] | None = None
        self._work = np.zeros(6, dtype=np.int64)
        self._copy_on_write = False
        self.solved, self.repaired = 1, 0
        """How often this field was solved from scratch, and how often it was repaired."""
        self._field = self._show(count)

    @property
    def field(self) -> Field:
        """The field as it is now. Its arrays are views that the next :meth:`repair` writes to."""
        return self._field

    @property
    def padded(self) -> Padded:
        """The same arrays with their border, for kernels."""
        return self._padded

    @one_call
    def snapshot(self) -> Field:
        """The field as it is now, with arrays of its own."""
        f = self._field
        return replace(
            f,
            free=frozen(f.free.copy()),
            exact=frozen(f.exact.copy()),
            step=frozen(f.step.copy()),
            luciferin=frozen(f.luciferin.copy()),
        )

    @one_call
    def copy(self) -> FieldRepairer:
        """An independent copy of the repairer and its field."""
        other = self.copy_on_write()
        other._copy_maps()
        return other

    def copy_on_write(self) -> FieldRepairer:
        """A copy that shows the arrays of this one, and copies them before it is repaired. This one must not be repaired."""
        other = FieldRepairer.__new__(FieldRepairer)
        other.__dict__.update(super()._own_state())
        other._lists, other._work = None, self._work.copy()
        other._copy_on_write = True
        other.solved, other.repaired = 0, 0
        return other

    def _copy_maps(self) -> None:
        """Have arrays of its own."""
        luciferin, cost, step = self._maps
        checkpoint()
        luciferin = luciferin.copy()
        checkpoint()
        self._maps = (luciferin, cost.copy(), step.copy())
        checkpoint()
        self._free, self._weight = self._free.copy(), self._weight.copy()
        self._copy_on_write = False
        self._field = self._show(self._field.expansions, self._field.revision)

    def _own_state(self) -> dict[str, Any]:
        # A view travels as an array of its own: what is then repaired is not what is shown. The lists are empty
        # between two calls, and long.
        state = {
            name: value for name, value in super()._own_state().items() if name not in ("_field", "_padded")
        }
        return {
            **state,
            "_lists": None,
            "_copy_on_write": False,
            "shown": (self._field.expansions, self._field.revision),
        }

    def _take_state(self, state: dict[str, Any]) -> None:
        shown = state.pop("shown")
        self.__dict__.update(state)
        self._field = self._show(*shown)

    @one_call
    def repair(
        self,
        *,
        blocked: Iterable[Cell] = (),
        freed: Iterable[Cell] = (),
        terrain: Iterable[tuple[Cell, int]] = (),
    ) -> Field:
        """The field after one Change; the one before is no longer valid (:meth:`snapshot` would be).

        Parameters
        ----------
        blocked, freed : cells that the robot's centre may no longer enter, or may now; a cell in both is
            blocked. For a robot of some radius these are more than the walls that changed.
        terrain : cells and what they cost to enter now, 0 to 252.

        ``expansions`` of the result is the work: cells that lost their cost plus cells that were settled.

        Raises
        ------
        SceneError : a cell outside the map. SettingError : a terrain value out of its range, or any for a
            field without terrain. Nothing is changed then.
        """
        on, off = self._indices(freed, "freed"), self._indices(blocked, "blocked")
        graded, weights = self._weights(list(terrain))
        if self._copy_on_write:
            self._copy_maps()
        if self._lists is None:
            self._lists = _lists(self._free.size)
        luciferin, cost, step = self._maps
        spaces = np.repeat(_SPACES, (len(on), len(off)))
        most = self._free.size // GIVE_UP
        limits = (most // HOPELESS, most, self._frame.never)
        done = repair.repair(
            self._free, self._weight, cost, step, luciferin, *self._lists,
            np.concatenate((on, off)), spaces, graded, weights,
            *self._steps, *limits, *self._shares, self._work,
        )  # fmt: skip
        work = int(self._work[repair.LOST] + self._work[repair.SETTLED])
        revision = self._field.revision + 1
        if done:
            self.repaired += 1
        else:
            work += self._solve()
        if self._maps[1] is cost:
            self._field = replace(self._field, revision=revision, expansions=work)
        else:
            self._field = self._show(work, revision)  # costs have outgrown the memory they were in
        return self._field

    def _solve(self) -> int:
        """Solve from scratch, into the same memory if it will do; how many cells were settled."""
        frame = self._frame
        # Read-only, as solve() hands them on: a kernel recompiles for arrays that may be written.
        free = frozen(np.array(frame.inside(self._free.view(np.bool_)), order="C"))
        terrain = frozen(np.array(frame.inside(self._weight), order="C")) if self._has_terrain else None
        self._frame, self._maps, count = fill(
            free, terrain, self._moves, self._goal, self._shares, into=(frame, self._maps)
        )
        self.solved += 1
        return count

    def _show(self, expansions: int, revision: int = 0) -> Field:
        inside = self._frame.inside
        luciferin, cost, step = self._maps
        terrain = self._weight if self._has_terrain else _NO_WEIGHTS
        shown = (frozen(a.view()) for a in (cost, luciferin, step, self._free, terrain))
        self._padded = Padded(self._frame, *shown)
        return Field(
            free=inside(self._free.view(np.bool_)),
            exact=inside(cost),
            step=inside(step),
            luciferin=inside(luciferin),
            goal=self._goal,
            moves=self._moves,
            rho=self._rho,
            gamma=self._gamma,
            revision=revision,
            expansions=expansions,
        )

    def _indices(self, cells: Iterable[Cell], what: str) -> NDArray[np.int32]:
        """Where cells lie in the frame."""
        given = cells if isinstance(cells, tuple | list | np.ndarray) else list(cells)
        (height, width), frame = self._shape, self._frame
        if len(given) < _FEW:
            for x, y in given:
                if not (0 <= x < width and 0 <= y < height):
                    raise self._outside(x, y, what)
            at = frame.pad * (frame.width + 1)
            return np.array([y * frame.width + x + at for x, y in given], dtype=np.int32)
        xs, ys = np.asarray(given, dtype=np.int64).reshape(-1, 2).T
        outside = (xs < 0) | (xs >= width) | (ys < 0) | (ys >= height)
        if outside.any():
            k = int(outside.argmax())
            raise self._outside(xs[k], ys[k], what)
        return ((ys + frame.pad) * frame.width + xs + frame.pad).astype(np.int32)

    def _outside(self, x: int, y: int, what: str) -> SceneError:
        height, width = self._shape
        return SceneError(
            "CHANGE_OUTSIDE",
            f"cell ({x}, {y}) is outside the map",
            where=what,
            allowed=f"x 0 to {width - 1}, y 0 to {height - 1}",
        )

    def _weights(self, terrain: list[tuple[Cell, int]]) -> tuple[NDArray[np.int32], NDArray[np.uint8]]:
        """Where the cells lie, and their values."""
        if not terrain:
            return _NONE, _NO_WEIGHTS
        if not self._has_terrain:
            raise SettingError(
                "GRID_TERRAIN",
                "terrain for a field that has none",
                todo="make a FieldRepairer with terrain and weighed moves",
            )
        for cell, value in terrain:
            if not (isinstance(value, int | np.integer) and 0 <= value <= MAX_TERRAIN):
                raise SettingError(
                    "GRID_TERRAIN", f"{value} at {cell}", where="terrain", allowed=f"0 to {MAX_TERRAIN}"
                )
        values = np.array([value for _, value in terrain], dtype=np.uint8)
        return self._indices([cell for cell, _ in terrain], "terrain"), values


_FEW = 32
"""Fewer cells than that are looked at one by one: arrays take longer to set up."""
_NONE = np.zeros(0, dtype=np.int32)
_NO_WEIGHTS = np.zeros(0, dtype=np.uint8)


def _lists(n: int) -> tuple[NDArray[Any], ...]:
    """What the kernel asks for as ``after``, ``before``, ``mark`` and ``seen``."""
    after = np.arange(n + calendar.RING + 1, dtype=np.int32)
    before = after.copy()
    before[:n] = calendar.AWAY
    return after, before, np.zeros(n, dtype=np.uint8), np.empty(n, dtype=np.int32)
