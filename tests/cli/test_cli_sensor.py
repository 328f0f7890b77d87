"""``simulate`` with a sensor and with a goal that moves: options, output, scenario files."""

from __future__ import annotations

import json
from pathlib import Path

from in_process import run

SEES = (
    "simulate",
    "guide",
    "--planner",
    "dstar-lite",
    "--obstacles",
    "0",
    "--sensor-range",
    "2",
    "--field-of-view",
    "120",
)


def test_a_sensor_is_printed_recorded_and_saved(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = run(*SEES)
    assert text.exit == 0, text.err
    assert "sensor: 2 m, 120 degrees; " in text.out
    made = run(*SEES, "--json", "--no-timing", "--save-scenario", "s.yaml")
    found = json.loads(made.out)
    assert found["sensor"] == {"range_m": 2.0, "field_of_view": 2.0943951023931953, "unseen_cost": 1.0}
    assert {len(row) for row in found["seen"]} == {10}
    assert found["goals"] is None
    again = run("run", "s.yaml", "--json", "--no-timing")
    assert json.loads(again.out) == found


def test_a_goal_that_moves_is_read_recorded_and_saved(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("goal.csv").write_text("x,y\n7,0\n7,0\n7,1\n7,1\n7,2\n")
    call = ("simulate", "guide", "--planner", "sipp", "--obstacles", "0", "--goal-track", "goal.csv")
    found = json.loads(run(*call, "--json", "--no-timing", "--save-scenario", "g.yaml").out)
    assert found["outcome"] == "arrived"
    assert found["goals"][:5] == [[7, 0], [7, 0], [7, 1], [7, 1], [7, 2]]
    assert found["robot"][-1] == found["goals"][-1]
    assert json.loads(run("run", "g.yaml", "--json", "--no-timing").out) == found
    Path("f.yaml").write_text(
        "version: 1\nmap: guide\ngoal: [7, 0]\nplanner: sipp\nobstacles: []\nsimulate: {goal_track_file: goal.csv}\n"
    )
    assert json.loads(run("run", "f.yaml", "--json", "--no-timing").out)["robot"] == found["robot"]


def test_what_is_refused_names_its_option_or_place(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    alone = run("simulate", "guide", "--field-of-view", "90")
    assert (alone.exit, "error[FIELD_OF_VIEW]: --field-of-view: 90" in alone.err) == (2, True)
    Path("s.yaml").write_text("version: 1\nmap: guide\nsimulate: {field_of_view: 90}\n")
    place = run("run", "s.yaml")
    assert (place.exit, "s.yaml:3:27: /simulate/field_of_view" in place.err) == (3, True), place.err
    Path("i.yaml").write_text(
        "version: 1\nmap: guide\ninflation: {inflation_radius: 2}\nsimulate: {sensor_range: 3}\n"
    )
    inflated = run("run", "i.yaml")
    assert (inflated.exit, "SENSOR_INFLATION" in inflated.err) == (3, True), inflated.err


def test_cells_of_a_goal_that_cannot_be_name_their_file(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    cases = {
        "off": ("-1,3\n", "error[GOAL_OUTSIDE]: off.csv: goal (-1, 3) is outside the map"),
        "jump": ("7,0\n2,3\n", "error[OBSTACLE_SPEED]: jump.csv: jumps from (7, 0) to (2, 3)"),
        "leaves": ("7,0\n7,-1\n", "error[GOAL_TRACK]: leaves.csv: cell (7, -1) at tick 1"),
    }
    for name, (rows, message) in cases.items():
        Path(f"{name}.csv").write_text("x,y\n" + rows)
        done = run("simulate", "guide", "--obstacles", "0", "--goal-track", f"{name}.csv")
        assert done.exit == 3
        assert message in done.err
    Path("s.yaml").write_text("version: 1\nmap: guide\nsimulate: {goal_track: [[7, 0], [2, 3]]}\n")
    done = run("run", "s.yaml")
    assert (done.exit, "s.yaml:3:24: /simulate/goal_track: jumps" in done.err) == (3, True), done.err
