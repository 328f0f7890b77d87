"""The plain and the compiled form of every field kernel give the same bytes."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.kernels.field import descent
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES
from lampyris.model.robot import Robot
from lampyris.planning.field.gates import find_gates
from lampyris.planning.field.layers import clearance
from lampyris.planning.field.solve import solve
from reference.kernel_forms import use


def _grids(count: int, seed: int) -> list[tuple[np.ndarray, tuple[int, int], tuple[int, int]]]:
    rng = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        height, width = rng.integers(1, 28, 2)
        free = rng.random((height, width)) >= 0.5 * rng.random()
        ends = [(int(rng.integers(width)), int(rng.integers(height))) for _ in range(2)]
        out.append((free, ends[0], ends[1]))
    return out


@pytest.mark.parametrize("name", MOVES)
@pytest.mark.parametrize("stopping", [False, True])
def test_fields(name: str, stopping: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    results = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        results[form] = [
            solve(free, MOVES[name], goal, rho=0.37, gamma=0.7, stop=stop if stopping else None)
            for free, goal, stop in _grids(40, 7)
        ]
    for a, b in zip(results["plain"], results["compiled"], strict=True):
        for what in ("exact", "step", "luciferin", "free"):
            assert getattr(a, what).tobytes() == getattr(b, what).tobytes(), what
        assert a.expansions == b.expansions


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", MOVES)
@pytest.mark.parametrize("stopping", [False, True])
def test_fields_over_terrain(name: str, stopping: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    results = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        rng = np.random.default_rng(9)
        results[form] = [
            solve(
                free,
                MOVES[name].weighed(),
                goal,
                terrain=(rng.integers(0, 253, free.shape) * (rng.random(free.shape) < 0.5)).astype(np.uint8),
                rho=0.37,
                gamma=0.7,
                stop=stop if stopping else None,
            )
            for free, goal, stop in _grids(40, 9)
        ]
    for a, b in zip(results["plain"], results["compiled"], strict=True):
        for what in ("exact", "step", "luciferin"):
            assert getattr(a, what).tobytes() == getattr(b, what).tobytes(), what
        assert a.expansions == b.expansions


@pytest.mark.parametrize("guard", [0, -1])
def test_operations_on_whole_arrays_are_the_loops(guard: int) -> None:
    """Parents and luciferin by arrays, by the loops as written, and compiled."""
    rng = np.random.default_rng(5)
    for k in range(12):
        rows, width = (int(n) + 2 for n in rng.integers(1, 14, 2))
        free = np.zeros((rows, width), dtype=bool)
        free[1:-1, 1:-1] = rng.random((rows - 2, width - 2)) >= 0.3
        goal = (int(rng.integers(1, width - 1)), int(rng.integers(1, rows - 1)))
        free[goal[1], goal[0]] = True
        cost = _costs(free, goal, bool(guard))
        limit = 2**30 if k % 2 else int(np.median(cost[cost >= 0])) + 1
        results = []
        for form in (descent.parents8.run_plain, descent.parents8.linked(), descent.parents8.compiled()):
            costs, steps = cost.copy(), np.full(cost.shape, -7, dtype=np.int8)
            form(
                costs.reshape(-1),
                steps.reshape(-1),
                width,
                rows,
                10,
                14,
                guard,
                limit,
                np.zeros(1, dtype=np.int64),
            )
            results.append((costs.tobytes(), steps.tobytes()))
        assert results[0] == results[1] == results[2]
        order = np.argsort(costs, axis=None, kind="stable").astype(np.uint32)
        order = order[costs.reshape(-1)[order] >= 0]
        count = len(order)
        assert order[0] == goal[1] * width + goal[0]
        order = np.concatenate([order, np.zeros(25, dtype=np.uint32)])
        jump = np.array([dy * width + dx for dx, dy in OFFSETS])
        shone = []
        for form in (descent.glow.run_plain, descent.glow.linked(), descent.glow.compiled()):
            luciferin = np.full(cost.size, -1.0)
            given = (costs.reshape(-1), steps.reshape(-1), jump, luciferin, np.inf, 0.63, 0.7, 10)
            form(order, count, *given, np.zeros(1, dtype=np.int64))
            shone.append(luciferin.tobytes())
        assert shone[0] == shone[1] == shone[2]


OFFSETS = ((-1, -1), (1, -1), (-1, 1), (1, 1), (-1, 0), (1, 0), (0, -1), (0, 1))


def _costs(free: np.ndarray, goal: tuple[int, int], guarded: bool) -> np.ndarray:
    """Costs to the goal by relaxing until nothing changes; walls -1, cells without a way far above all."""
    never = 2**40
    cost = np.where(free, never, -1)
    cost[goal[1], goal[0]] = 0
    changed = True
    while changed:
        changed = False
        for y, x in np.argwhere(free):
            for dx, dy in OFFSETS:
                sides = free[y, x + dx] and free[y + dy, x]
                if not free[y + dy, x + dx] or (dx and dy and guarded and not sides):
                    continue
                through = cost[y + dy, x + dx] + (14 if dx and dy else 10)
                if through < cost[y, x]:
                    cost[y, x] = through
                    changed = True
    return cost


@pytest.mark.nightly
def test_clearance_and_gates(monkeypatch: pytest.MonkeyPatch) -> None:
    results = {}
    for form in ("plain", "compiled"):
        use(monkeypatch, form)
        results[form] = [
            (clearance(grid).tobytes(), find_gates(grid), find_gates(grid, Robot(radius=1.2)))
            for grid in (Grid(~free) for free, _, _ in _grids(40, 8))
        ]
    assert results["plain"] == results["compiled"]
