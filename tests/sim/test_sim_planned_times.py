"""Drives that follow planned times: never early, late as little as limits allow, and safe when they are late."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import SettingError, UsageError
from lampyris.model.drive import Drive, PlannedTimes
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.referee.drive import check_drive, measure
from lampyris.report.data.csv import write_drive_csv, write_plan_csv
from sizes import sized

FOOTPRINT = ((1.1, 0.6), (-0.6, 0.6), (-0.6, -0.6), (1.1, -0.6))


def door(**robot: Any) -> Scene:
    """An obstacle stands in a door for 40 ticks and leaves it."""
    walls = np.zeros((17, 40), dtype=bool)
    walls[:, 20] = True
    walls[7:10, 20] = False
    track = [(20, 8)] * 40 + [(20 + k, 8) for k in range(1, 4)] + [(23, 8 - k) for k in range(1, 8)]
    grid = lampyris.Grid(walls, resolution=0.5)
    start, goal = ((*grid.to_metres((x, y)).tolist(), 0.0) for x, y in ((8, 8), (36, 14)))
    return Scene(
        grid,
        start_pose=start,
        goal_pose=goal,
        robot=lampyris.Robot(footprint=[(x / 2, y / 2) for x, y in FOOTPRINT], drive="differential", **robot),
        traffic=lampyris.Recorded(tuple(track), radius=0.2),
    )


def early_at(drive: Drive) -> float:
    """Metres by which the robot is farther than its planned times at most, looked at every hundredth of a second."""
    worst = -math.inf
    for k in range(len(drive.t) - 1):
        table = drive.timetables[drive.leg[k]]
        if table is None:
            continue
        t = np.arange(drive.t[k], drive.t[k + 1], 0.01)
        d = t - drive.t[k]
        s = drive.s[k] + d * (drive.v[k] + 0.5 * drive.a[k] * d)
        worst = max(worst, float((s - table.farthest(t)).max()))
    return worst


@pytest.mark.parametrize("planner", ["lattice-sipp", "pad-sipp"])
def test_a_drive_waits_where_the_plan_waits_and_says_how_late_it_is(planner: str) -> None:
    scene = door(v_max=1.0, a_max=1.0, d_max=1.0)
    plan = lampyris.plan(scene, planner)
    drive = lampyris.drive(scene, planner)
    assert drive.outcome is Outcome.ARRIVED, drive.sentence
    assert check_drive(drive) is None
    assert measure(drive)["collisions"] == 0
    assert early_at(drive) <= 1e-6
    assert plan.pose_path is not None
    assert plan.pose_path.times is not None
    first = drive.timetables[0]
    assert first is not None
    assert first.reach[-1] == pytest.approx(float(plan.pose_path.times[-1, 0]))
    late = drive.lateness
    assert late is not None
    assert 0.0 < late[-1] < 5.0
    assert drive.planned_arrival is not None
    assert drive.duration == pytest.approx(drive.planned_arrival + late[-1], abs=1e-6)


def test_a_plan_for_less_than_the_top_speed_leaves_time_to_catch_up() -> None:
    scene = door(v_max=1.0, a_max=1.0, d_max=1.0)
    full, slow = (lampyris.drive(scene, "lattice-sipp", speed_fraction=f) for f in (1.0, 0.7))
    assert full.outcome is slow.outcome is Outcome.ARRIVED
    assert full.lateness is not None
    assert slow.lateness is not None
    assert slow.lateness[-1] < 0.5 * full.lateness[-1]
    assert early_at(slow) <= 1e-6


def test_planned_times_alone_keep_it_off_the_obstacle() -> None:
    """The law optimum looks at no obstacle: the robot waits before the door because the plan does."""
    scene = door(v_max=1.0, a_max=2.0, d_max=2.0)
    drive = lampyris.drive(scene, "lattice-sipp", law="optimum")
    assert drive.outcome is Outcome.ARRIVED, drive.sentence
    assert check_drive(drive) is None
    assert measure(drive)["collisions"] == 0
    assert "planned time" in drive.cause
    assert drive.replans == 0
    assert drive.lateness is not None
    assert drive.lateness.max() < 1.0
    assert float(np.diff(drive.t)[np.array(drive.cause[:-1]) == "planned time"].sum()) > 10.0
    table = drive.timetables[0]
    assert table is not None
    waits = int((table.leave - table.reach).argmax())
    stood = (drive.v[:-1] == 0.0) & (drive.v[1:] == 0.0)
    assert np.abs(drive.s[:-1][stood] - table.s[waits]).max() <= 0.02 * scene.grid.resolution + 1e-9


@pytest.mark.nightly
@pytest.mark.parametrize("crossings", [5])
def test_a_late_robot_still_touches_nobody(crossings: int) -> None:
    """A slow start makes it miss its gap: it brakes, and asks for new times."""
    walls = np.zeros((9, 30 + 6 * crossings), dtype=bool)
    grid = lampyris.Grid(walls, resolution=0.5)
    start, goal = ((*grid.to_metres((x, 4)).tolist(), 0.0) for x in (3, 26 + 6 * crossings))
    # Crossings that a robot of the planned speed just passes.
    crossing = [
        lampyris.Recorded(
            tuple([(20 + 6 * k, 0)] * (16 + 6 * k) + [(20 + 6 * k, y) for y in range(9)]), radius=0.2
        )
        for k in range(crossings)
    ]
    scene = Scene(
        grid, start_pose=start, goal_pose=goal, traffic=tuple(crossing),
        robot=lampyris.Robot(footprint=[(x / 2, y / 2) for x, y in FOOTPRINT], v_max=1.0, a_max=0.2, d_max=0.2),
    )  # fmt: skip
    drive = lampyris.drive(scene, "lattice-sipp")
    assert check_drive(drive) is None
    assert measure(drive)["collisions"] == 0
    assert drive.lateness is not None
    assert drive.lateness.max() > 1.0
    assert "moving obstacle" in drive.cause


@sized("drives", 2, 200)
def test_random_drives_are_never_early_and_never_in_contact(drives: int) -> None:
    rng = np.random.default_rng(26)
    arrived = timed = 0
    for number in range(drives):
        walls = rng.random((24, 24)) < 0.02
        grid = lampyris.Grid(walls, resolution=0.5)
        ends = [(*rng.uniform(1.0, 11.0, 2).tolist(), float(rng.uniform(-3, 3))) for _ in range(2)]
        tracks = []
        for band in range(3):  # rows of its own for each: tracks must not meet
            low, high = 8 * band, 8 * band + 6
            x, y = int(rng.integers(0, 24)), int(rng.integers(low, high + 1))
            track = [(x, y)]
            for _ in range(40):
                dx, dy = rng.integers(-1, 2, 2).tolist()
                for _ in range(int(rng.integers(1, 5))):
                    to = (min(max(track[-1][0] + dx, 0), 23), min(max(track[-1][1] + dy, low), high))
                    track.append(track[-1] if walls[to[1], to[0]] else to)
            away = max(abs(x - ends[0][0] * 2), abs(24 - y - ends[0][1] * 2))
            if away > 5 and not walls[y, x]:
                tracks.append(lampyris.Recorded(tuple(track), radius=0.2))
        kind = ("differential", "ackermann", "omnidirectional")[number % 3]
        scene = Scene(
            grid, start_pose=ends[0], goal_pose=ends[1], traffic=tuple(tracks),
            robot=lampyris.Robot(
                footprint=[(x / 2, y / 2) for x, y in FOOTPRINT], drive=kind, turn_radius=0.8, v_max=1.0,
                a_max=float(rng.uniform(0.3, 2.0)), d_max=float(rng.uniform(0.3, 2.0)),
            ),
        )  # fmt: skip
        tracking = ("perfect", "velocity", "position")[number // 3 % 3]
        late = {} if tracking == "perfect" else {"tracking": tracking, "delay": 0.1}
        drive = lampyris.drive(
            scene,
            "pad-sipp" if number % 2 else "lattice-sipp",
            seed=number,
            time_limit=60.0,
            on_hit="go-on",
            **late,
        )
        assert check_drive(drive) is None
        assert measure(drive).get("collisions", 0) == 0
        if drive.timetables:
            timed += 1
            assert early_at(drive) <= 1e-5
        arrived += drive.outcome is Outcome.ARRIVED
    assert timed >= drives // 2
    assert arrived >= drives // 3


def test_the_referee_refuses_a_robot_that_is_early() -> None:
    drive = lampyris.drive(door(v_max=1.0, a_max=1.0, d_max=1.0), "lattice-sipp")
    table = drive.timetables[0]
    assert table is not None
    late = PlannedTimes(table.s, table.reach + 1.0, table.leave + 1.0)
    found = check_drive(replace(drive, timetables=(late, *drive.timetables[1:])))
    assert found is not None
    assert found.rule == "planned times"


def test_what_times_do_not_go_with_is_refused() -> None:
    scene = door(v_max=1.0)
    with pytest.raises(UsageError, match="does not keep these"):
        lampyris.drive(scene, "lattice-sipp", law="rpp")
    with pytest.raises(UsageError, match="does not keep these"):
        lampyris.drive(scene, "lattice-sipp", controller="mppi")
    with pytest.raises(SettingError, match="obstacle_speed"):
        lampyris.drive(scene, "lattice-sipp", obstacle_speed=0.3)


def test_files_name_planned_times_and_those_of_the_law(tmp_path: Path) -> None:
    scene = door(v_max=1.0, a_max=1.0, d_max=1.0)
    plan = lampyris.plan(scene, "lattice-sipp")
    profile = lampyris.speed_profile(scene, plan)
    write_plan_csv(tmp_path / "plan.csv", plan, profile, scene.grid)
    with (tmp_path / "plan.csv").open() as file:
        rows = list(csv.DictReader(file))
    reach, leave, law = (
        np.array([float(row[name]) for row in rows]) for name in ("planned_reach_s", "planned_leave_s", "t_s")
    )
    assert plan.pose_path is not None
    assert plan.pose_path.times is not None
    assert leave[-1] == pytest.approx(float(plan.pose_path.times[-1, 0]))
    assert (leave - reach).sum() == pytest.approx(float(plan.attributes["waits_s"]), rel=1e-6)
    assert (np.diff(reach) >= -1e-9).all()
    assert law[-1] < leave[-1], "the law knows of no waiting"
    drive = lampyris.drive(scene, "lattice-sipp")
    write_drive_csv(tmp_path / "drive.csv", drive)
    with (tmp_path / "drive.csv").open() as file:
        rows = list(csv.DictReader(file))
    late = np.array([float(row["t_s"]) - float(row["planned_t_s"]) for row in rows])
    assert drive.lateness is not None
    np.testing.assert_allclose(np.maximum(late, 0.0), drive.lateness, atol=1e-9)
