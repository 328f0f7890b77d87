"""Every lie of a worker about poses that can be seen is refused."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np
import pytest
from lies import honest, judged, refused
from one_samples import planner, results_of
from pose_samples import CAR, CART, GOAL, PLANNERS, START, hall, posed

import lampyris
from lampyris.model.grid import Grid
from lampyris.model.plan import Status
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.planning import registry
from lampyris.study.design.study import Study
from lampyris.study.execution import drive_evidence, evidence, pose_evidence
from lampyris.study.execution.site import Place
from lampyris.study.execution.verify_poses import _disc_path, judged_by
from sizes import sized


def changed(result: Any, change: Callable[[dict[str, Any]], None], form: Any, *path: str) -> Any:
    """The result with the arrays under a path of its evidence changed."""
    made = copy.deepcopy(result)
    told = made["evidence"]
    for name in path[:-1]:
        told = told[name]
    arrays = {k: np.array(v) for k, v in evidence.unpack_arrays(told[path[-1]], form).items()}
    change(arrays)
    told[path[-1]] = evidence.pack_arrays(arrays, form)
    return made


def with_poses(result: Any, change: Callable[[dict[str, Any]], None]) -> Any:
    return changed(result, change, pose_evidence._POSES, "path", "arrays")


def with_speeds(result: Any, change: Callable[[dict[str, Any]], None]) -> Any:
    return changed(result, change, evidence._PROFILE, "profile", "arrays")


def moved(a: dict[str, Any]) -> None:
    a["poses"][5:-5, 1] += 0.6


def through_the_wall(a: dict[str, Any]) -> None:
    a["poses"][:, 1] += 2.0


def cut(a: dict[str, Any]) -> None:
    a["poses"], a["gears"] = a["poses"][:-4], a["gears"][:-4]


def begun_late(a: dict[str, Any]) -> None:
    a["poses"], a["gears"] = a["poses"][8:], a["gears"][8:]


def reversed_gears(a: dict[str, Any]) -> None:
    a["gears"] = -a["gears"]


def turned(a: dict[str, Any]) -> None:
    a["poses"][:, 2] += 0.5


def sparse(a: dict[str, Any]) -> None:
    a["poses"], a["gears"] = a["poses"][::6], np.sign(a["gears"][5::6])


def endless(a: dict[str, Any]) -> None:
    a["poses"][3, 0] = np.inf


@pytest.mark.parametrize("name", PLANNERS)
def test_lies_about_a_path_of_poses(name: str) -> None:
    study = posed(planners=(name,), robot=CAR)
    true = honest(study)
    for lie in (moved, through_the_wall, begun_late, reversed_gears, turned, sparse, endless):
        refused(study, with_poses(true, lie))
    if name == "hybrid-astar":
        refused(study, with_poses(true, cut), "goal")
    for field, factor, word in (
        ("cost_m", 0.97, "cost"),
        ("cost_m", 1.03, "cost"),
        ("lower_bound_m", 9.0, ""),
    ):
        made = copy.deepcopy(true)
        made["evidence"]["path"][field] *= factor
        refused(study, made, word)
    for change in ({"expansions": -1}, {"iterations": 0.5}, {"path": None}, {"profile": None}, {"kind": "plan"},
                   {"status": "no-path"}, {"status": "won"}):  # fmt: skip
        refused(study, {**true, "evidence": {**true["evidence"], **change}})


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", PLANNERS)
def test_speeds_that_are_not_the_law_s_are_refused(name: str) -> None:
    """Slower ones, too: they are worked out again."""
    study = posed(planners=(name,))
    true = honest(study)

    def scaled(key: str, factor: float) -> Callable[[dict[str, Any]], None]:
        def change(a: dict[str, Any]) -> None:
            a[key] = a[key] * factor

        return change

    for key, factor in (
        ("v", 1.01),
        ("v", 0.9),
        ("t", 0.5),
        ("t", 1.1),
        ("s", 0.9),
        ("xy", 1.001),
        ("a", 2.0),
    ):
        refused(study, with_speeds(true, scaled(key, factor)), f"whose {key}")
    for change in ({"law": "optimum"}, {"units": "velocity units"}):
        made = copy.deepcopy(true)
        made["evidence"]["profile"].update(change)
        refused(study, made, "law")


def test_a_bound_that_is_not_proven_is_refused() -> None:
    """Of hybrid-astar the lower bound is worked out again; a lattice keeps to its weight."""
    study = posed(planners=("hybrid-astar",))
    true = honest(study)
    scene = Scene(hall(), start_pose=START, goal_pose=GOAL, robot=lampyris.Robot(**CART))
    path, proven = true["evidence"]["path"], registry.make("hybrid-astar", {}).proven_bound(scene)  # type: ignore[attr-defined]
    assert proven == pytest.approx(path["lower_bound_m"], rel=1e-12)
    assert proven < path["cost_m"] / 1.1
    for factor in (1.0001, 1.1):
        made = copy.deepcopy(true)
        made["evidence"]["path"]["lower_bound_m"] *= factor
        refused(study, made, "proven")
    for weight in (1.0, 1.5):
        study = posed(planners=(planner("lattice", weight=weight),), robot=CAR)
        made = honest(study)
        made["evidence"]["path"]["lower_bound_m"] /= 1.7
        refused(study, made, "keeps to")


def test_prices_and_tolerances_are_those_of_the_settings() -> None:
    """A worker that planned with other settings than its job's is refused: nothing of them is in its evidence."""
    asked = posed(
        planners=(planner("lattice", reverse_cost=3.0, reverse=True),), robot=CAR, goal=START, start=GOAL
    )
    other = posed(planners=(planner("lattice", reverse_cost=1.0),), robot=CAR, goal=START, start=GOAL)
    true, lie = honest(asked), honest(other)
    assert lie["evidence"]["path"]["cost_m"] < true["evidence"]["path"]["cost_m"]
    refused(asked, {**true, "evidence": lie["evidence"]}, "cost")
    beside = (GOAL[0] - 0.3, GOAL[1], GOAL[2])
    short = honest(posed(planners=("hybrid-astar",), goal=beside))["evidence"]
    exact, near = (
        posed(planners=("hybrid-astar",)),
        posed(planners=(planner("hybrid-astar", goal_tolerance=0.5),)),
    )
    refused(exact, {**honest(exact), "evidence": short}, "goal")
    short["path"]["lower_bound_m"] = 1.0
    assert judged(near, {**honest(near), "evidence": short}).ending == "done"
    for name in PLANNERS:
        one, scene = (
            registry.make(name, {}),
            Scene(hall(), start_pose=START, goal_pose=GOAL, robot=lampyris.Robot(**CART)),
        )
        plan = lampyris.plan(scene, one)
        told = {k: v for k, v in plan.attributes.items() if k not in ("lattice_cost", "end_error")}
        if name == "hybrid-astar":
            told["end_error"] = plan.attributes["end_error"]
        assert told == dict(judged_by(one, 0.25))


