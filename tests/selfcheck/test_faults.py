"""The check of the fail-safe: it holds; a robot that does not brake, or too late, or breaks down is seen."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lampyris.errors import SceneError
from lampyris.model.trace import Outcome as Ending
from lampyris.sim import sensor as feed
from lampyris.sim.continuous.control import Decision
from lampyris.sim.continuous.drive import DriveSimulation
from lampyris.sim.sensor import FAULTS, SensorMonitor
from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.traffic import faults
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes
from lampyris_selfcheck.checks.traffic.faults import CHECK, SPOILS


def run(kind: str, count: int, first: int = 0) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, first=first, cases=count)).outcome


@pytest.mark.nightly
@pytest.mark.parametrize("kind", FAULTS)
def test_it_holds(kind: str) -> None:
    seen = run(kind, 4, first=100)
    assert (seen.cases, seen.failed) == (4, 0), seen.failures
    assert seen.counts["noticed"] >= 3


@pytest.mark.nightly
def test_every_way_to_spoil_a_message_is_tried() -> None:
    seen = run("garbage", len(SPOILS))
    assert not seen.failures
    assert {name for name in SPOILS if seen.counts.get(name)} == set(SPOILS)
    assert seen.counts["messages spoilt"] > 20


@pytest.mark.nightly
@pytest.mark.parametrize("number", [945, 1761, 1773, 2241])
def test_a_message_that_lists_more_obstacles_than_there_are_names_nobody_of_them(number: int) -> None:
    """The nightly found it: the drive said that the robot waits for obstacle 6 of six, from 0."""
    seen = run("garbage", 1, first=number)
    assert seen.counts["twice"] == 1
    assert not seen.failures


@pytest.mark.nightly
def test_it_sees_a_robot_that_trusts_everything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        SensorMonitor, "hear", lambda self, now, messages, robot, moving: _deaf(self, messages)
    )
    for kind in ("stops", "duplicates", "back-in-time"):
        assert run(kind, 6).failed >= 4, kind


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["nan", "missing", "jumps", "in-robot"])
def test_it_sees_a_robot_that_notices_late(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of an obstacle of its own too: when that was wrong, the moment was not judged."""
    sound = SensorMonitor.hear
    wrong: dict[int, int] = {}

    def slow(self: SensorMonitor, now: float, messages: list[Any], robot: Any, moving: bool) -> str:
        told = sound(self, now, messages, robot, moving)
        wrong[id(self)] = wrong.get(id(self), 0) + 1 if told else 0
        return told if wrong[id(self)] > 4 else ""

    monkeypatch.setattr(SensorMonitor, "hear", slow)
    assert any("what began at" in f.what for f in run(kind, 12).failures)


@pytest.mark.nightly
@pytest.mark.parametrize("kind", ["nan", "missing"])
def test_it_sees_a_robot_that_never_gives_up(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = DriveSimulation._end

    def end(self: DriveSimulation, outcome: Ending, detail: str) -> None:
        sound(self, Ending.TIMEOUT if outcome is Ending.STOPPED else outcome, detail)

    monkeypatch.setattr(DriveSimulation, "_end", end)
    assert any("the fault lasts for good" in f.what for f in run(kind, 8).failures)


def test_a_scene_refused_for_another_reason_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuses(*args: Any, **more: Any) -> Any:
        raise SceneError("START_OUTSIDE", "(0, 0)", where="start", allowed="a cell")

    monkeypatch.setattr(faults, "drive", refuses)
    monkeypatch.setattr(scenes, "drive", refuses)
    for kind in ("nan", "garbage"):
        assert run(kind, 2).failed == 2
    with pytest.raises(SceneError, match="START_OUTSIDE"):
        scenes.harsh_drive(np.random.default_rng(1), 1)


def _deaf(watch: SensorMonitor, messages: list[Any]) -> str:
    for message in messages[-1:]:
        watch._note(message)
        watch.last = message
    return ""


@pytest.mark.nightly
def test_it_sees_a_robot_that_brakes_half_as_hard(monkeypatch: pytest.MonkeyPatch) -> None:
    sound = DriveSimulation._decide

    def tired(self: DriveSimulation, period: float) -> Decision:
        found = sound(self, period)
        return Decision(0.5 * found.a, found.cause, found.cause_index) if found.cause == "no data" else found

    monkeypatch.setattr(DriveSimulation, "_decide", tired)
    assert run("stops", 8).failed >= 4


@pytest.mark.nightly
def test_it_sees_messages_that_break_the_robot_down(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(feed, "_nonsense", lambda message: "")
    seen = run("garbage", 3 * len(SPOILS))
    assert seen.failed >= 2
    assert any("Error" in f.what for f in seen.failures)


def test_an_exception_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*args: Any, **more: Any) -> Any:
        raise KeyError("no such obstacle")

    monkeypatch.setattr(faults, "drive", broken)
    assert run("nan", 2).failed == 2
