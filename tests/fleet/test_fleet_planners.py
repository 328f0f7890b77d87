"""Planners of fleets: no conflicts, bounds, completeness, promises, the same bytes for the same seed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from fleet_checks import conflicts, is_biconnected, joint_optimum, random_map

import lampyris
from lampyris.errors import LimitError, SettingError, UsageError
from lampyris.fleets import random_fleet
from lampyris.kernels import _jit
from lampyris.kernels._jit import Kernel, compiled_only
from lampyris.planning.fleet.distance_tables import tables_of, wide_tables
from lampyris.planning.fleet.lacam import Lacam
from lampyris.planning.fleet.pibt import PibtRun
from lampyris.planning.fleet.registry import list_fleet_planners, names
from lampyris.referee import check_fleet_plan
from sizes import some

SLOWER = {"cbs": 50, "eecbs": 50, "lns": 20}
"""Planners whose iterations take so many times as long."""
Agent, Fleet, Status = lampyris.Agent, lampyris.Fleet, lampyris.Status


def fleet_of(seed: int) -> lampyris.Fleet:
    """A random fleet on a random map: up to a third of the free cells of its region."""
    rng = np.random.default_rng(seed)
    width, height = rng.integers(4, 24, 2).tolist()
    grid = random_map(seed, width, height, float(rng.uniform(0, 0.35)))
    while True:
        try:
            return random_fleet(grid, int(rng.integers(1, 2 + width * height // 6)), seed=seed)
        except SettingError:
            continue


@pytest.mark.commit(24)
@pytest.mark.parametrize("planner", names())
@pytest.mark.parametrize("seed", some(range(400), 30))
def test_no_conflict_by_referee_and_by_definition(planner: str, seed: int) -> None:
    fleet = fleet_of(seed)
    settings = {"restarts": 2} if planner == "prioritised-sipp" else {}
    if planner == "pibt":
        settings = {"ticks": 300}
    budget = lampyris.Budget(expansions=2000 // SLOWER.get(planner, 1))
    plan = lampyris.plan_fleet(fleet, planner, seed=seed, budget=budget, planner_settings=settings)
    assert check_fleet_plan(plan, fleet, every=True) is None
    if plan:
        assert conflicts(plan, fleet) == []
        assert plan.sum_of_costs == sum(len(path) - 1 for path in plan.paths) >= plan.lower_bound
        assert plan.makespan == max(len(path) - 1 for path in plan.paths)
        assert plan.improvements[-1][1] == plan.sum_of_costs
    else:
        assert plan.sum_of_costs is plan.makespan is plan.gap is None


@pytest.mark.parametrize("seed", some(range(1000), 12))
def test_beside_the_optimum_of_the_joint_space(seed: int) -> None:
    """On 3 x 3 maps with two or three robots: LaCAM* finds a plan exactly where there is one; no plan is better."""
    rng = np.random.default_rng(seed)
    blocked = rng.random((3, 3)) < 0.2
    robots = int(rng.integers(2, 4))
    blocked.flat[rng.permutation(9)[: robots + 1]] = False
    fleet = random_fleet_anywhere(lampyris.Grid(blocked), robots, rng)
    best = joint_optimum(fleet)
    for planner in names():
        budget = lampyris.Budget(expansions=2000) if planner in ("cbs", "eecbs") else None
        settings = {"pibt": {"ticks": 100}, "lns": {"rounds": 20}}.get(planner, {})
        plan = lampyris.plan_fleet(fleet, planner, seed=seed, budget=budget, **settings)
        assert check_fleet_plan(plan, fleet, every=True) is None
        if plan:
            assert best is not None
            assert plan.lower_bound <= best <= plan.sum_of_costs
        elif planner in ("lacam", "lns"):
            assert plan.status is Status.NO_PATH
            assert best is None
    if best is not None:
        whole = lampyris.plan_fleet(fleet, "lacam", seed=seed, budget=lampyris.Budget(expansions=200_000))
        assert best <= whole.sum_of_costs <= 2 * best + 4


def random_fleet_anywhere(grid: lampyris.Grid, robots: int, rng: np.random.Generator) -> lampyris.Fleet:
    """Starts and goals on any free cells: there may be no plan."""
    free = [(int(x), int(y)) for y, x in np.argwhere(~grid.blocked)]
    starts, goals = (rng.permutation(len(free))[:robots] for _ in range(2))
    return Fleet(grid, [Agent(free[a], free[b]) for a, b in zip(starts, goals, strict=True)])


@pytest.mark.commit(2)
@pytest.mark.parametrize("seed", some(range(1000), 15))
def test_pibt_brings_every_robot_to_its_goal_on_biconnected_maps(seed: int) -> None:
    """Each has been there, though not all at once (Okumura et al. 2022, Theorem 1)."""
    rng = np.random.default_rng(seed)
    width, height = rng.integers(4, 17, 2).tolist()
    blocked = np.zeros((height, width), dtype=bool)
    for y, x in rng.permutation(np.argwhere(~blocked))[: width * height // 6].tolist():
        blocked[y, x] = True
        if not is_biconnected(blocked):
            blocked[y, x] = False
    grid = lampyris.Grid(blocked)
    cells = int(np.count_nonzero(~blocked))
    fleet = random_fleet(grid, int(rng.integers(2, min(200, cells - 1))), seed=seed)
    run = PibtRun(tables_of(fleet), swap=False, seed=seed)
    run.go_on(20_000)
    assert (run.visited >= 0).all()
    if run.solved:
        assert (run.track[-1] == tables_of(fleet).goals).all()


def test_a_dead_end_needs_the_swap_rule() -> None:
    """Two robots that change places in a corridor with one bay."""
    blocked = np.ones((2, 7), dtype=bool)
    blocked[0] = False
    blocked[1, 3] = False
    fleet = Fleet(lampyris.Grid(blocked), [Agent((0, 0), (6, 0)), Agent((6, 0), (0, 0))])
    with_rule = lampyris.plan_fleet(fleet, "pibt", ticks=200)
    without = lampyris.plan_fleet(fleet, "pibt", swap=False, ticks=200)
    assert with_rule
    assert without.status is Status.ITERATION_LIMIT
    assert "of 2 robots" in without.sentence
    assert without.paths, "what was found is told"
    assert conflicts(with_rule, fleet) == conflicts(lampyris.plan_fleet(fleet), fleet) == []


def test_what_has_no_plan_is_proven() -> None:
    fleet = Fleet(lampyris.Grid(np.zeros((1, 5), dtype=bool)), [Agent((0, 0), (4, 0)), Agent((4, 0), (0, 0))])
    for budget in (None, lampyris.Budget(expansions=10**6)):
        plan = lampyris.plan_fleet(fleet, budget=budget)
        assert plan.status is Status.NO_PATH
    assert lampyris.plan_fleet(fleet, "prioritised-sipp").status is Status.ITERATION_LIMIT


def test_walls_between_a_robot_and_its_goal() -> None:
    blocked = np.zeros((3, 3), dtype=bool)
    blocked[:, 1] = True
    fleet = Fleet(lampyris.Grid(blocked), [Agent((0, 0), (0, 2)), Agent((0, 1), (2, 1))])
    for planner in names():
        plan = lampyris.plan_fleet(fleet, planner)
        assert (plan.status, plan.paths) == (Status.NO_PATH, ())
        assert "robot 1" in plan.sentence


def packed(plan: lampyris.FleetPlan) -> str:
    return json.dumps(replace(plan, timing={}).to_dict(), allow_nan=False)


@pytest.mark.parametrize("planner", names())
def test_one_seed_gives_the_same_bytes(planner: str) -> None:
    fleet = random_fleet(lampyris.load_grid("rooms-20"), 40, seed=2)
    budget = lampyris.Budget(expansions=3000 // SLOWER.get(planner, 1))
    first, again = (packed(lampyris.plan_fleet(fleet, planner, seed=5, budget=budget)) for _ in range(2))
    assert first == again
    # prioritised-sipp draws only when it starts again.
    if list_fleet_planners()[planner].traits.stochastic and planner != "prioritised-sipp":
        assert packed(lampyris.plan_fleet(fleet, planner, seed=6, budget=budget)) != first


@pytest.mark.parametrize("planner", names())
def test_plain_and_compiled_form_agree(planner: str) -> None:
    fleet = random_fleet(random_map(4, 12, 9, 0.2), 14, seed=4)
    budget = lampyris.Budget(expansions=300 // SLOWER.get(planner, 1))
    with compiled_only():
        compiled = packed(lampyris.plan_fleet(fleet, planner, budget=budget))
    asked = Kernel._plain_is_quicker
    try:
        Kernel._plain_is_quicker = lambda self, args: True
        forms = {k: k._compiled for k in _jit.KERNELS}
        for k in forms:
            k._compiled = None
        plain = packed(lampyris.plan_fleet(fleet, planner, budget=budget))
    finally:
        Kernel._plain_is_quicker = asked
        for k, form in forms.items():
            k._compiled = form
    assert plain == compiled


def test_improvement_keeps_to_the_budget_and_never_gets_worse() -> None:
    fleet = random_fleet(random_map(1, 8, 8, 0.1), 12, seed=1)
    first = lampyris.plan_fleet(fleet)
    better = lampyris.plan_fleet(fleet, budget=lampyris.Budget(expansions=20_000))
    same = lampyris.plan_fleet(fleet, budget=lampyris.Budget(expansions=20_000), improve=False)
    assert first.paths[0].shape == same.paths[0].shape
    assert first.sum_of_costs == same.sum_of_costs
    assert better.sum_of_costs < first.sum_of_costs
    assert better.iterations <= 20_000
    costs = [cost for _, cost in better.improvements]
    assert costs == sorted(set(costs), reverse=True)


def test_lns_records_each_neighbourhood_that_made_the_plan_cheaper() -> None:
    fleet = random_fleet(random_map(3, 16, 16, 0.1), 50, seed=3)
    ticked: list[int] = []
    plan = lampyris.plan_fleet(fleet, "lns", rounds=250, progress=lambda done, _cost: ticked.append(done))
    rounds, costs = zip(*plan.improvements, strict=True)
    assert list(costs) == sorted(set(costs), reverse=True)
    assert (costs[-1], rounds[-1] <= plan.iterations) == (plan.sum_of_costs, True)
    assert len(rounds) > 3 * len(ticked)
    # Cut off after any of them, the search has just that cost.
    k = len(rounds) // 2
    short = lampyris.plan_fleet(fleet, "lns", rounds=rounds[k] - rounds[0])
    assert short.improvements == plan.improvements[: k + 1]


def test_samples_make_plans_cheaper() -> None:
    costs = {1: 0, 10: 0}
    for seed in range(5):
        fleet = random_fleet(random_map(seed, 16, 16, 0.1), 60, seed=seed)
        for samples in costs:
            costs[samples] += lampyris.plan_fleet(fleet, samples=samples, seed=seed).sum_of_costs
    assert costs[10] < costs[1]


def test_neighbourhoods_make_plans_cheaper_and_no_longer() -> None:
    """Where robots are dense LNS gains far more than LaCAM* in as many iterations."""
    total = {"lacam": 0, "lns": 0, "first": 0, "bound": 0}
    budget = lampyris.Budget(expansions=2000)
    for seed in range(4):
        fleet = random_fleet(random_map(seed, 24, 24, 0.1), 100, seed=seed)
        first = lampyris.plan_fleet(fleet)
        plans = {name: lampyris.plan_fleet(fleet, name, budget=budget) for name in ("lacam", "lns")}
        for name, plan in plans.items():
            assert conflicts(plan, fleet) == []
            total[name] += plan.sum_of_costs
        total["first"] += first.sum_of_costs
        total["bound"] += first.lower_bound
        assert plans["lns"].makespan <= first.makespan
        assert plans["lns"].iterations <= 2000
        costs = [cost for _, cost in plans["lns"].improvements]
        assert costs == sorted(set(costs), reverse=True)
    assert total["first"] - total["lns"] > 3 * (total["first"] - total["lacam"])
    assert total["lns"] < 1.15 * total["bound"]


@pytest.mark.parametrize("seed", some(range(300), 6))
def test_neighbourhoods_beside_the_optimum(seed: int) -> None:
    """With all robots in one neighbourhood the plan is never better than the optimum of the joint space."""
    rng = np.random.default_rng(seed)
    blocked = rng.random((3, 4)) < 0.15
    blocked.flat[rng.permutation(12)[:5]] = False
    fleet = random_fleet_anywhere(lampyris.Grid(blocked), 3, rng)
    best = joint_optimum(fleet)
    plan = lampyris.plan_fleet(fleet, "lns", seed=seed, rounds=300)
    assert bool(plan) == (best is not None)
    if best is not None:
        assert best <= plan.sum_of_costs
        assert conflicts(plan, fleet) == []


@pytest.mark.nightly
def test_seconds_keep_the_best_plan_so_far() -> None:
    fleet = random_fleet(random_map(1, 12, 12, 0.1), 30, seed=1)
    for planner in ("lacam", "lns"):
        with compiled_only():
            lampyris.plan_fleet(fleet, planner, budget=lampyris.Budget(expansions=500))
        plan = lampyris.plan_fleet(fleet, planner, budget=lampyris.Budget(seconds=0.3))
        assert plan
        assert "time limit" in plan.sentence
        assert check_fleet_plan(plan, fleet) is None
    none = lampyris.plan_fleet(fleet, budget=lampyris.Budget(seconds=1e-9))
    assert (none.status, none.paths) == (Status.LIMIT, ())


def test_a_token_cancels() -> None:
    fleet = random_fleet(random_map(1, 12, 12, 0.1), 30, seed=1)
    stop = lampyris.CancelToken()
    seen: list[tuple[int, int | None]] = []

    def progress(iterations: int, cost: int | None) -> None:
        seen.append((iterations, cost))
        if len(seen) == 3:
            threading.Thread(target=stop.set).start()

    budget = lampyris.Budget(seconds=60, stop=stop)
    plan = lampyris.plan_fleet(fleet, budget=budget, progress=progress)
    assert plan.status is Status.CANCELLED
    assert seen[0][1] is not None


def test_tables_beyond_the_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = random_fleet(lampyris.load_grid("warehouse-200"), 100)
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "3")
    with pytest.raises(LimitError, match="distance table of 100 robots"):
        lampyris.plan_fleet(fleet)


RSS = """
import resource, sys
import numpy as np
import lampyris
blocked = np.random.default_rng(1).random((256, 256)) < 0.2
fleet = lampyris.random_fleet(lampyris.Grid(blocked), 1000)
assert lampyris.plan_fleet(fleet, sys.argv[1], budget=lampyris.Budget(expansions=1500))
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


