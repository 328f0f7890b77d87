"""``lampyris compare`` and ``lampyris speed`` with planners of poses, for a robot with a footprint."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

import lampyris
from bad_inputs.case import Outcome, inside, run

CAR = "footprint: [[1.0, 0.4], [-0.4, 0.4], [-0.4, -0.4], [1.0, -0.4]]\ndrive: ackermann\nturn_radius: 2.0\n"
ENDS = ("--start-m", "3.5,5.5,0", "--goal-m", "16.5,9.5,1.5707963")


@pytest.fixture(scope="module")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a map of 20 x 14 m with a wall in the middle, and a car."""
    folder = tmp_path_factory.mktemp("room")
    blocked = np.zeros((14, 20), dtype=np.uint8)
    blocked[9:, 10] = 1
    np.save(folder / "room.npy", blocked)
    (folder / "car.yaml").write_text(CAR)
    return folder


def call(folder: Path, verb: str, *words: str) -> Outcome:
    with inside(folder):
        return run(verb, "room.npy", "--robot", "car.yaml", *ENDS, *words)


def test_planners_of_poses_are_compared_by_length_bound_and_reversals(room: Path) -> None:
    done = call(
        room, "compare", "--planners", "lattice,pad,astar", "--json", "--no-timing", "--picture", "c.svg"
    )
    told = json.loads(done.out)
    lattice, pad, disc = told["rows"]
    robot = lampyris.Robot(
        footprint=[(1.0, 0.4), (-0.4, 0.4), (-0.4, -0.4), (1.0, -0.4)], drive="ackermann", turn_radius=2.0
    )
    grid = lampyris.load_grid(room / "room.npy")
    scene = lampyris.Scene(grid, start_pose=(3.5, 5.5, 0.0), goal_pose=(16.5, 9.5, 1.5707963), robot=robot)
    for row in (lattice, pad):
        path = lampyris.plan(scene, row["planner"]).pose_path
        assert path is not None
        assert row["length_m"] == pytest.approx(path.length_m)
        assert (row["bound"], row["reversals"]) == (pytest.approx(path.bound), path.reversals)
        assert 1.0 <= row["bound"] <= 1.5 + 1e-9
    assert (disc["found"], disc["bound"], disc["reversals"]) == (1, None, None)
    assert disc["length_m"] > 0.0
    assert "bound" in (room / "c.svg").read_text()


def test_the_table_has_columns_of_poses_and_says_what_is_bounded(room: Path) -> None:
    done = call(room, "compare", "--planners", "lattice")
    head = next(line for line in done.out.splitlines() if line.startswith("planner"))
    assert {"length (m)", "bound", "reversals"} <= set(head.split("\t"))
    assert not {"cost", "gap (%)"} & set(head.split("\t"))
    assert "ackermann robot" in done.out
    assert "no path costs less" in done.out


def test_among_obstacles_they_drive_in_continuous_time(room: Path) -> None:
    words = ("--planners", "lattice,astar", "--obstacles", "1", "--json", "--no-timing", "--picture", "d.svg")
    told = json.loads(call(room, "compare", *words).out)
    assert told["kind"] == "drive"
    assert told["rows"][0]["arrived"] == 1
    assert told["rows"][0]["time_s"] > 5.0
    assert (room / "d.svg").stat().st_size > 1000
    for wrong in (("--planners", "lattice", "--ticks", "9"), ("--planners", "lattice-sipp")):
        assert call(room, "compare", *wrong, "--obstacles", "1").exit == 2


def test_laws_are_compared_on_a_path_of_poses(room: Path) -> None:
    files = ("--csv", "s.csv", "--picture", "s.svg", "--chart", "s2.svg")
    told = json.loads(call(room, "speed", "--planner", "lattice", "--json", "--no-timing", *files).out)
    path = told["path"]
    assert 1.0 <= path["bound"] <= 1.5 + 1e-9
    assert np.allclose(path["poses"][0], (3.5, 5.5, 0.0))
    assert np.allclose(path["poses"][-1][:2], (16.5, 9.5))
    assert path["given_m"] == pytest.approx(path["length_m"])
    times = {row["law"]: row["duration_s"] for row in told["laws"]}
    assert times["optimum"] <= times["physical"]
    with (room / "s.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert float(rows[0]["yaw"]) == pytest.approx(0.0)
    assert float(rows[-1]["yaw"]) == pytest.approx(1.5707963, abs=1e-6)
    assert float(rows[-1]["t_s"]) == pytest.approx(times["physical"])
    assert "robot to scale" in (room / "s.svg").read_text()


@pytest.mark.parametrize("words", [("--smooth", "arcs"), ("--track", "t.csv")])
def test_options_of_paths_of_cells_are_refused(room: Path, words: tuple[str, str]) -> None:
    (room / "t.csv").write_text("x,y\n3,3\n")
    done = call(room, "speed", "--planner", "lattice", *words)
    assert done.exit == 2
    assert "lattice, which plans poses" in done.err
