"""Planners over terrain: exact searches against the field, AD-GSO against both, and changes of terrain."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris.kernels.graph import weighted_search as kernels
from lampyris.kernels.graph.search import EXHAUSTED, FOUND, LIMIT
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.path import path_of
from lampyris.model.plan import Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.adgso.ad_gso import AdGso
from lampyris.planning.base import Budget
from lampyris.planning.field.layers import free_space, moves_for
from lampyris.planning.field.solve import solve, solve_field
from lampyris.planning.graph.astar import AStar
from lampyris.planning.graph.dijkstra import Dijkstra
from lampyris.planning.graph.grid_graph import following_of
from lampyris.planning.graph.terrain_graph import TerrainSearch
from lampyris.referee import check_path, check_plan
from lampyris_selfcheck.reference.paths import terrain as terrain_twin
from reference.kernel_forms import use

RNG = np.random.default_rng(0)  # Never drawn from by these planners.
NAMES = sorted(MOVES)


def rough(rng: np.random.Generator, low: int, high: int, crowd: float = 0.4) -> Grid:
    """A grid with terrain somewhere, of one of four kinds."""
    height, width = rng.integers(low, high, 2)
    shape = (height, width)
    terrain = (
        lambda: rng.integers(0, 253, shape),
        lambda: rng.integers(0, 253, shape) * (rng.random(shape) < 0.1),
        lambda: 252 * (rng.random(shape) < 0.5),
        lambda: rng.integers(0, 3, shape),
    )[rng.integers(4)]()
    terrain[0, 0] = 1
    blocked = rng.random(shape) < crowd * rng.random()
    blocked[0, 0] = False
    return Grid(blocked, terrain=terrain)


def cell(rng: np.random.Generator, grid: Grid) -> tuple[int, int]:
    return int(rng.integers(grid.width)), int(rng.integers(grid.height))


# ---- the exact searches ------------------------------------------------------------------------


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", NAMES)
def test_five_hundred_queries_each_cost_what_the_field_says(name: str) -> None:
    rng = np.random.default_rng([51, NAMES.index(name)])
    words = []
    for _ in range(50):
        grid = rough(rng, 2, 26)
        radius = float(rng.choice([0.0, 0.0, 0.8]))
        goal = cell(rng, grid)
        scene = Scene(grid, (0, 0), goal, name, Robot(radius=radius))
        field = solve_field(scene)
        sessions = [p.open(scene, RNG) for p in (AStar(), Dijkstra())]
        for _ in range(10):
            start = cell(rng, grid)
            here = replace(scene, start=start)
            cost = int(field.exact[start[1], start[0]])
            spent = []
            for session in sessions:
                plan = session.plan(Change(robot=start))
                words.append(plan.status)
                assert check_plan(plan, here) is None
                assert (plan.path is None) == (cost < 0)
                if plan.path is not None:
                    assert plan.path.exact == plan.optimal_exact == cost
                    assert plan.gap == 0
                spent.append(plan.expansions)
            if plan:
                assert spent[0] <= spent[1]
    assert {"found", "no-path", "start-occupied", "goal-occupied"} == set(words)
    assert len(words) == 1000


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("informed", [False, True])
def test_both_forms_of_the_search_write_the_same(
    name: str, informed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers: dict[str, list[object]] = {"plain": [], "compiled": []}
    for form in answers:
        rng = np.random.default_rng([52, NAMES.index(name)])
        with monkeypatch.context() as patch:
            use(patch, form)
            for _ in range(8):
                grid = rough(rng, 5, 30)
                assert grid.terrain is not None
                one = TerrainSearch(~grid.blocked, grid.terrain, MOVES[name].weighed(), informed=informed)
                goal = cell(rng, grid)
                if grid.blocked[goal[1], goal[0]]:
                    goal = (0, 0)
                for budget in (None, 7):
                    a = one.find_path((0, 0), goal, budget)
                    answers[form].append(
                        (a.ending, a.expansions, None if a.cells is None else a.cells.tolist())
                    )
                answers[form].append(one.region((0, 0)).expansions)
    assert answers["plain"] == answers["compiled"]


@pytest.mark.nightly
def test_what_is_expanded_depends_on_the_map_alone() -> None:
    """By f, then h, then cell: so Dijkstra expands exactly the cells before the goal in that order."""
    rng = np.random.default_rng(53)
    for name in NAMES:
        for _ in range(10):
            grid = rough(rng, 4, 20)
            goal = cell(rng, grid)
            scene = Scene(grid, (0, 0), goal, name)
            plan = Dijkstra().open(scene, RNG).plan()
            if not plan:
                continue
            assert plan.path is not None
            cost = _costs_from_the_start(grid, moves_for(scene))
            order = sorted((c, y, x) for (x, y), c in cost.items())
            assert plan.expansions == order.index((plan.path.exact, goal[1], goal[0]))


def _costs_from_the_start(grid: Grid, moves: Moves) -> dict[tuple[int, int], int]:
    """Exact costs from (0, 0) to every cell, by repeated relaxation along the steps of the reference."""
    assert grid.terrain is not None
    free = (~grid.blocked).tolist()
    best = {(0, 0): 0}
    changed = True
    while changed:
        changed = False
        for (x, y), paid in list(best.items()):
            for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True):
                if terrain_twin.legal(moves.name, free, x, y, dx, dy):
                    there = (x + dx, y + dy)
                    c = paid + cost // 63 * (63 + int(grid.terrain[there[1], there[0]]))
                    if c < best.get(there, 2**62):
                        best[there] = c
                        changed = True
    return best


def test_heap_entries_come_out_in_order(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pushed, made better and popped at random, judged by sorting; in both forms."""
    for form in ("plain", "compiled"):
        rng = np.random.default_rng(54)
        with monkeypatch.context() as patch:
            use(patch, form)
            n = 40
            keys, ties = np.zeros(n, np.int64), np.zeros(n, np.int64)
            items, place = np.zeros(n, np.int32), np.zeros(n, np.int32)
            heap = (keys, ties, items, place)
            for _ in range(15):
                held: dict[int, tuple[int, int]] = {}
                for _ in range(120):
                    item = int(rng.integers(n))
                    key, tie = (int(v) for v in rng.integers(0, 5, 2))
                    if item not in held:
                        held[item] = (key, tie)
                        kernels.rise(*heap, len(held) - 1, key, tie, item)
                    elif (key, tie) < held[item]:
                        held[item] = (key, tie)
                        kernels.rise(*heap, int(place[item]), key, tie, item)
                    elif rng.random() < 0.5:
                        top = int(items[0])
                        assert (*held[top], top) == min((*v, k) for k, v in held.items())
                        del held[top]
                        last = len(held)
                        if last:
                            kernels.sink(*heap, last, 0, int(keys[last]), int(ties[last]), int(items[last]))
                    for k in held:
                        assert items[place[k]] == k
                        assert (keys[place[k]], ties[place[k]]) == held[k]


