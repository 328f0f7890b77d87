"""Planners that see traffic: the arrival is the earliest there is, nobody is met on the way."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from lampyris.model.change import Change, ObstacleTrack
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner, Session
from lampyris.planning.spacetime.sipp import Sipp
from lampyris.planning.spacetime.space_time_astar import SpaceTimeAStar
from lampyris_selfcheck.check import Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.traffic import moving_drawn as drawn
from lampyris_selfcheck.checks.traffic import moving_gates as gates
from lampyris_selfcheck.checks.traffic.moving_cases import ONE, Question, first_of_group, place, questions
from lampyris_selfcheck.checks.traffic.moving_judge import Judged, fault
from lampyris_selfcheck.reference.paths.timed import EIGHT, Body, Cell, arrivals

PLANNERS: dict[str, Planner] = {"sipp": Sipp(margin=0), "space-time-astar": SpaceTimeAStar(margin=0)}
"""With no margin: a way is left for any gain, so that every answer arrives as early as can be."""

RNG = np.random.default_rng(0)
"""Never drawn from: these planners are deterministic."""

ONE_PATROL, TWO_PATROLS = 154_112, 47_920

KINDS = {
    "two patrols": Kind(
        "every free space of 3 x 2 cells, start, goal and two patrols; the order of the patrols decides which"
        " of the two planners is asked, so both are asked of every two",
        commit=1_500,
        nightly=TWO_PATROLS,
        release=TWO_PATROLS,
        chunk=4_000,
        whole=TWO_PATROLS,
    ),
    "turned about": Kind(
        "the same, the two patrols told in the other order",
        commit=0,
        nightly=TWO_PATROLS,
        release=TWO_PATROLS,
        chunk=4_000,
        whole=TWO_PATROLS,
    ),
    "one patrol": Kind(
        "every free space of 3 x 3 cells, start, goal and patrol; both planners",
        commit=0,
        nightly=ONE_PATROL,
        release=ONE_PATROL,
        chunk=4_000,
        whole=ONE_PATROL,
    ),
    "drawn": Kind(
        "maps of up to 24 x 24, four step sets, terrain, robots and obstacles of some size, obstacles that"
        " end and that go round; both planners, from a session and through the front door",
        commit=50,
        nightly=8_000,
        release=80_000,
        chunk=100,
    ),
    "gates": Kind(
        "two ways, the nearer one shut about as long as the other is longer; and a last step that two bodies"
        " cross: to wait or to go about; both planners, from a session and through the front door",
        commit=60,
        nightly=4_000,
        release=40_000,
        chunk=100,
    ),
    "driven": Kind(
        "a drawn plan driven with real accelerations among its obstacles: every instant's distance",
        commit=10,
        nightly=2_000,
        release=20_000,
        chunk=10,
        least={"driven": 0.7},
    ),
}


def run(ask: Ask, part: Part) -> Outcome:
    """Judge some cases."""
    tally = Tally(part)
    if part.kind not in _DRAWN:
        _every(tally, part)
        return tally.outcome()
    for number in part.numbers:
        try:
            _DRAWN[part.kind](tally, number, ask.rng("moving", part.kind, number))
        except Exception as error:
            tally.case("raised")
            tally.fail(number, f"{type(error).__name__}: {error}")
    return tally.outcome()


_DRAWN: Mapping[str, Callable[[Tally, int, np.random.Generator], None]] = {
    "drawn": lambda tally, number, rng: drawn.judge_plans(tally, number, rng, PLANNERS),
    "driven": lambda tally, number, rng: drawn.judge_drive(tally, number, rng, PLANNERS),
    "gates": lambda tally, number, rng: drawn.judge_asked(tally, number, gates.draw(rng), PLANNERS),
}


def _every(tally: Tally, part: Part) -> None:
    """The cases of an exhaustive kind.

    A session is asked everything that there is of one map, start and goal, one after the other: it may keep
    to the way it is on. A part that begins among them asks those before, too, so that no case depends on it.
    """
    cases = questions(3, 3, 1) if part.kind == "one patrol" else questions(3, 2, 2)
    sessions: dict[str, Session] = {}
    group, truth, least = None, _Truth(), np.inf
    for number in range(first_of_group(cases, part.first), part.first + part.cases):
        asked = cases[number]
        if asked[:3] != group:
            group, sessions = asked[:3], {}
        judged = number >= part.first
        seen: set[str] = set()
        for name in _whom(part.kind, asked):
            try:
                word, wrong, near = _ask(name, asked, part.kind == "turned about", sessions, truth, judged)
            except Exception as error:
                word, wrong, near = "raised", f"{type(error).__name__}: {error}", None
            seen.add(word)
            if judged and wrong:
                tally.fail(number, f"{name}: {wrong}", **_data(asked))
            if near is not None:
                least = min(least, near)
        if judged:
            tally.case(*sorted(seen))
    if least < np.inf:
        tally.measure("least distance of two centres in a part, cells", least)


def _whom(kind: str, asked: Question) -> tuple[str, ...]:
    if kind == "one patrol":
        return tuple(PLANNERS)
    first, second = asked[3]
    return ("sipp",) if (first < second) != (kind == "turned about") else ("space-time-astar",)


class _Truth:
    """Earliest arrivals on every cell, kept for the goals of one map, start and set of patrols."""

    def __init__(self) -> None:
        self._known: dict[tuple[object, ...], dict[Cell, int]] = {}
        self._map: tuple[tuple[bool, ...], ...] = ()

    def arrival(self, asked: Question, bodies: list[Body]) -> int | None:
        free, start, goal, ways = asked
        if free is not self._map:
            self._map, self._known = free, {}
        key = (start, *sorted(ways))
        if key not in self._known:
            self._known[key] = arrivals(free, EIGHT, False, start, bodies, period=2)
        return self._known[key].get(goal)


def _ask(
    name: str, asked: Question, turned: bool, sessions: dict[str, Session], truth: _Truth, judged: bool
) -> tuple[str, str, float | None]:
    """One planner's answer: how it ended, what is wrong with it, and how near anybody came."""
    free, start, goal, ways = asked
    if name not in sessions:
        scene = Scene(Grid(~np.array(free)), start, goal)
        sessions[name] = PLANNERS[name].open(scene, RNG)
    told = ways[::-1] if turned else ways
    seen = tuple(ObstacleTrack(k, way, 0, 2) for k, way in enumerate(told))
    plan = sessions[name].plan(Change(robot=start, obstacle_tracks=seen))
    if not judged:
        return "", "", None
    bodies: list[Body] = [(place(way, 2), ONE) for way in ways]
    want = truth.arrival(asked, bodies)
    wrong, near = fault(Judged(plan, free, EIGHT, False, start, goal, bodies), want)
    return ("never" if want is None else "waits" if _waits(plan.schedule) else "drives"), wrong, near


def _waits(schedule: object) -> bool:
    return schedule is not None and bool((np.diff(np.asarray(schedule)) > 1).any())


def _data(asked: Question) -> dict[str, object]:
    free, start, goal, ways = asked
    rows = ["".join(".#"[not here] for here in row) for row in free]
    return {"rows": rows, "start": start, "goal": goal, "patrols": ways}


CHECK = Check(
    "moving",
    ("G2",),
    "among moving obstacles a plan arrives at the earliest tick there is, and meets nobody",
    KINDS,
    run,
)
