"""Polyanya: the shortest path in the plane, held against the visibility graph, Theta* and the referee."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from lampyris.kernels.map_models import polyanya as kernels
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.field.layers import free_cells
from lampyris.planning.graph.theta_star import ThetaStar
from lampyris.planning.map_models import polyanya_search as search
from lampyris.planning.map_models.polyanya import Polyanya
from lampyris.planning.map_models.visibility_search import VisibilitySearch
from lampyris.referee import check_plan
from lampyris.testing import check_planner
from lampyris_selfcheck.reference.geometry.plane import disc_optimum, point_optimum
from sizes import sized

RNG = np.random.default_rng(0)
RULES = [("dissertation", 0.0), ("octile", 0.0), ("octile", 0.8), ("four-connected", 0.0)]
Cell = tuple[int, int]


def plan_of(scene: Scene, planner: object = None) -> Plan:
    plan = (planner or Polyanya()).open(scene, RNG).plan()  # type: ignore[attr-defined]
    assert check_plan(plan, scene) is None
    return plan


def cells_where(mask: np.ndarray) -> list[Cell]:
    return [(int(x), int(y)) for y, x in np.argwhere(mask)]


def random_scene(rng: np.random.Generator, most: int, name: str, radius: float) -> Scene:
    while True:
        grid = Grid(rng.random(rng.integers(3, most, 2)) < rng.choice([0.1, 0.2, 0.3, 0.4, 0.5]))
        free = cells_where(free_cells(grid, radius))
        if free:
            start, goal = (free[int(rng.integers(len(free)))] for _ in range(2))
            return Scene(grid, start, goal, name, Robot(radius=radius))


def held_against_others(scene: Scene) -> bool:
    """A plan as long as the visibility graph's bound, no longer than Theta*; whether there is one."""
    radius = scene.robot.radius
    free = free_cells(scene.grid, radius)
    judge = VisibilitySearch(free, MOVES[scene.moves.name], wide=radius > 0)
    known = judge.find_path(scene.start, scene.goal)
    plan = plan_of(scene)
    assert bool(plan) == (known.model is not None)
    if not plan:
        return False
    assert plan.map_model is not None
    assert known.model is not None
    assert plan.map_model.bound == pytest.approx(known.model.bound, abs=1e-9)
    assert plan.waypoints is not None
    assert plan.any_angle_length is not None
    touching = radius == 0 and scene.moves.name in ("octile", "four-connected")
    # Each corner costs less than 4 steps of 2^-16 where none may be touched.
    corners = max(0, len(plan.waypoints) - 2)
    assert plan.any_angle_length <= plan.map_model.bound + (corners * 2**-14 if touching else 0) + 1e-9
    theta = plan_of(scene, ThetaStar())
    assert theta.any_angle_length is not None
    assert plan.any_angle_length <= theta.any_angle_length + 1e-9
    return True


@pytest.mark.parametrize(("name", "radius"), RULES)
@sized("maps", 12, 2500)
def test_random_maps(name: str, radius: float, maps: int) -> None:
    rng = np.random.default_rng([91, int(10 * radius), len(name)])
    assert sum(held_against_others(random_scene(rng, 12, name, radius)) for _ in range(maps)) > maps // 4


