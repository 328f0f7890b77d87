"""The visibility graph: the shortest of all lines between cell centres, and the bound in the plane."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris.kernels.map_models.visibility import corners_in_view, in_view, sight
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.field.layers import free_cells
from lampyris.planning.graph.theta_star import ThetaStar
from lampyris.planning.map_models import visibility_search as search
from lampyris.planning.map_models.visibility_graph import VisibilityGraph
from lampyris.referee import check_plan
from lampyris.testing import check_planner
from lampyris_selfcheck.reference.geometry.plane import disc_optimum, point_optimum
from lampyris_selfcheck.reference.paths.any_angle import all_lines, shortest
from sizes import sized

RNG = np.random.default_rng(0)
Cell = tuple[int, int]


def cells_where(mask: np.ndarray) -> list[Cell]:
    return [(int(x), int(y)) for y, x in np.argwhere(mask)]


def plan_of(scene: Scene, planner: object = None) -> Plan:
    plan = (planner or VisibilityGraph()).open(scene, RNG).plan()  # type: ignore[attr-defined]
    assert check_plan(plan, scene) is None
    return plan


def random_walls(rng: np.random.Generator, most: int) -> np.ndarray:
    walls: np.ndarray = rng.random(rng.integers(3, most, 2)) < rng.choice([0.1, 0.2, 0.3, 0.4])
    return walls


@pytest.mark.nightly
@sized("cases", 1, 3)
def test_the_contract(cases: int) -> None:
    check_planner(VisibilityGraph(), cases=cases)


@pytest.mark.parametrize("name", ["dissertation", "octile"])
@sized("maps", 3, 60)
def test_no_lines_between_centres_are_shorter(name: str, maps: int) -> None:
    """Against all pairs of cells, in fractions."""
    rng = np.random.default_rng([81, name == "octile"])
    asked = better = 0
    while asked < 12 * maps:
        walls = random_walls(rng, 9)
        free = cells_where(~walls)
        if len(free) < 2:
            continue
        lines = all_lines(set(free), set(cells_where(walls)), name == "dissertation")
        goal = free[int(rng.integers(len(free)))]
        least = shortest(set(free), lines, goal)
        for start in free[:: max(1, len(free) // 6)]:
            scene = Scene(Grid(walls), start, goal, name)
            plan = plan_of(scene)
            assert bool(plan) == (start in least)
            if not plan:
                continue
            asked += 1
            theta = plan_of(scene, ThetaStar())
            assert plan.any_angle_length is not None
            assert theta.any_angle_length is not None
            assert plan.any_angle_length == pytest.approx(least[start], abs=1e-9)
            assert plan.any_angle_length <= theta.any_angle_length + 1e-9
            better += plan.any_angle_length < theta.any_angle_length - 1e-9
    assert better > 0.05 * asked


@pytest.mark.parametrize(("name", "radius"), [("dissertation", 0.0), ("octile", 0.0), ("octile", 0.8)])
@sized("cases", 6, 120)
def test_the_bound_is_the_optimum_in_the_plane(name: str, radius: float, cases: int) -> None:
    """Against all corners of all cells, in fractions, by lines cut at every line of the grid."""
    rng = np.random.default_rng([82, int(10 * radius), name == "octile"])
    found = 0
    while found < cases:
        grid = Grid(random_walls(rng, 7))
        open_cells = free_cells(grid, radius)
        free = cells_where(open_cells)
        if len(free) < 2:
            continue
        start, goal = (free[int(rng.integers(len(free)))] for _ in range(2))
        rows = open_cells.tolist()
        best = (
            disc_optimum(rows, start, goal)
            if radius
            else point_optimum(rows, start, goal, name == "dissertation")
        )
        plan = plan_of(Scene(grid, start, goal, name, Robot(radius=radius)))
        assert bool(plan) == (best < math.inf)
        if not plan:
            continue
        found += start != goal
        assert plan.map_model is not None
        assert plan.map_model.bound == pytest.approx(best, abs=1e-9)
        if radius:
            assert plan.any_angle_length == pytest.approx(best, abs=1e-9)


def test_the_best_turning_point_may_be_in_the_open() -> None:
    """Between two walls one turn far from both is shorter than two turns beside them."""
    walls = np.zeros((4, 101), dtype=bool)
    walls[2:, [30, 70]] = True
    scene = Scene(Grid(walls), (0, 2), (100, 2), "octile")
    plan = plan_of(scene)
    assert plan.waypoints is not None
    assert plan.waypoints.tolist() == [[0, 2], [50, 1], [100, 2]]
    assert plan.map_model is not None
    assert plan.map_model.bound == pytest.approx(math.sqrt(29.5**2 + 0.25) * 2 + 41)


def test_budgets_and_terrain() -> None:
    walls = np.zeros((12, 12), dtype=bool)
    walls[6, 2:] = True
    scene = Scene(Grid(walls), (11, 11), (11, 0), "octile")
    full = VisibilityGraph().open(scene, RNG).plan()
    for few in (1, 2, full.expansions // 2, full.expansions - 1):
        short = VisibilityGraph().open(scene, RNG).plan(budget=Budget(expansions=few))
        assert short.status == "limit"
        assert short.expansions <= few
    assert VisibilityGraph().open(scene, RNG).plan(budget=Budget(expansions=full.expansions)) == full
    ground = Grid(walls, terrain=np.full((12, 12), 7, dtype=np.uint8))
    over = plan_of(Scene(ground, (11, 11), (11, 0), "octile"))
    assert over.map_model is None
    assert over.waypoints is not None


@pytest.mark.parametrize("radius", [0.0, 0.6])
@sized("maps", 4, 100)
def test_nothing_in_sight_is_missing_from_what_is_listed(radius: float, maps: int) -> None:
    """Every corner, and every cell centre, that a lattice point sees is in the list that the search looks at."""
    rng = np.random.default_rng(28)
    for _ in range(maps):
        free = rng.random(rng.integers(3, 12, 2)) > rng.choice([0.05, 0.3, 0.5])
        made = search._wide_corners(free) if radius else search._corners(free, bool(rng.integers(2)))
        x, y = (np.concatenate((np.zeros(2, dtype=np.int64), one)) for one in (made.x, made.y))
        vertex, tried, spans, _, seen = search._looking(made.square, made.stride, x, y)
        squares = np.zeros(4 * len(made.square), dtype=np.int32)
        centres = np.argwhere(made.square.reshape(-1, made.stride) != 0)
        points = [*zip(made.x, made.y, strict=True), *(() if radius else (2 * centres[:, ::-1] + 1).tolist())]
        for turn, (px, py) in enumerate(points, 1):
            sees = [
                v for v in range(2, len(x))
                if sight(made.square, made.node, made.stride, px, py, int(x[v]), int(y[v])) == 1
            ]  # fmt: skip
            count = corners_in_view(
                made.square, made.node, made.stride, px, py, vertex, tried, turn, spans, squares, seen
            )
            assert {0, 1, *sees} <= set(seen[:count].tolist())
            assert len(set(seen[:count].tolist())) == count
            if px & 1:
                listed = set(squares[: in_view(made.square, made.stride, px, py, spans, squares)].tolist())
                for r, c in centres.tolist():
                    line = sight(made.square, made.node, made.stride, px, py, 2 * c + 1, 2 * r + 1)
                    assert line == 0 or r * made.stride + c in listed


def test_a_list_that_is_too_short_is_refused() -> None:
    made = search._corners(np.ones((4, 4), dtype=bool), touching=True)
    spans, squares = search._spans(made.square, made.stride), np.zeros(3, dtype=np.int32)
    assert in_view(made.square, made.stride, 5, 5, spans, squares) == -1
