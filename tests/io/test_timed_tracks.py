"""Tracks in seconds and metres."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import in_process
import lampyris
from lampyris.errors import FileError, SettingError
from lampyris.io.tracks.timed_tracks import read_any_track, read_timed_track, write_timed_track

GRID = lampyris.Grid(np.zeros((10, 20), dtype=bool), resolution=0.5)


def track(folder: Path, text: str) -> Path:
    file = folder / "track.csv"
    file.write_text(text)
    return file


def test_it_is_interpolated_at_each_tick(tmp_path: Path) -> None:
    file = track(tmp_path, "t,x_m,y_m,radius_m\n1.0,0.25,4.75,0.3\n3.0,2.25,4.75,0.2\n3.5,2.25,4.25,0.3\n")
    made = read_any_track(file, GRID, 0.5)
    # Rests until 1 s, then a cell a tick to the right from 0.25 to 2.25 m, then one cell down.
    assert made.track == ((0, 0), (0, 0), (0, 0), (1, 0), (2, 0), (3, 0), (4, 0), (4, 1))
    assert made.radius == 0.3
    assert read_any_track(file, GRID, 0.5, radius=0.7).radius == 0.7


def test_tracks_are_written_as_they_are_read(tmp_path: Path) -> None:
    file = track(tmp_path, "t,x_m,y_m,radius_m\n0,1e-3,2.25,0.3\n0.1,7,0.1,0.4\n")
    found = read_timed_track(file)
    assert (found.t.tolist(), found.radius) == ([0.0, 0.1], 0.4)
    write_timed_track(file, found)
    again = read_timed_track(file)
    assert (again.t.tolist(), again.xy.tolist(), again.radius) == (found.t.tolist(), found.xy.tolist(), 0.4)


def test_tracks_in_cells_are_read_as_before(tmp_path: Path) -> None:
    assert read_any_track(track(tmp_path, "x,y\n3,4\n4,4\n"), GRID, 0.5).track == ((3, 4), (4, 4))


@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("t,x_m,y_m\n0,1,1\n0,2,2\n", "OBSTACLE_TIME", "track.csv:3"),
        ("t,x_m,y_m\n-1,1,1\n", "OBSTACLE_TIME", "0 or more"),
        ("t,x_m,y_m\n0,1,north\n", "TRACK", "north"),
        ("t,x_m,y_m\n", "OBSTACLE_TIME", "at least one row"),
        ("", "TRACK", "t,x_m,y_m[,radius_m] in seconds and metres"),
        ("x_m,y_m\n1,1\n", "TRACK", "t"),
        ("t,x_m,y_m,radius_m\n0,1,1,-2\n", "TRACK", "-2"),
    ],
)
def test_what_is_no_track_is_refused(text: str, code: str, says: str, tmp_path: Path) -> None:
    with pytest.raises(FileError) as fault:
        read_any_track(track(tmp_path, text), GRID, 0.5)
    assert fault.value.code == code
    assert says in str(fault.value)


def test_too_fast_and_too_long(tmp_path: Path) -> None:
    with pytest.raises(SettingError, match="OBSTACLE_SPEED"):
        read_any_track(track(tmp_path, "t,x_m,y_m\n0,1,1\n1,5,1\n"), GRID, 0.5)
    with pytest.raises(SettingError, match="let its times begin at 0"):
        read_any_track(track(tmp_path, "t,x_m,y_m\n0,1,1\n1e8,5,1\n"), GRID, 0.5)


def test_a_fast_person_sets_the_speed_of_obstacles_in_a_drive(tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", np.zeros((12, 12), dtype=bool))
    file = track(tmp_path, "t,x_m,y_m,radius_m\n0,0.5,10.5,0.4\n4,8.5,10.5,0.4\n")
    words = (
        str(tmp_path / "m.npy"), "--start", "1,6", "--goal", "9,6", "--planner", "astar", "--obstacles", "0",
        "--track", str(file),
    )  # fmt: skip
    done = in_process.call("drive", *words)
    assert done.returncode == 0, done.stderr
    assert "obstacles move at up to 2 m/s" in done.stderr
    slow = in_process.call("simulate", *words)
    assert slow.returncode == 3
    assert "lampyris drive --obstacle-speed" in slow.stderr


def test_a_scenario_file_names_one(tmp_path: Path) -> None:
    track(tmp_path, "t,x_m,y_m,radius_m\n0,0.25,4.75,0.3\n2,2.25,4.75,0.3\n")
    np.save(tmp_path / "m.npy", np.zeros((10, 20), dtype=bool))
    file = tmp_path / "s.yaml"
    file.write_text(
        "version: 1\nmap: {file: m.npy, resolution: 0.5}\nstart: [1, 6]\ngoal: [9, 6]\n"
        "obstacles: [{kind: recorded, file: track.csv, tick_s: 0.5}]\nsimulate: {}\n"
    )
    (one,) = lampyris.load_scenario(file).scene.traffic
    assert one == lampyris.Recorded(((0, 0), (1, 0), (2, 0), (3, 0), (4, 0)), 0.3)
