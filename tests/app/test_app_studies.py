"""Studies sent from the page: the same worlds, in a process of their own that ends with anyone who asked."""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from lampyris.app.engine.study_process import study_of_question
from lampyris.app.server.studies import MOST_WAITING, Studies
from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.maps import library
from lampyris.study.design.study_map import pack

STATE: dict[str, Any] = {
    "version": 1, "map": "guide", "start": [0, 9], "goal": [7, 0], "preset": "dissertation", "robot": {},
    "planner": {"name": "astar", "settings": {}}, "law": None, "moves": None, "seed": 3, "edits": [],
    "obstacles": [{"kind": "random-walk", "count": 2}], "simulate": {"ticks": None, "patience": None},
}  # fmt: skip
WHO: dict[str, Any] = {
    "planners": [
        {"name": "astar", "settings": {}, "label": "astar"},
        {"name": "ad-gso", "settings": {"nt": 5}, "label": "ad-gso nt=5"},
    ],
    "laws": [{"name": "physical", "settings": {}, "label": "physical"}],
    "seeds": 2,
    "queries": 1,
}


def asked(scenario: dict[str, Any] | None = None, **more: Any) -> dict[str, Any]:
    return {**WHO, **more, "scenario": {**STATE, **(scenario or {})}}


def refusal(question: dict[str, Any]) -> LampyrisError:
    with pytest.raises(LampyrisError) as found:
        study_of_question(question)
    return found.value


def test_a_study_is_of_the_scenarios_world() -> None:
    study, notes = study_of_question(asked())
    assert (len(study), notes) == (4, [])
    assert [(w.start, w.goal) for w in study.worlds] == [((0, 9), (7, 0))]
    assert [who.called for who in study.planners] == ["astar", "ad-gso nt=5"]
    assert [(c.kind, c.count) for c in study.traffic_cases] == [("random-walk", 2)]
    assert (study.moves, study.root, study.kind) == ("dissertation", 3, "simulate")
    many, _ = study_of_question(asked(queries=5, seeds=3))
    assert len(many) == 5 * 3 * 2
    assert many.worlds[0].start == (0, 9)
    assert len({w.ground.hash for w in many.worlds}) == 1


def test_nobody_named_is_the_scenarios_own() -> None:
    study, _ = study_of_question({"scenario": STATE})
    assert [(w.name, x.name) for w in study.planners for x in study.laws] == [("astar", "dissertation")]


@pytest.mark.parametrize("name", ["env-3", "hills-48"])
def test_an_uploaded_map_goes_along_with_its_terrain(name: str) -> None:
    found = library.load(name)
    ends = {"map": "up-1", "start": list(found.start or ()), "goal": list(found.goal or ())}
    study, _ = study_of_question({**asked(ends, queries=3), "ground": pack(found.grid)})
    (ground,) = study.grounds.values()
    assert (ground.grid.blocked == found.grid.blocked).all()
    assert (ground.grid.terrain is None) == (found.grid.terrain is None)


@pytest.mark.parametrize(
    ("obstacles", "crowd", "notes"),
    [
        ([], ("none", 0), 0),
        ([{"kind": "random-walk", "count": 0}], ("none", 0), 0),
        ([{"kind": "crossing", "count": 3}, {"kind": "crossing", "count": 2}], ("crossing", 5), 0),
        ([{"kind": "patrol", "waypoints": [[3, 3]]}] * 2, ("patrol", 2), 1),
        (
            [
                {"kind": "crossing", "count": 3, "radius": 0.2},
                {"kind": "random-walk", "count": 1, "rate": 0.5},
            ],
            ("mixed", 4),
            2,
        ),
    ],
)
def test_obstacles_are_a_crowd(obstacles: list[Any], crowd: tuple[str, int], notes: int) -> None:
    study, told = study_of_question(asked({"obstacles": obstacles}))
    (made,) = study.traffic_cases
    assert (made.kind, made.count) == crowd
    assert len(told) == notes


@pytest.mark.parametrize(
    ("question", "code"),
    [
        (asked(queries=0), "QUERIES"),
        (asked(queries=501), "QUERIES"),
        (asked(seeds=True), "SEEDS"),
        (asked(seeds="2"), "SEEDS"),
        (asked(planners=[{"name": "nobody"}]), "PLANNER"),
        (asked(planners=[{"name": 3}]), "TYPE"),
        (asked(planners=[{"name": "astar", "label": "x" * 99}]), "JSON_TEXT"),
        (asked({"obstacles": [{"kind": "recorded", "track": [[1, 1]]}]}), "TRAFFIC"),
        (asked({"goal": [99, 0]}), "GOAL_OUTSIDE"),
        (asked({"map": {"file": "/etc/passwd"}}), "PATH_OUTSIDE"),
        ({"scenario": 3}, "KEY"),
    ],
)
def test_studies_that_are_none(question: dict[str, Any], code: str) -> None:
    assert refusal(question).code == code


