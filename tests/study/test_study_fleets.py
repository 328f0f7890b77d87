"""Studies of fleets: the same rows wherever they run, every plan judged, every lie refused, every number on the page."""

from __future__ import annotations

import copy
import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from in_process import call
from lampyris.errors import FileError, LampyrisError
from lampyris.report.data.fleets.measures import (
    FLEET_METRICS,
    costs_by_seconds,
    fleet_metrics,
    improvements_of,
)
from lampyris.study.analysis.fleet_tables import falls, falls_by_seconds, tables_of
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.analysis.table import FLEET_LABELS, table_of
from lampyris.study.design.row import Row
from lampyris.study.design.serialize import study_of, study_plain
from lampyris.study.design.study import Study, StudyMap, canonical
from lampyris.study.design.study_file import load_study
from lampyris.study.design.study_map import pack
from lampyris.study.execution import evidence as e
from lampyris.study.execution import run as running
from lampyris.study.execution.batches import Batch, Letters
from lampyris.study.execution.execution import Execution
from lampyris.study.execution.fleets import fleet_evidence
from lampyris.study.execution.verify import ResultVerifier
from lampyris.study.execution.worker import work
from lampyris.study.page.page import page_of
from lampyris.study.store.store import Store

MAPS = "maps: [{bundled: rooms-20, queries: {random: 2}}]\n"
PLANNERS = "planners: [pibt, lacam, {name: lns, settings: {rounds: 40}}, prioritised-sipp]\n"
SMALL = f"version: 1\nname: small\nrobots: [2, 12]\n{MAPS}{PLANNERS}seeds: 2\n"


def put(folder: Path, text: str, name: str = "s.yaml") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


@pytest.fixture(scope="module")
def small(tmp_path_factory: pytest.TempPathFactory) -> Study:
    return load_study(put(tmp_path_factory.mktemp("study"), SMALL))


def rows_of(study: Study, where: Execution | None = None, done: tuple[str, ...] = ()) -> dict[str, Row]:
    rows: dict[str, Row] = {}
    running.run(study, lambda some: rows.update((r.key, r) for r in some), done=done, where=where)
    return rows


@pytest.fixture(scope="module")
def rows(small: Study) -> dict[str, Row]:
    return rows_of(small)


def plain_rows(rows: dict[str, Row]) -> dict[str, tuple[Any, ...]]:
    return {key: (r.ending, dict(r.metrics), r.error) for key, r in rows.items()}


def test_a_study_is_a_product_with_worlds_that_do_not_depend_on_the_planner(small: Study) -> None:
    assert (small.kind, len(small)) == ("fleet", 2 * 2 * 2 * 4)
    jobs = list(small.jobs())
    assert len({job.key for job in jobs}) == len(jobs)
    seeds = {(j.labels["query"], j.labels["robots"], j.labels["seed"]): set() for j in jobs}  # type: ignore[var-annotated]
    for job in jobs:
        seeds[job.labels["query"], job.labels["robots"], job.labels["seed"]].add(job.plain["seed"])
    assert all(len(one) == 1 for one in seeds.values())
    assert len(set().union(*seeds.values())) == len(seeds)
    again = study_of(json.loads(canonical(study_plain(small))), {h: g.grid for h, g in small.grounds.items()})
    assert [job.key for job in again.jobs()] == [job.key for job in jobs]
    assert [dict(job.labels) for job in again.jobs()] == [dict(job.labels) for job in jobs]


def test_more_robots_begin_with_fewer_and_more_fleets_with_the_same(tmp_path: Path, small: Study) -> None:
    more = load_study(put(tmp_path, SMALL.replace("random: 2", "random: 3").replace("seeds: 2", "seeds: 3")))
    assert {job.key for job in small.jobs()} <= {job.key for job in more.jobs()}


