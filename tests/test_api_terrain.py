"""The front door over terrain: plans, profiles and drives, each judged by the referee on its way out."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import lampyris
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import RandomWalk
from lampyris.planning.assess import assess
from lampyris.planning.field.layers import moves_for
from lampyris.planning.field.solve import solve_field


def rough(seed: int, moves: str, radius: float = 0.0) -> Scene:
    rng = np.random.default_rng(seed)
    blocked = rng.random((16, 18)) < (0.03 if radius else 0.15)
    for y, x in ((0, 0), (0, 1), (1, 0), (1, 1), (15, 17), (14, 17), (15, 16), (14, 16)):
        blocked[y, x] = False
    terrain = rng.integers(0, 253, blocked.shape) * (rng.random(blocked.shape) < 0.5)
    return Scene(Grid(blocked, terrain=terrain), (0, 0), (17, 15), moves, Robot(radius=radius))


@pytest.mark.commit(4)
@pytest.mark.parametrize("name", sorted(MOVES))
@pytest.mark.parametrize("planner", ["ad-gso", "astar", "dijkstra"])
def test_a_plan_is_measured_against_the_optimum_over_terrain(planner: str, name: str) -> None:
    found = gaps = 0
    for seed in range(8):
        scene = rough(seed, name, 0.6 if seed % 4 == 3 else 0.0)
        plan = lampyris.plan(scene, planner)
        field = solve_field(scene)
        assert bool(plan) == (field.exact[0, 0] >= 0)
        if plan.path is None:
            continue
        found += 1
        assert plan.path.moves == moves_for(scene)
        assert plan.optimal_exact == field.exact[0, 0]
        assert plan.optimal_cost == pytest.approx(field.cost[0, 0], rel=1e-15)
        gap = plan.path.exact / int(field.exact[0, 0]) - 1
        assert plan.gap == pytest.approx(gap, abs=1e-15)
        gaps += plan.gap > 0
        x, y = plan.path.cells[:, 0], plan.path.cells[:, 1]
        assert plan.sum_cost_to_go == pytest.approx(math.fsum(field.cost[y, x].tolist()), rel=1e-12)
        bare = replace(plan, optimal_exact=None, sum_cost_to_go=None)
        told = assess(bare, scene)
        assert (told.optimal_exact, told.gap) == (plan.optimal_exact, plan.gap)
        assert told.sum_cost_to_go == pytest.approx(plan.sum_cost_to_go, rel=1e-12)
        for law in ("physical", "dissertation"):
            assert len(lampyris.speed_profile(scene, plan, law).v) == len(plan.path.cells)
    assert found >= 4
    assert (gaps > 0) == (planner == "ad-gso")


def test_dear_ground_is_gone_round() -> None:
    """A swamp across the straight way: twice as dear is not worth the detour, five times is."""
    for value, cost in ((63, 8 + 3), (252, 6 + 6 * 2**0.5 + 2)):
        terrain = np.zeros((13, 9), int)
        terrain[1:12, 3:6] = value
        scene = Scene(Grid(np.zeros((13, 9), bool), terrain=terrain), (0, 6), (8, 6), "octile")
        plan = lampyris.plan(scene, "astar")
        assert plan.cells is not None
        assert any(terrain[y, x] for x, y in plan.cells) == (value == 63)
        assert plan.cost == pytest.approx(cost, rel=1e-15)


@pytest.mark.parametrize("name", sorted(MOVES))
@pytest.mark.parametrize("planner", ["ad-gso", "astar"])
def test_a_drive_over_terrain_pays_for_what_it_drove_over(planner: str, name: str) -> None:
    arrived = 0
    for seed in range(3):
        scene = replace(rough(seed, name, 0.6 if seed == 2 else 0.0), traffic=(RandomWalk(count=6),))
        run = lampyris.simulate(scene, planner, seed=seed)
        assert scene.grid.terrain is not None
        assert run.path is not None
        assert run.path.moves == scene.moves.weighed()
        entered = [63 + int(scene.grid.terrain[y, x]) for x, y in run.path.cells[1:].tolist()]
        assert len(entered) == sum(run.path.steps)
        if run.outcome is Outcome.ARRIVED:
            arrived += 1
            assert run.path.exact >= int(solve_field(scene).exact[0, 0])
    assert arrived >= 2


def test_traffic_is_placed_as_on_plain_ground() -> None:
    """Obstacles take shortest ways: what ground costs the robot is nothing to them."""
    scene = replace(rough(1, "octile"), traffic=(RandomWalk(count=5), lampyris.Crossing(count=2)))
    plain = replace(scene, grid=replace(scene.grid, terrain=None))
    over, without = (lampyris.simulate(s, "astar", seed=4, ticks=1) for s in (scene, plain))
    assert [t[0].tolist() for t in over.tracks] == [t[0].tolist() for t in without.tracks]
    assert len(over.tracks) == 7
