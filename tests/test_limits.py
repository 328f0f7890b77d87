"""Every stated limit, on both sides: one less and exactly as much are taken, one more is refused.

What a header claims is looked at before anything is made for it, whatever follows.
"""

from __future__ import annotations

import struct
import tracemalloc
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import lampyris
from lampyris._core.limits import MAX_CELLS
from lampyris._core.scalars import MAX_SEED
from lampyris.errors import LampyrisError, LimitError
from lampyris.io import paths as way_file
from lampyris.io.maps.formats import movingai, pgm, table
from lampyris.io.maps.formats import npy as numpy_file
from lampyris.io.maps.formats import png as image
from lampyris.io.maps.formats.document import byte_limit
from lampyris.io.maps.formats.movingai import read_scen
from lampyris.io.maps.load import load_map
from lampyris.io.maps.recipes.make import make
from lampyris.io.paths import read_path_points
from lampyris.io.text import csv_table, strict_json, strict_yaml
from lampyris.io.text.strict_json import read_json
from lampyris.io.text.strict_yaml import read_yaml
from lampyris.io.tracks import csv_tracks, dob
from lampyris.io.tracks.csv_tracks import read_track
from lampyris.io.tracks.obstacle_states import read_obstacle_states
from lampyris.model.grid import Grid
from lampyris.model.robot import GREATEST, LEAST, Robot
from lampyris.model.scene import MAX_RADIUS, Scene
from lampyris.model.traffic import MAX_OBSTACLES, RandomWalk, Recorded
from lampyris.scenarios import load_scenario
from lampyris_selfcheck.reference.files.map_files import bmp, chunk, npy, png, put, rows
from lampyris_selfcheck.reference.files.watching import memory
from sizes import some

Ask = Callable[[Path, int], object]
"""Given a folder and n: ask for n."""


def test_the_limits_are_those_that_are_promised() -> None:
    assert MAX_CELLS == 2**24
    assert byte_limit(MAX_CELLS) == 8 * 2**24 + 2**20
    assert (strict_yaml.MAX_BYTES, strict_yaml.MAX_DEPTH) == (64 * 2**10, 32)
    assert (strict_json.MAX_BYTES, strict_json.MAX_DEPTH) == (16 * 2**20, 32)
    assert movingai.MAX_SCEN_LINES == 100_000
    assert pgm.HEADER_BYTES == movingai.HEADER_BYTES == numpy_file.HEADER_BYTES == 4096
    assert MAX_OBSTACLES == 10_000
    assert MAX_SEED == 2**63 - 1


# ---- cells: a map of n columns, with at most 20 cells allowed --------------------

