"""Keepout masks: what Nav2's keepout filter makes of a costmap."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import in_process
import lampyris
from lampyris.errors import FileError, UsageError
from lampyris.io.maps.keepout import read_keepout


def mask(
    folder: Path,
    grey: np.ndarray,
    *,
    mode: str = "raw",
    resolution: float = 0.5,
    origin: str = "[0.0, 0.0, 0.0]",
) -> Path:
    Image.fromarray(grey.astype(np.uint8)).save(folder / "mask.pgm")
    file = folder / "mask.yaml"
    file.write_text(
        f"image: mask.pgm\nresolution: {resolution}\norigin: {origin}\nnegate: 0\nmode: {mode}\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return file


def test_each_value_costs_what_nav2s_filter_says(tmp_path: Path) -> None:
    values = np.arange(102).reshape(2, 51)  # 101 is unknown
    kept, costs, _ = read_keepout(
        mask(tmp_path, values), lampyris.Grid(np.zeros((2, 51), dtype=bool), resolution=0.5)
    )
    assert np.argwhere(kept).tolist() == [[1, 49]]
    for value in range(100):
        by_hand = int(value * 254 / 100 + 0.5)  # std::round of a number that is not negative
        assert costs.ravel()[value] == min(by_hand, 252)
    assert costs[1, 50] == 0


def test_a_finer_mask_elsewhere_covers_the_cells_whose_centres_it_holds(tmp_path: Path) -> None:
    grid = lampyris.Grid(np.zeros((6, 8), dtype=bool), resolution=1.0)
    file = mask(
        tmp_path, np.full((4, 4), 100), resolution=0.5, origin="[2.0, 1.0, 0.0]"
    )  # x 2 to 4, y 1 to 3
    kept, _, notes = read_keepout(file, grid)
    assert {(x, y) for y, x in np.argwhere(kept).tolist()} == {(2, 3), (3, 3), (2, 4), (3, 4)}
    assert "4 free cells kept out, 44 cells beyond the mask" in notes[-1]


def test_the_path_keeps_out_and_so_does_the_saved_scenario(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", np.zeros((9, 9), dtype=bool))
    grey = np.full((9, 9), 254)
    grey[2:9, 4] = 0
    file = mask(tmp_path, grey, mode="trinary", resolution=1.0)
    saved = tmp_path / "s.yaml"
    words = (
        str(tmp_path / "map.npy"),
        "--start",
        "1,6",
        "--goal",
        "7,6",
        "--planner",
        "astar",
        "--keepout",
        str(file),
    )
    for call in (("plan", *words, "--save-scenario", str(saved)), ("run", str(saved))):
        done = in_process.call(*call, "--json", "--no-timing", "--force" if call[0] == "plan" else "--json")
        assert done.returncode == 0, done.stderr
        assert min(y for x, y in __import__("json").loads(done.stdout)["cells"] if x == 4) <= 1


def test_masks_that_are_none_are_refused(tmp_path: Path) -> None:
    grid = lampyris.Grid(np.zeros((4, 4), dtype=bool))
    with pytest.raises(FileError, match="no cell of the map"):
        read_keepout(mask(tmp_path, np.zeros((2, 2)), origin="[100.0, 0.0, 0.0]"), grid)
    with pytest.raises(UsageError, match="SUFFIX"):
        read_keepout(tmp_path / "mask.png", grid)
