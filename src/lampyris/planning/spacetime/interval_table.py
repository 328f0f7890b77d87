"""Safe intervals that are kept from call to call and changed where obstacles have moved or tracks have become longer.

What tracks of known end forbid is laid out once. When such a track gets longer, the intervals of the cells that it then
covers, and of the cell where it ended, are made again: they are split at the new ticks, and the last one no longer ends
where the track did. What a call guesses of other obstacles is laid over that cell by cell, and taken away by the next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import distinct
from lampyris._core.cancellation import checkpoint
from lampyris.kernels.spacetime.timed_search import NEVER
from lampyris.planning.spacetime.prediction import Forbidden, Lasting, joined
from lampyris.planning.spacetime.search import TimedSearch, Timetable, intervals

_Ints = NDArray[np.int64]
K = TypeVar("K", bound=np.generic)
_SHIFT = 32
_LOW = (1 << _SHIFT) - 1
MOST_TICK = 1 << 28
"""Ticks before which all must be that is laid out here: a cell and a step at a tick then are one number of 64 bits."""
WASTE = 4096
"""Intervals that nothing refers to any more, besides as many as are in use, before all are laid out again."""


@dataclass(slots=True)
class _Rows:
    """What is forbidden, by padded flat index.

    Parameters
    ----------
    busy : cell and tick at which an obstacle is there, as one number; rising.
    bans : cell and forbidden step, as one number; rising.
    forever : cells from which an obstacle does not leave again, and from which tick, as one number; rising.
    """

    busy: _Ints
    bans: _Ints
    forever: _Ints

    def cells(self) -> _Ints:
        """All cells, rising."""
        return distinct(np.concatenate((self.busy, self.bans, self.forever)) >> _SHIFT)

    def of(self, cells: _Ints) -> _Rows:
        """What is forbidden on some cells, which rise."""
        return _Rows(*(_part(rows, cells) for rows in (self.busy, self.bans, self.forever)))

    def and_(self, other: _Rows) -> _Rows:
        """Both together."""
        return _Rows(
            _merged(self.busy, other.busy),
            _merged(self.bans, other.bans),
            _merged(self.forever, other.forever),
        )


class IntervalTable:
    """The timetable of one search, changed from call to call.

    Parameters
    ----------
    search : whose cells and steps they are.
    """

    def __init__(self, search: TimedSearch) -> None:
        self._search = search
        self._slot: NDArray[np.int32] = search.no_slots()
        self._serials: list[int] | None = []
        self._begin, self._end = np.zeros((2, 0), dtype=np.int64)
        self._owner = np.zeros(0, dtype=np.int32)
        self._first, self._barred = (np.zeros(1, dtype=np.int64) for _ in range(2))
        self._ban = np.zeros(0, dtype=np.int64)
        none = np.zeros(0, dtype=np.int64)
        self._rows = _Rows(none, none, none)
        self._slots = self._intervals = self._bans = self._in_use = 0
        self._covered, self._under = none, np.zeros(0, dtype=np.int32)

    def table(self, lasting: Sequence[Lasting], passing: Forbidden) -> Timetable:
        """What tracks that end forbid and what is forbidden besides; valid until the next call.

        Parameters
        ----------
        lasting : of tracks that end; worked out by one forecaster.
        passing : of all other obstacles.
        """
        checkpoint()
        still = max([passing.still, *(one.still for one in lasting)])
        early = min([int(passing.at[:, 1].min(initial=0)), *(one.first for one in lasting)])
        if early < 0 or still >= MOST_TICK:
            return self._search.timetable(joined(lasting, passing, early))
        self._slot[self._covered] = self._under
        self._covered, self._under = self._covered[:0], self._under[:0]
        serials = [one.serial for one in lasting]
        if serials != self._serials:
            before, self._serials = self._serials, None  # as long as it is half done
            if before is None or len(before) != len(serials) or not self._grow(lasting, before):
                self._lay(lasting)
            self._serials = serials
        slots, made, bans = self._slots, self._intervals, self._bans
        over = self._packed(passing)
        cells = over.cells()
        if len(cells):
            self._under = self._slot[cells]
            self._covered = cells
            slots, made, bans = self._write(cells, self._rows.of(cells).and_(over))
        return Timetable(
            self._slot,
            cells,
            self._first[: slots + 1],
            self._begin[:made],
            self._end[:made],
            self._owner[:made],
            self._barred[: slots + 1],
            self._ban[:bans],
            still if passing.until == NEVER else NEVER,
            passing.until,
        )

    def _lay(self, lasting: Sequence[Lasting]) -> None:
        """Lay all out again."""
        packed = [self._packed(one) for one in lasting]
        self._rows = _Rows(
            *(
                distinct(
                    np.concatenate((np.zeros(0, dtype=np.int64), *(getattr(rows, what) for rows in packed)))
                )
                for what in ("busy", "bans", "forever")
            )
        )
        self._slot.fill(-1)
        self._slots = self._intervals = self._bans = 0
        checkpoint()
        self._keep(self._rows.cells(), self._rows)
        self._in_use = self._intervals

    def _grow(self, lasting: Sequence[Lasting], before: Sequence[int]) -> bool:
        """Change what tracks that have become longer change; False: others have changed besides."""
        grown = [one for one, was in zip(lasting, before, strict=True) if one.serial != was]
        if any(one.grew_from != was for one, was in zip(lasting, before, strict=True) if one.serial != was):
            return False
        if self._intervals > 2 * self._in_use + WASTE:
            return False
        rows = self._rows
        new = [self._packed(one.added) for one in grown if one.added is not None]
        forever = distinct(np.concatenate([self._packed(one).forever for one in lasting]))
        ended = np.setxor1d(forever, rows.forever, assume_unique=True)
        busy, bans = rows.busy, rows.bans
        for one in new:
            busy, bans = _merged(busy, one.busy), _merged(bans, one.bans)
        self._rows = _Rows(busy, bans, forever)
        cells = distinct(np.concatenate((ended >> _SHIFT, *(one.cells() for one in new))))
        if len(cells):
            self._keep(cells, self._rows.of(cells))
        return True

    def _keep(self, cells: _Ints, rows: _Rows) -> None:
        self._slots, self._intervals, self._bans = self._write(cells, rows)

    def _write(self, cells: _Ints, rows: _Rows) -> tuple[int, int, int]:
        """Write the intervals and bans of some cells behind what is kept; how many slots, intervals and bans there are then."""
        at, ends = (
            (np.searchsorted(cells, part >> _SHIFT), part & _LOW) for part in (rows.busy, rows.forever)
        )
        begin, end, owner = intervals(at, ends, cells)
        slots, made, bans = self._slots, self._intervals, self._bans
        first = made + np.searchsorted(owner, cells)
        barred = bans + np.searchsorted(rows.bans, cells << _SHIFT)
        total = slots + len(cells), made + len(begin), bans + len(rows.bans)
        self._begin = _written(self._begin, made, begin)
        self._end = _written(self._end, made, end)
        self._owner = _written(self._owner, made, owner)
        self._ban = _written(self._ban, bans, rows.bans & _LOW)
        self._first = _written(self._first, slots, np.append(first, total[1]))
        self._barred = _written(self._barred, slots, np.append(barred, total[2]))
        self._slot[cells] = np.arange(slots, total[0], dtype=np.int32)
        return total

    def _packed(self, given: Forbidden | Lasting) -> _Rows:
        """The same by padded flat index."""
        search = self._search
        out, code = search.banned(given.steps)
        return _Rows(
            distinct(search.padded(given.at[:, 0]) << _SHIFT | given.at[:, 1]),
            distinct(out << _SHIFT | code),
            distinct(search.padded(given.forever[:, 0]) << _SHIFT | given.forever[:, 1]),
        )


def _written(kept: NDArray[K], at: int, new: NDArray[Any]) -> NDArray[K]:
    """An array with new entries from a place on; another one with twice the room where it is full."""
    need = at + len(new)
    if need > len(kept):
        larger = np.zeros(need + need // 2, dtype=kept.dtype)
        larger[:at] = kept[:at]
        kept = larger
    kept[at:need] = new
    return kept


def _merged(one: _Ints, other: _Ints) -> _Ints:
    """Two rising rows as one, each number once."""
    if not len(other) or not len(one):
        return one if len(one) else other
    place = np.searchsorted(one, other)
    fresh = one[np.minimum(place, len(one) - 1)] != other
    return np.insert(one, place[fresh], other[fresh])


def _part(rows: _Ints, cells: _Ints) -> _Ints:
    """The numbers of some cells, which rise."""
    low, high = np.searchsorted(rows, cells << _SHIFT), np.searchsorted(rows, (cells + 1) << _SHIFT)
    many = high - low
    shift = np.repeat(low - (np.cumsum(many) - many), many)
    return rows[shift + np.arange(len(shift))]
