"""Footprints, robot files and poses, as a user gives them."""

from __future__ import annotations

import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

import lampyris
from in_process import call
from lampyris.errors import SettingError
from lampyris.model.robot import Robot, footprint_of, rectangle_of
from lampyris.model.scene import Scene

CAR = "rectangle: [1.2, 0.5]\ndrive: ackermann\nturn_radius: 0.9\nv_max: 1.5\n"


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ([(0, 0), (1, 0)], "3 to 64 pairs"),
        ("abc", "3 to 64 pairs"),
        ([(1, 1), (-1, 1), (-1, math.nan), (1, -1)], "3 to 64 pairs"),
        ([(1, 1), (-1, -1), (-1, 1), (1, -1)], "edges 0 and 2 cross"),
        ([(1, 1), (2, 1), (2, 2), (1, 2)], "is not inside"),
        ([(0, 1), (0, -1), (1, 0)], "is not inside"),
        ([(1, 1), (1, 1), (-1, 1), (-1, -1)], "twice in a row"),
        ([(1e-300, 1e-300), (-1e-300, 1e-300), (0, -1e-300)], "twice in a row"),
        ([(1, 1), (-1, 1), (-1, -1), (-1, 1)], "edges"),
        ([(k, 1) for k in range(70)], "3 to 64 pairs"),
    ],
)
def test_an_outline_that_is_none_is_refused(given: object, words: str) -> None:
    with pytest.raises(SettingError, match=words) as caught:
        Robot(footprint=given)  # type: ignore[arg-type]
    assert caught.value.code == "ROBOT_FOOTPRINT"


@pytest.mark.parametrize(("n", "fits"), [(2, False), (3, True), (63, True), (64, True), (65, False)])
def test_an_outline_has_3_to_64_vertices(n: int, fits: bool) -> None:
    turns = 2 * np.pi * np.arange(n) / n
    polygon = np.column_stack((np.cos(turns), np.sin(turns)))
    if fits:
        assert len(footprint_of(polygon)) == n
    else:
        with pytest.raises(SettingError, match="3 to 64"):
            footprint_of(polygon)


def test_a_footprint_has_one_orientation_and_sets_the_radius() -> None:
    square = rectangle_of([2.0, 1.0])
    clockwise = footprint_of(square[::-1])
    assert (
        Robot(footprint=square).radius
        == Robot(footprint=clockwise).radius
        == pytest.approx(math.hypot(1, 0.5))
    )
    area = sum(
        ax * by - bx * ay for (ax, ay), (bx, by) in zip(clockwise, clockwise[1:] + clockwise[:1], strict=True)
    )
    assert area > 0
    assert Robot(footprint=square).inscribed_radius == 0.5
    assert (
        dataclasses.replace(Robot(footprint=square), footprint=clockwise).radius
        == Robot(footprint=square).radius
    )
    assert Robot(radius=9.0, footprint=square).radius == pytest.approx(math.hypot(1, 0.5))


def test_scenes_take_poses() -> None:
    grid = lampyris.Grid(np.zeros((10, 20), dtype=bool), resolution=0.5)
    scene = Scene(grid, start_pose=(1.1, 2.2, 7.0), goal=(19, 0))
    assert scene.start == (2, 5)
    assert scene.start_pose == pytest.approx((1.1, 2.2, 7.0 - 2 * math.pi))
    assert scene.goal_pose is None
    with pytest.raises(SettingError, match="more than once"):
        Scene(grid, start=(0, 0), start_pose=(1.1, 2.2, 0.0), goal=(19, 0))
    with pytest.raises(SettingError, match="three finite numbers"):
        Scene(grid, start_pose=(1.1, 2.2), goal=(19, 0))


