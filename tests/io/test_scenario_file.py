"""Scenario files: what every key means, in YAML and in JSON, and what is wrong with the wrong ones."""

from __future__ import annotations

import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from scenario_mistakes import BODIES, HEAD, MISTAKES

import lampyris
from lampyris.errors import LampyrisError
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.scenario.save import json_of, yaml_of
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded

GUIDE = {"version": 1, "map": "guide"}
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Messages then hold short names."""
    monkeypatch.chdir(tmp_path)


def load(data: Any, name: str = "s.yaml", **how: Any) -> lampyris.Scenario:
    """A scenario from plain data, from YAML or JSON text, or from bytes."""
    if isinstance(data, dict):
        data = json_of(data) if name.endswith(".json") else yaml_of(data)
    Path(name).write_bytes(data if isinstance(data, bytes) else data.encode())
    return lampyris.load_scenario(name, **how)


def refused(data: Any, name: str = "s.yaml", **how: Any) -> tuple[LampyrisError, list[str]]:
    """The error, and a line for it and each of its notes."""
    with pytest.raises(LampyrisError) as caught:
        load(data, name, **how)
    return caught.value, [str(caught.value), *getattr(caught.value, "__notes__", ())]


# ---- every key --------------------


def test_two_keys_are_enough() -> None:
    s = load(GUIDE)
    guide = lampyris.load_grid("guide")
    assert (s.scene.start, s.scene.goal) == ((0, 9), (7, 0))
    assert map_hash(s.scene.grid) == map_hash(guide)
    assert s.scene.robot == lampyris.Robot()
    assert (s.scene.moves.name, s.planner, s.settings, s.law, s.seed) == (
        "octile",
        "ad-gso",
        {},
        "physical",
        0,
    )
    assert (s.simulated, s.ticks, s.patience, s.scene.traffic, s.name) == (False, None, None, (), "")


FULL: dict[str, Any] = {
    "version": 1,
    "$schema": "https://example.org/never-fetched",
    "name": "the lot",
    "map": {
        "rows": ["....#", ".S...", "?..G."],
        "resolution": 0.5,
        "origin": [1.0, -2.0, 0.25],
        "name": "room",
    },
    "map_hash": "",
    "start": [0, 0],
    "goal": [4, 2],
    "robot": {"radius": 0.1, "v_max": 2, "a_max": 0.25, "d_max": 1e-3},
    "preset": "dissertation",
    "moves": "four-connected",
    "planner": {"name": "ad-gso", "settings": {"choice": "exact", "nt": 4, "rho": 0.5}},
    "law": {"name": "physical", "settings": {"creep": 0.5}},
    "seed": 2**63 - 1,
    "obstacles": [
        {"kind": "random-walk", "count": 2, "rate": 0.25, "radius": 0.1},
        {"kind": "patrol", "waypoints": [[1, 0], [2, 2]], "radius": 0.1},
        {"kind": "crossing", "count": 1, "radius": 0},
        {"kind": "recorded", "track": [[3, 0], [3, 1]]},
        {"kind": "recorded", "file": "t.csv", "radius": 0.2},
    ],
    "simulate": {"ticks": 9, "patience": 0},
}


@pytest.mark.parametrize("name", ["s.yaml", "s.json"])
def test_every_key(name: str) -> None:
    Path("t.csv").write_text("x,y\n0,1\n1,1\n")
    rows = {**FULL["map"]}
    Path("rows.txt").write_text("\n".join(rows["rows"]))
    given = {**FULL, "map_hash": map_hash(lampyris.load_grid("./rows.txt"))}
    s = load(given, name)
    grid = s.scene.grid
    assert (grid.name, grid.resolution, grid.origin) == ("room", 0.5, (1.0, -2.0, 0.25))
    assert grid.blocked.tolist() == [[c in "#?" for c in row] for row in rows["rows"]]
    assert grid.unknown is not None
    assert grid.unknown[2, 0]
    assert (s.scene.start, s.scene.goal, s.scene.moves.name) == ((0, 0), (4, 2), "four-connected")
    assert s.scene.robot == lampyris.Robot(0.1, 2.0, 0.25, 0.001)
    assert (s.planner, s.settings) == ("ad-gso", {"choice": "exact", "nt": 4, "rho": 0.5})
    assert (s.law, s.law_settings, s.seed, s.name) == ("physical", {"creep": 0.5}, 2**63 - 1, "the lot")
    assert s.scene.traffic == (
        RandomWalk(2, 0.25, 0.1),
        Patrol(((1, 0), (2, 2)), 0.1),
        Crossing(1, 0.0),
        Recorded(((3, 0), (3, 1)), 0.0),
        Recorded(((0, 1), (1, 1)), 0.2),
    )
    assert (s.simulated, s.ticks, s.patience, s.where) == (True, 9, 0, name)


def test_yaml_and_json_say_the_same() -> None:
    Path("t.csv").write_text("x,y\n0,1\n")
    given = {k: v for k, v in FULL.items() if k != "map_hash"}
    plain = json.dumps(given)
    assert load(given, "a.yaml") == load(given, "b.json") == load(plain, "c.json") == load(plain, "d.yml")
    with_mark = load(b"\xef\xbb\xbf" + plain.encode(), "e.json")
    assert with_mark == load(b"\xef\xbb\xbf" + yaml_of(given).encode(), "f.yaml") == load(given)


def test_numbers_are_those_of_yaml_1_2() -> None:
    s = load("version: 1\nmap: guide\nrobot: {radius: 1e-1, v_max: .5, a_max: 5, d_max: 0x10}\nname: no\n")
    assert s.scene.robot == lampyris.Robot(0.1, 0.5, 5.0, 16.0)
    assert s.name == "no"


def test_presets_are_for_what_is_not_given() -> None:
    s = load({**GUIDE, "preset": "dissertation"})
    assert (s.scene.moves.name, s.law) == ("dissertation", "dissertation")
    s = load({**GUIDE, "preset": "dissertation", "moves": "octile", "law": "physical"})
    assert (s.scene.moves.name, s.law) == ("octile", "physical")


def test_every_form_of_map() -> None:
    ends = {"start": [1, 1], "goal": [1, 1]}
    assert load({"version": 1, "map": {"bundled": "guide", "resolution": 2.0}}).scene.grid.resolution == 2.0
    Path("maps").mkdir()
    Path("maps/a.txt").write_text("S..\n..G\n")
    s = load({"version": 1, "map": {"file": "maps/a.txt", "resolution": 0.5}})
    assert (s.scene.grid.name, s.scene.grid.resolution, s.scene.goal) == ("a.txt", 0.5, (2, 1))
    made = {"recipe": "maze", "size": [31, 21], "seed": 3, "settings": {"corridor": 2}, "resolution": 0.1}
    grid = load({"version": 1, "map": made, **ends}).scene.grid
    assert (grid.width, grid.height, grid.resolution, grid.name) == (31, 21, 0.1, "maze")
    other = load({"version": 1, "map": {**made, "seed": 4}, **ends}).scene.grid
    assert map_hash(other) != map_hash(grid)
    hills = load({"version": 1, "map": {"recipe": "hills", "size": [40, 40]}, **ends}).scene.grid
    assert hills.terrain is not None
    assert hills.terrain.any()


def test_how_a_map_file_is_read_can_be_said() -> None:
    from lampyris_selfcheck.reference.files.map_files import png, rows

    Path("grey.png").write_bytes(png(3, 1, 8, 0, rows([0, 100, 254])))
    ends = {"start": [0, 0], "goal": [0, 0]}
    s = load({"version": 1, "map": {"file": "grey.png", "values": "costmap"}, **ends})
    assert s.scene.grid.terrain is not None
    assert s.scene.grid.terrain.tolist() == [[0, 100, 0]]
    Path("rgb.png").write_bytes(png(2, 1, 8, 2, rows([1, 2, 3, 254, 255, 253])))
    error, _ = refused({"version": 1, "map": {"file": "rgb.png"}, **ends})
    assert error.code == "IMG_COLOUR"
    s = load(
        {"version": 1, "map": {"file": "rgb.png", "colour": "luminance"}, "start": [1, 0], "goal": [1, 0]}
    )
    assert s.scene.grid.blocked.tolist() == [[True, False]]


def test_ends_in_metres_follow_the_pose_of_the_map() -> None:
    grid = {"rows": ["...."] * 3, "resolution": 0.5, "origin": [10.0, 20.0, math.pi / 2]}
    s = load({"version": 1, "map": grid, "start": {"m": [10.0 - 1e-6, 20.1]}, "goal": {"m": [8.6, 21.9]}})
    assert (s.scene.start, s.scene.goal) == ((0, 2), (3, 0))


def test_ends_with_a_heading_are_poses_at_the_centre_of_their_cell() -> None:
    grid = {"rows": ["...."] * 3, "resolution": 0.5, "origin": [10.0, 20.0, 0.0]}
    ends = {"start": {"cell": [0, 2], "yaw": 1.5}, "goal": {"pose": [11.3, 21.2, -1.0]}}
    s = load({"version": 1, "map": grid, **ends}).scene
    assert (s.start, s.start_pose, s.goal, s.goal_pose) == (
        (0, 2),
        (10.25, 20.25, 1.5),
        (2, 0),
        (11.3, 21.2, -1.0),
    )
    for end, code in (({"cell": [4, 0], "yaw": 0.0}, "START_OUTSIDE"), ({"cell": [0, 0]}, "KEY")):
        error, _ = refused({"version": 1, "map": grid, "start": end, "goal": [0, 0]})
        assert error.code == code


def test_obstacles_of_a_plan_are_left_aside_with_a_note() -> None:
    s = load({**GUIDE, "obstacles": [{"kind": "crossing", "count": 2}]})
    assert not s.simulated
    assert "nothing is simulated" in s.notes[0]
    assert load({**GUIDE, "obstacles": [{"kind": "crossing", "count": 2}], "simulate": {}}).simulated


def test_dob_files_give_one_obstacle_or_all() -> None:
    text = "NumberOfDynamicObstacles: 2\n"
    for k in range(2):
        text += (
            f"DynamicObstacleID: {k}\nObstacleRadius: 0.5\nNumberOfTrajectories: 1\nTrajectoryID: 0\n"
            f"TrajectoryProbability: 1\nNumberOfPoints: 2\n0.5 {k}.5 0 0\n1.5 {k}.5 1 0\n"
            "ObstacleExistsAfterTrajectory: 1\n"
        )
    Path("d.dob").write_text(text)
    one = {"kind": "recorded", "file": "d.dob"}
    a, b = Recorded(((0, 9), (1, 9)), 0.5), Recorded(((0, 8), (1, 8)), 0.5)
    assert load({**GUIDE, "obstacles": [one]}).scene.traffic == (a, b)
    assert load({**GUIDE, "obstacles": [{**one, "id": 1}]}).scene.traffic == (b,)
    assert load({**GUIDE, "obstacles": [{**one, "id": 0, "radius": 0.0}]}).scene.traffic[0].radius == 0.0
    slow = load({**GUIDE, "obstacles": [{**one, "id": 0, "tick_s": 0.25}]}).scene.traffic[0]
    assert isinstance(slow, Recorded)
    assert len(slow.track) == 5
    half = load({**GUIDE, "robot": {"v_max": 2.0}, "obstacles": [{**one, "id": 0}]}).scene.traffic[0]
    assert isinstance(half, Recorded)
    assert len(half.track) == 3
    error, _ = refused({**GUIDE, "obstacles": [{**one, "id": 2}]})
    assert (error.code, error.where) == ("OBSTACLE_ID", "s.yaml:4:47: /obstacles/0/id")


# ---- mistakes --------------------


@pytest.mark.commit(54)
@pytest.mark.parametrize(("text", "code", "place", "says"), MISTAKES)
def test_each_mistake_with_its_place(text: str, code: str, place: str, says: str) -> None:
    Path("bad.csv").write_text("x,y\n1,b\n")
    Path("late.csv").write_text("x,y,tick\n1,1,0\n1,1,0\n")
    Path("ok.csv").write_text("x,y\n1,1\n")
    error, lines = refused(text)
    assert error.code == code, lines
    assert error.where == f"s.yaml:{place}", lines
    assert says in lines[0], lines
    assert error.exit_code == (5 if code in ("LIMIT", "RADIUS", "MAP_TOO_LARGE") else 3)
    assert len(lines[0]) < 800
    assert all(line.isprintable() for line in lines)


def test_json_has_the_same_mistakes_at_its_own_places() -> None:
    error, lines = refused('{"version": 1,\n "map": "guide",\n "robt": {},\n "seed": -1}', "s.json")
    assert lines[0].startswith("error[KEY]: s.json:3:2: /robt: unknown key 'robt'")
    assert lines[1].startswith("error[SEED]: s.json:4:10: /seed: -1")
    error, _ = refused('{"version": 1, "map": "guide", "name": "' + "x" * 10**6 + '"}', "s.json")
    assert (error.code, error.what) == ("JSON_TEXT", "1,000,000 characters")
    for text, code in (('{"version": 1,}', "JSON_SYNTAX"), ('{"robot": {"v_max": 1e999}}', "JSON_NUMBER")):
        assert refused(text, "s.json")[0].code == code


def test_all_mistakes_are_told_of_at_once_in_the_order_of_the_file() -> None:
    shape = HEAD + "robot: {a_max: 0, x: 1}\nseed: -1\nobstacles: [{kind: crossing}]\n"
    _, lines = refused(shape)
    assert [re.findall(r"\[(\w+)\]: s\.yaml:(\d+)", line)[0] for line in lines] == [
        ("ROBOT_LIMIT", "3"), ("KEY", "3"), ("SEED", "4"), ("KEY", "5"),
    ]  # fmt: skip
    meaning = HEAD + "start: [99, 0]\nplanner: astra\nlaw: fast\nobstacles:\n"
    meaning += "  - {kind: recorded, track: [[0, 0], [5, 0]]}\n  - {kind: patrol, waypoints: [[-1, 0]]}\n"
    error, lines = refused(meaning)
    assert [re.findall(r"\[(\w+)\]: s\.yaml:(\d+)", line)[0] for line in lines] == [
        ("START_OUTSIDE", "3"), ("PLANNER", "4"), ("LAW", "5"),
        ("OBSTACLE_SPEED", "7"), ("OBSTACLE_TRACK", "8"),
    ]  # fmt: skip
    assert "obstacle 1 is at (-1, 0)" in lines[-1], "it keeps its number though the one before was refused"
    assert error.exit_code == 3
    many = BODIES + "  - {kind: nobody}\n" * 150
    _, lines = refused(many)
    assert len(lines) == 21
    assert lines[-1] == "and 130 more"


@pytest.mark.nightly
def test_more_obstacles_than_a_scene_may_have() -> None:
    one = '{"kind":"crossing","count":1}'
    for listed, says in ((100_001, "100,001 obstacles"), (10_001, "10,001 obstacles")):
        error, _ = refused(
            '{"version":1,"map":"guide","obstacles":[' + ",".join([one] * listed) + "]}", "s.json"
        )
        assert (error.code, error.exit_code, error.what) == ("LIMIT", 5, says)
    bodies = [{"kind": "crossing", "count": 6000}, {"kind": "random-walk", "count": 6000}]
    error, _ = refused({**GUIDE, "obstacles": bodies})
    assert (error.code, error.what) == ("LIMIT", "12,000 obstacles in all")


def test_tracks_of_files_are_counted_together(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lampyris.io.scenario.build.MAX_TICKS", 1000)
    Path("long.csv").write_text("x,y,tick\n0,0,0\n0,0,4999\n")
    one = {"kind": "recorded", "file": "long.csv"}
    assert len(load({**GUIDE, "obstacles": [one, one]}).scene.traffic) == 2
    error, lines = refused({**GUIDE, "obstacles": [one] * 800})
    assert (error.code, error.exit_code, len(lines)) == ("LIMIT", 5, 1)


def test_a_map_that_has_changed_is_refused_and_both_hashes_are_named() -> None:
    Path("m.txt").write_text("S.G\n")
    given = {"version": 1, "map": {"file": "m.txt"}, "map_hash": map_hash(lampyris.load_grid("m.txt"))}
    load(given)
    Path("m.txt").write_text("S#G\n")
    error, lines = refused(given)
    assert error.code == "MAP_HASH"
    assert given["map_hash"] in lines[0]
    assert map_hash(lampyris.load_grid("m.txt")) in lines[0]


def test_limits_of_size() -> None:
    assert refused(HEAD + "#" * 2**16)[0].code == "YAML_SIZE"
    assert refused("version: 1\nmap: {rows: ['SG']}\n", max_cells=1)[0].code == "MAP_TOO_LARGE"
    assert (
        refused({"version": 1, "map": {"recipe": "maze", "size": [9, 9]}}, max_cells=80)[0].code
        == "MAP_TOO_LARGE"
    )
    for name, code in (("s.json", "JSON_SIZE"), ("s.yaml", "YAML_SIZE")):
        assert refused(b" " * (17 * 2**20), name)[0].code == code
    assert refused(b"", "s.json")[0].code == "JSON_SHAPE"
    assert refused(b"- 1")[0].code == "YAML_SHAPE"
    with pytest.raises(LampyrisError, match="FILE_MISSING"):
        lampyris.load_scenario("none.yaml")
    with pytest.raises(LampyrisError, match="FILE_KIND"):
        lampyris.load_scenario(os.devnull)


# ---- what may be opened --------------------

WATCH = """
import os, sys, lampyris
folder = os.path.realpath(os.getcwd())
opened = []
def hook(event, args):
    if event == "open" and isinstance(args[0], str):
        opened.append(args[0])
    elif event.split(".")[0] in ("socket", "subprocess") or event == "os.system":
        opened.append(event)
