"""All 512 grids of 3x3 cells, every start and goal, blocked ends too: verdict exact cost equal a twin's."""

from __future__ import annotations

from collections import Counter
from itertools import product

import numpy as np
import pytest

import lampyris
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.scene import Scene
from lampyris.planners.astar import AStar
from lampyris.planners.base import Planner
from lampyris.planners.bidirectional_astar import BidirectionalAStar
from lampyris.planners.dijkstra import Dijkstra
from lampyris.planners.jps import JumpPointSearch
from lampyris.referee import check_path
from lampyris.selfcheck.twins.search_twin import Cell, Counts, cost_of, distances, verdict

PLANNERS = [AStar(), Dijkstra(), JumpPointSearch(), BidirectionalAStar()]
CELLS = list(product(range(3), repeat=2))

VERDICTS = {"start-occupied": 20_736, "goal-occupied": 9_216, "found": 9_096, "no-path": 2_424}
"""Half of all 41,472 starts are blocked; 11,520 ordered pairs of free cells remain, start = goal included.

That 9,096 of them are connected is known from another all-pairs count of the same model: it judges the twin.
"""


def all_grids() -> list[tuple[Grid, list[list[bool]]]]:
    made = []
    for bits in range(512):
        blocked = np.array([bits >> k & 1 for k in range(9)], dtype=bool).reshape(3, 3)
        made.append((Grid(blocked), (~blocked).tolist()))
    return made


def judge(plan: Plan, scene: Scene, start: Cell, word: str, known: dict[Cell, Counts]) -> None:
    name = scene.moves.name

    def case() -> str:
        return f"{plan.planner}, {name}, {start} to {scene.goal} on\n{scene.grid.blocked.astype(int)}"

    assert plan.status == word, case()
    if plan.path is not None:
        assert cost_of(plan.path.steps, name) == cost_of(known[start], name), case()
        assert check_path(plan.path, scene.grid, scene.robot, scene.moves, start, scene.goal) is None, case()


def ask_everything(planner: Planner, name: str, grids: list[tuple[Grid, list[list[bool]]]]) -> Counter[str]:
    """Every start and goal of these grids, one session for each goal; how often each verdict was right."""
    rng = np.random.default_rng(0)
    words: Counter[str] = Counter()
    for grid, free in grids:
        for goal in CELLS:
            known = distances(free, name, goal)
            scene = Scene(grid, goal, goal, name)
            session = planner.open(scene, rng)
            for start in CELLS:
                word = verdict(free, start, known, goal)
                words[word] += 1
                judge(session.plan(Change(robot=start)), scene, start, word, known)
    return words


@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_every_octile_query(planner: Planner) -> None:
    assert ask_everything(planner, "octile", all_grids()) == VERDICTS


@pytest.mark.parametrize("name", ["dissertation", "four", "sixteen"])
@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_every_query_of_one_grid_in_six_with_other_moves(planner: Planner, name: str) -> None:
    words = ask_everything(planner, name, all_grids()[1::6])
    assert words.total() == 86 * 81
    assert words["found"] > 1000


@pytest.mark.nightly
@pytest.mark.parametrize("name", ["dissertation", "four", "sixteen"])
@pytest.mark.parametrize("planner", PLANNERS, ids=lambda p: p.name)
def test_every_query_with_other_moves(planner: Planner, name: str) -> None:
    words = ask_everything(planner, name, all_grids())
    assert {w: n for w, n in words.items() if "occupied" in w} == {
        w: n for w, n in VERDICTS.items() if "occupied" in w
    }


def test_a_sample_through_the_front_door() -> None:
    rng = np.random.default_rng(1)
    grids = all_grids()
    for _ in range(600):
        grid, free = grids[rng.integers(512)]
        start, goal = CELLS[rng.integers(9)], CELLS[rng.integers(9)]
        name = ("octile", "dissertation", "four", "sixteen")[rng.integers(4)]
        scene = Scene(grid, start, goal, name)
        known = distances(free, name, goal)
        for planner in ("astar", "dijkstra"):
            judge(lampyris.plan(scene, planner), scene, start, verdict(free, start, known, goal), known)
