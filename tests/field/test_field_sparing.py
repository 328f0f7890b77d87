"""Fields in as little memory as can be: the same to the last bit."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from lampyris.kernels.field import descent
from lampyris.model.field import Field
from lampyris.model.moves import MOVES
from lampyris.planning.field import frame, waves
from lampyris.planning.field.solve import solve
from lampyris.typing import Cell
from reference.kernel_forms import run_compiled


def same(a: Field, b: Field) -> None:
    np.testing.assert_array_equal(a.exact, b.exact)
    np.testing.assert_array_equal(a.step, b.step)
    assert a.luciferin.tobytes() == b.luciferin.tobytes()
    assert a.expansions == b.expansions


@pytest.mark.commit(1)
@pytest.mark.parametrize("name", MOVES)
def test_random_maps(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With and without terrain and a cell to stop at; shares at which luciferin vanishes or overflows."""
    rng = np.random.default_rng(sum(name.encode()))
    for case in range(60):
        shape = tuple(int(v) for v in rng.integers(1, 30, 2))
        free = rng.random(shape) >= rng.choice([0.0, 0.1, 0.3, 0.5])
        ys, xs = np.nonzero(free)
        if not len(ys):
            continue
        goal, stop = ((int(xs[k]), int(ys[k])) for k in rng.integers(len(ys), size=2))
        moves, terrain = MOVES[name], None
        if case % 3 == 0:
            terrain = rng.integers(0, 253, shape).astype(np.uint8)
            moves = moves.weighed()
        rho, gamma = ((0.4, 0.6), (1.0, 1e308), (1e-300, 1e-300))[case % 5 % 3]
        until: Cell | None = stop if case % 4 == 0 else None

        def ask() -> Field:
            return solve(free, moves, goal, terrain=terrain, rho=rho, gamma=gamma, stop=until)  # noqa: B023

        as_usual = ask()
        monkeypatch.setattr(waves, "SPARING", 0)
        same(ask(), as_usual)
        monkeypatch.undo()


def test_a_spiral(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where nearly every parent is asked before it is known, and the climb is as long as the map."""
    size = 41
    free = np.zeros((size, size), dtype=np.bool_)
    x, y, dx, dy = 0, 0, 1, 0
    free[0, 0] = True
    for run in [size - 1, *(n for k in range(size - 1, 0, -2) for n in (k, k))]:
        for _ in range(run):
            x, y = x + dx, y + dy
            free[y, x] = True
        dx, dy = -dy, dx
    monkeypatch.setattr(waves, "SPARING", 0)
    for goal in ((0, 0), (x, y)):
        spared = solve(free, MOVES["four-connected"], goal)
        assert spared.expansions == int(free.sum())
        with monkeypatch.context() as patch:
            patch.setattr(waves, "SPARING", 2**31)
            same(spared, solve(free, MOVES["four-connected"], goal))


@pytest.mark.nightly
def test_both_forms() -> None:
    free = np.random.default_rng(4).random((40, 50)) >= 0.3
    free[20, 20] = True
    field = solve(free, MOVES["octile"], (20, 20))
    jump = np.zeros(128, dtype=np.int64)
    jump[:8] = [dy * 50 + dx for dx, dy in MOVES["octile"].offsets]
    cost, step = (np.ascontiguousarray(a).ravel() for a in (field.exact, field.step))
    for run in (descent.shine.run_plain, partial(run_compiled, descent.shine)):
        luciferin = np.zeros(free.size)
        run(
            cost, step, jump, luciferin, 50, 20 * 50 + 20, np.inf, 1.0 - 0.4, 0.6, float(MOVES["octile"].unit)
        )
        assert luciferin.tobytes() == field.luciferin.tobytes()


def test_lists_share_memory_only_where_they_fit() -> None:
    host = np.zeros(100, dtype=np.float64)
    small, large, middle = frame.Scratch().within(host, (10, np.int64), (200, np.int64), (80, np.int64))
    assert np.shares_memory(small, host)
    assert np.shares_memory(middle, host)
    assert not np.shares_memory(large, host)
    assert not np.shares_memory(small, middle)
    assert (len(small), len(large), len(middle)) == (10, 200, 80)
