"""Saving: what is written is read again, and by strangers too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lampyris.errors import FileError, UsageError
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map
from lampyris.io.maps.save import WRITERS, save_map
from lampyris.model.grid import Grid
from lampyris_selfcheck.reference.files.map_files import cells


def _document(seed: int, width: int, height: int) -> MapDocument:
    rng = np.random.Generator(np.random.PCG64(seed))
    kind = rng.choice(3, (height, width), p=[0.6, 0.3, 0.1])
    kind.flat[:4] = 0
    grid = Grid(kind > 0, unknown=kind == 2)
    return MapDocument(grid, start=(0, 0), goal=(2, 0), obstacle_cells=((1, 0), (3, 0)))


@pytest.mark.parametrize("ending", WRITERS)
@pytest.mark.parametrize("shape", [(4, 1), (5, 7), (64, 3), (9, 40)])
def test_round_trip(tmp_path: Path, ending: str, shape: tuple[int, int]) -> None:
    for seed in range(8):
        before = _document(seed, *shape)
        path = tmp_path / f"m{ending}"
        save_map(before, path)
        after = load_map(path)
        assert after.grid.blocked.tolist() == before.grid.blocked.tolist()
        if ending != ".map":
            assert cells(after) == cells(before)
        if ending in (".png", ".txt"):
            assert (after.start, after.goal, after.obstacle_cells) == (
                before.start,
                before.goal,
                before.obstacle_cells,
            )
        else:
            assert (after.start, after.goal, after.obstacle_cells) == (None, None, ())
        again = tmp_path / f"n{ending}"
        save_map(after, again)
        if ending in (".png", ".txt"):
            assert again.read_bytes() == path.read_bytes()


@pytest.mark.parametrize("ending", WRITERS)
def test_a_bare_grid_in_every_format(tmp_path: Path, ending: str) -> None:
    grid = Grid([[True, False], [False, False]])
    save_map(grid, tmp_path / f"M{ending.upper()}")
    assert cells(load_map(tmp_path / f"M{ending.upper()}")) == ["#.", ".."]


def test_strangers_read_the_same(tmp_path: Path) -> None:
    before = _document(3, 20, 10)
    for ending in (".png", ".pgm", ".npy"):
        save_map(before, tmp_path / f"m{ending}")
    grey = np.asarray(Image.open(tmp_path / "m.pgm"))
    assert before.grid.unknown is not None
    assert ((grey == 0) == (before.grid.blocked & ~before.grid.unknown)).all()
    assert ((grey == 205) == before.grid.unknown).all()
    colour = np.asarray(Image.open(tmp_path / "m.png").convert("RGB"))
    assert colour[0, 0].tolist() == [255, 0, 0]
    assert colour[0, 2].tolist() == [255, 215, 0]
    assert colour[0, 1].tolist() == [255, 20, 147]
    assert ((np.load(tmp_path / "m.npy") != 0) == before.grid.blocked).all()


def test_the_guide_map_stays_itself(tmp_path: Path) -> None:
    guide = load_map("guide")
    save_map(guide, tmp_path / "g.png")
    again = load_map(tmp_path / "g.png")
    assert (again.start, again.goal) == ((0, 9), (7, 0))
    assert cells(again) == cells(guide)


def test_refused(tmp_path: Path) -> None:
    grid = Grid([[False]])
    with pytest.raises(UsageError, match=r"MAP_ENDING.*\.gif"):
        save_map(grid, tmp_path / "m.gif")
    with pytest.raises(FileError, match="FILE_WRITE"):
        save_map(grid, tmp_path / "no" / "m.png")
    with pytest.raises(FileError, match="FILE_WRITE"):
        save_map(grid, tmp_path / "nul\0.png")
