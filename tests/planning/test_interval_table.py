"""Safe intervals that are changed from call to call are those that are made anew."""

from __future__ import annotations

import threading
import weakref
from collections.abc import Iterator

import numpy as np
import pytest

from lampyris.kernels.spacetime.timed_search import NEVER, clean
from lampyris.model.change import ObstacleTrack
from lampyris.model.moves import MOVES
from lampyris.planning.field.footprint import footprint
from lampyris.planning.spacetime import interval_table
from lampyris.planning.spacetime.interval_table import MOST_TICK, IntervalTable
from lampyris.planning.spacetime.prediction import Forecaster
from lampyris.planning.spacetime.search import TimedSearch, Timetable
from lampyris.planning.spacetime.search_room import LASTING_STATES, ROOM, StateRoom, _shrink
from lampyris.typing import BoolGrid, Cell

OWN = ((0, 0),)
STEPS = 8


def walk(free: BoolGrid, begin: Cell, length: int, rng: np.random.Generator) -> list[Cell]:
    """So many cells after one, by single steps."""
    height, width = free.shape
    x, y = begin
    track = []
    for dx, dy in rng.integers(-1, 2, (length, 2)).tolist():
        x, y = min(max(x + dx, 0), width - 1), min(max(y + dy, 0), height - 1)
        track.append((x, y))
    return track


def said(
    table: Timetable, cells: int, first: int, last: int
) -> tuple[list[list[bool]], set[tuple[int, int]]]:
    """Of every cell and tick whether a robot may be there, and all forbidden steps that end then."""
    safe, bans = [], set()
    for cell in range(cells):
        s = int(table.slot[cell])
        ticks = [s < 0] * (last + 1 - first)
        if s >= 0:
            for i in range(int(table.first[s]), int(table.first[s + 1])):
                assert table.owner[i] == cell
                for t in range(max(int(table.begin[i]), first), min(int(table.end[i]), last) + 1):
                    ticks[t - first] = True
            codes = table.ban[table.barred[s] : table.barred[s + 1]].tolist()
            assert codes == sorted(codes)
            bans |= {(cell, code) for code in codes if code >= first * STEPS}
        safe.append(ticks)
    return safe, bans


