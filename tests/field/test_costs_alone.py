"""Costs that are wanted once: by a kernel of their own, the same as those of a field."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris.kernels.field import wavefront
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
            queue, waits = np.empty(frame.size, dtype=np.uint32), np.zeros(frame.size, dtype=np.uint8)
            form(cost, queue, waits, steps, frame.index(goal), np.zeros(1, dtype=np.int64))
            assert not waits.any()
            found = frame.inside(cost)
            assert np.array_equal(np.where(found == frame.never, -1, found), wanted)


@pytest.mark.parametrize("name", EIGHT)
def test_costs_along_a_path_come_from_it_where_nothing_is_compiled_yet(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[int] = []
    monkeypatch.setattr(wavefront.windows, "_compiled", None)
    monkeypatch.setattr(type(wavefront.windows), "pays", lambda self, *args: True)
    monkeypatch.setattr(
        "lampyris.planning.field.waves.costs_alone", lambda *args: (asked.append(1), costs_alone(*args))
    )
    moves = MOVES[name]
    for free, goal in _maps(12):
        exact = solve(free, moves, goal).exact
        monkeypatch.setattr(wavefront.windows, "_compiled", None)
        ys, xs = np.nonzero(exact >= 0)
        cells = np.stack((xs, ys), axis=1).astype(np.int32)
        assert np.array_equal(costs_along(free, moves, goal, cells), exact[ys, xs])
    assert len(asked) in (0, 12)
    assert asked or name not in ("octile",)


def test_costs_along_a_path_come_from_the_field_where_it_is_loaded(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: object) -> None:
        raise AssertionError("not asked for")

    wavefront.windows.compiled()
    monkeypatch.setattr("lampyris.planning.field.waves.costs_alone", fails)
    free, goal = _maps(1)[0]
    cells = np.array([goal], dtype=np.int32)
    assert costs_along(free, MOVES["octile"], goal, cells).tolist() == [0]
