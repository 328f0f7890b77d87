"""Adaptive dimensionality among known tracks: arrivals beside a search over everything, bounds, rounds, and what is said."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from test_lattice_sipp import corridor, drawn, scene_of
from timed_reference import Exhaustive

import lampyris
from lampyris.errors import LimitError
from lampyris.model.plan import Plan, Status
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.planning.lattice.pad.timed_pad_planner import PadSipp
from lampyris.planning.lattice.timed.timed_planner import LatticeSipp
from lampyris.referee import check_plan
from sizes import sized


def planned(scene: Scene, budget: Budget | None = None, **settings: Any) -> Plan:
    plan = PadSipp(**settings).open(scene, np.random.default_rng(0)).plan(None, budget)
    if plan:
        assert check_plan(plan, scene) is None
    return plan


@sized("cases", 3, 300)
def test_arrivals_are_those_of_a_search_over_everything(cases: int) -> None:
    """With weight 1 the earliest; else at most so many times as late, never before the told bound; and no path agrees."""
    rng = np.random.default_rng(8)
    found = delayed = closed = more = 0
    for _ in range(cases):
        scene = drawn(rng)
        session = LatticeSipp(weight=1.0).open(scene, rng)
        starts, goals = session.starts(session.lattice_map), session.goals(session.lattice_map)
        least = Exhaustive(scene, session).arrival(starts, goals) if starts and goals else math.inf
        whole = session.plan()
        assert bool(whole) == (least < math.inf)
        for weight in (1.0, 1.3, 3.0):
            plan = planned(scene, weight=weight)
            assert plan.status is whole.status
            if plan.pose_path is None:
                closed += plan.status is Status.HEMMED_IN
                continue
            assert plan.pose_path.times is not None
            arrival = float(plan.pose_path.times[-1, 0])
            assert least * (1 - 1e-9) <= arrival <= weight * least * (1 + 1e-8) + 1e-6
            assert plan.pose_path.lower_bound_m <= least * (1 + 1e-8) + 1e-6
            assert plan.pose_path.bound <= weight * (1 + 1e-8)
            assert plan.expansions == sum(
                one.low_expansions + one.high_expansions + one.tracking_expansions for one in plan.rounds
            )
            found, more = found + 1, more + (len(plan.rounds) > 1)
        if whole.pose_path is not None:
            alone = LatticePlanner(weight=1.0, shortcut=False).open(replace(scene, traffic=()), rng).plan()
            assert alone.pose_path is not None
            delayed += least > alone.pose_path.cost_m + 1e-6
    assert found >= cases // 2
    assert more
    assert delayed >= cases // 20
    assert closed >= cases // 20


@pytest.mark.parametrize(
    "settings",
    [{"sphere_radius": 1.0, "tunnel": 1.0}, {"sphere_growth": 1.1, "sphere_radius": 2.0}, {"tunnel": 30.0}],
)
def test_no_setting_costs_the_bound(settings: dict[str, Any]) -> None:
    scene, best = corridor()
    assert best.pose_path is not None
    for weight in (1.0, 1.4):
        plan = planned(scene, weight=weight, **settings)
        assert plan.pose_path is not None
        assert plan.pose_path.cost_m <= weight * best.pose_path.cost_m * (1 + 1e-8)
        assert plan.pose_path.lower_bound_m <= best.pose_path.cost_m * (1 + 1e-8)


def test_where_nothing_passes_it_plans_as_pad_does() -> None:
    """One round, cells first; the path of poses costs what its times say."""
    scene = scene_of(
        np.zeros((40, 60), dtype=bool), [[(5, 35), (6, 35)]], (4, 4, 0.0), (55, 6, 0.0), "omnidirectional"
    )
    plan = planned(scene, weight=1.3)
    assert [one.spheres for one in plan.rounds] == [()]
    assert plan.attributes["waits_s"] == 0.0
    whole = LatticeSipp(weight=1.3).open(scene, np.random.default_rng(0)).plan()
    assert plan.expansions <= whole.expansions


def test_spheres_are_where_the_obstacle_is_met() -> None:
    walls = np.zeros((17, 60), dtype=bool)
    walls[:, 40] = True
    walls[7:10, 40] = False
    track = [(40, 8)] * 90 + [(40 + k, 8) for k in range(1, 4)] + [(43, 8 - k) for k in range(1, 8)]
    scene = scene_of(walls, [track], (6, 8, 0.0), (55, 14, 0.0))
    plan = planned(scene, weight=1.05)
    assert plan.status is Status.FOUND
    assert plan.attributes["waits_s"] > 40.0
    spheres = plan.rounds[-1].spheres
    assert spheres
    assert any(math.dist(cell, (40, 8)) <= radius + 3 for cell, radius in spheres)
    assert not any(math.dist(cell, (6, 8)) <= radius for cell, radius in spheres)
    bounds = [one.lower_bound_m for one in plan.rounds]
    assert bounds == sorted(bounds)
    assert plan.rounds[0].lower_bound_m < 0.7 * plan.rounds[-1].lower_bound_m, "walls alone know of no wait"


def test_walls_and_obstacles_that_close_every_path_are_told_apart() -> None:
    walls = np.zeros((17, 40), dtype=bool)
    walls[:, 20] = True
    walls[7:10, 20] = False
    scene = scene_of(walls, [[(20, 8)]], (12, 8, 0.0), (36, 8, 0.0))
    shut = planned(scene)
    assert shut.status is Status.HEMMED_IN
    assert shut.rounds
    walls[:, 20] = True
    assert planned(scene_of(walls, [[(20, 8)]], (12, 8, 0.0), (36, 8, 0.0))).status is Status.NO_PATH
    at_start = scene_of(np.zeros((12, 20), dtype=bool), [[(4, 5)]], (4, 5, 0.0), (15, 5, 0.0))
    assert planned(at_start).status is Status.HEMMED_IN


def test_budgets_and_memory_stop_it(monkeypatch: pytest.MonkeyPatch) -> None:
    scene, _ = corridor()
    whole = planned(scene, weight=1.0)
    statuses = set()
    for share in (0.02, 0.5, 0.9):
        most = int(whole.expansions * share)
        plan = planned(scene, Budget(expansions=most), weight=1.0)
        assert plan.expansions <= most
        statuses.add(plan.status)
        if plan.status is Status.FOUND:
            assert "budget" in plan.detail
            assert plan.bound is not None
            assert plan.bound > 1.0
    assert Status.LIMIT in statuses
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "10")
    large = scene_of(np.zeros((300, 300), dtype=bool), [], (9, 50, 0.0), (50, 50, 0.0))
    with pytest.raises(LimitError, match="planning with pad-sipp"):
        planned(large)


def test_the_same_question_has_the_same_answer_by_name() -> None:
    scene, _ = corridor()
    first = lampyris.plan(scene, "pad-sipp", weight=1.2)
    second = lampyris.plan(scene, "pad-sipp", weight=1.2)
    assert first == second
    assert first.rounds == second.rounds