@pytest.mark.nightly
@pytest.mark.parametrize("planner", ["lacam", "lns", "pibt"])
def test_memory_of_1_000_robots(planner: str) -> None:
    """On a map of 256 x 256 cells, interpreter and compiled code included: under 400 MB."""
    done = subprocess.run([sys.executable, "-c", RSS, planner], capture_output=True, text=True, check=True)
    assert int(done.stdout) * 1024 < 400e6


def test_memory_of_the_search_ends_the_improvement(monkeypatch: pytest.MonkeyPatch) -> None:
    fleet = random_fleet(random_map(1, 12, 12, 0.1), 30, seed=1)
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "2")
    plan = lampyris.plan_fleet(fleet, budget=lampyris.Budget(expansions=10**7))
    assert plan
    assert "LAMPYRIS_MAX_MEMORY" in plan.sentence
    assert plan.iterations < 10**6


def test_distances_beyond_16_bits() -> None:
    """A corridor of 40,000 cells, wound up."""
    rows = 81
    blocked = np.ones((rows, 1001), dtype=bool)
    blocked[::2] = False
    for k, y in enumerate(range(1, rows, 2)):
        blocked[y, 1000 if k % 2 == 0 else 0] = False
    fleet = Fleet(lampyris.Grid(blocked), [Agent((0, 0), (1000, rows - 1))])
    tables = tables_of(fleet)
    assert tables.table.dtype == np.int32
    assert tables.distance.tolist() == [41 * 1000 + 80]


