"""One run: every kind, every ending; the result is that of the simulator, whatever was kept before."""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np
import pytest
from one_samples import batch_of, grid_of, ground_of, law, planner, results_of, rows_of, study_of

import lampyris
from lampyris.errors import InputError, InternalFault, SettingError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.planning import registry
from lampyris.planning.base import Budget, Traits
from lampyris.sim.grid import loop
from lampyris.sim.traffic.mobility import drawn_traffic
from lampyris.study.design.study import Config, Study, StudyTraffic, canonical
from lampyris.study.execution import site
from lampyris.study.execution import worker as one
from lampyris.study.execution.worker import run_job, work

LIVE = StudyTraffic("random-walk", 6, tracks="live")


def result_of(study: Any) -> dict[str, Any]:
    (result,) = results_of(study)
    return result


def test_a_result_is_told_under_the_key_of_its_job() -> None:
    study = study_of("simulate", ("astar", "ad-gso"), seeds=(0, 1))
    told = results_of(study)
    assert [r["key"] for r in told] == [job.key for job in study.jobs()]
    assert [r["ending"] for r in told] == ["done"] * 4
    assert all(set(r) == {"key", "ending", "error", "evidence", "timing"} for r in told)
    assert all(r["error"] == "" and r["timing"]["cpu_s"] >= 0 for r in told)


@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
def test_what_is_kept_changes_nothing(kind: str) -> None:
    """The same bytes from a worker that has run nothing, that has run it before, and in another order."""
    crowd_ = LIVE if kind == "drive" else StudyTraffic("random-walk", 6)
    _same_whatever_was_kept(study_of(kind, ("astar", "ad-gso"), crowd_, seeds=(0, 1)))


def test_what_planners_of_other_settings_left_changes_nothing() -> None:
    who = (planner("ad-gso"), planner("ad-gso", nt=3), planner("ad-gso", choice="exact"))
    _same_whatever_was_kept(study_of("simulate", who, LIVE, law_of="dissertation", seeds=(0, 1)))


def _same_whatever_was_kept(study: Study) -> None:
    jobs = list(study.jobs())

    def evidence(some: list[Any]) -> dict[str, bytes]:
        told = json.loads(work(batch_of(study, some)))["results"]
        return {r["key"]: canonical([r["ending"], r["error"], r["evidence"]]) for r in told}

    site.forget()
    fresh = evidence(jobs)
    assert evidence(jobs) == fresh
    site.forget()
    assert evidence(jobs[::-1]) == fresh
    for job in jobs:
        site.forget()
        assert evidence([job]) == {job.key: fresh[job.key]}


@pytest.mark.commit(3)
@pytest.mark.parametrize("who", ["ad-gso", "astar", "sipp", "dstar-lite"])
@pytest.mark.parametrize("law_", ["physical", "dissertation"])
def test_a_simulation_is_that_of_the_loop(who: str, law_: str) -> None:
    study = study_of("simulate", (who,), StudyTraffic("mixed", 6, tracks="live"), law_of=law_, seeds=(3,))
    (job,) = study.jobs()
    grid = ground_of(study).grid
    made = run_job(job.plain, grid).noun
    assert isinstance(made, Trace)
    seed = job.plain["seed"]
    scene = Scene(grid, (0, 0), made.scene.goal, traffic=())
    scene = replace(scene, traffic=drawn_traffic("mixed", 6, grid, seed, fit=scene))
    ticks = site.world_of(job.plain, grid).last_tick(None)
    told = loop.run(scene, registry.make(who), seed=seed, law=law_, ticks=ticks)
    assert np.array_equal(made.robot, told.robot)
    assert made.outcome == told.outcome
    assert (made.expansions, made.replans, made.path_switches) == (
        told.expansions,
        told.replans,
        told.path_switches,
    )
    assert all(map(np.array_equal, made.tracks, told.tracks))


@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
def test_the_expansions_of_every_call_are_bounded(kind: str) -> None:
    free = result_of(study_of(kind, ("astar",), StudyTraffic()))
    bound = result_of(study_of(kind, ("astar",), StudyTraffic(), expansions=5, patience=2))
    assert free["ending"] == bound["ending"] == "done"
    assert free["evidence"] != bound["evidence"]
    (row,) = rows_of(study_of(kind, ("astar",), StudyTraffic(), expansions=5, patience=2))
    assert row.ending == "done"
    assert not row.metrics["arrived"]
    assert row.metrics["outcome"] == {"plan": "limit", "simulate": "blocked", "drive": "timeout"}[kind]


