"""Fleets from files: .scen and lists of agents, and what is wrong in them with its place."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

import lampyris
from lampyris.errors import FileError, LampyrisError, SceneError, SettingError

GRID = lampyris.Grid(np.zeros((4, 6), dtype=bool), resolution=0.5, name="hall.map")
PAIRS = [((0, 0), (5, 3)), ((5, 3), (0, 0)), ((2, 1), (3, 3))]


def put(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def scen(pairs: list[tuple[tuple[int, int], tuple[int, int]]], width: int = 6) -> str:
    rows = [f"0\thall.map\t{width}\t4\t{a}\t{b}\t{c}\t{d}\t1.5" for (a, b), (c, d) in pairs]
    return "\n".join(["version 1", *rows]) + "\n"


def ends(fleet: lampyris.Fleet) -> list[tuple[tuple[int, int], tuple[int, int]]]:
    return [(one.start, one.goal) for one in fleet.robots]


def test_every_kind_of_file_says_the_same(tmp_path: Path) -> None:
    listed = {"agents": [{"start": list(a), "goal": list(b)} for a, b in PAIRS]}
    metres = [[GRID.to_metres(cell).tolist() for cell in pair] for pair in PAIRS]
    in_metres = {"agents": [{"start_m": a, "goal_m": b} for a, b in metres]}
    yaml = "agents:\n" + "".join(f"  - {{start: {list(a)}, goal: {list(b)}}}\n" for a, b in PAIRS)
    columns = "start_x,start_y,goal_x,goal_y"
    csv = "\n".join([columns, *(",".join(map(str, (*a, *b))) for a, b in PAIRS)])
    csv_m = "\n".join(
        [
            ",".join(f"{name}_m" for name in columns.split(",")),
            *(",".join(map(str, (*a, *b))) for a, b in metres),
        ]
    )
    files = {
        "a.scen": scen(PAIRS), "a.json": json.dumps(listed), "b.json": json.dumps(in_metres), "a.yaml": yaml,
        "a.csv": csv, "b.csv": csv_m, "c.txt": json.dumps(listed),
    }  # fmt: skip
    for name, text in files.items():
        path = put(tmp_path, name, text)
        assert ends(lampyris.load_fleet(path, GRID)) == PAIRS
        assert ends(lampyris.load_fleet(path, GRID, 2)) == PAIRS[:2]


WRONG: dict[str, tuple[str, str, type[LampyrisError], str]] = {
    "one start twice": ("a.scen", scen([PAIRS[0], ((0, 0), (1, 1))]), FileError, "a.scen: line 3: robot 1: start"),
    "one goal twice": ("a.csv", "start_x,start_y,goal_x,goal_y\n0,0,1,1\n0,1,1,1\n", FileError, "a.csv:3: robot 1: goal"),
    "outside the map": ("a.csv", "start_x,start_y,goal_x,goal_y\n0,0,6,1\n", SceneError, "a.csv:2: robot 0: goal"),
    "another size of map": ("a.scen", scen(PAIRS, 7), FileError, "line 2: 7 x 4"),
    "an empty scen": ("a.scen", "version 1\n", FileError, "there is no line in it"),
    "half a cell": ("a.csv", "start_x,start_y,goal_x,goal_y\n0.5,0,1,1\n", FileError, "a.csv:2: start_x is not whole"),
    "no number": ("a.csv", "start_x,start_y,goal_x,goal_y\n0,x,1,1\n", FileError, "a.csv:2: start_y is 'x'"),
    "no column": ("a.csv", "start_x,start_y,goal_x\n0,0,1\n", FileError, "no column goal_y"),
    "no row": ("a.csv", "start_x,start_y,goal_x,goal_y\n", FileError, "there is no agent in it"),
    "no list": ("a.yaml", "robots: []\n", FileError, "a.yaml:1:"),
    "an empty list": ("a.json", '{"agents": []}', FileError, "there is no agent in it"),
    "no goal": ("a.json", '{"agents": [\n {"start": [0, 0]}]}', FileError, "a.json:2:2: no goal"),
    "both": (
        "a.json", '{"agents": [{"start": [0, 0], "start_m": [0, 0], "goal": [1, 1]}]}', FileError,
        "both start and start_m",
    ),
    "a fraction": ("a.yaml", "agents:\n  - {start: [0.5, 0], goal: [1, 1]}\n", FileError, "a.yaml:2:13: start is"),
    "three numbers": ("a.yaml", "agents:\n  - {start: [0, 0, 0], goal: [1, 1]}\n", FileError, "a.yaml:2:13: start is"),
    "an unknown key": ("a.yaml", "agents:\n  - {start: [0, 0], end: [1, 1]}\n", FileError, "unknown key"),
    "no mapping": ("a.yaml", "agents:\n  - 3\n", FileError, "a.yaml:2:5"),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_with_its_place(tmp_path: Path, name: str) -> None:
    file, text, kind, words = WRONG[name]
    with pytest.raises(kind) as caught:
        lampyris.load_fleet(put(tmp_path, file, text), GRID)
    assert words in str(caught.value)


def test_fewer_lines_than_robots(tmp_path: Path) -> None:
    for name, text in (
        ("a.scen", scen(PAIRS)),
        ("a.csv", "start_x,start_y,goal_x,goal_y\n0,0,1,1\n1,1,2,2\n2,2,3,3"),
    ):
        with pytest.raises(FileError, match="ask for at most 3 robots"):
            lampyris.load_fleet(put(tmp_path, name, text), GRID, 4)
    with pytest.raises(SettingError, match="robots 0"):
        lampyris.load_fleet(tmp_path / "a.scen", GRID, 0)


def test_what_a_fleet_refuses() -> None:
    agent = lampyris.Agent
    blocked = np.zeros((4, 6), dtype=bool)
    blocked[0, 0] = True
    wall = lampyris.Grid(blocked)
    with pytest.raises(SceneError, match=r"robots\[1\].goal: \(0, 0\) is blocked"):
        lampyris.Fleet(wall, [agent((1, 1), (2, 2)), agent((2, 2), (0, 0))])
    with pytest.raises(SceneError, match=r"robots\[0\].start: \(9, 0\) is outside"):
        lampyris.Fleet(wall, [agent((9, 0), (2, 2))])
    with pytest.raises(SettingError, match="start of robot 0, too"):
        lampyris.Fleet(wall, [agent((1, 1), (2, 2)), agent((1, 1), (3, 3))])
    with pytest.raises(SettingError, match="no robot"):
        lampyris.Fleet(wall, [])
    with pytest.raises(SettingError, match=r"at most 0\.354 cells"):
        lampyris.plan_fleet(lampyris.Fleet(wall, [agent((1, 1), (2, 2), lampyris.Robot(radius=0.36))]))
    car = lampyris.Robot(radius=0.2, drive="ackermann", turn_radius=1.0)
    with pytest.raises(SettingError, match=r"robots\[0\].robot.*Ackermann"):
        lampyris.Fleet(wall, [agent((1, 1), (2, 2), car)])
    with pytest.raises(SettingError, match="not a cell"):
        agent((1.5, 1), (2, 2))
    assert len(lampyris.Fleet(wall, [agent((1, 1), (2, 2), lampyris.Robot(radius=0.35))])) == 1
