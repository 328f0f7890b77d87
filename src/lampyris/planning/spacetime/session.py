"""The session of a planner that sees traffic: forecast, search, and whether a new path is worth the change."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from lampyris._core.settings import check_settings, number, under_name, whole, word
from lampyris._core.values import completed
from lampyris.kernels import loading
from lampyris.kernels.simulation.asking import ANSWERS, FROM
from lampyris.model.change import Change, ObstacleTrack
from lampyris.model.moves import Moves
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk, Recorded
from lampyris.planning.base import AnswersInTicks, Budget, NextSteps, SensedNow, SessionBase
from lampyris.planning.edits import edited
from lampyris.planning.field.footprint import footprint
from lampyris.planning.field.layers import free_cells, free_space, moves_for
from lampyris.planning.graph.grid_graph import check_cells
from lampyris.planning.session_limits import limited
from lampyris.planning.spacetime.intercept import earliest_meeting
from lampyris.planning.spacetime.interval_table import IntervalTable
from lampyris.planning.spacetime.live_search import MOST_CELLS, MOST_STAYS, LiveSearch, seen_at
from lampyris.planning.spacetime.prediction import Forbidden, Forecaster
from lampyris.planning.spacetime.search import (
    FOUND,
    LIMIT,
    TimedSearch,
    TimedSearchResult,
    Timetable,
    shared_search,
)
from lampyris.typing import BoolGrid, Cell

GUESSES = ("velocity", "reach", "still")
TRACKS = ("known", "hidden")
MAX_HORIZON = 1000
PERSISTENCE = 2
"""An obstacle that has been standing for n ticks may stay for so many times n more. Without that a robot
waits forever before one that never moves: it always seems quicker to sit out the horizon than to drive
around. (As long again would do, and would wait twice as long before a long way round.)"""
MOST_UNROLLED = 1 << 17
"""Ticks for which tracks that repeat themselves are written out at most."""


@dataclass(frozen=True, slots=True)
class Timed:
    """What planners that see traffic have in common; their settings.

    Parameters
    ----------
    forecast : what an obstacle does whose future is not known: ``velocity``, it goes on as in its last step;
        ``reach``, it may be wherever it could have walked to; ``still``, it stays.
    horizon : for how many ticks that is believed, 0 to 1000. Beyond it nothing is said of such an obstacle,
        save that one which has been standing may stay for twice as long again. If no path can be found, half
        as many are believed, and so on down to none; with none, standing ones are ignored, too.
    growth : cells a tick by which the disc around a ``velocity`` forecast grows, 0 to 10.
    margin : ticks that a new path must save before the robot leaves one that is still good, 0 to 1000. With 0
        it turns for any gain, and among obstacles that wander it turns often.
    tracks : ``known``: recorded obstacles' tracks are planned with to their ends; ``hidden``: they are
        guessed like the others.

    Raises
    ------
    SettingError : a setting out of its range.
    """

    forecast: str = word("velocity", GUESSES, title="forecast of obstacles")
    horizon: int = whole(2, 0, MAX_HORIZON, unit="ticks", title="forecast horizon")
    growth: float = number(0.0, 0.0, 10.0, unit="cells", title="growth of the forecast")
    margin: int = whole(1, 0, MAX_HORIZON, unit="ticks", title="gain needed for a new path")
    tracks: str = word("known", TRACKS, title="recorded tracks")

    name: ClassVar[str] = ""

    def __post_init__(self) -> None:
        check_settings(self, under_name(self.name))


class TimedSession(SessionBase):
    """A session that knows the tick, remembers the path it is on, and keeps to it where that is as good.

    Parameters
    ----------
    scene : what to plan in. Its recorded obstacles are known to a call that is given none.
    name : the planner's name.
    settings : see :class:`Timed`.
    by_ticks : whether cells and ticks are searched one by one; else safe intervals.
    """

    def __init__(self, scene: Scene, name: str, settings: Timed, *, by_ticks: bool) -> None:
        self._name = name
        self._settings = settings
        self._by_ticks = by_ticks
        self._robot = scene.start
        self._current: TimedSearchResult | None = None
        self._stood: dict[int, tuple[Cell, int]] = {}
        self._live: LiveSearch | None = None
        self._ahead = False  # whether what is remembered is in _live
        self._under_walls: dict[Cell, int] = {}
        self._shares = False
        self._lay(scene)

    def share_map(self) -> None:
        """See :class:`lampyris.planning.base.SessionBase`: the steps and costs to the goal. The first plan is then made as
        :meth:`next_steps` makes it, where that knows how."""
        self._shares = True

    def _lay(self, scene: Scene) -> None:
        check_cells(scene.grid.blocked.size)
        self._scene, self._laid = scene, False
        self._free: BoolGrid = free_space(scene)
        self._moves = _single(moves_for(scene))
        self._search: TimedSearch | None = None
        self._table: IntervalTable | None = None
        own = footprint(scene.robot.radius, scene.grid.resolution)
        walkable = free_cells(scene.grid, 0.0)
        guess, growth = self._settings.forecast, self._settings.growth
        self._forecaster = Forecaster(walkable, own, guess=guess, growth=growth)
        self._laid = True

    def next_steps(self, seen: SensedNow, wanted: int) -> NextSteps | None:
        """What :meth:`plan` would answer; None: it has to be asked.

        The map must be as it was reported last. An answer counts as a call of :meth:`plan`.
        """
        if not seen.live or not seen.obstacles or (seen.limit is not None and seen.limit < 1):
            return None
        live = self._recalled()
        if live is None:
            return None
        found = live.find(seen)
        if found is None:
            self._remember()
        else:
            self._robot = live.search.cell(seen.robot)
        return found

    def answers(self, wanted: int, limit: int | None, obstacles: int, live: bool) -> AnswersInTicks | None:
        """For a kernel that asks as :meth:`next_steps` is asked, among so many obstacles at most; None: it cannot.

        Before any other call :meth:`answered` takes in what it has answered.
        """
        search = self._recalled() if live else None
        return None if search is None else search.answers(-1 if limit is None else limit)

    def first_answers(
        self, wanted: int, limit: int | None, obstacles: int, live: bool
    ) -> tuple[AnswersInTicks, int] | None:
        """The same before the first call, with the states that were expanded to begin with."""
        ends = self._robot, self._scene.goal
        if not live or not all(self._free[y, x] for x, y in ends):
            return None
        self._laid_search()
        search = self._recalled()
        if search is None:
            return None
        search.make_room(obstacles)
        return search.answers(-1 if limit is None else limit), 0

    def answered(self, asked: NDArray[np.int64]) -> None:
        """Take in what a kernel has answered."""
        assert self._live is not None
        self._live.answered(asked)
        if asked[ANSWERS]:
            self._robot = self._live.search.cell(int(asked[FROM]))

    def _recalled(self) -> LiveSearch | None:
        """The search among obstacles of unknown future, with what is remembered; None: it does not know these settings."""
        settings, search = self._settings, self._search
        if search is None or self._by_ticks or not self._laid:
            return None
        if search.steps_left(self._robot) < 0:
            return None  # where walls leave no path, obstacles are not watched
        if settings.growth > 0 or settings.forecast == "reach" or self._free.size > MOST_CELLS:
            return None
        if self._forecaster.own != ((0, 0),):
            return None
        if self._live is None or self._live.search is not search:
            self._remember()
            self._live = LiveSearch(
                search, self._forecaster.free, settings.horizon, settings.margin, settings.forecast
            )
        if not self._ahead:
            self._live.recall(self._stood, self._current)
        self._ahead = True
        return self._live

    def whole_plan(self, change: Change) -> Plan:
        """The plan that the last answer of :meth:`next_steps` is a part of."""
        live = self._live if self._ahead else None
        route = self._current if live is None else live.route()
        spent = 0 if self._live is None else self._live.spent
        assert route is not None
        assert route.cells is not None
        path = path_of(route.cells, self._moves, self._scene.grid.terrain)
        ticks = route.ticks
        return Plan(Status.FOUND, self._name, path, iterations=1, expansions=spent, commit=1, schedule=ticks)

    def _remember(self) -> None:
        """Take back what :meth:`next_steps` has noted."""
        if self._ahead and self._live is not None:
            self._stood, self._current = self._live.noted()
        self._ahead = False

    def drop(self, anywhere: bool) -> str:
        """See :class:`lampyris.planning.session_limits.Limited`."""
        self._laid = self._laid and not anywhere
        return self._name

    @limited
    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        """The earliest arrival among what is known and guessed of the obstacles.

        ``change.obstacle_tracks`` says what is known; without it the cells of ``change.obstacles`` count as taken for
        ever, save the robot's own and the goal; without either, the scene's recorded obstacles are known.

        Raises
        ------
        SceneError : the robot, or a cell of the map said to have changed, is outside the map; ``OBSTACLE_SPEED``, an obstacle
            goes farther than to a neighbour in a tick.
        """
        began = loading.wall()
        self._remember()
        change = change or Change()
        scene = edited(self._scene, change, self._under_walls)
        if change.robot is not None:
            self._robot = (int(change.robot[0]), int(change.robot[1]))
        if scene is not self._scene:
            self._current, self._shares = None, False
        if scene is not self._scene or not self._laid:
            self._lay(scene)
        most = None if budget is None else budget.expansions
        meets = change.goal_track is not None and self._settings.tracks == "known"
        made = self._meeting(change, most) if meets else self._answer(change, most)
        return completed(made, timing={"search_s": loading.wall() - began})

    # ---- the answer --------------------

    def _answer(self, change: Change, budget: int | None) -> Plan:
        start, goal = self._robot, self._scene.goal
        if not self._free[start[1], start[0]]:
            return Plan(Status.START_OCCUPIED, self._name)
        if not self._free[goal[1], goal[0]]:
            return Plan(Status.GOAL_OCCUPIED, self._name)
        first = self._search is None and self._shares
        search = self._laid_search()
        if search.steps_left(start) < 0:
            return Plan(Status.NO_PATH, self._name, iterations=1)
        seen = seen_at(change, search, budget) if first and start != goal else None
        if seen is not None and self.next_steps(seen, 0) is not None:
            return self.whole_plan(change)
        tracks, closed = self._known_obstacles(change)
        self._watch(tracks)
        spent = 0
        believed = self._settings.horizon if any(s.period is None for s in tracks) else 0
        while True:
            left = None if budget is None else budget - spent
            if left is not None and left < 1:
                return self._failed(Status.LIMIT, spent)
            table, route = self._route(tracks, closed, change.tick, believed, left)
            spent += route.expansions
            if route.cells is not None:
                break
            if route.ending == LIMIT:
                return self._failed(Status.LIMIT, spent)
            if believed == 0:
                why = "No path at any time: walls leave one, moving obstacles close it."
                return self._failed(Status.HEMMED_IN, spent, why)
            believed //= 2
        route = self._chosen(table, route, change.tick)
        assert route.cells is not None
        self._current = route
        # Where all is known there is nothing to ask again for; a call that is given no obstacles may yet meet some.
        known = all(s.period is not None for s in tracks)
        settled = known and (change.obstacle_tracks is None or bool(tracks))
        return Plan(
            Status.FOUND,
            self._name,
            path_of(route.cells, self._moves, self._scene.grid.terrain),
            iterations=1,
            expansions=spent,
            commit=None if settled else 1,
            schedule=route.ticks,
        )

    def _laid_search(self) -> TimedSearch:
        """The search on the map as it is, one that sessions share where they may."""
        if self._search is None and self._shares:
            self._search = shared_search(self._scene, self._moves)
        if self._search is None:
            self._search = TimedSearch(self._free, self._moves, self._scene.goal, self._scene.grid.terrain)
        self._shares = False
        return self._search

    def _meeting(self, change: Change, budget: int | None) -> Plan:
        """The earliest meeting with a goal of known track."""
        start, goals = self._robot, change.goal_track
        assert goals
        if not self._free[start[1], start[0]]:
            return Plan(Status.START_OCCUPIED, self._name)
        tracks, closed = self._known_obstacles(change)
        self._watch(tracks)
        guessed = any(s.period is None for s in tracks)
        believed, spent = self._settings.horizon if guessed else 0, 0
        most = self._most_unrolled(tracks) + len(goals)
        unroll = min(len(goals) + 8 * sum(self._free.shape), most)
        while True:
            left = None if budget is None else max(budget - spent, 0)
            forbidden = self._forecaster.forbidden(
                tracks, change.tick, believed, unroll, self._standing(tracks)
            )
            if closed:
                forbidden = _closing(forbidden, closed, change.tick, self._scene.grid.width)
            route = earliest_meeting(self._free, self._moves, start, change.tick, goals, forbidden, left)
            spent += route.expansions
            if route.cells is not None:
                break
            if route.ending == LIMIT:
                return self._failed(Status.LIMIT, spent)
            if route.cut and unroll < most:
                unroll = min(4 * unroll, most)
                continue
            if believed == 0:
                if tracks or closed:
                    why = "Never where the goal is: walls or moving obstacles are in the way at all times."
                    return self._failed(Status.HEMMED_IN, spent, why)
                return self._failed(Status.NO_PATH, spent)
            believed //= 2
        path = path_of(route.cells, self._moves, self._scene.grid.terrain)
        commit = 1 if guessed or closed else None
        return Plan(
            Status.FOUND, self._name, path, iterations=1, expansions=spent, commit=commit, schedule=route.ticks
        )  # fmt: skip

    def _known_obstacles(self, change: Change) -> tuple[list[ObstacleTrack], list[Cell]]:
        """The obstacles of this call, and cells that count as taken forever."""
        if change.obstacle_tracks is None:
            if change.obstacles:
                contains, ends = self._scene.grid.contains, (self._robot, self._scene.goal)
                return [], sorted(c for c in change.obstacles if c not in ends and contains(c))
            resolution = self._scene.grid.resolution
            seen = [
                ObstacleTrack(k, one.track, 0, 1, footprint(one.radius, resolution))
                for k, one in enumerate(self._scene.traffic)
                if isinstance(one, Recorded)
            ]
            # Where these begin is known; where they go is guessed.
            first = len(self._scene.traffic)
            begins = [
                (cell, one.radius)
                for one in self._scene.traffic
                if isinstance(one, RandomWalk)
                for cell in one.starts
            ]
            seen += [
                ObstacleTrack(first + n, (cell,), 0, None, footprint(radius, resolution))
                for n, (cell, radius) in enumerate(begins)
            ]
        else:
            seen = list(change.obstacle_tracks)
        if self._settings.tracks == "hidden":
            now = change.tick + (change.obstacle_tracks is not None and change.tick > 0)
            seen = [_hidden(s, now) for s in seen]
        return seen, []

    def _watch(self, tracks: list[ObstacleTrack]) -> None:
        """Note where each obstacle of unknown future is, and since when."""
        stood = {}
        for seen in tracks:
            if seen.period is None:
                here, since = seen.track[-1], seen.since + len(seen.track) - 1
                for cell in seen.track[-2::-1]:
                    if cell != here:
                        break
                    since -= 1
                known, first = self._stood.get(seen.obstacle, (here, since))
                stood[seen.obstacle] = here, min(first, since) if known == here else since
        self._stood = stood

    def _standing(self, tracks: list[ObstacleTrack]) -> dict[int, int]:
        """The obstacles that have been standing, and for how many ticks more they may."""
        for_ = {}
        for seen in tracks:
            if seen.period is None:
                stood = seen.since + len(seen.track) - 1 - self._stood[seen.obstacle][1]
                if stood > 0:
                    for_[seen.obstacle] = min(PERSISTENCE * stood, MOST_STAYS)
        return for_

    def _route(
        self, tracks: list[ObstacleTrack], closed: list[Cell], tick: int, believed: int, budget: int | None
    ) -> tuple[Timetable, TimedSearchResult]:
        """The earliest arrival; tracks without end are written out for as long as it takes."""
        search = self._search
        assert search is not None
        unrolled = 64 + 4 * search.steps_left(self._robot)
        most = self._most_unrolled(tracks)
        spent = 0
        while True:
            unroll = min(unrolled, most)
            lasting, passing = self._forecaster.forecast(
                tracks, tick, believed, unroll, self._standing(tracks)
            )
            if closed:
                passing = _closing(passing, closed, tick, self._scene.grid.width)
            if self._table is None:
                self._table = IntervalTable(search)
            table = self._table.table(lasting, passing)
            soonest = tick + search.steps_left(self._robot)
            kept = self._kept(table, tick, min(soonest + self._settings.margin, table.horizon))
            if kept is not None:  # no path is shorter than the map alone lets it be
                return table, replace(kept, expansions=spent)
            find = search.by_ticks if self._by_ticks else search.by_intervals
            route = find(table, self._robot, tick, None if budget is None else max(budget - spent, 0))
            spent += route.expansions
            if route.cells is not None or not route.cut or unrolled >= most or route.ending == LIMIT:
                return table, replace(route, expansions=spent)
            unrolled *= 4

    def _most_unrolled(self, tracks: list[ObstacleTrack]) -> int:
        """For how many ticks tracks without end are written out at most."""
        periods = math.lcm(*(s.period for s in tracks if s.period)) if tracks else 1
        longest = max((len(s.track) for s in tracks), default=0)
        return min(int(np.count_nonzero(self._free)) * periods + longest, MOST_UNROLLED)

    def _chosen(self, table: Timetable, found: TimedSearchResult, tick: int) -> TimedSearchResult:
        """The new path, or the one the robot is on if that is still good and the new one saves too little."""
        assert found.ticks is not None
        kept = self._kept(table, tick, int(found.ticks[-1]) + self._settings.margin)
        return found if kept is None else replace(found, cells=kept.cells, ticks=kept.ticks)

    def _kept(self, table: Timetable, tick: int, latest: int) -> TimedSearchResult | None:
        """The rest of the path the robot is on, if that is still good and arrives at tick ``latest`` or before."""
        old = self._current
        search = self._search
        if old is None or old.cells is None or old.ticks is None or search is None:
            return None
        # The robot is on the last cell of the old path that it has entered by now.
        at = int(np.searchsorted(old.ticks, tick, side="right")) - 1
        if at < 0 or (int(old.cells[at, 0]), int(old.cells[at, 1])) != self._robot:
            return None
        cells, ticks = old.cells[at:], old.ticks[at:].copy()
        ticks[0] = tick
        if int(ticks[-1]) > latest or not search.still_good(table, cells, ticks):
            return None
        return TimedSearchResult(FOUND, 0, False, cells, ticks)

    def _failed(self, status: Status, expansions: int, detail: str = "") -> Plan:
        self._current = None
        return Plan(status, self._name, iterations=1, expansions=expansions, detail=detail)


def _hidden(seen: ObstacleTrack, now: int) -> ObstacleTrack:
    """The same obstacle with no more known than where it is at a tick, and where it was the tick before."""
    if seen.period is None:
        return seen
    n, since = len(seen.track), max(now - 1, seen.since)
    ticks = (t - seen.since for t in range(since, max(now, seen.since) + 1))
    places = tuple(seen.track[t if t < n else n - seen.period + (t - n) % seen.period] for t in ticks)
    return replace(seen, track=places, since=since, period=None)


@lru_cache(maxsize=16)
def _single(moves: Moves) -> Moves:
    """The steps of one cell: in a tick a robot moves no farther than an obstacle does."""
    kept = [k for k, (dx, dy) in enumerate(moves.offsets) if max(abs(dx), abs(dy)) == 1]
    if len(kept) == len(moves.offsets):
        return moves
    offsets = tuple(moves.offsets[k] for k in kept)
    return replace(moves, offsets=offsets, costs=tuple(moves.costs[k] for k in kept))


def _closing(forbidden: Forbidden, cells: list[Cell], tick: int, width: int) -> Forbidden:
    """The same with these cells taken forever."""
    rows = np.array([(y * width + x, tick) for x, y in cells], dtype=np.int64).reshape(-1, 2)
    return replace(forbidden, forever=np.concatenate((forbidden.forever, rows)))