class Story:
    """Tracks that become longer, others that come, go and turn, call by call."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.free = self.rng.random((9, 11)) >= 0.15
        self.free[0, 0] = self.free[-1, -1] = True
        body = footprint(1.0, 1.0)
        self.bodies = [body if k % 3 == 2 else OWN for k in range(6)]
        self.tracks = [tuple(self.more((k, k), 1 + 4 * (k % 2))) for k in range(6)]
        self.tick = 0

    def more(self, begin: Cell, length: int) -> list[Cell]:
        """A track from near a cell."""
        return walk(self.free, begin, length, self.rng)

    def seen(self) -> list[ObstacleTrack]:
        """What is seen at the next call."""
        rng = self.rng
        what = rng.integers(6)
        if what in (0, 1, 2):  # all of some length, or all, become longer
            length = len(self.tracks[int(rng.integers(len(self.tracks)))])
            ticks = int(rng.integers(1, 5))
            self.tracks = [
                (*track, *self.more(track[-1], ticks)) if what == 0 or len(track) == length else track
                for track in self.tracks
            ]
        elif what == 3:  # one is another
            k = int(rng.integers(len(self.tracks)))
            self.tracks[k] = tuple(self.more((5, 5), len(self.tracks[k])))
        self.tick = max(self.tick + int(rng.integers(-1, 3)), 0)
        found = [
            ObstacleTrack(k, track, 0, 1, self.bodies[k])
            for k, track in enumerate(self.tracks)
            if rng.random() < 0.98
        ]
        for k in range(int(rng.integers(4))):
            begin = (int(rng.integers(11)), int(rng.integers(9)))
            found.append(ObstacleTrack(10 + k, (begin, *self.more(begin, 1)), max(self.tick - 1, 0), None))
        if rng.random() < 0.2:
            there = self.more((3, 3), 4)
            found.append(ObstacleTrack(20, (*there, *there[-2:0:-1]), 0, 6))
        return found


@pytest.mark.parametrize("seed", range(12))
def test_changed_is_as_made_anew(seed: int) -> None:
    story = Story(seed)
    search = TimedSearch(story.free, MOVES["octile"], (10, 8), None)
    kept = Forecaster(story.free, OWN, guess="velocity", growth=0.0)
    table = IntervalTable(search)
    for call in range(14):
        seen, horizon = story.seen(), call % 3
        standing = {10: 3}
        changed = table.table(*kept.forecast(seen, story.tick, horizon, 20, standing))
        fresh = Forecaster(story.free, OWN, guess="velocity", growth=0.0)
        other = search.again()
        anew = other.timetable(fresh.forbidden(seen, story.tick, horizon, 20, standing))
        assert (changed.still, changed.horizon) == (anew.still, anew.horizon)
        last = 70 if anew.horizon > 2**39 else anew.horizon
        cells, first = 11 * 13, story.tick + 1
        assert said(changed, cells, first, last) == said(anew, cells, first, last)
        one, two = (
            who.by_intervals(what, (0, 0), story.tick, None)
            for who, what in ((search, changed), (other, anew))
        )
        assert (one.ending, one.expansions, one.cut) == (two.ending, two.expansions, two.cut)
        if (
            one.cells is not None
            and two.cells is not None
            and one.ticks is not None
            and two.ticks is not None
        ):
            assert one.cells.tolist() == two.cells.tolist()
            assert one.ticks.tolist() == two.ticks.tolist()


def test_longer_tracks_change_their_cells_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Six ticks more of one obstacle lay out at most the cells that it covers then, and the one where it was."""
    free = np.ones((40, 40), dtype=np.bool_)
    search = TimedSearch(free, MOVES["octile"], (39, 39), None)
    rng = np.random.default_rng(3)
    tracks = [tuple(walk(free, (20, 20), 60, rng)) for _ in range(5)]
    kept, table = Forecaster(free, OWN, guess="velocity", growth=0.0), IntervalTable(search)
    laid: list[int] = []
    right = interval_table.intervals
    monkeypatch.setattr(
        interval_table,
        "intervals",
        lambda at, ends, cells: (laid.append(len(cells)), right(at, ends, cells))[1],
    )

    def call(tick: int) -> None:
        seen = [ObstacleTrack(k, track, 0, 1) for k, track in enumerate(tracks)]
        table.table(*kept.forecast(seen, tick, 2, 0))

    call(0)
    call(1)
    assert len(laid) == 1
    whole = laid[0]
    tracks = [(*track, *walk(free, track[-1], 6, rng)) for track in tracks]
    call(2)
    assert len(laid) == 2
    assert laid[1] <= 5 * (1 + 6 + 2 * 6) < whole


def test_waste_is_laid_out_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """An obstacle that goes to and fro in two cells for long: what nothing refers to any more does not add up."""
    monkeypatch.setattr(interval_table, "WASTE", 50)
    free = np.ones((5, 5), dtype=np.bool_)
    search = TimedSearch(free, MOVES["octile"], (4, 4), None)
    kept, table = Forecaster(free, OWN, guess="velocity", growth=0.0), IntervalTable(search)
    track: tuple[Cell, ...] = ((1, 1),)
    for tick in range(60):
        track = (*track, (1 + tick % 2, 1))
        found = table.table(*kept.forecast([ObstacleTrack(0, track, 0, 1)], tick, 2, 0))
        anew = Forecaster(free, OWN, guess="velocity", growth=0.0).forbidden(
            [ObstacleTrack(0, track, 0, 1)], 0, 2, 0
        )
        assert said(found, 49, tick + 1, 70) == said(search.again().timetable(anew), 49, tick + 1, 70)
        assert len(found.begin) <= 3 * 70 + 50