@pytest.mark.nightly
@pytest.mark.parametrize(("name", "radius"), RULES[:3])
def test_all_maps_of_4_x_4(name: str, radius: float) -> None:
    """The bound of every map, from the first to the last free cell, and one pair more."""
    for bits in range(1, 2**16):
        walls = (bits >> np.arange(16) & 1).astype(bool).reshape(4, 4)
        free = free_cells(Grid(walls), radius)
        cells = cells_where(free)
        if len(cells) < 2:
            continue
        moves = MOVES[name]
        mine = search.PolyanyaSearch(free, moves, wide=radius > 0)
        judge = VisibilitySearch(free, moves, wide=radius > 0)
        for start, goal in ((cells[0], cells[-1]), (cells[len(cells) // 2], cells[bits % len(cells)])):
            a, b = mine.find_path(start, goal), judge.find_path(start, goal)
            assert (a.model is None) == (b.model is None), (bits, start, goal)
            if a.model is not None and b.model is not None:
                assert a.model.bound == pytest.approx(b.model.bound, abs=1e-9), (bits, start, goal)


@pytest.mark.parametrize(("name", "radius"), RULES[:3])
@sized("cases", 4, 120)
def test_the_optimum_in_the_plane(name: str, radius: float, cases: int) -> None:
    """Against all corners of all cells, in fractions."""
    rng = np.random.default_rng([92, int(10 * radius), len(name)])
    for _ in range(cases):
        scene = random_scene(rng, 7, name, radius)
        rows = free_cells(scene.grid, radius).tolist()
        ends = (scene.start, scene.goal)
        best = disc_optimum(rows, *ends) if radius else point_optimum(rows, *ends, name == "dissertation")
        plan = plan_of(scene)
        assert bool(plan) == (best < math.inf)
        if plan and plan.map_model is not None:
            assert plan.map_model.bound == pytest.approx(best, abs=1e-9)


def test_lines_around_a_post_are_those_worked_out_by_hand() -> None:
    walls = np.zeros((4, 101), dtype=bool)
    walls[2:, [30, 70]] = True
    length = math.sqrt(29.5**2 + 0.25) * 2 + 41
    cutting = plan_of(Scene(Grid(walls), (0, 2), (100, 2), "dissertation"))
    assert cutting.waypoints is not None
    assert cutting.waypoints.tolist() == [[0, 2], [29.5, 1.5], [70.5, 1.5], [100, 2]]
    assert cutting.any_angle_length == pytest.approx(length, abs=1e-12)
    kept_off = plan_of(Scene(Grid(walls), (0, 2), (100, 2), "octile"))
    off = 2.0**-16
    assert kept_off.waypoints is not None
    assert kept_off.waypoints.tolist() == [[0, 2], [29.5 - off, 1.5 - off], [70.5 + off, 1.5 - off], [100, 2]]
    assert kept_off.map_model is not None
    assert kept_off.map_model.bound == pytest.approx(length, abs=1e-12)


@pytest.mark.parametrize("rule", [search.CUT, search.TOUCH, search.WIDE])
@sized("maps", 4, 200)
def test_the_mesh_covers_every_free_square_once(rule: int, maps: int) -> None:
    rng = np.random.default_rng(93)
    for _ in range(maps):
        free = rng.random(rng.integers(3, 30, 2)) > rng.choice([0.05, 0.3, 0.5])
        mesh = search.Mesh(free, rule)
        square = mesh.square.reshape(-1, mesh.stride)
        count = np.zeros(square.shape, dtype=int)
        for k, (left, top, right, bottom) in enumerate((mesh.rects.reshape(-1, 4) // 2).tolist()):
            count[top:bottom, left:right] += 1
            assert (mesh.owner.reshape(square.shape)[top:bottom, left:right] == k).all()
        assert (count == square).all()
        # Neighbours know one another, and share just what either says.
        shared = set()
        for p in range(len(mesh.first) - 1):
            rows = mesh.sides[5 * mesh.first[p] : 5 * mesh.first[p + 1]].reshape(-1, 5)
            for dx, dy, cx, cy, q in rows.tolist():
                shared.add((p, q, (dx, dy), (cx, cy)))
        assert {(q, p, c, d) for p, q, d, c in shared} == shared
        owner = mesh.owner.reshape(square.shape)
        pairs = itertools.chain(
            zip(owner[:, :-1].ravel(), owner[:, 1:].ravel(), strict=True),
            zip(owner[:-1].ravel(), owner[1:].ravel(), strict=True),
        )
        beside = {(int(a), int(b)) for a, b in pairs if a >= 0 and b >= 0 and a != b}
        assert {(p, q) for p, q, *_ in shared} == beside | {(b, a) for a, b in beside}


def test_budgets_terrain_changes_and_room(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(94)
    walls = rng.random((30, 30)) < 0.25
    walls[0, 0] = walls[-1, -1] = False
    scene = Scene(Grid(walls), (0, 0), (29, 29), "octile")
    monkeypatch.setattr(search, "FIRST_NODES", 1)
    full = plan_of(scene)
    monkeypatch.undo()
    assert full
    assert plan_of(scene) == full
    for few in (1, full.expansions - 1):
        short = Polyanya().open(scene, RNG).plan(budget=Budget(expansions=few))
        assert short.status == "limit"
        assert short.expansions <= few
    session = Polyanya().open(scene, RNG)
    cells = full.cells
    assert cells is not None
    gone = tuple((int(x), int(y)) for x, y in cells[5:6])
    among = session.plan(Change(obstacles=frozenset(gone)))
    blocked = walls.copy()
    blocked[gone[0][1], gone[0][0]] = True
    new = replace(scene, grid=Grid(blocked))
    assert among == replace(Polyanya().open(new, RNG).plan(), optimal_exact=among.optimal_exact)
    assert session.plan(Change()) == full
    assert session.plan(Change(blocked=gone)).waypoints is not None
    ground = Grid(walls, terrain=np.full((30, 30), 7, dtype=np.uint8))
    over = plan_of(Scene(ground, (0, 0), (29, 29), "octile"))
    assert over.map_model is None
    assert over.waypoints is not None


def test_the_referee_refuses_lines_that_touch_or_cross() -> None:
    walls = np.zeros((5, 5), dtype=bool)
    walls[2, 2] = True
    scenes = {name: Scene(Grid(walls), (0, 2), (4, 2), name) for name in ("octile", "dissertation")}
    for name, scene in scenes.items():
        plan = plan_of(scene)
        assert plan.waypoints is not None
        on = plan.waypoints.copy()
        on[1:-1] = np.round(on[1:-1] * 2) / 2
        fault = check_plan(replace(plan, waypoints=on), scene)
        assert (fault is None) == (name == "dissertation")
        inside = plan.waypoints.copy()
        inside[1, 0] += 0.25
        broken = check_plan(replace(plan, waypoints=inside), scene)
        assert broken is not None
        assert broken.rule == "line"
        odd = plan.waypoints.copy()
        odd[1] += 1e-7
        wrong = check_plan(replace(plan, waypoints=odd), scene)
        assert wrong is not None
        assert wrong.rule == "waypoints"


def test_work_on_an_open_map_does_not_grow_with_its_cells() -> None:
    """One rectangle, one node for the start and one for the goal."""
    for size in (10, 200):
        free = np.ones((size, size), dtype=bool)
        answer = search.PolyanyaSearch(free, MOVES["octile"], wide=False).find_path((0, 0), (size - 1, 3))
        assert answer.model is not None
        assert (answer.expansions, answer.model.counts["rectangles"]) == (1, 1)


@pytest.mark.nightly
@sized("cases", 1, 3)
def test_the_contract(cases: int) -> None:
    check_planner(Polyanya(), cases=cases)


def test_statuses_are_those_of_the_searches() -> None:
    assert (kernels.FOUND, kernels.EXHAUSTED, kernels.LIMIT) == (0, 1, 2)
