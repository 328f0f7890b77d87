"""Studies of fleets that drive, of lifelong fleets, and of sizes: every run judged, lies refused, all of it on the page."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from in_process import call
from lampyris.errors import LampyrisError
from lampyris.report.data.fleets.drive_measures import FLEET_DRIVE_METRICS, LIFELONG_METRICS
from lampyris.study.analysis.fleet_tables import tables_of
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.analysis.table import table_of
from lampyris.study.design.row import Row
from lampyris.study.design.serialize import study_of, study_plain
from lampyris.study.design.study import Study, canonical
from lampyris.study.design.study_file import load_study
from lampyris.study.execution import evidence as e
from lampyris.study.execution import run as running
from lampyris.study.execution.batches import Batch, Letters
from lampyris.study.execution.fleets import drive_evidence
from lampyris.study.execution.verify import ResultVerifier
from lampyris.study.execution.worker import work
from lampyris.study.page.page import page_of

HEAD = "version: 1\nmaps: [{bundled: rooms-20, queries: {random: 1}}]\n"
DRIVES = (
    HEAD + "robots: [3]\nradius: [0.2, 0.35]\ndelays: [0, 0.3]\nexecute: {obstacles: 1}\nplanners: [pibt]\n"
)
LIFELONG = HEAD + "robots: 5\nlifelong: {ticks: 14}\nplanners: [pibt, lacam]\n"


def put(folder: Path, text: str) -> Path:
    (folder / "s.yaml").write_text(text, encoding="utf-8")
    return folder / "s.yaml"


def rows_of(study: Study) -> dict[str, Row]:
    rows: dict[str, Row] = {}
    running.run(study, lambda some: rows.update((r.key, r) for r in some))
    assert all(row.ending == "done" for row in rows.values()), [r.error for r in rows.values() if r.error]
    return rows


def fleet_of(study: Study, job: Any) -> lampyris.Fleet:
    world = next(w for w in study.worlds if w.ground.hash == job.plain["map"])
    assert world.fleet is not None
    ends = world.fleet.ends[: job.plain["robots"]].tolist()
    return lampyris.Fleet(world.ground.grid, [lampyris.Agent((a, b), (c, d)) for a, b, c, d in ends])


def page_words(study: Study, rows: dict[str, Row], films: bool) -> tuple[set[str], str]:
    runs = runs_of(study, table_of(study, rows).records())
    summary = summarise(runs)
    return {tab.name for tab in tables_of(summary, runs)}, page_of(runs, summary, films=films)


def test_drives_are_those_of_simulate_fleet(tmp_path: Path) -> None:
    study = load_study(put(tmp_path, DRIVES))
    assert len(study) == 2 * 2
    again = study_of(json.loads(canonical(study_plain(study))), {h: g.grid for h, g in study.grounds.items()})
    assert [job.key for job in again.jobs()] == [job.key for job in study.jobs()]
    rows = rows_of(study)
    assert len({job.plain["seed"] for job in study.jobs()}) == 1  # of the numbers of robots alone
    for job in study.jobs():
        metrics = rows[job.key].metrics
        assert set(FLEET_DRIVE_METRICS) < set(metrics)
        fleet = fleet_of(study, job)
        plan = lampyris.plan_fleet(fleet, "pibt", seed=job.plain["seed"])
        robot = lampyris.Robot(radius=job.labels["radius"])
        trace = lampyris.simulate_fleet(
            fleet,
            plan,
            robot=robot,
            seed=job.plain["seed"],
            delays=lampyris.Delays(job.labels["delays"]),
            obstacles=1,
        )
        assert metrics["sum_of_costs"] == plan.sum_of_costs
        assert metrics["duration_s"] == trace.duration_s
        assert metrics["lateness_mean_s"] == np.nanmean(trace.lateness)
        assert (metrics["delayed"], metrics["contacts"]) == (trace.delayed, 0)
    names, page = page_words(study, rows, films=False)
    assert {"by-number-lateness-mean-s", "by-number-wait-order-s", "by-number-ratio"} <= names
    for words in (
        "robots-lateness_mean_s",
        "3 of radius 0.35 m, 0.3 of moves delayed",
        "drives of many robots",
    ):
        assert words in page, words


def test_lifelong_fleets_are_those_of_lifelong_fleet(tmp_path: Path) -> None:
    study = load_study(put(tmp_path, LIFELONG))
    rows = rows_of(study)
    for job in study.jobs():
        trace = lampyris.lifelong_fleet(
            fleet_of(study, job), 14, planner=job.plain["planner"]["name"], seed=job.plain["seed"]
        )
        metrics = rows[job.key].metrics
        assert set(LIFELONG_METRICS) < set(metrics)
        assert (metrics["throughput"], metrics["utilisation"]) == (trace.throughput, trace.utilisation)
        assert (metrics["service_ticks"], metrics["in_motion"]) == (trace.mean_service_time, trace.moving)
    names, page = page_words(study, rows, films=True)
    assert {"by-number-throughput", "by-number-utilisation", "by-number-service-ticks"} <= names
    assert "lifelong fleets" in page
    assert "image/webp" in page


def lies_refused(
    study: Study, form: dict[str, tuple[str, int]], lies: dict[str, Any], words: dict[str, Any]
) -> None:
    """Each change of an array, and of a word, of honest evidence is refused."""
    job = list(study.jobs())[-1]
    ground, fleet = study.grounds[job.plain["map"]], study.fleets[job.plain["fleet"]]
    (result,) = json.loads(work(Letters(study.grounds, False, study.fleets)(Batch((job,)))))["results"]
    judge = ResultVerifier()
    assert judge.row(job, result, ground, fleet).ending == "done"
    honest = {
        name: np.array(array) for name, array in e.unpack_arrays(result["evidence"]["arrays"], form).items()
    }
    for name, lie in lies.items():
        arrays = {key: array.copy() for key, array in honest.items()}
        arrays[name] = lie(arrays[name])
        claim = {**result["evidence"], "arrays": e.pack_arrays(arrays, form)}
        row = judge.row(job, {**result, "evidence": claim}, ground, fleet)
        assert (row.ending, row.error[:7]) == ("failed", "REFEREE"), name
    for name, value in words.items():
        row = judge.row(job, {**result, "evidence": {**result["evidence"], name: value}}, ground, fleet)
        assert (row.ending, row.error[:7]) == ("failed", "REFEREE"), name


def moved(array: np.ndarray) -> np.ndarray:
    array.flat[0] += 1
    return array


def test_lies_about_drives_are_refused(tmp_path: Path) -> None:
    study = load_study(put(tmp_path, DRIVES))
    lies: dict[str, Any] = dict.fromkeys(("robot", "columns", "arrivals", "planned", "waits", "discs"), moved)
    words = {
        "status": "no-path",
        "plan": None,
        "counts": [1, 0, 0, 0, 0, 0],
        "tick": -1.0,
        "kind": "lifelong",
        "notes": 3,
    }
    lies_refused(study, drive_evidence._DRIVE, lies, words)


def test_lies_about_lifelong_fleets_are_refused(tmp_path: Path) -> None:
    study = load_study(put(tmp_path, LIFELONG))
    lies: dict[str, Any] = dict.fromkeys(
        ("starts", "steps", "done", "assigned", "visits", "stop_counts"), moved
    )
    lies["steps"] = lambda steps: steps[: len(steps) // 2 * 1 - len(steps) // 2 % 6]
    words = {"status": "limit", "windows": -1, "fallbacks": 10**6, "kind": "fleet-plan"}
    lies_refused(study, drive_evidence._LIFELONG, lies, words)


def test_sizes_of_cells_and_radii_are_compared(tmp_path: Path) -> None:
    grid = np.zeros((12, 16), dtype=bool)
    np.save(tmp_path / "m.npy", grid)
    text = (
        "version: 1\nrobots: 2\ncell: [1, 2]\nradius: [0.4, 0.9]\nplanners: [prioritised-sipp]\nmaps:\n"
        "  - {file: m.npy, queries: [{start: [0, 2], goal: [13, 9]}, {start: [13, 2], goal: [2, 9]}]}\n"
        "  - {file: m.npy, queries: {random: 1}}\n"
    )
    study = load_study(put(tmp_path, text))
    assert [w.ground.grid.resolution for w in study.worlds] == [1, 2, 1, 2]
    assert study.worlds[1].fleet.ends.tolist() == [[0, 1, 6, 4], [6, 1, 1, 4]]  # type: ignore[union-attr]
    rows = rows_of(study)
    assert {row.metrics["found"] for row in rows.values()} == {True}
    assert {(j.labels["map"], j.labels["radius"]) for j in study.jobs()} == {
        ("m.npy", 0.4), ("m.npy", 0.9), ("m.npy, cells of 2 m", 0.4), ("m.npy, cells of 2 m", 0.9),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "code", "place"),
    [
        (DRIVES.replace("delays: [0, 0.3]", "delays: [0, 2]"), "DELAYS", "/delays/1"),
        (DRIVES.replace("delays: [0, 0.3]", "delays: [0, 0]"), "DUPLICATE", "/delays/1"),
        (DRIVES.replace("radius: [0.2, 0.35]", "radius: [0.2, 0.4]"), "FLEET_ROBOT", "/radius/1"),
        (DRIVES.replace("plan", "robot: {radius: 0.2}\nplan"), "KEY", "/radius"),
        (DRIVES.replace("{obstacles: 1}", "{policy: orca}"), "KEY", "/delays"),
        (DRIVES.replace("execute: {obstacles: 1}\n", ""), "KEY", "/delays"),
        (
            DRIVES.replace("execute: {obstacles: 1}", "execute: {obstacles: -1}"),
            "FLEET_DRIVE",
            "/execute/obstacles",
        ),
        (DRIVES + "lifelong: {ticks: 9}\n", "KEY", "/lifelong"),
        (DRIVES + "cell: 1.5\n", "CELL", "/cell"),
        (LIFELONG.replace("lacam", "lns"), "PLANNER", "/planners/1"),
        (LIFELONG.replace("lacam", "{name: lacam, settings: {samples: 3}}"), "KEY", "/planners/1"),
        (LIFELONG + "moves: octile\n", "MOVES", "/moves"),
        (LIFELONG + "radius: 0.4\n", "FLEET_ROBOT", "/radius"),
        (LIFELONG + "budget: {expansions: 9}\n", "KEY", "/budget/expansions"),
        (HEAD + "planners: [astar]\nlifelong: {ticks: 3}\n", "KEY", "/lifelong"),
    ],
)
def test_a_mistake_is_named_with_its_place(text: str, code: str, place: str, tmp_path: Path) -> None:
    with pytest.raises(LampyrisError) as caught:
        load_study(put(tmp_path, text))
    assert caught.value.code == code, str(caught.value)
    assert caught.value.where.endswith(place) or f"{place}:" in caught.value.where, caught.value.where


def test_a_chosen_run_becomes_a_film(tmp_path: Path) -> None:
    put(tmp_path, LIFELONG)
    assert call("study", "s.yaml", "--workers", "1", "--store", "a.db", cwd=tmp_path).returncode == 0
    assert call("study", "film", "a.db", "1", "one.webp", cwd=tmp_path).returncode == 0
    assert (tmp_path / "one.webp").read_bytes()[8:12] == b"WEBP"
    wrong = call("study", "film", "a.db", "2", "two.webp", cwd=tmp_path)
    assert (wrong.returncode, "0 to 1" in wrong.stderr) == (2, True)
    assert not (tmp_path / "two.webp").exists()
