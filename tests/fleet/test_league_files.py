"""Problems of the League of Robot Runners, and plans as other programs read them."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from fleet_checks import random_map

import lampyris
from in_process import call
from lampyris.errors import FileError, LampyrisError, LimitError, SettingError, UsageError
from lampyris.io import league_files
from lampyris.io.league_files import LeagueProblem, read_league, write_league
from lampyris.io.maps.load import load_map
from lampyris.io.maps.save import save_map
from lampyris.io.text.strict_json import read_json
from sizes import some

MAP = "type octile\nheight 3\nwidth 4\nmap\n.E..\n.@@.\nS..T\n"
PROBLEM = {
    "mapFile": "maps/small.map", "agentFile": "small.agents", "taskFile": "small.tasks", "teamSize": 2, "numTasksReveal": 1.5,
    "taskAssignmentStrategy": "roundrobin",
}  # fmt: skip


def problem_in(folder: Path, agents: str, tasks: str, **changed: object) -> Path:
    (folder / "maps").mkdir(exist_ok=True)
    (folder / "maps" / "small.map").write_text(MAP)
    (folder / "small.agents").write_text(agents)
    (folder / "small.tasks").write_text(tasks)
    (folder / "small.json").write_text(json.dumps(PROBLEM | changed))
    return folder / "small.json"


def test_a_problem_as_the_league_writes_it(tmp_path: Path) -> None:
    agents = "# version for LoRR 2023\n3\n0\n3\n7\n"
    path = problem_in(tmp_path, agents, "# tasks\n3\n9,3\n8,\n1, 2 , 10\n")
    grid = lampyris.load_grid(tmp_path / "maps" / "small.map")
    assert not grid.blocked[0, 1], "E is free"
    fleet = lampyris.load_fleet(path, grid)
    assert fleet.starts == ((0, 0), (3, 0))
    assert fleet.goals == ((1, 2), (0, 2))
    found = read_league(path, read_json(path.read_bytes(), "p"), grid)
    assert found.tasks == (((1, 2), (3, 0)), ((0, 2),), ((1, 0), (2, 0), (2, 2)))
    assert found.reveal == 1.5
    assert len(lampyris.load_fleet(path, grid, 1)) == 1
    done = call("fleet", str(tmp_path / "maps" / "small.map"), "--agents", str(path), "--json")
    assert (done.returncode, json.loads(done.stdout)["robots"]) == (0, 2)
    save_map(load_map(tmp_path / "maps" / "small.map"), tmp_path / "again.map")
    assert (tmp_path / "again.map").read_text() == MAP


@pytest.mark.parametrize(
    ("agents", "tasks", "changed", "message"),
    [
        ("2\n0\n", "2\n1\n2\n", {}, r"small.agents: 1 line of 2"),
        ("2\n0\n12\n", "2\n1\n2\n", {}, r"small.agents: line 3: location 12.*0 to 11"),
        ("2\n0\n-1\n", "2\n1\n2\n", {}, r"line 3: '-1'"),
        ("2\n0\n3\n", "x\n", {}, r"small.tasks: line 1.*how many lines"),
        ("2\n0\n3\n", "", {}, r"small.tasks: no count"),
        ("2\n0\n0\n", "2\n1\n2\n", {}, r"small.agents: line 3: robot 1: .*start of robot 0"),
        ("2\n0\n3\n", "2\n1\n1\n", {}, r"small.tasks: line 3: robot 1: .*goal of robot 0"),
        ("2\n0\n3\n", "2\n1\n5\n", {}, r"small.tasks: line 3: robot 1: .*blocked"),
        ("2\n0\n3\n", "1\n1\n", {}, r"1 task for 2 robots"),
        ("2\n0\n3\n", "2\n1\n2\n", {"teamSize": 3}, r"teamSize is 3, but 2 robots"),
        ("2\n0\n3\n", "2\n1\n2\n", {"teamSize": True}, r"teamSize is"),
        ("2\n0\n3\n", "2\n1\n2\n", {"numTasksReveal": 0}, r"numTasksReveal is 0"),
        ("2\n0\n3\n", "2\n1\n2\n", {"taskFile": 7}, r"taskFile is 7"),
        ("2\n0\n3\n", "2\n1\n2\n", {"agentFile": "/etc/passwd"}, r"relative to this one"),
        ("2\n0\n3\n", "2\n1\n2\n", {"agentFile": "none.agents"}, r"none.agents"),
    ],
)  # fmt: skip
def test_what_a_problem_must_not_be(
    tmp_path: Path, agents: str, tasks: str, changed: dict[str, object], message: str
) -> None:
    path = problem_in(tmp_path, agents, tasks, **changed)
    grid = lampyris.load_grid(tmp_path / "maps" / "small.map")
    with pytest.raises(LampyrisError, match=message) as caught:
        lampyris.load_fleet(path, grid)
    assert isinstance(caught.value, FileError | lampyris.errors.SceneError)


@pytest.mark.parametrize("seed", some(range(100), 10))
def test_written_and_read_again(tmp_path: Path, seed: int) -> None:
    grid = random_map(seed, 13, 9, 0.2)
    fleet = lampyris.random_fleet(grid, 6, seed=seed)
    plan = lampyris.plan_fleet(fleet, seed=seed)
    for name in ("a.json", "a.scen"):
        lampyris.export_fleet(plan, fleet, tmp_path / name)
        again = lampyris.load_fleet(tmp_path / name, grid)
        assert (again.starts, again.goals) == (fleet.starts, fleet.goals)
    assert (lampyris.load_grid(tmp_path / "a.map").blocked == grid.blocked).all()
    rng = np.random.default_rng(seed)
    free = [(int(x), int(y)) for y, x in np.argwhere(~grid.blocked)]
    tasks = tuple(tuple(free[k] for k in rng.integers(len(free), size=rng.integers(1, 5))) for _ in range(9))
    whole = LeagueProblem(fleet.starts, tasks, 2.5)
    write_league(tmp_path / "b.json", grid, whole)
    found = read_league(tmp_path / "b.json", read_json((tmp_path / "b.json").read_bytes(), "b"), grid)
    assert (found.starts, found.tasks, found.reveal) == (whole.starts, tasks, 2.5)


def test_lengths_in_a_scen_are_octile(tmp_path: Path) -> None:
    grid = lampyris.Grid(np.zeros((5, 9), dtype=bool), name="open.map")
    fleet = lampyris.Fleet(grid, [lampyris.Agent((0, 0), (8, 4))])
    lampyris.export_fleet(lampyris.plan_fleet(fleet), fleet, tmp_path / "x.scen")
    line = (tmp_path / "x.scen").read_text().splitlines()[1].split("\t")
    assert line == ["2", "open.map", "9", "5", "0", "0", "8", "4", f"{4 + 4 * math.sqrt(2):.8f}"]
    walled = np.zeros((2, 3), dtype=bool)
    walled[:, 1] = True
    cut = lampyris.Fleet(lampyris.Grid(walled), [lampyris.Agent((0, 0), (2, 0))])
    none = lampyris.plan_fleet(cut)
    with pytest.raises(SettingError, match="not known"):
        lampyris.export_fleet(none, cut, tmp_path / "y.scen")
    with pytest.raises(UsageError, match="no paths"):
        lampyris.export_fleet(none, cut, tmp_path / "y.txt")
    with pytest.raises(UsageError, match=r"\.scen, \.json, \.txt"):
        lampyris.export_fleet(none, cut, tmp_path / "y.pdf")


def test_the_log_has_every_cell_at_every_tick(tmp_path: Path) -> None:
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 5, seed=4)
    plan = lampyris.plan_fleet(fleet)
    lampyris.export_fleet(plan, fleet, tmp_path / "log.txt")
    head, _, body = (tmp_path / "log.txt").read_text().partition("solution=\n")
    values = dict(line.split("=", 1) for line in head.splitlines())
    assert (values["agents"], values["solved"], values["soc"]) == ("5", "1", str(plan.sum_of_costs))
    rows = body.splitlines()
    assert len(rows) == plan.makespan + 1
    for tick, row in enumerate(rows):
        number, _, cells = row.partition(":")
        found = [tuple(map(int, pair.split(","))) for pair in cells.strip("(),").split("),(")]
        assert (int(number), found) == (tick, [tuple(c) for c in plan.at(tick).tolist()])


@pytest.mark.parametrize("seed", some(range(3000), 150))
def test_mutated_files_are_read_or_refused_with_a_reason(tmp_path: Path, seed: int) -> None:
    path = problem_in(tmp_path, "3\n0\n3\n7\n", "3\n9,3\n8\n1,2,10\n")
    rng = np.random.default_rng(seed)
    target = [path, tmp_path / "small.agents", tmp_path / "small.tasks"][seed % 3]
    data = bytearray(target.read_bytes())
    for _ in range(int(rng.integers(1, 6))):
        k = int(rng.integers(len(data))) if data else 0
        kind = rng.integers(3)
        if kind == 0 and data:
            data[k] = int(rng.choice([0, 10, 35, 44, 45, 48, 57, 92, 123, 255, rng.integers(256)]))
        elif kind == 1:
            data[k:k] = bytes(
                rng.choice(list(b'0123456789,#\n"{}-'), size=rng.integers(1, 12)).astype(np.uint8)
            )
        else:
            del data[k : k + int(rng.integers(1, 9))]
    target.write_bytes(bytes(data))
    grid = lampyris.load_grid(tmp_path / "maps" / "small.map")
    reason = None
    try:
        fleet = lampyris.load_fleet(path, grid)
    except LampyrisError as fault:
        reason = fault
    if reason is not None:
        assert reason.where
        assert reason.code != "REFEREE"
    else:
        assert len(set(fleet.starts)) == len(fleet) == len(set(fleet.goals))


def test_the_option(tmp_path: Path) -> None:
    target = tmp_path / "shop.json"
    words = ("fleet", "rooms-20", "--robots", "4", "--export")
    done = call(*words, str(target))
    assert (done.returncode, done.stdout.count("wrote ")) == (0, 4)
    assert call(*words, str(target)).returncode == 2, "files that exist are not overwritten"
    target.unlink()
    assert call(*words, str(target)).returncode == 2, "nor those beside it"
    assert call(*words, str(target), "--force").returncode == 0
    assert call(*words, "shop.pdf").returncode == 2


def test_too_many_lines_and_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = problem_in(tmp_path, "2\n0\n3\n", "2\n1\n2\n")
    grid = lampyris.load_grid(tmp_path / "maps" / "small.map")
    for name, value in (("MAX_LINES", 2), ("MAX_BYTES", 4)):
        assert lampyris.load_fleet(path, grid)
        with monkeypatch.context() as patched:
            patched.setattr(league_files, name, value)
            with pytest.raises(LimitError, match=rf"small.agents.*{value}"):
                lampyris.load_fleet(path, grid)
