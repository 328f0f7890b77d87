"""Space-time searches made callable: a map laid out once, a forecast laid out for each question."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import distinct
from lampyris._core.cancellation import checkpoint
from lampyris.kernels.spacetime.timed_search import (
    EXHAUSTED,
    FOUND,
    FULL,
    LIMIT,
    NEVER,
    sipp,
    space_time,
    steps_to_go,
)
from lampyris.model.grid import TERRAIN_UNIT, GridKey
from lampyris.model.moves import Moves
from lampyris.model.scene import Scene
from lampyris.planning.field.frame import framed
from lampyris.planning.field.layers import free_cells
from lampyris.planning.field.solve import exact_costs
from lampyris.planning.field_cache import SHARED, SHARED_CELLS
from lampyris.planning.spacetime.prediction import Forbidden
from lampyris.planning.spacetime.search_room import ROOM
from lampyris.typing import BoolGrid, ByteGrid, Cell, Cells, Ticks

_Ints = NDArray[np.int64]

MOST_STATES = 1 << 24
"""Cells times ticks that space-time A* looks at before it gives up: about a gigabyte."""

__all__ = ["EXHAUSTED", "FOUND", "LIMIT", "TimedSearch", "TimedSearchResult", "Timetable"]


@dataclass(frozen=True, slots=True, eq=False)
class TimedSearchResult:
    """What one search found.

    Parameters
    ----------
    ending : FOUND, EXHAUSTED or LIMIT of :mod:`lampyris.kernels.spacetime.timed_search`.
    expansions : states expanded.
    cut : whether a path was given up because it went beyond the ticks that were laid out.
    cells : int32, (n, 2), start first, no cell twice in a row; None if nothing was found.
    ticks : int64, (n,); when the robot enters each.
    """

    ending: int
    expansions: int
    cut: bool = False
    cells: Cells | None = None
    ticks: Ticks | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Timetable:
    """A forecast as the kernels read it (:mod:`lampyris.kernels.spacetime.timed_search`), and to ask about single steps."""

    slot: NDArray[np.int32]
    touched: _Ints
    first: _Ints
    begin: _Ints
    end: _Ints
    owner: NDArray[np.int32]
    barred: _Ints
    ban: _Ints
    still: int
    horizon: int

    def safe_until(self, cell: int, tick: int) -> int:
        """The last tick to which a robot may stay on a flat cell where it is at ``tick``, with or without
        right.
        """
        s = int(self.slot[cell])
        if s < 0:
            return NEVER
        for i in range(int(self.first[s]), int(self.first[s + 1])):
            if self.begin[i] <= tick + 1 <= self.end[i]:
                return int(self.end[i])
        return tick

    def bans(self, cell: int, code: int) -> bool:
        """Whether a step out of a flat cell is forbidden; ``code`` is tick * steps + step."""
        s = int(self.slot[cell])
        if s < 0:
            return False
        low, high = int(self.barred[s]), int(self.barred[s + 1])
        at = low + int(np.searchsorted(self.ban[low:high], code))
        return at < high and bool(self.ban[at] == code)


class TimedSearch:
    """One map, one goal, the eight (or four) steps of a tick.

    Parameters
    ----------
    free : bool (height, width); where the robot may be.
    moves : the step set; of ``sixteen-connected`` the eight single steps.
    goal : a free cell.
    terrain : what cells weigh, with weighed moves, or None.
    """

    def __init__(self, free: BoolGrid, moves: Moves, goal: Cell, terrain: ByteGrid | None) -> None:
        width = free.shape[1]
        self._width = width
        self._stride = width + 2
        self._free = framed(free, 1, False).view(np.uint8)
        n = len(self._free)
        offsets = moves.offsets
        corners = not moves.corner_cutting
        self._kinds = {o: k for k, o in enumerate(offsets)}
        self._kind_of = np.full(9, -1, dtype=np.int64)
        for k, (dx, dy) in enumerate(offsets):
            self._kind_of[(dx + 1) * 3 + dy + 1] = k
        row = self._stride
        self._offset = np.array([dy * row + dx for dx, dy in offsets], dtype=np.int64)
        self._via = np.array([dx if dx and dy and corners else 0 for dx, dy in offsets], dtype=np.int64)
        self._across = np.array(
            [dy * row if dx and dy and corners else 0 for dx, dy in offsets], dtype=np.int64
        )
        self._price = np.array(moves.costs, dtype=np.int64)
        if terrain is None:
            self._toll = framed(np.broadcast_to(np.int64(1), free.shape), 1, 1)
        else:
            self._price //= TERRAIN_UNIT
            self._toll = framed(terrain, 1, 0, np.int64)
            self._toll += TERRAIN_UNIT
        self._goal = self.flat(goal)
        self._steps = np.empty(n, dtype=np.int32)
        steps_to_go(
            self._free,
            self._offset,
            self._via,
            self._across,
            self._goal,
            self._steps,
            np.empty(n, dtype=np.int32),
        )
        exact, _ = exact_costs(free, moves, goal, terrain=terrain)
        self._rest = framed(exact, 1, -1, np.int64)
        checkpoint()
        self._slot = np.full(n, -1, dtype=np.int32)
        self._inside: NDArray[np.uint8] | None = None

    def again(self) -> TimedSearch:
        """Another search on the same map, with a timetable of its own."""
        other = object.__new__(TimedSearch)
        other.__dict__.update(self.__dict__)
        other._slot = self.no_slots()
        return other

    def flat(self, cell: Cell) -> int:
        """The padded flat index of a cell."""
        return int((cell[1] + 1) * self._stride + cell[0] + 1)

    def inside(self) -> NDArray[np.uint8]:
        """1 for a cell of the map, 0 for its border, by padded flat index; searches made by :meth:`again` share it."""
        if self._inside is None:
            height = len(self._free) // self._stride - 2
            self._inside = framed(np.ones((height, self._width), dtype=np.uint8), 1, 0)
        return self._inside

    def walkable(self, free: BoolGrid) -> NDArray[np.uint8]:
        """Where obstacles can be, by padded flat index: of the same cells as the robot's in most cases."""
        rows = self._free.reshape(-1, self._stride)[1:-1, 1:-1]
        same = np.array_equal(rows.view(np.bool_), free)
        return self._free if same else framed(free, 1, False).view(np.uint8)

    def flats(self, x: _Ints, y: _Ints) -> _Ints:
        """The padded flat indices of cells."""
        padded: _Ints = (y + 1) * self._stride + x + 1
        return padded

    def cell(self, flat: int) -> Cell:
        """x, y of a padded flat index."""
        y, x = divmod(flat, self._stride)
        return x - 1, y - 1

    @property
    def kinds(self) -> _Ints:
        """The number of each step, at 3 (dx + 1) + dy + 1; -1 for none."""
        return self._kind_of

    @property
    def ground(self) -> tuple[NDArray[np.uint8] | _Ints | NDArray[np.int32] | int, ...]:
        """The map as :func:`lampyris.kernels.spacetime.timed_search.sipp` takes it, ``free`` to ``rest``, and the goal."""
        return (*self._ground(), self._goal)

    def steps_left(self, cell: Cell) -> int:
        """Least number of steps from a cell to the goal on the bare map; -1 if there is no path."""
        return int(self._steps[self.flat(cell)])

    def timetable(self, given: Forbidden) -> Timetable:
        """Lay out a forecast. Valid until the next one is laid out."""
        checkpoint()
        at, forever = self.padded(given.at[:, 0]), self.padded(given.forever[:, 0])
        out, code = self.banned(given.steps)
        checkpoint()
        slot = self._slot
        slot[:] = -1
        for cells in (at, forever, out):
            slot[cells] = 0
        touched = np.flatnonzero(slot == 0).astype(np.int64)
        checkpoint()
        slot[touched] = np.arange(len(touched), dtype=np.int32)
        busy = slot[at].astype(np.int64), given.at[:, 1]
        begin, end, owner = intervals(busy, (slot[forever], given.forever[:, 1]), touched)
        checkpoint()
        first = np.searchsorted(owner, np.concatenate((touched, [len(slot)])))
        # One number for slot and code: sorting pairs by column takes twenty times as long.
        span = int(code.max(initial=0)) + 1
        bans = distinct(slot[out].astype(np.int64) * span + code)
        barred = np.searchsorted(bans, np.arange(len(touched) + 1) * span)
        return Timetable(
            slot,
            touched,
            first.astype(np.int64),
            begin,
            end,
            owner.astype(np.int32),
            barred.astype(np.int64),
            bans % span,
            given.still if given.until == NEVER else NEVER,
            given.until,
        )

    def no_slots(self) -> NDArray[np.int32]:
        """A slot for no cell, as timetables say it."""
        return np.full(len(self._free), -1, dtype=np.int32)

    def banned(self, steps: _Ints) -> tuple[_Ints, _Ints]:
        """Cells and codes of forbidden steps (rows of :class:`Forbidden`), those left out that the robot does not know."""
        kinds = self._kind_of[(steps[:, 2] + 1) * 3 + steps[:, 3] + 1]
        may = kinds >= 0
        return self.padded(steps[may, 0]), steps[may, 1] * len(self._offset) + kinds[may]

    def padded(self, flat: _Ints) -> _Ints:
        """Padded flat indices from those of the map."""
        y, x = np.divmod(flat, self._width)
        padded: _Ints = (y + 1) * self._stride + x + 1
        return padded

    def _ground(self) -> tuple[NDArray[np.uint8] | _Ints | NDArray[np.int32], ...]:
        return (
            self._free, self._offset, self._via, self._across, self._price, self._toll, self._steps,
            self._rest,
        )  # fmt: skip

    def by_intervals(self, table: Timetable, start: Cell, tick: int, budget: int | None) -> TimedSearchResult:
        """The earliest arrival, by SIPP."""
        s = self.flat(start)
        states = len(self._free) + len(table.begin) + 1
        result = np.zeros(5, dtype=np.int64)
        with ROOM.take(states, result, self) as room:
            sipp(
                *self._ground(), table.slot, table.first, table.begin, table.end, table.owner, table.barred,
                table.ban, s, self._goal, tick, table.safe_until(s, tick), table.horizon,
                -1 if budget is None else budget, *room, result,
            )  # fmt: skip
            ending, expansions, _, cut, n = result.tolist()
            if ending != FOUND:
                return TimedSearchResult(ending, expansions, bool(cut))
            flat, ticks = room.key[:n], room.tie[:n].copy()
            checkpoint()
            return TimedSearchResult(ending, expansions, bool(cut), self._cells(flat), ticks)

    def by_ticks(self, table: Timetable, start: Cell, tick: int, budget: int | None) -> TimedSearchResult:
        """The earliest arrival, by A* over cells and ticks."""
        s = self.flat(start)
        room = 1 << 12
        while True:
            checkpoint()
            hashed = np.full(2 * room, -1, dtype=np.int32)
            arrive, paid, key, tie = (np.zeros(room, dtype=np.int64) for _ in range(4))
            cell, came, place = (np.zeros(room, dtype=np.int32) for _ in range(3))
            result = np.zeros(4, dtype=np.int64)
            checkpoint()
            space_time(
                *self._ground(), table.slot, table.first, table.begin, table.end, table.barred, table.ban, s,
                self._goal, tick, table.still, table.horizon, -1 if budget is None else budget, hashed, cell,
                arrive, paid, came, np.zeros(room, dtype=np.uint8), np.zeros(room + 1, dtype=np.int32), place,
                key, tie, result,
            )  # fmt: skip
            if result[0] != FULL:
                return self._route(result, came, cell, arrive)
            if room >= MOST_STATES:
                return TimedSearchResult(LIMIT, int(result[1]))
            room *= 4

    def _route(
        self,
        result: _Ints,
        came: NDArray[np.int32],
        cell: NDArray[np.int32],
        arrive: _Ints,
    ) -> TimedSearchResult:
        ending, expansions, state, cut = result.tolist()
        if ending != FOUND:
            return TimedSearchResult(ending, expansions, bool(cut))
        # Backwards, by pieces: of one list of half a million the array alone was 18 ms without a look.
        pieces, piece = [], [state]
        while came[piece[-1]] >= 0:
            last = piece[-1]
            if len(piece) == 4096:
                checkpoint()
                pieces.append(np.array(piece, dtype=np.int64))
                piece = []
            piece.append(int(came[last]))
        states = np.concatenate((*pieces, np.array(piece, dtype=np.int64)))[::-1]
        checkpoint()
        flat = cell[states].astype(np.int64)
        moved = np.concatenate(([True], flat[1:] != flat[:-1]))  # a wait is a state of its own in A*
        flat, ticks = flat[moved], arrive[states][moved]
        checkpoint()
        return TimedSearchResult(ending, expansions, bool(cut), self._cells(flat), ticks)

    def _cells(self, flat: _Ints) -> Cells:
        """x, y of padded flat indices."""
        y = flat // self._stride
        cells = np.empty((len(flat), 2), dtype=np.int32)
        cells[:, 0], cells[:, 1] = flat - y * self._stride - 1, y - 1
        return cells

    def still_good(self, table: Timetable, cells: Cells, ticks: Ticks) -> bool:
        """Whether a robot that is on ``cells[0]`` at ``ticks[0]`` may drive on as planned."""
        x, y = cells.astype(np.int64).T
        flat = (y + 1) * self._stride + x + 1
        touched = table.slot[flat] >= 0
        # Most of a long path lies where nobody ever comes.
        for k in np.flatnonzero(touched[:-1] | touched[1:]).tolist():
            u, v = int(flat[k]), int(flat[k + 1])
            t, then = int(ticks[k]), int(ticks[k + 1])
            kind = self._kinds[(int(x[k + 1] - x[k]), int(y[k + 1] - y[k]))]
            if table.safe_until(u, t) < then - 1 or table.bans(u, then * len(self._offset) + kind):
                return False
            s = int(table.slot[v])
            if s >= 0 and not any(
                table.begin[i] <= then <= table.end[i]
                for i in range(int(table.first[s]), int(table.first[s + 1]))
            ):
                return False
        return True