def test_steps_left_out_are_never_needed() -> None:
    """Fewer than over plain ground, where the way round may be as cheap as any; all without them cost the
    same.
    """
    assert [len(row) for row in following_of(MOVES["octile"].weighed())] == [5] * 8 + [8]
    assert [len(row) for row in following_of(MOVES["dissertation"].weighed())] == [5] * 8 + [8]
    plain = {(k, e) for k, row in enumerate(following_of(MOVES["dissertation"])) for e in row}
    over = {(k, e) for k, row in enumerate(following_of(MOVES["dissertation"].weighed())) for e in row}
    assert plain < over


def test_the_base_starts_again_before_it_runs_out_of_bits() -> None:
    rng = np.random.default_rng(55)
    grid = rough(rng, 6, 7, 0.0)
    assert grid.terrain is not None
    one = TerrainSearch(~grid.blocked, grid.terrain, MOVES["octile"].weighed(), informed=True)
    first = one.find_path((0, 0), (5, 3))
    one._base = -(2**62) + 2 * one._span
    bases = []
    for _ in range(4):
        again = one.find_path((0, 0), (5, 3))
        assert np.array_equal(first.cells, again.cells)
        assert again.expansions == first.expansions
        bases.append(one._base)
    s = one._span
    assert bases == [-(2**62) + s, -(2**62), -s, -2 * s]


