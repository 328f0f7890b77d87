"""``lampyris fleet --execute`` and ``--lifelong``: text, JSON, films, exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import lampyris
from in_process import call

ROOMS = ("fleet", "rooms-20", "--robots", "8", "--seed", "1")


def test_execute_prints_what_python_says() -> None:
    words = (
        *ROOMS,
        "--execute",
        "--delays",
        "0.2",
        "--delay-duration",
        "2",
        "--v-max",
        "0.8",
        "--json",
        "--no-timing",
    )
    said = call(*words)
    assert said.returncode == 0
    record = json.loads(said.stdout)
    fleet = lampyris.random_fleet(lampyris.load_grid("rooms-20"), 8, seed=1)
    trace = lampyris.simulate_fleet(
        fleet, lampyris.plan_fleet(fleet, seed=1), delays=lampyris.Delays(0.2, 2.0), seed=1,
        robot=lampyris.Robot(radius=0.35, v_max=0.8),
    )  # fmt: skip
    assert record["arrivals_s"] == trace.arrivals.tolist()
    assert record["lateness_s"] == trace.lateness.tolist()
    assert record["waits_s"] == trace.wait_totals()
    assert (record["contacts"], record["arrived"], record["delayed"]) == (0, 8, trace.delayed)
    assert record["timing"] == {}
    assert call(*words).stdout == said.stdout


def test_text_and_film(tmp_path: Path) -> None:
    said = call(
        *ROOMS, "--execute", "--obstacles", "2", "--film", "a.webp", "--picture", "a.png", cwd=tmp_path
    )
    assert said.returncode in (0, 4), said.stderr
    for word in ("contacts", "0 pairs", "lateness", "waiting", "obstacles", "order of visits"):
        assert word in said.stdout, said.stdout
    with Image.open(tmp_path / "a.webp") as film:
        assert film.n_frames > 20
        first = np.asarray(film.convert("RGB")).astype(int)
        film.seek(film.n_frames - 1)
        assert (np.asarray(film.convert("RGB")) != first).any()
    assert (tmp_path / "a.png").stat().st_size > 1000


def test_a_fault_that_blocks_the_only_way_is_exit_4(tmp_path: Path) -> None:
    (tmp_path / "m.map").write_text("type octile\nheight 1\nwidth 9\nmap\n.........\n")
    (tmp_path / "a.csv").write_text("start_x,start_y,goal_x,goal_y\n2,0,8,0\n0,0,7,0\n")
    words = ("fleet", "m.map", "--agents", "a.csv", "--execute", "--fault", "0@2")
    said = call(*words, cwd=tmp_path)
    assert said.returncode == 4
    assert "in the way of robot 1" in said.stdout
    record = json.loads(call(*words, "--json", cwd=tmp_path).stdout)
    assert record["faults"] == [{"robot": 0, "t_s": 2.0}]
    assert record["arrivals_s"] == [None, None]


def test_orca_counts_its_contacts() -> None:
    said = call(*ROOMS, "--execute", "--policy", "orca", "--json")
    record = json.loads(said.stdout)
    assert record["settings"]["policy"] == "orca"
    assert said.returncode == (0 if record["arrived"] == 8 else 4)
    assert record["contacts"] >= 0
    assert record["wall_contacts"] == 0


def test_lifelong_prints_throughput(tmp_path: Path) -> None:
    said = call(*ROOMS, "--lifelong", "40", "--film", "b.webp", cwd=tmp_path)
    assert said.returncode == 0
    for word in ("throughput", "utilisation", "service", "40 windows"):
        assert word in said.stdout, said.stdout
    assert (tmp_path / "b.webp").stat().st_size > 1000
    record = json.loads(
        call(*ROOMS, "--lifelong", "40", "--window", "4", "--planner", "lacam", "--json", cwd=tmp_path).stdout
    )
    assert (record["planner"], record["windows"], record["window"]) == ("lacam", 10, 4)
    assert (
        record["throughput"]
        == record["completed"] / 40
        == sum(one["done"] is not None for one in record["tasks"]) / 40
    )
    assert len(record["paths"]) == 8
    assert len(record["paths"][0]) == 41
    (tmp_path / "t.csv").write_text("release,x,y\n0,1,1\n5,2,1\n")
    record = json.loads(call(*ROOMS, "--lifelong", "60", "--tasks", "t.csv", "--json", cwd=tmp_path).stdout)
    assert len(record["tasks"]) == 2  # and not the goals that are drawn without a file


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--delays", "0.1"), "--delays without --execute"),
        (("--window", "3"), "--window without --lifelong"),
        (("--execute", "--lifelong", "5"), "both given"),
        (("--execute", "--delay-duration", "2"), "without --delays"),
        (("--execute", "--fault", "x"), "ROBOT@TIME"),
        (("--execute", "--fault", "99@3"), "robot 0 to 7"),
        (("--execute", "--delays", "2"), "--delays: 2"),
        (("--execute", "--radius", "0.5"), "must not touch"),
        (("--lifelong", "5", "--planner", "cbs"), "plans no windows"),
        (("--lifelong", "5", "--fault", "1@2.5"), "whole tick"),
        (("--fault", "1@2"), "--execute or --lifelong"),
        (("--execute", "--policy", "orca", "--obstacles", "2"), "policy orca"),
    ],
)
def test_options_that_do_not_go_together_are_refused(words: tuple[str, ...], said: str) -> None:
    done = call(*ROOMS, *words)
    assert done.returncode in (2, 3), done.stdout
    assert said in done.stderr, done.stderr


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--policy", "orca", "--delays", "0.1"), "--delays with --policy orca"),
        (("--fault", "9@3"), "--fault: (9, 3.0)"),
        (("--fault", "1@-3"), "--fault: (1, -3.0)"),
        (("--radius", "0.5"), "--radius: "),
        (("--drive", "ackermann"), "--drive: "),
        (("--obstacle-radius", "1"), "--obstacle-radius without --obstacles"),
    ],
)
def test_wrong_values_and_options_without_effect_are_exit_2(words: tuple[str, ...], says: str) -> None:
    done = call("fleet", "guide", "--robots", "3", "--execute", *words)
    assert done.returncode == 2
    assert says in done.stderr


def test_tasks_of_a_file_are_all_that_is_counted(tmp_path: Path) -> None:
    file = tmp_path / "tasks.csv"
    file.write_text("release,x,y\n0,4,4\n500,1,9\n")
    done = call("fleet", "guide", "--robots", "3", "--lifelong", "60", "--tasks", str(file), "--json")
    assert done.returncode == 0
    assert json.loads(done.stdout)["completed"] == 1


def test_the_json_of_a_drive_has_the_motion_of_every_robot() -> None:
    record = json.loads(call(*ROOMS, "--execute", "--delays", "0.2", "--json").stdout)
    motion = {name: np.array(values) for name, values in record["phases"].items()}
    grid = lampyris.load_grid("rooms-20")
    for k, (start, goal) in enumerate(zip(record["starts"], record["goals"], strict=True)):
        own = {name: values[motion["robot"] == k] for name, values in motion.items()}
        assert (np.diff(own["t"]) >= 0).all()
        far = own["duration"] * (own["v"] + 0.5 * own["a"] * own["duration"])
        ends = np.stack((own["x"] + far * own["dx"], own["y"] + far * own["dy"]), axis=1)
        assert [own["x"][0], own["y"][0]] == pytest.approx(grid.to_metres(start), abs=1e-9)
        assert ends[-1] == pytest.approx(grid.to_metres(goal), abs=1e-6)
        assert own["t"][-1] + own["duration"][-1] == pytest.approx(record["arrivals_s"][k])
