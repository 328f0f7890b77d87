"""The planner pad against an exhaustive search of the whole lattice: costs, bounds, no path, and the cost condition."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from lattice_scenes import FOOTPRINTS, motions_of, optimum, scene_of

import lampyris
from lampyris._core.cancellation import CancelToken
from lampyris.errors import LimitError, SettingError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import DRIVES, Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.lattice.guided.lower_bound import goal_of
from lampyris.planning.lattice.guided.open_space import FAR, NEVER, open_space_of
from lampyris.planning.lattice.lattice_planner import LatticePlanner, LatticeSession, lattice_for
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.around_goal import MANY, with_walls
from lampyris.planning.lattice.pad.field import LowField
from lampyris.planning.lattice.pad.pad_planner import PadPlanner
from lampyris.planning.lattice.pad.regions import Sphere, Spheres, Tunnel
from lampyris.referee import check_plan
from lampyris_selfcheck.reference.paths.lattice import Motion, least_costs
from sizes import sized

WEIGHTS = (1.0, 1.1, 1.5, 4.0)


def planned(scene: Scene, budget: Budget | None = None, **settings: Any) -> Plan:
    """Without shortcuts, as the exhaustive search has the states nearest to both ends."""
    plan = (
        PadPlanner(**{"shortcut": False, **settings}).open(scene, np.random.default_rng(0)).plan(None, budget)
    )
    if plan:
        assert check_plan(plan, scene) is None
    return plan


@pytest.mark.commit(2)
@sized("maps", 4, 1000)
@pytest.mark.parametrize("footprint", FOOTPRINTS)
@pytest.mark.parametrize("drive", DRIVES)
def test_costs_keep_their_bound_and_no_path_agrees(drive: str, footprint: str, maps: int) -> None:
    found = 0
    for seed in range(maps):
        scene = scene_of(seed, drive, FOOTPRINTS[footprint])
        status, least = optimum(scene, LatticePlanner(weight=1.0))
        for weight in WEIGHTS:
            plan = planned(scene, weight=weight)
            assert plan.status is status, (seed, weight)
            if plan.pose_path is None:
                continue
            found += 1
            path = plan.pose_path
            assert path.lower_bound_m <= least * (1 + 1e-9)
            assert least <= path.cost_m * (1 + 1e-9) <= weight * least * (1 + 2e-9)
            assert path.bound <= weight * (1 + 1e-9)
            if weight == 1.0:
                assert path.cost_m == pytest.approx(least, rel=1e-12)
                assert path.bound == 1.0
    assert found > 0


@pytest.mark.commit(2)
@pytest.mark.parametrize("settings", [
    {"sphere_radius": 1.0, "tunnel": 1.0}, {"sphere_radius": 2.0, "sphere_growth": 1.1}, {"tunnel": 30.0},
    {"headings": 32}, {"reverse": False}, {"goal_tolerance": 1.5, "goal_yaw_tolerance": 0.8},
])  # fmt: skip
def test_no_setting_costs_the_bound(settings: dict[str, Any]) -> None:
    """Spheres of a cell, tunnels too narrow to turn in, many goals: more rounds, the same promise."""
    common = {k: v for k, v in settings.items() if k in LatticePlanner.__dataclass_fields__}
    rounds = 0
    for seed in range(20, 26):
        scene = scene_of(seed, DRIVES[seed % 2], FOOTPRINTS["car"], side=24)
        exact = (
            LatticePlanner(weight=1.0, shortcut=False, **common).open(scene, np.random.default_rng(0)).plan()
        )
        for weight in (1.0, 1.3):
            plan = planned(scene, weight=weight, **settings)
            assert plan.status is exact.status
            if plan.pose_path is not None and exact.pose_path is not None:
                assert plan.pose_path.cost_m <= weight * exact.pose_path.cost_m * (1 + 1e-9)
                assert plan.pose_path.lower_bound_m <= exact.pose_path.cost_m * (1 + 1e-9)
                rounds = max(rounds, len(plan.rounds))
    assert rounds > 1


@pytest.mark.nightly
@sized("pairs", 4_000, 1_000_000)
def test_no_pair_of_states_is_cheaper_than_the_pair_of_their_cells(pairs: int) -> None:
    """The cost condition, which every bound rests on."""
    checked = seed = 0
    while checked < pairs:
        drive = DRIVES[seed % 3]
        scene = scene_of(seed, drive, list(FOOTPRINTS.values())[seed // 3 % 3], side=16)
        lattice = lattice_for(scene, LatticePlanner())
        lattice_map = LatticeMap(scene.grid, lattice)
        rng = np.random.default_rng(seed)
        seed += 1
        cell = (int(rng.integers(16)), int(rng.integers(16)))
        ends = [(cell, h) for h in range(16) if lattice_map.is_free(cell, h)]
        if not ends:
            continue
        # The field runs backward, the reference ahead: from many states to all, each of which is a goal in turn.
        best = least_costs(scene.grid.blocked.tolist(), motions_of(lattice), [(*cell, h) for cell, h in ends])
        some = sorted({state[:2] for state in best})
        for goal in rng.permutation(len(some))[:8].tolist():
            x, y = some[goal]
            costs = LowField(lattice_map, [lattice_map.index((x, y))]).costs([lattice_map.index(cell)])
            low = int(costs[lattice_map.index(cell)])
            assert low >= 0
            for h in range(16):
                if (x, y, h) in best:
                    checked += 1
                    assert low <= best[x, y, h]


def test_the_field_is_the_projected_graphs() -> None:
    """Settled in lists, lazily and backward, against the plainest search ahead over the same displacements."""
    for seed in range(6):
        scene = scene_of(seed, DRIVES[seed % 3], FOOTPRINTS["arrow"], side=14)
        lattice = lattice_for(scene, LatticePlanner())
        lattice_map = LatticeMap(scene.grid, lattice)
        cells = [lattice_map.index((x, y)) for x in range(14) for y in range(14)]
        free = [c for c in cells if any(lattice_map.is_free(lattice_map.cell(c), h) for h in range(16))]
        # Motions without headings: every one may follow every other.
        motions = {
            0: [
                (dx, dy, 0, cost, swept)
                for of in motions_of(lattice).values()
                for dx, dy, _, cost, swept in of
            ]
        }
        start = lattice_map.cell(free[0])
        best = least_costs(scene.grid.blocked.tolist(), motions, [(*start, 0)])
        for goal in free[:: max(1, len(free) // 9)]:
            costs = LowField(lattice_map, [goal]).costs([free[0]])
            assert int(costs[free[0]]) == best.get((*lattice_map.cell(goal), 0), -1)


def test_a_field_settled_in_parts_or_repaired_equals_a_new_one() -> None:
    walls = np.zeros((60, 60), dtype=bool)
    walls[:50, 30] = True
    rng = np.random.default_rng(5)
    robot = Robot(footprint=FOOTPRINTS["square"], drive="ackermann", turn_radius=2.0)
    scene = Scene(Grid(walls), start_pose=(5.5, 5.5, 0.0), goal_pose=(55.5, 5.5, 0.0), robot=robot)
    lattice = lattice_for(scene, LatticePlanner())
    lattice_map = LatticeMap(scene.grid, lattice)
    goal, near, far = (lattice_map.index(cell) for cell in ((55, 54), (52, 54), (5, 5)))
    field = LowField(lattice_map, [goal])
    field.costs([near])
    part = field.settled
    field.costs([far])
    whole = field.settled
    assert part < whole
    kept = 0
    for _ in range(12):
        x, y = rng.integers(0, 40, 2).tolist()
        walls = walls.copy()
        walls[y, x] ^= True
        lattice_map = LatticeMap(Grid(walls), lattice)
        before = field.settled
        assert field.repaired(lattice_map, [(x, y)])
        costs = field.costs([far])
        fresh = LowField(lattice_map, [goal])
        known = fresh.costs([far])
        assert costs[far] == known[far]
        both = (field.by >= 0) & (fresh.by >= 0)
        assert both.any()
        assert (costs[both] == known[both]).all()
        kept += fresh.settled - (field.settled - before)
    assert kept > 0.2 * 12 * fresh.settled, "repairing saves work"
    assert not field.repaired(lattice_map, [(55, 54)]), "nothing is left next to the goal"


@pytest.mark.nightly
def test_the_search_expands_fewer_states_than_the_lattice_in_the_open() -> None:
    """Both counts of the same questions, added up."""
    for drive in DRIVES:
        robot = Robot(
            drive=drive, footprint=FOOTPRINTS["car"], turn_radius=3.0 if drive == "ackermann" else 0.0
        )
        rng = np.random.default_rng(4)
        theirs = ours = 0
        for _ in range(6):
            walls = rng.random((120, 120)) < 0.002
            ends = [(*rng.uniform(5, 115, 2).tolist(), float(rng.uniform(-3, 3))) for _ in range(2)]
            scene = Scene(Grid(walls), start_pose=ends[0], goal_pose=ends[1], robot=robot)
            full = LatticePlanner(weight=1.6, shortcut=False).open(scene, np.random.default_rng(0)).plan()
            plan = planned(scene, weight=1.6)
            assert plan.status is full.status
            theirs, ours = theirs + full.expansions, ours + plan.expansions
            assert plan.expansions == sum(
                one.low_expansions + one.high_expansions + one.tracking_expansions for one in plan.rounds
            )
        assert ours < 0.85 * theirs


def test_an_omnidirectional_robot_in_the_open_needs_no_sphere_but_at_the_ends() -> None:
    scene = Scene(
        Grid(np.zeros((80, 80), dtype=bool)), start_pose=(9.5, 9.5, 2.0), goal_pose=(70.5, 33.5, 0.0),
        robot=Robot(drive="omnidirectional", footprint=FOOTPRINTS["square"]),
    )  # fmt: skip
    for weight in (1.05, 1.5):
        plan = planned(scene, weight=weight)
        assert plan.status is Status.FOUND
        for one in plan.rounds:
            for cell, radius in one.spheres:
                assert any(math.dist(cell, end) <= radius for end in (scene.start, scene.goal))


def test_spheres_grow_where_they_are_too_small() -> None:
    """A dead end as wide as the robot: cells lead through its mouth, and only backing out of it turns the robot."""
    walls = np.zeros((40, 40), dtype=bool)
    walls[18:23, :25] = True
    walls[19:22, :25] = False
    scene = Scene(
        Grid(walls), start_pose=(4.5, 19.5, math.pi), goal_pose=(35.5, 30.5, 0.0),
        robot=Robot(drive="ackermann", footprint=FOOTPRINTS["car"], turn_radius=3.0),
    )  # fmt: skip
    plan = planned(scene, weight=1.0, sphere_radius=2.0)
    exact = LatticePlanner(weight=1.0, shortcut=False).open(scene, np.random.default_rng(0)).plan()
    assert plan.pose_path is not None
    assert exact.pose_path is not None
    assert plan.pose_path.cost_m == pytest.approx(exact.pose_path.cost_m, rel=1e-12)
    bounds = [one.lower_bound_m for one in plan.rounds]
    assert bounds == sorted(bounds)
    # A corridor with two bends in which the robot backs, far from both ends and from their spheres.
    walls = np.zeros((40, 160), dtype=bool)
    walls[:, 60:100] = True
    walls[10:14, 60:80] = walls[10:20, 78:82] = walls[16:20, 78:100] = False
    scene = replace(
        scene,
        grid=Grid(walls),
        start=None,
        goal=None,
        start_pose=(8.5, 29.5, 0.0),
        goal_pose=(150.5, 23.5, 0.0),
    )
    exact = LatticePlanner(weight=1.0, shortcut=False).open(scene, np.random.default_rng(0)).plan()
    plan = planned(scene, weight=1.05, sphere_radius=2.0)
    assert plan.pose_path is not None
    assert exact.pose_path is not None
    assert plan.pose_path.cost_m <= 1.05 * exact.pose_path.cost_m * (1 + 1e-9)
    assert plan.pose_path.reversals > 0
    assert len(plan.rounds) > 2
    between = [radius for (x, _), radius in plan.rounds[-1].spheres if 60 <= x < 100]
    assert max(between) > 2.0
    assert len(between) > 2
    bounds = [one.lower_bound_m for one in plan.rounds]
    assert bounds == sorted(bounds)


def test_walls_around_a_goal_add_to_the_bound() -> None:
    """The goal faces the mouth of a dead end as wide as the robot, so that it is backed into."""
    walls = np.zeros((24, 34), dtype=bool)
    walls[10:15, 20:] = True
    walls[11:14, 20:] = False
    robot = Robot(drive="ackermann", footprint=FOOTPRINTS["car"], turn_radius=3.0)
    scene = Scene(Grid(walls), start_pose=(4.5, 4.5, 0.0), goal_pose=(28.5, 11.5, math.pi), robot=robot)
    session = PadPlanner(weight=1.1).open(scene, np.random.default_rng(0))
    lattice_map = session.lattice_map
    lattice = lattice_map.lattice
    ((goal_cell, heading),) = session.goals(lattice_map)
    goal_state = (lattice_map.index(goal_cell), heading)
    costs = LowField(lattice_map, [goal_state[0]]).costs([lattice_map.index((4, 19))])
    without = goal_of([goal_state], open_space_of(lattice, FAR), lattice_map, costs)
    back: dict[int, list[Motion]] = {k: [] for k in range(16)}
    for start, motions in motions_of(lattice).items():
        for dx, dy, end, cost, swept in motions:
            back[end].append((-dx, -dy, start, cost, tuple((a - dx, b - dy) for a, b in swept)))
    least = least_costs(walls.tolist(), back, [(*goal_cell, heading)])
    exact = []
    for limit in (5, 200, MANY):
        goal, expanded = with_walls(without, lattice_map, costs, limit)
        assert 0 < expanded <= limit
        assert goal.entry >= without.entry
        known = [
            (goal.at_least((index, h), lattice_map.stride, int(costs[index])), cost)
            for (x, y, h), cost in least.items()
            for index in [lattice_map.index((x, y))]
        ]
        assert all(low <= cost for low, cost in known)
        exact.append(sum(low == cost for low, cost in known))
    assert exact == sorted(exact)
    assert exact[-1] > 100
    assert goal.entry > without.entry
    assert planned(scene, weight=1.1)


def test_the_same_question_has_the_same_answer() -> None:
    for seed in range(4):
        scene = scene_of(seed, DRIVES[seed % 3], FOOTPRINTS["car"], side=20)
        first, second = (planned(scene, weight=1.2) for _ in range(2))
        assert first == second
        assert first.rounds == second.rounds


@pytest.mark.parametrize("shortcut", [False, True])
def test_sessions_that_see_changes_answer_as_fresh_ones_do(shortcut: bool) -> None:
    """Status and bound, whatever spheres, tunnels and costs are kept; and the path is good on the map as it is.

    With shortcuts both planners begin and end at the poses themselves.
    """
    statuses = set()
    for seed in range(3):
        rng = np.random.default_rng(seed)
        scene = scene_of(seed, DRIVES[seed], FOOTPRINTS["car"], side=26)
        session = PadPlanner(weight=1.3, shortcut=shortcut).open(scene, np.random.default_rng(0))
        session.plan()
        now, at = scene, None
        for _ in range(14):
            cells = [tuple(one) for one in rng.integers(0, 26, (int(rng.integers(0, 7)), 2)).tolist()]
            blocked = tuple(
                c for c in cells if not now.grid.blocked[c[1], c[0]] and c not in (now.start, now.goal)
            )
            freed = tuple(c for c in cells if now.grid.blocked[c[1], c[0]])
            walls = now.grid.blocked.copy()
            for x, y in blocked:
                walls[y, x] = True
            for x, y in freed:
                walls[y, x] = False
            if rng.random() < 0.4:
                free = np.argwhere(~walls)
                y, x = free[int(rng.integers(len(free)))].tolist()
                at = (x, y)
            obstacles = frozenset(
                tuple(one) for one in rng.integers(0, 26, (int(rng.integers(0, 3)), 2)).tolist()
            )
            now = Scene(
                Grid(walls), start_pose=scene.start_pose, goal_pose=scene.goal_pose, robot=scene.robot
            )
            answer = session.plan(Change(robot=at, blocked=blocked, freed=freed, obstacles=obstacles))
            fresh = (
                LatticePlanner(weight=1.0, shortcut=shortcut)
                .open(now, np.random.default_rng(0))
                .plan(Change(at, obstacles))
            )
            assert answer.status is fresh.status
            statuses.add(answer.status)
            if answer.pose_path is not None and fresh.pose_path is not None:
                least, cost = (
                    one.attributes.get("lattice_cost", one.pose_path.cost_m) for one in (fresh, answer)
                )
                some = 1e-6 if shortcut else 1e-9  # costs of curves are rounded
                assert cost <= 1.3 * least * (1 + some)
                assert answer.pose_path.cost_m <= 1.3 * least * (1 + 1e-9)
                assert answer.pose_path.lower_bound_m <= least * (1 + some)
                assert answer.pose_path.bound <= 1.3 * (1 + 1e-9)
                seen = walls.copy()
                for x, y in obstacles - {at or now.start, now.goal}:
                    seen[y, x] = True
                start = (*now.grid.to_metres(at).tolist(), 0.0) if at is not None else now.start_pose
                if at is None:
                    judged = Scene(Grid(seen), start_pose=start, goal_pose=now.goal_pose, robot=now.robot)
                    assert check_plan(answer, judged) is None
    assert Status.FOUND in statuses
    assert len(statuses) > 1


def test_a_change_far_from_the_path_is_answered_from_the_old_tunnel() -> None:
    scene = Scene(
        Grid(np.zeros((70, 70), dtype=bool)), start_pose=(9.5, 9.5, 0.0), goal_pose=(60.5, 9.5, 0.0),
        robot=Robot(footprint=FOOTPRINTS["car"]),
    )  # fmt: skip
    session = PadPlanner(weight=1.2, shortcut=False).open(scene, np.random.default_rng(0))
    first = session.plan()
    again = session.plan(Change(blocked=((30, 5),)))
    assert again.pose_path == first.pose_path
    assert len(again.rounds) == 1
    assert again.rounds[0].planned == ()
    assert again.rounds[0].tracked


@pytest.mark.nightly
def test_budgets_stop_it() -> None:
    walls = np.zeros((60, 60), dtype=bool)
    walls[10:, 30] = True
    scene = Scene(
        Grid(walls), start_pose=(9.5, 50.5, 0.0), goal_pose=(50.5, 50.5, 2.0),
        robot=Robot(footprint=FOOTPRINTS["car"], drive="ackermann", turn_radius=3.0),
    )  # fmt: skip
    assert planned(scene, Budget(expansions=3)).status is Status.LIMIT
    whole = planned(scene, weight=1.02)
    statuses = set()
    for share in (0.05, 0.3, 0.6, 0.9):
        most = int(whole.expansions * share)
        plan = planned(scene, Budget(expansions=most), weight=1.02)
        assert plan.expansions <= most
        statuses.add(plan.status)
        if plan.bound is not None:
            assert plan.bound > 1.02
            assert "budget" in plan.detail
    assert statuses <= {Status.LIMIT, Status.FOUND}
    stop = CancelToken()
    stop.set()
    assert lampyris.plan(scene, "pad", budget=Budget(stop=stop)).status is Status.CANCELLED
    session = PadPlanner(shortcut=False).open(scene, np.random.default_rng(0))
    assert session.plan(None, Budget(stop=stop)).status is Status.CANCELLED
    assert session.plan() == planned(scene)


def test_settings_and_memory_are_refused_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    for wrong in (
        {"sphere_radius": 0.0},
        {"sphere_growth": 1.0},
        {"tunnel": -1.0},
        {"headings": 17},
        {"weight": 0.5},
    ):
        with pytest.raises(SettingError, match=next(iter(wrong))):
            PadPlanner(**wrong)  # type: ignore[arg-type]
    scene = Scene(
        Grid(np.zeros((300, 300), dtype=bool)), start_pose=(9.5, 50.5, 0.0), goal_pose=(50.5, 50.5, 2.0)
    )
    monkeypatch.setenv("LAMPYRIS_MAX_MEMORY", "50")
    assert LatticePlanner().open(scene, np.random.default_rng(0)).plan()
    with pytest.raises(LimitError, match="planning with pad"):
        planned(scene)


@pytest.mark.nightly
def test_tables_of_open_space_are_the_lattices_costs() -> None:
    for drive in DRIVES:
        robot = Robot(drive=drive, footprint=FOOTPRINTS["square"], turn_radius=2.0)
        side = 41
        scene = Scene(Grid(np.zeros((side, side), dtype=bool)), (20, 20), (20, 20), robot=robot)
        lattice = lattice_for(scene, LatticePlanner())
        table = open_space_of(lattice)
        assert table.half <= 20
        motions = {k: [(*one[:4], ()) for one in of] for k, of in motions_of(lattice).items()}
        rng = np.random.default_rng(1)
        for k in (1, 6, 15):
            grid = np.zeros((2 * table.half + 1,) * 2, dtype=bool).tolist()
            best = least_costs(grid, motions, [(table.half, table.half, k)])
            for x, y, h in rng.integers(0, (2 * table.half + 1, 2 * table.half + 1, 16), (60, 3)).tolist():
                least = best.get((x, y, h), NEVER)
                assert table.cost[k, y, x, h] == least
                assert table.to(h)[2 * table.half - y, 2 * table.half - x, k] == least


def test_spheres_and_tunnels() -> None:
    lattice_map = LatticeSession(
        LatticePlanner(),
        Scene(Grid(np.zeros((20, 30), dtype=bool)), (3, 3), (25, 9), robot=Robot(radius=0.3)),
    ).lattice_map
    spheres = Spheres(3.0, 2.0)
    spheres.add_or_grow((5, 5))
    spheres.add_or_grow((6, 5))
    spheres.add_or_grow((20, 5))
    assert spheres.all == [Sphere((5, 5), 6.0), Sphere((20, 5), 3.0)]
    inside = np.zeros(lattice_map.walls.size, dtype=np.uint8)
    spheres.mark(inside, lattice_map)
    for x in range(30):
        for y in range(20):
            held = any(one.holds((x, y)) for one in spheres.all)
            assert inside[lattice_map.index((x, y))] == held
    assert inside.sum() == sum(
        any(one.holds((x, y)) for one in spheres.all) for x in range(30) for y in range(20)
    )
    path = [(4, 10), (6, 10), (8, 11), (10, 12), (12, 12)]
    tunnel = Tunnel(path, 3.5, lattice_map, [Sphere((20, 4), 2.0)])
    for x in range(30):
        for y in range(20):
            away = [math.dist((x, y), place) for place in path]
            index = lattice_map.index((x, y))
            assert (index in tunnel) == (min(away) <= 3.5 or Sphere((20, 4), 2.0).holds((x, y)))
            if min(away) <= 3.5:
                place = int(tunnel.place_of([index])[0])
                assert away[place] == min(away)
    assert int(tunnel.place_of([lattice_map.index((20, 4))])[0]) == 4
