"""LNS: never worse than its first plan, and better where there is something to gain."""

from __future__ import annotations

import pytest
from fleet_checks import conflicts, random_map

import lampyris
from lampyris.errors import SettingError
from lampyris.fleets import random_fleet
from lampyris.referee import check_fleet_plan
from sizes import some


@pytest.mark.parametrize("start", ["lacam", "pibt"])
@pytest.mark.parametrize("seed", some(range(100), 6))
def test_never_worse_and_mostly_better(seed: int, start: str) -> None:
    fleet = random_fleet(random_map(seed, 20, 16, 0.1), 40, seed=seed)
    first = lampyris.plan_fleet(fleet, start, seed=seed)
    before = first.sum_of_costs
    for most in (1, 20, 200):
        plan = lampyris.plan_fleet(
            fleet, "lns", seed=seed, start=start, budget=lampyris.Budget(expansions=most)
        )
        assert check_fleet_plan(plan, fleet, every=True) is None
        assert conflicts(plan, fleet) == []
        assert plan.iterations <= most
        assert plan.sum_of_costs <= before
        before = plan.sum_of_costs
        assert plan.improvements[0] == (0, first.sum_of_costs)
        assert plan.improvements[-1][1] == plan.sum_of_costs
    assert before < first.sum_of_costs
    excess = first.sum_of_costs - first.lower_bound
    assert before - first.lower_bound < 0.5 * excess, "most of what is not on shortest paths is gained"


def test_shortest_paths_need_no_search() -> None:
    fleet = random_fleet(random_map(1, 20, 16, 0.0), 1, seed=1)
    plan = lampyris.plan_fleet(fleet, "lns")
    assert (plan.iterations, plan.gap) == (0, 0.0)
    assert "shortest path" in plan.sentence


def test_without_a_budget_it_ends() -> None:
    fleet = random_fleet(random_map(1, 10, 10, 0.1), 30, seed=1)
    plan = lampyris.plan_fleet(fleet, "lns")
    assert plan
    assert plan.iterations == 1000


def test_seconds_and_memory_leave_the_first_plan(monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = random_fleet(random_map(1, 12, 12, 0.1), 30, seed=1)
    plan = lampyris.plan_fleet(fleet, "lns", budget=lampyris.Budget(seconds=0.5))
    assert plan
    assert plan.sum_of_costs <= lampyris.plan_fleet(fleet).sum_of_costs
    first = lampyris.plan_fleet(fleet)
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "1")
    plan = lampyris.plan_fleet(fleet, "lns", budget=lampyris.Budget(expansions=10))
    assert plan.sum_of_costs == first.sum_of_costs
    assert "memory" in plan.sentence


def test_what_is_refused() -> None:
    fleet = random_fleet(random_map(1, 8, 8, 0.1), 3)
    with pytest.raises(SettingError, match="neighbours"):
        lampyris.plan_fleet(fleet, "lns", neighbours=1)
    with pytest.raises(SettingError, match="start"):
        lampyris.plan_fleet(fleet, "lns", start="cbs")
