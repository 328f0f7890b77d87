"""A sample of all 3x3 questions through the front door; ``lampyris selfcheck grids`` asks them all."""

from __future__ import annotations

from itertools import product

import numpy as np

import lampyris
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.referee import check_plan
from lampyris_selfcheck.reference.paths.search import cost_of, distances, verdict
from sizes import sized

CELLS = list(product(range(3), repeat=2))


@sized("cases", 150, 600)
def test_a_sample_through_the_front_door(cases: int) -> None:
    rng = np.random.default_rng(1)
    for _ in range(cases):
        blocked = rng.integers(2, size=(3, 3)).astype(bool)
        free = (~blocked).tolist()
        start, goal = CELLS[rng.integers(9)], CELLS[rng.integers(9)]
        name = ("octile", "dissertation", "four-connected", "sixteen-connected")[rng.integers(4)]
        scene = Scene(Grid(blocked), start, goal, name)
        known = distances(free, name, goal)
        for planner in ("astar", "dijkstra"):
            plan = lampyris.plan(scene, planner)
            case = f"{planner}, {name}, {start} to {goal} on {blocked.astype(int).tolist()}"
            assert plan.status == verdict(free, start, known, goal), case
            assert check_plan(plan, scene) is None, case
            if plan.path is not None:
                assert cost_of(plan.path.steps, name) == cost_of(known[start], name), case
