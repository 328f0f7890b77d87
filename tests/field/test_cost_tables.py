"""Compact tables of costs are the costs of the fields."""

from __future__ import annotations

import numpy as np
import pytest

import lampyris
from lampyris.errors import LimitError, SceneError, SettingError
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene


@pytest.mark.parametrize("moves", ["four-connected", "dissertation"])
@pytest.mark.parametrize("dtype", ["uint16", "uint32"])
def test_they_are_the_costs_of_fields(moves: str, dtype: str) -> None:
    rng = np.random.default_rng(7)
    walls = rng.random((21, 33)) < 0.3
    walls[0, 0] = False
    scene = Scene(Grid(walls), (0, 0), (0, 0), moves)
    goals = [(int(x), int(y)) for x, y in zip(rng.integers(0, 33, 19), rng.integers(0, 21, 19), strict=True)]
    assert any(walls[y, x] for x, y in goals)
    never = np.iinfo(dtype).max
    tables = [list(lampyris.solve_fields(scene, goals, dtype=dtype, workers=n)) for n in (1, 3)]
    assert len(tables[0]) == len(goals)
    for one, again, field in zip(*tables, lampyris.solve_fields(scene, goals), strict=True):
        assert one.dtype == dtype
        assert not one.flags.writeable
        assert one.tobytes() == again.tobytes()
        assert np.array_equal(one, np.where(field.exact < 0, never, field.exact.astype(np.int64)))


def test_what_is_refused() -> None:
    scene = Scene(Grid(np.zeros((3, 4), dtype=bool)), (0, 0), (1, 1), "four-connected")
    with pytest.raises(SettingError, match="uint16, uint32, or None"):
        lampyris.solve_fields(scene, [(0, 0)], dtype="int8")
    with pytest.raises(SceneError, match="outside"):
        list(lampyris.solve_fields(scene, [(0, 0), (4, 0)], dtype="uint16"))
    assert list(lampyris.solve_fields(scene, [], dtype="uint16")) == []


@pytest.mark.nightly
@pytest.mark.parametrize("moves", ["four-connected", "dissertation"])
def test_costs_that_do_not_fit_are_refused(moves: str) -> None:
    walls = np.zeros((367, 367), dtype=bool)
    walls[1::4, :-1] = walls[3::4, 1:] = True
    scene = Scene(Grid(walls), (0, 0), (0, 366), moves)
    with pytest.raises(LimitError, match="does not fit into uint16"):
        list(lampyris.solve_fields(scene, [(0, 0)], dtype="uint16"))
    assert next(iter(lampyris.solve_fields(scene, [(0, 0)], dtype="uint32"))).max() == 2**32 - 1
