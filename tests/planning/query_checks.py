"""Random questions to exact planners, judged by the plain reference and the referee."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.planning.base import Planner
from lampyris.referee import check_plan
from lampyris_selfcheck.reference.paths.search import cost_of, distances, verdict

NAMES = sorted(MOVES)
RNG = np.random.default_rng(0)  # Never drawn from: these planners are deterministic.


def ask_at_random(planners: Sequence[Planner], name: str, seed: int, queries: int) -> Counter[str]:
    """So many queries on random maps of 3 to 24 cells a side, five starts to a map and goal.

    Each answer must have the reference's verdict and, found, its exact cost. Returns how often each verdict was.
    """
    rng = np.random.default_rng([seed, NAMES.index(name)])
    words: Counter[str] = Counter()
    for _ in range(queries // 5):
        height, width = (int(n) for n in rng.integers(3, 25, size=2))
        free = rng.random((height, width)) >= rng.choice([0.0, 0.1, 0.25, 0.4, 0.5])
        rows = free.tolist()
        goal = (int(rng.integers(width)), int(rng.integers(height)))
        known = distances(rows, name, goal)
        grid = Grid(~free)
        sessions = [p.open(Scene(grid, goal, goal, name), RNG) for p in planners]
        for _ in range(5):
            start = (int(rng.integers(width)), int(rng.integers(height)))
            scene = Scene(grid, start, goal, name)
            word = verdict(rows, start, known, goal)
            words[word] += 1
            for session in sessions:
                plan = session.plan(Change(robot=start))
                case = f"{plan.planner}, {name}, {start} to {goal} on\n{grid.blocked.astype(int)}"
                assert plan.status == word, case
                broken = check_plan(plan, scene)
                assert broken is None, f"{broken}: {case}"
                if plan.path is not None:
                    assert cost_of(plan.path.steps, name) == cost_of(known[start], name), case
                    assert plan.optimal_exact == plan.path.exact
    return words


def turned(free: np.ndarray, k: int) -> np.ndarray:
    """One of the eight turned or mirrored copies of a map."""
    return np.rot90(free.T if k & 4 else free, k & 3)


def turned_cell(cell: tuple[int, int], shape: tuple[int, ...], k: int) -> tuple[int, int]:
    """Where a cell of a map of that shape is in its copy."""
    mark = np.zeros(shape, dtype=bool)
    mark[cell[1], cell[0]] = True
    y, x = np.argwhere(turned(mark, k))[0]
    return int(x), int(y)
