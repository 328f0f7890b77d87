"""Compiled periods: the same drive as period by period, whole, stopped anywhere, and looked at in between."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest

from lampyris import CancelToken, Crossing, Patrol, RandomWalk, Recorded, Scene
from lampyris._core import cancellation
from lampyris.kernels.simulation import drive as kernel
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.planning import registry
from lampyris.sim.continuous import compiled_periods
from lampyris.sim.continuous.control import Decision
from lampyris.sim.continuous.drive import DriveSimulation
from lampyris.sim.sensor import FaultySensor
from reference.kernel_forms import use

WALLS = np.zeros((14, 16), dtype=bool)
WALLS[4, 2:9] = WALLS[9, 6:14] = True
TRAFFIC: dict[str, tuple[Any, ...]] = {
    "nobody": (),
    "walkers": (RandomWalk(14),),
    "two kinds of walkers": (RandomWalk(5), RandomWalk(3, radius=0.4)),
    "all kinds": (Recorded(tuple((1 + min(t, 13), 12) for t in range(20))), Crossing(2), Patrol(((2, 2), (9, 2))), RandomWalk(4)),
}  # fmt: skip


def simulation(traffic: str, seed: int, law: str = "physical", **settings: Any) -> DriveSimulation:
    """From one corner of a small map to the other."""
    given = {"time_limit": 25.0, "patience": 1.0, "on_hit": "go-on", **settings}
    scene = Scene(Grid(WALLS), (0, 0), (15, 13), robot=Robot(radius=0.3), traffic=TRAFFIC[traffic])
    return DriveSimulation(scene, registry.make("astar", {}), law=law, seed=seed, **given)


def by_period(run: DriveSimulation) -> Drive:
    """The whole drive by the loop in Python."""
    while run.outcome is None:
        run.step()
    return run.drive()


def differ(a: Drive, b: Drive) -> list[str]:
    """The fields in which two drives differ, to the last bit."""
    found = []
    for one in fields(a):
        x, y = getattr(a, one.name), getattr(b, one.name)
        if one.name == "timing":
            continue
        if isinstance(x, np.ndarray):
            found += [] if x.tobytes() == y.tobytes() else [one.name]
        elif x != y:
            found.append(one.name)
    return found


@pytest.fixture
def codes(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """What the kernel, in its plain form, has returned."""
    use(monkeypatch, "plain")
    seen: list[int] = []
    sound = kernel.advance

    def advance(*args: Any) -> int:
        seen.append(sound(*args))
        return seen[-1]

    monkeypatch.setattr(kernel, "advance", advance)
    return seen


@pytest.mark.parametrize(
    ("traffic", "law", "settings"),
    [
        ("walkers", "physical", {}),
        ("two kinds of walkers", "physical", {"obstacle_speed": 1.3, "period": 0.3}),
        ("all kinds", "physical", {}),
        ("walkers", "optimum", {"obstacle_speed": 0.4}),
        ("walkers", "dissertation", {"time_limit": 10.0}),
        ("nobody", "physical", {}),
    ],
)
def test_compiled_periods_are_the_loop(
    traffic: str, law: str, settings: dict[str, Any], codes: list[int]
) -> None:
    made = by_period(simulation(traffic, 3, law, **settings))
    assert not codes
    assert not differ(simulation(traffic, 3, law, **settings).run(), made)
    assert codes
    assert (kernel.DECIDE_TICK in codes) == (traffic == "all kinds")
    assert kernel.DECIDE in codes or law != "dissertation"


def test_a_drive_is_the_same_stopped_anywhere(codes: list[int]) -> None:
    made = by_period(simulation("walkers", 5))
    rng = np.random.default_rng(5)
    run = simulation("walkers", 5)
    while run.outcome is None:
        if rng.random() < 0.4:
            run.step()
        else:
            run.advance(int(rng.integers(1, 9)))
        assert run.drive().t[-1] <= made.t[-1]
    assert not differ(run.drive(), made)
    assert codes


@pytest.mark.parametrize(
    ("traffic", "law", "after"),
    [("walkers", "dissertation", 5), ("walkers", "dissertation", 40), ("all kinds", "physical", 0)],
)
def test_a_drive_that_is_cancelled_can_go_on(
    traffic: str, law: str, after: int, codes: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was left between two states where the law decides in Python: obstacles and log stayed behind the robot."""
    made = by_period(simulation(traffic, 3, law, time_limit=10.0))
    run, stop, decisions = simulation(traffic, 3, law, time_limit=10.0), CancelToken(), [0]
    decide = DriveSimulation.decide

    def counted(self: DriveSimulation, seconds: float) -> Decision:
        decisions[0] += 1
        if decisions[0] == after:
            stop.set()
        return decide(self, seconds)

    monkeypatch.setattr(DriveSimulation, "decide", counted)
    if after == 0:
        stop.set()
    with pytest.raises(cancellation.Cancelled), cancellation.watching(stop=stop):
        run.run()
    assert run.outcome is None
    assert not differ(run.run(), made)
    assert codes


def test_progress_is_reported_now_and_then(codes: list[int]) -> None:
    told: list[float] = []
    made = simulation("nobody", 1).run(told.append)
    assert told == sorted(told)
    assert told[-1] == made.t[-1]
    assert len(told) > 3


def test_what_the_kernel_does_not_know_is_left_to_the_loop(codes: list[int]) -> None:
    assert compiled_periods.supported(simulation("walkers", 1))
    unknown: list[dict[str, Any]] = [
        {"noise": 0.1},
        {"tracking": "velocity"},
        {"sensor": FaultySensor("nan", 1.0)},
    ]
    for settings in unknown:
        run = simulation("walkers", 1, time_limit=1.0, **settings)
        assert not compiled_periods.supported(run)
        run.run()
    assert not codes
