"""Octile moves of fleets: crossings, optima by brute force; discs of several sizes."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from fleet_checks import conflicts, contacts, joint_optimum, neighbours, random_map

import lampyris
from lampyris.errors import SceneError, SettingError, UsageError
from lampyris.model.fleet.fleet import MOST_RADIUS, OCTILE_RADIUS
from lampyris.planning.fleet.distance_tables import tables_of
from lampyris.planning.fleet.registry import list_fleet_planners, names
from lampyris.planning.fleet.separation import meets
from lampyris.referee import check_fleet_plan
from sizes import some

Agent, Fleet, Robot, Status = lampyris.Agent, lampyris.Fleet, lampyris.Robot, lampyris.Status
SLOWER = {"cbs": 50, "eecbs": 50, "lns": 20}
SIZES = [name for name, row in list_fleet_planners().items() if row.traits.sizes]


def fleet_on(rng: np.random.Generator, width: int, height: int, share: float, robots: int) -> lampyris.Fleet:
    blocked = rng.random((height, width)) < share
    blocked.flat[rng.permutation(blocked.size)[: robots + 1]] = False
    free = [(int(x), int(y)) for y, x in np.argwhere(~blocked)]
    starts, goals = (rng.permutation(len(free))[:robots] for _ in range(2))
    ends = zip(starts, goals, strict=True)
    return Fleet(lampyris.Grid(blocked), [Agent(free[a], free[b]) for a, b in ends])


@pytest.mark.parametrize("seed", some(range(1000), 10))
def test_octile_beside_the_optimum_of_the_joint_space(seed: int) -> None:
    rng = np.random.default_rng(seed)
    fleet = fleet_on(rng, 3, int(rng.integers(2, 4)), 0.15, int(rng.integers(2, 4)))
    best = joint_optimum(fleet, "octile")
    for planner in names():
        budget = lampyris.Budget(expansions=2000) if planner in ("cbs", "eecbs") else None
        settings = {"pibt": {"ticks": 100}, "lns": {"rounds": 100}}.get(planner, {})
        plan = lampyris.plan_fleet(fleet, planner, moves="octile", seed=seed, budget=budget, **settings)
        assert check_fleet_plan(plan, fleet, every=True) is None
        assert plan.moves == "octile"
        if plan:
            assert conflicts(plan, fleet) == contacts(plan, fleet) == []
            assert best is not None
            assert plan.lower_bound <= best <= plan.sum_of_costs
            if planner == "cbs":
                assert plan.sum_of_costs == best
            if planner == "eecbs":
                assert plan.sum_of_costs <= 1.1 * plan.lower_bound + 1e-9
        elif planner in ("lacam", "lns"):
            assert (plan.status, best) == (Status.NO_PATH, None)


@pytest.mark.commit(60)
@pytest.mark.parametrize("planner", names())
@pytest.mark.parametrize("seed", some(range(400), 10))
def test_octile_without_conflicts(planner: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    width, height = rng.integers(4, 20, 2).tolist()
    fleet = fleet_on(rng, width, height, 0.2, int(rng.integers(2, 3 + width * height // 8)))
    budget = lampyris.Budget(expansions=1500 // SLOWER.get(planner, 1))
    settings = {"ticks": 200} if planner == "pibt" else {}
    plan = lampyris.plan_fleet(fleet, planner, moves="octile", seed=seed, budget=budget, **settings)
    assert check_fleet_plan(plan, fleet, every=True) is None
    if plan.paths:
        whole = replace(plan) if plan else None
        assert whole is None or conflicts(whole, fleet) == []


def test_diagonals_save_ticks_and_crossings_cost_one() -> None:
    grid = lampyris.Grid(np.zeros((2, 2), dtype=bool))
    crossed = Fleet(grid, [Agent((0, 0), (1, 1)), Agent((1, 0), (0, 1))])
    plan = lampyris.plan_fleet(crossed, "cbs", moves="octile")
    assert (plan.sum_of_costs, plan.lower_bound) == (3, 3)
    alone = Fleet(lampyris.Grid(np.zeros((5, 9), dtype=bool)), [Agent((0, 0), (8, 4))])
    for planner in names():
        assert lampyris.plan_fleet(alone, planner, moves="octile").makespan == 8
        assert lampyris.plan_fleet(alone, planner).makespan == 12


def test_no_diagonal_past_the_corner_of_a_wall() -> None:
    blocked = np.array([[0, 1], [0, 0]], dtype=bool)
    fleet = Fleet(lampyris.Grid(blocked), [Agent((0, 0), (1, 1))])
    for planner in names():
        assert lampyris.plan_fleet(fleet, planner, moves="octile").makespan == 2


def test_tables_of_octile_moves_beside_a_plain_search() -> None:
    for seed in range(6):
        grid = random_map(seed, 17, 11, 0.3)
        fleet = lampyris.random_fleet(grid, 3, seed=seed)
        tables = tables_of(fleet, "octile")
        rows = tables.table.reshape(3, -1)
        for row, agent in zip(rows, fleet.robots, strict=True):
            steps, front = {agent.goal: 0}, [agent.goal]
            for cell in front:
                for near in neighbours(grid.blocked, cell, "octile"):
                    if near not in steps:
                        steps[near] = steps[cell] + 1
                        front.append(near)
            free = {tuple(place): k for k, place in enumerate(tables.graph.places.tolist())}
            assert row.tolist() == [steps.get(place, tables.never) for place in free]


def test_the_least_distance_of_every_pair_of_steps() -> None:
    """The radii up to which cells alone keep robots apart, by trying all pairs of steps."""
    steps = {
        "four-connected": [(0, 0), (1, 0), (-1, 0), (0, 1), (0, -1)],
        "octile": list(product((-1, 0, 1), repeat=2)),
    }
    least = {}
    for moves, each in steps.items():
        found = []
        for x, y in product(range(-3, 4), repeat=2):
            for a, b in product(each, repeat=2):
                end = (x + b[0] - a[0], y + b[1] - a[1])
                swap = end == (-x, -y) and a == (x, y)
                crossed = (
                    all(a) and all(b) and (2 * x, 2 * y) == (a[0] - b[0], a[1] - b[1]) and a != b and (x, y) != (0, 0)
                )  # fmt: skip
                if (x, y) == (0, 0) or end == (0, 0) or swap or crossed:
                    continue
                share = np.linspace(0, 1, 1001)
                gap = np.hypot(x + share * (b[0] - a[0]), y + share * (b[1] - a[1])).min()
                found.append(gap)
                assert not meets(x, y, b[0] - a[0], b[1] - a[1], gap - 1e-5)
                assert meets(x, y, b[0] - a[0], b[1] - a[1], gap + 1e-5)
        least[moves] = min(found)
    assert least["four-connected"] / 2 == pytest.approx(MOST_RADIUS, abs=1e-6)
    assert least["octile"] / 2 == pytest.approx(OCTILE_RADIUS, abs=1e-6)


# ---- discs ----------------------------------------


def discs(seed: int, radii: tuple[float, ...]) -> lampyris.Fleet:
    """A few discs of these radii (cells) on a random map with few walls."""
    rng = np.random.default_rng(seed)
    width, height = rng.integers(8, 20, 2).tolist()
    grid = random_map(seed, width, height, float(rng.uniform(0, 0.06)))
    unit = grid.resolution
    robots: list[lampyris.Agent] = []
    for _ in range(int(rng.integers(2, 12))):
        radius = float(rng.choice(radii))
        for _ in range(20):
            cells = [(int(rng.integers(width)), int(rng.integers(height))) for _ in range(2)]
            try:
                fleet = Fleet(grid, [*robots, Agent(cells[0], cells[1], Robot(radius=radius * unit))])
                tables_of(fleet)
            except (SettingError, SceneError):
                continue
            robots = list(fleet.robots)
            break
    return Fleet(grid, robots) if robots else discs(seed + 10_000, radii)


@pytest.mark.parametrize("planner", SIZES)
@pytest.mark.parametrize("moves", ["four-connected", "octile"])
@pytest.mark.parametrize("radii", [(0.4, 0.5), (0.3, 1.0), (0.5, 0.8, 1.2, 2.0)])
@pytest.mark.parametrize("seed", some(range(200), 2))
def test_discs_never_touch(planner: str, moves: str, radii: tuple[float, ...], seed: int) -> None:
    fleet = discs(seed, radii)
    settings = {"ticks": 100} if planner == "pibt" else {"restarts": 3}
    plan = lampyris.plan_fleet(fleet, planner, moves=moves, seed=seed, planner_settings=settings)
    assert check_fleet_plan(plan, fleet, every=True) is None
    if plan.paths:
        assert contacts(plan, fleet, 60) == []
    if plan:
        assert conflicts(plan, fleet) == []


@pytest.mark.parametrize("planner", SIZES)
def test_most_small_fleets_of_discs_are_solved(planner: str) -> None:
    solved = 0
    for seed in range(30):
        fleet = discs(seed, (0.5, 0.8, 1.2))
        settings = {"ticks": 300} if planner == "pibt" else {}
        solved += bool(lampyris.plan_fleet(fleet, planner, moves="octile", seed=seed, **settings))
    assert solved >= 20


@pytest.mark.parametrize("moves", ["four-connected", "octile"])
def test_small_discs_are_planned_as_points(moves: str) -> None:
    grid = lampyris.load_grid("rooms-20")
    points = lampyris.random_fleet(grid, 20, seed=1)
    most = (OCTILE_RADIUS if moves == "octile" else MOST_RADIUS) * grid.resolution
    small = Fleet(grid, [replace(one, robot=Robot(radius=most)) for one in points.robots])
    for planner in ("lacam", *SIZES):
        settings = {"ticks": 100} if planner == "pibt" else {}
        plans = [lampyris.plan_fleet(fleet, planner, moves=moves, **settings) for fleet in (points, small)]
        assert [p.tolist() for p in plans[0].paths] == [p.tolist() for p in plans[1].paths]
        assert contacts(plans[1], small, 60) == []


def test_a_large_disc_keeps_out_of_narrow_aisles() -> None:
    blocked = np.zeros((9, 12), dtype=bool)
    blocked[:, 5] = True
    blocked[4, 5] = False
    grid = lampyris.Grid(blocked)
    small, large = Robot(radius=0.5), Robot(radius=0.6)
    for planner in SIZES:
        assert lampyris.plan_fleet(Fleet(grid, [Agent((1, 4), (10, 4), small)]), planner)
        plan = lampyris.plan_fleet(Fleet(grid, [Agent((1, 4), (10, 4), large)]), planner)
        assert plan.status is Status.NO_PATH


def test_what_is_refused() -> None:
    grid = lampyris.Grid(np.zeros((6, 8), dtype=bool))
    big = Robot(radius=1.0)
    fleet = Fleet(grid, [Agent((1, 1), (6, 4), big)])
    for planner in set(names()) - set(SIZES):
        with pytest.raises(SettingError, match=r"(?s)robots\[0\].*touch at corners.*pibt, prioritised-sipp"):
            lampyris.plan_fleet(fleet, planner)
    with pytest.raises(SettingError, match=r"robots\[1\].start: overlaps robot 0"):
        Fleet(grid, [Agent((1, 1), (6, 4), big), Agent((2, 2), (1, 1), big)])
    with pytest.raises(SettingError, match=r"robots\[1\].goal: overlaps robot 0"):
        Fleet(grid, [Agent((1, 1), (6, 4), big), Agent((5, 5), (5, 4), big)])
    walled = np.zeros((6, 8), dtype=bool)
    walled[0] = True
    with pytest.raises(SceneError, match=r"robots\[0\].start"):
        lampyris.plan_fleet(Fleet(lampyris.Grid(walled), [Agent((1, 1), (6, 4), big)]), "pibt")
    for moves in ("dissertation", "sixteen-connected"):
        with pytest.raises(UsageError, match="four-connected, octile"):
            lampyris.plan_fleet(lampyris.random_fleet(grid, 2), moves=moves)


# ---- the referee ----------------------------------------


def plan_of(*paths: list[tuple[int, int]], moves: str = "octile") -> lampyris.FleetPlan:
    return lampyris.FleetPlan(Status.FOUND, "test", tuple(np.array(path) for path in paths), moves=moves)


def open_fleet(*ends: tuple[tuple[int, int], tuple[int, int]], radius: float | None = None) -> lampyris.Fleet:
    robot = None if radius is None else Robot(radius=radius)
    grid = lampyris.Grid(np.zeros((6, 8), dtype=bool), resolution=1.0)
    return Fleet(grid, [Agent(a, b, robot) for a, b in ends])


def test_the_referee_sees_crossings_and_corners() -> None:
    crossed = open_fleet(((1, 1), (2, 2)), ((2, 1), (1, 2)))
    plan = plan_of([(1, 1), (2, 2)], [(2, 1), (1, 2)])
    found = check_fleet_plan(plan, crossed)
    assert (found.rule, found.where) == ("crossing", "robots 0 and 1, tick 1")
    assert check_fleet_plan(replace(plan, moves="four-connected"), crossed).rule == "step"
    assert check_fleet_plan(replace(plan, moves="dissertation"), crossed).rule == "moves"
    later = plan_of([(1, 1), (1, 1), (2, 2)], [(2, 1), (1, 2)])
    assert check_fleet_plan(later, crossed) is None
    beside = open_fleet(((1, 1), (2, 2)), ((3, 1), (2, 2 + 1)))
    assert check_fleet_plan(plan_of([(1, 1), (2, 2)], [(3, 1), (3, 2), (2, 3)]), beside) is None
    blocked = np.zeros((6, 8), dtype=bool)
    blocked[1, 2] = True
    walled = Fleet(lampyris.Grid(blocked), [Agent((1, 1), (2, 2))])
    assert check_fleet_plan(plan_of([(1, 1), (2, 2)]), walled).rule == "wall"


@pytest.mark.parametrize(
    ("radius", "rule"),
    [(0.2, None), (OCTILE_RADIUS, None), (OCTILE_RADIUS + 0.01, "contact"), (0.5, "contact")],
)
def test_the_referee_sees_discs_that_touch_on_their_steps(radius: float, rule: str | None) -> None:
    """One leaves (2, 2) diagonally, the other enters it from the side that the first one passes."""
    fleet = open_fleet(((2, 2), (3, 3)), ((3, 2), (2, 2)), radius=radius)
    found = check_fleet_plan(plan_of([(2, 2), (3, 3)], [(3, 2), (2, 2)]), fleet)
    assert (None if found is None else found.rule) == rule


def test_the_referee_sees_discs_in_walls() -> None:
    blocked = np.zeros((6, 8), dtype=bool)
    blocked[0] = True
    grid = lampyris.Grid(blocked, resolution=1.0)
    fleet = Fleet(grid, [Agent((1, 3), (4, 3), Robot(radius=1.0))])
    low = [(1, 3), (2, 3), (3, 3), (4, 3)]
    assert check_fleet_plan(plan_of(low, moves="four-connected"), fleet) is None
    high = [(1, 3), (1, 2), (2, 2), (2, 1), (3, 1), (3, 2), (4, 2), (4, 3)]
    found = check_fleet_plan(plan_of(high, moves="four-connected"), fleet)
    assert (found.rule, found.where) == ("wall", "robot 0, tick 3")
    wrong = replace(plan_of(low, moves="four-connected"), shortest=np.array([2]))
    assert check_fleet_plan(wrong, fleet).rule == "bound"
