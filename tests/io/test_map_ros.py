"""ROS maps: the rules of nav2_map_server against values computed by hand, metres with yaw, writing."""

from __future__ import annotations

import csv
import json
import math
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import lampyris
from lampyris.errors import FileError, SettingError, UsageError
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.formats.ros_write import save_ros
from lampyris.io.maps.load import load_map
from lampyris.io.maps.save import save_map
from lampyris.model.grid import Grid
from lampyris_selfcheck.reference.files.map_files import cells, chunk, png, put, rows

DATA = Path(__file__).resolve().parents[1] / "data"
YAML = """\
image: m.pgm
mode: trinary
resolution: 0.050
origin: [0.000, 0.000, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""


def table(name: str) -> list[dict[str, str]]:
    with (DATA / name).open(encoding="utf-8", newline="") as stream:
        return list(csv.DictReader(stream))


def ros(folder: Path, picture: bytes, image: str = "m.pgm", **keys: object) -> Path:
    """A YAML file and its picture; keys replace or add lines."""
    lines = dict(line.split(": ", 1) for line in YAML.splitlines())
    lines |= {key: str(value) for key, value in keys.items()} | {"image": image}
    put(folder, picture, image)
    return put(folder, "".join(f"{k}: {v}\n" for k, v in lines.items()).encode(), "m.yaml")


def pgm(*lines: list[int], maxval: int = 255) -> bytes:
    raster = b"".join(bytes(line) for line in lines)
    return f"P5\n{len(lines[0])} {len(lines)}\n{maxval}\n".encode() + raster


def picture(kind: str, sample: str) -> bytes:
    """One pixel, as a file."""
    if kind == "grey8":
        return png(1, 1, 8, 0, rows([int(sample)]))
    if kind == "alpha":
        grey, alpha = sample.split("/")
        return png(1, 1, 8, 4, rows([int(grey), int(alpha)]))
    if kind == "grey16":
        return png(1, 1, 16, 0, rows(int(sample).to_bytes(2, "big")))
    if kind == "pgm100":
        return f"P2 1 1 100\n{sample}\n".encode()
    if kind == "bitmap":
        return f"P1 1 1\n{sample}\n".encode()
    channels = [int(v) for v in sample.split()]
    if kind.startswith("palette"):
        # The colour is number 1; number 0 is its opposite, opaque.
        before = chunk(b"PLTE", bytes([255 - v for v in channels] + channels))
        if kind == "palette-alpha":
            before += chunk(b"tRNS", b"\xff\xfe")
        return png(1, 1, 8, 3, rows([1]), before=before)
    return png(1, 1, 8, 6 if kind == "rgba" else 2, rows(channels))


def test_the_vector_has_what_it_should() -> None:
    cases = table("ros_vector.csv")
    assert len(cases) >= 40
    assert {case["mode"].lower() for case in cases} == {"trinary", "scale", "raw"}
    assert {case["negate"] for case in cases} == {"0", "1"}
    assert {case["value"] for case in cases} >= {"-1", "0", "100", "67"}


@pytest.mark.commit(35)
@pytest.mark.parametrize("case", table("ros_vector.csv"), ids=lambda c: "-".join(list(c.values())[:6]))
def test_a_pixel_is_what_was_computed_by_hand(tmp_path: Path, case: dict[str, str]) -> None:
    keys = {key: case[key] for key in ("mode", "negate", "occupied_thresh", "free_thresh")}
    found = load_map(ros(tmp_path, picture(case["picture"], case["sample"]), **keys))
    value = int(case["value"])
    assert found.occupancy is not None
    assert found.occupancy.tolist() == [[value]], case["why"]
    assert cells(found) == [{0: ".", -1: "?"}.get(value, "#")], "only 0 is free, -1 alone is unknown"


def test_the_picture_is_not_flipped(tmp_path: Path) -> None:
    found = load_map(ros(tmp_path, pgm([0, 254, 254], [205, 254, 0])))
    assert cells(found) == ["#..", "?.#"]
    # data[0] of an OccupancyGrid is the lower-left cell, at the origin.
    assert found.grid.to_cell(0.01, 0.01) == (0, 1)
    assert (found.format, found.grid.name, found.grid.resolution) == ("ros", "m.yaml", 0.05)
    assert found.occupancy is not None
    assert not found.occupancy.flags.writeable


@pytest.mark.parametrize("case", table("ros_yaw.csv"), ids=lambda c: c["why"][:20] + c["column"])
def test_metres_turn_with_the_map(tmp_path: Path, case: dict[str, str]) -> None:
    width, height = int(case["width"]), int(case["height"])
    origin = f"[{case['x']}, {case['y']}, {case['yaw']}]"
    path = ros(tmp_path, pgm(*[[254] * width] * height), resolution=case["resolution"], origin=origin)
    grid = load_map(path).grid
    cell = (int(case["column"]), int(case["row"]))
    x, y = float(case["metres_x"]), float(case["metres_y"])
    assert grid.to_cell(x, y) == cell
    np.testing.assert_allclose(grid.to_metres(cell), [x, y], atol=1e-6, err_msg=case["why"])


def test_a_turned_map_planned_in_metres_on_the_command_line(tmp_path: Path) -> None:
    wall = [254, 254, 0, 254, 254]
    path = ros(tmp_path, pgm([254] * 5, *[wall] * 4), resolution=0.5, origin=f"[10, -5, {math.pi / 2}]")
    # Local (0.25, 0.25) and (2.25, 0.25), turned left by a quarter and moved to (10, -5).
    words = ("plan", str(path), "--start-m", "9.75,-4.75", "--goal-m", "9.75,-2.75", "--json")
    code = "from lampyris.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", code, *words], capture_output=True, text=True, check=False, timeout=120
    )
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert (record["start"], record["goal"]) == ([0, 4], [4, 4])
    assert [2, 0] in record["cells"], "the only gap in the wall"
    assert record["map"]["origin"] == [10, -5, math.pi / 2]
    assert (record["cells"][0], record["cells"][-1]) == ([0, 4], [4, 4])


def test_a_start_on_an_unknown_cell_is_refused(tmp_path: Path) -> None:
    found = load_map(ros(tmp_path, pgm([205, 254, 254])))
    assert "1 cell unknown (blocked for planning)" in found.notes
    assert lampyris.plan(lampyris.Scene(found.grid, (0, 0), (2, 0))).status.value == "start-occupied"
    assert lampyris.plan(lampyris.Scene(found.grid, (1, 0), (2, 0))).cost == 1


@pytest.mark.parametrize(
    ("mode", "free", "says"),
    [
        ("trinary", 0.25, "2 pixels of grey 205.*read as free by free_thresh 0.25; 0.196 keeps them unknown"),
        ("scale", 0.25, "2 pixels of grey 205.*read as free by mode scale; trinary with 0.196"),
        ("scale", 0.196, "2 pixels of grey 205.*read as free by mode scale"),
        ("trinary", 0.196, ""),
        ("raw", 0.25, ""),
    ],
)
def test_unknown_grey_read_as_free_does_not_pass_in_silence(
    tmp_path: Path, mode: str, free: float, says: str
) -> None:
    found = load_map(ros(tmp_path, pgm([205, 254, 205, 0]), mode=mode, free_thresh=free))
    notes = [note for note in found.notes if "205" in note]
    if says:
        (note,) = notes
        assert re.search(says, note)
    else:
        assert notes == []


def test_notes_count_what_is_blocked_for_want_of_a_cost(tmp_path: Path) -> None:
    found = load_map(ros(tmp_path, pgm([0, 1, 99, 100, 255]), mode="raw"))
    assert cells(found) == [".###?"]
    assert "2 cells of occupancy 1 to 99 read as blocked; only 0 is free" in found.notes
    colour = load_map(ros(tmp_path, png(1, 1, 8, 2, rows([255, 0, 0])), "m.png"))
    assert any("Rec. 601" in note for note in colour.notes)
    assert colour.start is None, "the legend of drawings is not that of map servers"


def test_what_nav2_accepts_is_accepted_with_a_note(tmp_path: Path) -> None:
    found = load_map(
        ros(tmp_path, pgm([128]), negate=2, occupied_thresh=0.3, free_thresh=0.7, map_type="occupancy", Mod=1)
    )
    assert cells(found) == ["."]
    text = "\n".join(found.notes)
    assert "negate 2; read as 1" in text
    assert "free_thresh 0.7 >= occupied_thresh 0.3; where both hold, the cell is free" in text
    assert "unknown key 'map_type'; it is left aside" in text
    assert "did you mean `mode`?" in text


@pytest.mark.parametrize(
    ("word", "white"), [("true", "#"), ("false", "."), ("no", "."), ("On", "#"), ("Y", "#"), ("1", "#")]
)
def test_negate_in_the_words_of_yaml_cpp(tmp_path: Path, word: str, white: str) -> None:
    assert cells(load_map(ros(tmp_path, pgm([255]), negate=word))) == [white]


def test_numbers_that_other_readers_misread(tmp_path: Path) -> None:
    path = ros(tmp_path, pgm([255]), resolution="5e-2", origin="[1e1, -.5, +2.5E-1]")
    grid = load_map(path).grid
    assert (grid.resolution, grid.origin) == (0.05, (10.0, -0.5, 0.25))


@pytest.mark.parametrize("name", ["m", "m.yml", "m.txt", "m.json"])
def test_a_map_yaml_is_known_by_its_content(tmp_path: Path, name: str) -> None:
    put(tmp_path, pgm([0, 255]))
    put(tmp_path, pgm([0, 255]), "m.pgm")
    text = "# a comment\n" + YAML if name != "m.json" else json.dumps(
        {"image": "m.pgm", "resolution": 0.05, "origin": [0, 0, 0], "negate": 0, "occupied_thresh": 0.65,
         "free_thresh": 0.196}
    )  # fmt: skip
    found = load_map(put(tmp_path, text.encode(), name))
    assert (found.format, cells(found)) == ("ros", ["#."])


def test_a_picture_called_yaml_is_a_picture(tmp_path: Path) -> None:
    found = load_map(put(tmp_path, pgm([0, 255]), "m.yaml"))
    assert found.format == "pgm"
    assert "called .yaml and is pgm" in found.notes[0]
    with pytest.raises(FileError, match=r"IMG_FORMAT.*GIF"):
        load_map(put(tmp_path, b"GIF89a" + bytes(9), "m.yaml"))


def test_resolution_is_the_files_own(tmp_path: Path) -> None:
    path = ros(tmp_path, pgm([0, 255]))
    assert load_map(path, resolution=0.05).grid.resolution == 0.05
    with pytest.raises(SettingError, match=r"MAP_RESOLUTION.*0\.1 given, the file says 0.05"):
        load_map(path, resolution=0.1)


# Writing


def _grid(
    seed: int, origin: tuple[float, float, float] = (-12.5, 3.125, 0.0), resolution: float = 0.05
) -> Grid:
    rng = np.random.Generator(np.random.PCG64(seed))
    kind = rng.choice(3, (7, 11), p=[0.6, 0.3, 0.1])
    return Grid(kind > 0, unknown=kind == 2, resolution=resolution, origin=origin)


def test_the_yaml_is_what_nav2_writes(tmp_path: Path) -> None:
    save_map(_grid(0), tmp_path / "office.yaml")
    assert (tmp_path / "office.yaml").read_text() == (
        "image: office.pgm\nmode: trinary\nresolution: 0.050\norigin: [-12.500, 3.125, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    grey = np.asarray(Image.open(tmp_path / "office.pgm"))
    assert set(np.unique(grey)) == {0, 205, 254}
    grid = _grid(0)
    assert grid.unknown is not None
    assert ((grey == 254) == ~grid.blocked).all()
    assert ((grey == 205) == grid.unknown).all()


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize(
    ("origin", "resolution"),
    [
        ((0.0, 0.0, 0.0), 1.0),
        ((-12.5, 3.125, 1.0), 0.05),
        ((1 / 3, -1e-9, -math.pi), 0.05),
        ((123456.789012, 1e-3, 0.1 + 0.2), 1 / 30),
        ((0.0005, 5e-324, 1e-300), 1e-6),
    ],
)
def test_round_trip(tmp_path: Path, mode: str, origin: tuple[float, float, float], resolution: float) -> None:
    for seed in range(4):
        before = _grid(seed, origin, resolution)
        save_ros(before, tmp_path / "m.yaml", mode=mode)
        after = load_map(tmp_path / "m.yaml")
        assert cells(after) == cells(MapDocument(before))
        assert (after.grid.origin, after.grid.resolution) == (origin, resolution)
        save_map(after, tmp_path / "n.yaml")
        again = load_map(tmp_path / "n.yaml")
        assert cells(again) == cells(after)
        assert again.grid.origin == origin


@pytest.mark.parametrize("mode", ["scale", "raw", None])
def test_every_occupancy_comes_back(tmp_path: Path, mode: str | None) -> None:
    values = [list(range(101)), [-1] * 101]
    raw = [[v if v >= 0 else 255 for v in line] for line in values]
    before = load_map(ros(tmp_path, pgm(*raw), mode="raw"))
    assert before.occupancy is not None
    assert before.occupancy.tolist() == values
    save_ros(before, tmp_path / "n.yaml", mode=mode)
    after = load_map(tmp_path / "n.yaml")
    assert after.occupancy is not None
    assert after.occupancy.tolist() == values
    save_ros(before, tmp_path / "t.yaml", mode="trinary")
    # What trinary cannot hold is occupied, never free.
    assert cells(load_map(tmp_path / "t.yaml")) == ["." + "#" * 100, "?" * 101]


def test_an_occupancy_that_contradicts_the_grid_is_not_written(tmp_path: Path) -> None:
    read = load_map(ros(tmp_path, pgm([0, 50, 50, 255]), mode="raw"))
    edited = MapDocument(Grid([[True, False, True, False]]), occupancy=read.occupancy)
    save_map(edited, tmp_path / "n.yaml")
    after = load_map(tmp_path / "n.yaml")
    assert after.occupancy is not None
    assert after.occupancy.tolist() == [[100, 0, 50, 0]]


def test_scale_is_written_with_alpha_in_four_channels(tmp_path: Path) -> None:
    grid = Grid([[False, True, True]], unknown=[[False, False, True]])
    save_ros(grid, tmp_path / "m.yaml", mode="scale")
    pixels = np.asarray(Image.open(tmp_path / "m.png"))
    assert pixels.tolist() == [[[255, 255, 255, 255], [0, 0, 0, 255], [127, 127, 127, 0]]]
    save_ros(grid, tmp_path / "r.yaml", mode="raw", image_format="png")
    assert np.asarray(Image.open(tmp_path / "r.png")).tolist() == [[0, 100, 255]]


@pytest.mark.parametrize(
    "name", ["two words.yaml", "ü.yml", "-.yaml", 'q"uote.yaml', "#1.yaml", "1.yaml", "~.yaml"]
)
def test_odd_names_are_quoted(tmp_path: Path, name: str) -> None:
    save_map(_grid(1), tmp_path / name)
    assert cells(load_map(tmp_path / name)) == cells(MapDocument(_grid(1)))


def test_marks_are_left_out(tmp_path: Path) -> None:
    save_map(load_map("guide"), tmp_path / "g.yaml")
    after = load_map(tmp_path / "g.yaml")
    assert (after.start, after.goal, after.obstacle_cells) == (None, None, ())
    assert cells(after) == cells(load_map("guide"))


def test_writing_refused(tmp_path: Path) -> None:
    grid = Grid([[False]])
    with pytest.raises(UsageError, match=r"MAP_ENDING.*\.png"):
        save_ros(grid, tmp_path / "m.png")
    with pytest.raises(UsageError, match=r"MAP_MODE.*trinary, scale, raw"):
        save_ros(grid, tmp_path / "m.yaml", mode="tri")
    for mode, kind in (("scale", "pgm"), ("trinary", "gif")):
        with pytest.raises(UsageError, match="IMAGE_FORMAT"):
            save_ros(grid, tmp_path / "m.yaml", mode=mode, image_format=kind)
    for name in ("c:m.yaml", "a|b.yaml"):
        with pytest.raises(UsageError, match="PATH_FORM"):
            save_map(grid, tmp_path / name)
    with pytest.raises(FileError, match="FILE_WRITE"):
        save_map(grid, tmp_path / "no" / "m.yaml")
    assert os.listdir(tmp_path) == []
