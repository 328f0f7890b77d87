"""What runs did otherwise than asked: in rows, stores, exports and pages; stores of before rows had it."""

from __future__ import annotations

import csv
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from one_samples import planner, results_of, study_of

import lampyris
from lampyris.cli.verbs.study import tables
from lampyris.model.grid import Grid
from lampyris.study.analysis.export import write_csv
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.analysis.summary_tables import tabs
from lampyris.study.analysis.table import table_of
from lampyris.study.design.row import Row
from lampyris.study.design.study import Study, StudyTraffic
from lampyris.study.execution.verify import ResultVerifier
from lampyris.study.front import run_study
from lampyris.study.otherwise import remark
from lampyris.study.page.page import page_of
from lampyris.study.store.store import Store

NOTE = "min_clearance 3 was weakened to 0 cells: no path to the goal keeps more"


def corridor() -> Grid:
    """Walls above and below a way one cell wide."""
    blocked = np.ones((5, 12), dtype=bool)
    blocked[2] = False
    return Grid(blocked, name="corridor", resolution=0.5)


def study(kind: str, **more: Any) -> Study:
    """A planner whose wish cannot be kept, beside one that has none."""
    far = replace(planner("ad-gso", min_clearance=3), label="far")
    return study_of(kind, (far, "astar"), StudyTraffic(), grid=corridor(), start=(0, 2), goal=(11, 2), **more)


@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
def test_a_row_says_what_was_weakened(kind: str) -> None:
    table = run_study(study(kind))
    assert dict(zip(table["planner"], table["notes"], strict=True)) == {"far": NOTE, "astar": None}


def test_the_store_and_the_csv_keep_it(tmp_path: Path) -> None:
    one = study("plan")
    run_study(one, tmp_path / "a.db")
    with Store.open(tmp_path / "a.db", writable=False) as store:
        table = table_of(store.study(), store.scan())
    write_csv(tmp_path / "a.csv", table)
    with (tmp_path / "a.csv").open(encoding="utf-8", newline="") as file:
        found = {line["planner"]: line["notes"] for line in csv.DictReader(file)}
    assert found == {"far": NOTE, "astar": ""}


@pytest.mark.nightly
def test_the_page_the_tables_and_the_summary_say_it() -> None:
    one = study("simulate", seeds=(0, 1, 2))
    runs = runs_of(one, run_study(one).records())
    summary = summarise(runs)
    said = f"3 of 3 runs of far did otherwise than asked: {NOTE}"
    assert summary.notes == (said,)
    assert summary.as_json()["notes"] == [said]
    assert f"{said}." in tabs(summary)[0].note
    assert f"<p>{said}.</p>" in page_of(runs, summary, films=False)


def test_nothing_is_said_where_all_was_done_as_asked() -> None:
    one = study_of("plan", ("astar",), StudyTraffic())
    assert summarise(runs_of(one, run_study(one).records())).notes == ()


@pytest.mark.nightly
def test_rows_of_before_they_had_it_are_read_as_without(tmp_path: Path) -> None:
    one = study("plan")
    made = run_study(one)
    names = [name for name in made.metrics if name != "notes"]
    old = [
        Row(key, "done", {name: made[name][k] for name in names}) for k, key in enumerate(made["key"])
    ]  # fmt: skip
    with Store.create(tmp_path / "old.db", one) as store:
        store.add(old)
    table = run_study(one, tmp_path / "old.db")
    assert table["notes"] == [None, None]
    assert table["cost"] == made["cost"]
    runs = runs_of(one, table.records())
    assert summarise(runs).notes == ()
    assert "otherwise than asked" not in page_of(runs, summarise(runs), films=False)


def test_notes_of_a_worker_are_cut_and_cannot_command_a_terminal() -> None:
    one = study_of("plan", ("astar",), StudyTraffic())
    (job,), (result,) = list(one.jobs()), results_of(one)
    ground = next(iter(one.grounds.values()))

    def row(notes: Any) -> Row:
        evidence = {**result["evidence"], "notes": notes}
        return ResultVerifier().row(job, {**result, "evidence": evidence}, ground)

    assert row(["\x1b[2J"]).metrics["notes"] == "?[2J"
    for n, kept in ((499, 499), (500, 500), (501, 500)):
        assert row(["x" * n]).metrics["notes"] == "x" * kept
    for n, kept in ((19, 19), (20, 20), (21, 20)):
        assert row(["x"] * n).metrics["notes"] == "; ".join(["x"] * kept)
    assert row(["", ""]).metrics["notes"] is None
    for wrong in ("weakened", [1], None):
        assert row(wrong).error.startswith("REFEREE: [EVIDENCE]: evidence: notes of another kind"), wrong


def test_a_remark_quotes_the_most_frequent_notes_first() -> None:
    assert remark("a", ["", ""]) == ""
    assert remark("a", ["n"]) == "a: n"
    assert remark("a", ["n", "", "n"]) == "2 of 3 runs of a did otherwise than asked: n"
    many = ["p", "q", "q", "r", "s", "t", ""]
    said = "6 of 7 runs of a did otherwise than asked: q (2); p (1); r (1); 2 other notes"
    assert remark("a", many) == said


def test_the_library_says_the_same() -> None:
    scene = lampyris.Scene(corridor(), (0, 2), (11, 2))
    plan = lampyris.plan(scene, "ad-gso", min_clearance=3)
    assert plan.notes == (NOTE,)
    assert json.dumps(plan.notes)


def test_the_terminal_says_it_beneath_the_results(capsys: pytest.CaptureFixture[str]) -> None:
    one = study("plan")
    tables.print_summary(summarise(runs_of(one, run_study(one).records())))
    assert f"far: {NOTE}" in capsys.readouterr().out.splitlines()
