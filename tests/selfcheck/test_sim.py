"""The check of simulations: it holds, its monitors agree, and it sees collisions of every kind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris.errors import InternalFault, LampyrisError, LimitError
from lampyris.model.trace import Trace
from lampyris.planning import registry
from lampyris.sim.grid import loop
from lampyris.sim.world.world import Occupancy
from lampyris_selfcheck import runner
from lampyris_selfcheck.check import Ask, Outcome
from lampyris_selfcheck.checks.traffic import sim
from lampyris_selfcheck.checks.traffic import sim_scenes as scenes
from lampyris_selfcheck.checks.traffic.sim import CHECK, faults_of
from lampyris_selfcheck.reference.motion.tick_speed import gains
from sizes import some


def run(kind: str, count: int, first: int = 0) -> Outcome:
    return runner.run(CHECK, Ask(), runner.Range(only=kind, first=first, cases=count)).outcome


@pytest.mark.nightly
@pytest.mark.parametrize(("kind", "count"), some([("edits", 24), ("fast", 60), ("walk", 48), ("drive", 4)]))
def test_it_holds_and_steps_are_made(kind: str, count: int) -> None:
    seen = run(kind, count, first=1)
    assert (seen.cases, seen.failed) == (count, 0), seen.failures
    assert seen.counts["steps"] > 10 * count
    assert seen.counts["arrived"] > 0


@pytest.mark.nightly
def test_a_robot_that_may_step_into_anybody_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Occupancy, "robot_may", lambda self, step: True)
    seen = run("walk", 60)
    assert seen.failed >= 5
    assert any("monitor" in f.what and "referee" in f.what for f in seen.failures)


def some_trace(seed: int, **how: object) -> Trace:
    rng = np.random.default_rng(seed)
    scene = scenes.drawn_scene(rng, "random-walk", **how)  # type: ignore[arg-type]
    return loop.run(scene, registry.make("astar", {}), seed=seed, patience=15)


@pytest.mark.nightly
@pytest.mark.parametrize("sizes", [{}, {"robot_radius": 0.8, "body_radius": 1.2}])
def test_the_monitor_sees_traces_that_were_tampered_with(sizes: dict[str, float]) -> None:
    """One body is moved a cell at one tick, at random: whatever the referee refuses, the monitor names."""
    broken = 0
    for seed in range(40):
        trace = some_trace(seed, **sizes)
        assert faults_of(trace) == ""
        rng = np.random.default_rng((seed, 1))
        k, t = int(rng.integers(len(trace.tracks))), int(rng.integers(1, trace.ticks + 1))
        tracks = [track.copy() for track in trace.tracks]
        tracks[k][t] += rng.integers(-1, 2, 2).astype(np.int32)
        said = faults_of(replace(trace, tracks=tuple(tracks)))
        assert "referee: " not in said or "monitor: " in said, (seed, k, t)
        broken += "monitor: " in said
    assert 10 < broken < 40


@pytest.mark.nightly
def test_the_kernel_and_the_loop_are_compared_in_crowds() -> None:
    seen = run("crowd", 60)
    assert (seen.cases, seen.failed) == (60, 0), seen.failures
    assert seen.counts["compared with the loop"] > 40


@pytest.mark.parametrize(
    ("law", "speed", "fine"),
    [
        ("dissertation", [0.0, 20.0, 0.0, 28.0], True),
        ("dissertation", [0.0, 20.0, 0.0, 28.1], False),
        ("dissertation", [0.0, 20.0, 1.0, 28.0], False),
        ("physical", [0.0, 1.0, 0.0, 2.0**0.25], True),
        ("physical", [0.0, 1.0, 0.0, 1.2], False),
        ("physical", [0.0, 1.1, 0.0, 1.0], False),
    ],
)
def test_speeds_may_be_no_more_than_the_law_gains(law: str, speed: list[float], fine: bool) -> None:
    cells = [(0, 0), (1, 0), (1, 0), (2, 1)]
    assert (gains(cells, speed, law, 0.5, 1.0) == []) is fine


def test_an_exception_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*args: object, **more: object) -> None:
        raise IndexError("no such body")

    monkeypatch.setattr(loop, "Simulation", broken)
    seen = run("walk", 5)
    assert (seen.cases, seen.failed) == (5, 5)
    assert seen.failures[0].what == "IndexError: no such body"


@pytest.mark.parametrize("fault", [InternalFault("PLAN_START", "elsewhere"), LimitError("LIMIT", "too much")])
def test_no_error_of_ours_counts_as_a_refusal(monkeypatch: pytest.MonkeyPatch, fault: LampyrisError) -> None:
    def broken(*args: object, **more: object) -> None:
        raise fault

    monkeypatch.setattr(loop, "Simulation", broken)
    seen = run("walk", 3)
    assert (seen.cases, seen.failed) == (3, 3)


def test_every_map_is_monitored_and_compared_in_turn() -> None:
    scenes_of = sim.RUNS_A_SCENE * len(sim.MAPS)
    for stride in (sim.MONITORED["fast"], sim.COMPARED):
        every = {(k // sim.RUNS_A_SCENE) % len(sim.MAPS) for k in range(0, stride * scenes_of, stride)}
        assert every == set(range(len(sim.MAPS)))


def test_the_comparison_of_kernel_and_loop_sees_any_field() -> None:
    trace = some_trace(3)
    assert sim.difference(trace, trace) == ""
    robot = trace.robot.copy()
    robot[-1] += 1
    assert sim.difference(trace, replace(trace, robot=robot)) == "robot"
    assert sim.difference(trace, replace(trace, detail="else")) == "detail"