def test_plan_of_a_robot_file_prints_poses(tmp_path: Path) -> None:
    (tmp_path / "car.yaml").write_text(CAR)
    np.save(tmp_path / "hall.npy", np.zeros((50, 50), dtype=bool))
    words = f"plan {tmp_path}/hall.npy --resolution 0.4 --robot {tmp_path}/car.yaml --planner lattice".split()
    words += ["--start-m", "2,2,0", "--goal-m", "16,16,1.57"]
    record = json.loads(call(*words, "--set", "weight=1.5", "--json").stdout)
    assert record["status"] == "found"
    poses = np.array(record["poses"])
    assert poses.shape[1] == 3
    assert np.hypot(*(poses[0, :2] - (2, 2))) < 0.4
    assert np.hypot(*(poses[-1, :2] - (16, 16))) < 0.4
    assert 1.0 <= record["bound"] <= 1.5 * (1 + 1e-6)
    assert record["lower_bound_m"] <= record["length_m"] <= record["cost_m"]
    assert record["reversals"] >= 0
    assert record["speed"]["duration"] > 0
    save, csv, picture = (str(tmp_path / name) for name in ("run.yaml", "plan.csv", "plan.png"))
    done = call(*words, "--save-scenario", save, "--csv", csv, "--picture", picture)
    assert done.returncode == 0
    assert "ackermann drive" in done.stdout
    assert Path(picture).stat().st_size > 10_000
    again = json.loads(call("run", save, "--json", "--no-timing").stdout)
    assert again["poses"] == record["poses"]
    assert Path(csv).read_text().startswith("x_m,y_m,yaw,v,gear,t_s")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("rectangle: [1.2]\n", "robot.yaml"),
        ("rectangle: [1.2, -1]\n", "length, width"),
        ("rectangle: [1e-300, 1e-300]\n", "length, width"),
        ("rectangle: [1, 1]\nradius: 0.3\n", "radius and rectangle together"),
        ("drive: tracks\n", "differential"),
        ("footprint: [[1, 1], [2, 2]]\n", "3 to 64 pairs"),
        ("wheels: 4\n", "wheels"),
    ],
)
def test_a_wrong_robot_file_is_named(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "robot.yaml").write_text(text)
    done = call("plan", "env-6", "--robot", str(tmp_path / "robot.yaml"), "--planner", "lattice")
    assert done.returncode == 3
    assert words in done.stderr
    assert "robot.yaml" in done.stderr


def test_verbs_on_cells_drive_a_footprint_as_the_disc_around_it(tmp_path: Path) -> None:
    (tmp_path / "small.yaml").write_text("rectangle: [0.6, 0.4]\n")
    done = {}
    for robot in (f"--robot {tmp_path}/small.yaml", f"--radius {math.hypot(0.3, 0.2)}"):
        found = [
            json.loads(call(*f"{words} {robot} --json --no-timing".split()).stdout)
            for words in (
                "drive env-6 --planner astar --obstacles 0",
                "plan env-6 --planner ad-gso --set min_clearance=1",
                "simulate env-6 --planner astar --obstacles 2",
            )
        ]
        done[robot[:8]] = found
        assert [one.get("outcome", one.get("status")) for one in found] == ["arrived", "found", "arrived"]
    both = [[one.get("t"), one.get("cells"), one.get("robot")] for found in done.values() for one in found]
    assert both[0][:2] == both[3][:2]
    assert both[1][:2] == both[4][:2]
    assert both[2] == both[5]
    grid = lampyris.Grid(np.zeros((9, 20), dtype=bool))
    scene = Scene(grid, (1, 4), (18, 4), robot=Robot(footprint=rectangle_of([0.6, 0.4])))
    assert lampyris.smooth(scene, lampyris.plan(scene, "astar")).s[-1] == pytest.approx(17.0)


@pytest.mark.nightly
def test_motions_of_more_than_a_thousand_cells_are_refused(tmp_path: Path) -> None:
    for radius, code in ((2000.0, 0), (1e5, 5)):
        (tmp_path / "wide.yaml").write_text(f"rectangle: [1, 1]\ndrive: ackermann\nturn_radius: {radius}\n")
        words = f"plan guide --robot {tmp_path}/wide.yaml --planner lattice --start-m 2.5,9.5,0 --goal-m 3.5,9.5,0"
        done = call(*words.split())
        assert done.returncode in ((0, 4) if code == 0 else (5,)), done.stderr
    assert "LATTICE_REACH" in done.stderr


def test_verbs_on_cells_refuse_a_planner_of_poses() -> None:
    done = call("simulate", "env-6", "--planner", "lattice")
    assert done.returncode == 2
    assert "lattice plans poses" in done.stderr
