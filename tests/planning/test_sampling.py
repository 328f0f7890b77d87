"""Planners that sample: complete on small maps, towards the any-angle optimum, the same bytes from the same seed."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from query_checks import NAMES

import lampyris
from lampyris._core.cancellation import CancelToken
from lampyris.errors import SettingError
from lampyris.kernels.graph.any_angle import CUT, TOUCH, WIDE, sees
from lampyris.kernels.sampling import batch, draws, growth
from lampyris.kernels.sampling.buckets import around, around_improvable, file_node
from lampyris.kernels.sampling.lines import line_free
from lampyris.kernels.sampling.nearest import nearest, node_at, put_node
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.base import Budget
from lampyris.planning.sampling import trees
from lampyris.planning.sampling.ground import SamplingMap
from lampyris.planning.sampling.trees import Query
from lampyris.referee import check_plan
from lampyris.referee.plans.any_angle import line_meets
from lampyris.testing import check_planner
from lampyris_selfcheck.reference.paths.any_angle import all_lines, shortest
from lampyris_selfcheck.reference.paths.search import distances
from reference.kernel_forms import use

STARS = ("rrt-star", "informed-rrt-star", "bit-star")
ALL = ("rrt", "rrt-connect", *STARS)
FEW = {"samples": 1200}


def plan_of(name: str, scene: Scene, seed: int = 0, *, record: bool = False, **settings: object) -> Plan:
    session = registry.make(name, settings).open(scene, np.random.default_rng(seed), record=record)
    plan = session.plan()
    assert check_plan(plan, scene) is None
    return plan


def walled(seed: int = 3, size: int = 30) -> Scene:
    walls = np.random.default_rng(seed).random((size, size)) < 0.15
    walls[0, 0] = walls[-1, -1] = False
    return Scene(Grid(walls), (0, 0), (size - 1, size - 1))


# ---- what they find -----------------------------------------------------------------------------


@pytest.mark.nightly
@pytest.mark.parametrize("name", ALL)
def test_the_contract(name: str) -> None:
    check_planner(name, cases=3)


@pytest.mark.parametrize("name", ALL)
def test_small_maps_are_solved_or_proven_to_have_no_path(name: str) -> None:
    """With samples for every cell, the answer is that of an exhaustive search; stars come near the shortest lines."""
    rng = np.random.default_rng([281, ALL.index(name)])
    words: Counter[str] = Counter()
    for case in range(6):
        walls = rng.random(rng.integers(4, 7, 2)) < rng.choice([0.2, 0.35])
        free = [(int(x), int(y)) for y, x in np.argwhere(~walls)]
        blocked = {(int(x), int(y)) for y, x in np.argwhere(walls)}
        moves = NAMES[case % len(NAMES)]
        start, goal = (free[int(k)] for k in rng.integers(len(free), size=2))
        reached = distances((~walls).tolist(), moves, goal)
        scene = Scene(Grid(walls), start, goal, moves)
        plan = plan_of(name, scene, case, **FEW)
        assert plan.status == ("found" if start in reached else "no-path")
        words[plan.status] += 1
        if plan and name in STARS:
            least = shortest(set(free), all_lines(set(free), blocked, MOVES[moves].corner_cutting), start)[
                goal
            ]
            assert plan.any_angle_length is not None
            assert least - 1e-9 <= plan.any_angle_length <= least * 1.0001
    assert words["found"] >= 2


@pytest.mark.nightly
@pytest.mark.parametrize("name", STARS)
def test_lengths_tend_to_the_shortest_without_shortcuts_and_ancestors(name: str) -> None:
    """All pairs of cells are tried again and again, so that the tree itself ends at the optimum."""
    rng = np.random.default_rng(282)
    for case in range(20):
        walls = rng.random((9, 9)) < 0.25
        walls[0, 0] = walls[8, 8] = False
        free = {(int(x), int(y)) for y, x in np.argwhere(~walls)}
        blocked = {(int(x), int(y)) for y, x in np.argwhere(walls)}
        best = shortest(free, all_lines(free, blocked, MOVES["octile"].corner_cutting), (0, 0))
        scene = Scene(Grid(walls), (0, 0), (8, 8))
        plan = plan_of(name, scene, case, samples=60_000, shortcut=False, ancestors=0)
        assert bool(plan) == ((8, 8) in best)
        if plan:
            assert plan.any_angle_length == pytest.approx(best[8, 8], abs=1e-6)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("radius", [0.0, 1.2])
def test_an_open_map_is_crossed_straight(name: str, radius: float) -> None:
    scene = Scene(Grid(np.zeros((20, 30), dtype=bool)), (1, 1), (28, 9), robot=Robot(radius=radius))
    plan = plan_of(name, scene, **FEW)
    assert plan.waypoints is not None
    assert plan.waypoints.tolist() == [[1, 1], [28, 9]]
    here = plan_of(name, replace(scene, goal=scene.start))
    assert here.waypoints is not None
    assert here.waypoints.tolist() == [[1, 1]]


@pytest.mark.parametrize("name", ALL)
def test_discs_keep_their_room(name: str) -> None:
    """The referee judges every line of a disc among random walls."""
    scene = walled(5, 34)
    walls = scene.grid.blocked & (np.random.default_rng(1).random((34, 34)) < 0.15)
    walls[:4, :4] = walls[-4:, -4:] = False
    wide = replace(scene, grid=Grid(walls), start=(1, 1), goal=(32, 32), robot=Robot(radius=1.1))
    assert plan_of(name, wide, samples=4000)


@pytest.mark.parametrize("name", ALL)
def test_moving_obstacles_and_map_changes(name: str) -> None:
    walls = np.zeros((9, 12), dtype=bool)
    walls[:, 6] = True
    walls[4, 6] = False
    scene = Scene(Grid(walls), (1, 4), (10, 4))
    session = registry.make(name, FEW).open(scene, np.random.default_rng(0))
    assert session.plan()
    assert session.plan(Change(obstacles=frozenset({(6, 4)}))).status is Status.HEMMED_IN
    shut = session.plan(Change(blocked=frozenset({(6, 4)})))
    assert (shut.status, shut.sentence.count("regions") + shut.sentence.count("region") > 0) == (
        Status.NO_PATH,
        True,
    )
    assert session.plan(Change(freed=frozenset({(6, 0)})))


# ---- records, budgets, seeds --------------------------------------------------------------------


@pytest.mark.parametrize("name", STARS)
def test_the_record_never_rises_and_the_tree_is_free(name: str) -> None:
    scene = walled()
    plan = plan_of(name, scene, record=True, samples=3000)
    assert len(plan.best_by_iteration) == plan.iterations == 30
    assert all(a >= b for a, b in zip(plan.best_by_iteration, plan.best_by_iteration[1:], strict=False))
    assert plan.any_angle_length is not None
    assert plan.any_angle_length <= plan.best_by_iteration[-1] + 1e-9
    assert plan.tree is not None
    assert len(plan.tree) > 50
    for x0, y0, x1, y1 in plan.tree[::7].astype(int).tolist():
        assert line_meets(scene.grid.blocked, (x0, y0), (x1, y1), scene) is None
    assert plan_of(name, scene, samples=300).tree is None


@pytest.mark.parametrize("name", ALL)
def test_same_seed_same_bytes(name: str) -> None:
    scene = walled()
    first, second = (plan_of(name, scene, seed=4, record=True, samples=2000) for _ in range(2))
    assert first == second
    tried = [plan_of(name, scene, seed=k, samples=2000) for k in range(3)]
    assert len({one.waypoints.tobytes() for one in tried if one.waypoints is not None}) > 1 or name in STARS


@pytest.mark.parametrize("name", ALL)
def test_both_forms_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = walled(6, 16)
    plans = []
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        plans.append(plan_of(name, scene, record=True, samples=400))
    assert plans[0] == plans[1]


@pytest.mark.parametrize(
    ("chain", "turns"),
    [
        ([(2, 3), (5, 3), (9, 3), (5, 3), (5, 8)], [(2, 3), (5, 3), (5, 8)]),  # there and back along one line
        ([(2, 3), (4, 3), (6, 5), (9, 8), (6, 5), (4, 3), (4, 6)], [(2, 3), (4, 3), (4, 6)]),  # along two
        ([(2, 3), (6, 3), (4, 3), (9, 3)], [(2, 3), (9, 3)]),  # back, and on
        ([(2, 3), (6, 3), (0, 3), (0, 4)], [(2, 3), (0, 3), (0, 4)]),  # back beyond its beginning
    ],
)
def test_a_path_does_not_go_back_along_its_own_line(
    chain: list[tuple[int, int]], turns: list[tuple[int, int]]
) -> None:
    """Two trees of rrt-connect met on random512-10-0 at a node that both came to by one line: a waypoint followed itself."""
    ground = SamplingMap(np.ones((12, 12), dtype=bool), MOVES["octile"], wide=False)
    lines = ground.lines(np.array([ground.flat(cell) for cell in chain], dtype=np.int32), shorter=False)
    assert [tuple(cell) for cell in lines.turns.tolist()] == turns
    steps = np.abs(np.diff(lines.walk, axis=0)).max(axis=1)
    assert steps.tolist() == [1] * sum(
        max(abs(a - c), abs(b - d)) for (a, b), (c, d) in itertools.pairwise(turns)
    )


def test_a_seeded_search_begins_with_the_walk_pulled_straight() -> None:
    for seed in (3, 5):
        scene = walled(seed, 8)
        walk = plan_of("dijkstra", scene)
        plan = plan_of("bit-star", scene, record=True, seeded=True, samples=20, batch=10)
        assert plan.best_by_iteration[0] <= walk.cost + 1e-9
        free = {(int(x), int(y)) for y, x in np.argwhere(~scene.grid.blocked)}
        blocked = {(int(x), int(y)) for y, x in np.argwhere(scene.grid.blocked)}
        least = shortest(free, all_lines(free, blocked, False), scene.start)[scene.goal]
        assert plan.any_angle_length >= least - 1e-9
        assert plan_of("bit-star", scene, seeded=True, samples=3000).any_angle_length <= least * 1.0001
    scene = walled(5, 14)
    session = registry.make("bit-star", {"seeded": True}).open(scene, np.random.default_rng(0))
    assert session.plan(budget=Budget(expansions=5)).status is Status.LIMIT
    around = [(scene.goal[0] - 1, scene.goal[1]), (scene.goal[0], scene.goal[1] - 1), (12, 12)]
    assert not session.plan(Change(obstacles=around))
    assert check_plan(session.plan(Change()), scene) is None


def test_draws_near_the_path_are_free_cells_around_it_and_all_of_them() -> None:
    free = np.ones(40 * 40, dtype=np.uint8)
    walls = np.array([20 * 40 + 18, 22 * 40 + 23, 12 * 40 + 28])
    free[walls] = 0
    cells, trail = np.flatnonzero(free).astype(np.int32), np.array([20 * 40 + 20, 0], dtype=np.int32)
    count, whole = np.zeros(1, dtype=np.int64), np.zeros(16, dtype=np.int64)
    whole[[draws.STRIDE, draws.KEY, draws.NEAR]] = 40, 9, 2**32
    met = {draws.drawn_cell(free, cells, cells[:0], trail, whole, 99.0, count, 0) for _ in range(20_000)}
    around = {(x, y) for a in (0, 20) for x in range(a - 8, a + 9) for y in range(a - 8, a + 9)}
    expected = {y * 40 + x for x, y in around if x >= 0 and y >= 0} - set(walls.tolist())
    assert met == expected | {-1}
    counted = Counter(
        draws.drawn_cell(free, cells, cells[:0], trail[:1], whole, 99.0, count, 0) for _ in range(4000)
    )
    assert counted[20 * 40 + 20] > 5 * counted[28 * 40 + 28]  # nearer cells more often


@pytest.mark.parametrize("name", STARS)
def test_a_search_without_a_path_goes_on_from_a_walk_of_the_grid(name: str) -> None:
    wall = np.zeros((60, 60), dtype=bool)
    wall[:, 6:58:4] = True
    for k, x in enumerate(range(6, 58, 4)):
        wall[3 + 50 * (k % 2), x] = False  # doors at the far ends by turns
    scene = Scene(Grid(wall), (1, 1), (58, 30))
    few = {"samples": 400, "batch": 20, "narrow": 0.0}
    alone = plan_of(name, scene, record=True, seed_after=None, **few)
    assert alone.status is Status.ITERATION_LIMIT
    plan = plan_of(name, scene, record=True, seed_after=100, **few)
    walk = plan_of("dijkstra", scene)
    assert plan.best_by_iteration[:5] == (math.inf,) * 5
    assert plan.best_by_iteration[5] <= walk.cost + 1e-9
    assert plan.expansions > 400  # those of A* count
    assert "went on from" in plan.notes[0]
    best = plan_of("visibility-graph", scene).any_angle_length
    assert best - 1e-9 <= plan.any_angle_length <= 1.02 * best
    closed = registry.make(name, {"seed_after": 100, **few}).open(scene, np.random.default_rng(0))
    assert closed.plan(budget=Budget(expansions=150)).status is Status.LIMIT  # too few for A*


@pytest.mark.parametrize("name", STARS)
def test_a_search_with_a_long_path_goes_on_from_a_shorter_walk_of_the_grid(name: str) -> None:
    # bit-star on warehouse-1024: where it met a path by chance, it was still 9 % too long after 2 s; without one A* helped.
    wall = np.zeros((60, 60), dtype=bool)
    wall[:50, 25:36] = True
    wall[30, 25:36] = (
        False  # a short way through a passage one cell wide, a long one around the end of the wall
    )
    scene = Scene(Grid(wall), (10, 12), (50, 12))
    few = {"samples": 400, "batch": 20, "narrow": 0.0, "near_path": 0.0, "record": True}
    best = plan_of("visibility-graph", scene).any_angle_length
    alone = {s: plan_of(name, scene, s, seed_after=None, **few) for s in range(4)}
    long = [s for s, plan in alone.items() if 1.5 * best < plan.best_by_iteration[-1] < math.inf]
    assert long
    for seed in long:
        plan = plan_of(name, scene, seed, seed_after=200, **few)
        assert plan.best_by_iteration[:10] == alone[seed].best_by_iteration[:10]
        assert best - 1e-9 <= plan.best_by_iteration[10] <= 1.02 * best
        assert "a longer path after 200 samples" in plan.notes[0]


@pytest.mark.parametrize("name", STARS)
def test_a_seeded_search_has_room_for_the_walk_besides_its_samples(name: str) -> None:
    # bit-star wrote past the end of its arrays where the turns of the walk and all samples were more than the samples.
    ground = SamplingMap(np.ones((99, 99), dtype=bool), MOVES["octile"], wide=False)
    planner = registry.make(name, {})
    ends = ground.flat((0, 0)), ground.flat((98, 98))
    room = Query(ground, *ends, key=5, samples=50, step=9.0, narrow=0.1, near=0.5, seeded=True).room()
    assert room >= 102
    seeded = Query(ground, *ends, key=5, samples=50, step=9.0, narrow=0.1, near=0.0, seeded=True)
    search = planner.begin(seeded)
    turns = [(0, 0), *((k, k % 2) for k in range(1, 49)), (98, 98)]
    search.go_on_from(np.array([ground.flat(cell) for cell in turns], dtype=np.int32))
    search.run(50)
    cells = {(int(x), int(y)) for x, y in search.edges()[:, :2]}
    assert len(cells) > 50
    assert all(0 <= x - ground.flat((0, 0)) % ground.stride < 99 for x, _ in cells)


def test_samples_run_out_where_there_is_a_path() -> None:
    plan = plan_of("rrt", walled(), samples=3, goal_bias=0.0)
    assert (plan.status, plan.expansions) == (Status.ITERATION_LIMIT, 3)
    assert "There is one" in plan.sentence


@pytest.mark.parametrize("name", ALL)
def test_budgets_and_stops(name: str) -> None:
    scene = walled()
    session = registry.make(name, {}).open(scene, np.random.default_rng(0))
    few = session.plan(None, Budget(expansions=2))
    assert few.status is Status.LIMIT
    assert few.expansions <= 2
    stop = CancelToken()
    stop.set()
    assert session.plan(None, Budget(stop=stop)).status is Status.CANCELLED
    some = session.plan(None, Budget(expansions=5000))
    assert some
    assert some.expansions <= 5000
    if name in STARS:
        assert "budget" in some.sentence


def test_a_time_limit_ends_it_with_the_best_path() -> None:
    session = registry.make("rrt-star", {"samples": 10_000_000}).open(walled(), np.random.default_rng(0))
    plan = session.plan(None, Budget(seconds=0.4))
    assert plan.status in (Status.FOUND, Status.LIMIT)
    if plan:
        assert plan.sentence == "Stopped improving at the time limit."


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("rrt", {"goal_bias": 1.5}),
        ("rrt-connect", {"step": 1.0}),
        ("rrt-star", {"ancestors": -1}),
        ("bit-star", {"batch": 0}),
    ],
)
def test_wrong_settings_are_named(name: str, wrong: dict[str, object]) -> None:
    with pytest.raises(SettingError, match=next(iter(wrong))):
        registry.make(name, wrong)


# ---- parts ----------------------------------------------------------------------------------------


def test_the_nearest_node_and_those_around() -> None:
    rng = np.random.default_rng(283)
    n = 200
    cells = np.unique(rng.integers(0, 60, (n, 2)), axis=0).astype(np.int32)
    cells = cells[rng.permutation(len(cells))]
    x, y = cells[:, 0].copy(), cells[:, 1].copy()
    n = len(cells)
    sides, stack = np.empty(2 * n, dtype=np.int32), np.empty(2 * n, dtype=np.int64)
    bucket, link = np.zeros(64, dtype=np.int32), np.zeros(n, dtype=np.int32)
    for k in range(n):
        put_node(sides, x, y, 0, k)
        file_node(bucket, link, 8, 1, int(x[k]), int(y[k]), k)
    near = np.zeros(n, dtype=np.int32)
    for _ in range(60):
        px, py = (int(v) for v in rng.integers(0, 60, 2))
        d = (x.astype(int) - px) ** 2 + (y.astype(int) - py) ** 2
        assert d[nearest(sides, x, y, 0, px, py, stack)] == d.min()
        assert (node_at(sides, x, y, 0, px, py) >= 0) == (d.min() == 0)
        radius = float(rng.uniform(1, 20))
        many = around(bucket, link, 8, 8, 1, x, y, px, py, radius, near)
        found = near[:many].tolist()
        assert sorted(found) == np.flatnonzero((d > 0) & (d <= radius * radius)).tolist()
        cost = np.where(rng.random(n) < 0.2, np.inf, rng.uniform(0, 90, n))
        spent = float(rng.uniform(0, 90))
        falls = spent + np.sqrt(d) < cost
        rows = (bucket, link, 8, 8, 1, x, y, cost, px, py, radius)
        many = around_improvable(*rows, spent, near)
        some = near[:many].tolist()
        assert some == [k for k in found if k in some]  # in the same order
        assert {k for k in found if falls[k]} <= set(some) <= {k for k in found if cost[k] > spent}
        assert len(some) <= sum(falls[found]) + 1
        many = around_improvable(*rows, -math.inf, near)
        assert near[:many].tolist() == found


@pytest.mark.parametrize("name", ["rrt-star", "bit-star"])
def test_more_batches_are_foreseen_unless_the_first_path_may_be_straight(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel: Any = growth.grow if name == "rrt-star" else batch.search_batch
    asked: list[int] = []
    monkeypatch.setattr(kernel, "expect", lambda calls, *given: asked.append(calls))
    plan_of(name, Scene(Grid(np.zeros((20, 20), dtype=bool)), (0, 0), (19, 7)), samples=1000)
    assert 10 not in asked  # not before the first batch
    asked.clear()
    plan_of(name, walled(4), samples=1000)
    assert asked == [10, 9, 8, 7, 6, 5, 4, 3, 2, 1]


def test_lines_that_are_known_to_be_blocked_are_not_checked_again(monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = [walled(seed, 70) for seed in (3, 5, 7)]
    lines: list[int] = []
    run = trees.BatchSearch.run

    def noted(self: trees.BatchSearch, samples: int) -> None:
        run(self, samples)
        lines.append(self.lines)

    monkeypatch.setattr(trees.BatchSearch, "run", noted)
    plans, checked = [], []
    for places in (1, trees.BLOCKED):
        monkeypatch.setattr(trees, "BLOCKED", places)
        lines.clear()
        plans.append([plan_of("bit-star", scene, seed=8, record=True, samples=6000) for scene in scenes])
        checked.append(sum(lines))
    assert plans[0] == plans[1]
    assert checked[1] < 0.8 * checked[0], checked


def test_lines_looked_at_early_are_those_of_theta_star() -> None:
    rng = np.random.default_rng(284)
    even = np.zeros(1, dtype=np.uint8)
    free_lines = 0
    for _ in range(300):
        free = np.zeros((24, 30), dtype=np.uint8)
        free[1:-1, 1:-1] = rng.random((22, 28)) >= rng.choice([0.01, 0.05])
        (ax, bx), (ay, by) = rng.integers(1, 29, 2).tolist(), rng.integers(1, 23, 2).tolist()
        free[ay, ax] = free[by, bx] = 1
        flat = free.ravel()
        for rule in (CUT, TOUCH, WIDE):
            seen = sees(flat, even, 0, 30, ay * 30 + ax, ax, ay, bx, by, rule) == 1
            assert bool(line_free(flat, even, 30, ax, ay, bx, by, rule)) == seen
            free_lines += seen
    assert 100 < free_lines < 800


def test_draws_are_even_and_cells_lie_in_the_ellipse() -> None:
    bits = np.array([draws.drawn(7, k) for k in range(4000)])
    assert bits.min() >= 0
    assert bits.max() < 2**32
    for part in (bits >> 24, bits & 255):
        counts = np.bincount(part, minlength=256)
        assert (
            (counts - 4000 / 256) ** 2 / (4000 / 256)
        ).sum() < 340  # chi-square, 255 degrees of freedom: 0.9998
    free = np.ones(40 * 40, dtype=np.uint8)
    cells = np.arange(1600, dtype=np.int32)
    count, whole = np.zeros(1, dtype=np.int64), np.zeros(16, dtype=np.int64)
    whole[[draws.STRIDE, draws.KEY, draws.START, draws.GOAL]] = 40, 9, 5 + 40 * 10, 30 + 40 * 25
    none = cells[:0]
    met = Counter(draws.drawn_cell(free, cells, none, none, whole, 31.0, count, 0) for _ in range(6000))
    inside = {
        y * 40 + x
        for x in range(40)
        for y in range(40)
        if math.dist((5, 10), (x, y)) + math.dist((x, y), (30, 25)) < 31.0
    }
    met.pop(-1, None)
    assert set(met) == inside


# ---- poses ----------------------------------------------------------------------------------------

HALL = np.zeros((40, 60), dtype=bool)
HALL[:, 30:32] = True
HALL[16:26, 30:32] = False
BODY = ((0.9, 0.4), (-0.4, 0.4), (-0.4, -0.4), (0.9, -0.4))


def posed(drive: str, goal: tuple[float, float, float] = (12.0, 3.0, 1.5)) -> Scene:
    robot = Robot(footprint=BODY, drive=drive, turn_radius=1.2 if drive == "ackermann" else 0.0)
    return Scene(Grid(HALL, resolution=0.25), start_pose=(2.0, 2.0, 0.3), goal_pose=goal, robot=robot)


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("drive", ["ackermann", "differential", "omnidirectional"])
def test_footprints_are_led_through_a_door(drive: str) -> None:
    scene = posed(drive)
    plan = plan_of("pose-rrt-connect", scene, record=True, rounds=4)
    assert plan.pose_path is not None
    assert plan.pose_path.bound >= 1.0
    assert plan.tree is not None
    costs = plan.best_by_iteration
    assert all(a >= b for a, b in itertools.pairwise(costs))
    assert plan == plan_of("pose-rrt-connect", scene, record=True, rounds=4)


@pytest.mark.parametrize("drive", ["ackermann", "differential", "omnidirectional"])
def test_a_path_over_poses_costs_less_with_every_batch(drive: str) -> None:
    scene = posed(drive)
    first = plan_of("pose-rrt-connect", scene)
    plan = plan_of("pose-rrt-star", scene, record=True, rounds=3)  # two batches: too few for compiled code
    assert first.pose_path is not None
    assert plan.pose_path is not None
    assert plan.tree is not None
    assert len(plan.tree) > 0
    costs = plan.best_by_iteration
    assert len(costs) == 3
    assert all(a >= b for a, b in itertools.pairwise(costs))
    assert plan.pose_path.cost_m == pytest.approx(costs[-1] * 0.25)
    assert plan.pose_path.cost_m <= first.pose_path.cost_m + 1e-9


@pytest.mark.parametrize("goal", [(12.0, 3.0, 1.5), (11.87, 3.06, -2.9)])
def test_a_seeded_tree_of_poses_begins_with_the_path_of_the_lattice(goal: tuple[float, float, float]) -> None:
    scene = posed("ackermann", goal)
    prices = {"reverse_cost": 1.0, "shortcut": False}
    lattice = plan_of("lattice", scene, **prices).pose_path
    plan = plan_of("pose-rrt-star", scene, seeded=True, rounds=1, reverse_cost=1.0)
    assert lattice is not None
    assert plan.pose_path is not None
    searched = plan_of("lattice", scene, weight=1.5, **prices)
    assert plan.expansions == searched.expansions  # no sample was taken
    assert plan.pose_path.cost_m < 1.1 * lattice.cost_m
    for pose, asked in zip(plan.pose_path.poses[[0, -1]], (scene.start_pose, goal), strict=True):
        assert pose[:2] == pytest.approx(asked[:2], abs=1e-6)
        assert math.remainder(pose[2] - asked[2], math.tau) == pytest.approx(0.0, abs=1e-6)


def test_a_seeded_tree_of_poses_takes_edits_and_falls_back_on_two_trees() -> None:
    scene = posed("ackermann")
    session = registry.make("pose-rrt-star", {"seeded": True, "rounds": 1}).open(
        scene, np.random.default_rng(1)
    )
    seeded = session.plan().expansions
    assert seeded > 54  # two trees take 54 samples
    for most in (1, 100, seeded, seeded + 10):
        assert session.plan(budget=Budget(expansions=most)).expansions <= most
    door = tuple((30, y) for y in range(16, 26))
    assert session.plan(Change(blocked=door)).status is Status.NO_PATH
    assert session.plan(Change(freed=door)).status is Status.FOUND


@pytest.mark.nightly
@pytest.mark.parametrize("drive", ["ackermann", "differential"])
def test_many_samples_over_poses_find_what_the_lattice_does_not(drive: str) -> None:
    scene = posed(drive)
    plan, again = (plan_of("pose-rrt-star", scene, record=True, rounds=200) for _ in range(2))
    lattice = plan_of("lattice", scene)
    assert plan.pose_path is not None
    assert lattice.pose_path is not None
    assert plan == again
    assert plan.pose_path.length_m < 1.02 * lattice.pose_path.length_m


@pytest.mark.nightly
@pytest.mark.parametrize("reverse", [True, False])
@pytest.mark.parametrize("drive", ["ackermann", "differential", "omnidirectional"])
def test_footprints_among_random_walls(drive: str, reverse: bool) -> None:
    """Between poses at which the robot stands free: ends in walls are drawn again."""
    rng = np.random.default_rng(285)
    occupied = {Status.START_OCCUPIED, Status.GOAL_OCCUPIED}
    found = asked = 0
    while asked < 14:
        walls = np.kron(rng.random((8, 12)) < 0.2, np.ones((6, 6), dtype=bool))
        ends = [(*rng.uniform((1, 1), (17, 11)).tolist(), float(rng.uniform(-3, 3))) for _ in range(2)]
        grid, robot = Grid(walls, resolution=0.25), posed(drive).robot
        scene = Scene(grid, start_pose=ends[0], goal_pose=ends[1], robot=robot)
        other = plan_of("hybrid-astar", scene, reverse=reverse)
        if other.status in occupied:
            continue
        asked += 1
        plan = plan_of("pose-rrt-connect", scene, asked, samples=8000, reverse=reverse)
        assert plan.status not in occupied
        found += bool(plan)
    assert found >= 5


def test_no_path_in_a_narrow_place_is_no_lie() -> None:
    """The disc around the robot does not fit at the start, the robot does: the referee asks for no other status.

    ``hybrid-astar`` begins exactly at the start: that it were occupied is refused.
    """
    walls = np.zeros((20, 40), dtype=bool)
    walls[4:16, :20] = True
    walls[7:12, 2:20] = False
    walls[:, 30] = True
    robot = posed("ackermann").robot
    scene = Scene(
        Grid(walls, resolution=0.25), start_pose=(2.0, 2.5, 0.0), goal_pose=(9.0, 2.5, 0.0), robot=robot
    )
    for planner in ("hybrid-astar", "lattice", "pad"):
        plan = lampyris.plan(scene, planner)
        assert plan.status is Status.NO_PATH
        assert check_plan(plan, scene) is None
        occupied = check_plan(replace(plan, status=Status.START_OCCUPIED), scene)
        assert (occupied is None) == (planner != "hybrid-astar")
        walled = replace(scene, start=None, start_pose=(2.0, 3.6, 0.0))
        same = replace(scene, goal=None, goal_pose=scene.start_pose)
        for other in (walled, same):
            assert "no-path, but" in str(check_plan(plan, other))


@pytest.mark.parametrize("planner", ["hybrid-astar", "lattice"])
def test_no_path_to_near_a_goal_in_a_wall_is_no_lie(planner: str) -> None:
    """Ends of paths are within the goal's tolerance: that the goal itself is in a wall says nothing."""
    walls = np.zeros((20, 40), dtype=bool)
    walls[:, [24, 30]] = True
    ends = {"start_pose": (2.0, 2.5, 0.0), "goal_pose": (7.6, 2.5, 1.57)}
    scene = Scene(Grid(walls, resolution=0.25), robot=posed("ackermann").robot, **ends)
    plan = lampyris.plan(scene, planner, goal_tolerance=1.5)
    assert plan.status is Status.NO_PATH
    assert check_plan(plan, scene) is None


def test_an_open_end_is_not_occupied() -> None:
    scene = posed("ackermann")
    for status in (Status.START_OCCUPIED, Status.GOAL_OCCUPIED):
        assert "the robot can stand" in str(check_plan(Plan(status, "lattice"), scene))


def test_footprints_where_walls_separate_or_touch() -> None:
    shut = HALL.copy()
    shut[:, 30:32] = True
    scene = replace(posed("ackermann"), grid=Grid(shut, resolution=0.25))
    assert plan_of("pose-rrt-connect", scene, samples=600).status is Status.NO_PATH
    assert plan_of("pose-rrt-connect", posed("ackermann", (7.6, 9.0, 0.0))).status is Status.GOAL_OCCUPIED
    few = registry.make("pose-rrt-connect").open(posed("ackermann"), np.random.default_rng(0))
    assert few.plan(None, Budget(expansions=1)).status is Status.LIMIT


def test_the_lists_name_them() -> None:
    cells, poses = lampyris.list_planners(), lampyris.list_planners("poses")
    assert set(ALL) <= set(cells)
    assert "pose-rrt-connect" in poses
    assert all(cells[name].traits.stochastic and not cells[name].traits.optimal for name in ALL)