async def until_over(studies: Studies, job: str) -> dict[str, Any]:
    async with asyncio.timeout(600):
        while (now := studies.progress(job))["state"] not in ("done", "failed", "cancelled"):
            await asyncio.sleep(0.02)
    return now


def test_a_study_runs_beside_and_its_report_can_be_read(tmp_path: Path) -> None:
    async def whole() -> Any:
        studies = Studies(tmp_path)
        job = await studies.start(asked())
        bad = await studies.start(asked({"planner": {"name": "nobody", "settings": {}}}))
        with pytest.raises(FileError, match="JOB"):
            studies.report(job)
        waiting = studies.progress(bad)["state"]
        told = await until_over(studies, job)
        report = studies.report(job)
        failed = await until_over(studies, bad)
        await studies.close()
        return told, report, waiting, failed

    told, report, waiting, failed = asyncio.run(whole())
    assert (told["state"], told["done"], told["total"], told["report"]) == ("done", 4, 4, True)
    assert b"ad-gso nt=5" in report
    assert b"<script" not in report
    assert str(tmp_path).encode() not in report
    assert waiting == "waiting"
    assert (failed["state"], failed["error"]["code"]) == ("failed", "PLANNER")


@pytest.mark.nightly
def test_studies_are_cancelled_while_they_wait_and_while_they_run(tmp_path: Path) -> None:
    async def whole() -> Any:
        studies = Studies(tmp_path)
        jobs = [await studies.start(asked(seeds=1000, queries=3)) for _ in range(MOST_WAITING + 1)]
        with pytest.raises(LimitError, match="BUSY"):
            await studies.start(asked())
        await studies.cancel(jobs[1])
        while studies.progress(jobs[0])["state"] == "waiting":
            await asyncio.sleep(0.02)
        process = studies._jobs[jobs[0]].process
        await studies.cancel(jobs[0])
        assert process is not None
        ended = await process.wait()
        states = [studies.progress(job)["state"] for job in jobs[:2]]
        with pytest.raises(FileError, match="JOB"):
            await studies.cancel("nobody")
        await studies.close()
        return states, ended, [studies.progress(job)["state"] for job in jobs]

    states, ended, after = asyncio.run(whole())
    assert states == ["cancelled", "cancelled"]
    assert ended != 0
    assert set(after) == {"cancelled"}


@pytest.mark.nightly
def test_a_study_ends_when_nobody_waits_for_it(tmp_path: Path) -> None:
    line = json.dumps(asked(seeds=1000, queries=3)).encode() + b"\n"
    words = (sys.executable, "-m", "lampyris.app.engine.study_process", str(tmp_path))
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        process.stdin.write(line)
        process.stdin.flush()
        assert json.loads(process.stdout.readline())["state"] == "running"
        process.stdin.close()
        assert process.wait(timeout=120) == 0


@pytest.mark.parametrize("planner", ["astar", "lattice"])
def test_a_study_has_the_robots_footprint(planner: str) -> None:
    """Planners of poses drive in continuous time, between poses."""
    car = {"footprint": [[0.4, 0.15], [-0.2, 0.15], [-0.2, -0.15], [0.4, -0.15]], "turn_radius": 1.0}
    poses = {"start": {"cell": [0, 9], "yaw": 0.0}, "goal": [7, 0]} if planner == "lattice" else {}
    box = {"kind": "random-walk", "count": 2, "rectangle": [0.8, 0.4]}
    study, notes = study_of_question(
        asked({"robot": car, "obstacles": [box], **poses}, planners=[planner], queries=2)
    )
    assert notes == []
    assert study.robot["footprint"] == tuple(map(tuple, car["footprint"]))  # type: ignore[arg-type]
    assert study.traffic_cases[0].footprint == ((-0.4, -0.2), (0.4, -0.2), (0.4, 0.2), (-0.4, 0.2))
    if planner == "astar":
        assert (study.kind, study.worlds[0].start_pose) == ("simulate", None)
    else:
        assert study.kind == "drive"
        assert study.worlds[0].start_pose == (0.5, 0.5, 0.0)
        assert None not in (study.worlds[1].start_pose, study.worlds[1].goal_pose)
