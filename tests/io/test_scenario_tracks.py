"""Recorded tracks from files: CSV, and the .dob files of the SBPL planners."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

import lampyris
from lampyris.errors import FileError, LampyrisError, LimitError, SettingError
from lampyris.io.tracks.csv_tracks import read_track
from lampyris.io.tracks.dob import looks_like, read_dob, recorded
from lampyris.model.grid import Grid
from lampyris.model.traffic import Recorded


def csv(tmp_path: Path, data: bytes | str) -> Path:
    path = tmp_path / "t.csv"
    path.write_bytes(data.encode() if isinstance(data, str) else data)
    return path


# ---- CSV --------------------


@pytest.mark.parametrize(
    ("text", "cells"),
    [
        ("x,y\n1,2\n1,3\n", ((1, 2), (1, 3))),
        ("\ufeffx,y\r\n1,2\r\n\r\n1,3", ((1, 2), (1, 3))),
        (" y , name, x \n 2 ,a, 1 \n3,b,-1\n", ((1, 2), (-1, 3))),
        ('"x","y"\n"+1","2"\n', ((1, 2),)),
        ("x,y,tick\n0,0,0\n0,1,3\n1,1,4\n", ((0, 0), (0, 0), (0, 0), (0, 1), (1, 1))),
        ("x,y,t\n5,5,0.25\n5,6,7\n", ((5, 5), (5, 6))),
    ],
)
def test_what_a_csv_says(tmp_path: Path, text: str, cells: tuple[tuple[int, int], ...]) -> None:
    assert read_track(csv(tmp_path, text)) == cells


def test_the_csv_of_a_simulation_and_of_a_plan_is_a_track(tmp_path: Path) -> None:
    from lampyris.report.data.csv import write_plan_csv, write_trace_csv

    scene = lampyris.Scene(lampyris.load_grid("guide"), (0, 9), (7, 0))
    plan = lampyris.plan(scene)
    write_plan_csv(tmp_path / "p.csv", plan, lampyris.speed_profile(scene, plan), scene.grid)
    assert plan.path is not None
    assert read_track(tmp_path / "p.csv") == tuple(map(tuple, plan.path.cells.tolist()))
    trace = lampyris.simulate(scene, traffic=lampyris.RandomWalk(5), seed=3)
    write_trace_csv(tmp_path / "t.csv", trace)
    assert read_track(tmp_path / "t.csv") == tuple(map(tuple, trace.robot.tolist()))


@pytest.mark.parametrize(
    ("text", "code", "place", "says"),
    [
        ("", "TRACK", "t.csv", "empty file"),
        ("a,y\n1,2\n", "TRACK", "t.csv:1", "no column x"),
        ("x,y,x\n1,2,3\n", "TRACK", "t.csv:1", "more than one column x"),
        ("x,y\n1,2\n1.5,2\n", "TRACK", "t.csv:3", "x is '1.5'"),
        ("x,y\n1\n", "TRACK", "t.csv:2", "y is ''"),
        ("x,y\n1,1_0\n", "TRACK", "t.csv:2", "y is '1_0'"),
        ("x,y\n1,٣\n", "TRACK", "t.csv:2", "whole number"),
        ("x,y\n1,99999999999\n", "TRACK", "t.csv:2", "whole number"),
        ('x,y\n1,"2\n', "TRACK", "t.csv:2", "CSV"),
        (b"x,y\n1,\xff\n", "TRACK", "t.csv:2", "0xff"),
        ("x,y\n", "OBSTACLE_TIME", "t.csv", "empty track"),
        ("x,y,tick\n1,2,1\n", "OBSTACLE_TIME", "t.csv:2", "0 in the first row"),
        ("x,y,tick\n1,2,0\n1,2,5\n1,2,5\n", "OBSTACLE_TIME", "t.csv:4", "at least 6"),
        ("x,y,tick\n1,2,0\n1,2,-1\n", "OBSTACLE_TIME", "t.csv:3", "tick -1"),
        ("x,y,tick\n1,2,0\n1,2,999999999\n", "LIMIT", "t.csv:3", "100,000 ticks"),
        ("x,y,tick\n1,2,half\n", "TRACK", "t.csv:2", "tick is 'half'"),
    ],
)
def test_each_mistake_in_a_csv(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str | bytes, code: str, place: str, says: str
) -> None:
    monkeypatch.chdir(tmp_path)
    csv(tmp_path, text)
    with pytest.raises((FileError, LimitError)) as caught:
        read_track("t.csv")
    assert (caught.value.code, caught.value.where) == (code, place)
    assert says in str(caught.value)


def test_only_regular_files_of_a_sensible_size_are_read(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="FILE_MISSING"):
        read_track(tmp_path / "none.csv")
    with pytest.raises(FileError, match="FILE_KIND"):
        read_track(tmp_path)
    with pytest.raises(FileError, match="FILE_KIND"):
        read_track(os.devnull)
    path = csv(tmp_path, "x,y\n")
    os.truncate(path, 2**24 + 1)
    with pytest.raises(LimitError, match="FILE_TOO_LARGE"):
        read_track(path)


# ---- .dob --------------------

GRID = Grid(np.zeros((10, 10), bool), resolution=0.1)


def dob(*points: str, radius: float = 0.25, stays: int = 0, more: str = "") -> bytes:
    lines = [
        "NumberOfDynamicObstacles: 1", "DynamicObstacleID: 0", f"ObstacleRadius: {radius}",
        "NumberOfTrajectories: 1", "TrajectoryID: 0", "TrajectoryProbability: 1.0",
        f"NumberOfPoints: {len(points)}", *points, f"ObstacleExistsAfterTrajectory: {stays}", more,
    ]  # fmt: skip
    return "\n".join(lines).encode()


def test_points_become_the_cell_at_each_tick() -> None:
    data = dob("0.05 0.05 0.0 0", "0.25 0.05 0.2 0", "0.25 0.25 0.6 0", stays=1)
    assert looks_like(data)
    assert looks_like(b"\xef\xbb\xbf\n " + data)
    assert not looks_like(b"x,y\n1,2\n")
    (one,) = read_dob(data, "d.dob")
    assert (one.radius, one.trajectories, one.spread, one.stays) == (0.25, 1, False, True)
    track, notes = recorded(one, 0, GRID, 0.1, "d.dob")
    # y goes up in metres and down in cells; from 0.2 s on it takes two ticks a cell.
    assert track == Recorded(((0, 9), (1, 9), (2, 9), (2, 8), (2, 8), (2, 7), (2, 7)), 0.25)
    assert notes == ()


def test_points_with_a_z_and_on_the_lines_between_cells() -> None:
    # As the generator of experiments writes them: (column - 1) * resolution, six digits, five numbers.
    points = [f"{k * 0.1:f} {0.0:f} {0:f} {k * 0.1:f} {0:f}" for k in range(10)]
    (one,) = read_dob(dob(*points), "d.dob")
    track, notes = recorded(one, 3, GRID, 0.1, "d.dob")
    assert track.track == tuple((k, 9) for k in range(10))
    assert notes == ("d.dob: obstacle 3: it vanishes at its end; here it stays there",)
    assert 0.3 / 0.1 < 3
    (one,) = read_dob(dob("0.300000 0.700000 0 0"), "d.dob")
    assert recorded(one, 0, GRID, 0.1, "d.dob")[0].track == ((3, 2),)


def test_what_a_recorded_obstacle_cannot_say_is_noted() -> None:
    both = (
        b"NumberOfDynamicObstacles: 1 DynamicObstacleID: 0 ObstacleRadius: 0 NumberOfTrajectories: 2 "
        b"TrajectoryID: 0 TrajectoryProbability: 0.3 NumberOfPoints: 1 0 0 0 0 "
        b"ObstacleExistsAfterTrajectory: 1 "
        b"TrajectoryID: 1 TrajectoryProbability: 0.7 NumberOfPoints: 1 0.5 0.5 2 0.1 "
        b"ObstacleExistsAfterTrajectory: 0"
    )
    (one,) = read_dob(both, "d.dob")
    track, notes = recorded(one, 0, GRID, 1.0, "d.dob")
    assert track.track == ((5, 4), (5, 4), (5, 4))
    said = " ".join(notes)
    for words in ("likeliest of its 2", "standard deviations", "comes at 2 s", "vanishes"):
        assert words in said


def test_a_tick_that_is_too_long_and_one_that_is_too_short() -> None:
    (one,) = read_dob(dob("0 0 0 0", "0.9 0 0.3 0"), "d.dob")
    with pytest.raises(SettingError, match=r"OBSTACLE_SPEED.*d\.dob.*\(0, 9\) to \(3, 9\).*shorter tick_s"):
        recorded(one, 0, GRID, 0.1, "d.dob")
    assert len(recorded(one, 0, GRID, 0.03, "d.dob")[0].track) == 11
    with pytest.raises(SettingError, match=r"OBSTACLE_TIME.*300,000 ticks.*longer tick_s"):
        recorded(one, 0, GRID, 1e-6, "d.dob")


@pytest.mark.parametrize(
    ("data", "code", "says"),
    [
        (dob("0 0 0 0", more="and more"), "DOB", "'and' after 1 obstacle"),
        (dob("0 0 0"), "DOB", "3 numbers for 1 point"),
        (dob("0 0 0 0", "1 1 1 1 1"), "DOB", "9 numbers for 2 points"),
        (dob("0 0 1 0", "0 0 0.5 0"), "OBSTACLE_TIME", "d.dob:9: t = 0.5 s"),
        (dob("0 0 -1 0"), "OBSTACLE_TIME", "t = -1 s"),
        (dob(), "OBSTACLE_TIME", "without points"),
        (dob("0 0 nan 0"), "DOB", "'nan'"),
        (dob("0 0 x 0"), "DOB", "d.dob:8: 'x'; allowed: a number"),
        (dob("0 0 0 0", radius=-1), "DOB", "'-1'"),
        (dob("0 0 0 0", stays=2), "DOB", "0 to 1"),
        (b"NumberOfDynamicObstacles: 1\nDynamicObstacleID: 5", "DOB", "d.dob:2: '5'; allowed: a number, 0"),
        (b"NumberOfDynamicObstacles: 2.5", "DOB", "2.5; allowed: a whole number"),
        (b"NumberOfDynamicObstacles: 99999999", "DOB", "0 to 10000"),
        (b"NumberOfDynamicObstacles: 1", "DOB", "the file ends; allowed: DynamicObstacleID: comes here"),
        (b"NumberOfDynamicObstacles:", "DOB", "the file ends"),
    ],
)
def test_each_mistake_in_a_dob(data: bytes, code: str, says: str) -> None:
    with pytest.raises(FileError) as caught:
        read_dob(data, "d.dob")
    assert caught.value.code == code
    assert says in str(caught.value)


def test_damaged_dobs_give_obstacles_or_a_typed_error() -> None:
    rng = np.random.default_rng(11)
    good = dob("0 0 0 0", "0.1 0 0.1 0", "0.2 0.1 0.2 0")
    read = 0
    for _ in range(2000):
        raw = bytearray(good)
        for _ in range(int(rng.integers(1, 4))):
            at = int(rng.integers(len(raw)))
            raw[at : at + int(rng.integers(3))] = [b"", b" ", b"9", b"-", b"\xff", b":", b"e9"][
                int(rng.integers(7))
            ]
        try:
            for k, one in enumerate(read_dob(bytes(raw), "d.dob")):
                recorded(one, k, GRID, 0.1, "d.dob")
            read += 1
        except LampyrisError as error:
            read += not error.code
    assert 50 < read < 1900
