"""Scenario files of fleets: read, run and saved, with every mistake at its place; larger cells; robots with a size."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import lampyris
from in_process import call
from lampyris.errors import FileError, LampyrisError, SceneError, SettingError, UsageError
from lampyris.io.fleet_scenario.scenario import (
    MAX_ITERATIONS,
    MAX_TIME,
    FleetExecution,
    FleetScenario,
    Lifelong,
)
from lampyris.io.fleet_scenario.schema import json_schema
from lampyris.io.maps.coarse import coarse_fleet, coarse_grid
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.lifelong import FleetTask

ROOT = Path(__file__).resolve().parents[2]
GRID = lampyris.Grid(np.zeros((6, 8), dtype=bool), resolution=0.5, name="hall")
AGENTS = [lampyris.Agent((0, 0), (7, 5)), lampyris.Agent((7, 5), (0, 0)), lampyris.Agent((3, 1), (4, 4))]
FLEET = lampyris.Fleet(GRID, AGENTS)
HALL = (
    "map: {rows: ['........', '........', '........', '........', '........', '........'], resolution: 0.5}\n"
)


def put(folder: Path, text: str, name: str = "f.yaml") -> Path:
    (folder / name).write_text(f"version: 1\n{HALL}{text}", encoding="utf-8")
    return folder / name


def read(path: Path) -> FleetScenario:
    made = lampyris.load_scenario(path)
    assert isinstance(made, FleetScenario)
    return made


@pytest.mark.parametrize("ending", ["yaml", "json"])
@pytest.mark.parametrize(
    "scenario",
    [
        FleetScenario(FLEET),
        FleetScenario(FLEET, "lns", {"rounds": 5}, "octile", 7, 40, name="a b"),
        FleetScenario(
            lampyris.Fleet(GRID, [replace(AGENTS[0], robot=lampyris.Robot(0.1)), replace(AGENTS[1], robot=lampyris.Robot(0.12))]),
            execution=FleetExecution({"obstacles": 1}, Delays(0.2, 1.0)), faults=((1, 2.5),),
        ),
        FleetScenario(FLEET, "pibt", lifelong=Lifelong(20, 2, (FleetTask([(1, 1), (2, 2)], 3), FleetTask([(0, 0)])))),
        FleetScenario(FLEET, "pibt", lifelong=Lifelong(9), faults=((0, 4),)),
    ],
    ids=["plain", "settings", "drive", "tasks", "lifelong"],
)  # fmt: skip
def test_what_is_saved_is_read_again_and_runs_alike(
    scenario: FleetScenario, ending: str, tmp_path: Path
) -> None:
    file = tmp_path / f"s.{ending}"
    assert lampyris.save_scenario(scenario, file) == ()
    again = read(file)
    assert again.fleet.robots == scenario.fleet.robots or scenario.execution is not None
    assert (again.seed, again.moves, again.name, again.faults) == (
        scenario.seed, scenario.moves, scenario.name, scenario.faults,
    )  # fmt: skip
    lampyris.save_scenario(again, tmp_path / f"t.{ending}")
    assert (tmp_path / f"t.{ending}").read_bytes() == file.read_bytes()  # nothing is left to a default
    assert lampyris.run(again) == lampyris.run(scenario)


def test_each_kind_of_fleet_in_a_file(tmp_path: Path) -> None:
    rows = "".join(
        f"0\tinline\t8\t6\t{a}\t{b}\t{c}\t{d}\t1\n"
        for (a, b), (c, d) in ((one.start, one.goal) for one in AGENTS)
    )
    (tmp_path / "a.scen").write_text(f"version 1\n{rows}")
    (tmp_path / "a.csv").write_text("start_x,start_y,goal_x,goal_y,radius\n0,0,7,5,0.1\n7,5,0,0,0.05\n")
    listed = read(
        put(
            tmp_path,
            "robot: {v_max: 2}\n"
            "fleet: {agents: [{start: [0, 0], goal: {m: [3.9, 0.1]}, radius: 0.2, tasks: [[1, 1]]}]}\n",
        )
    )
    (one,) = listed.fleet.robots
    assert (one.goal, one.tasks, one.robot) == ((7, 5), ((1, 1),), lampyris.Robot(radius=0.2, v_max=2.0))
    scen = read(put(tmp_path, "fleet: {scen: a.scen, robots: 2}\n"))
    assert [robot.start for robot in scen.fleet.robots] == [(0, 0), (7, 5)]
    table = read(put(tmp_path, "fleet: {file: a.csv}\n"))
    assert table.fleet.radii.tolist() == [0.2, 0.1]
    drawn = read(put(tmp_path, "fleet: {random: 4, seed: 3}\n"))
    assert drawn.fleet == lampyris.random_fleet(drawn.fleet.grid, 4, seed=3)


MISTAKES = [
    ("fleet: {random: 0}\n", "ROBOTS", "/fleet/random"),
    ("fleet: {randm: 3}\n", "KEY", "/fleet"),
    ("fleet: {agents: [{start: [0, 0], goal: [9, 9]}]}\n", "GOAL_OUTSIDE", "/fleet/agents/0/goal"),
    ("fleet: {agents: [{start: [0, 0], goal: [1, 1]}, {start: [0, 0], goal: [2, 2]}]}\n", "FLEET", "/fleet/agents/1/start"),
    ("fleet: {random: 2}\nplanner: lacan\n", "PLANNER", "/planner"),
    ("fleet: {random: 2}\nplanner: {name: lns, settings: {rounds: -1}}\n", "ROUNDS", "/planner/settings/rounds"),
    ("fleet: {random: 2}\nexecute: {period: 0}\n", "FLEET_DRIVE", "/execute/period"),
    ("fleet: {random: 2}\nexecute: {delays: {probability: 3}}\n", "DELAYS", "/execute/delays/probability"),
    ("fleet: {random: 2}\nexecute: {}\nlifelong: {ticks: 4}\n", "KEY", "/execute"),
    ("fleet: {random: 2}\nfaults: [{robot: 0, time: 1}]\n", "KEY", "/faults"),
    ("fleet: {random: 2}\nexecute: {}\nfaults: [{robot: 5, time: 1}]\n", "FAULTS", "/faults/0/robot"),
    ("fleet: {random: 2}\nlifelong: {ticks: 4, tasks: [{stops: [[8, 0]]}]}\n", "TASK", "/lifelong/tasks/0"),
    ("fleet: {random: 2}\nlifelong: {ticks: 4}\nplanner: cbs\n", "PLANNER", "/planner"),
    ("fleet: {random: 2, agents: [{start: [0, 0], goal: [1, 1]}]}\n", "KEY", "/fleet"),
    ("fleet: {random: 99}\n", "ROBOTS", "/fleet/random"),
    ("fleet: {random: 100001}\n", "ROBOTS", "/fleet/random"),
    ("fleet: {scen: missing.scen}\n", "FILE_MISSING", "/fleet/scen"),
    ("fleet: {agents: [{start: [0, 99999999999999999999], goal: [1, 1]}]}\n", "START_OUTSIDE", "/fleet/agents/0/start"),
    ("fleet: {agents: [{start: [0, 0], goal: {m: [1.0e+300, 1]}}]}\n", "GOAL_OUTSIDE", "/fleet/agents/0/goal"),
    ("fleet: {agents: [{start: [0, 99999999999999999999], goal: [1, 1]}]}\ncell: 1\n", "START_OUTSIDE", "/fleet/agents/0/start"),
    ("fleet: {random: 2}\nexecute: {}\nfaults: {robot: 1, time: 2}\n", "TYPE", "/faults"),
    ("fleet: {random: 2}\nexecute: {}\nfaults: [[1, 2]]\n", "TYPE", "/faults/0"),
    ("fleet: {random: 2}\nexecute: {}\nfaults: 1@2\n", "TYPE", "/faults"),
    ("fleet: {random: 2}\nexecute: {}\nfaults: [{robot: 1, time: 2}, {robot: 1, time: 3}]\n", "FAULTS", "/faults/1/robot"),
    ("fleet: {random: 2}\nexecute: {}\nfaults: [{robot: 1, time: 1.0e+12}]\n", "FAULTS", "/faults/0/time"),
    ("fleet: {random: 2}\nlifelong: {ticks: 4}\nfaults: [{robot: 1, time: 1.5}]\n", "FAULTS", "/faults/0/time"),
    ("fleet: {random: 2}\nexecute: {policy: orca}\nfaults: [{robot: 1, time: 2}]\n", "KEY", "/faults"),
    ("fleet: {random: 2}\nexecute: {policy: orca, delays: {probability: 0.1}}\n", "KEY", "/execute/delays"),
    ("fleet: {random: 2}\nexecute: {policy: orca}\nbudget: {seconds: 1}\n", "KEY", "/budget"),
    ("fleet: {random: 2}\nlifelong: {ticks: 4}\nbudget: {iterations: 1}\n", "KEY", "/budget"),
    ("fleet: {random: 2}\nbudget: {iterations: 1000000000001}\n", "BUDGET", "/budget/iterations"),
    ("fleet: {random: 2}\nlifelong: {ticks: 4, window: 10001}\n", "WINDOW", "/lifelong/window"),
    ("fleet: {random: 2}\nlifelong: {ticks: 4, tasks: [{stops: [[1, 0]], robot: 2}]}\n", "TASK", "/lifelong/tasks/0/robot"),
    ("fleet: {random: 2}\nlifelong: {ticks: 4, tasks_file: missing.csv}\n", "FILE_MISSING", "/lifelong/tasks_file"),
    ("fleet: {random: 2}\ncell: 0.7\n", "CELL", "/cell"),
    ("fleet: {random: 2}\nrobot: {drive: ackermann}\n", "FLEET_ROBOT", "/robot"),
    ("fleet: {scen: ../a.scen}\n", "PATH_OUTSIDE", "/fleet/scen"),
    ("fleet: {random: 2}\nlaw: physical\n", "KEY", "/law"),
]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "code", "place"), MISTAKES, ids=[place or code for _, code, place in MISTAKES]
)
def test_a_mistake_is_named_with_its_place(text: str, code: str, place: str, tmp_path: Path) -> None:
    file = put(tmp_path, text)
    with pytest.raises(LampyrisError) as caught:
        lampyris.load_scenario(file)
    assert caught.value.code == code, str(caught.value)
    assert str(file) in caught.value.where
    assert caught.value.where.endswith(place) or f"{place}:" in caught.value.where
    assert caught.value.allowed or caught.value.todo or code == "FILE_MISSING"


def test_several_mistakes_are_reported_together(tmp_path: Path) -> None:
    file = put(tmp_path, "fleet: {random: 2}\nplanner: lacan\nexecute: {}\nlifelong: {ticks: 4}\ncell: 0.7\n")
    done = call("run", file)
    assert done.returncode == 3
    assert re.findall(r"error\[(\w+)\]", done.stderr) == ["PLANNER", "KEY", "CELL"]


def test_the_forms_of_a_fleet_and_the_way_out_are_in_the_message(tmp_path: Path) -> None:
    for text, words in (
        ("fleet: {robots: 20}\n", "{random: N}"),
        ("fleets: {random: 20}\n", "did you mean /fleet?"),
        ("fleet: {random: 20}\nrobot: {radius: 0.6}\n", "discs of radius 0.6 m found room"),
        ("fleet: {agents: [{start: [0, 0], goal: [7, 5]}, {start: [1, 1], goal: [3, 3]}]}\ncell: 1\n", "make `cell` smaller"),
        ("fleet: {random: 2}\nexecute: {}\nfaults: 1@2\n", "a list of {robot: K, time: T}"),
    ):  # fmt: skip
        with pytest.raises(LampyrisError, match=re.escape(words)):
            lampyris.load_scenario(put(tmp_path, text))
    kept = read(put(tmp_path, "fleet: {agents: [{start: [0, 0], goal: [7, 5], tasks: [[1, 1]]}]}\n"))
    assert any("without effect" in note for note in kept.notes)


def test_limits_of_faults_and_iterations_are_taken() -> None:
    drive = FleetExecution()
    assert FleetScenario(FLEET, iterations=MAX_ITERATIONS).iterations == MAX_ITERATIONS
    assert FleetScenario(FLEET, execution=drive, faults=((0, MAX_TIME / 2),)).faults == ((0, MAX_TIME / 2),)
    with pytest.raises(SettingError, match="BUDGET"):
        FleetScenario(FLEET, iterations=MAX_ITERATIONS + 1)
    for wrong in ([(0, MAX_TIME)], [0, 1], {0: 1}, "0@1", [(0, -1)], [(0.5, 1)], [(0, 1, 2)]):
        with pytest.raises(SettingError, match="FAULTS"):
            FleetScenario(FLEET, execution=drive, faults=wrong)  # type: ignore[arg-type]


def test_what_goes_wrong_in_a_run_names_the_file(tmp_path: Path) -> None:
    for text in ("", "execute: {}\n"):
        file = put(tmp_path, f"fleet: {{random: 2}}\nrobot: {{radius: 0.24}}\n{text}")
        done = call("run", file)
        assert done.returncode == 3
        assert f"{file}: robots[0].robot" in done.stderr.replace("\n", " ")


def test_a_drive_without_a_plan_is_saved_and_refuses_what_plans(tmp_path: Path) -> None:
    line = ("fleet", "rooms-20", "--robots", "2", "--execute", "--policy", "orca")
    done = call(*line, "--json", "--no-timing", "--save-scenario", "s.yaml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert call("run", "s.yaml", "--json", "--no-timing", cwd=tmp_path).stdout == done.stdout
    for words in (("--planner", "lns"), ("--seconds", "1"), ("--iterations", "4"), ("--moves", "octile")):
        assert call(*line, *words).returncode == 2, words
    for words in (("--moves", "octile"), ("--iterations", "4"), ("--set", "swap=false")):
        assert call("fleet", "rooms-20", "--robots", "2", "--lifelong", "5", *words).returncode == 2, words
    assert call("fleet", "rooms-20", "--robots", "2", "--lifelong", "5", "--fault", "9@2").returncode == 2
    with pytest.raises(SettingError, match="DELAYS"):
        lampyris.simulate_fleet(FLEET, delays=Delays(0.1), policy="orca")


def test_robots_that_a_file_cannot_tell_apart_and_a_fault_without_a_drive_are_refused(tmp_path: Path) -> None:
    slow = [replace(AGENTS[0], robot=lampyris.Robot(v_max=0.5)), replace(AGENTS[1], robot=lampyris.Robot())]
    with pytest.raises(SettingError, match=r"robots\[1\]"):
        lampyris.save_scenario(FleetScenario(lampyris.Fleet(GRID, slow)), tmp_path / "a.yaml")
    with pytest.raises(SettingError, match="FLEET_SCENARIO"):
        FleetScenario(FLEET, faults=((0, 1),))
    with pytest.raises(SettingError, match="FLEET_SCENARIO"):
        FleetScenario(FLEET, execution=FleetExecution(), lifelong=Lifelong(3))
    with pytest.raises(SettingError, match="TYPE"):
        FleetScenario(GRID)  # type: ignore[arg-type]


def test_the_command_line_saves_what_it_runs(tmp_path: Path) -> None:
    for words in ((), ("--execute", "--delays", "0.2", "--radius", "0.3"), ("--lifelong", "12")):
        line = ("rooms-20", "--robots", "3", "--seed", "4", *words)
        done = call("fleet", *line, "--save-scenario", "s.yaml", "--force", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        own = call("fleet", *line, "--json", "--no-timing", cwd=tmp_path)
        again = call("run", "s.yaml", "--json", "--no-timing", cwd=tmp_path)
        assert (again.returncode, again.stdout) == (0, own.stdout), again.stderr
    assert call("run", "s.yaml", "--chart", "c.png", cwd=tmp_path).returncode == 2


@pytest.mark.source
def test_the_schema_in_the_docs_is_current() -> None:
    kept = (ROOT / "docs" / "fleet.schema.json").read_text(encoding="utf-8")
    assert kept == json.dumps(json_schema(), indent=2) + "\n", (
        "lampyris schema --fleet > docs/fleet.schema.json"
    )
    assert json.loads(call("schema", "--fleet").stdout) == json_schema()


# ---- larger cells --------------------


def test_a_coarse_cell_is_free_only_if_all_cells_in_it_are() -> None:
    rng = np.random.Generator(np.random.PCG64(5))
    for times in (1, 2, 3, 4):
        blocked = rng.random((9, 17)) < 0.04
        grid = lampyris.Grid(blocked, resolution=0.05, origin=(3.0, -2.0, 0.4))
        coarse = coarse_grid(grid, 0.05 * times)
        assert (coarse.height, coarse.width) == (-(-9 // times), -(-17 // times))
        inside: dict[tuple[int, int], list[bool]] = {}
        for b, a in np.ndindex(blocked.shape):
            cell = coarse.to_cell(*grid.to_metres((a, b)).tolist())
            inside.setdefault(cell, []).append(not blocked[b, a])
        for y, x in np.ndindex(coarse.blocked.shape):
            some = inside[x, y]
            assert coarse.blocked[y, x] == (len(some) < times * times or not all(some))


def test_starts_and_goals_are_the_coarse_cells_that_hold_them() -> None:
    coarse = coarse_grid(GRID, 1.0)
    made = coarse_fleet(FLEET, coarse)
    assert [(one.start, one.goal) for one in made.robots] == [
        ((0, 0), (3, 2)),
        ((3, 2), (0, 0)),
        ((1, 0), (2, 2)),
    ]
    blocked = np.zeros((6, 8), dtype=bool)
    blocked[1, 1] = True
    near = lampyris.Grid(blocked, resolution=0.5)
    with pytest.raises(
        SceneError, match=r"robot 0: its start \(0, 0\), in larger cells: \(0, 0\) is blocked"
    ):
        coarse_fleet(lampyris.Fleet(near, AGENTS[:1]), coarse_grid(near, 1.0))
    with pytest.raises(FileError, match="robot 1"):
        coarse_fleet(
            lampyris.Fleet(GRID, [lampyris.Agent((0, 0), (7, 5)), lampyris.Agent((1, 1), (3, 3))]), coarse
        )
    assert coarse_grid(GRID, 0.5) is GRID
    for cell in (0.1, 0.75, float("nan"), "1"):
        with pytest.raises(SettingError, match="CELL"):
            coarse_grid(GRID, cell)  # type: ignore[arg-type]
    with pytest.raises(SettingError, match="no free cell"):
        coarse_grid(near, 3.0)


def test_the_command_line_plans_in_larger_cells_and_says_so(tmp_path: Path) -> None:
    pgm = b"P5\n40 20\n255\n" + bytes([254] * 800)
    (tmp_path / "lab.pgm").write_bytes(pgm)
    (tmp_path / "lab.yaml").write_text(
        "image: lab.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "r.yaml").write_text("agents:\n  - {start_m: [0.1, 0.1], goal_m: [1.9, 0.9], radius: 0.15}\n")
    line = ("lab.yaml", "--agents", "r.yaml", "--cell", "0.5")
    done = call("fleet", *line, "--save-scenario", "s.yaml", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "10 x 10 cells of the map" in done.stderr.replace("\n", " ")
    assert "of radius 0.15 m" in done.stdout
    record = json.loads(call("run", "s.yaml", "--json", cwd=tmp_path).stdout)
    assert (record["paths"][0][0], record["paths"][0][-1]) == ([0, 1], [3, 0])


# ---- robots with a size --------------------


def test_a_radius_counts_in_planning_and_is_refused_with_the_reason(tmp_path: Path) -> None:
    saved = tmp_path / "s.yaml"
    done = call("fleet", "rooms-20", "--robots", "2", "--radius", "0.45", "--save-scenario", saved)
    assert (done.returncode, saved.exists()) == (2, False)
    assert "prioritised-sipp" in done.stderr
    done = call("fleet", "rooms-20", "--robots", "2", "--radius", "0.45", "--planner", "prioritised-sipp")
    assert (done.returncode, "of radius 0.45 m" in done.stdout) == (0, True), done.stderr
    done = call("fleet", "rooms-20", "--robots", "2", "--radius", "0.3", "--lifelong", "5")
    assert done.returncode == 2


def test_the_robot_of_a_file_and_the_radii_of_agents(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text("rectangle: [0.4, 0.3]\nv_max: 2.0\n")
    (tmp_path / "a.json").write_text(
        json.dumps(
            {"agents": [{"start": [1, 1], "goal": [3, 3]}, {"start": [3, 3], "goal": [1, 1], "radius": 0.1}]}
        )
    )
    line = ("rooms-20", "--agents", "a.json", "--robot", "robot.yaml", "--save-scenario", "s.yaml", "--force")
    assert call("fleet", *line, cwd=tmp_path).returncode == 0
    first, second = read(tmp_path / "s.yaml").fleet.robots
    assert first.robot == lampyris.Robot(radius=0.25, v_max=2.0)
    assert second.robot == lampyris.Robot(radius=0.1, v_max=2.0)
    (tmp_path / "a.json").write_text(
        json.dumps({"agents": [{"start": [1, 1], "goal": [3, 3], "radius": -1}]})
    )
    done = call("fleet", "rooms-20", "--agents", "a.json", cwd=tmp_path)
    assert (done.returncode, "radius is -1" in done.stderr) == (3, True)


def test_lifelong_fleets_take_the_tasks_of_a_league_problem(tmp_path: Path) -> None:
    (tmp_path / "m.map").write_text("type octile\nheight 3\nwidth 4\nmap\n....\n....\n....\n")
    (tmp_path / "r.agents").write_text("2\n0\n3\n")
    (tmp_path / "r.tasks").write_text("5\n1,2\n8\n9,10\n4\n6,7,11\n")
    keys = {"mapFile": "m.map", "agentFile": "r.agents", "taskFile": "r.tasks", "teamSize": 2}
    (tmp_path / "p.json").write_text(json.dumps(keys))
    done = call("fleet", "m.map", "--agents", "p.json", "--lifelong", "60", "--json", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    tasks = json.loads(done.stdout)["tasks"]
    assert [one["stops"] for one in tasks] == [
        [[1, 0], [2, 0]],
        [[0, 2]],
        [[1, 2], [2, 2]],
        [[0, 1]],
        [[2, 1], [3, 1], [3, 2]],
    ]
    assert all(one["done"] is not None for one in tasks)
    (tmp_path / "s.yaml").write_text(
        "version: 1\nmap: {file: m.map}\nfleet: {file: p.json}\nlifelong: {ticks: 60}\n"
    )
    assert json.loads(call("run", "s.yaml", "--json", cwd=tmp_path).stdout)["tasks"] == tasks
    trace = lampyris.lifelong_fleet(lampyris.Fleet(GRID, AGENTS), 1, tasks=[])
    assert (trace.mean_service_time, len(trace.service_times)) == (None, 0)
    with pytest.raises(SettingError, match="FLEET_ROBOT"):
        lampyris.lifelong_fleet(lampyris.Fleet(GRID, [replace(AGENTS[0], robot=lampyris.Robot(0.3))]), 3)


def test_outputs_of_a_whole_plan_are_refused_where_there_is_none(tmp_path: Path) -> None:
    for words, why in (
        (("--lifelong", "5"), "window by window"),
        (("--execute", "--policy", "orca"), "makes no plan"),
    ):
        done = call("fleet", "rooms-20", "--robots", "2", *words, "--picture", "p.png", cwd=tmp_path)
        assert (done.returncode, why in done.stderr.replace("\n", " ")) == (2, True), done.stderr
    with pytest.raises(UsageError):
        lampyris.save_scenario(FleetScenario(FLEET), tmp_path / "s.txt")
