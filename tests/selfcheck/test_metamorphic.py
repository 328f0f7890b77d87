"""Each of the eleven relations can fail: for each, an answer that breaks it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lampyris.errors import SettingError
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.planning.spacetime import session as _timed_session
from lampyris_selfcheck.check import Ask, Outcome, Part
from lampyris_selfcheck.checks.changes import metamorphic
from lampyris_selfcheck.checks.changes import metamorphic_draw as draw
from lampyris_selfcheck.checks.changes import metamorphic_maps as maps
from lampyris_selfcheck.checks.changes import metamorphic_motion as motion
from lampyris_selfcheck.checks.changes.metamorphic_draw import PLAIN
from sizes import some

# What a wrong planner would make of the cost of a way.
WRONG: dict[str, Callable[[int, Scene], int]] = {
    "costlier to the east": lambda cost, scene: cost + PLAIN * scene.start[0],
    "cheaper among walls": lambda cost, scene: cost - int(scene.grid.blocked.sum()),
    "costlier on wide maps": lambda cost, scene: cost + PLAIN * scene.grid.width,
    "costlier by a step": lambda cost, _: cost + PLAIN,
}
SEEN_BY = [
    ("rotate", "costlier to the east"),
    ("reflect", "costlier to the east"),
    ("swap", "costlier to the east"),
    ("pad blocked", "costlier on wide maps"),
    ("wall more", "cheaper among walls"),
    ("wall less", "cheaper among walls"),
    ("off the way", "cheaper among walls"),
    ("scale", "costlier by a step"),
]


def ask(kind: str, cases: int = 120) -> Outcome:
    return metamorphic.run(Ask(), Part(kind, 0, cases))


def test_there_are_eleven() -> None:
    assert len(metamorphic.KINDS) == 11
    assert all(kind.what and kind.commit == 200 for kind in metamorphic.KINDS.values())


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize(("kind", "defect"), some(SEEN_BY, 4))
def test_a_wrong_planner_is_seen(kind: str, defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = draw.ask_with

    def wrong(chosen: Any, scene: Scene) -> draw.SearchAnswer:
        told = right(chosen, scene)
        return replace(told, cost=WRONG[defect](told.cost, scene)) if told.word == "found" else told

    assert not ask(kind).failed
    monkeypatch.setattr(draw, "ask_with", wrong)
    assert ask(kind).failed


@pytest.mark.nightly
@pytest.mark.parametrize(("kind", "defect"), some(SEEN_BY, 4))
def test_a_wrong_field_is_seen(kind: str, defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = draw.field_of

    def wrong(scene: Scene) -> Any:
        costs = right(scene)
        out = costs.copy()
        for y, x in np.argwhere(costs >= 0).tolist():
            out[y, x] = max(0, WRONG[defect](int(costs[y, x]), replace(scene, start=(x, y))))
        return out

    for room in (maps, motion):
        monkeypatch.setattr(room, "field_of", wrong)
    assert ask(kind).failed


@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["rotate", "swap", "pad blocked"])
def test_a_wrong_verdict_is_seen(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    right = draw.ask_with

    def wrong(chosen: Any, scene: Scene) -> draw.SearchAnswer:
        told = right(chosen, scene)
        return draw.SearchAnswer("no-path", -1) if told.word == "found" and scene.start[0] % 2 else told

    monkeypatch.setattr(draw, "ask_with", wrong)
    assert ask(kind).failed


def test_a_planner_that_is_not_exact_and_too_good(monkeypatch: pytest.MonkeyPatch) -> None:
    right = draw.ask_with

    def wrong(chosen: Any, scene: Scene) -> draw.SearchAnswer:
        told = right(chosen, scene)
        return replace(told, cost=told.cost - 1) if chosen.name == "theta-star" else told

    monkeypatch.setattr(draw, "ask_with", wrong)
    monkeypatch.setattr(draw, "own", lambda optimal: ("theta-star",))
    seen = ask("rotate", 40)
    assert seen.failed
    assert all("theta-star" in f.what for f in seen.failures)


@pytest.mark.nightly
def test_a_crowd_that_is_overlooked(monkeypatch: pytest.MonkeyPatch) -> None:
    right = _timed_session.Forecaster.forbidden

    def forbidden(self: Any, bodies: Any, *rest: Any) -> Any:
        return right(self, bodies if len(bodies) < 3 else [], *rest)

    monkeypatch.setattr(_timed_session.Forecaster, "forbidden", forbidden)
    assert ask("mover more", 600).failed


@pytest.mark.nightly
def test_a_robot_that_takes_fright_at_its_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    right = motion.api.speed_profile

    def profile(scene: Scene, plan: Any, law: str) -> Any:
        robot = scene.robot
        made = right(scene, plan, law)  # type: ignore[arg-type]
        return SimpleNamespace(duration=made.duration * (robot.v_max + robot.a_max + robot.d_max))

    monkeypatch.setattr(motion.api, "speed_profile", profile)
    assert ask("quicker").failed


@pytest.mark.nightly
def test_a_robot_that_is_refused_only_when_it_is_quicker(monkeypatch: pytest.MonkeyPatch) -> None:
    right = motion.api.speed_profile

    def profile(scene: Scene, plan: Any, law: str) -> Any:
        if max(scene.robot.v_max, scene.robot.a_max, scene.robot.d_max) > 2.5:
            raise SettingError("ROBOT_LIMIT", "too quick", where="robot", allowed="less")
        return right(scene, plan, law)  # type: ignore[arg-type]

    monkeypatch.setattr(motion.api, "speed_profile", profile)
    seen = ask("quicker")
    assert "ROBOT_LIMIT with a greater" in seen.failures[0].what


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["off the way", "quicker"])
def test_most_cases_compare_something(kind: str) -> None:
    """Three in ten of them did not, or one in two."""
    seen = ask(kind, 50)
    assert not seen.failed
    says = sum(n for word, n in seen.counts.items() if word.startswith(metamorphic.SAYS[kind]))
    assert says >= 45, seen.counts


@pytest.mark.nightly
def test_a_file_that_is_read_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    right = motion.load_map

    def load(path: str) -> Any:
        grid = right(path).grid
        return SimpleNamespace(grid=Grid(grid.blocked[::-1]) if path.endswith(".npy") else grid)

    monkeypatch.setattr(motion, "load_map", load)
    seen = ask("relabel", 60)
    assert seen.failed
    assert all(".npy" in f.what for f in seen.failures)


@pytest.mark.nightly
def test_an_order_that_matters(monkeypatch: pytest.MonkeyPatch) -> None:
    right = _timed_session.Forecaster.forbidden

    def forbidden(self: Any, bodies: Any, *rest: Any) -> Any:
        return right(self, bodies[1:], *rest)

    monkeypatch.setattr(_timed_session.Forecaster, "forbidden", forbidden)
    assert ask("relabel", 60).failed


def test_an_exception_is_a_failure_and_no_end(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any) -> draw.SearchAnswer:
        raise RuntimeError("out of order")

    monkeypatch.setattr(draw, "ask_with", broken)
    seen = ask("rotate", 5)
    assert (seen.cases, seen.failed) == (5, 5)