def test_a_run_under_a_budget_is_that_of_the_loop() -> None:
    """Under every budget, too small, just enough, and too large to matter."""
    for budget in (40, 400, 1000, 3000, 10**6):
        study = study_of(
            "simulate", ("ad-gso",), LIVE, law_of="dissertation", expansions=budget, seeds=(0, 1), ticks=80
        )
        for job in study.jobs():
            grid = ground_of(study).grid
            made = run_job(job.plain, grid).noun
            assert isinstance(made, Trace)
            scene = site.world_of(job.plain, grid).scene
            told = loop.run(
                scene, registry.make("ad-gso"), seed=job.plain["seed"], law="dissertation", ticks=80,
                budget=Budget(budget),
            )  # fmt: skip
            assert np.array_equal(made.robot, told.robot), budget
            assert (made.outcome, made.expansions) == (told.outcome, told.expansions)


# ---- endings that are no result --------------------


def test_a_wrong_question_is_refused() -> None:
    for study, code in (
        (study_of("simulate", crowd=StudyTraffic("random-walk", 400)), "OBSTACLE_ROOM"),
        (study_of("simulate", crowd=StudyTraffic("random-walk", 3, rate=0.5)), "TRAFFIC_RATE"),
        (study_of("simulate", (planner("ad-gso", nt=0),)), "NT"),
        (study_of("simulate", (planner("ad-gso", no_such=1),)), "SETTING"),
        (study_of("plan", law_of=law("physical", creep=7)), "LAW_SETTING"),
        (study_of("simulate", crowd=StudyTraffic("swarm", 3)), "MOBILITY"),
        (study_of("drive", drive={"period": -1.0}), "DRIVE_SETTING"),
        (study_of("simulate", moves="hops"), "MOVES"),
    ):
        result = result_of(study)
        assert result["ending"] == "refused"
        assert result["evidence"] is None
        assert result["error"].startswith(f"{code}: "), result["error"]
        assert "\n" not in result["error"]
        (row,) = rows_of(study)
        assert (row.ending, row.metrics, row.error) == ("refused", {}, result["error"])


def test_a_blocked_end_is_an_answer_whatever_the_crowd() -> None:
    blocked = grid_of().blocked.copy()
    blocked[0, 0] = True
    for kind in ("plan", "simulate", "drive"):
        (row,) = rows_of(
            study_of(kind, crowd=StudyTraffic("random-walk", 5000), grid=Grid(blocked, name="b"))
        )
        assert (row.ending, row.metrics["outcome"], row.metrics["found"]) == ("done", "start-occupied", False)
        assert row.metrics["optimal"] is None


class _Odd:
    """A guest that misbehaves as it is told."""

    name: ClassVar[str] = "odd"
    traits: ClassVar[Traits] = Traits(optimal=False)
    summary = source = "."
    how: ClassVar[BaseException | Status] = Status.NO_PATH

    def open(self, scene: Scene, rng: np.random.Generator, *, record: bool = False) -> _Odd:
        return self

    def plan(self, change: Change | None = None, budget: Budget | None = None) -> Plan:
        if isinstance(self.how, BaseException):
            raise self.how
        return Plan(self.how, "odd")


@pytest.fixture
def odd(monkeypatch: pytest.MonkeyPatch) -> type[_Odd]:
    made = registry.make
    monkeypatch.setattr(registry, "make", lambda name, s=None: _Odd() if name == "odd" else made(name, s))
    return _Odd


@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
@pytest.mark.parametrize(
    ("raised", "ending", "error"),
    [
        (ValueError("two\nlines \x1b[1m"), "failed", "FAULT: ValueError: two lines ?[1m"),
        (MemoryError(), "failed", "MEMORY: MemoryError: "),
        (RecursionError("deep"), "failed", "FAULT: RecursionError: deep"),
        (SystemExit(3), "failed", "FAULT: SystemExit: 3"),
        (InternalFault("OOPS", "ours"), "failed", "OOPS: ours"),
        (SettingError("NO", "thanks", where="there"), "refused", "NO: there: thanks"),
        (ZeroDivisionError("x" * 5000), "failed", "FAULT: ZeroDivisionError: xxx"),
    ],
)
def test_whatever_a_planner_raises_is_told_in_a_line(
    odd: Any, monkeypatch: pytest.MonkeyPatch, kind: str, raised: BaseException, ending: str, error: str
) -> None:
    monkeypatch.setattr(odd, "how", raised)
    study = study_of(kind, (Config("odd"),), StudyTraffic())
    result = result_of(study)
    assert result["ending"] == ending
    assert result["error"].startswith(error)
    assert len(result["error"]) <= one.MAX_WORDS
    assert result["error"].isprintable()
    assert set(result["timing"]) >= {"cpu_s", "wall_s"}


