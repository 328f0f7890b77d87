"""Theta* and lazy Theta*: lines that can be driven, from the shortest any-angle way to the shortest walk."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from query_checks import NAMES, RNG

from lampyris.errors import SettingError
from lampyris.kernels.graph.any_angle import CUT, TOUCH, WIDE
from lampyris.kernels.graph.any_angle import sees as kernel_sees
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.planning.field.layers import free_cells
from lampyris.planning.graph.astar import AStar
from lampyris.planning.graph.theta_star import LazyThetaStar, ThetaStar
from lampyris.referee import check_plan
from lampyris.referee.plans.any_angle import line_meets
from lampyris.testing import check_planner
from lampyris_selfcheck.reference.paths.any_angle import all_lines, clearance, sees, shortest
from lampyris_selfcheck.reference.paths.search import distances
from reference.kernel_forms import use
from sizes import sized

PUBLISHED = LazyThetaStar(put_back=False)
PLANNERS: list[Planner] = [ThetaStar(), LazyThetaStar(), PUBLISHED]
each = pytest.mark.parametrize("planner", PLANNERS, ids=["theta", "lazy", "lazy as published"])


def cells_where(mask: np.ndarray) -> list[tuple[int, int]]:
    return [(int(x), int(y)) for y, x in np.argwhere(mask)]


def plan_of(planner: Planner, scene: Scene) -> Plan:
    plan = planner.open(scene, RNG).plan()
    assert check_plan(plan, scene) is None
    return plan


# ---- how long ----------------------------------------------------------------------------------


@pytest.mark.nightly
@sized("cases", 1, 3)
@each
def test_the_contract(planner: Planner, cases: int) -> None:
    check_planner(planner, cases=cases)


def test_settings() -> None:
    assert LazyThetaStar() == LazyThetaStar(put_back=True) != PUBLISHED
    with pytest.raises(SettingError, match="put_back"):
        LazyThetaStar(put_back=1)  # type: ignore[arg-type]


@pytest.mark.nightly
@pytest.mark.parametrize("name", NAMES)
def test_between_the_shortest_lines_and_the_shortest_walk(name: str) -> None:
    """On maps so small that every pair of cells can be tried."""
    rng = np.random.default_rng([71, NAMES.index(name)])
    asked = shortest_found = 0
    for _ in range(14):
        walls = rng.random(rng.integers(3, 8, 2)) < rng.choice([0.1, 0.2, 0.3, 0.4])
        free = cells_where(~walls)
        if len(free) < 2:
            continue
        lines = all_lines(set(free), set(cells_where(walls)), MOVES[name].corner_cutting)
        goal = free[int(rng.integers(len(free)))]
        least = shortest(set(free), lines, goal)
        walks = distances((~walls).tolist(), name, goal)
        grid = Grid(walls)
        sessions = [p.open(Scene(grid, goal, goal, name), RNG) for p in PLANNERS]
        for start in free:
            for planner, session in zip(PLANNERS, sessions, strict=True):
                plan = session.plan(Change(robot=start))
                assert plan.status == ("found" if start in walks else "no-path")
                assert check_plan(plan, Scene(grid, start, goal, name)) is None
                if plan.waypoints is None or plan.any_angle_length is None:
                    assert not plan
                    continue
                asked += 1
                assert plan.any_angle_length >= least[start] - 1e-9
                shortest_found += plan.any_angle_length <= least[start] + 1e-9
                straight, diagonal, knight = walks[start]
                walk = straight + diagonal * math.sqrt(2) + knight * math.sqrt(5)
                # As published it may be longer than the walk: by 18 % in the worst of these.
                assert plan.any_angle_length <= walk * (1.5 if planner is PUBLISHED else 1.0) + 1e-9
    assert asked > 300
    assert shortest_found > 0.8 * asked


@each
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("radius", [0.0, 1.3])
def test_an_open_map_is_crossed_straight(planner: Planner, name: str, radius: float) -> None:
    grid = Grid(np.zeros((30, 50), dtype=bool))
    for goal in ((49, 29), (49, 0), (0, 29), (49, 7), (3, 29), (37, 28)):
        plan = plan_of(planner, Scene(grid, (0, 0), goal, name, Robot(radius=radius)))
        assert plan.waypoints is not None
        assert plan.waypoints.tolist() == [[0, 0], list(goal)]
        assert plan.any_angle_length == math.sqrt(goal[0] ** 2 + goal[1] ** 2)
    here = plan_of(planner, Scene(grid, (4, 5), (4, 5), name))
    assert here.waypoints is not None
    assert (here.waypoints.tolist(), here.any_angle_length, here.expansions) == ([[4, 5]], 0.0, 0)


@pytest.mark.commit(3)
@each
@pytest.mark.parametrize("name", NAMES)
def test_larger_maps_and_wide_robots(planner: Planner, name: str) -> None:
    rng = np.random.default_rng([72, NAMES.index(name)])
    found = saved = 0
    for _ in range(40):
        walls = rng.random(rng.integers(10, 45, 2)) < rng.choice([0.02, 0.1, 0.3])
        radius = float(rng.choice([0.0, 0.3, 0.8, 1.7, 2.5]))
        scene = Scene(
            Grid(walls), (0, 0), (walls.shape[1] - 1, walls.shape[0] - 1), name, Robot(radius=radius)
        )
        plan = plan_of(planner, scene)
        walk = AStar().open(scene, RNG).plan()
        assert plan.status == walk.status
        if plan.path is None or walk.path is None or plan.any_angle_length is None:
            continue
        found += 1
        beeline = math.dist(scene.start, scene.goal)
        assert beeline - 1e-9 <= plan.any_angle_length <= plan.path.arc[-1] + 1e-9
        longest = walk.path.arc[-1] * (1.5 if planner is PUBLISHED else 1.0)
        assert plan.any_angle_length <= longest + 1e-9
        # The walk along the lines is not much of a detour either.
        assert plan.path.arc[-1] <= 1.1 * walk.path.arc[-1] + (8 if name != "sixteen-connected" else 12)
        saved += plan.any_angle_length < walk.path.arc[-1] - 1e-9
        if plan.waypoints is not None and radius > 0:
            blocked = set(cells_where(walls))
            for begin, end in pairwise([(int(x), int(y)) for x, y in plan.waypoints]):
                near = {c for c in blocked if _apart(c, begin, end) < radius + 2}
                assert clearance(near, begin, end) >= radius - 1e-9
    assert found > 10
    assert saved > found / 3


def _apart(cell: tuple[int, int], begin: tuple[int, int], end: tuple[int, int]) -> float:
    """Distance of a cell from the box around a line."""
    gaps = [max(min(a, b) - c, c - max(a, b), 0) for c, a, b in zip(cell, begin, end, strict=True)]
    return max(gaps)


# ---- lines of sight ----------------------------------------------------------------------------


def look(free: np.ndarray, begin: tuple[int, int], end: tuple[int, int], rule: int) -> bool:
    height, width = free.shape
    padded = np.zeros((height + 2, width + 2), np.uint8)
    padded[1:-1, 1:-1] = free
    (x0, y0), (x1, y1) = begin, end
    at = (y0 + 1) * (width + 2) + x0 + 1
    weight = np.zeros(1, np.uint8)
    return bool(kernel_sees(padded.ravel(), weight, 0, width + 2, at, x0 + 1, y0 + 1, x1 + 1, y1 + 1, rule))


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_lines_of_sight_are_exact(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both rules for points, and the referee's own judgement, against fractions."""
    use(monkeypatch, form)
    rng = np.random.default_rng(73)
    seen = {CUT: 0, TOUCH: 0}
    for _ in range(220):
        walls = rng.random(rng.integers(2, 12, 2)) < rng.choice([0.05, 0.15])
        free = cells_where(~walls)
        begin, end = (free[int(rng.integers(len(free)))] for _ in range(2))
        for rule, name in ((CUT, "dissertation"), (TOUCH, "octile")):
            truth = sees(set(cells_where(walls)), begin, end, rule == CUT)
            assert look(~walls, begin, end, rule) == truth
            assert look(~walls, end, begin, rule) == truth
            wall = line_meets(walls, begin, end, Scene(Grid(walls), begin, end, name))
            assert (wall is None) == truth
            assert wall is None or walls[wall[1], wall[0]]
            seen[rule] += truth
    assert seen[CUT] >= seen[TOUCH] > 60


