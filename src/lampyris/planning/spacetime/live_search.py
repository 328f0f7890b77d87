"""Live search: SIPP's answer to a simulation that asks at every tick, without a plan made of it.

Among obstacles of one cell of which no more is known than their last step; see :mod:`lampyris.kernels.spacetime.live_search`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.kernels.simulation.asking import (
    ASKED_STATE,
    KNOWN,
    PER_ANSWER,
    ROUTE_CELLS,
    SPENT,
    advance_sipp,
)
from lampyris.kernels.spacetime.live_search import live_search
from lampyris.kernels.spacetime.timed_search import FOUND
from lampyris.model.change import Change
from lampyris.planning.base import AnswersInTicks, NextSteps, SensedNow
from lampyris.planning.spacetime.search import TimedSearch, TimedSearchResult
from lampyris.planning.spacetime.search_room import StateRoom
from lampyris.typing import BoolGrid, Cell

MOST_STAYS = 1000
"""Ticks for which one that has been standing may stay, at most."""
MOST_CELLS = 1 << 20
"""Cells of a map up to which there is room for each session of its own, 50 bytes a cell."""

SMALL = 1 << 15
"""Cells of a map up to which there is room for a route through all of them."""

_Ints = NDArray[np.int64]


class LiveSearch:
    """Searches of one session on one map.

    Parameters
    ----------
    search : the map, laid out.
    walkable : bool (height, width); where obstacles can be.
    horizon, margin, forecast : settings of the session.

    Attributes
    ----------
    search : as given.
    spent : states that the last search expanded.
    """

    def __init__(
        self, search: TimedSearch, walkable: BoolGrid, horizon: int, margin: int, forecast: str
    ) -> None:
        self.search = search
        self.spent = 0
        self._stride = walkable.shape[1] + 2
        inside = search.inside()
        self._map = (
            search.walkable(walkable),
            inside,
            self._stride,
            search.kinds,
            *search.ground,
        )
        self._answers: AnswersInTicks | None = None
        self._settings = (horizon, int(forecast == "velocity"), MOST_STAYS, margin)
        self._horizon = horizon
        # On large maps hardly any route is as long as there are cells; for one that is longer room is made.
        cells = len(inside)
        self._route_for(cells if cells <= SMALL else 8 * (self._stride + cells // self._stride))
        self._length = 0
        self._result = np.zeros(8, dtype=np.int64)
        self._now = self._known = 0
        self._make_room(32)

    def make_room(self, obstacles: int) -> None:
        """See that there is room for so many obstacles."""
        if obstacles > self._most:
            noted = self._noted
            self._make_room(2 * obstacles)
            self._noted[:, : noted.shape[1]] = noted

    def _make_room(self, obstacles: int) -> None:
        """Room for so many obstacles."""
        n = len(self._map[1])
        self._most = obstacles
        self._answers = None
        ranges, bans = obstacles * (self._horizon + 4), 3 * obstacles * (self._horizon + 1)
        cells = ranges + bans + 1
        intervals = ranges + cells
        self._noted = np.zeros((2, obstacles), dtype=np.int64)
        touched, first, barred = np.zeros((3, cells + 1), dtype=np.int64)
        begin, end = np.zeros((2, intervals), dtype=np.int64)
        self._room: tuple[Any, ...] = (
            np.full(n, -1, dtype=np.int32), touched, first, begin, end, np.zeros(intervals, dtype=np.int32), barred,
            np.zeros(bans, dtype=np.int64), np.zeros(3, dtype=np.int64), np.zeros(2 * ranges, dtype=np.int64),
            np.zeros(bans, dtype=np.int64), np.zeros(ranges, dtype=np.int64), np.zeros(bans, dtype=np.int64),
        )  # fmt: skip
        states = n + intervals + 1
        self._states: tuple[Any, ...] = StateRoom.of(states)

    def _route_for(self, cells: int) -> None:
        """Room for a route of so many cells."""
        self._route, self._enter = np.zeros((2, cells), dtype=np.int64)
        self._answers = None

    def recall(self, stood: dict[int, tuple[Cell, int]], current: TimedSearchResult | None) -> None:
        """Begin with what the session remembers: since when obstacles have stood where, and the route that is driven."""
        if len(stood) > self._most:
            self._make_room(2 * len(stood))
        self._known = len(stood)
        for obstacle, ((x, y), since) in stood.items():
            self._noted[:, obstacle] = (y + 1) * self._stride + x + 1, since
        self._length = 0
        if current is not None and current.cells is not None and current.ticks is not None:
            x, y = current.cells.astype(np.int64).T
            self._length = len(x)
            if len(x) > len(self._route):
                self._route_for(2 * len(x))
            self._route[: len(x)] = (y + 1) * self._stride + x + 1
            self._enter[: len(x)] = current.ticks

    def noted(self) -> tuple[dict[int, tuple[Cell, int]], TimedSearchResult | None]:
        """What :meth:`recall` takes."""
        cells, since = self._noted[:, : self._known].tolist()
        stood = {
            n: (self.search.cell(cell), first)
            for n, (cell, first) in enumerate(zip(cells, since, strict=True))
        }
        return stood, self.route()

    def route(self) -> TimedSearchResult | None:
        """The route that is driven; None: there is none."""
        if not self._length:
            return None
        y, x = np.divmod(self._route[: self._length], self._stride)
        cells_of = np.empty((self._length, 2), dtype=np.int32)
        cells_of[:, 0], cells_of[:, 1] = x - 1, y - 1
        return TimedSearchResult(FOUND, self.spent, False, cells_of, self._enter[: self._length].copy())

    def answers(self, limit: int) -> AnswersInTicks:
        """For a kernel that asks by itself.

        Parameters
        ----------
        limit : states that an answer may expand; -1: any number.
        """
        if self._answers is None:
            rest = (
                np.zeros(self._most, dtype=np.int64), *self._noted, *self._settings, *self._map, *self._room,
                *self._states, self._route, self._enter, self._result,
            )  # fmt: skip
            asked = np.zeros(ASKED_STATE, dtype=np.int64)
            self._answers = AnswersInTicks(advance_sipp, asked, rest, self._route, self._enter)
        asked = self._answers.asked
        asked[PER_ANSWER], asked[KNOWN], asked[ROUTE_CELLS] = limit, self._known, self._length
        return self._answers

    def answered(self, asked: NDArray[np.int64]) -> None:
        """Take in what a kernel has answered."""
        self._known, self._length, self.spent = (int(asked[at]) for at in (KNOWN, ROUTE_CELLS, SPENT))

    def find(self, seen: SensedNow) -> NextSteps | None:
        """The earliest arrival, or the route that is driven; None where there is none as things are believed."""
        self.make_room(seen.obstacles)
        limit = -1 if seen.limit is None else seen.limit
        live_search(
            seen.where, seen.step_x, seen.step_y, seen.new, seen.obstacles, seen.now, seen.tick, self._known,
            *self._noted, *self._settings, limit, seen.robot, *self._map, *self._room, *self._states,
            self._route, self._enter, self._length, self._result,
        )  # fmt: skip
        self._known = seen.obstacles
        ending, self.spent, _, _, length, *_ = self._result.tolist()
        if ending != FOUND:
            return None
        self._length = length
        return NextSteps(self._route, length - 1, 1, self.spent, self._enter)


def seen_at(change: Change, search: TimedSearch, limit: int | None) -> SensedNow | None:
    """A change as a simulation describes it that asks for next steps; None: it cannot be described so."""
    tracks = change.obstacle_tracks
    if not tracks or change.robot is None:
        return None
    now = tracks[0].since + len(tracks[0].track) - 1
    if not change.tick <= now <= change.tick + 1:
        return None
    rows = []
    for k, one in enumerate(tracks):
        track = one.track
        (x, y), (x0, y0), known = track[-1], track[0], len(track)
        plain = one.obstacle == k and one.period is None and known <= 2 and one.footprint == ((0, 0),)
        plain = plain and abs(x - x0) <= 1 and abs(y - y0) <= 1  # one that jumps is refused, but not here
        if not plain or one.since + known - 1 != now:
            return None
        rows.append((x, y, x - x0, y - y0, known == 1))
    x_of, y_of, step_x, step_y, new = np.array(rows, dtype=np.int64).T.copy()
    where = search.flats(x_of, y_of)
    nothing = np.zeros(1, dtype=np.int64)
    robot = search.flat(change.robot)
    return SensedNow(
        robot, change.tick, now, nothing, 0, where, step_x, step_y, new, len(tracks), True, limit
    )