def test_verdicts_that_are_wrong_are_refused() -> None:
    for name in PLANNERS:
        study = posed(planners=(name,))
        true = honest(study)
        for status in (Status.START_OCCUPIED, Status.GOAL_OCCUPIED, Status.NO_PATH, Status.FOUND):
            made = copy.deepcopy(true)
            made["evidence"].update(status=status.value, path=None, profile=None)
            if status is Status.NO_PATH and name == "hybrid-astar":
                assert judged(study, made).ending == "done"  # it may miss a path
            else:
                refused(study, made, "" if status is Status.FOUND else status.value)
        car = posed(planners=(name,), robot=CAR)
        made = {**honest(car), "evidence": {**made["evidence"], "status": "no-path"}}
        assert judged(car, made).ending == "done"  # what a car cannot do, no disc shows


@sized("cases", 6, 60)
@pytest.mark.parametrize("name", ["lattice", "pad"])
def test_a_lattice_finds_what_a_wide_disc_shows(name: str, cases: int) -> None:
    """The rule by which a ``no-path`` is refused holds on random maps."""
    rng, shown = np.random.default_rng(7), 0
    for _ in range(cases):
        blocked = np.kron(rng.random((9, 9)) < 0.15, np.ones((4, 4), dtype=bool))
        grid = Grid(blocked, resolution=0.25)
        robot = lampyris.Robot(**CART)
        free = np.argwhere(~blocked)
        (y0, x0), (y1, x1) = free[rng.integers(len(free), size=2)].tolist()
        scene = Scene(grid, (x0, y0), (x1, y1), robot=robot)
        if _disc_path(Place(scene).scene):
            shown += 1
            assert lampyris.plan(scene, name)
    assert shown


def test_evidence_of_the_other_kind_is_refused() -> None:
    cells, poses = posed(planners=("astar",)), posed()
    of_cells, of_poses = honest(cells), honest(poses)
    refused(cells, {**of_cells, "evidence": of_poses["evidence"]}, "evidence of a plan")
    refused(poses, {**of_poses, "evidence": of_cells["evidence"]}, "evidence of a pose-plan")


# ---- drives --------------------


def driven(controller: str = "exact", **more: Any) -> Study:
    settings = asdict(DriveSettings(controller=controller))
    return posed("drive", ("lattice",), drive=settings, **more)


