"""The referee of fleets sees every seeded defect of a plan, and its distances are those of a plain search."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fleet_checks import neighbours, random_map

import lampyris
from lampyris.errors import InternalFault
from lampyris.fleets import random_fleet
from lampyris.referee import check_fleet_plan, demand
from lampyris.referee.fleets.fleet_plan import _distances

Plan, Fleet = lampyris.FleetPlan, lampyris.Fleet
FLEET = random_fleet(lampyris.load_grid("rooms-20"), 40, seed=1)
FOUND = lampyris.plan_fleet(FLEET)


def with_path(plan: Plan, k: int, path: Any) -> Plan:
    """The plan with another path of robot ``k``, its figures left consistent with it."""
    paths = tuple(np.array(path) if i == k else one for i, one in enumerate(plan.paths))
    return replace(plan, paths=paths, improvements=())


def longest(plan: Plan) -> int:
    return max(range(len(plan.paths)), key=lambda k: len(plan.paths[k]))


def jump(plan: Plan) -> Plan:
    k = longest(plan)
    path = plan.paths[k]
    moved = [t for t in range(len(path) - 2) if abs(path[t + 2] - path[t]).sum() == 2]
    return with_path(plan, k, np.delete(path, moved[0] + 1, axis=0))


def diagonal(plan: Plan) -> Plan:
    for k, path in enumerate(plan.paths):
        for t in range(len(path) - 2):
            if (abs(path[t + 2] - path[t]) == 1).all():
                return with_path(plan, k, np.delete(path, t + 1, axis=0))
    raise AssertionError("no corner")


def through_a_wall(plan: Plan) -> Plan:
    k = longest(plan)
    path = plan.paths[k].copy()
    y, x = np.argwhere(FLEET.grid.blocked)[0]
    path[len(path) // 2] = (x, y)
    return with_path(plan, k, path)


def off_the_map(plan: Plan) -> Plan:
    path = plan.paths[0].copy()
    path[len(path) // 2] = (-1, 3)
    return with_path(plan, 0, path)


def late_wait(plan: Plan) -> Plan:
    k = longest(plan)
    return with_path(plan, k, np.concatenate((plan.paths[k], plan.paths[k][-1:])))


def short_of_the_goal(plan: Plan) -> Plan:
    k = longest(plan)
    return with_path(plan, k, plan.paths[k][:-1])


def other_start(plan: Plan) -> Plan:
    k = longest(plan)
    return with_path(plan, k, plan.paths[k][1:])


def shifted(plan: Plan, change: int) -> Plan:
    return replace(plan, shortest=plan.shortest + change)


def exchanged(plan: Plan) -> Plan:
    paths = list(plan.paths)
    paths[0], paths[1] = paths[1], paths[0]
    return replace(plan, paths=tuple(paths))


DEFECTS: dict[str, tuple[str, Callable[[Plan], Plan]]] = {
    "a robot without a path": ("paths", lambda p: replace(p, paths=p.paths[:-1])),
    "a path too many": ("paths", lambda p: replace(p, paths=(*p.paths, p.paths[0]))),
    "two paths exchanged": ("start", exchanged),
    "the first cell left out": ("start", other_start),
    "a step of two cells": ("step", jump),
    "a diagonal step": ("step", diagonal),
    "a cell in a wall": ("wall", through_a_wall),
    "a cell off the map": ("outside", off_the_map),
    "the last cell left out": ("goal", short_of_the_goal),
    "a wait on the goal": ("arrival", late_wait),
    "bounds too high": ("bound", lambda p: shifted(p, 1)),
    "bounds too low": ("bound", lambda p: shifted(p, -1)),
    "a proved bound above the cost": ("bound", lambda p: replace(p, bound=p.sum_of_costs + 1)),
    "bounds of too few robots": ("bound", lambda p: replace(p, shortest=p.shortest[:-1])),
    "costs that do not fall": ("improvements", lambda p: replace(p, improvements=((1, 5), (2, p.sum_of_costs)))),
    "another last cost": ("improvements", lambda p: replace(p, improvements=((1, p.sum_of_costs + 1),))),
}  # fmt: skip


@pytest.mark.parametrize("name", DEFECTS)
def test_a_seeded_defect_is_seen(name: str) -> None:
    rule, spoil = DEFECTS[name]
    assert check_fleet_plan(FOUND, FLEET) is None
    found = check_fleet_plan(spoil(FOUND), FLEET)
    assert found is not None
    assert found.rule == rule
    with pytest.raises(InternalFault, match=rule):
        demand(found)


def pair(one: list[tuple[int, int]], other: list[tuple[int, int]]) -> tuple[Plan, Fleet]:
    """Two robots on an open map that follow these paths."""
    robots = [lampyris.Agent(path[0], path[-1]) for path in (one, other)]
    paths = (np.array(one), np.array(other))
    return Plan(lampyris.Status.FOUND, "by hand", paths), Fleet(lampyris.Grid(np.zeros((4, 6), bool)), robots)


@pytest.mark.parametrize(
    ("rule", "where", "one", "other"),
    [
        ("vertex", "tick 1", [(0, 0), (1, 0), (2, 0)], [(1, 1), (1, 0), (1, 1), (1, 2)]),
        (
            "vertex",
            "tick 3",
            [(0, 0), (1, 0)],
            [(1, 3), (1, 2), (1, 1), (1, 0), (2, 0)],
        ),  # it stays at its goal
        ("swap", "tick 1", [(0, 0), (1, 0)], [(1, 0), (0, 0)]),
        ("swap", "tick 2", [(1, 0), (1, 1), (1, 2)], [(1, 3), (1, 2), (1, 1)]),
        (None, "", [(0, 0), (1, 0), (2, 0)], [(1, 0), (2, 0), (3, 0)]),  # one behind the other
        (None, "", [(0, 0), (1, 0), (1, 1), (0, 1)], [(1, 0), (1, 1), (0, 1), (0, 0)]),  # round a block
    ],
)
def test_pairs(rule: str | None, where: str, one: Any, other: Any) -> None:
    plan, fleet = pair(one, other)
    found = check_fleet_plan(plan, fleet)
    if rule is None:
        assert found is None
    else:
        assert found is not None
        assert (found.rule, where in found.where) == (rule, True)
        assert "robots 0 and 1" in found.where


def test_long_plans_are_judged_in_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    """A swap across the border of two stretches is seen."""
    from lampyris.referee.fleets import fleet_plan

    monkeypatch.setattr(fleet_plan, "_ENTRIES", 4)
    there = [(0, 0), (0, 0), (1, 0), (2, 0)]
    plan, fleet = pair(there, [(5, 3)] * 3 + [(5, 2)])
    assert check_fleet_plan(plan, fleet) is None
    plan, fleet = pair(there, [(1, 1), (1, 0), (0, 0), (0, 1)])
    assert check_fleet_plan(plan, fleet).rule == "swap"


@pytest.mark.parametrize("moves", ["four-connected", "octile"])
@pytest.mark.parametrize("seed", range(10))
def test_distances_beside_a_plain_search(seed: int, moves: str) -> None:
    grid = random_map(seed, 17, 13, 0.35)
    free = [(int(x), int(y)) for y, x in np.argwhere(~grid.blocked)]
    rng = np.random.default_rng(seed)
    ends = [tuple(free[k] for k in rng.integers(0, len(free), 2)) for _ in range(10)]
    for (start, goal), distance in zip(
        ends, _distances(grid.blocked, ends, diagonal=moves == "octile"), strict=True
    ):
        steps, queue = {start: 0}, deque([start])
        while queue:
            cell = queue.popleft()
            for there in neighbours(grid.blocked, cell, moves):
                if there not in steps:
                    steps[there] = steps[cell] + 1
                    queue.append(there)
        assert distance == steps.get(goal)


def test_some_bounds_are_worked_out_again_on_large_maps() -> None:
    """Without ``every`` a wrong length of a robot that is not drawn is not seen, one that is impossible is."""
    k = next(k for k, path in enumerate(FOUND.paths) if len(path) - 1 > FOUND.shortest[k] + 1)
    wrong = FOUND.shortest.copy()
    wrong[k] += 1
    plan = replace(FOUND, shortest=wrong)
    assert check_fleet_plan(plan, FLEET, every=True).rule == "bound"
    wrong = FOUND.shortest.copy()
    wrong[k] = len(FOUND.paths[k])
    assert check_fleet_plan(replace(FOUND, shortest=wrong), FLEET, every=False).rule == "bound"


def test_a_plan_that_is_not_found_is_judged_as_far_as_it_goes() -> None:
    fleet = random_fleet(lampyris.load_grid("rooms-20"), 40, seed=1)
    plan = lampyris.plan_fleet(fleet, "pibt", ticks=3)
    assert plan.status is lampyris.Status.ITERATION_LIMIT
    assert check_fleet_plan(plan, fleet) is None
    broken = replace(plan, paths=(*plan.paths[:-1], plan.paths[0]))
    assert check_fleet_plan(broken, fleet).rule == "start"


def test_a_plan_that_costs_more_than_its_planner_promises_is_refused() -> None:
    fleet = lampyris.random_fleet(lampyris.Grid(np.zeros((6, 6), dtype=bool)), 8, seed=3)
    plan = lampyris.plan_fleet(fleet, "pibt")
    assert plan.gap is not None
    assert plan.gap > 0
    assert check_fleet_plan(plan, fleet, factor=1 + plan.gap) is None
    for factor in (1.0, 1 + plan.gap / 2):
        found = check_fleet_plan(plan, fleet, factor=factor)
        assert found is not None
        assert found.rule == "bound"
