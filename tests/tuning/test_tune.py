"""``lampyris tune``: ranges from declarations, failures that count, the same bytes again, resumed from its store."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from in_process import call
from lampyris.errors import LampyrisError
from lampyris.study.analysis.measures import ALL
from lampyris.study.design.config import law_config, planner_config
from lampyris.study.design.study_file import load_study
from lampyris.tuning.objective import measure_of, penalised
from lampyris.tuning.ranges import SearchRange, ranges_of
from lampyris.tuning.subject import Subject
from lampyris.tuning.tune import MAX_TRIALS, tune

STUDY = """
version: 1
name: s
kind: plan
maps:
  - {bundled: env-1, queries: {random: 10, least: 20}}
planners:
  - {name: ad-gso, label: glow}
  - {name: pso}
  - {name: astar}
"""


def of_planner(name: str) -> Subject:
    return Subject("planner", planner_config(name, {}, ""))


def of_law(name: str, **settings: Any) -> Subject:
    return Subject("law", law_config(name, settings, ""), planner_config("astar", {}, ""))


def test_ranges_come_from_declarations() -> None:
    by_name = {one.name: one for one in ranges_of(of_planner("pso"))}
    assert by_name["swarm"] == SearchRange("swarm", "whole", 3, 300)
    assert by_name["swarm"].log
    assert by_name["inertia"] == SearchRange("inertia", "number", 0.07298, 1.0)  # declared: 0 to 1
    assert by_name["slack"] == SearchRange("slack", "number", 0.0, 10.0)  # 0 by default
    assert by_name["repair"].plain == [False, True]
    assert "seeded" not in by_name
    words = {one.name: one for one in ranges_of(of_planner("ad-gso"))}
    assert set(words["choice"].words) >= {"greedy", "exact"}


def test_ranges_of_laws_come_from_declarations() -> None:
    """Those of rules that are on by dotted names; flags, which switch a cap off, only if they are named."""
    by_name = {one.name: one for one in ranges_of(of_law("rpp"))}
    assert by_name["scaling_gain"] == SearchRange("scaling_gain", "number", 0.1, 1.0)  # declared: up to 1
    assert len(by_name) == 10
    known = {one.name: one for one in ranges_of(of_law("physical"))}
    assert set(known) == {"creep", "moving.reaction", "moving.max_age", "moving.margin"}
    assert "blind.hidden_speed" in {one.name for one in ranges_of(of_law("blind"))}
    assert ranges_of(of_law("physical"), ["clearance"])[0].plain == [False, True]
    off = of_law("physical")
    assert off.config.settings["blind"] is None
    on = off.changed({"blind.hidden_speed": 0.5})
    assert (on.settings["blind.hidden_speed"], on.settings["blind.hidden_radius"]) == (0.5, 0.2)
    with pytest.raises(LampyrisError) as refused:
        ranges_of(of_law("optimum"))
    assert (refused.value.code, refused.value.where) == ("RANGE", "law")


@pytest.mark.parametrize(
    ("words", "code"),
    [
        (["inertia=0.2:1.5"], "RANGE"),
        (["inertia=0.5:0.2"], "RANGE"),
        (["inertia=x:1"], "RANGE"),
        (["swarm=2.5:7"], "RANGE"),
        (["repair=true"], "RANGE"),
        (["inertja"], "RANGE"),
        (["own", "own=1:2"], "RANGE"),
    ],
)
def test_wrong_ranges_are_refused(words: list[str], code: str) -> None:
    with pytest.raises(LampyrisError) as refused:
        ranges_of(of_planner("pso"), words)
    assert refused.value.code == code


def test_a_query_that_fails_counts_ten_times_the_defaults() -> None:
    nan = float("nan")
    defaults, values = np.array([5.0, 4.0, nan, nan]), np.array([6.0, nan, 3.0, nan])
    assert penalised(values, defaults, ALL["cost"]).tolist() == [6.0, 40.0, 3.0, 50.0]
    assert penalised(values, defaults, ALL["near_m"]).tolist() == [6.0, 0.0, 3.0, 0.0]


def test_metrics_that_cannot_change_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(STUDY)
    study = load_study(file)
    glow, pso, astar = (Subject("planner", one) for one in study.planners)
    assert measure_of("cost", study, glow).better == "less"
    for planner, metric, code in (
        (pso, "cost", "TUNE"),
        (astar, "gap", "TUNE"),
        (glow, "cpu_s", "METRIC"),
        (glow, "coast", "METRIC"),
    ):
        with pytest.raises(LampyrisError) as refused:
            measure_of(metric, study, planner)
        assert refused.value.code == code


def test_a_law_cannot_change_the_cost_of_a_plan(tmp_path: Path) -> None:
    file = tmp_path / "s.yaml"
    file.write_text(STUDY)
    study = load_study(file)
    law = Subject("law", study.laws[0], study.planners[0])
    assert measure_of("time_s", study, law).better == "less"
    with pytest.raises(LampyrisError) as refused:
        measure_of("cost", study, law)
    assert refused.value.code == "TUNE"
    with pytest.raises(LampyrisError) as unknown:
        tune(study, tmp_path / "x.study.db", planner="astar", law="rpp")
    assert (unknown.value.code, unknown.value.where) == ("LAW", "law")


def test_without_optuna_one_sentence_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "optuna", None)
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(STUDY)
    done = call("tune", "s.yaml", "--planner", "glow")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.strip() == "error[TUNE_MISSING]: optuna is not installed; pip install 'lampyris[tune]'"
    assert not list(tmp_path.glob("*.db"))


def test_numbers_out_of_range_are_refused(tmp_path: Path) -> None:
    """Without Optuna, or with it: what is wrong with the call comes first, and the number of trials last."""
    file = tmp_path / "s.yaml"
    file.write_text(STUDY)
    study = load_study(file)

    def refused(**more: Any) -> str:
        with pytest.raises(LampyrisError) as found:
            tune(study, tmp_path / "x.study.db", **{"planner": "no-such", **more})
        return found.value.code

    assert [refused(trials=n) for n in (0, 1, MAX_TRIALS - 1, MAX_TRIALS, MAX_TRIALS + 1)] == [
        "TRIALS", "PLANNER", "PLANNER", "PLANNER", "TRIALS"
    ]  # fmt: skip
    assert [refused(held_out_share=x) for x in (0.0, 0.5, 1.0, float("nan"))] == [
        "HELD_OUT",
        "PLANNER",
        "HELD_OUT",
        "HELD_OUT",
    ]
    assert (refused(seed=-1), refused(workers=0), refused()) == ("SEED", "WORKERS", "PLANNER")


@pytest.mark.nightly
def test_the_same_call_gives_the_same_bytes_and_resumes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("optuna")
    monkeypatch.chdir(tmp_path)
    Path("s.yaml").write_text(STUDY)
    words = (
        "tune",
        "s.yaml",
        "--planner",
        "glow",
        "--metric",
        "expansions",
        "--range",
        "nt=2:40",
        "--range",
        "mvr",
        "--json",
    )

    def tuned(trials: int, store: str) -> dict[str, Any]:
        done = call(*words, "--trials", str(trials), "--store", store, "--force")
        assert done.returncode == 0, done.stderr
        return dict(json.loads(done.stdout))

    whole = tuned(14, "a.study.db")
    file = Path("s-tuned.yaml").read_bytes()
    tuned(6, "b.study.db")  # as if it had been interrupted
    assert {**tuned(14, "b.study.db"), "store": ""} == {**whole, "store": ""}
    assert Path("s-tuned.yaml").read_bytes() == file
    assert any(one["pruned"] and one["queries"] < 7 for one in whole["trials"])
    best = whole["trials"][whole["best"]]
    assert not best["pruned"]
    assert best["value"] == min(one["value"] for one in whole["trials"] if not one["pruned"])
    assert whole["held_out"]["queries"] == 3
    # The file runs as a study: the same rows as those of the trial, held-out queries included.
    table = lampyris.run_study("s-tuned.yaml")
    from lampyris.study.store.store import Store

    with Store.open("a.study.db", writable=False) as kept:
        rows = kept.rows()
    assert len(table) == 10
    for key, work in zip(table["key"], table["expansions"], strict=True):
        assert rows[key].metrics["expansions"] == work
    assert dict(load_study("s-tuned.yaml").planners[0].settings) == whole["settings"]


DRIVES = """
version: 1
name: d
kind: drive
maps:
  - {bundled: env-1, queries: {random: 6, least: 15}}
