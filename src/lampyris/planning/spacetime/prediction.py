"""Forecast: where moving obstacles will be, and what that forbids the robot, tick by tick.

An obstacle with a size and a robot with a size meet as a point robot meets a larger obstacle
(:func:`lampyris.planning.field.footprint.reach_of`); so everything here is about a point.

What is known of an obstacle's future (:class:`lampyris.model.change.ObstacleTrack`) is taken as it is. What is not is
guessed, by one of

* ``velocity``: it goes on as in its last step, inside a disc that grows by ``growth`` cells a tick;
* ``reach``: it may be on any cell that it could have walked to by then;
* ``still``: it stays where it is;

for ``horizon`` ticks from the last one that is known. Beyond that nothing is said of it, save of one that is
known to be standing: whatever else it may do, it may also stay.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import checkpoint
from lampyris.errors import SceneError
from lampyris.kernels.spacetime.timed_search import NEVER
from lampyris.model.change import ObstacleTrack
from lampyris.model.grid import frozen
from lampyris.planning.field.footprint import reach_of
from lampyris.typing import BoolGrid, Cell

_PART = 1 << 17
"""Places of obstacles that are worked out between two cancellation checks."""
_Ints = NDArray[np.int64]
_EIGHT = tuple((dx, dy) for dy in (-1, 0, 1) for dx in (-1, 0, 1) if dx or dy)


@dataclass(frozen=True, slots=True, eq=False)
class Forbidden:
    """What the forecast forbids a point robot.

    Parameters
    ----------
    at : int64, (a, 2); cell (y * width + x) and tick at which an obstacle is there.
    steps : int64, (b, 4); cell, tick, dx, dy of steps that end at that tick and would swap with or cross
        an obstacle.
    forever : int64, (c, 2); cell and first tick from which an obstacle stays there forever.
    still : the last tick at which anything is forbidden that is not forever.
    until : the tick to which all obstacles that move forever are written out, beyond which nothing is known of them; NEVER:
        there are none.
    """

    at: _Ints
    steps: _Ints
    forever: _Ints
    still: int
    until: int = NEVER


@dataclass(slots=True)
class _Notes:
    at: list[_Ints] = field(default_factory=list)
    steps: list[_Ints] = field(default_factory=list)
    forever: list[_Ints] = field(default_factory=list)
    until: int = NEVER


_Alike: TypeAlias = tuple[tuple[Cell, ...], int, int, int | None]
"""Footprint, first tick, length and period: tracks that have these in common are worked out together."""
_Numbered: TypeAlias = Sequence[tuple[int, tuple[Cell, ...]]]
"""Numbers of obstacles, and their tracks."""


@dataclass(frozen=True, slots=True, eq=False)
class Lasting:
    """What tracks that end forbid from a tick on: it stays true as long as the tracks are the same.

    Parameters
    ----------
    key : what these tracks have in common.
    tracks : those of the obstacles.
    first, last : the first tick that was worked out, and the tick at which they end.
    at, steps, forever : rows of :class:`Forbidden`.
    serial : a number of its own.
    grew_from, added : the number of what was known of the same tracks before they became longer, and the rows of ``at`` and
        ``steps`` that have come since; -1 and None: they were others.
    """

    key: _Alike
    tracks: list[tuple[Cell, ...]]
    first: int
    last: int
    at: _Ints
    steps: _Ints
    forever: _Ints
    serial: int
    grew_from: int = -1
    added: Forbidden | None = None

    @property
    def still(self) -> int:
        """The last tick of which anything is said; -1: there is none."""
        return max(int(rows[:, 1].max(initial=-1)) for rows in (self.at, self.steps, self.forever))

    def holds(self, tracks: list[tuple[Cell, ...]], tick: int) -> bool:
        """Whether it is of these very tracks, and begins early enough."""
        same = len(tracks) == len(self.tracks) and all(map(operator.is_, tracks, self.tracks))
        return same and self._begins_by(tick)

    def became(self, tracks: list[tuple[Cell, ...]], tick: int, key: _Alike) -> bool:
        """Whether these tracks are the same ones, longer, and it begins early enough."""
        (cells, since, length, period), more = self.key, key[2]
        if (
            (cells, since, period) != (key[0], key[1], key[3])
            or more <= length
            or len(tracks) != len(self.tracks)
        ):
            return False
        if not self._begins_by(tick):
            return False
        return all(new[:length] == old for new, old in zip(tracks, self.tracks, strict=True))

    def _begins_by(self, tick: int) -> bool:
        """Whether it says all from a tick on: before their first tick tracks forbid nothing."""
        return self.first <= min(max(tick, self.key[1]), self.last)

    def write(self, tick: int, notes: _Notes) -> None:
        """Note what is left of it from a tick on."""
        tick = min(tick, self.last)
        notes.at.append(self.at[self.at[:, 1] >= tick])
        notes.steps.append(self.steps[self.steps[:, 1] > tick])
        notes.forever.append(self.forever)


def joined(lasting: Sequence[Lasting], passing: Forbidden, tick: int = 0) -> Forbidden:
    """Everything forbidden after a tick."""
    notes = _Notes([passing.at], [passing.steps], [passing.forever], passing.until)
    for one in lasting:
        one.write(tick, notes)
    return _forbidden(notes, max(tick, passing.still))


def _forbidden(notes: _Notes, tick: int) -> Forbidden:
    """What is noted, after a tick."""
    at, steps, forever = _rows(notes.at, 2), _rows(notes.steps, 4), _rows(notes.forever, 2)
    still = max([tick, *(int(rows[:, 1].max()) for rows in (at, steps, forever) if len(rows))])
    return Forbidden(at, steps, forever, still, notes.until)


class Forecaster:
    """Turns what is seen into what is forbidden.

    Parameters
    ----------
    free : bool (height, width); where an obstacle can be, for ``velocity`` and ``reach``.
    own : the robot's footprint.
    guess : ``velocity``, ``reach`` or ``still``.
    growth : cells a tick by which the disc of ``velocity`` grows.

    Attributes
    ----------
    free, own : as given.
    """

    def __init__(self, free: BoolGrid, own: tuple[Cell, ...], *, guess: str, growth: float) -> None:
        self.free = self._free = free
        self.own = self._own = own
        self._guess = guess
        self._growth = growth
        self._height, self._width = free.shape
        self._lasting: dict[_Alike, Lasting] = {}
        self._serial = 0

    def forbidden(
        self,
        obstacles: Sequence[ObstacleTrack],
        tick: int,
        horizon: int,
        unrolled: int,
        standing: Mapping[int, int] | None = None,
    ) -> Forbidden:
        """Everything forbidden after ``tick``.

        Parameters
        ----------
        obstacles : the obstacles.
        tick : when the robot stands where it is; its first step ends at ``tick + 1``.
        horizon : for how many ticks unknown futures are guessed; 0: only what is known counts.
        unrolled : for how many ticks tracks that repeat themselves are written out.
        standing : obstacles that have been standing, by number, and for how many ticks more they may. Counts for
            those with an unknown future, and not with a horizon of 0.
        """
        return joined(*self.forecast(obstacles, tick, horizon, unrolled, standing), tick=tick)

    def forecast(
        self,
        obstacles: Sequence[ObstacleTrack],
        tick: int,
        horizon: int,
        unrolled: int,
        standing: Mapping[int, int] | None = None,
    ) -> tuple[list[Lasting], Forbidden]:
        """The same in two parts: what tracks that end forbid, which is kept as long as they are the same, and the rest."""
        notes = _Notes()
        alike: dict[_Alike, list[ObstacleTrack]] = {}
        for seen in obstacles:
            # Those of one size that are known for the same ticks are computed together.
            key = (seen.footprint, seen.since, len(seen.track), seen.period)
            alike.setdefault(key, []).append(seen)
        lasting: dict[_Alike, Lasting] = {}
        for key, group in alike.items():
            cells, since, _, period = key
            if period == 1:
                numbered = [(seen.obstacle, tuple(seen.track)) for seen in group]
                lasting[key] = self._last(key, numbered, tick)
                continue
            tracks = _checked([(seen.obstacle, seen.track) for seen in group], since, period)
            self._known(tracks, since, period, cells, tick, unrolled, notes)
            if period is None and horizon > 0:
                self._guessed(tracks, since, cells, tick, horizon, notes)
        self._lasting = lasting
        for seen in obstacles:
            if horizon > 0 and seen.period is None and standing and seen.obstacle in standing:
                self._stays(seen, standing[seen.obstacle], notes)
        return list(lasting.values()), _forbidden(notes, tick)

    # ---- what is known --------------------

    def _last(self, key: _Alike, numbered: _Numbered, tick: int) -> Lasting:
        """What tracks that end forbid, worked out again only if they are others than those of the call before.

        Tuples alone are recognised: a list that a caller gives as a track is copied to a new tuple by every call.
        """
        tracks = [track for _, track in numbered]
        known = self._lasting.get(key)
        if known is not None and known.holds(tracks, tick):
            return known
        cells, since, length, period = key
        notes, last = _Notes(), since + length - 1
        self._serial += 1
        old = next((one for one in self._lasting.values() if one.became(tracks, tick, key)), None)
        if old is not None:
            return self._longer(old, key, numbered)
        self._known(_checked(numbered, since, period), since, period, cells, tick, 0, notes)
        at, steps = _rows(notes.at, 2), _rows(notes.steps, 4)
        first, forever = min(max(tick, since), last), _rows(notes.forever, 2)
        return Lasting(key, tracks, first, last, at, steps, forever, self._serial)

    def _longer(self, old: Lasting, key: _Alike, numbered: _Numbered) -> Lasting:
        """What tracks forbid that have become longer: what they forbade, and what has come since."""
        cells, since, length, period = key
        notes = _Notes()
        self._known(_checked(numbered, since, period), since, period, cells, old.last, 0, notes)
        added = _forbidden(notes, old.last)
        at = np.concatenate((old.at, added.at[added.at[:, 1] > old.last]))
        steps = np.concatenate((old.steps, added.steps))
        last, tracks = since + length - 1, [track for _, track in numbered]
        return Lasting(
            key, tracks, old.first, last, at, steps, added.forever, self._serial, old.serial, added
        )

    def _known(
        self,
        tracks: _Ints,
        since: int,
        period: int | None,
        cells: tuple[Cell, ...],
        tick: int,
        unrolled: int,
        notes: _Notes,
    ) -> None:
        """From the robot's tick, for the step that begins there, to the end of the tracks, (obstacles, m, 2)."""
        length = tracks.shape[1]
        last = since + length - 1
        until = max(last, tick + unrolled) if period is not None and period > 1 else last
        first = max(tick, since)
        if period == 1:
            first = min(first, last)
        if first <= until:
            ticks = np.arange(first, until + 1, dtype=np.int64)
            k = ticks - since
            if period is not None:
                k = np.where(k >= length, length - period + (k - length) % period, k)
            self._drive(tracks[:, k], ticks, cells, notes, stands=period == 1)
        if period is not None and period > 1:
            notes.until = min(notes.until, until)

    def _drive(
        self, places: _Ints, ticks: _Ints, cells: tuple[Cell, ...], notes: _Notes, *, stands: bool
    ) -> None:
        """Obstacles that are on ``places`` (obstacles, m, 2) at ``ticks``; ``stands``: and stay at the last."""
        each = max(1, _PART // (places.shape[1] * len(cells)))
        for k in range(0, len(places), each):
            checkpoint()
            self._drive_some(places[k : k + each], ticks, cells, notes, stands)

    def _drive_some(
        self, places: _Ints, ticks: _Ints, cells: tuple[Cell, ...], notes: _Notes, stands: bool
    ) -> None:
        met = _offsets(self._own, cells)
        now = places[:, :, None, :] + met
        when = np.broadcast_to(ticks[None, :, None], now.shape[:3])
        self._note_cells(now.reshape(-1, 2), when.reshape(-1), notes.at)
        if stands:
            self._note_cells(now[:, -1].reshape(-1, 2), when[:, -1].reshape(-1), notes.forever)
        hops = np.diff(places, axis=1)
        obstacle, leg = np.nonzero(hops.any(axis=2))
        if not len(obstacle):
            return
        hop = hops[obstacle, leg]
        kind = (hop[:, 0] + 1) * 3 + hop[:, 1] + 1
        for which in np.unique(kind).tolist():
            bans = _bans(self._own, cells, which // 3 - 1, which % 3 - 1)
            moved = kind == which
            out = places[obstacle[moved], leg[moved]][:, None, :] + bans[None, :, :2]
            steps = np.broadcast_to(bans[None, :, 2:], out.shape)
            rows = np.concatenate((out, steps), axis=2).reshape(-1, 4)
            inside = self._inside(rows)
            then = np.repeat(ticks[leg[moved] + 1], len(bans))[inside]
            rows = rows[inside]
            flat = rows[:, 1] * self._width + rows[:, 0]
            notes.steps.append(np.stack((flat, then, rows[:, 2], rows[:, 3]), axis=1))

    # ---- what is guessed --------------------

    def _guessed(
        self, tracks: _Ints, since: int, cells: tuple[Cell, ...], tick: int, horizon: int, notes: _Notes
    ) -> None:
        last = since + tracks.shape[1] - 1
        met = _offsets(self._own, cells)
        if self._guess == "reach":
            for x, y in tracks[:, -1].tolist():
                for k, reached in self._reached((x, y), horizon):
                    self._note_spread(reached, met, last + k, notes)
            return
        at = tracks[:, -1]
        hop = at - tracks[:, -2] if self._guess == "velocity" and tracks.shape[1] > 1 else np.zeros_like(at)
        places = [at]
        for _ in range(horizon):
            to = places[-1] + hop
            hop = np.where(self._standing(to)[:, None], hop, 0)  # it will not go through the wall
            places.append(places[-1] + hop)
        ticks = np.arange(last, last + horizon + 1, dtype=np.int64)
        keep = ticks >= tick
        if not keep.any():  # it was seen so long ago that nothing is believed of it any more
            return
        self._drive(np.stack(places, axis=1)[:, keep], ticks[keep], cells, notes, stands=False)
        if self._guess == "velocity" and self._growth > 0:
            for k in range(1, horizon + 1):
                disc = np.array(_disc(self._growth * k), dtype=np.int64)
                around = (places[k][:, None, :] + disc).reshape(-1, 2)
                self._note_spread(around[self._standing(around)], met, last + k, notes)

    def _stays(self, seen: ObstacleTrack, ticks: int, notes: _Notes) -> None:
        """An obstacle that may stay where it is for so many ticks."""
        around = np.array(seen.track[-1], dtype=np.int64) + _offsets(self._own, seen.footprint)
        last = seen.since + len(seen.track) - 1
        when = np.repeat(np.arange(last + 1, last + ticks + 1, dtype=np.int64), len(around))
        self._note_cells(np.tile(around, (ticks, 1)), when, notes.at)

    def _reached(self, cell: Cell, horizon: int) -> Iterator[tuple[int, _Ints]]:
        """The cells of the map that can be walked to from a cell in k ticks, for k = 1 .. horizon; (m, 2) each.

        The cell may be outside the map: then the first step leads onto it, or there are none.
        """
        (x, y), far = cell, horizon + 1
        if not (-1 <= x <= self._width and -1 <= y <= self._height):
            return
        x0, y0 = max(x - far, -1), max(y - far, -1)
        window = np.zeros(
            (min(y + far, self._height) + 1 - y0, min(x + far, self._width) + 1 - x0), dtype=np.bool_
        )
        left, top = max(x0, 0), max(y0, 0)
        inside = self._free[top : y + far + 1, left : x + far + 1]
        window[top - y0 : top - y0 + inside.shape[0], left - x0 : left - x0 + inside.shape[1]] = inside
        mask: NDArray[np.bool_] = np.zeros(window.shape, dtype=np.bool_)
        mask[y - y0, x - x0] = True
        for k in range(1, horizon + 1):
            checkpoint()
            wide = np.pad(mask, 1)
            grown = mask.copy()
            for dx, dy in _EIGHT:
                grown |= wide[1 + dy : 1 + dy + mask.shape[0], 1 + dx : 1 + dx + mask.shape[1]]
            mask = grown & window
            ys, xs = np.nonzero(mask)
            yield k, np.stack((xs + x0, ys + y0), axis=1).astype(np.int64)

    # ---- writing down --------------------

    def _note_spread(self, cells: _Ints, met: _Ints, tick: int, notes: _Notes) -> None:
        """An obstacle that may be on any of these cells at a tick."""
        around = (cells[:, None, :] + met[None, :, :]).reshape(-1, 2)
        self._note_cells(around, np.full(len(around), tick), notes.at)

    def _note_cells(self, cells: _Ints, ticks: _Ints, into: list[_Ints]) -> None:
        inside = self._inside(cells)
        flat = cells[inside, 1] * self._width + cells[inside, 0]
        into.append(np.stack((flat, ticks[inside]), axis=1))

    def _inside(self, cells: _Ints) -> NDArray[np.bool_]:
        x, y = cells[:, 0], cells[:, 1]
        inside: NDArray[np.bool_] = (x >= 0) & (x < self._width) & (y >= 0) & (y < self._height)
        return inside

    def _standing(self, cells: _Ints) -> NDArray[np.bool_]:
        """Which of these cells an obstacle can be on."""
        inside = self._inside(cells)
        inside[inside] = self._free[cells[inside, 1], cells[inside, 0]]
        return inside


def _checked(numbered: _Numbered, since: int, period: int | None) -> _Ints:
    """Tracks of one length, (obstacles, m, 2), checked: each step stays in its cell or ends in one of the eight neighbours.

    Raises
    ------
    SceneError : ``OBSTACLE_SPEED``, a step ends farther away.
    """
    tracks = np.array([track for _, track in numbered], dtype=np.int64)
    length = tracks.shape[1]
    again = length - (period or 1)  # where it goes on after its last tick
    then = np.concatenate((tracks[:, 1:], tracks[:, again : again + 1]), axis=1)
    far = np.abs(then - tracks).max(axis=2, initial=0) > 1
    if far.any():
        which, leg = (int(k) for k in np.argwhere(far)[0])
        a, b = (tuple(place.tolist()) for place in (tracks[which, leg], then[which, leg]))
        raise SceneError(
            "OBSTACLE_SPEED",
            f"obstacle {numbered[which][0]} jumps from {a} to {b} at t = {since + leg + 1}",
            where="obstacle_tracks",
            allowed="one cell a tick, to one of the eight neighbours",
        )
    return tracks


def _rows(parts: list[_Ints], width: int) -> _Ints:
    return np.concatenate(parts) if parts else np.zeros((0, width), dtype=np.int64)


@lru_cache(maxsize=64)
def _offsets(own: tuple[Cell, ...], other: tuple[Cell, ...]) -> _Ints:
    return frozen(np.array(reach_of(own, other), dtype=np.int64))


@lru_cache(maxsize=512)
def _bans(own: tuple[Cell, ...], other: tuple[Cell, ...], dx: int, dy: int) -> _Ints:
    """Steps a point robot must not make while an obstacle steps by (dx, dy); int64, (m, 4).

    Each row: where the robot stands, relative to the obstacle's cell *before* its step, and the robot's step. A
    swap: the robot enters a cell where it would have met the obstacle before, from one where it meets it now. A
    crossing: the two diagonals of a 2x2 block. (:mod:`lampyris.sim.world.world` says the same of footprints.)
    Steps that end on the obstacle itself are forbidden already and left out.
    """
    met = set(reach_of(own, other))
    found = set()
    for x, y in met:  # bits: what is found is sorted below
        here = (x + dx, y + dy)  # met after the obstacle's step
        for ex, ey in _EIGHT:
            to = (here[0] + ex, here[1] + ey)
            if to in met and (to[0] - dx, to[1] - dy) not in met:
                found.add((*here, ex, ey))
        if dx and dy:
            # A cell of the obstacle goes from (x, y) to (x + dx, y + dy).
            found.add((x + dx, y, -dx, dy))
            found.add((x, y + dy, dx, -dy))
    return frozen(np.array(sorted(found), dtype=np.int64).reshape(-1, 4))


@lru_cache(maxsize=256)
def _disc(radius: float) -> tuple[Cell, ...]:
    """Cells whose centre lies within so many cells."""
    far = int(radius)
    span = range(-far, far + 1)
    return tuple((dx, dy) for dy in span for dx in span if dx * dx + dy * dy <= radius * radius)