def test_ctrl_c_is_nobodys_result(odd: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(odd, "how", KeyboardInterrupt())
    with pytest.raises(KeyboardInterrupt):
        result_of(study_of("plan", (Config("odd"),), StudyTraffic()))


@pytest.mark.parametrize("kind", ["plan", "simulate", "drive"])
def test_seconds_that_are_used_up_are_a_timeout(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock is the test's own: each look is a second later."""
    now = [0.0]

    def later() -> float:
        now[0] += 1.0
        return now[0]

    monkeypatch.setattr(one.time, "thread_time", later)
    result = result_of(study_of(kind, seconds=0.5))
    assert (result["ending"], result["error"]) == ("timeout", "SECONDS: more than 0.5 s of CPU")
    assert result["evidence"] is None
    assert result_of(study_of(kind, seconds=1e6))["ending"] == "done"


# ---- batches --------------------


@pytest.mark.parametrize(
    "batch",
    [b"", b"\xff", b"[]", b"null", b"{}", b'{"grounds": {}, "jobs": 1, "memory": false}', b"[" * 10_000,
     b'{"grounds": [], "jobs": [], "memory": false}', b'{"grounds": {}, "jobs": [], "memory": 0}'],
)  # fmt: skip
def test_a_batch_that_is_none_is_refused(batch: bytes) -> None:
    with pytest.raises(InputError) as refused:
        work(batch)
    assert refused.value.code == "BATCH"


def test_damaged_jobs_are_results_too() -> None:
    """Every field left out, and every field of another type: a result in its place, never an error."""
    study = study_of("simulate")
    (job,) = study.jobs()
    jobs: list[Any] = [1, None, {}, [], job.plain]
    for name in job.plain:
        jobs += [{k: v for k, v in job.plain.items() if k != name}]
        jobs += [{**job.plain, name: wrong} for wrong in (None, 7, "x", [1], {"a": 1}, -1.5)]
    told = json.loads(work(canonical({**json.loads(batch_of(study, [])), "jobs": jobs})))["results"]
    assert len(told) == len(jobs)
    assert told[4]["ending"] == "done"
    assert told[4]["key"] == job.key
    for plain, result in zip(jobs, told, strict=True):
        if isinstance(plain, dict):
            assert result["key"] == hashlib.sha256(canonical(plain)).hexdigest()
        assert result["ending"] in ("done", "refused", "failed")
        if result["ending"] != "done":
            assert result["error"]
            assert result["error"].isprintable()


def test_a_map_with_other_cells_than_its_name_is_refused() -> None:
    study = study_of("plan")
    one._grids.clear()
    said = json.loads(batch_of(study))
    other = json.loads(batch_of(study_of("plan", grid=grid_of(1))))
    (name,), (packed,) = said["grounds"], other["grounds"].values()
    said["grounds"] = {name: packed}
    (result,) = json.loads(work(canonical(said)))["results"]
    assert result["ending"] == "refused"
    assert "PACKED_HASH" in result["error"]
    said["grounds"] = {}
    (result,) = json.loads(work(canonical(said)))["results"]
    assert result["ending"] == "refused"
    assert result["error"].startswith("BATCH")


@pytest.mark.nightly
def test_memory_is_measured_if_it_is_asked_for() -> None:
    assert "memory_b" not in result_of(study_of("plan"))["timing"]
    small = result_of(study_of("plan", memory=True))["timing"]["memory_b"]
    large = result_of(study_of("plan", memory=True, grid=grid_of(0, 100)))["timing"]["memory_b"]
    assert 10_000 < small < large


# ---- budgets through the front door --------------------


def test_the_front_door_takes_a_budget() -> None:
    scene = Scene(grid_of(), (0, 0), (18, 15))
    few = Budget(5)
    assert lampyris.simulate(scene, "astar", patience=2, budget=few).outcome.value == "blocked"
    assert lampyris.simulate(scene, "astar", budget=Budget(10**6)).arrived
    assert not lampyris.drive(scene, "astar", budget=few, give_up=1.0, patience=0.5).arrived
    assert lampyris.drive(scene, "astar", budget=Budget(10**6)).arrived
    for run in (lampyris.simulate, lampyris.drive, lampyris.plan):
        with pytest.raises(SettingError):
            run(scene, "astar", budget=5)  # type: ignore[operator]


def test_a_clock_that_goes_back_costs_no_result(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its seconds were then below zero, which the referee refuses, and the run counted as failed."""
    clock = itertools.count(1000.0, -7.0)
    monkeypatch.setattr(one.time, "perf_counter", clock.__next__)
    assert result_of(study_of("plan"))["timing"]["wall_s"] == 0.0