def test_budgets_and_regions() -> None:
    grid = Grid(np.zeros((5, 6), bool), terrain=np.full((5, 6), 9))
    assert grid.terrain is not None
    one = TerrainSearch(~grid.blocked, grid.terrain, MOVES["four-connected"].weighed(), informed=True)
    whole = one.find_path((0, 0), (5, 4))
    assert whole.ending == FOUND
    for budget in range(1, whole.expansions + 2):
        answer = one.find_path((0, 0), (5, 4), budget)
        assert answer.ending == (FOUND if budget >= whole.expansions else LIMIT)
        assert answer.expansions == min(budget, whole.expansions)
    assert (one.region((2, 2)).ending, one.region((2, 2)).expansions) == (EXHAUSTED, 30)
    assert (one.region((2, 2), 7).ending, one.region((2, 2), 7).expansions) == (LIMIT, 7)
    wall = [(3, y) for y in range(5)]
    shut = one.find_path((0, 0), (5, 4), closed=wall)
    assert (shut.ending, shut.expansions) == (EXHAUSTED, 15)
    assert one.find_path((0, 0), (5, 4)).expansions == whole.expansions


# ---- AD-GSO ------------------------------------------------------------------------------------


@pytest.mark.commit(4)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("choice", ["greedy", "roulette", "exact"])
def test_ad_gso_finds_legal_ways_and_exact_the_cheapest(name: str, choice: str) -> None:
    rng = np.random.default_rng([56, NAMES.index(name)])
    found = dearer = 0
    for k in range(40):
        grid = rough(rng, 2, 26)
        radius = float(rng.choice([0.0, 0.0, 0.8]))
        scene = Scene(grid, cell(rng, grid), cell(rng, grid), name, Robot(radius=radius))
        planner = AdGso(choice=choice, nt=int(rng.integers(1, 40)), mvr=int(rng.integers(1, 6)))
        best = AStar().open(scene, RNG).plan()
        plan = planner.open(scene, np.random.default_rng(k), record=True).plan()
        assert plan.status == best.status
        assert check_plan(plan, scene) is None
        if plan.path is None or best.path is None:
            continue
        found += 1
        assert plan.optimal_exact == best.path.exact
        if choice == "exact":
            assert plan.path.exact == best.path.exact
        dearer += plan.path.exact > best.path.exact
    assert found > 15
    assert choice == "exact" or dearer > 0


def test_ad_gso_takes_the_cheapest_way_inside_its_window() -> None:
    """Every sub-path that leaves the parents is a cheapest one through the accepted cells."""
    rng = np.random.default_rng(57)
    looked_at = 0
    for name in NAMES:
        for choice in ("greedy", "exact"):
            for k in range(40):
                grid = rough(rng, 8, 20, 0.3)
                scene = Scene(grid, cell(rng, grid), cell(rng, grid), name)
                session = AdGso(choice=choice, nt=20, mvr=4).open(
                    scene, np.random.default_rng(k), record=True
                )
                session.plan()
                blocks = [cell(rng, grid) for _ in range(12)]
                plan = session.plan(Change(obstacles=frozenset(blocks)))
                for jump in plan.jumps:
                    if jump.by_parents:
                        continue
                    looked_at += 1
                    inside = np.zeros(grid.blocked.shape, bool)
                    for x, y in [jump.at, *(c.cell for c in jump.candidates)]:
                        inside[y, x] = True
                    # Cells beside a diagonal need only be open, not accepted: judged on a map of steps.
                    assert jump.subpath[0] == jump.at
                    assert jump.subpath[-1] == jump.chosen
                    assert all(inside[y, x] for x, y in jump.subpath)
                    exact = path_of(np.array(jump.subpath), moves_for(scene), grid.terrain).exact
                    open_now = free_space(scene).copy()
                    if jump is plan.jumps[0]:
                        for x, y in blocks:
                            open_now[y, x] &= (x, y) == jump.at
                        assert exact == _inside(
                            jump.at, jump.chosen, inside, open_now, grid, moves_for(scene)
                        )
    assert looked_at > 100


def _inside(
    start: tuple[int, int],
    goal: tuple[int, int],
    inside: np.ndarray,
    open_now: np.ndarray,
    grid: Grid,
    moves: Moves,
) -> int:
    """Least cost from start to goal over accepted cells, side cells open."""
    assert grid.terrain is not None
    free = open_now.tolist()
    best = {start: 0}
    changed = True
    while changed:
        changed = False
        for (x, y), paid in list(best.items()):
            for (dx, dy), cost in zip(moves.offsets, moves.costs, strict=True):
                if not terrain_twin.legal(moves.name, free, x, y, dx, dy) or not inside[y + dy, x + dx]:
                    continue
                there = (x + dx, y + dy)
                c = paid + cost // 63 * (63 + int(grid.terrain[there[1], there[0]]))
                if c < best.get(there, 2**62):
                    best[there] = c
                    changed = True
    return best[goal]


