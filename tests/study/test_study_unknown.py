"""Studies of robots that learn their map and of goals that move: what is compared, and which claims are refused."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.errors import LampyrisError
from lampyris.io.scenario.save import yaml_of
from lampyris.study.analysis.runs import runs_of
from lampyris.study.analysis.summary import summarise
from lampyris.study.analysis.summary_tables import tabs
from lampyris.study.analysis.table import table_of
from lampyris.study.design.serialize import study_of, study_plain
from lampyris.study.design.study import Study, canonical
from lampyris.study.design.study_file import load_study
from lampyris.study.execution.evidence import _TRACE as form
from lampyris.study.execution.evidence import pack_arrays, unpack_arrays
from lampyris.study.execution.verify import ResultVerifier
from lampyris.study.execution.worker import work

ROWS = ["........", ".######.", ".#......", ".#.####.", "........"]
QUERY = {"start": [0, 0], "goal": [3, 2]}
FILE = {
    "version": 1,
    "maps": [{"rows": ROWS, "queries": [QUERY]}],
    "planners": ["dstar-lite", "ad-gso"],
    "sensors": ["none", {"sensor_range": 2}, {"sensor_range": 2, "field_of_view": 120, "unseen_cost": 2}],
}


def load(tmp_path: Path, **more: Any) -> Study:
    path = tmp_path / "s.yaml"
    path.write_text(yaml_of({**FILE, **more}))
    return load_study(str(path))


def results(study: Study) -> list[dict[str, Any]]:
    """What a worker says of each job."""
    from lampyris.study.design.study_map import pack

    jobs = [dict(job.plain) for job in study.jobs()]
    grounds = {hash_: pack(ground.grid) for hash_, ground in study.grounds.items()}
    found: list[dict[str, Any]] = json.loads(
        work(canonical({"grounds": grounds, "jobs": jobs, "memory": False}))
    )["results"]
    return found


def test_every_planner_drives_with_every_sensor_and_ratios_are_to_the_known_map(tmp_path: Path) -> None:
    study = load(tmp_path)
    assert study.kind == "simulate"
    assert [p.called for p in study.planners][:3] == [
        "dstar-lite", "dstar-lite (sensor 2 m)", "dstar-lite (sensor 2 m, 120 deg, unseen 2)",
    ]  # fmt: skip
    jobs = list(study.jobs())
    assert "sensor" not in jobs[0].plain  # keys of jobs without a sensor are as they were
    assert [job.labels["unseen_cost"] for job in jobs[:3]] == [None, 1.0, 2.0]
    verifier, ground = ResultVerifier(), study.worlds[0].ground
    rows = [verifier.row(job, said, ground) for job, said in zip(jobs, results(study), strict=True)]
    assert {(row.ending, row.error) for row in rows} == {("done", "")}
    table = table_of(study, rows)
    costs, ratios = table["cost"], table["path_ratio"]
    assert ratios[0] is ratios[3] is None
    assert ratios[1] == costs[1] / costs[0]
    assert ratios[1] > 1.0
    assert table["expansions_ratio"][5] == table["expansions"][5] / table["expansions"][3]
    assert max(table["replans"]) > 0
    texts = [str(tab.header) for tab in tabs(summarise(runs_of(study, table.records())))]
    assert any("path / map known" in text for text in texts)
    assert any("expansions / map known" in text for text in texts)
    scene = lampyris.Scene(ground.grid, (0, 0), (3, 2))
    alone = lampyris.simulate(scene, "dstar-lite", sensor=lampyris.Sensor(2.0), seed=jobs[1].plain["seed"])
    assert costs[1] == alone.cost


def test_a_study_with_sensors_survives_its_plain_form(tmp_path: Path) -> None:
    query = {**QUERY, "goal_track": [[3, 2], [3, 2], [4, 2]]}
    study = load(tmp_path, maps=[{"rows": ROWS, "queries": [QUERY, query]}])
    assert len({world.query for world in study.worlds}) == 2
    plain = json.loads(canonical(study_plain(study)))
    again = study_of(plain, {hash_: ground.grid for hash_, ground in study.grounds.items()})
    assert [job.key for job in again.jobs()] == [job.key for job in study.jobs()]


def test_a_goal_that_moves_has_no_optimum(tmp_path: Path) -> None:
    query = {**QUERY, "goal_track": [[3, 2], [3, 2], [4, 2], [5, 2]]}
    study = load(tmp_path, maps=[{"rows": ROWS, "queries": [query]}], planners=["sipp"], sensors=["none"])
    job = next(study.jobs())
    row = ResultVerifier().row(job, results(study)[0], study.worlds[0].ground)
    assert (row.ending, row.metrics["arrived"]) == ("done", True)
    assert row.metrics["optimal"] is row.metrics["gap"] is None


def test_claims_of_what_was_seen_are_judged(tmp_path: Path) -> None:
    study = replace(load(tmp_path), planners=load(tmp_path).planners[1:2])
    job, said = next(study.jobs()), results(study)[0]
    arrays = unpack_arrays(said["evidence"]["arrays"], form)
    ground = study.worlds[0].ground

    def error(**changed: Any) -> str:
        wrong = {k: v for k, v in {**arrays, **changed}.items() if v is not None}
        claim = {**said, "evidence": {**said["evidence"], "arrays": pack_arrays(wrong, form)}}
        return ResultVerifier().row(job, claim, ground).error

    assert error() == ""
    assert "sight" in error(seen=np.zeros_like(arrays["seen"]))
    assert "unseen" in error(seen=np.full_like(arrays["seen"], -1))
    assert "missing" in error(seen=None)


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"kind": "plan"}, "/sensors: `sensors` with kind plan"),
        ({"kind": "drive"}, "/sensors: `sensors` with kind drive"),
        ({"sensors": [{"field_of_view": 90}]}, "/sensors/0: field_of_view 90 without a range"),
        ({"sensors": [{"sensor_range": -1}]}, "/sensors/0/sensor_range: -1"),
        ({"sensors": ["none", "none"]}, "/sensors/1: the same sensor a second time"),
        ({"inflation": {"inflation_radius": 2}}, "/sensors: sensors with inflation"),
        (
            {"maps": [{"rows": ROWS, "queries": [{**QUERY, "goal_track": [[4, 2]]}]}]},
            "/queries/0/goal_track: the track begins at (4, 2)",
        ),
    ],
)
def test_what_cannot_be_is_refused_at_its_place(tmp_path: Path, more: dict[str, Any], message: str) -> None:
    with pytest.raises(LampyrisError) as caught:
        load(tmp_path, **more)
    assert message in "\n".join([str(caught.value), *getattr(caught.value, "__notes__", ())])