def test_random_fleets_of_one_seed_begin_alike() -> None:
    grid = lampyris.load_grid("rooms-20")
    small, large = random_fleet(grid, 5, seed=3), random_fleet(grid, 50, seed=3)
    assert large.robots[:5] == small.robots
    assert random_fleet(grid, 5, seed=4) != small
    with pytest.raises(SettingError, match="robots 400"):
        random_fleet(grid, 400)


@pytest.mark.parametrize("radius", [0.4, 0.7, 1.0, 1.6])
def test_random_robots_have_room_for_their_discs(radius: float) -> None:
    """Judged from the definitions, in metres: walls are squares."""
    cell = 0.5
    grid = lampyris.Grid(random_map(2, 40, 30, 0.02).blocked, resolution=cell)
    robot = lampyris.Robot(radius=radius * cell)
    large, small = (random_fleet(grid, n, seed=7, robot=robot) for n in (12, 5))
    assert small.robots == large.robots[:5]
    wall = np.argwhere(grid.blocked)[:, ::-1].astype(float)
    for ends in (large.starts, large.goals):
        at = np.array(ends, dtype=float)
        away = np.sqrt(((at[:, None] - at[None, :]) ** 2).sum(axis=2)) + 1e9 * np.eye(len(at))
        assert away.min() >= 2 * radius - 1e-9
        gap = np.maximum(np.abs(at[:, None] - wall[None, :]) - 0.5, 0.0)
        assert np.sqrt((gap**2).sum(axis=2)).min() >= min(radius, 0.5) - 1e-9
        if radius > 0.5:
            assert np.sqrt((gap**2).sum(axis=2)).min() >= radius - 1e-9
    made = lampyris.plan_fleet(large, "pibt", budget=lampyris.Budget(3))
    assert made.paths  # starts and goals are taken, and the referee has nothing against them
    with pytest.raises(SettingError, match="found room|from walls" if radius > 0.5 else "robots 1200"):
        random_fleet(grid, 1200, seed=7, robot=robot)
    with pytest.raises(SettingError, match="no cell is 30 m or more"):
        random_fleet(grid, 1, robot=lampyris.Robot(radius=30.0))


