"""Costs that are wanted once: by a kernel of their own, the same as those of a field."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from lampyris.kernels.field import bucket_wavefront, wavefront
from lampyris.kernels.field.costs_alone import costs_alone
from lampyris.model.moves import MOVES
from lampyris.planning.field.frame import BorderedMap
from lampyris.planning.field.solve import costs_along, solve
from lampyris.typing import BoolGrid

EIGHT = [name for name, moves in MOVES.items() if len(moves.offsets) == 8]


def _maps(count: int) -> list[tuple[BoolGrid, tuple[int, int]]]:
    rng = np.random.default_rng(8)
    made = []
    for _ in range(count):
        free = rng.random(tuple(rng.integers(1, 24, 2).tolist())) >= 0.5 * rng.random()
        goal = (int(rng.integers(free.shape[1])), int(rng.integers(free.shape[0])))
        free[goal[1], goal[0]] = True
        made.append((free, goal))
    return made


@pytest.mark.parametrize("name", MOVES)
def test_costs_are_those_of_the_field(name: str) -> None:
    moves = MOVES[name]
    for free, goal in _maps(25):
        frame = BorderedMap(free, moves)
        wanted = solve(free, moves, goal).exact
        columns = (*frame.table(moves), np.array(moves.costs, dtype=np.int64))
        steps = np.stack(columns, axis=1).ravel()
        for form in (costs_alone.run_plain, costs_alone.compiled()):
            cost = frame.lay(np.where(free, frame.never + 1, 0), frame.dtype) - frame.dtype(1)
            queue, waits = np.empty(free.sum() + 1, dtype=np.uint32), np.zeros(frame.size, dtype=np.uint8)
            assert form(cost, queue, waits, steps, frame.index(goal), np.zeros(1, dtype=np.int64)) == 1
            assert not waits.any()
            found = frame.inside(cost)
            assert np.array_equal(np.where(found == frame.never, -1, found), wanted)


@pytest.mark.parametrize("name", EIGHT)
def test_costs_along_a_path_come_from_it_where_nothing_is_compiled_yet(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = _ask_before_fields(monkeypatch)
    moves = MOVES[name]
    for free, goal in _maps(12):
        exact = solve(free, moves, goal).exact
        _unload(monkeypatch)
        ys, xs = np.nonzero(exact >= 0)
        cells = np.stack((xs, ys), axis=1).astype(np.int32)
        assert np.array_equal(costs_along(free, moves, goal, cells), exact[ys, xs])
    assert done == ([1] * 12 if moves.costs == (moves.diagonal,) * 4 + (moves.unit,) * 4 else [])


def _ask_before_fields(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Have costs come from the kernel; what it returns."""
    done: list[int] = []

    def noted(*args: Any) -> int:
        done.append(costs_alone(*args))
        return done[-1]

    monkeypatch.setattr(type(wavefront.windows), "pays", lambda self, *args: True)
    monkeypatch.setattr("lampyris.planning.field.waves.costs_alone", noted)
    return done


def _unload(monkeypatch: pytest.MonkeyPatch) -> None:
    for loop in (wavefront.windows, bucket_wavefront.two_heads):
        monkeypatch.setattr(loop, "_compiled", None)


def _detours(many: int) -> BoolGrid:
    """Corridors one cell wide in a row: each tent of 16 diagonal steps has a detour below it of 20 steps that costs less."""
    free = np.zeros((16, 19 * many), dtype=bool)
    free[10, ::19] = True
    for x in range(1, 19 * many, 19):
        for i in range(17):
            free[10 - min(i, 16 - i), x + i] = True
        free[10:14, [x, x + 16]] = True
        free[13, x : x + 17] = True
        free[10, x + 16 : x + 19] = True
    return free[:, : 19 * many]


def test_it_is_given_up_where_cells_are_expanded_again_and_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Forty detours took 18 expansions a cell, 4,000 of them 500 times as long as the field."""
    free, moves, goal = _detours(40), MOVES["dissertation"], (0, 10)
    exact = solve(free, moves, goal).exact
    done = _ask_before_fields(monkeypatch)
    _unload(monkeypatch)
    ys, xs = np.nonzero(exact >= 0)
    assert len(ys) == np.count_nonzero(free)
    cells = np.stack((xs, ys), axis=1).astype(np.int32)
    assert np.array_equal(costs_along(free, moves, goal, cells), exact[ys, xs])
    assert done == [0]


@pytest.mark.parametrize("name", EIGHT)
def test_costs_along_a_path_come_from_the_field_where_it_is_loaded(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise AssertionError("not asked for")

    _unload(monkeypatch)
    (bucket_wavefront.two_heads if MOVES[name].corner_cutting else wavefront.windows).compiled()
    monkeypatch.setattr(type(wavefront.windows), "pays", lambda self, *args: True)
    monkeypatch.setattr("lampyris.planning.field.waves.costs_alone", fails)
    free, goal = _maps(1)[0]
    cells = np.array([goal], dtype=np.int32)
    assert costs_along(free, MOVES[name], goal, cells).tolist() == [0]
