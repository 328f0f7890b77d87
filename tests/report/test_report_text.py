"""Numbers, CSV and tables."""

from __future__ import annotations

import csv
import math
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from report_samples import sample_plan, sample_profile, sample_scene, sample_trace

from lampyris import api
from lampyris.errors import FileError, UsageError
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.report.data.adgso_tables import jump_tables, text
from lampyris.report.data.csv import PLAN_COLUMNS, TRACE_COLUMNS, write_plan_csv, write_trace_csv
from lampyris.report.data.metrics import path_metrics


def test_metrics_of_a_path_known_by_heart() -> None:
    grid = Grid(np.zeros((8, 8), bool), resolution=0.5)
    cells = [(0, 0), (1, 0), (2, 1), (3, 2), (3, 3), (5, 4), (4, 4)]
    m = path_metrics(path_of(np.array(cells), MOVES["sixteen-connected"]), grid)
    length = 3 + 2 * math.sqrt(2) + math.sqrt(5)
    assert (m["cells"], m["straights"], m["diagonals"], m["knights"]) == (7, 3, 2, 1)
    assert m["length_cells"] == pytest.approx(length)
    assert m["length_m"] == pytest.approx(length / 2)
    assert m["turns"] == 4
    half = math.degrees(math.atan2(1, 2))
    assert m["turn_deg"] == pytest.approx(45 + 45 + (90 - half) + (180 - half))
    assert m["sharpest_deg"] == pytest.approx(180 - half)
    assert 0 < m["smoothness"] < 1


def test_metrics_of_a_straight_line_and_of_a_point() -> None:
    grid = Grid(np.zeros((1, 9), bool))
    line = path_metrics(path_of([[x, 0] for x in range(9)], MOVES["octile"]), grid)
    assert (line["turns"], line["smoothness"], line["sharpest_deg"]) == (0, 1.0, 0.0)
    point = path_metrics(path_of([[3, 0]], MOVES["octile"]), grid)
    assert (point["cells"], point["length_m"], point["smoothness"]) == (1, 0.0, 1.0)


def rows(path: Path) -> list[dict[str, str]]:
    raw = path.read_bytes()
    assert raw.endswith(b"\n")
    assert b"\r" not in raw
    return list(csv.DictReader(raw.decode().splitlines()))


def test_plan_csv_has_all_digits(tmp_path: Path) -> None:
    scene = sample_scene()
    turned = replace(scene.grid, origin=(1.0, 2.0, 3.0))
    plan = sample_plan(scene)
    profile = sample_profile(plan)
    assert plan.path is not None
    for grid in (scene.grid, turned):
        write_plan_csv(tmp_path / "plan.csv", plan, profile, grid)
        table = rows(tmp_path / "plan.csv")
        assert tuple(table[0]) == PLAN_COLUMNS
        assert PLAN_COLUMNS[:5] == ("x_m", "y_m", "yaw", "v", "t_s")
        assert len(table) == len(plan.path.cells)
        xy = grid.to_metres(plan.path.cells)
        for k, row in enumerate(table):
            # Exactly equal: repr keeps every bit.
            assert (float(row["x_m"]), float(row["y_m"])) == tuple(xy[k])
            for name in "vtsa":
                assert float(row["t_s" if name == "t" else name]) == getattr(profile, name)[k]
            assert row["cause"] == profile.cause[k]
            assert -math.pi <= float(row["yaw"]) <= math.pi
        for a, b in pairwise(table):
            ahead = math.atan2(float(b["y_m"]) - float(a["y_m"]), float(b["x_m"]) - float(a["x_m"]))
            assert math.remainder(ahead - float(a["yaw"]), 2 * math.pi) == pytest.approx(0, abs=1e-9)


def test_trace_csv_has_a_row_a_tick(tmp_path: Path) -> None:
    trace = sample_trace()
    write_trace_csv(tmp_path / "run.csv", trace)
    table = rows(tmp_path / "run.csv")
    assert tuple(table[0]) == TRACE_COLUMNS
    assert [int(r["tick"]) for r in table] == list(range(trace.ticks + 1))
    assert [[int(r["x"]), int(r["y"])] for r in table] == trace.robot.tolist()
    assert [float(r["v"]) for r in table] == trace.speed.tolist()
    assert [r["event"] for r in table if r["event"]] == ["replan", "wait", "arrive"]
    # It waits from tick 3 to 4 and keeps its yaw; at tick 0 it looks along its first step.
    assert table[4]["yaw"] == table[3]["yaw"]
    assert table[0]["yaw"] == table[1]["yaw"]


def test_csv_refuses_what_it_cannot_write(tmp_path: Path) -> None:
    scene = sample_scene()
    plan = sample_plan(scene)
    profile = sample_profile(plan)
    with pytest.raises(UsageError, match="a path of 0 nodes"):
        write_plan_csv(tmp_path / "a.csv", Plan(Status.NO_PATH, "x"), profile, scene.grid)
    short = replace(plan, path=path_of([[0, 0]], MOVES["four-connected"]))
    with pytest.raises(UsageError, match="a path of 1 nodes"):
        write_plan_csv(tmp_path / "a.csv", short, profile, scene.grid)
    with pytest.raises(FileError, match="nowhere"):
        write_plan_csv(tmp_path / "nowhere" / "a.csv", plan, profile, scene.grid)
    assert not (tmp_path / "a.csv").exists()


def test_jump_tables_list_rings_and_mark_the_choice() -> None:
    plan = sample_plan(sample_scene())
    tables = jump_tables(plan)
    assert len(tables) == len(plan.jumps)
    first = tables[0]
    assert first.rows == (
        ("1", f"({plan.jumps[0].chosen[0]},{plan.jumps[0].chosen[1]})", "1.500", "0.7500", "<- next"),
        ("2", "(0,0)", "3.250", "0.2500", ""),
    )
    assert first.chosen == 0
    assert "along the parents" in first.note
    assert "cheapest path" in tables[1].note
    lines = text(first).splitlines()
    assert lines[0].startswith("Iteration 1: at (1,1), luciferin 6.000; 2 accepted in 3 rings")
    assert lines[1].split() == ["ring", "accepted", "luciferin", "probability", "chosen"]
    assert len({line.index(mark) for line, mark in zip(lines[2:4], ("1.500", "3.250"), strict=True)}) == 1
    assert jump_tables(replace(plan, jumps=())) == ()


def test_a_plan_with_a_schedule_says_the_tick_of_each_node(tmp_path: Path) -> None:
    scene = Scene(
        Grid(np.array([[c == "#" for c in row] for row in ("##.##", ".....", "##.##")])),
        (0, 1),
        (4, 1),
        traffic=(Recorded(((2, 0), (2, 0), (2, 1), (2, 2))),),
    )
    plan = api.plan(scene, "sipp")
    write_plan_csv(tmp_path / "p.csv", plan, api.speed_profile(scene, plan), scene.grid)
    with (tmp_path / "p.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [int(r["tick"]) for r in rows] == [0, 1, 3, 4, 5]
    assert [(r["x"], r["y"]) for r in rows] == [(str(x), "1") for x in range(5)]
