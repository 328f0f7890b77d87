"""Every lie of a worker that can be seen is refused."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lies import LIVE, REPLAYED, altered, honest, judged, refused
from one_samples import (
    ground_of,
    law,
    planner,
    results_of,
    study_of,
)  # fmt: skip

import lampyris
from lampyris.model.grid import Grid
from lampyris.model.path import path_of
from lampyris.model.scene import Scene
from lampyris.model.trace import Trace
from lampyris.study.design.study import StudyTraffic
from lampyris.study.execution import evidence
from lampyris.study.execution.site import world_of
from lampyris.study.execution.worker import run_job


def test_lies_about_what_a_result_is() -> None:
    study = study_of("simulate")
    true = honest(study)
    for wrong in (None, 7, [], {}, {**true, "key": "0" * 64}, {**true, "ending": "won"},
                  {**true, "ending": None}, {**true, "evidence": None}, {**true, "evidence": {}},
                  {**true, "timing": None}, {**true, "timing": {"cpu_s": float("nan")}},
                  {**true, "timing": {"cpu_s": -1}}, {**true, "timing": {"wall_s": True}},
                  {**true, "ending": "timeout"}):  # fmt: skip
        refused(study, wrong)
    row = judged(study, {**true, "timing": {**true["timing"], "other": "x"}})
    assert set(row.timing) <= {"cpu_s", "wall_s", "plan_s"}
    told = judged(study, {**true, "ending": "failed", "error": "a\nb" + "x" * 9999})
    assert (told.ending, told.error[:3], len(told.error)) == ("failed", "a?b", 500)
    for name in true["evidence"]:
        refused(study, {**true, "evidence": {k: v for k, v in true["evidence"].items() if k != name}})
        for wrong in (None, 3, "x", [], -1.5, {}):
            row = judged(study, {**true, "evidence": {**true["evidence"], name: wrong}})
            assert row.ending == "failed" or (name, wrong) in (
                ("path", None),
                ("last_tick", None),
                ("last_tick", 3),
                ("notes", []),
            )


def test_lies_about_a_plan() -> None:
    study = study_of("plan", ("astar",), StudyTraffic())
    true = honest(study)

    def shorter(result: Any) -> None:
        result["evidence"]["path"]["exact"] -= 1

    def steps(result: Any) -> None:
        result["evidence"]["path"]["steps"][0] += 1

    def optimal(result: Any) -> None:
        result["evidence"]["optimal"] = result["evidence"]["path"]["exact"] - 1

    def no_way(result: Any) -> None:
        result["evidence"].update(status="no-path", path=None, profile=None, optimal=None)
        result["evidence"]["arrays"] = evidence.pack_arrays({}, evidence._PLAN)

    def no_speeds(result: Any) -> None:
        result["evidence"]["profile"] = None

    def other_law(result: Any) -> None:
        result["evidence"]["profile"]["law"] = "optimum"

    def negative(result: Any) -> None:
        result["evidence"]["expansions"] = -1

    for lie, word in (
        (shorter, "cost"), (steps, "steps"), (optimal, "optimal"), (no_way, "no-path"),
        (no_speeds, "without speeds"), (other_law, "law"), (negative, "expansions"),
    ):  # fmt: skip
        made = copy.deepcopy(true)
        lie(made)
        refused(study, made, word)


def test_a_way_through_walls_is_refused() -> None:
    """The straight line from corner to corner, told with its right cost."""
    size = 12
    blocked = np.zeros((size, size), dtype=np.bool_)
    blocked[3:9, 5] = True
    study = study_of("plan", ("astar",), StudyTraffic(), grid=Grid(blocked, name="w"))
    true = honest(study)
    cells = np.stack([np.arange(size)] * 2, axis=1)
    scene = Scene(Grid(np.zeros_like(blocked)), (0, 0), (size - 1, size - 1))
    free = lampyris.plan(scene, "astar")
    assert free.path is not None
    assert np.array_equal(free.path.cells, cells)
    profile = lampyris.speed_profile(scene, free)
    made = {**true, "evidence": {**evidence.plan_evidence(replace(free, optimal_exact=None), profile)}}
    refused(study, made, "wall")
    # Round the wall, but over a corner of it.
    down = [(k, k - 3) for k in range(7, 12)] + [(11, k) for k in range(9, 12)]
    over = np.array([(0, 0), (1, 1), (2, 2), (3, 2), (4, 2), (5, 2), (6, 3), *down])
    lie = replace(free, path=path_of(over, scene.moves), optimal_exact=None)
    refused(study, {**true, "evidence": evidence.plan_evidence(lie, profile)}, "corner")


@pytest.mark.parametrize("law_", ["physical", "dissertation"])
def test_speeds_that_no_robot_could_drive_are_refused(law_: str) -> None:
    study = study_of("plan", ("astar",), StudyTraffic(), law_of=law_)
    true = honest(study)

    def faster(a: dict[str, Any]) -> None:
        a["v"][1:-1] *= 1.5

    def rushed(a: dict[str, Any]) -> None:
        a["t"] *= 0.5

    def start(a: dict[str, Any]) -> None:
        a["v"][0] = 0.5

    def short(a: dict[str, Any]) -> None:
        a["s"] *= 0.9

    for lie in (faster, rushed, start, short):
        refused(study, altered(true, "plan", lie, "profile"))


@pytest.mark.parametrize("crowd", [REPLAYED, LIVE])
@pytest.mark.parametrize("law_", ["physical", "dissertation"])
def test_lies_about_a_simulation(crowd: StudyTraffic, law_: str) -> None:
    study = study_of("simulate", ("ad-gso",), crowd, law_of=law_)
    true = honest(study)

    def teleport(a: dict[str, Any]) -> None:
        a["robot"][4] += (3, 0)
        a["robot"][5] -= (3, 0)

    def elsewhere(a: dict[str, Any]) -> None:
        a["robot"][0] = (1, 1)

    def stops_short(a: dict[str, Any]) -> None:
        for name in ("robot", "speed", "cause"):
            a[name] = a[name][:-1]

    def fast(a: dict[str, Any]) -> None:
        a["speed"][3] = 81.0

    def backwards(a: dict[str, Any]) -> None:
        a["speed"][3] = -0.1

    def endless(a: dict[str, Any]) -> None:
        a["speed"][3] = np.inf

    def no_replans(a: dict[str, Any]) -> None:
        a["events"] = np.concatenate(([(1, 0, 0, 0)], a["events"]))

    for lie in (teleport, elsewhere, stops_short, fast, backwards, endless, no_replans):
        if lie is no_replans:
            made = altered(true, "simulate", lie)
            made["evidence"]["event_words"][0] = "replan"
            refused(study, made, "replans")
        else:
            refused(study, altered(true, "simulate", lie))
    for change in (
        {"outcome": "blocked"}, {"outcome": "hit"}, {"outcome": "collision"}, {"outcome": "no-path"},
        {"outcome": "timeout"}, {"outcome": "won"}, {"obstacle_count": 5}, {"obstacle_count": 7}, {"path": None},
    ):  # fmt: skip
        refused(study, {**true, "evidence": {**true["evidence"], **change}})
    path, counts = true["evidence"]["path"], true["evidence"]["counts"]
    for change in (
        {"path": {**path, "exact": path["exact"] - 1}}, {"path": {**path, "steps": [0, 0]}},
        {"counts": [counts[0], counts[1] + 1, *counts[2:]]}, {"counts": [*counts[:3], -1, counts[4]]},
        {"counts": counts[:4]},
    ):  # fmt: skip
        refused(study, {**true, "evidence": {**true["evidence"], **change}})


def test_a_robot_that_drives_through_obstacles_is_refused() -> None:
    """In a replayed world the worker does not say where the obstacles are, so it cannot leave them out."""
    grid = Grid(np.zeros((3, 14), dtype=np.bool_), name="lane", resolution=0.5)
    seen = 0
    for seed in range(12):
        crowd = StudyTraffic("random-walk", 9)
        study = study_of("simulate", ("astar",), crowd, grid=grid, start=(0, 1), goal=(13, 1), seeds=(seed,))
        alone = study_of(
            "simulate", ("astar",), StudyTraffic(), grid=grid, start=(0, 1), goal=(13, 1), seeds=(seed,)
        )
        (true,), (lie,) = results_of(study), results_of(alone)
        made = {**true, "ending": "done", "evidence": {**lie["evidence"], "obstacle_count": 9}}
        tracks = world_of(next(study.jobs()).plain, grid).replay.upto(13)
        meets = any(tuple(c) == (t, 1) for t in range(14) for c in tracks[t].tolist())
        if meets:
            refused(study, made, "obstacle")
            seen += 1
    assert seen > 3


def test_live_obstacles_must_begin_where_this_world_has_them() -> None:
    study = study_of("simulate", ("ad-gso",), LIVE)
    true = honest(study)

    (job,) = study.jobs()
    noun = run_job(job.plain, ground_of(study).grid).noun
    assert isinstance(noun, Trace)
    visited = {tuple(c) for t in (noun.robot, *noun.tracks) for c in t.tolist()}
    away = next(
        (0, y) for y in range(15, 0, -1) if (0, y) not in visited and not noun.scene.grid.blocked[y, 0]
    )
    ticks = len(noun.robot)

    def moved(a: dict[str, Any]) -> None:
        """The first one stands for ever where nobody comes by."""
        cells = np.cumsum(a["tracks"], axis=0)
        cells[:ticks] = away
        a["tracks"] = np.diff(cells, axis=0, prepend=cells[:1] * 0)

    def late(a: dict[str, Any]) -> None:
        a["appears"][:] = 1

    def jumps(a: dict[str, Any]) -> None:
        a["tracks"][3] += (2, 0)

    def in_walls(a: dict[str, Any]) -> None:
        a["tracks"][1:6] += (0, 1)

    refused(study, altered(true, "simulate", moved), "obstacle 0 does not begin at")
    for lie in (late, jumps, in_walls):
        refused(study, altered(true, "simulate", lie))


def test_a_late_end_is_refused() -> None:
    """More ticks than the world has, told honestly otherwise."""
    study = study_of("simulate", ("astar",), LIVE, ticks=200)
    true = honest(study)
    short = replace(study, ticks=5)
    (job,) = short.jobs()
    refused(short, {**true, "key": job.key}, "last is 5")
    (cut,) = results_of(short)
    assert judged(short, cut).metrics["outcome"] == "timeout"
    (long,) = study.jobs()
    refused(study, {**cut, "key": long.key}, "timeout after 5 ticks")


def test_lies_about_a_drive() -> None:
    study = study_of("drive", ("astar",), REPLAYED, seeds=(2,))
    true = honest(study)
    assert true["evidence"]["outcome"] == "arrived"

    def faster(a: dict[str, Any]) -> None:
        a["v"] *= 1.2

    def quick(a: dict[str, Any]) -> None:
        a["t"] *= 0.9

    def push(a: dict[str, Any]) -> None:
        a["a"][0] *= 2

    def jump(a: dict[str, Any]) -> None:
        a["s"][3:] += 0.5

    def other_way(a: dict[str, Any]) -> None:
        a["pieces"][:, :2] += 0.3

    def away(a: dict[str, Any]) -> None:
        a["corners"][:, 1] += 1.0

    def small(a: dict[str, Any]) -> None:
        a["discs"][:, 0] = 0.01

    def quicker(a: dict[str, Any]) -> None:
        a["discs"][:, 1] *= 3

    def hit(a: dict[str, Any]) -> None:
        a["moments"] = np.array([(0.5, 0.0, 0.0)])
        a["moment_words"], a["moment_obstacles"] = np.zeros(1), np.zeros(1)

    for lie in (faster, quick, push, jump, other_way, away, small, quicker):
        refused(study, altered(true, "drive", lie))
    made = altered(true, "drive", hit)
    made["evidence"]["event_words"] = ["hit"]
    refused(study, made)
    for change in (
        {"outcome": "blocked"}, {"outcome": "hit"}, {"outcome": "collision"}, {"outcome": "no-path"},
        {"period": 0.2}, {"period": float("nan")}, {"counts": [-1, 0]}, {"error": "x"}, {"kinds": ["patrol"]},
    ):  # fmt: skip
        refused(study, {**true, "evidence": {**true["evidence"], **change}})


def test_lies_about_a_drive_among_obstacles_that_yield() -> None:
    """There the worker says where they went; where they begin is the world's to say."""
    study = study_of("drive", ("astar",), LIVE, seeds=(6,))
    true = honest(study)

    def begins_elsewhere(a: dict[str, Any]) -> None:
        a["corners"][0, 1] += 1.0

    def begins_late(a: dict[str, Any]) -> None:
        a["corners"][0, 0] = 0.01

    for lie in (begins_elsewhere, begins_late):
        refused(study, altered(true, "drive", lie), "obstacle 0 does not begin at")