def test_what_is_refused() -> None:
    fleet = random_fleet(lampyris.load_grid("guide"), 3)
    with pytest.raises(UsageError, match="did you mean lacam"):
        lampyris.plan_fleet(fleet, "lacan")
    with pytest.raises(UsageError, match="four-connected, octile"):
        lampyris.plan_fleet(fleet, moves="dissertation")
    with pytest.raises(SettingError, match="sample"):
        lampyris.plan_fleet(fleet, sample=3)
    with pytest.raises(SettingError, match="samples 0"):
        lampyris.plan_fleet(fleet, samples=0)
    with pytest.raises(SettingError, match="together with a planner object"):
        lampyris.plan_fleet(fleet, Lacam(), samples=2)
    with pytest.raises(SettingError, match="no planner of fleets"):
        lampyris.plan_fleet(fleet, Lacam)


def test_the_table_of_planners() -> None:
    rows = list_fleet_planners()
    assert list(rows) == list(lampyris.list_planners("fleets")) == list(names())
    assert [name for name, row in rows.items() if row.traits.complete] == ["cbs", "eecbs", "lacam", "lns"]
    assert [name for name, row in rows.items() if row.traits.optimal] == ["cbs"]
    assert [name for name, row in rows.items() if row.traits.bounded] == ["eecbs"]
    assert rows["lacam"].settings == {"swap": True, "improve": True, "samples": 1}
    assert [name for name, row in rows.items() if row.traits.sizes] == ["pibt", "prioritised-sipp"]
    assert all(row.traits.moves == ("four-connected", "octile") for row in rows.values())
    assert all(row.summary and row.source for row in rows.values())
    with pytest.raises(UsageError, match="cells, poses, fleets"):
        lampyris.list_planners("robots")


