"""``lampyris drive``: told, drawn, filmed, saved, and driven again to the same bytes."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Iterator
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import lampyris
from bad_inputs.case import inside, run
from lampyris.io.scenario.run_settings import DriveTable
from lampyris.model.settings.drive import DriveSettings

CALL = ("drive", "guide", "--radius", "0.2", "--obstacles", "2", "--seed", "3")


@pytest.fixture(autouse=True)
def _here(tmp_path: Path) -> Iterator[None]:
    with inside(tmp_path):
        yield


def told(*words: str, exit: int = 0) -> dict[str, Any]:
    done = run(*words, "--json", "--no-timing")
    assert done.exit == exit, done.err
    out = json.loads(done.out)
    assert isinstance(out, dict)
    return out


def test_a_drive_is_told_whole() -> None:
    r = told(*CALL)
    assert (r["outcome"], r["law"], r["seed"], r["timing"]) == ("arrived", "physical", 3, {})
    n = len(r["t"])
    assert {len(r[k]) for k in ("t", "s", "v", "a", "leg", "cause", "cause_index", "why")} == {n}
    assert r["t"][0] == r["v"][0] == r["v"][-1] == 0
    assert r["duration"] == r["t"][-1]
    assert r["duration"] >= r["optimum"] * (1 - 1e-9)
    assert sum(h["time"] for h in r["limited_by"]) == pytest.approx(1)
    assert len(r["obstacle_specs"]) == 2
    assert all(len(b["t"]) == len(b["xy"]) for b in r["obstacle_specs"])
    assert r["curves"][0]["xy"][0] == r["start"]
    assert r["curves"][-1]["end"] == r["goal"]
    assert r["moments"][-1]["word"] == "arrive"


@pytest.mark.nightly
def test_a_limit_on_jerk_is_told_not_to_bind_a_drive() -> None:
    note = "note: jerk_max limits profiles, not drives\n"
    plain = run(*CALL, "--json", "--no-timing")
    limited = run(*CALL, "--jerk-max", "0.1", "--save-scenario", "a.yaml", "--json", "--no-timing")
    assert note in limited.err
    assert note not in plain.err
    made = json.loads(limited.out)
    t, a = np.array(made["t"]), np.array(made["a"])
    # A push changes from one period to the next by more than a tenth of the limit would let it.
    assert np.abs(np.diff(a)).max() > 10 * 0.1 * np.diff(t).min()
    assert note in run("run", "a.yaml", "--json", "--no-timing").err
    assert "it limits profiles, not drives" in " ".join(run("drive", "--help").out.split())


@pytest.mark.parametrize("more", [("--smooth", "none"), ("--obstacles", "10", "--chart", "drive.png")])
def test_what_the_readme_drives(more: tuple[str, ...]) -> None:
    """Corners without arcs, and a way round that once ran nearer to a wall than the robot's radius."""
    r = told("drive", "env-3", "--resolution", "0.25", "--radius", "0.15", *more)
    assert (r["outcome"], r["v"][-1]) == ("arrived", 0)


def test_saved_and_run_again_it_is_the_same_to_the_byte() -> None:
    words = (
        *CALL,
        "--law",
        "rpp",
        "--obstacle-info",
        "velocities",
        "--tracking",
        "velocity",
        "--delay",
        "0.1",
    )
    done = run(*words, "--save-scenario", "a.yaml", "--json", "--no-timing")
    assert done.exit in (0, 4), done.err
    again = run("run", "a.yaml", "--save-scenario", "b.json", "--json", "--no-timing")
    assert (again.exit, again.out) == (done.exit, done.out)
    assert run("run", "b.json", "--json", "--no-timing").out == done.out
    assert lampyris.load_scenario("a.yaml") == lampyris.load_scenario("b.json")
    said = lampyris.load_scenario("a.yaml").drive
    assert said == {
        **asdict(DriveSettings()),
        "obstacle_info": "velocities",
        "tracking": "velocity",
        "delay": 0.1,
    }


@pytest.mark.nightly
def test_figures_films_and_tables_are_written() -> None:
    done = run(*CALL, "--film", "a.webp", "--chart", "a.png", "--csv", "a.csv")
    assert done.exit == 0, done.err
    assert "limited by" in done.out
    assert all(f"wrote a.{kind}" in done.out for kind in ("webp", "png", "csv"))
    r = told(*CALL)
    with open("a.csv") as file:
        rows = list(csv.DictReader(file))
    for name in ("t", "v", "a", "s"):
        assert [float(row["t_s" if name == "t" else name]) for row in rows] == r[name]
    assert [row["why"] for row in rows] == r["why"]
    with Image.open("a.webp") as film:
        assert 10 < film.n_frames <= 242
    with Image.open("a.png") as chart:
        assert chart.size[0] > 1000
    assert run(*CALL, "--chart", "a.png").exit == 2


