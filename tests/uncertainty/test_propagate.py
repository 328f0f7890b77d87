"""Uncertain settings of a planned drive: names, ranges, outcomes, energy."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import LampyrisError
from lampyris.model.profile import Profile
from lampyris.uncertainty.energy import GRAVITY, EnergyModel, energy_of, energy_of_drive, length_of_drive
from lampyris.uncertainty.propagate import propagate_uncertainty

ROBOT = lampyris.Robot(radius=0.2)


def corridor(length: int = 12) -> lampyris.Scene:
    """A straight drive, no wall near."""
    return lampyris.Scene(lampyris.Grid(np.zeros((9, length), bool)), (0, 4), (length - 1, 4), robot=ROBOT)


def test_the_mean_time_of_a_straight_drive_is_that_of_its_integral() -> None:
    made = propagate_uncertainty(
        corridor(), {"v_max": (0.5, 1.0)}, planner="astar", law="optimum", tolerance=1e-4
    )
    times = [
        lampyris.speed_profile(
            lampyris.Scene(corridor().grid, (0, 4), (11, 4), robot=lampyris.Robot(radius=0.2, v_max=v)),
            lampyris.plan(corridor(), "astar"),
            "optimum",
        ).duration
        for v in (np.arange(40) + 0.5) / 80 + 0.5
    ]
    assert made.mean == pytest.approx(float(np.mean(times)), rel=1e-3)
    assert made.sd == pytest.approx(float(np.std(times)), rel=0.02)
    assert made.unit == "s"
    assert made.sobol["v_max"].first == pytest.approx(1.0)


def test_settings_of_every_owner_are_found_by_name() -> None:
    walls = np.zeros((9, 12), bool)
    walls[3, 4:8] = True
    scene = lampyris.Scene(lampyris.Grid(walls), (0, 4), (11, 4), robot=ROBOT)
    made = propagate_uncertainty(
        scene,
        {
            "d-max": "0.8:1.2",
            "law.creep": "0.1:0.2",
            "rolling": "normal(0.02,0.001)",
            "planner.creep": "0.1:0.2",
        },
        of="energy",
        planner="fastest-time",
        tolerance=0.1,
    )
    assert set(made.sobol) == {"d-max", "law.creep", "rolling", "planner.creep"}
    assert made.unit == "J/kg"
    assert made.sobol["rolling"].total > 0.1


@pytest.mark.parametrize(
    ("vary", "more", "words"),
    [
        ({"v_mx": "1:2"}, {}, "did you mean v_max"),
        ({"creep": "0.1:0.2"}, {"planner": "fastest-time"}, "one of several"),
        ({"v_max": "0:2"}, {}, r"vary\.v_max: 0 to 2"),
        ({"radius": "normal(0.2,0.1)"}, {}, r"vary\.radius: -0\.4 to 0\.8"),
        ({"v_max": "1:2", "robot.v_max": "1:2"}, {}, "given twice"),
        ({"v_max": 3}, {}, "a distribution"),
        ({"v_max": "1:2"}, {"of": "arrived"}, "changes in steps"),
        ({"v_max": "1:2"}, {"law": "dissertation"}, "no metres and seconds; allowed: blind, cloud"),
        ({"radius": "0.1:5"}, {}, r"no path in the run with radius="),
        ({}, {}, "1 to 12"),
    ],
)
def test_what_cannot_vary_is_refused(vary: dict[str, Any], more: dict[str, Any], words: str) -> None:
    walls = np.zeros((9, 12), bool)
    walls[0], walls[8] = True, True
    scene = lampyris.Scene(lampyris.Grid(walls), (0, 4), (11, 4), robot=ROBOT)
    with pytest.raises(LampyrisError, match=words):
        propagate_uncertainty(scene, vary, **{"planner": "astar", **more})


def test_the_energy_of_a_drive_is_that_of_its_speeds() -> None:
    robot = lampyris.Robot(a_max=0.5, d_max=1.0)
    s, v, t = np.array([0.0, 1.0, 3.0, 3.5]), np.array([0.0, 1.0, 1.0, 0.0]), np.array([0.0, 2.0, 4.0, 5.0])
    profile = Profile("physical", s, v, np.array([0.5, 0.0, -1.0, 0.0]), t, ("limit",) * 4, "m/s")
    rolling = 0.015 * GRAVITY * 3.5
    assert energy_of(profile, robot, EnergyModel()) == pytest.approx(0.5 + rolling)
    assert energy_of(profile, robot, EnergyModel(recovered=0.6)) == pytest.approx(0.2 + rolling)
    # From rest to rest over 1 m: up to sqrt(2 / 3) m/s, in 3 v seconds.
    peak = math.sqrt(2.0 / 3.0)
    short = Profile(
        "physical",
        np.array([0.0, 1.0]),
        np.zeros(2),
        np.zeros(2),
        np.array([0.0, 3 * peak]),
        ("goal",) * 2,
        "m/s",
    )
    want = 0.5 * peak * peak + 0.015 * GRAVITY
    assert energy_of(short, robot, EnergyModel()) == pytest.approx(want, rel=1e-6)


@pytest.mark.nightly
def test_drives_do_not_depend_on_the_workers() -> None:
    grid = lampyris.Grid(np.zeros((1, 6), dtype=bool))
    scene = lampyris.Scene(grid, (0, 0), (5, 0))
    one, two = (
        lampyris.propagate_uncertainty(scene, {"v_max": (0.8, 1.2)}, planner="astar", runs=40, workers=n)
        for n in (1, 2)
    )
    assert one == two
    assert one.sample.tobytes() == two.sample.tobytes()


def test_a_drive_among_obstacles_takes_what_the_simulator_says() -> None:
    scene, off = corridor(6), lampyris.Patrol([(2, 2), (3, 2)])
    made = propagate_uncertainty(
        scene,
        {"v_max": (0.8, 1.2)},
        planner="astar",
        traffic=off,
        method="monte-carlo",
        monte_carlo_runs=20,
        seed=3,
    )
    assert (made.method, made.runs) == ("monte-carlo", 20)
    ends = []
    for v_max in (0.8, 1.2):
        fast = replace(scene, robot=replace(scene.robot, v_max=v_max))
        drive = lampyris.drive(fast, "astar", traffic=off, seed=3, obstacle_speed=scene.robot.v_max)
        assert energy_of_drive(drive, EnergyModel()) > 0.5 * float(drive.v.max()) ** 2
        assert math.isclose(length_of_drive(drive), float(drive.curves[0].length), abs_tol=0.05)
        ends.append(drive.duration)
    assert ends[1] <= made.sample.min() < made.sample.max() <= ends[0]
    lane = lampyris.Scene(lampyris.Grid(np.zeros((1, 8), dtype=bool)), (0, 0), (7, 0), robot=ROBOT)
    with pytest.raises(LampyrisError, match="drives that arrive"):
        propagate_uncertainty(lane, {"v_max": (0.8, 1.2)}, planner="astar", traffic=lampyris.Patrol([(4, 0)]))