ROS = "image: m.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
WIDE: dict[str, Callable[[int], bytes]] = {
    "png": lambda n: png(n, 1, 8, 0, rows([255] * n)),
    "bmp": lambda n: bmp(n, 1, 24, b"\xff" * (3 * n + -3 * n % 4)),
    "bmp runs": lambda n: bmp(n, 1, 8, bytes((n, 0, 0, 1)), palette=b"\xff" * 4, used=1, packing=1),
    "P1": lambda n: b"P1 %d 1\n" % n + b"0" * n,
    "P2": lambda n: b"P2 %d 1 9\n" % n + b"9 " * n,
    "P4": lambda n: b"P4 %d 1\n" % n + bytes((n + 7) // 8),
    "P5": lambda n: b"P5 %d 1 255\n" % n + b"\xff" * n,
    "P6": lambda n: b"P6 %d 1 255\n" % n + b"\xff" * 3 * n,
    "npy": lambda n: npy(f"{{'descr': '|b1', 'fortran_order': False, 'shape': (1, {n}), }}", bytes(n)),
    "movingai": lambda n: b"type octile\nheight 1\nwidth %d\nmap\n" % n + b"." * n + b"\n",
    "text": lambda n: b"." * n + b"\n",
    "text column": lambda n: b".\n" * n,
    "csv": lambda n: b",".join([b"0"] * n) + b"\n",
}


@pytest.mark.parametrize("kind", WIDE)
def test_cells(tmp_path: Path, kind: str) -> None:
    suffix = ".csv" if kind == "csv" else ""
    for n in (19, 20):
        assert load_map(put(tmp_path, WIDE[kind](n), f"m{suffix}"), max_cells=20).grid.blocked.size == n
    with pytest.raises(LimitError, match=r"21( x 1)? is 21 cells; (allowed: )?at most 20") as caught:
        load_map(put(tmp_path, WIDE[kind](21), f"m{suffix}"), max_cells=20)
    assert caught.value.exit_code == 5


def test_cells_of_a_ros_map_and_of_a_bundled_one(tmp_path: Path) -> None:
    path = put(tmp_path, ROS.encode(), "m.yaml")
    for n in (19, 20, 21):
        put(tmp_path, WIDE["P5"](n), "m.pgm")
        if n <= 20:
            assert load_map(path, max_cells=20).grid.width == n
    with pytest.raises(LimitError, match=r"21 cells; (allowed: )?at most 20"):
        load_map(path, max_cells=20)
    for n in (100, 101):
        assert load_map("guide", max_cells=n).grid.blocked.size == 100
    with pytest.raises(LimitError, match=r"100 cells; (allowed: )?at most 99"):
        load_map("guide", max_cells=99)


@pytest.mark.parametrize("n", [0, -1, MAX_CELLS + 1, 1.5, True, None, "9"])
def test_the_limit_itself_has_limits(n: int) -> None:
    with pytest.raises(LampyrisError, match=r"^error\[MAX_CELLS\]: .*1 to 16,777,216"):
        load_map("guide", max_cells=n)
    assert load_map("guide", max_cells=MAX_CELLS).grid.width == 10


# Claims of 4097 x 4096 cells (one row too many) or far more, with next to nothing behind them.
CLAIMS: dict[str, tuple[str, Callable[[int, int], bytes]]] = {
    "png": ("m.png", lambda w, h: png(w, h, 8, 0, b"\0\0")),
    "png interlaced": ("m.png", lambda w, h: png(w, h, 16, 6, b"\0\0", interlace=1)),
    "bmp": ("m.bmp", lambda w, h: bmp(w, h, 24, bytes(9))),
    "bmp runs": ("m.bmp", lambda w, h: bmp(w, h, 8, b"\0\1", palette=bytes(8), used=2, packing=1)),
    "P1": ("m.pgm", lambda w, h: b"P1 %d %d\n0" % (w, h)),
    "P2": ("m.pgm", lambda w, h: b"P2 %d %d 255\n0" % (w, h)),
    "P5": ("m.pgm", lambda w, h: b"P5 %d %d 65535\n\0" % (w, h)),
    "P6": ("m.pgm", lambda w, h: b"P6 %d %d 255\n\0" % (w, h)),
    "npy": (
        "m.npy",
        lambda w, h: npy(f"{{'descr': '<i8', 'fortran_order': False, 'shape': ({h}, {w}), }}", b"\0"),
    ),
    "movingai": ("m.map", lambda w, h: b"type octile\nheight %d\nwidth %d\nmap\n.\n" % (h, w)),
}


@pytest.mark.commit(8)
@pytest.mark.parametrize("kind", CLAIMS)
@pytest.mark.parametrize("size", [(4096, 4097), (2**24 + 1, 1), (60_000, 60_000), (2**31 - 1, 2**31 - 1)])
def test_a_claim_is_refused_before_anything_is_made_for_it(
    tmp_path: Path, kind: str, size: tuple[int, int]
) -> None:
    name, build = CLAIMS[kind]
    path = put(tmp_path, build(*size), name)
    with pytest.raises(LimitError):
        load_map(path)  # imports what the next call will not have to
    tracemalloc.start()
    try:
        with pytest.raises(
            LimitError, match=r"(IMG|MAP)_TOO_LARGE\]: .* cells; (allowed: )?at most 16,777,216 cells"
        ):
            load_map(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 200_000


@pytest.mark.parametrize("kind", ["png", "P5", "P6", "npy", "movingai"])
def test_a_claim_within_the_limit_is_compared_with_the_file_first(tmp_path: Path, kind: str) -> None:
    """4096 x 4096 cells would be taken, but they are not there: refused, and nothing made for them."""
    name, build = CLAIMS[kind]
    path = put(tmp_path, build(4096, 4096), name)
    tracemalloc.start()
    try:
        with pytest.raises(LampyrisError, match="TRUNCATED"):
            load_map(path)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 4 * 2**20


def test_pixels_packed_beyond_the_picture_are_left_packed(tmp_path: Path) -> None:
    """100 MB of rows behind a picture of six pixels, in 100 kB."""
    import zlib

    packed = zlib.compress(rows([255] * 3, [0] * 3) + bytes(100 * 2**20), 1)
    head = struct.pack(">IIBBBBB", 3, 2, 8, 0, 0, 0, 0)
    data = image.MAGIC + chunk(b"IHDR", head) + chunk(b"IDAT", packed) + chunk(b"IEND")
    path = put(tmp_path, data, "m.png")
    load_map("guide")
    with memory() as grown:
        assert load_map(path).grid.blocked.tolist() == [[False] * 3, [True] * 3]
    assert grown[0] < 32 * 2**20


# ---- bytes, lines, headers, depth --------------------


def yaml_nested(n: int) -> bytes:
    """A mapping with lists in it: n levels."""
    return b"a: " + b"[" * (n - 1) + b"]" * (n - 1)


def json_nested(n: int) -> bytes:
    return b'{"a": ' + b"[" * (n - 1) + b"]" * (n - 1) + b"}"


def pgm_header(folder: Path, n: int) -> object:
    """A header of n bytes, its last white space included."""
    head = b"P5\n#" + b"x" * (n - 13) + b"\n1 1 255\n"
    assert len(head) == n
    return load_map(put(folder, head + b"\xff", "m.pgm"))


def map_header(folder: Path, n: int) -> object:
    head = b"type%soctile\nheight 1\nwidth 1\nmap\n" % (b" " * (n - 32))
    assert len(head) == n
    return load_map(put(folder, head + b".\n", "m.map"))


def npy_header(folder: Path, n: int) -> object:
    text = "{'descr': '|b1', 'fortran_order': False, 'shape': (1, 1), }"
    return load_map(put(folder, npy(text.ljust(n - 1), b"\0"), "m.npy"))


def sized(name: str, content: bytes, filler: bytes, read: Callable[[Path], object]) -> Ask:
    """A file of n bytes: content, then filler."""

    def ask(folder: Path, n: int) -> object:
        return read(put(folder, content + filler * (n - len(content)), name))

    return ask


def chunks(folder: Path, n: int) -> object:
    """A picture of n chunks."""
    return load_map(put(folder, png(1, 1, 8, 0, rows([255]), before=chunk(b"tEXt") * (n - 3)), "m.png"))


def packed_text(folder: Path, n: int) -> object:
    import zlib

    text = chunk(b"zTXt", b"k\0\0" + zlib.compress(bytes(n)))
    return load_map(put(folder, png(1, 1, 8, 0, rows([255]), before=text), "m.png"))


def scenario(**parts: str) -> Callable[[Path], object]:
    """A scenario on the guide map with these keys."""
    keys = {"map": '"guide"', "start": "[0, 9]", "goal": "[7, 0]", **parts}
    text = '{"version": 1, ' + ", ".join(f'"{k}": {v}' for k, v in keys.items()) + "}"
    return lambda folder: load_scenario(put(folder, text.encode(), "s.json"))


def bodies_drawn(folder: Path, n: int) -> object:
    """A text map with n moving obstacles."""
    cells = ("o" * n).ljust(101 * 101, ".")
    text = "\n".join(cells[k : k + 101] for k in range(0, len(cells), 101))
    return load_map(put(folder, text.encode(), "m.txt"))


def in_all(folder: Path, n: int) -> object:
    """Two kinds of obstacles, n together."""
    kinds = f'[{{"kind": "crossing", "count": 5000}}, {{"kind": "random-walk", "count": {n - 5000}}}]'
    return scenario(obstacles=kinds)(folder)


def dob_words(folder: Path, n: int) -> object:
    return dob.read_dob(b"NumberOfDynamicObstacles: 0" + b" 0" * (n - 2), "t.dob")


def one_track(folder: Path, n: int) -> object:
    found = read_track(put(folder, b"x,y\n" + b"1,2\n" * n, "t.csv"))
    assert len(found) == n
    return found


def one_track_by_ticks(folder: Path, n: int) -> object:
    found = read_track(put(folder, b"tick,x,y\n0,1,2\n%d,1,2\n" % (n - 1), "t.csv"))
    assert len(found) == n
    return found


ONE = Grid([[False]])
LIMITS: dict[str, tuple[int, Ask, str]] = {
    "file of a map": (
        byte_limit(1),
        sized("m.txt", b".", b"\n", lambda p: load_map(p, max_cells=1)),
        "FILE_TOO_LARGE",
    ),
    "PGM header": (4096, pgm_header, "PGM_HEADER"),
    "MovingAI header": (4096, map_header, "MAP_HEADER"),
    "NumPy header": (4096, npy_header, "NPY_HEADER"),
    "packed text": (2**20, packed_text, "IMG_CORRUPT"),
    "PNG chunks": (50, chunks, "IMG_CORRUPT"),
    "YAML bytes": (2**16, lambda f, n: read_yaml(b"a: 1\n".ljust(n, b"#"), "m"), "YAML_SIZE"),
    "YAML depth": (32, lambda f, n: read_yaml(yaml_nested(n), "m"), "YAML_DEPTH"),
    "YAML values": (10_000, lambda f, n: read_yaml(b"a: [" + b"0," * (n - 2) + b"]", "m"), "YAML_SIZE"),
    "YAML digits": (30, lambda f, n: read_yaml(b"a: " + b"9" * n, "m"), "YAML_NUMBER"),
    "JSON bytes": (2**24, lambda f, n: read_json(b'{"a": 1}'.ljust(n), "m"), "JSON_SIZE"),
    "JSON depth": (32, lambda f, n: read_json(json_nested(n), "m"), "JSON_DEPTH"),
    "JSON values": (
        60,
        lambda f, n: read_json(b'{"a": [' + b"0," * (n - 2) + b"0]}", "m", max_values=60),
        "JSON_SIZE",
    ),
    "JSON digits": (30, lambda f, n: read_json(b'{"a": ' + b"9" * n + b"}", "m"), "JSON_NUMBER"),
    "scen lines": (
        100_000,
        lambda f, n: read_scen(put(f, b"version 1\n" + b"\n" * (n - 1), "m.scen")),
        "SCEN_LINES",
    ),
    "scenario in YAML": (
        2**16,
        sized("s.yaml", b"version: 1\nmap: guide\nstart: [0, 9]\ngoal: [7, 0]\n", b"#", load_scenario),
        "YAML_SIZE",
    ),
    "obstacles of a kind": (
        MAX_OBSTACLES,
        lambda f, n: scenario(obstacles=f'[{{"kind": "crossing", "count": {n}}}]')(f),
        "LIMIT",
    ),
    "obstacles in all": (MAX_OBSTACLES, in_all, "LIMIT"),
    "obstacles drawn": (MAX_OBSTACLES, bodies_drawn, "LIMIT"),
    "obstacles of a specification": (MAX_OBSTACLES, lambda f, n: RandomWalk(n), "LIMIT"),
    "track": (csv_tracks.MAX_TICKS, one_track, "LIMIT"),
    "track by ticks": (csv_tracks.MAX_TICKS, one_track_by_ticks, "LIMIT"),
    "line of a track file": (
        csv_table.MAX_LINE,
        lambda f, n: read_track(put(f, b"x,y\n1,2," + b"z" * (n - 5) + b"\n", "t.csv")),
        "LIMIT",
    ),
    "points of a way": (
        way_file.MAX_POINTS,
        lambda f, n: read_path_points(put(f, b"x,y\n" + b"1,2\n" * n, "w.csv")),
        "LIMIT",
    ),
    "moving obstacles in a file": (
        MAX_OBSTACLES,
        lambda f, n: read_obstacle_states(
            put(f, b"x_m,y_m,radius,top_speed\n" + b"1,2,0,1\n" * n, "m.csv"), ONE
        ),
        "LIMIT",
    ),
    "lines of a table": (
        csv_table.MAX_LINES,
        lambda f, n: read_path_points(put(f, b"x,y\n1,2\n" + b"\n" * (n - 2), "w.csv")),
        "LIMIT",
    ),
    "file of a way": (
        csv_table.MAX_BYTES,
        sized("w.csv", b"x,y\n1,2\n", b" ", read_path_points),
        "FILE_TOO_LARGE",
    ),
    "file of a track": (
        csv_table.MAX_BYTES,
        sized("t.csv", b"x,y\n1,2\n", b"\n", read_track),
        "FILE_TOO_LARGE",
    ),
    "words of a .dob": (dob.MAX_WORDS, dob_words, "LIMIT"),
    "radius in cells": (
        MAX_RADIUS,
        lambda f, n: Scene(Grid([[False]], resolution=0.5), (0, 0), (0, 0), robot=Robot(radius=n / 2)),
        "RADIUS",
    ),
    "name": (64, lambda f, n: scenario(name='"' + "x" * n + '"')(f), "JSON_TEXT"),
    "seed of a scenario": (MAX_SEED, lambda f, n: scenario(seed=str(n))(f), "SEED"),
    "seed of a plan": (
        MAX_SEED,
        lambda f, n: lampyris.plan(Scene(Grid([[False]]), (0, 0), (0, 0)), seed=n),
        "SEED",
    ),
    "seed of a recipe": (MAX_SEED, lambda f, n: make("random", 4, 4, n), "SEED"),
    "cells of a recipe": (
        4096,
        lambda f, n: scenario(map=f'{{"recipe": "random", "size": [{n}, 4096]}}')(f),
        "MAP_TOO_LARGE",
    ),
}
SLOW = {"cells of a recipe"}
"""Asked on the far side only: what is within the limit takes its time."""
FULL = {"file of a track", "file of a way", "words of a .dob"}
"""At the limit these say something else, as no file so large is right."""
LONG = {"points of a way", "words of a .dob"}
"""For the night: files of a million values."""


@pytest.mark.commit(11)
@pytest.mark.parametrize("what", some(sorted(LIMITS, key=LONG.__contains__), len(LIMITS) - len(LONG)))
def test_one_less_as_much_and_one_more(tmp_path: Path, what: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(image, "MAX_CHUNKS", 50)
    limit, ask, code = LIMITS[what]
    for n in () if what in SLOW else (limit - 1, limit):
        if what not in FULL:
            ask(tmp_path, n)
            continue
        with pytest.raises(LampyrisError) as other:
            ask(tmp_path, n)
        assert other.value.code != code
    with pytest.raises(LampyrisError) as caught:
        ask(tmp_path, limit + 1)
    assert caught.value.code == code, str(caught.value)


@pytest.mark.parametrize(
    ("name", "limit"), [("m.txt", byte_limit(MAX_CELLS)), ("m.scen", 2**24), ("t.csv", 2**24)]
)
def test_a_file_that_is_too_large_is_not_read(tmp_path: Path, name: str, limit: int) -> None:
    """A terabyte that takes no room on the disk."""
    path = tmp_path / name
    with path.open("wb") as sparse:
        sparse.truncate(2**40)
    read = {"m.txt": load_map, "m.scen": read_scen, "t.csv": read_track}[name]
    with (
        memory() as grown,
        pytest.raises(LimitError, match=rf"1,099,511,627,776 bytes; (allowed: )?at most {limit:,} bytes"),
    ):
        read(path)  # type: ignore[operator]
    assert grown[0] < 2**20


@pytest.mark.parametrize("field", ["v_max", "a_max", "d_max", "a_lat_max", "jerk_max"])
def test_limits_of_a_robot(field: str) -> None:
    for value in (LEAST, np.nextafter(LEAST, 1), 1, np.nextafter(GREATEST, 0), GREATEST):
        Robot(**{field: float(value)})
    for value in (0, np.nextafter(LEAST, 0), np.nextafter(GREATEST, np.inf), -1, np.nan, np.inf):
        with pytest.raises(LampyrisError, match="ROBOT_LIMIT"):
            Robot(**{field: float(value)})


def test_a_number_of_a_table(tmp_path: Path) -> None:
    """A billion: of what comes one after the other, the next double is refused, and so is a million's."""
    most = csv_table.GREATEST
    for value in (most, np.nextafter(most, 0), -most, np.nextafter(-most, 0)):
        assert read_path_points(put(tmp_path, b"x,y\n%a,0\n0,0\n" % float(value), "w.csv"))
    for value in (np.nextafter(most, np.inf), np.nextafter(-most, -np.inf)):
        with pytest.raises(LampyrisError, match=r"^error\[PATH_FILE\]"):
            read_path_points(put(tmp_path, b"x,y\n%a,0\n0,0\n" % float(value), "w.csv"))


def test_what_a_file_is_shows_in_its_head(tmp_path: Path) -> None:
    """A zero byte within the head: no text. Behind it: the reader of texts says what is wrong."""
    codes = []
    for at in (table.HEAD_BYTES - 2, table.HEAD_BYTES - 1, table.HEAD_BYTES):
        with pytest.raises(LampyrisError) as caught:
            load_map(put(tmp_path, b"." * at + b"\0\n", "m.dat"))
        codes.append(caught.value.code)
    assert codes[0] == codes[1] != codes[2]


def test_limits_of_a_grid() -> None:
    for resolution in (1e-6, 1000):
        assert Grid([[False]], resolution=resolution).resolution == resolution
    for resolution in (np.nextafter(1e-6, 0), np.nextafter(1000, 2000), 0, -1, np.nan):
        with pytest.raises(LampyrisError, match="MAP_RESOLUTION"):
            Grid([[False]], resolution=float(resolution))
    for value in (0, 252):
        Grid([[False]], terrain=[[value]])
    for value in (-1, 253):
        with pytest.raises(LampyrisError, match="GRID_TERRAIN"):
            Grid([[False]], terrain=[[value]])


def test_tracks_step_by_one_cell() -> None:
    Recorded(((0, 0), (1, 1)))
    with pytest.raises(LampyrisError, match="OBSTACLE_SPEED"):
        Recorded(((0, 0), (2, 0)))