def test_rows_are_measured_from_plans_that_passed_the_referee(small: Study, rows: dict[str, Row]) -> None:
    assert all(row.ending == "done" for row in rows.values()), [r.error for r in rows.values() if r.error]
    for job in small.jobs():
        metrics, world = rows[job.key].metrics, small.worlds[job.index * len(small.worlds) // len(small)]
        assert set(metrics) == set(FLEET_METRICS)
        ends = world.fleet.ends[: job.plain["robots"]].tolist()  # type: ignore[union-attr]
        fleet = lampyris.Fleet(world.ground.grid, [lampyris.Agent((a, b), (c, d)) for a, b, c, d in ends])
        who = job.plain["planner"]
        plan = lampyris.plan_fleet(
            fleet, who["name"], seed=job.plain["seed"], planner_settings=who["settings"]
        )
        assert fleet_metrics(plan) == metrics
    lns = [rows[job.key].metrics for job in small.jobs() if job.plain["planner"]["name"] == "lns"]
    for metrics in lns:
        steps = improvements_of(metrics["improvements"])
        assert (steps[0][1], steps[-1][1]) == (metrics["first_cost"], metrics["sum_of_costs"])


@pytest.mark.parametrize(
    "where",
    [pytest.param(Execution(workers=2), marks=pytest.mark.nightly, id="two workers"), Execution(shuffle=3)],
)
def test_rows_are_the_same_wherever_and_in_whatever_order(
    small: Study, rows: dict[str, Row], where: Execution
) -> None:
    assert plain_rows(rows_of(small, where)) == plain_rows(rows)


def test_a_store_of_half_a_study_is_completed_with_the_same_bytes(tmp_path: Path) -> None:
    put(tmp_path, SMALL)
    line = ("study", "s.yaml", "--workers", "1", "--csv", "a.csv", "--store", "a.db")
    assert call(*line, cwd=tmp_path).returncode == 0
    study = load_study(tmp_path / "s.yaml")
    with Store.open(tmp_path / "a.db") as store:
        kept = list(store.scan())
    assert len(kept) == len(study)
    from lampyris.study.store.store import open_for

    with open_for(tmp_path / "b.db", study) as store:
        store.add(kept[::3])
    again = [word.replace("a.", "b.") for word in line]
    done = call(*again, cwd=tmp_path)
    assert (done.returncode, f"{len(kept) - len(kept[::3])} new" in done.stdout) == (0, True), done.stdout
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()
    with (tmp_path / "a.csv").open() as file:
        table = list(csv.DictReader(file))
    assert list(table[0])[2:7] == list(FLEET_LABELS)
    assert {row["robots"] for row in table} == {"2", "12"}
    assert call("study", "export", "a.db", "--latex", "a.tex", cwd=tmp_path).returncode == 0
    assert "by number of robots" in (tmp_path / "a.tex").read_text()


# ---- lies --------------------


def honest(study: Study) -> tuple[Any, StudyMap, Any, dict[str, Any]]:
    job = next(
        job for job in study.jobs() if job.plain["planner"]["name"] == "lns" and job.plain["robots"] == 12
    )
    ground = study.grounds[job.plain["map"]]
    letter = Letters(study.grounds, False, study.fleets)(Batch((job,)))
    (result,) = json.loads(work(letter))["results"]
    return job, ground, study.fleets[job.plain["fleet"]], result


def arrays_with(result: dict[str, Any], change: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
    made = copy.deepcopy(result)
    arrays = {
        k: np.array(v) for k, v in e.unpack_arrays(made["evidence"]["arrays"], fleet_evidence._ARRAYS).items()
    }
    change(arrays)
    made["evidence"]["arrays"] = e.pack_arrays(arrays, fleet_evidence._ARRAYS)
    return made


def test_every_lie_about_a_fleet_that_can_be_seen_is_refused(small: Study) -> None:
    job, ground, fleet, result = honest(small)
    judge = ResultVerifier()
    assert judge.row(job, result, ground, fleet).ending == "done"

    def moved(a: dict[str, Any]) -> None:
        a["starts"][0] += 1

    def jump(a: dict[str, Any]) -> None:
        a["steps"][0] = (2, 0)

    def cheaper(a: dict[str, Any]) -> None:
        a["shortest"][0] -= 1

    def rising(a: dict[str, Any]) -> None:
        a["improved"][-1, 1] += 5

    def together(a: dict[str, Any]) -> None:
        a["lengths"][1], a["starts"][1] = 1, a["starts"][0]

    for change in (moved, jump, cheaper, rising, together):
        row = judge.row(job, arrays_with(result, change), ground, fleet)
        assert (row.ending, row.error[:7]) == ("failed", "REFEREE"), change.__name__
    for key, value in (("status", "limit"), ("status", "won"), ("status", "cancelled"), ("bound", 10**6), ("bound", -1),
                       ("iterations", -1), ("kind", "plan"), ("notes", 3), ("arrays", {})):  # fmt: skip
        row = judge.row(job, {**result, "evidence": {**result["evidence"], key: value}}, ground, fleet)
        assert (row.ending, row.error[:7]) == ("failed", "REFEREE"), (key, value)


def test_costs_over_seconds_are_those_of_the_plan_or_refused(small: Study) -> None:
    job, ground, fleet, result = honest(small)
    judge = ResultVerifier()
    row = judge.row(job, result, ground, fleet)
    told = costs_by_seconds(row.timing["cost_by_s"])
    assert told[-1][1] == row.metrics["sum_of_costs"] < told[0][1] == row.metrics["first_cost"]
    assert 0.0 < told[0][0] <= told[-1][0] <= row.timing["plan_s"]
    last = told[-1][1]
    for lie in (f"0.000100:{last - 1}", f"0.000200:{last + 9} 0.000100:{last}", f"0.000100:{last} 0.000200:{last}", "", "soon",
                f"nan:{last}", f"-1.000000:{last}", 3, " ".join(f"0.000001:{last + k}" for k in range(64, -1, -1))):  # fmt: skip
        refused = judge.row(job, {**result, "timing": {**result["timing"], "cost_by_s": lie}}, ground, fleet)
        assert (refused.ending, refused.error[:18]) == ("failed", "REFEREE: cost_by_s"), lie
    silent = {key: value for key, value in result["timing"].items() if key != "cost_by_s"}
    assert judge.row(job, {**result, "timing": silent}, ground, fleet).ending == "done"


def test_a_worker_is_given_the_robots_or_says_that_it_was_not(small: Study) -> None:
    job, ground, _, _ = honest(small)
    said = {"grounds": {ground.hash: pack(ground.grid)}, "jobs": [job.plain], "memory": False}
    for fleets in ({}, {job.plain["fleet"]: "x"}, {job.plain["fleet"]: 3}):
        (result,) = json.loads(work(canonical({**said, "fleets": fleets})))["results"]
        assert (result["ending"], result["error"][:4]) == ("refused", "JOB:")


# ---- files --------------------


def test_fleets_of_movingai_files_and_of_lists(tmp_path: Path) -> None:
    (tmp_path / "m.map").write_text("type octile\nheight 4\nwidth 6\nmap\n" + "......\n" * 4)
    for k, starts in enumerate(((0, 1), (2, 3))):
        lines = "".join(f"0\tm.map\t6\t4\t{a}\t0\t{5 - a}\t3\t1\n" for a in starts)
        (tmp_path / f"m-{k}.scen").write_text(f"version 1\n{lines}")
    text = (
        "version: 1\nkind: fleet\nrobots: 2\nplanners: [pibt]\n"
        "maps:\n  - {scen: .}\n"
        "  - {file: m.map, queries: [{start: [0, 0], goal: [1, 1]}, {start: {m: [5.5, 0.5]}, goal: [2, 2]}]}\n"
    )
    study = load_study(put(tmp_path, text))
    assert [w.query for w in study.worlds] == ["m-0", "m-1", "listed"]
    assert study.worlds[2].fleet.ends.tolist() == [[0, 0, 1, 1], [5, 3, 2, 2]]  # type: ignore[union-attr]
    with pytest.raises(FileError, match="SCEN_LINES"):
        load_study(put(tmp_path, text.replace("robots: 2", "robots: [1, 3]")))


@pytest.mark.parametrize(
    ("old", "new", "code", "place"),
    [
        ("robots: [2, 12]\n", "kind: fleet\n", "KEY", ""),
        ("robots: [2, 12]", "robots: []", "ROBOTS", "/robots"),
        ("robots: [2, 12]", "robots: [2, 0]", "ROBOTS", "/robots/1"),
        ("robots: [2, 12]", "robots: [2, 2]", "DUPLICATE", "/robots/1"),
        ("robots: [2, 12]", "robots: 5000", "ROBOTS", "/maps/0/queries"),
        ("robots: [2, 12]", "robots: 2\nkind: plan", "KEY", "/robots"),
        ("seeds: 2", "laws: [physical]", "KEY", "/laws"),
        ("seeds: 2", "traffic: [none]", "KEY", "/traffic"),
        ("seeds: 2", "moves: dissertation", "MOVES", "/planners/0"),
        ("seeds: 2", "robot: {radius: 0.45}", "FLEET_ROBOT", "/planners/1"),
        ("seeds: 2", "robot: {drive: ackermann}", "FLEET_ROBOT", "/robot"),
        ("pibt,", "astar,", "PLANNER", "/planners/0"),
        ("pibt,", "cbs,", "BUDGET", "/planners/0"),
        ("random: 2", "random: 2, least: 3", "KEY", "/maps/0/queries/least"),
        (", queries: {random: 2}", "", "QUERIES", "/maps/0"),
        ("{random: 2}", "[{start: [1, 1], goal: [2, 2]}]", "ROBOTS", "/maps/0/queries"),
    ],
)
def test_a_mistake_in_a_study_of_fleets_is_named_with_its_place(
    old: str, new: str, code: str, place: str, tmp_path: Path
) -> None:
    assert old in SMALL
    with pytest.raises(LampyrisError) as caught:
        load_study(put(tmp_path, SMALL.replace(old, new)))
    assert caught.value.code == code, str(caught.value)
    assert caught.value.where.endswith(place) or f"{place}:" in caught.value.where, caught.value.where


def test_optimal_planners_run_within_a_budget(tmp_path: Path) -> None:
    text = (
        MAPS.replace("random: 2", "random: 1")
        + "version: 1\nrobots: 3\nplanners: [cbs]\nbudget: {expansions: 500}\n"
    )
    study = load_study(put(tmp_path, text))
    (row,) = rows_of(study).values()
    assert row.metrics["found"] is True
    assert row.metrics["lower_bound"] == row.metrics["sum_of_costs"]


# ---- the page --------------------


def test_tables_and_page_tell_each_measure_by_the_number_of_robots(
    small: Study, rows: dict[str, Row]
) -> None:
    table = table_of(small, rows)
    runs = runs_of(small, table.records())
    summary = summarise(runs)
    some = {tab.name: tab for tab in tables_of(summary, runs)}
    assert {"by-number-found", "by-number-ratio", "by-number-makespan", "improvement"} <= set(some)
    assert not any("plan-s" in name for name in some)  # seconds depend on the machine
    ratio = some["by-number-ratio"]
    assert [row[0] for row in ratio.rows] == [2, 12]
    for (
        number,
        *_,
    ) in ratio.rows:
        for k, entrant in enumerate(summary.entrants):
            mine = [
                rows[job.key].metrics["ratio"] for job in small.jobs()
                if job.labels["planner"] == entrant and job.labels["robots"] == number
            ]  # fmt: skip
            cell = next(row for row in ratio.rows if row[0] == number)[2 + k]
            assert float(str(cell).split()[0]) == pytest.approx(np.mean([m for m in mine if m]), abs=6e-4)
    lns = summary.entrants.index("lns rounds=40")
    assert all(steps[-1][1] >= bound for steps, bound in falls(runs, 1, lns))
    page = page_of(runs, summary)
    for words in ("Results by number of robots", "Solved (%)", "robots-found", "improvement-1", "12 robots"):
        assert words in page, words
    assert "Speed laws" not in page
    timed = summarise(runs, timing=True)
    assert any(tab.name == "by-number-plan-s" for tab in tables_of(timed, runs))
    assert "cost-by-s-1" not in page
    assert "cost-by-s-1" in page_of(runs, timed, timing=True)
    for steps, bound in falls_by_seconds(runs, 1, lns):
        assert steps[0][0] > 0.0
        assert steps[-1][1] >= bound
