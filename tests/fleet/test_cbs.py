"""CBS: the least sum of costs, by two independent searches; what it says without a plan; the paths of single robots."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from fleet_checks import conflicts, joint_optimum, neighbours, random_map
from scipy import ndimage

import lampyris
from lampyris.errors import LimitError
from lampyris.fleets import random_fleet
from lampyris.planning.fleet.constraint_tree import _cover
from lampyris.planning.fleet.distance_tables import tables_of
from lampyris.planning.fleet.space_time import SpaceTime
from lampyris.referee import check_fleet_plan
from lampyris_selfcheck.reference.paths.joint_plans import least_sum_of_costs
from sizes import sized, some

Agent, Fleet, Status = lampyris.Agent, lampyris.Fleet, lampyris.Status
NODES = lampyris.Budget(expansions=20_000)


def connected_grids() -> list[lampyris.Grid]:
    """All 218 maps of 3 x 3 cells in which the free cells are connected."""
    made = []
    for bits in range(1, 512):
        free = np.array([bits >> k & 1 for k in range(9)], dtype=bool).reshape(3, 3)
        if ndimage.label(free)[1] == 1:
            made.append(lampyris.Grid(~free))
    return made


def fleet_on(grid: lampyris.Grid, robots: int, rng: np.random.Generator) -> lampyris.Fleet | None:
    free = [(int(x), int(y)) for y, x in np.argwhere(~grid.blocked)]
    if len(free) < robots:
        return None
    starts, goals = (rng.permutation(len(free))[:robots] for _ in range(2))
    return Fleet(grid, [Agent(free[a], free[b]) for a, b in zip(starts, goals, strict=True)])


@pytest.mark.parametrize("robots", [2, 3])
@sized("placements", 1, 20)
def test_least_cost_on_all_connected_grids_of_3_x_3(placements: int, robots: int) -> None:
    """As Dijkstra over the joint space; where that has no plan, neither has CBS."""
    rng = np.random.default_rng(robots)
    grids = connected_grids()
    assert len(grids) == 218
    solved = limited = 0
    for grid, _ in product(grids, range(placements)):
        fleet = fleet_on(grid, robots, rng)
        if fleet is None:
            continue
        best = joint_optimum(fleet)
        plan = lampyris.plan_fleet(fleet, "cbs", budget=NODES)
        if plan.status is Status.LIMIT:  # a few that turn in a pocket, three robots for six cells
            limited += 1
            assert best is not None
            assert plan.lower_bound <= best
            continue
        assert (plan.sum_of_costs, plan.status is Status.NO_PATH) == (best, best is None)
        if plan:
            assert conflicts(plan, fleet) == []
            assert plan.lower_bound == plan.sum_of_costs
            solved += 1
    assert solved > 80 * placements
    assert limited <= placements // 5


@pytest.mark.parametrize("seed", some(range(1000), 40))
def test_least_cost_by_time_expanded_search(seed: int) -> None:
    rng = np.random.default_rng(seed)
    width, height = rng.integers(3, 8, 2).tolist()
    grid = random_map(seed, width, height, float(rng.uniform(0, 0.3)))
    region = int(ndimage.sum_labels(~grid.blocked, *_largest(~grid.blocked)))
    fleet = random_fleet(grid, min(int(rng.integers(2, 5)), max(1, region // 3)), seed=seed)
    best = least_sum_of_costs(grid.blocked.tolist(), fleet.starts, fleet.goals, 3)
    for settings in ({}, {"disjoint": False}, {"bypass": False}):
        plan = lampyris.plan_fleet(fleet, "cbs", budget=NODES, **settings)
        assert check_fleet_plan(plan, fleet, every=True) is None
        if best is not None:
            assert plan.sum_of_costs == plan.lower_bound == best
        elif plan:
            assert plan.sum_of_costs > plan.shortest.sum() + 3


def _largest(free: np.ndarray) -> tuple[np.ndarray, int]:
    labels, _ = ndimage.label(free)
    return labels, 1 + int(np.bincount(labels.ravel())[1:].argmax())


def test_one_robot_waits_in_the_bay() -> None:
    """Two robots change places in a corridor of seven cells with a bay in its middle: 6 steps each, one waits for the
    other to pass and goes in and out, 2 + 2 more."""
    blocked = np.ones((2, 7), dtype=bool)
    blocked[0] = False
    blocked[1, 3] = False
    fleet = Fleet(lampyris.Grid(blocked), [Agent((0, 0), (6, 0)), Agent((6, 0), (0, 0))])
    plan = lampyris.plan_fleet(fleet, "cbs")
    assert plan.sum_of_costs == joint_optimum(fleet) == plan.lower_bound
    assert plan.shortest.sum() == 12 < plan.sum_of_costs


def test_a_robot_at_its_goal_makes_way() -> None:
    """It stands where another one has to pass, so it comes later, or goes aside."""
    blocked = np.ones((2, 6), dtype=bool)
    blocked[0] = False
    blocked[1, 2] = False
    fleet = Fleet(lampyris.Grid(blocked), [Agent((2, 0), (3, 0)), Agent((0, 0), (5, 0))])
    plan = lampyris.plan_fleet(fleet, "cbs")
    assert plan.sum_of_costs == joint_optimum(fleet)
    assert conflicts(plan, fleet) == []


def test_no_plan_is_recognised() -> None:
    fleet = Fleet(lampyris.Grid(np.zeros((1, 5), dtype=bool)), [Agent((0, 0), (4, 0)), Agent((4, 0), (0, 0))])
    for planner in ("cbs", "eecbs"):
        plan = lampyris.plan_fleet(fleet, planner)
        assert (plan.status, plan.planner, plan.paths) == (Status.NO_PATH, planner, ())


def test_too_many_robots_end_at_the_limit_with_a_bound() -> None:
    fleet = random_fleet(random_map(3, 16, 16, 0.2), 40, seed=3)
    bounds = []
    for nodes in (1, 10, 40):
        plan = lampyris.plan_fleet(fleet, "cbs", budget=lampyris.Budget(expansions=nodes))
        assert (plan.status, plan.paths, plan.iterations) == (Status.LIMIT, (), nodes)
        assert f"at least {plan.lower_bound:,}" in plan.sentence
        bounds.append(plan.lower_bound)
    better = lampyris.plan_fleet(fleet, "lns", budget=lampyris.Budget(expansions=300))
    assert plan.shortest.sum() < bounds[0] <= bounds[1] <= bounds[2] <= better.sum_of_costs


def test_memory_ends_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = random_fleet(random_map(3, 16, 16, 0.2), 60, seed=3)
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "4")
    for planner in ("cbs", "eecbs"):
        plan = lampyris.plan_fleet(
            fleet, planner, planner_settings={"weight": 1.0} if planner == "eecbs" else {}
        )
        assert plan.status is Status.LIMIT
        assert "memory" in plan.sentence
        large = random_fleet(lampyris.load_grid("rooms-100"), 10, seed=3)
        with pytest.raises(LimitError, match="tables of paths of 10 robots"):
            lampyris.plan_fleet(large, planner)


@pytest.mark.parametrize("seed", range(40))
def test_the_cover_of_robots_in_conflict(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robots = int(rng.integers(2, 10))
    edges = {tuple(sorted(rng.permutation(robots)[:2].tolist())) for _ in range(int(rng.integers(1, 14)))}
    sizes = [
        bin(bits).count("1")
        for bits in range(2**robots)
        if all(bits >> a & 1 or bits >> b & 1 for a, b in edges)
    ]
    assert _cover(edges) == min(sizes)


@pytest.mark.parametrize("seed", some(range(300), 40))
def test_paths_of_one_robot_with_constraints(seed: int) -> None:
    """They are as cheap as breadth-first search over cells and ticks finds them."""
    rng = np.random.default_rng(seed)
    fleet = random_fleet(random_map(seed, 9, 9, 0.15), 12, seed=seed)
    tables = tables_of(fleet)
    soft = SpaceTime(tables, 4)
    banned = {
        (cell, t)
        for cell, t in zip(rng.integers(0, tables.graph.cells, 60), rng.integers(1, 12, 60), strict=True)
    }
    banned = {(int(c), int(t)) for c, t in banned}
    path = soft.find(0, [(0, c, c, t) for c, t in sorted(banned)])
    free_ways = _earliest(fleet, 0, 60, {(tuple(tables.graph.places[c].tolist()), t) for c, t in banned})
    assert (None if path is None else path.cost) == free_ways
    if path is not None:
        assert path.bound == path.cost == len(path.single) - 1
        assert all(a in (-1, b) for a, b in zip(path.single, path.cells, strict=True))
        assert not any((c, t) in banned for t, c in enumerate(path.cells))


def _earliest(fleet, k, most, banned):  # type: ignore[no-untyped-def]
    """Breadth-first search over ticks: sets of cells; the arrival that is for good."""
    goal = fleet.goals[k]
    late = [t for cell, t in banned if cell == goal]
    front = {fleet.starts[k]}
    for t in range(most):
        if goal in front and t > max(late, default=-1):
            return t
        front = {v for u in front for v in neighbours(fleet.grid.blocked, u) if (v, t + 1) not in banned}
    return None
