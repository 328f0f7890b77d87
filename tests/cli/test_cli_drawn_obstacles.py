"""Moving obstacles drawn in a map are obstacles of every run on it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import lampyris
from bad_inputs.case import run
from lampyris.io.maps.load import load_map
from lampyris.model.change import Change
from lampyris.model.scene import Scene
from lampyris.model.traffic import RandomWalk
from lampyris.planning import registry

ROWS = "S..o....\n........\n..o...G.\n"
DRAWN = [[3, 0], [2, 2]]


@pytest.fixture
def drawn(tmp_path: Path) -> Path:
    path = tmp_path / "drawn.txt"
    path.write_text(ROWS, encoding="utf-8")
    return path


def told(*words: str) -> dict[str, Any]:
    record: dict[str, Any] = json.loads(run(*words, "--json", "--no-timing").out)
    return record


def test_simulate_and_drive_begin_with_them(drawn: Path) -> None:
    record = told("simulate", str(drawn), "--obstacles", "0")
    assert record["obstacles"][0] == DRAWN
    assert [b["kind"] for b in record["obstacle_specs"]] == ["random-walk"] * 2
    record = told("drive", str(drawn), "--obstacles", "1")
    assert [b["xy"][0] for b in record["obstacle_specs"]][:2] == DRAWN
    assert len(record["obstacle_specs"]) == 3


def test_their_size_is_that_of_the_option(tmp_path: Path) -> None:
    path = tmp_path / "wide.txt"
    path.write_text("S.......\n" + "........\n" * 5 + ".....o..\n" + "........\n" * 5 + "G.......\n")
    record = told("simulate", str(path), "--obstacles", "0", "--obstacle-radius", "0.9")
    assert [b["radius"] for b in record["obstacle_specs"]] == [0.9]


def test_a_saved_scenario_has_them_and_gives_the_same_run(tmp_path: Path, drawn: Path) -> None:
    found = load_map(drawn)
    assert found.start is not None
    assert found.goal is not None
    scene = Scene(found.grid, found.start, found.goal, traffic=found.traffic())
    first = lampyris.Scenario(scene, "dstar-lite", seed=3, simulated=True, map=None)
    for name in ("all.yaml", "all.json"):
        lampyris.save_scenario(first, tmp_path / name)
        again = lampyris.load_scenario(tmp_path / name)
        assert again.scene.traffic == (RandomWalk(2, starts=((3, 0), (2, 2))),)
        one, two = lampyris.run(first), lampyris.run(again)
        assert [t.tolist() for t in one.tracks] == [t.tolist() for t in two.tracks]


def scenario(tmp_path: Path, more: str) -> lampyris.Scenario:
    path = tmp_path / "s.yaml"
    path.write_text(f"version: 1\nmap: {{file: drawn.txt}}\nsimulate: {{}}\n{more}", encoding="utf-8")
    return lampyris.load_scenario(path)


def test_a_scenario_without_a_list_has_those_of_the_map(tmp_path: Path, drawn: Path) -> None:
    assert scenario(tmp_path, "").scene.traffic == (RandomWalk(2, starts=((3, 0), (2, 2))),)
    listed = scenario(tmp_path, "obstacles: [{kind: random-walk, count: 2, starts: [[3, 0]]}]\n")
    assert listed.scene.traffic == (RandomWalk(2, starts=((3, 0),)),)
    assert any("1 of 2 moving obstacles drawn in the map" in note for note in listed.notes)
    none = scenario(tmp_path, "obstacles: []\n")
    assert none.scene.traffic == ()
    assert any("2 of 2 moving obstacles drawn in the map" in note for note in none.notes)


def test_a_start_that_cannot_be_is_refused_at_its_place(tmp_path: Path, drawn: Path) -> None:
    for starts, word in (("[[99, 0]]", "(99, 0)"), ("[[3, 0], [3, 0]]", "twice"), ("[[1, 0, 2]]", "[x, y]")):
        with pytest.raises(lampyris.LampyrisError) as wrong:
            scenario(tmp_path, f"obstacles: [{{kind: random-walk, count: 2, starts: {starts}}}]\n")
        assert "obstacles" in wrong.value.where
        assert word in str(wrong.value)


def test_a_planner_that_sees_traffic_plans_round_where_they_begin(tmp_path: Path) -> None:
    path = tmp_path / "lane.txt"
    path.write_text("S.o...G\n.......\n", encoding="utf-8")
    found = load_map(path)
    assert found.start is not None
    assert found.goal is not None
    scene = Scene(found.grid, found.start, found.goal, traffic=found.traffic())
    for planner in ("sipp", "space-time-astar"):
        made = registry.make(planner, {"forecast": "still", "horizon": 9})
        plan = lampyris.plan(scene, made)
        assert plan.cells is not None
        assert (2, 0) not in [tuple(c) for c in plan.cells.tolist()]
        bare = made.open(Scene(found.grid, found.start, found.goal), None)
        cells = bare.plan(Change()).cells
        assert (2, 0) in [tuple(c) for c in cells.tolist()]


def test_a_comparison_says_that_it_leaves_them_aside(drawn: Path) -> None:
    done = run("compare", str(drawn), "--planners", "astar,dijkstra")
    assert "the 2 moving obstacles drawn in the map are left aside" in done.err + done.out