def test_a_long_way_round_fits_the_room_for_it() -> None:
    """Heavy cells one wide between light ones: parents make long detours around them, in many steps."""
    terrain = np.zeros((21, 21), int)
    terrain[1::4, :-1] = terrain[3::4, 1:] = 252
    for name in NAMES:
        for choice in ("greedy", "exact"):
            scene = Scene(Grid(np.zeros((21, 21), bool), terrain=terrain), (0, 20), (0, 0), name)
            plan = AdGso(choice=choice, nt=400, mvr=20).open(scene, RNG).plan()
            assert check_plan(plan, scene) is None
            assert plan.status is Status.FOUND


# ---- changes -----------------------------------------------------------------------------------


@pytest.mark.parametrize("planner", [AStar(), Dijkstra(), AdGso(choice="exact"), AdGso()])
def test_a_session_takes_in_changes_of_terrain(planner: AStar | Dijkstra | AdGso) -> None:
    """From plain to rough, rougher, walled and back to plain: always the answer of a new session."""
    rng = np.random.default_rng(58)
    for name in NAMES:
        height, width = 9, 12
        blocked = rng.random((height, width)) < 0.15
        blocked[0, 0] = blocked[8, 11] = False
        scene = Scene(Grid(blocked), (0, 0), (11, 8), name)
        session = planner.open(scene, np.random.default_rng(1))
        ground = np.zeros((height, width), int)
        for k in range(6):
            cells = [(int(c) % width, int(c) // width) for c in rng.integers(0, height * width, 30)]
            if k == 5:
                cells = [(x, y) for y in range(height) for x in range(width)]
            values = [0 if k == 5 else int(v) for v in rng.integers(0, 253, len(cells))]
            change = Change(terrain=tuple(zip(cells, values, strict=True)))
            for (x, y), value in zip(cells, values, strict=True):
                ground[y, x] = value
            plan = session.plan(change)
            now = replace(scene, grid=Grid(blocked, terrain=ground))
            fresh = planner.open(now, np.random.default_rng(1)).plan()
            assert check_plan(plan, now) is None
            assert plan.status == fresh.status
            assert (plan.path is None) == (fresh.path is None)
            if plan.path is not None and fresh.path is not None:
                assert plan.cells is not None
                assert plan.cells.tolist() == fresh.path.cells.tolist()
                assert plan.path.exact == fresh.path.exact
                assert plan.optimal_exact == fresh.optimal_exact
                assert plan.path.moves.scale == (1 if k == 5 else 63)


def test_budgets_of_a_session_on_rough_ground() -> None:
    rng = np.random.default_rng(59)
    grid = rough(rng, 12, 13, 0.0)
    scene = Scene(grid, (0, 0), (11, 11), "octile")
    whole = AStar().open(scene, RNG).plan()
    assert AStar().open(scene, RNG).plan(None, Budget(whole.expansions - 1)).status is Status.LIMIT
    assert AStar().open(scene, RNG).plan(None, Budget(whole.expansions)).status is Status.FOUND


def test_a_path_over_terrain_is_refused_for_what_it_does_not_pay() -> None:
    grid = Grid(np.zeros((1, 3), bool), terrain=[[0, 9, 0]])
    scene = Scene(grid, (0, 0), (2, 0), "four-connected")
    plan = AStar().open(scene, RNG).plan()
    assert plan.path is not None
    assert plan.path.paid == 63 + 9 + 63
    free = path_of(plan.path.cells, MOVES["four-connected"])
    assert check_path(free, grid, scene.robot, scene.moves, scene.start, scene.goal) is not None


def test_the_field_of_one_query_stops_early() -> None:
    rng = np.random.default_rng(60)
    grid = rough(rng, 30, 31, 0.2)
    assert grid.terrain is not None
    free = ~grid.blocked
    free[3, 3] = free[0, 0] = True
    part = solve(free, MOVES["octile"].weighed(), (0, 0), terrain=grid.terrain, stop=(3, 3))
    assert part.expansions < np.count_nonzero(free)