def test_corners() -> None:
    """Between two blocked cells, past one, and along a wall."""
    between = np.array([[True, False], [False, True]])
    assert look(between, (0, 0), (1, 1), CUT)
    assert not look(between, (0, 0), (1, 1), TOUCH)
    past = np.ones((3, 4), dtype=bool)
    past[2, 1] = False
    # From (0, 2) to (3, 1) the line runs through the side cell; from (0, 1) straight along it.
    assert not look(past, (0, 2), (3, 1), CUT)
    assert look(past, (0, 1), (3, 1), TOUCH)
    # (0, 0) to (3, 3) touches the corner of (1, 2) and (2, 1).
    diagonal = np.ones((4, 4), dtype=bool)
    diagonal[1, 2] = False
    assert look(diagonal, (0, 0), (3, 3), CUT)
    assert not look(diagonal, (0, 0), (3, 3), TOUCH)
    assert not look(diagonal, (0, 0), (3, 3), WIDE)


def test_a_line_for_a_disc_keeps_the_disc_clear() -> None:
    rng = np.random.default_rng(74)
    seen = refused = 0
    for _ in range(120):
        walls = rng.random((12, 14)) < 0.04
        radius = float(rng.choice([0.2, 0.5, 0.9, 1.4, 2.0]))
        free = free_cells(Grid(walls), radius)
        cells = cells_where(free)
        if not cells:
            continue
        begin, end = (cells[int(rng.integers(len(cells)))] for _ in range(2))
        room = clearance(set(cells_where(walls)), begin, end)
        if look(free, begin, end, WIDE):
            seen += 1
            assert room >= radius - 1e-9
        elif room >= radius:
            refused += 1
        assert look(free, begin, end, WIDE) == look(free, end, begin, WIDE)
        scene = Scene(Grid(walls), begin, end, "octile", Robot(radius=radius))
        # 400 points of the line may all miss the place where the disc just touches a wall.
        if abs(room - radius) > 0.02:
            assert (line_meets(walls, begin, end, scene) is None) == (room > radius)
    assert seen > 40
    assert refused < seen