@pytest.mark.parametrize(("budget", "goal"), [(None, (19, 19)), (25, (19, 19)), (None, (3, 0))])
def test_a_search_leaves_its_room_clean(budget: int | None, goal: Cell) -> None:
    """Found, stopped by its budget, or in vain; cleaning has the price of what was searched, not of all there is room for."""
    free = np.ones((20, 20), dtype=np.bool_)
    search = TimedSearch(free, MOVES["octile"], goal, None)
    seen = [ObstacleTrack(0, ((3, 0),), 0, 1)]
    forbidden = Forecaster(free, OWN, guess="velocity", growth=0.0).forbidden(seen, 0, 2, 0)
    search.by_intervals(search.timetable(forbidden), (0, 0), 0, budget)
    room = ROOM.kept
    assert room is not None
    assert (room.arrive.min(), room.arrive.max()) == (NEVER, NEVER)
    assert (room.done.max(), room.place.max(), room.heap[0]) == (0, 0, 0)
    large = StateRoom.of(1 << 18)
    assert clean.price((large.arrive, large.done, large.heap, large.place, 9)) < 1_000_000


def test_large_room_goes_with_the_search_that_used_it_last() -> None:
    """47 MB once stayed with a thread after its last session."""
    free = np.ones((100, 100), dtype=np.bool_)
    nothing = Forecaster(free, OWN, guess="velocity", growth=0.0).forbidden([], 0, 2, 0)

    def used() -> TimedSearch:
        search = TimedSearch(free, MOVES["octile"], (19, 19), None)
        search.by_intervals(search.timetable(nothing), (0, 0), 0, None)
        return search

    first = used()
    second = used()
    room = ROOM.kept
    assert room is not None
    assert len(room.arrive) > LASTING_STATES
    del first  # the second used it last
    assert ROOM.kept is room
    del second, room
    assert ROOM.kept is None
    alone: list[tuple[TimedSearch, weakref.ref[object]]] = []

    def search_alone() -> None:
        search = used()
        assert ROOM.kept is not None
        alone.append((search, weakref.ref(ROOM.kept.arrive)))

    searcher = threading.Thread(target=search_alone)
    searcher.start()
    searcher.join()  # the room of a thread that ended is not kept, whatever lives
    assert alone[0][1]() is None


def test_room_that_is_taken_while_it_is_looked_at_is_not_put_back() -> None:
    """A search may end in another thread. Room put back while it is in use would be lent again in whatever state it is left."""

    class Lent(list[StateRoom]):
        def __iter__(self) -> Iterator[StateRoom]:
            while self:
                yield self.pop()

    for states in (1, 100):
        held = Lent([StateRoom.of(10)])
        _shrink(held, states)
        assert len(held) == 0


def test_arrays_clean_as_the_loops_do() -> None:
    rng = np.random.default_rng(2)
    for _ in range(20):
        room = StateRoom.of(40)
        waiting, expanded = rng.integers(0, 20, 2).tolist()
        states = rng.permutation(40)
        room.heap[1 : waiting + 1], room.heap[0] = states[:waiting], waiting
        room.heap[41 - expanded :] = states[waiting : waiting + expanded]
        touched = states[: waiting + expanded]
        room.arrive[touched], room.done[states[waiting : waiting + expanded]] = 7, 1
        room.place[states[:waiting]] = np.arange(1, waiting + 1)
        given = [np.array(part) for part in (room.arrive, room.done, room.heap, room.place)]
        loops = [part.tolist() for part in given]
        clean.linked()(*loops, expanded)
        assert clean.arrays is not None
        clean.arrays(*given, expanded)
        assert [part.tolist() for part in given] == loops
        assert set(loops[0]) == {NEVER}


def test_ticks_that_are_too_late_are_laid_out_each_time() -> None:
    free = np.ones((5, 5), dtype=np.bool_)
    search = TimedSearch(free, MOVES["octile"], (4, 4), None)
    kept, table = Forecaster(free, OWN, guess="velocity", growth=0.0), IntervalTable(search)
    seen = [ObstacleTrack(0, ((1, 1), (2, 1)), MOST_TICK, 1)]
    found = table.table(*kept.forecast(seen, MOST_TICK, 2, 0))
    route = search.by_intervals(found, (2, 0), MOST_TICK, None)
    assert route.cells is not None
    assert (2, 1) not in [tuple(cell) for cell in route.cells.tolist()]
