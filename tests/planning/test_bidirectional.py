"""Bidirectional A*: exact with and without terrain, each cell expanded once, both forms of its kernels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from query_checks import NAMES, RNG

from lampyris.kernels.graph.bidirectional import EXHAUSTED, FOUND, LIMIT, SPAN
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.path import path_of
from lampyris.model.scene import Scene
from lampyris.planning.graph.bidirectional_astar import BidirectionalAStar
from lampyris.planning.graph.bidirectional_search import TwoSearches, TwoTerrainSearches, both_ends
from lampyris.planning.graph.grid_graph import GridSearch, SearchResult
from lampyris.planning.graph.terrain_graph import search_of
from lampyris.referee import check_plan
from lampyris_selfcheck.reference.paths import terrain as terrain_twin
from lampyris_selfcheck.reference.paths.field import surd
from reference.kernel_forms import use


def told(answer: SearchResult) -> tuple[object, ...]:
    return answer.ending, answer.expansions, None if answer.cells is None else answer.cells.tolist()


def rough(rng: np.random.Generator, high: int) -> tuple[np.ndarray, np.ndarray]:
    """Free cells and terrain, of one of four kinds."""
    shape = tuple(int(n) for n in rng.integers(2, high, 2))
    terrain = (
        rng.integers(0, 253, shape),
        rng.integers(0, 253, shape) * (rng.random(shape) < 0.1),
        252 * (rng.random(shape) < 0.5),
        rng.integers(0, 3, shape),
    )[rng.integers(4)].astype(np.uint8)
    free = rng.random(shape) >= rng.choice([0.0, 0.15, 0.35])
    return free, terrain * free


def random_cell(rng: np.random.Generator, shape: tuple[int, ...]) -> tuple[int, int]:
    return int(rng.integers(shape[1])), int(rng.integers(shape[0]))


@pytest.mark.parametrize("name", NAMES)
def test_terrain_is_paid_in_the_robots_direction(name: str) -> None:
    """Against a reference in fractions; where there and back cost differently, too."""
    rng = np.random.default_rng([61, NAMES.index(name)])
    found = oneway = 0
    for _ in range(12):
        free, terrain = rough(rng, 11)
        terrain[0, 0], free[0, 0] = 9, True
        grid = Grid(~free, terrain=terrain)
        goal = random_cell(rng, free.shape)
        known, _ = terrain_twin.field(free.tolist(), terrain.tolist(), name, goal)
        for _ in range(6):
            start = random_cell(rng, free.shape)
            scene = Scene(grid, start, goal, name)
            plan = BidirectionalAStar().open(scene, RNG).plan()
            assert check_plan(plan, scene) is None
            assert bool(plan) == (free[start[1], start[0]] and start in known)
            if plan.path is None:
                continue
            found += 1
            cost = surd(0)
            for (x0, y0), (x1, y1) in zip(plan.path.cells[:-1], plan.path.cells[1:], strict=True):
                step = terrain_twin.COSTS[name][abs(int(x1 - x0) * int(y1 - y0))]
                cost = cost + terrain_twin.times(step, terrain_twin.weighs(terrain, (x1, y1)))
            assert cost == known[start]
            back = BidirectionalAStar().open(replace(scene, start=goal, goal=start), RNG).plan()
            assert back.path is not None
            oneway += back.path.exact != plan.path.exact
    assert found > 25
    assert oneway > 10


@pytest.mark.parametrize("name", NAMES)
def test_larger_maps_cost_what_one_search_finds(name: str) -> None:
    rng = np.random.default_rng([62, NAMES.index(name)])
    found = 0
    for k in range(60):
        free, terrain = rough(rng, 45)
        weighed = k % 2 == 1
        moves = MOVES[name].weighed() if weighed else MOVES[name]
        two = both_ends(free, terrain if weighed else None, moves)
        one = search_of(free, terrain if weighed else None, moves)
        cells = np.argwhere(free)
        for _ in range(4 if len(cells) else 0):
            start, goal = (tuple(int(v) for v in cells[rng.integers(len(cells))][::-1]) for _ in range(2))
            mine, theirs = two.find_path(start, goal), one.find_path(start, goal)
            assert mine.ending == theirs.ending
            assert mine.expansions <= len(cells)
            if mine.cells is not None and theirs.cells is not None:
                found += 1
                ground = terrain if weighed else None
                assert path_of(mine.cells, moves, ground).exact == path_of(theirs.cells, moves, ground).exact
    assert found > 100


def test_start_equals_goal_costs_nothing_and_expands_nothing() -> None:
    free = np.ones((3, 4), dtype=bool)
    for terrain in (None, np.full((3, 4), 7, np.uint8)):
        for name in NAMES:
            moves = MOVES[name] if terrain is None else MOVES[name].weighed()
            assert told(both_ends(free, terrain, moves).find_path((2, 1), (2, 1))) == (FOUND, 0, [[2, 1]])


@pytest.mark.parametrize("weighed", [False, True])
def test_neighbours_walls_and_budgets(weighed: bool) -> None:
    free = np.array([[True, True, False, True, True]])
    terrain = np.array([[0, 5, 0, 1, 0]], np.uint8) if weighed else None
    moves = MOVES["octile"].weighed() if weighed else MOVES["octile"]
    one = both_ends(free, terrain, moves)
    assert told(one.find_path((0, 0), (1, 0)))[::2] == (FOUND, [[0, 0], [1, 0]])
    assert told(one.find_path((1, 0), (0, 0)))[::2] == (FOUND, [[1, 0], [0, 0]])
    shut = one.find_path((0, 0), (4, 0))
    assert shut.ending == EXHAUSTED
    assert one.find_path((0, 0), (4, 0), shut.expansions).ending == EXHAUSTED
    assert one.find_path((0, 0), (4, 0), shut.expansions - 1).ending == LIMIT
    assert one.find_path((3, 0), (4, 0)).ending == FOUND
    whole = np.ones((9, 9), dtype=bool)
    ground = np.full((9, 9), 3, np.uint8) if weighed else None
    two = both_ends(whole, ground, moves)
    there = two.find_path((0, 0), (8, 5))
    for budget in (1, there.expansions - 1, there.expansions):
        answer = two.find_path((0, 0), (8, 5), budget)
        assert answer.ending == (FOUND if budget == there.expansions else LIMIT)
        assert answer.expansions == budget
    assert two.find_path((0, 0), (8, 5), closed=[(4, y) for y in range(9)]).ending == EXHAUSTED
    assert told(two.find_path((0, 0), (8, 5))) == told(there)


def test_both_ends_take_part() -> None:
    """A goal at the closed end of a long alley, which the search from it leaves at once."""
    free = np.ones((61, 61), dtype=bool)
    free[29, 20:56] = free[31, 20:56] = free[30, 20] = False
    one = GridSearch(free, MOVES["octile"], informed=True).find_path((5, 30), (21, 30))
    terrain = np.zeros(free.shape, np.uint8)
    for two in (
        TwoSearches(free, MOVES["octile"]),
        TwoTerrainSearches(free, terrain, MOVES["octile"].weighed()),
    ):
        answer = two.find_path((5, 30), (21, 30))
        assert (answer.ending, answer.expansions < 200) == (FOUND, True)
        assert one.expansions > 3000


@pytest.mark.parametrize("weighed", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_both_forms_write_the_same(name: str, weighed: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    answers: dict[str, list[object]] = {"plain": [], "compiled": []}
    for form in answers:
        rng = np.random.default_rng([63, NAMES.index(name)])
        with monkeypatch.context() as patch:
            use(patch, form)
            for _ in range(8):
                free, terrain = rough(rng, 25)
                free[0, 0] = free[-1, -1] = True
                moves = MOVES[name].weighed() if weighed else MOVES[name]
                one = both_ends(free, terrain if weighed else None, moves)
                for budget in (None, 11):
                    answers[form].append(
                        told(one.find_path((0, 0), (free.shape[1] - 1, free.shape[0] - 1), budget))
                    )
    assert answers["plain"] == answers["compiled"]


def test_searches_are_told_apart_for_ever() -> None:
    rng = np.random.default_rng(64)
    free = rng.random((20, 20)) >= 0.2
    free[0, 0] = free[19, 19] = True
    one = TwoSearches(free, MOVES["octile"])
    first = told(one.find_path((0, 0), (19, 19)))
    one._base = -(2**63) + 3 * SPAN
    bases = []
    for _ in range(4):
        assert told(one.find_path((0, 0), (19, 19))) == first
        bases.append(one._base)
    assert bases == [-(2**63) + 2 * SPAN, -(2**63) + SPAN, -SPAN, -2 * SPAN]

    two = TwoTerrainSearches(free, np.full(free.shape, 2, np.uint8), MOVES["octile"].weighed())
    first = told(two.find_path((0, 0), (19, 19)))
    two._runs = 2**31 - 3
    runs = []
    for _ in range(4):
        assert told(two.find_path((0, 0), (19, 19))) == first
        runs.append(two._runs)
    assert runs == [2**31 - 2, 2**31 - 1, 1, 2]
    kept = TwoSearches(free, MOVES["octile"])
    for _ in range(30):
        ends = [tuple(int(v) for v in rng.integers(0, 20, 2)) for _ in range(2)]
        if all(free[y, x] for x, y in ends):
            assert told(kept.find_path(*ends)) == told(TwoSearches(free, MOVES["octile"]).find_path(*ends))