def test_a_drive_past_its_time_limit_is_refused() -> None:
    """Told honestly otherwise: it is what the same drive came to under a limit that it kept."""
    study = study_of("drive", ("astar",), StudyTraffic())
    true = honest(study)
    (job,) = (short := study_of("drive", ("astar",), StudyTraffic(), drive={"time_limit": 5.0})).jobs()
    (cut,) = results_of(short)
    assert judged(short, cut).metrics["outcome"] == "timeout"
    refused(short, {**true, "key": job.key}, "the limit is 5.0 s")


def test_giving_up_is_refused_of_a_planner_that_misses_no_way() -> None:
    """A robot that did not set out at all, told as it would be if every way were closed."""
    walls = np.zeros((5, 5), dtype=np.bool_)
    walls[:, 2] = True
    for kind in ("simulate", "drive"):
        closed = study_of(kind, ("astar",), StudyTraffic(), grid=Grid(walls, name="w"))
        (cut,) = results_of(closed)
        assert judged(closed, cut).metrics["outcome"] == "no-path"
        free = study_of(
            kind, ("astar",), StudyTraffic(), grid=Grid(np.zeros((5, 5), dtype=np.bool_), name="f")
        )
        (job,) = free.jobs()
        refused(free, {**cut, "key": job.key}, "misses none")


def test_optimal_settings_of_others_are_not_believed() -> None:
    """A planner that may miss ways may say that there is none; one that never does may not."""
    study = study_of("plan", (planner("ad-gso"),), StudyTraffic(), law_of=law("physical"))
    true = honest(study)
    made = copy.deepcopy(true)
    made["evidence"].update(status="iteration-limit", path=None, profile=None, optimal=None)
    made["evidence"]["arrays"] = evidence.pack_arrays({}, evidence._PLAN)
    assert judged(study, made).metrics["found"] is False