good = lampyris.load_scenario("good.yaml")  # everything is imported now
sys.addaudithook(hook)
for name in sorted(os.listdir(".")):
    if not name.startswith("s-"):
        continue
    try:
        lampyris.load_scenario(name)
    except lampyris.LampyrisError as error:
        print(name, error.code)
    else:
        print(name, "read")
ours = [folder, os.path.dirname(lampyris.__file__), os.path.dirname(os.__file__), sys.prefix]
ours = [os.path.realpath(p) + os.sep for p in ours]
bad = [p for p in opened if not os.path.realpath(p).startswith(tuple(ours))]
print("outside:", bad, "inside:", any(p.endswith("good.txt") for p in opened))
"""


def test_nothing_outside_the_folder_is_opened(tmp_path: Path) -> None:
    (tmp_path / "out.txt").write_text("S.G\n")
    (tmp_path / "out.csv").write_text("x,y\n0,0\n")
    home = tmp_path / "home"
    (home / "sub").mkdir(parents=True)
    (home / "good.txt").write_text("S.G\n")
    (home / "link.txt").symlink_to(tmp_path / "out.txt")
    (home / "away").symlink_to(tmp_path)
    (home / "ok.txt").symlink_to(home / "good.txt")
    ros = "resolution: 1.0\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\nimage: "
    (tmp_path / "out.pgm").write_bytes(b"P5\n1 1\n255\n\xff")
    (home / "picture.pgm").symlink_to(tmp_path / "out.pgm")
    for name, image in (("abs", tmp_path / "out.pgm"), ("dots", "../out.pgm"), ("link", "picture.pgm")):
        (home / f"ros-{name}.yaml").write_text(f"{ros}{image}\n")
    cases = {
        "dots": ("map: {file: ../out.txt}", "PATH_OUTSIDE"),
        "inner": ("map: {file: sub/../../out.txt}", "PATH_OUTSIDE"),
        "absolute": (f"map: {{file: {tmp_path}/out.txt}}", "PATH_OUTSIDE"),
        "link": ("map: {file: link.txt}", "PATH_OUTSIDE"),
        "folder-link": ("map: {file: away/out.txt}", "PATH_OUTSIDE"),
        "address": ("map: {file: 'http://localhost/m.txt'}", "PATH_FORM"),
        "pipe": ("map: {file: '|id'}", "PATH_FORM"),
        "share": ("map: {file: '//host/share'}", "PATH_FORM"),
        "backslash": ("map: {file: '..\\out.txt'}", "PATH_FORM"),
        "nul": ('map: {file: "a\\u0000b"}', "PATH_FORM"),
        "ros-absolute": ("map: {file: ros-abs.yaml}", "PATH_OUTSIDE"),
        "ros-dots": ("map: {file: ros-dots.yaml}", "PATH_OUTSIDE"),
        "ros-link": ("map: {file: ros-link.yaml}", "PATH_OUTSIDE"),
        "track": ("map: guide\nobstacles: [{kind: recorded, file: ../out.csv}]", "PATH_OUTSIDE"),
        "self": ("map: {file: .}", "FILE_KIND"),
        "fine": ("map: {file: good.txt}", "read"),
        "fine-link": ("map: {file: ok.txt}", "read"),
    }  # fmt: skip
    (home / "good.yaml").write_text("version: 1\nmap: {file: good.txt}\n")
    for name, (line, _) in cases.items():
        (home / f"s-{name}.yaml").write_text(f"version: 1\n{line}\n")
    done = subprocess.run(
        [sys.executable, "-c", WATCH], cwd=home, capture_output=True, text=True, check=False
    )
    lines = done.stdout.splitlines()
    assert done.stderr == ""
    assert dict(line.removeprefix("s-").split(".yaml ") for line in lines[:-1]) == {
        name: code for name, (_, code) in cases.items()
    }
    assert lines[-1] == "outside: [] inside: True"


def test_allow_outside_is_the_callers_to_give(tmp_path: Path) -> None:
    (tmp_path / "out.txt").write_text("S.G\n")
    (tmp_path / "in").mkdir()
    path = tmp_path / "in" / "s.yaml"
    for text in ("../out.txt", str(tmp_path / "out.txt")):
        path.write_text(f"version: 1\nmap: {{file: {text}}}\n")
        assert lampyris.load_scenario(path, allow_outside=True).scene.goal == (2, 0)
        with pytest.raises(LampyrisError, match="allow_outside=True"):
            lampyris.load_scenario(path)


def test_paths_are_relative_to_the_file_wherever_the_caller_is(tmp_path: Path, monkeypatch: Any) -> None:
    (tmp_path / "a" / "maps").mkdir(parents=True)
    (tmp_path / "a" / "maps" / "m.txt").write_text("S.G\n")
    (tmp_path / "a" / "s.yaml").write_text("version: 1\nmap: {file: maps/m.txt}\n")
    (tmp_path / "b").mkdir()
    monkeypatch.chdir(tmp_path / "b")
    assert lampyris.load_scenario("../a/s.yaml").scene.goal == (2, 0)
