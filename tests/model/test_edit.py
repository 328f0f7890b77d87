"""Edits as nouns: what they refuse, and the map after them."""

from __future__ import annotations

import numpy as np
import pytest

import lampyris
from lampyris.errors import LampyrisError, LimitError, SceneError, SettingError
from lampyris.model import edit as edits_module
from lampyris.model.edit import Edit, applied, check_edits
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene


def test_cells_become_pairs_of_whole_numbers() -> None:
    edit = Edit(np.int64(3), [[1, 2], np.array([3, 4])], ([5, 6],))  # type: ignore[arg-type]
    assert edit == Edit(3, ((1, 2), (3, 4)), ((5, 6),))
    assert {type(v) for cell in (*edit.blocked, *edit.freed) for v in cell} == {int}
    assert lampyris.Edit is Edit


@pytest.mark.parametrize(
    "given",
    [(-1,), (1.5,), (True,), ("1",), (1, [[1, 2], [1, 2]]), (1, [[1, 2]], [[1, 2]]), (1, [1, 2]), (1, [[1]]),
     (1, [[1, 2.5]]), (1, (), [[1, True]])],
)  # fmt: skip
def test_an_edit_refuses(given: tuple[object, ...]) -> None:
    with pytest.raises(SettingError) as caught:
        Edit(*given)  # type: ignore[arg-type]
    assert caught.value.code == "EDIT"


@pytest.mark.parametrize(
    ("edits", "kind", "code"),
    [
        ((Edit(0),), SettingError, "EDIT_TICK"),
        ((Edit(2), Edit(2)), SettingError, "EDIT_TICK"),
        ((Edit(3), Edit(2)), SettingError, "EDIT_TICK"),
        ((Edit(1, ((4, 0),)),), SceneError, "EDIT_OUTSIDE"),
        ((Edit(1, (), ((0, -1),)),), SceneError, "EDIT_OUTSIDE"),
        (((1, 2),), SettingError, "TYPE"),
        ((Edit(1),) * 10_001, LimitError, "LIMIT"),
    ],
)
def test_a_scene_refuses(edits: object, kind: type[LampyrisError], code: str) -> None:
    with pytest.raises(kind) as caught:
        Scene(Grid(np.zeros((3, 4), bool)), (0, 0), (1, 1), edits=edits)  # type: ignore[arg-type]
    assert caught.value.code == code
    assert "edits" in caught.value.what + caught.value.where


def test_cells_are_counted_in_all(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(edits_module, "MAX_EDITED", 3)
    grid = Grid(np.zeros((3, 4), bool))
    one = Edit(1, ((0, 0), (1, 0)))
    assert check_edits(grid, one) == (one,)
    with pytest.raises(LimitError):
        check_edits(grid, (one, Edit(2, ((0, 1),), ((0, 0),))))


def test_the_map_after_edits_cell_by_cell() -> None:
    rng = np.random.default_rng(5)
    for _ in range(60):
        height, width = (int(v) for v in rng.integers(1, 6, 2))
        blocked, unknown = rng.random((height, width)) < 0.4, rng.random((height, width)) < 0.3
        terrain = rng.integers(0, 253, (height, width)).astype(np.uint8)
        grid = Grid(blocked, unknown, terrain=terrain)
        before = grid.blocked.copy()
        now, known = {}, set()
        some = []
        for tick in range(int(rng.integers(0, 4))):
            cells = [(x, y) for y in range(height) for x in range(width) if rng.random() < 0.5]
            cut = int(rng.integers(len(cells) + 1))
            some.append(Edit(tick, tuple(cells[:cut]), tuple(cells[cut:])))
            now |= dict.fromkeys(cells[:cut], True) | dict.fromkeys(cells[cut:], False)
            known |= set(cells)
        made = applied(grid, some)
        assert (made is grid) == (not some)
        assert (grid.blocked == before).all()
        for y in range(height):
            for x in range(width):
                wall = now.get((x, y), bool(blocked[y, x]))
                assert made.blocked[y, x] == wall
                hidden = made.unknown is not None and made.unknown[y, x]
                assert hidden == (unknown[y, x] and (x, y) not in known)
                if made.terrain is not None:
                    # What lies under a wall of the map as given nobody knows.
                    assert made.terrain[y, x] == (0 if wall or blocked[y, x] else terrain[y, x])
