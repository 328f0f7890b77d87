"""EECBS: within its factor of the bound, and the bound of the optimum."""

from __future__ import annotations

import numpy as np
import pytest
from fleet_checks import conflicts, joint_optimum, random_map

import lampyris
from lampyris.errors import SettingError
from lampyris.fleets import random_fleet
from lampyris.referee import check_fleet_plan
from sizes import some

Status = lampyris.Status


@pytest.mark.parametrize("weight", [1.0, 1.1, 1.5, 3.0])
@pytest.mark.parametrize("seed", some(range(300), 4))
def test_within_the_factor(seed: int, weight: float) -> None:
    rng = np.random.default_rng(seed)
    width, height = rng.integers(6, 17, 2).tolist()
    grid = random_map(seed, width, height, float(rng.uniform(0, 0.2)))
    fleet = random_fleet(grid, int(rng.integers(2, 3 + width * height // 24)), seed=seed)
    best = lampyris.plan_fleet(fleet, "cbs", budget=lampyris.Budget(expansions=400))
    for disjoint in (False, True):
        plan = lampyris.plan_fleet(
            fleet, "eecbs", budget=lampyris.Budget(expansions=400), weight=weight, disjoint=disjoint
        )
        assert check_fleet_plan(plan, fleet, every=True) is None
        if plan:
            assert conflicts(plan, fleet) == []
            assert plan.sum_of_costs <= weight * plan.lower_bound + 1e-9
        if best:
            assert plan.lower_bound <= best.sum_of_costs
        if best and plan and weight == 1.0:
            assert plan.sum_of_costs == best.sum_of_costs


@pytest.mark.parametrize("seed", some(range(500), 15))
def test_the_bound_is_one_of_the_joint_optimum(seed: int) -> None:
    rng = np.random.default_rng(seed)
    blocked = rng.random((3, 4)) < 0.2
    free = [(int(x), int(y)) for y, x in np.argwhere(~blocked)]
    starts, goals = (rng.permutation(len(free))[:3] for _ in range(2))
    agents = [lampyris.Agent(free[a], free[b]) for a, b in zip(starts, goals, strict=True)]
    fleet = lampyris.Fleet(lampyris.Grid(blocked), agents)
    best = joint_optimum(fleet)
    plan = lampyris.plan_fleet(fleet, "eecbs", budget=lampyris.Budget(expansions=1000), weight=1.3)
    if best is None:
        assert plan.status is Status.NO_PATH
    else:
        assert plan.lower_bound <= best
        assert plan.status is Status.LIMIT or best <= plan.sum_of_costs <= 1.3 * plan.lower_bound


def test_more_robots_than_cbs() -> None:
    fleet = random_fleet(random_map(3, 24, 24, 0.1), 80, seed=3)
    budget = lampyris.Budget(expansions=60)
    assert lampyris.plan_fleet(fleet, "cbs", budget=budget).status is Status.LIMIT
    plan = lampyris.plan_fleet(fleet, "eecbs", budget=budget, weight=1.5)
    assert plan
    assert plan.gap <= 0.5


def test_the_factor_is_checked() -> None:
    fleet = random_fleet(random_map(3, 8, 8, 0.1), 3)
    for wrong in (0.9, float("nan"), "1.1"):
        with pytest.raises(SettingError, match="weight"):
            lampyris.plan_fleet(fleet, "eecbs", weight=wrong)


def test_who_waits_on_the_goal_has_arrived() -> None:
    """A robot that may not arrive before some tick waited on its goal: the referee refused the path (exit code 6)."""
    ends = [((3, 2), (2, 0)), ((2, 1), (3, 0)), ((3, 1), (0, 2)), ((0, 0), (2, 2)), ((1, 0), (2, 1))]
    fleet = lampyris.Fleet(
        lampyris.Grid(np.zeros((3, 4), dtype=bool)), [lampyris.Agent(a, b) for a, b in ends]
    )
    plan = lampyris.plan_fleet(fleet, "eecbs", weight=1.3)
    assert plan
    assert plan.sum_of_costs <= 1.3 * plan.lower_bound
    assert all(len(path) == 1 or tuple(path[-2]) != tuple(path[-1]) for path in plan.paths)


@pytest.mark.parametrize("seed", some(range(400), 8))
@pytest.mark.parametrize("weight", [1.1, 1.3, 2.0])
def test_dense_fleets_are_accepted_by_the_referee(seed: int, weight: float) -> None:
    fleet = random_fleet(lampyris.Grid(np.zeros((5, 5), dtype=bool)), 6 + seed % 4, seed=seed)
    plan = lampyris.plan_fleet(fleet, "eecbs", weight=weight, budget=lampyris.Budget(expansions=300))
    assert plan.status in (lampyris.Status.FOUND, lampyris.Status.LIMIT)