GUEST = """
from dataclasses import dataclass
from typing import ClassVar
import numpy as np
from lampyris import FleetPlan
from lampyris.model.plan import Status
from lampyris.planning.fleet.base import FleetTraits

@dataclass(frozen=True)
class Stay:
    ticks: int = 3
    name: ClassVar[str] = "stay"
    traits: ClassVar[FleetTraits] = FleetTraits()
    summary: ClassVar[str] = "Stays."
    source: ClassVar[str] = "A test."

    def plan(self, fleet, seed, iterations=None, progress=None, moves="four-connected"):
        paths = tuple(np.array([start] * (self.ticks + 1)) for start in fleet.starts)
        return FleetPlan(Status.ITERATION_LIMIT, self.name, paths)
"""


IN_TURN = """
import contextlib, io, json, sys
from lampyris.cli import main
done = []
for words in json.load(sys.stdin):
    sys.argv, out, err, code = ["lampyris", *words], io.StringIO(), io.StringIO(), 0
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            main()
        except SystemExit as end:
            code = end.code
    done.append({"code": code, "out": out.getvalue(), "err": err.getvalue()})
print(json.dumps(done))
"""
"""Command lines in one process, one after the other."""


@pytest.mark.nightly
def test_a_guest_planner_of_fleets(tmp_path: Path) -> None:
    """An installed package adds one; one that is none is left out with a warning."""
    (tmp_path / "fleet_guest.py").write_text(GUEST)
    info = tmp_path / "fleet_guest-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: fleet-guest\nVersion: 1.0\n")
    entries = "stay = fleet_guest:Stay\nnone = fleet_guest:np\n"
    (info / "entry_points.txt").write_text(f"[lampyris.fleet_planners]\n{entries}")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    calls = (
        ("planners", "--json"),
        ("fleet", "guide", "--robots", "2", "--planner", "stay", "--set", "ticks=5", "--json"),
        ("fleet", "guide", "--robots", "2", "--planner", "none"),
        ("fleet", "guide", "--robots", "2", "--planner", "stay", "--moves", "octile"),
    )
    done = subprocess.run(
        [sys.executable, "-c", IN_TURN], input=json.dumps(calls), capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    listed, made, none, octile = json.loads(done.stdout)
    rows = {row["name"]: row for row in json.loads(listed["out"])["planners"]}
    assert rows["stay"]["kind"] == "fleets"
    assert "none" not in rows
    assert "planner none of the installed package fleet-guest 1.0" in listed["err"]
    assert (made["code"], len(json.loads(made["out"])["paths"][0])) == (4, 6)
    assert none["code"] == 3
    assert octile["code"] == 2


@pytest.mark.nightly
@pytest.mark.parametrize("planner", list_fleet_planners())
def test_wide_tables_give_the_same_plans(planner: str) -> None:
    """Tables of distances over 32,766 steps have numbers of four bytes, which are warmed for users but not for the suite."""
    fleet = random_fleet(lampyris.load_grid("guide"), 4, seed=3)
    with wide_tables():
        assert tables_of(fleet).table.dtype == np.int32
        wide = lampyris.plan_fleet(fleet, planner, budget=lampyris.Budget(expansions=200))
    narrow = lampyris.plan_fleet(fleet, planner, budget=lampyris.Budget(expansions=200))
    assert [path.tolist() for path in wide.paths] == [path.tolist() for path in narrow.paths]
    assert wide.status is narrow.status


def test_wide_tables_give_the_same_plans_in_plain_form() -> None:
    with _jit.recorded() as found:
        for planner in list_fleet_planners():
            test_wide_tables_give_the_same_plans(planner)
    assert found


@pytest.mark.parametrize("seed", some(range(60)))
def test_many_robots(seed: int) -> None:
    """Dense fleets on the bundled maps are solved at their first plan."""
    name, robots = (("rooms-100", 300), ("warehouse-200", 500), ("office-120", 400))[seed % 3]
    fleet = random_fleet(lampyris.load_grid(name), robots, seed=seed)
    plan = lampyris.plan_fleet(fleet, seed=seed)
    assert plan
    assert conflicts(plan, fleet) == []