planners: [astar]
laws: [rpp, physical]
traffic:
  - {kind: random-walk, count: 4}
"""


@pytest.mark.nightly
def test_a_law_is_tuned_on_drives_and_its_file_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("optuna")
    monkeypatch.chdir(tmp_path)
    Path("d.yaml").write_text(DRIVES)
    words = ("tune", "d.yaml", "--law", "rpp", "--range", "desired=0.2:1", "--range", "lookahead", "--json")

    def tuned(store: str) -> dict[str, Any]:
        done = call(*words, "--trials", "6", "--store", store, "--force")
        assert done.returncode == 0, done.stderr
        return dict(json.loads(done.stdout))

    first = tuned("a.study.db")
    file = Path("d-tuned.yaml").read_bytes()
    assert {**tuned("b.study.db"), "store": ""} == {**first, "store": ""}
    assert Path("d-tuned.yaml").read_bytes() == file
    assert (first["law"], first["planner"], first["metric"]) == ("rpp", "astar", "time_s")
    assert set(first["held_out"]["collisions"]) == {"default", "tuned"}
    values = [one["value"] for one in first["trials"] if not one["pruned"]]
    assert first["trials"][first["best"]]["value"] == min(values) < first["trials"][0]["value"]
    again = load_study("d-tuned.yaml")
    assert [dict(one.settings) for one in again.laws] == [first["settings"]]
    assert [one.name for one in again.planners] == ["astar"]
    # Its rows are those of the best trial.
    table = lampyris.run_study("d-tuned.yaml")
    from lampyris.study.store.store import Store

    with Store.open("a.study.db", writable=False) as kept:
        rows = kept.rows()
    for key, when in zip(table["key"], table["time_s"], strict=True):
        assert rows[key].metrics["time_s"] == when
