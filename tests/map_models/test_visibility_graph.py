"""The visibility graph: the shortest of all lines between cell centres, and the bound in the plane."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris.kernels.graph.any_angle import CUT, TOUCH, sees
from lampyris.kernels.map_models.visibility import BESIDE, EDGE, NEVER, SHUT, in_view, open_cone, sight
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


def test_a_line_may_pass_between_four_free_cells_beside_a_blocked_corner() -> None:
    """A diagonal that ends before the corner which it points to."""
    walls = np.array([[True, False, False, False], [False, False, False, True]])
    plan = plan_of(Scene(Grid(walls), (2, 1), (1, 0), "sixteen-connected"))
    assert plan.any_angle_length == pytest.approx(math.sqrt(2.0))


@pytest.mark.parametrize("name", ["dissertation", "octile"])
@sized("maps", 4, 100)
def test_a_bound_that_is_too_low_is_raised(name: str, maps: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """The first guesses decide how long it takes, not what is found."""
    rng = np.random.default_rng([83, name == "octile"])
    raised = 0
    for _ in range(maps):
        walls = rng.random((14, 14)) < 0.25
        walls[[0, -1], [0, -1]] = False
        scene = Scene(Grid(walls), (0, 0), (13, 13), name)
        plan = plan_of(scene)
        with monkeypatch.context() as patch:
            patch.setattr(search, "SHARE", 0.0)
            patch.setattr(search, "MORE", 0.01)
            patch.setattr(search, "MANY", 0)
            patch.setattr(search, "NEAR", (1.0, 1.01, NEVER))
            other = plan_of(scene)
        assert bool(plan) == bool(other)
        if plan and plan.map_model is not None and other.map_model is not None:
            assert plan.any_angle_length == pytest.approx(other.any_angle_length, abs=1e-9)
            assert plan.map_model.bound == pytest.approx(other.map_model.bound, abs=1e-9)
            raised += other.expansions > plan.expansions
    assert raised


def seen_from(
    made: search.CornerMap, x: int, y: int, vertex: np.ndarray, inset: float, room: int = 4
) -> tuple[set[int], set[int]]:
    """The squares whose centre is listed, and the vertices."""
    n = len(made.square)
    cone, spans = np.zeros(8), np.zeros(4 * (made.stride + n // made.stride))
    seen = np.zeros(room * n + 200, dtype=np.int32)
    open_cone(0, 0, 0, 0, cone)
    rest, known = np.zeros(n), np.full(n, NEVER)
    count = in_view(made.square, made.stride, x, y, cone, rest, NEVER, known, 0.0, inset, vertex, spans, seen)
    listed = seen[:count].tolist()
    return {v for v in listed if v >= 0}, {-1 - v for v in listed if v < 0}


@pytest.mark.parametrize("radius", [0.0, 0.6])
@sized("maps", 4, 100)
def test_nothing_in_sight_is_missing_from_what_is_listed(radius: float, maps: int) -> None:
    """Every corner, and every cell centre, that a lattice point sees is in the list that the search looks at."""
    rng = np.random.default_rng(28)
    for _ in range(maps):
        free = rng.random(rng.integers(3, 12, 2)) > rng.choice([0.05, 0.3, 0.5])
        made = search._wide_corners(free) if radius else search._corners(free, bool(rng.integers(2)))
        vertex = np.full(len(made.square), -1, dtype=np.int32)
        vertex[(made.y >> 1) * made.stride + (made.x >> 1)] = np.arange(len(made.x))
        centres = np.argwhere(made.square.reshape(-1, made.stride) != 0)
        points = [*zip(made.x, made.y, strict=True), *(() if radius else (2 * centres[:, ::-1] + 1).tolist())]
        lines = (made.square, made.node, made.stride)
        for px, py in points:
            squares, corners = seen_from(made, px, py, vertex, -EDGE)
            sees = {
                v for v in range(len(made.x))
                if sight(*lines, px, py, int(made.x[v]), int(made.y[v]), SHUT) == 1
                and (made.x[v], made.y[v]) != (px, py)
            }  # fmt: skip
            if radius:
                # Along sides with blocked squares on both sides the search looks by itself.
                sees = {v for v in sees if made.x[v] != px and made.y[v] != py}
            assert sees <= corners
            for r, c in centres.tolist():
                line = sight(*lines, px, py, 2 * c + 1, 2 * r + 1, SHUT)
                assert line == 0 or r * made.stride + c in squares


@sized("maps", 6, 200)
def test_lines_between_centres_are_those_of_theta_star(maps: int) -> None:
    """All pairs of cells, with corners that may be touched and that may not; and those that do not touch are all listed."""
    rng = np.random.default_rng(29)
    none, weight = np.zeros(1, dtype=np.int32), np.zeros(1, dtype=np.uint8)
    for _ in range(maps):
        free = rng.random(rng.integers(3, 9, 2)) > rng.choice([0.05, 0.3, 0.5])
        made = search._corners(free, touching=True)
        cells = np.argwhere(free)[:, ::-1] + 1
        for x, y in cells.tolist():
            at = y * made.stride + x
            listed = seen_from(made, 2 * x + 1, 2 * y + 1, none, 2.0 * EDGE)[0]
            for u, v in cells.tolist():
                ends = (2 * x + 1, 2 * y + 1, 2 * u + 1, 2 * v + 1)
                for shut, rule in ((BESIDE, TOUCH), (0, CUT)):
                    line = sees(made.square, weight, 0, made.stride, at, x, y, u, v, rule)
                    assert sight(made.square, made.node, made.stride, *ends, shut) == line
                    if rule == TOUCH and line and (u, v) != (x, y):
                        assert v * made.stride + u in listed


def test_a_list_that_is_too_short_is_lengthened() -> None:
    made = search._corners(np.ones((4, 4), dtype=bool), touching=True)
    cone, spans = np.zeros(8), np.zeros(4 * (made.stride + 7))
    open_cone(0, 0, 0, 0, cone)
    rest, known = np.zeros(49), np.full(49, NEVER)
    short, none = np.zeros(3, dtype=np.int32), np.zeros(1, dtype=np.int32)
    assert (
        in_view(made.square, made.stride, 5, 5, cone, rest, 99.0, known, 0.0, -EDGE, none, spans, short) == -1
    )
    walls = np.random.default_rng(4).random((12, 12)) < 0.2
    walls[[0, -1], [0, -1]] = False
    scene = Scene(Grid(walls), (0, 0), (11, 11), "octile")
    plan = plan_of(scene)
    make = search._tree

    def short_of_room(*given: object) -> search._Search:
        tree = make(*given)  # type: ignore[arg-type]
        tree.seen = np.zeros(1, dtype=np.int32)
        return tree

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(search, "_tree", short_of_room)
        assert plan_of(scene) == plan


@pytest.mark.parametrize(
    ("line", "blocked", "cone"),
    [
        ((4, -2), (-1, -1), {0: (-1.0, -0.5), 3: (0.0, 1.0)}),
        ((2, -4), (-1, -1), {3: (0.0, 0.5)}),
        ((-2, 4), (-1, -1), {2: (0.0, 1.0), 1: (-1.0, -0.5)}),
        ((3, 0), (-1, -1), {0: (-1.0, 0.0), 3: (0.0, 1.0)}),
        ((0, -3), (-1, -1), {3: (0.0, 0.0)}),
        ((4, 2), (1, -1), {0: (0.0, 0.5)}),
        ((5, 1), (0, 0), {0: (-1.0, 1.0), 1: (-1.0, 1.0), 2: (-1.0, 1.0), 3: (-1.0, 1.0)}),
    ],
)
def test_a_path_goes_on_around_the_blocked_square(
    line: Cell, blocked: Cell, cone: dict[int, tuple[float, float]]
) -> None:
    """Straight on, or towards the square; by the direction along which slopes are (+x, +y, -x, -y)."""
    found = np.zeros(8)
    open_cone(*line, *blocked, found)
    sides = found.reshape(4, 2).tolist()
    assert {k: (low, high) for k, (low, high) in enumerate(sides) if low <= high} == cone
