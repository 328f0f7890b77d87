"""The check of planning among moving obstacles can fail: each kind of mistake of a planner is seen."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lampyris import api
from lampyris.model.change import Change
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.profile import Profile
from lampyris.planning.spacetime import session as _timed_session
from lampyris.planning.spacetime.session import TimedSession
from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.traffic import moving, moving_cases
from lampyris_selfcheck.reference.paths.timed import EIGHT, Body, arrivals, earliest, nearest2
from sizes import some


def ask(kind: str, first: int, cases: int) -> Outcome:
    return moving.run(Ask(), Part(kind, first, cases))


@pytest.mark.nightly
def test_there_are_as_many_cases_as_it_says() -> None:
    assert len(moving_cases.questions(3, 2, 2)) == moving.TWO_PATROLS
    assert len(moving_cases.questions(3, 3, 1)) == moving.ONE_PATROL


@pytest.mark.nightly
@pytest.mark.parametrize("kind", some(["one patrol", "turned about", "two patrols"]))
def test_a_sample_of_what_the_commit_size_leaves_out(kind: str) -> None:
    seen = ask(kind, 40_000, 300)
    assert (seen.cases, seen.failed) == (300, 0)


def test_a_part_that_begins_anywhere_says_the_same() -> None:
    whole = ask("two patrols", 20_000, 60)
    halves = ask("two patrols", 20_000, 23) + ask("two patrols", 20_023, 37)
    assert whole.counts == halves.counts
    assert {"drives", "never"} <= set(whole.counts)


def test_the_search_for_all_goals_is_the_search_for_one() -> None:
    for free, start, goal, ways in moving_cases.questions(3, 3, 1)[100_000:150_000:997]:
        bodies: list[Body] = [(moving_cases.place(way, 2), ((0, 0),)) for way in ways]
        first = arrivals(free, EIGHT, False, start, bodies, period=2)
        assert first.get(goal) == earliest(free, EIGHT, False, start, goal, bodies, until=18)


def test_the_least_distance_of_two_points() -> None:
    assert nearest2((0, 0), (1, 0), (1, 0), (0, 0)) == 0  # a swap
    assert nearest2((0, 0), (1, 1), (1, 0), (0, 1)) == 0  # two diagonals of a block
    assert float(nearest2((0, 0), (1, 0), (1, 0), (0, 1))) == pytest.approx(0.2)
    assert nearest2((0, 0), (1, 0), (3, 4), (4, 4)) == 25  # side by side


# ---- planners that are wrong ------------------------------------------------------------------------------


def answering(monkeypatch: pytest.MonkeyPatch, wrong: Callable[[Plan], Plan]) -> None:
    right = TimedSession.plan

    def plan(self: TimedSession, change: Change | None = None, budget: Any = None) -> Plan:
        return wrong(right(self, change, budget))

    monkeypatch.setattr(TimedSession, "plan", plan)


def later(plan: Plan) -> Plan:
    return plan if plan.schedule is None else replace(plan, schedule=plan.schedule + 1)


def late_at_the_goal(plan: Plan) -> Plan:
    if plan.schedule is None or len(plan.schedule) < 2:
        return plan
    schedule = plan.schedule.copy()
    schedule[-1] += 1
    return replace(plan, schedule=schedule)


def gives_up(plan: Plan) -> Plan:
    if plan.schedule is None or len(plan.schedule) == plan.schedule[-1] + 1:
        return plan
    return Plan(Status.HEMMED_IN, plan.planner)


def takes_a_short_cut(plan: Plan) -> Plan:
    if plan.path is None or plan.schedule is None or len(plan.schedule) < 3:
        return plan
    path = path_of(plan.path.cells[[0, 0, -1]][1:], plan.path.moves) if _near(plan) else plan.path
    return replace(plan, path=path, schedule=plan.schedule[:2] if _near(plan) else plan.schedule)


def _near(plan: Plan) -> bool:
    assert plan.path is not None
    return bool((abs(plan.path.cells[-1] - plan.path.cells[0]) <= 1).all())


def raises(plan: Plan) -> Plan:
    raise RuntimeError("out of order")


@pytest.mark.nightly
@pytest.mark.parametrize("wrong", [later, late_at_the_goal, gives_up, takes_a_short_cut, raises])
@pytest.mark.parametrize("kind", some(["two patrols", "drawn", "gates"]))
def test_wrong_answers_fail(
    kind: str, wrong: Callable[[Plan], Plan], monkeypatch: pytest.MonkeyPatch
) -> None:
    answering(monkeypatch, wrong)
    assert ask(kind, 20_000, 400 if kind == "two patrols" else 60).failed


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["two patrols", "drawn"])
def test_who_does_not_mind_swaps_and_crossings_makes_them(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = _timed_session.Forecaster.forbidden

    def forbidden(self: Any, *args: Any) -> Any:
        found = right(self, *args)
        return replace(found, steps=found.steps[:0])

    monkeypatch.setattr(_timed_session.Forecaster, "forbidden", forbidden)
    seen = ask(kind, 20_000, 400 if kind == "two patrols" else 100)
    assert seen.failed
    assert any(word in f.what for f in seen.failures for word in ("swap", "cross", "arrives"))


@pytest.mark.nightly
def test_a_drive_that_does_not_wait_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    right = api.speed_profile

    def hasty(scene: Any, path: Any, *, tick_seconds: float) -> Profile:
        made = right(scene, path, tick_seconds=tick_seconds)
        return Profile(
            made.law, made.s, made.v * 4, made.a * 16, made.t / 4, made.cause, made.units, made.cause_index
        )

    assert not ask("driven", 0, 20).failed
    monkeypatch.setattr(api, "speed_profile", hasty)
    assert ask("driven", 0, 20).failed


def test_a_gap_is_that_of_the_motion() -> None:
    """Against samples, a thousand times as many as there are nodes."""
    from lampyris.model.grid import Grid
    from lampyris.model.robot import Robot
    from lampyris.model.scene import Scene
    from lampyris.model.traffic import Recorded
    from lampyris.motion.timing.obstacle_tracks import tracks_from_recorded
    from lampyris.motion.timing.scheduled import divided
    from lampyris_selfcheck.checks.traffic.moving_drive import least_gap
    from lampyris_selfcheck.reference.motion.path_time import least_gap as sampled

    down = Recorded(tuple((3, y) for y in range(7)), radius=0.2)
    scene = Scene(Grid(np.zeros((7, 7), bool)), (0, 3), (6, 4), robot=Robot(radius=0.2), traffic=(down,))
    plan = api.plan(scene, "sipp")
    for tick in (0.5, 1.0, 2.0):
        made = api.speed_profile(scene, plan, tick_seconds=tick)
        tracks = tracks_from_recorded(scene.traffic, tick, 1.0)
        assert plan.path is not None
        dense = sampled(made, divided(plan.path, 1.0, scene.robot), tracks, 0.2, dense=40_001)
        gap, whom, _ = least_gap(made, plan, scene, tick)
        assert whom == 0
        assert gap <= dense + 1e-9
        assert gap == pytest.approx(dense, abs=1e-3)