def test_the_referee_looks_on_every_side_of_a_line() -> None:
    for wall in ((4, 2), (4, 4), (2, 4), (6, 4)):
        walls = np.zeros((9, 9), dtype=bool)
        walls[wall[1], wall[0]] = True
        for begin, end in (((0, 3), (8, 3)), ((8, 3), (0, 3)), ((3, 0), (3, 8)), ((5, 8), (5, 0))):
            off = abs(wall[1] - begin[1]) if begin[1] == end[1] else abs(wall[0] - begin[0])
            for radius in (0.4, 0.6, 1.4, 1.6):
                scene = Scene(Grid(walls), begin, end, robot=Robot(radius=radius))
                assert line_meets(walls, begin, end, scene) == (wall if off - 0.5 < radius else None)


# ---- terrain, obstacles, forms -----------------------------------------------------------------


@pytest.mark.commit(1)
@each
@pytest.mark.parametrize("name", NAMES)
def test_over_terrain_a_line_keeps_to_cells_of_one_weight(planner: Planner, name: str) -> None:
    rng = np.random.default_rng([75, NAMES.index(name)])
    found = lines = 0
    for _ in range(8):
        shape = rng.integers(6, 19, 2)
        terrain = np.kron(rng.integers(0, 3, (shape + 5) // 6) * 126, np.ones((6, 6), int))[
            : shape[0], : shape[1]
        ]
        terrain[0, 0] = 1
        walls = rng.random(shape) < 0.1
        walls[0, 0] = walls[-1, -1] = False
        grid = Grid(walls, terrain=terrain)
        scene = Scene(grid, (0, 0), (int(shape[1]) - 1, int(shape[0]) - 1), name)
        plan = plan_of(planner, scene)
        walk = AStar().open(scene, RNG).plan()
        assert plan.status == walk.status
        if plan.waypoints is None or walk.path is None or grid.terrain is None:
            continue
        found += 1
        paid = 0.0
        for begin, end in pairwise([(int(x), int(y)) for x, y in plan.waypoints]):
            weights = {
                int(grid.terrain[y, x])
                for x, y in cells_where(~walls)
                if not sees({(x, y)}, begin, end, MOVES[name].corner_cutting)
            }
            weights |= {int(grid.terrain[y, x]) for x, y in (begin, end)}
            step = (end[0] - begin[0], end[1] - begin[1]) in MOVES[name].offsets
            lines += not step
            assert len(weights) == 1 or step
            paid += math.dist(begin, end) * (63 + int(grid.terrain[end[1], end[0]])) / 63
        if planner is not PUBLISHED:
            bare = path_of(walk.path.cells, MOVES[name])
            d = np.sqrt((np.diff(bare.cells, axis=0) ** 2).sum(axis=1))
            weigh = (63 + grid.terrain[bare.cells[1:, 1], bare.cells[1:, 0]].astype(int)) / 63
            assert paid <= float((d * weigh).sum()) + 1e-9
    assert found > 4
    assert lines > found


@each
def test_lines_keep_off_obstacles_for_one_call(planner: Planner) -> None:
    walls = np.zeros((9, 9), dtype=bool)
    scene = Scene(Grid(walls), (0, 4), (8, 4))
    session = planner.open(scene, RNG)
    seen = frozenset({(4, 3), (4, 4), (4, 5)})
    around = session.plan(Change(obstacles=seen))
    for x, y in seen:
        walls[y, x] = True
    assert around.waypoints is not None
    assert len(around.waypoints) > 2
    assert check_plan(around, replace(scene, grid=Grid(walls))) is None
    straight = session.plan()
    assert straight.waypoints is not None
    assert len(straight.waypoints) == 2


@each
@pytest.mark.parametrize("name", NAMES)
def test_both_forms_write_the_same(planner: Planner, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    answers: dict[str, list[object]] = {"plain": [], "compiled": []}
    for form in answers:
        rng = np.random.default_rng([76, NAMES.index(name)])
        with monkeypatch.context() as patch:
            use(patch, form)
            for k in range(6):
                shape = rng.integers(4, 30, 2)
                walls = rng.random(shape) < 0.2
                terrain = rng.integers(0, 2, shape) * 100 if k % 3 == 0 else None
                robot = Robot(radius=0.8 if k % 3 == 1 else 0.0)
                ends = (0, 0), (int(shape[1]) - 1, int(shape[0]) - 1)
                walls[0, 0] = walls[-1, -1] = False
                plan = planner.open(Scene(Grid(walls, terrain=terrain), *ends, name, robot), RNG).plan()
                points = None if plan.waypoints is None else plan.waypoints.tolist()
                cells = None if plan.cells is None else plan.cells.tolist()
                answers[form].append((plan.status, plan.expansions, points, cells))
    assert answers["plain"] == answers["compiled"]


def test_searches_are_told_apart_for_ever() -> None:
    walls = np.random.default_rng(77).random((20, 20)) < 0.2
    walls[0, 0] = walls[19, 19] = False
    session = ThetaStar().open(Scene(Grid(walls), (0, 0), (19, 19)), RNG)
    first = session.plan()
    assert first
    session._search._runs = 2**31 - 3  # type: ignore[attr-defined]
    for _ in range(4):
        again = session.plan()
        assert np.array_equal(again.waypoints, first.waypoints)
        assert again.expansions == first.expansions
    assert session._search._runs == 2  # type: ignore[attr-defined]


# ---- the referee -------------------------------------------------------------------------------


def test_the_referee_refuses_lines_that_are_not_as_told() -> None:
    walls = np.zeros((7, 9), dtype=bool)
    walls[3, 4] = True
    scene = Scene(Grid(walls), (0, 3), (8, 3))
    plan = plan_of(ThetaStar(), scene)
    assert plan.waypoints is not None
    assert plan.cells is not None

    def rule_of(points: object, path: Plan = plan, of: Scene = scene) -> tuple[str, str]:
        broken = check_plan(replace(path, waypoints=points), of)  # type: ignore[arg-type]
        assert broken is not None
        return broken.rule, broken.sentence

    assert rule_of([[0, 3], [8, 3]])[0] == "line"
    assert "the wall at (4, 3)" in rule_of([[0, 3], [8, 3]])[1]
    assert "different ends" in rule_of([[0, 3], [7, 3]])[1]
    assert "different ends" in rule_of(np.zeros((0, 2)))[1]
    assert "follows itself" in rule_of([[0, 3], [0, 3], [8, 3]])[1]
    assert "outside" in rule_of([[0, 3], [4, -1], [8, 3]])[1]
    assert "in its turn" in rule_of([[0, 3], [4, 0], [8, 3]])[1]
    middle = [plan.cells[k].tolist() for k in (2, 5)]
    assert "in its turn" in rule_of([[0, 3], *middle[::-1], [8, 3]])[1]
    # The same lines are too near for a disc, and touch a corner.
    wide = replace(scene, robot=Robot(radius=0.6))
    roomy = plan_of(ThetaStar(), wide)
    assert check_plan(replace(roomy, waypoints=roomy.waypoints), wide) is None
    assert rule_of([[0, 3], [8, 3]], roomy, wide)[0] == "line"
    nothing = Plan(Status.NO_PATH, "x", waypoints=np.array([[0, 0]]))
    shut = Scene(Grid(np.array([[False, True, False]])), (0, 0), (2, 0))
    broken = check_plan(nothing, shut)
    assert broken is not None
    assert "without a path" in broken.sentence


def test_the_length_that_a_plan_tells_is_measured_again(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene(Grid(np.zeros((4, 5), dtype=bool)), (0, 0), (4, 3))
    plan = plan_of(ThetaStar(), scene)
    assert plan.any_angle_length == 5.0
    monkeypatch.setattr(Plan, "any_angle_length", property(lambda _: 4.9))
    broken = check_plan(plan, scene)
    assert broken is not None
    assert broken.rule == "waypoints"


def test_a_plan_keeps_its_waypoints_to_itself() -> None:
    scene = Scene(Grid(np.zeros((4, 5), dtype=bool)), (0, 0), (4, 3))
    plan = plan_of(LazyThetaStar(), scene)
    assert plan.waypoints is not None
    assert plan.waypoints.dtype == np.int32
    assert not plan.waypoints.flags.writeable
    astar = AStar().open(scene, RNG).plan()
    assert (astar.waypoints, astar.any_angle_length) == (None, None)
    assert plan.optimal_exact is None
