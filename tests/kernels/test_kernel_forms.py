"""The plain and the compiled form of every field kernel give the same bytes."""

from __future__ import annotations

import numpy as np
import pytest

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
