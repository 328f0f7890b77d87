"""One default of smoothing: ``plan``, ``speed`` and ``speed_profile`` say one time of one scene."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from bad_inputs.case import inside, run
from lampyris._core.defaults import PROFILE_SMOOTH, SMOOTHING
from lampyris.io.maps.load import load_map
from lampyris.motion.geometry.sampled_path import SampledCellPath, sample_with_corners

LIMITS = [{}, {"a_lat_max": 0.2}, {"turn_radius": 0.4}, {"a_lat_max": 0.05, "turn_radius": 0.6}]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path) -> Iterator[None]:
    with inside(tmp_path):
        yield


def told(*words: str) -> dict[str, Any]:
    done = run(*words, "--json", "--no-timing")
    assert done.exit == 0, done.err
    out = json.loads(done.out)
    assert isinstance(out, dict)
    return out


@pytest.mark.commit(8)
@pytest.mark.parametrize("limits", LIMITS, ids=str)
@pytest.mark.parametrize(
    ("name", "radius", "resolution", "planner"),
    [
        ("env-1", 0.0, 1.0, "ad-gso"),
        ("env-3", 0.15, 0.25, "ad-gso"),
        ("env-3", 0.4, 1.0, "theta-star"),
        ("env-6", 0.2, 0.5, "astar"),
        ("guide", 0.0, 0.1, "dstar-lite"),
        ("maze-31", 0.3, 1.0, "jps"),
    ],
)
def test_plan_speed_and_profile_say_one_duration(
    name: str, radius: float, resolution: float, planner: str, limits: dict[str, float]
) -> None:
    words = [name, "--radius", repr(radius), "--resolution", repr(resolution), "--planner", planner]
    for limit, value in limits.items():
        words += [f"--{limit.replace('_', '-')}", repr(value)]
    planned, driven = told("plan", *words), told("speed", *words, "--laws", "physical,optimum,rpp")
    document = load_map(name)
    assert document.start is not None
    assert document.goal is not None
    robot = lampyris.Robot(radius=radius, **limits)
    grid = lampyris.Grid(document.grid.blocked, resolution=resolution)
    scene = lampyris.Scene(grid, document.start, document.goal, robot=robot)
    plan = lampyris.plan(scene, planner)
    made = lampyris.speed_profile(scene, plan)
    assert planned["speed"]["duration"] == driven["speed"]["duration"] == made.duration
    for key in ("s", "v", "a", "t", "cause"):
        assert planned["speed"][key] == driven["speed"][key], key
    assert driven["speed"]["xy"] == planned["cells"]
    assert driven["path"]["smooth"] == PROFILE_SMOOTH
    corners, way = planned["corners"], driven["path"]
    assert (way["arcs"] + way["stops"], way["stops"]) == (corners["turns"], corners["stops"])
    for law in driven["laws"]:
        assert law["duration_s"] == lampyris.speed_profile(scene, plan, law["law"]).duration
        assert law["peak_lateral"] <= robot.a_lat_max * (1 + 1e-9) or law["law"] == "rpp"


def test_what_is_said_of_corners() -> None:
    words = ("env-3", "--resolution", "0.25")
    for verb in ("plan", "speed"):
        assert "corners: 15 rounded within half a step, 0 stops to turn" in run(verb, *words).out
        stiff = run(verb, *words, "--turn-radius", "1").out
        assert "corners: 0 rounded within half a step, 15 stops to turn" in stiff
    drive = ("drive", *words, "--obstacles", "0", "--smooth", "none")
    assert "corners: 15 rounded, 0 stops to turn" in run(*drive).out
    assert "corners: 0 rounded, 15 stops to turn" in run(*drive, "--turn-radius", "1").out
    free = told(*drive)
    assert free["corners"] == {"turns": 15, "stops": 0}
    assert told(*drive, "--a-lat-max", "0.05")["duration"] > free["duration"] + 5


def test_smooth_means_the_same_for_speed_and_drive() -> None:
    """Three curves of one path, each as long by either verb, and the same words in both help texts."""
    words = ("env-3", "--resolution", "0.25", "--radius", "0.15")
    lengths = []
    for word, meaning in SMOOTHING.items():
        if word == "none":  # `speed` counts the lines between cells; the curve has its corners rounded
            document = load_map("env-3")
            grid = lampyris.Grid(document.grid.blocked, resolution=0.25)
            assert document.start is not None
            assert document.goal is not None
            scene = lampyris.Scene(grid, document.start, document.goal, robot=lampyris.Robot(radius=0.15))
            length = lampyris.smooth(scene, lampyris.plan(scene), method="none").s[-1]
        else:
            length = told("speed", *words, "--smooth", word)["path"]["length_m"]
        run_of = told("drive", *words, "--obstacles", "0", "--smooth", word)
        assert run_of["s"][-1] == pytest.approx(length, rel=1e-9)
        lengths.append(length)
        for verb in ("speed", "drive"):
            assert f"{word}: {meaning}" in " ".join(run(verb, "--help").out.split())
    assert lengths == sorted(set(lengths))


def test_a_corner_leaves_the_path_by_as_much_as_is_said() -> None:
    """A right angle of 1 m cells: an arc of 0.5 m radius passes its corner at (sqrt(2) - 1) 0.5 m."""
    Path("open.txt").write_text("....\n" * 4)
    words = ("open.txt", "--start", "0,0", "--goal", "3,3", "--moves", "four-connected")
    way = told("speed", *words)["path"]
    assert way["arcs"] >= 1
    assert way["deviation_m"] == pytest.approx(0.5 * (np.sqrt(2) - 1), rel=1e-12)
    assert told("speed", *words, "--turn-radius", "1")["path"]["deviation_m"] == 0


def test_the_comparison_measures_the_lateral_acceleration_in_corners() -> None:
    """Of the optimum under a tight limit it is the limit; of a law that minds no robot it is beyond."""
    rows = {row["law"]: row for row in told("speed", "env-3", "--a-lat-max", "0.1", "--laws", "all")["laws"]}
    assert rows["physical"]["peak_lateral"] == pytest.approx(0.1, rel=1e-9)
    assert rows["physical"]["broken"] == []
    assert "lateral" in rows["dissertation"]["broken"]


def test_tracks_are_let_pass_on_planned_cells() -> None:
    plan = told("plan", "env-6")
    x, y = plan["cells"][len(plan["cells"]) // 2]
    Path("t.csv").write_text("x,y\n" + f"{x},{y}\n" * 60 + f"{x},{y - 1}\n{x},{y - 2}\n{x},{y - 3}\n")
    still = told("speed", "env-6")
    met = told("speed", "env-6", "--track", "t.csv")
    assert met["speed"]["duration"] > still["speed"]["duration"] + 5
    assert "moving obstacle 0" in met["speed"]["why"]
    xy, t = np.array(met["speed"]["xy"]), np.array(met["speed"]["t"])
    assert (np.sqrt(((xy[t < 59] - (x, y)) ** 2).sum(axis=1)) >= 0.5 - 1e-6).all()
    assert run("speed", "env-6", "--track", "t.csv", "--csv", "out.csv").exit == 0


def test_a_course_still_draws_taut_and_files_keep_arcs() -> None:
    plan = told("plan", "env-3")
    Path("p.json").write_text(json.dumps(plan))
    assert told("speed", "env-3", "--path", "p.json")["path"]["smooth"] == "arcs"
    pulled = told("speed", "env-3", "--smooth", "straight")
    document = load_map("env-3")
    assert document.start is not None
    assert document.goal is not None
    scene = lampyris.Scene(document.grid, document.start, document.goal)
    course = lampyris.smooth(scene, lampyris.plan(scene))
    assert not isinstance(course, SampledCellPath)
    assert lampyris.speed_profile(scene, course).duration == pulled["speed"]["duration"]
    path = lampyris.plan(scene).path
    assert path is not None
    cells = sample_with_corners(path, 1.0, scene.robot)
    assert pulled["path"]["length_m"] < cells.s[-1]
