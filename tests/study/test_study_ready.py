"""Ready studies: each is read, is as large as it says, asks what its name says, and its runs come to rows."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import LampyrisError
from lampyris.io.maps.save import save_map
from lampyris.model.grid import Grid
from lampyris.planning import registry
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.analysis.summary_tables import START, tabs
from lampyris.study.design import bundled
from lampyris.study.design.row import Row
from lampyris.study.design.study import Study
from lampyris.study.design.study_file import load_study
from lampyris.study.execution.run import run

SIZES = {
    "density": 3024,
    "dissertation": 4500,
    "laws": 1080,
    "movingai": 2000,
    "poses": 300,
    "sensitivity": 6300,
    "unknown-maps": 378,
}
SWARMS = (
    "gso",
    "igso",
    "pso",
    "lpso",
    "apso",
    "ipso",
    "pso-apf",
    "diversity-pso",
    "ant-system",
    "mmas-dstar",
)
SIZES["line-up"] = 900 * (len(registry.names()) + len(SWARMS))


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """A folder with a map and two ``.scen`` files of 200 queries each about it."""
    save_map(Grid(np.zeros((30, 40), dtype=bool)), tmp_path / "open.map")
    for name, down in (("a", 20), ("b", 10)):
        lines = [
            f"{k // 10}\topen.map\t40\t30\t{k % 40}\t{k // 40}\t{k % 40}\t{k // 40 + down}\t{down}\n"
            for k in range(200)
        ]
        (tmp_path / f"{name}.scen").write_text("version 1\n" + "".join(lines))
    return tmp_path


def loaded(name: str, bench: Path) -> Study:
    """A ready study."""
    return load_study(name, data=bench if name == "movingai" else None)


def test_these_are_ready() -> None:
    assert bundled.names() == tuple(sorted(SIZES))
    with pytest.raises(LampyrisError, match=r"^error\[FILE_MISSING\].*did you mean laws\?"):
        bundled.text("law")


@pytest.mark.parametrize("name", bundled.names())
def test_each_is_as_large_as_it_says_and_explains_itself(name: str, bench: Path) -> None:
    study = loaded(name, bench)
    assert study.name == name
    assert len(study) == SIZES[name]
    assert study.about == bundled.about(name)
    assert study.about.count("?") >= 1
    said = {"movingai": "1,000 plans", "line-up": "900 simulations"}.get(name, f"{len(study):,} ")
    assert said in study.about
    assert re.search(r"about \d+ (second|minute)s of one core", study.about), "what it costs"
    assert bundled.text(name).startswith("# "), "comments for people"
    assert study.seconds is None, "reproducible"


@pytest.mark.nightly
def test_what_they_ask() -> None:
    compared, everyone = load_study("dissertation"), load_study("line-up")
    assert len(compared.worlds) >= 30
    assert len(compared.seeds) >= 10
    assert len({w.ground.name for w in compared.worlds}) == 6
    assert [(w.name, w.settings["gates"]) for w in compared.planners] == [
        ("ad-gso", "replan"), ("ad-gso", "close"), ("ad-gso", "ignore"), ("dstar-lpso", "replan"),
        ("dstar16-lpso", "close"),
    ], "each way with gates, so that like meets like"  # fmt: skip
    assert [(c.kind, c.tracks) for c in compared.traffic_cases] == [("random-walk", "live")] * 3
    assert {w.name for w in everyone.planners} == set(registry.names())
    keys = {job.key for job in everyone.jobs()}
    told = ("ad-gso (passes", "dstar")
    same = [job for job in compared.jobs() if job.labels["planner"].startswith(told)]
    assert len(same) == 2700
    assert all(job.key in keys for job in same), "the same worlds: the same runs"
    without = [w.name for w in everyone.planners if w.settings.get("seeded") is False]
    assert sorted(without) == sorted(SWARMS) == sorted(w.name for w in everyone.planners if w.starts_exact)
    density = load_study("density")
    assert {c.tracks for c in density.traffic_cases} == {"replayed"}
    assert {c.kind for c in density.traffic_cases} == {"random-walk", "patrol", "crossing"}
    assert load_study("laws").kind == "drive"
    swept = {w.called.removeprefix("ad-gso ").partition("=")[0] for w in load_study("sensitivity").planners}
    assert swept == {"nt", "mvr", "rho", "gamma"}


def test_data_are_needed_where_files_are_named(bench: Path) -> None:
    with pytest.raises(
        LampyrisError, match=r"^error\[FILE_MISSING\]: movingai\.yaml \(ready\):\d+.*data=FOLDER"
    ):
        load_study("movingai")
    study = load_study("movingai", data=bench)
    assert {w.published for w in study.worlds} == {10.0, 20.0}
    assert len({w.start for w in study.worlds}) == 100


@pytest.mark.commit(2)
@pytest.mark.parametrize("name", bundled.names())
def test_runs_of_each_come_to_rows(name: str, bench: Path) -> None:
    """One query, one seed, the smallest crowd, and the planners that are quick."""
    study = loaded(name, bench)
    slow = ("dstar-lpso", "dstar16-lpso", "ant-system", "mmas-dstar", "space-time-astar")
    few = tuple(w for w in study.planners if w.name not in slow)[:4]
    small = replace(
        study, worlds=study.worlds[:1], planners=few, laws=study.laws[:3], traffic_cases=study.traffic_cases[:1],
        seeds=study.seeds[:1],
    )  # fmt: skip
    rows: list[Row] = []
    run(small, rows.extend)
    assert len(rows) == len(small) > 0
    assert {row.ending for row in rows} == {"done"}, [row.error for row in rows]
    if name == "movingai":
        assert all(row.metrics["reference_ok"] for row in rows)


@pytest.mark.nightly
def test_gamma_decides_nothing_and_rho_something() -> None:
    """What ``sensitivity`` says of itself: luciferin is a multiple of gamma."""
    study = load_study("sensitivity")
    default, *others = (
        w
        for w in study.planners
        if w.called in ("ad-gso nt=10", *(f"ad-gso {s}" for s in ("gamma=0.3", "rho=1.0")))
    )
    small = replace(
        study, kind="plan", planners=(default, *others), traffic_cases=study.traffic_cases[:1], seeds=(0,)
    )
    rows: dict[str, Row] = {}
    run(small, lambda some: rows.update({row.key: row for row in some}))
    ways: dict[str, list[object]] = {}
    for job in small.jobs():
        ways.setdefault(str(job.labels["planner"]), []).append(rows[job.key].metrics["length_cells"])
    assert ways["ad-gso gamma=0.3"] == ways["ad-gso nt=10"]
    assert ways["ad-gso rho=1.0"] != ways["ad-gso nt=10"]


@pytest.mark.nightly
def test_every_table_says_which_swarms_start_from_the_exact_shortest_path() -> None:
    study = load_study("line-up")
    some = tuple(w for w in study.planners if w.name in ("astar", "pso", "pso-apf"))
    small = replace(
        study, worlds=study.worlds[:2], planners=some, traffic_cases=study.traffic_cases[:1], seeds=(0,)
    )
    rows: dict[str, Row] = {}
    run(small, lambda some: rows.update({row.key: row for row in some}))
    records = [
        (k, row.ending, row.error, row.metrics)
        for k, job in enumerate(small.jobs())
        for row in (rows[job.key],)
    ]
    summary = summarise(runs_of(small, records))
    assert summary.start_exact == ("pso", "pso-apf")
    made = tabs(summary)
    assert {tab.name.partition("-")[0] for tab in made} >= {"endings", "paths", "time", "work", "ranks"}
    for tab in made:
        assert tab.note.endswith(f"pso and pso-apf start {START}."), tab.name
    nobody = tabs(summarise(runs_of(replace(small, planners=some[:1]), records[:2])))
    assert not any("start" in tab.note for tab in nobody)