@lru_cache(maxsize=SHARED)
def _laid_out(key: GridKey, radius: float, moves: Moves, goal: Cell) -> TimedSearch:
    search = TimedSearch(free_cells(key.grid, radius), moves, goal, None)
    search.inside()  # now, or each of those that share it would make its own
    return search


def shared_search(scene: Scene, moves: Moves) -> TimedSearch | None:
    """A search on a scene's map as given, of which sessions with the same goal share all but the timetable; None: the map is
    large, or has terrain."""
    grid = scene.grid
    if grid.terrain is not None or grid.blocked.size > SHARED_CELLS:
        return None
    return _laid_out(GridKey(grid), scene.robot.radius, moves, scene.goal).again()


def intervals(
    at: tuple[NDArray[Any], _Ints], forever: tuple[NDArray[Any], _Ints], touched: _Ints
) -> tuple[_Ints, _Ints, _Ints]:
    """Safe intervals: first tick, last tick and cell of each, ordered by cell and tick.

    Parameters
    ----------
    at, forever : the place in ``touched`` of the cells that are taken, and the tick, or the first, at which each is.
    touched : cells, rising.
    """
    ends = np.full(len(touched), NEVER, dtype=np.int64)  # the first tick from which an obstacle never leaves
    np.minimum.at(ends, forever[0], forever[1])
    early = int(at[1].min(initial=0))
    span = int(at[1].max(initial=0)) - early + 1
    where, tick = np.divmod(distinct(at[0] * span + at[1] - early), span)
    busy = np.stack((touched[where], tick + early), axis=1)
    keep = busy[:, 1] < ends[where]
    busy, where = busy[keep], where[keep]
    # A safe interval begins behind every busy tick that is not followed by another, and at -NEVER.
    last = np.ones(len(busy), dtype=np.bool_)
    last[:-1] = (busy[1:, 0] != busy[:-1, 0]) | (busy[1:, 1] != busy[:-1, 1] + 1)
    opens = np.concatenate((np.full(len(touched), -NEVER, dtype=np.int64), busy[last, 1] + 1))
    owner = np.concatenate((np.arange(len(touched)), where[last]))
    new = np.ones(len(busy), dtype=np.bool_)
    new[1:] = last[:-1]
    closes = np.concatenate((busy[new, 1] - 1, ends - 1))
    closer = np.concatenate((where[new], np.arange(len(touched))))
    # As many open as close in each cell, alternating: sorted apart they fit together. Each is two ascending
    # runs, of which the one that comes first in every cell stands first: a stable sort by cell merges them.
    first, second = np.argsort(owner, kind="stable"), np.argsort(closer, kind="stable")
    begin, end, cell = opens[first], closes[second], touched[owner[first]]
    real = begin <= end
    return begin[real], end[real], cell[real]
