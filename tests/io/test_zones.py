"""Speed zones: masks of Nav2's speed filter, and numbers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import LampyrisError
from lampyris.io.maps.zones import read_zones
from lampyris.model.grid import Grid
from lampyris_selfcheck.reference.files.map_files import put

INF = float("inf")
GRID = Grid(np.zeros((2, 3), bool), resolution=0.5, origin=(1.0, 2.0, 0.0))
YAML = (
    "image: z.pgm\nresolution: 0.5\norigin: [1.0, 2.0, 0]\nnegate: 0\n"
    "occupied_thresh: 1.0\nfree_thresh: 0.0\n"
)


def mask(folder: Path, text: str, grey: list[int], name: str = "z.yaml") -> Path:
    (folder / "z.pgm").write_bytes(b"P5 3 2 255\n" + bytes(grey))
    return put(folder, text.encode(), name)


def test_a_mask_of_nav2_is_per_cents_of_the_greatest_speed(tmp_path: Path) -> None:
    zones, notes = read_zones(mask(tmp_path, YAML + "mode: raw\n", [0, 1, 50, 100, 99, 0]), GRID, 2.0)
    assert zones == pytest.approx(np.array([[INF, 0.02, 1.0], [2.0, 1.98, INF]]))
    assert notes == ("4 cells with a speed limit",)
    assert not zones.flags.writeable
    # Scale: darker is a higher value, as the documentation of the filter draws it.
    zones, _ = read_zones(mask(tmp_path, YAML + "mode: scale\n", [255, 0, 127, 255, 64, 204]), GRID, 1.0)
    assert zones[0].tolist() == [INF, 1.0, 0.5]
    assert zones[1].tolist() == [INF, 0.75, 0.2]


@pytest.mark.parametrize(
    ("text", "grey", "says"),
    [
        (YAML, [0] * 6, "ZONES_MODE.*z.yaml:1:1: mode trinary.*scale, or raw"),
        (YAML + "mode: trinary\n", [0] * 6, "ZONES_MODE.*z.yaml:7:7"),
        (YAML + "mode: raw\n", [0, 0, 0, 0, 101, 0], r"ZONES_VALUE.*cell \(1,1\): unknown"),
        (YAML.replace("0.5\n", "0.25\n") + "mode: raw\n", [0] * 6, "ZONES_MAP.*resolution 0.25.*the map's"),
        (YAML.replace("[1.0", "[3.0") + "mode: raw\n", [0] * 6, r"ZONES_MAP.*origin \[3, 2, 0\]"),
    ],
)
def test_a_mask_that_says_no_speed_is_refused(tmp_path: Path, text: str, grey: list[int], says: str) -> None:
    with pytest.raises(LampyrisError, match=says):
        read_zones(mask(tmp_path, text, grey), GRID, 1.0)


def test_numbers_are_metres_a_second(tmp_path: Path) -> None:
    want = np.array([[0.5, INF, 1.0], [INF, 3.0, 2.5]])
    for kind in ("<f8", ">f4", "<f2"):
        np.save(tmp_path / "z.npy", want.astype(kind))
        assert read_zones(tmp_path / "z.npy", GRID, 9.0)[0].tolist() == want.tolist()
    np.save(tmp_path / "f.npy", np.asfortranarray(want))
    assert read_zones(tmp_path / "f.npy", GRID, 9.0)[0].tolist() == want.tolist()
    for text in ("0.5,,1\ninf,3,2.5\n", "\ufeff.5; inf ;1e0\r\n;3;2.5\r\n\r\n", "# m/s\n0.5\t\t1\n\t3\t2.5"):
        file = put(tmp_path, text.encode(), "z.csv")
        assert read_zones(file, GRID, 9.0)[0].tolist() == want.tolist(), text
    # No note, and nothing but the file is looked at.
    assert read_zones(file, GRID, 9.0)[1] == ()


@pytest.mark.parametrize(
    ("name", "text", "says"),
    [
        ("z.csv", "1,1,1\n1,0,1\n", r"ZONES_VALUE.*z.csv: line 2, field 2: '0'; allowed: a speed > 0"),
        ("z.csv", "1,1,1\n1,nan,1\n", "ZONES_VALUE.*'nan'"),
        ("z.csv", "1,1,1\n1,-1,1\n", "ZONES_VALUE.*'-1'"),
        ("z.csv", "1,1\n1,1\n", "ZONES_MAP.*line 1: 2 fields in row 1; allowed: the map's 3 x 2 cells"),
        ("z.csv", "1,1,1\n", "ZONES_MAP.*3 x 1 cells"),
        ("z.csv", "1,1,1\n" * 3, "ZONES_MAP.*line 3: row 3"),
        ("z.npy", "nothing", "NPY_HEADER"),
        ("z.png", "", "SUFFIX.*'.png'.*yaml"),
        ("z.yaml", "", "YAML_SHAPE"),
    ],
)
def test_numbers_that_are_no_speeds_are_refused(tmp_path: Path, name: str, text: str, says: str) -> None:
    with pytest.raises(LampyrisError, match=says):
        read_zones(put(tmp_path, text.encode(), name), GRID, 1.0)


@pytest.mark.parametrize(
    ("cells", "says"),
    [
        (np.ones((3, 2)), "ZONES_MAP.*2 x 3 cells"),
        (np.ones((2, 3), np.int8), r"NPY_TYPE.*astype\('float64'\)"),
        (np.array([[1, 2, 0.0], [1, 1, 1]]), r"ZONES_VALUE.*cell \(2,0\): 0.0"),
        (np.array([[1, 2, 1], [np.nan, 1, 1]]), r"ZONES_VALUE.*cell \(0,1\): nan"),
        (np.array([[1, 2, 1], [-np.inf, 1, 1]]), r"ZONES_VALUE.*cell \(0,1\): -inf"),
    ],
)
def test_arrays_that_are_no_speeds_are_refused(tmp_path: Path, cells: np.ndarray, says: str) -> None:
    np.save(tmp_path / "z.npy", cells)
    with pytest.raises(LampyrisError, match=says):
        read_zones(tmp_path / "z.npy", GRID, 1.0)


def test_a_mask_may_not_name_pictures_elsewhere(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    mask(tmp_path, "", [0] * 6)
    file = put(tmp_path / "in", (YAML.replace("z.pgm", "../z.pgm") + "mode: raw\n").encode(), "z.yaml")
    with pytest.raises(LampyrisError, match="PATH_OUTSIDE"):
        read_zones(file, GRID, 1.0)
    assert np.isinf(read_zones(file, GRID, 1.0, allow_outside=True)[0]).all()