@pytest.mark.commit(1)
@pytest.mark.parametrize("controller", ["exact", "pure-pursuit"])
def test_lies_about_a_drive_of_poses(controller: str) -> None:
    study = driven(controller)
    true = honest(study)

    def curves(change: Callable[[dict[str, Any]], None]) -> Any:
        return changed(true, change, pose_evidence._CURVES, "curves")

    def column(k: int, more: float) -> Callable[[dict[str, Any]], None]:
        def change(a: dict[str, Any]) -> None:
            a["pieces"][:, k] += more

        return change

    def elsewhere(a: dict[str, Any]) -> None:
        a["pieces"][:, :2] += 3.0
        a["ends"][:, :2] += 3.0

    def other_end(a: dict[str, Any]) -> None:
        a["ends"][:, 2] += 1.0

    for lie in (
        column(0, 0.1),
        column(4, 0.1),
        column(5, 0.2),
        column(6, 0.3),
        column(7, 0.1),
        elsewhere,
        other_end,
    ):
        refused(study, curves(lie))

    def faster(a: dict[str, Any]) -> None:
        a["v"] *= 1.2

    def shorter(a: dict[str, Any]) -> None:
        a["t"] *= 0.8

    for lie in (faster, shorter):
        refused(study, changed(true, lie, drive_evidence._FORM, "arrays"))
    bare = copy.deepcopy(true)
    del bare["evidence"]["curves"]
    refused(study, bare)
    for change in (
        {"outcome": "hit"},
        {"outcome": "start-occupied"},
        {"outcome": "timeout"},
        {"period": 0.2},
    ):
        refused(study, {**true, "evidence": {**true["evidence"], **change}})
    if controller == "exact":
        return
    none = copy.deepcopy(true)
    none["evidence"].update(paths=pose_evidence.curves_evidence(()), path_times=[])
    refused(study, none, "without a path")
    none["evidence"]["path_times"] = [0.0]
    refused(study, none, "times of")


def test_a_disc_s_drive_is_not_one_of_the_footprint() -> None:
    """Driven along the wall as a narrow robot, told as of the wide one."""
    narrow = {**CART, "footprint": ((0.5, 0.1), (-0.4, 0.1), (-0.4, -0.1), (0.5, -0.1))}
    start = (*hall().to_metres((13, 4)).tolist(), np.pi / 2)
    grid = hall()
    true = honest(driven(robot=narrow, start=start, grid=grid))
    wide = driven(start=start, grid=grid)
    (job,) = wide.jobs()
    refused(wide, {**true, "key": job.key})
    plan = honest(posed(robot=narrow, start=start))
    (job,) = posed(start=start).jobs()
    refused(posed(start=start), {**plan, "key": job.key}, "footprint")


@pytest.mark.commit(1)
@sized("cases", 30, 250)
@pytest.mark.parametrize("kind", ["plan", "drive"])
def test_damaged_evidence_never_raises(kind: str, cases: int) -> None:
    study = posed(kind, ("lattice",))
    true = honest(study)
    before = dict(judged(study, true).metrics)
    rng = np.random.default_rng(3)
    values = [None, -1, 0, 10**30, 2.5, "x", "", [], {}, [[]], True, "found", [1, 2], float("inf")]

    def swap(told: Any) -> None:
        keys = list(told) if isinstance(told, dict) else range(len(told))
        key = keys[int(rng.integers(len(keys)))]
        if isinstance(told[key], dict | list) and told[key] and rng.random() < 0.7:
            swap(told[key])
        else:
            told[key] = values[int(rng.integers(len(values)))]

    failed = 0
    for _ in range(cases):
        made = copy.deepcopy(true)
        swap(made["evidence"])
        row = judged(study, made)
        assert row.ending in ("done", "failed")
        failed += row.ending == "failed"
        if row.ending == "done":
            assert sum(row.metrics[name] == before[name] for name in before) >= len(before) - 2
    assert failed > 0.4 * cases


def test_the_worker_s_own_result_stands_on_every_drive() -> None:
    for drive in ("ackermann", "differential", "omnidirectional"):
        for name in PLANNERS:
            study = posed(planners=(name,), robot={**CAR, "drive": drive})
            (result,) = results_of(study)
            row = judged(study, result)
            assert row.ending == "done", row.error


def test_a_pose_of_a_map_with_a_turned_origin() -> None:
    """The same cells with another origin are another key, and another map to a worker."""
    grid = replace(hall(), origin=(3.0, -2.0, 0.4))
    start = (*grid.to_metres((4, 19)).tolist(), 0.4)
    goal = (*grid.to_metres((22, 6)).tolist(), 0.4)
    for name in PLANNERS:
        study = posed(planners=(name,), grid=grid, start=start, goal=goal)
        row = judged(study, results_of(study)[0])
        assert (row.ending, row.metrics.get("outcome")) == ("done", "found"), row.error


def test_verdicts_that_nothing_led_to_are_refused() -> None:
    study = posed(planners=("lattice",), robot=CAR)
    true = honest(study)
    for status, word in (("hemmed-in", "moving obstacle"), ("cancelled", "cancel"), ("limit", "budget")):
        said = {**true["evidence"], "status": status, "path": None, "profile": None}
        refused(study, {**true, "evidence": said}, word)


def test_times_of_poses_are_judged() -> None:
    study = posed(planners=("lattice-sipp",), robot=CAR)
    true = honest(study)

    def quicker(a: dict[str, Any]) -> None:
        a["times"] = a["times"] * 0.9

    def without(a: dict[str, Any]) -> None:
        del a["times"]

    refused(study, with_poses(true, quicker))
    refused(study, with_poses(true, without), "times")
