"""What the page says again in its own files is what the package says."""

from __future__ import annotations

import csv
import json
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from test_page_play import needs_node, node

from lampyris.io.scenario.scenario import PRESETS
from lampyris.model.moves import MOVES
from lampyris.reproduce.tables import printed_data
from lampyris.study.analysis.measures import ALL

STATIC = files("lampyris.app").joinpath("static")


def source(name: str) -> str:
    """A file of the page."""
    return STATIC.joinpath(name).read_text(encoding="utf-8")


def printed() -> dict[str, Any]:
    """Tables 4.2 to 4.6 of the worked example as ``printed.json`` has them."""
    field: list[Any] = [None] * 100
    for row in printed_data.rows("4.2"):
        x, y = printed_data.cell(row["cell"])
        pointer = list(printed_data.cell(row["back_pointer"])) if row["back_pointer"] else None
        field[10 * y + x] = [row["luciferin"], pointer]
    claims = files("lampyris.reproduce").joinpath("data/claims.csv").read_text(encoding="utf-8")
    said = {row["id"]: row["printed"] for row in csv.DictReader(claims.splitlines())}
    own = next(row for row in printed_data.rows("4.10") if row["method"] == "ad-gso")
    return {
        "field": field,
        "walk": [iteration(table) for table in ("4.3", "4.4", "4.5", "4.6")],
        "whole": {
            "iterations": said["guide-iterations"],
            "gates": said["guide-gates"],
            "cost": said["guide-cost"],
            "table_cost": own["path_cost"],
        },
    }


def iteration(table: str) -> dict[str, Any]:
    """One of the tables of the walk."""
    rows = printed_data.rows(table)
    head = {row["name"]: row["printed"] for row in rows if row["part"] == "header"}
    accepted: dict[str, dict[str, str]] = {}
    for row in rows:
        if row["part"] == "accepted":
            accepted.setdefault(row["index"], {})[row["name"]] = row["printed"]
    return {
        "table": table,
        "current": list(printed_data.cell(head["current"])),
        "next": list(printed_data.cell(head["next"])) if "next" in head else None,
        "accepted": [[*printed_data.cell(one["cell"]), one["probability"]] for one in accepted.values()],
        "path": [list(printed_data.cell(row["printed"])) for row in rows if row["part"] == "path"],
    }


def test_printed_tables_are_the_packaged_ones() -> None:
    assert json.loads(source("printed.json")) == printed()


@pytest.mark.source
def test_the_tour_says_where_the_map_is_drawn_and_what_is_printed_for_another() -> None:
    """Figure 4.1 draws the map; 16.2, in Table 4.10, is for a map with two gates (issue 24, C22)."""
    told = source("tour.js")
    assert "draws no map" not in told
    assert "Figure 4.1" in told
    assert re.search(r"table_cost\} of its Table 4\.10 is for another map", told)
    method = (Path(__file__).parents[2] / "docs" / "method.md").read_text(encoding="utf-8")
    assert "Figure 4.1" in method
    assert "prints 13.4 and 16.2 for it" not in method
    assert re.search(r"16\.2 of its Table 4\.10 is for another", method)


def test_gates_have_one_symbol_and_one_name_in_pictures_map_and_key() -> None:
    """The map had crosses, its key squares, pictures diamonds (issue 24, C20)."""
    picture = (STATIC.joinpath("../../report/pictures/plan_picture.py")).read_text(encoding="utf-8")
    names = re.findall(r'\("(gate[^"]*)", \[g for g in gates', picture)
    assert '"marker": "D"' in picture
    key = re.search(r"const GATES = (\[.*\]);", source("legend.js"))
    assert key
    assert [name for _, name in json.loads(key[1])] == names
    for name in ("legend.js", "still.js"):
        assert "gateMarks(" in source(name), "the one drawing of a gate"
    assert 'shape: "gate"' in source("colours.js")
    assert "gateOutline(" in source("timeline.js")


def test_measures_are_those_of_studies() -> None:
    table = re.search(r"const MEASURES = \[(.*?)\n\];", source("measures.js"), re.DOTALL)
    assert table
    rows = re.findall(r'\["(\w+)", "([^"]+)", "(\w*)", (\d+)\]', table[1])
    assert len(rows) == len(table[1].strip().splitlines()) > 15
    for name, title, better, scale in rows:
        measure = ALL[name]
        assert better == measure.better, name
        if name == "plan_s":
            # Seconds there; a plan of the page takes milliseconds.
            assert (title, float(scale)) == ("planning (ms)", 1000 * measure.scale)
        else:
            assert (title, float(scale)) == (measure.title, measure.scale)


def test_presets_and_moves_are_the_scenario_file_s() -> None:
    text = source("settings.js")
    said = re.findall(r'(\w+): \{\s+moves: "(\w+)", law: "(\w+)"', text)
    assert {name: (moves, law) for name, moves, law in said} == PRESETS
    table = re.search(r"const MOVES = \{(.*?)\};", text, re.DOTALL)
    assert table
    assert set(re.findall(r'"?([\w-]+)"?: "\1:', table[1])) == set(MOVES)


@needs_node
def test_numbers_have_three_figures_and_what_is_left_of_a_sum_is_none(tmp_path: Path) -> None:
    script = """
    import { brief } from "./charts.js";
    console.log(JSON.stringify([0.15249, 4.44e-16, -1e-12, 0, 1e-6, 12.345, NaN].map(brief)));
    """
    assert node(tmp_path, script) == ["0.152", "0", "0", "0", "0.000001", "12.3", "\u2013"]