def test_limits_of_the_robot_are_kept_and_felt() -> None:
    plain = told(*CALL[:-4], "--obstacles", "0", "--law", "optimum")
    slow = told(*CALL[:-4], "--obstacles", "0", "--law", "optimum", "--a-lat-max", "0.05")
    assert slow["duration"] > plain["duration"]
    assert slow["robot"]["a_lat_max"] == 0.05
    zones = np.full((10, 10), 0.3)
    np.save("z.npy", zones)
    # The optimum leaves zones aside, our law does not.
    zoned = told(*CALL[:-4], "--obstacles", "0", "--zones", "z.npy")
    assert max(zoned["v"]) <= 0.3 + 1e-9
    assert "zone" in zoned["cause"]


def test_a_scenario_may_say_how_to_drive() -> None:
    Path("s.yaml").write_text(
        "version: 1\nmap: guide\nrobot: {radius: 0.2, a_lat_max: 0.5, jerk_max: null}\n"
        "law: {name: physical, settings: {creep: 0.2, moving.reaction: 0.2}}\n"
        "obstacles: [{kind: crossing, count: 1}]\ndrive: {period: 0.2, patience: 3}\n"
    )
    r = told("run", "s.yaml")
    assert (r["period"], r["robot"]["a_lat_max"]) == (0.2, 0.5)
    scenario = lampyris.load_scenario("s.yaml")
    assert scenario.law_settings == {"creep": 0.2, "moving.reaction": 0.2}
    assert scenario.notes == ()
    assert scenario != replace(scenario, drive={**(scenario.drive or {}), "period": 0.1})
    for option in ("--explain", "--picture=x.png", "--layer=cost"):
        done = run("run", "s.yaml", option)
        assert done.exit == 2
        assert "a scenario that drives" in done.err
    assert run("run", "s.yaml", "--chart", "c.svg").exit == 0
    Path("p.yaml").write_text("version: 1\nmap: guide\n")
    assert "a scenario that plans" in run("run", "p.yaml", "--chart", "d.svg").err


def test_the_table_of_a_scenario_is_that_of_the_simulation() -> None:
    assert DriveTable.model_validate({}).model_dump() == asdict(DriveSettings())
    assert list(DriveTable.model_fields) == [f.name for f in fields(DriveSettings)] or set(
        DriveTable.model_fields
    ) == {f.name for f in fields(DriveSettings)}


@pytest.mark.parametrize(
    ("words", "exit", "says"),
    [
        (("--obstacle-info", "tarcks"), 2, "DRIVE_SETTING.*--obstacle-info: 'tarcks'.*did you mean tracks"),
        (("--tracking", "perfct"), 2, "DRIVE_SETTING.*did you mean perfect"),
        (("--on-hit", "x"), 2, "DRIVE_SETTING.*--on-hit: 'x'; allowed: end, go-on"),
        (("--period", "0"), 2, "DRIVE_SETTING.*--period"),
        (("--delay", "-1"), 2, "DRIVE_SETTING.*--delay"),
        (("--time-limit", "nan"), 2, "DRIVE_SETTING.*--time-limit"),
        (("--obstacle-speed", "0"), 2, "DRIVE_SETTING.*--obstacle-speed"),
        (("--law", "fast"), 2, "LAW"),
        (("--set-law", "blind.rech=1"), 2, "LAW_SETTING.*did you mean reach"),
        (("--film", "a.mp4"), 2, "SUFFIX|.webp"),
        (("--chart", "a.pdf"), 2, "SUFFIX"),
        (("--chart", "a.png", "--csv", "a.png"), 2, "OPTIONS.*two outputs"),
        (("--save-scenario", "a.txt"), 2, "SCENARIO_ENDING"),
        (("--mobility", "patrl"), 2, "MOBILITY.*did you mean patrol"),
        (("--obstacles", "900"), 2, "--obstacles: .*fit"),
    ],
)  # fmt: skip
def test_mistakes_are_named_before_anything_is_done(words: tuple[str, ...], exit: int, says: str) -> None:
    done = run("drive", "guide", *words)
    assert done.exit == exit, done.err
    assert re.search(says, done.err), done.err
    assert (done.out, list(Path().iterdir())) == ("", [])


def test_without_a_way_there_is_no_drive() -> None:
    Path("wall.txt").write_text(".#.\n.#.\n")
    words = ("drive", "wall.txt", "--start", "0,0", "--goal", "2,1", "--obstacles", "0")
    r = told(*words, exit=4)
    assert (r["outcome"], r["curves"]) == ("no-path", [])
    done = run(*words, "--chart", "c.png", "--film", "c.webp", "--csv", "c.csv")
    assert (done.exit, done.err) == (
        4,
        "note: the robot never set off, so no film, picture, chart, replay or CSV was written\n",
    )
    assert [p.name for p in Path().iterdir()] == ["wall.txt"]
