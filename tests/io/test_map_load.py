"""load_map: names, kinds of file, limits; what a file is, is decided by its content."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from lampyris.errors import FileError, LampyrisError, LimitError, SettingError
from lampyris.io.maps.load import load_map
from lampyris_selfcheck.reference.files.map_files import bmp, cells, load_bytes, png, put, rows


def test_a_bundled_name_or_a_file_of_that_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    put(tmp_path, b"..\n", "guide")
    monkeypatch.chdir(tmp_path)
    assert load_map("guide").grid.width == 10
    assert load_map("./guide").grid.width == 2
    assert load_map(Path("guide")).grid.width == 2
    assert load_map(b"./guide").grid.width == 2  # type: ignore[arg-type]


@pytest.mark.parametrize("name", ["gide", "env_1", "no/such/map.png", "", "x" * 5000, "nul\0", "/dev/null/x"])
def test_neither_a_name_nor_a_file(name: str) -> None:
    with pytest.raises(FileError) as caught:
        load_map(name)
    assert caught.value.exit_code == 3
    assert caught.value.code == "FILE_MISSING"
    assert "`lampyris maps` lists" in caught.value.allowed
    assert len(str(caught.value)) < 350
    suggestion = {"gide": "did you mean guide?", "env_1": "did you mean env-1?"}.get(name, "")
    assert caught.value.todo == suggestion


def test_a_number_is_no_name() -> None:
    with pytest.raises(SettingError, match="MAP_NAME"):
        load_map(3)  # type: ignore[arg-type]


def test_what_is_not_a_regular_file_is_refused_at_once(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    listening = socket.socket(socket.AF_UNIX)
    home = Path.cwd()
    os.chdir(tmp_path)  # a socket's address is short
    try:
        listening.bind("s")
    finally:
        os.chdir(home)
    with listening:
        for name in (tmp_path, tmp_path / "pipe", tmp_path / "s", "/dev/zero", "/dev/null"):
            with pytest.raises(FileError, match="FILE_KIND"):
                load_map(name)


def test_a_link_to_a_map_is_a_map(tmp_path: Path) -> None:
    put(tmp_path, b".#\n", "real")
    (tmp_path / "link").symlink_to("real")
    assert cells(load_map(tmp_path / "link")) == [".#"]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_a_file_that_may_not_be_read(tmp_path: Path) -> None:
    put(tmp_path, b".", "shut").chmod(0)
    with pytest.raises(FileError, match="FILE_READ"):
        load_map(tmp_path / "shut")


@pytest.mark.parametrize(
    ("data", "name", "says"),
    [
        (b"", "a.png", "IMG_EMPTY"),
        (b"hello", "a.png", 'IMG_FORMAT.*starts with "hell"'),
        (b"GIF89a" + bytes(20), "a.png", "IMG_FORMAT.*this is GIF; allowed: PNG, BMP, PGM"),
        (b"\xff\xd8\xff\xe0", "a.jpg", "IMG_FORMAT.*JPEG.*; save it as PNG"),
        (b"II*\0aa", "a.map", "IMG_FORMAT.*TIFF"),
        (b"RIFFxxxxWEBP", "a.png", "IMG_FORMAT.*WebP"),
        (b"<svg/>", "a", "IMG_FORMAT.*SVG"),
        (b"PK\x03\x04", "a.npz", "IMG_FORMAT.*zip.*CSV$"),
        (b"P3 1 1 255 0 0 0", "a.ppm", "IMG_FORMAT.*plain PPM"),
        (b"ab\0c", "a", "IMG_FORMAT"),
        (b"....\n", "a.map", "MAP_TYPE.*type octile"),
    ],
)
def test_files_that_are_no_maps(tmp_path: Path, data: bytes, name: str, says: str) -> None:
    with pytest.raises(FileError, match=says):
        load_bytes(tmp_path, data, name)


def test_content_decides_and_the_wrong_ending_is_noted(tmp_path: Path) -> None:
    picture = png(2, 1, 8, 0, rows([0, 255]))
    found = load_bytes(tmp_path, picture, "a.pgm")
    assert (found.format, cells(found)) == ("png", ["#."])
    assert found.notes == ("the file is called .pgm and is png; it was read as what it is",)
    assert load_bytes(tmp_path, picture, "a.PNG").notes == ()
    assert load_bytes(tmp_path, picture, "a").notes == ()
    assert load_bytes(tmp_path, b"type octile\nheight 1\nwidth 1\nmap\n.\n", "a.txt").format == "movingai"
    assert load_bytes(tmp_path, bmp(1, 1, 24, bytes(4)), "a.png").format == "bmp"


def test_resolution_and_name(tmp_path: Path) -> None:
    assert load_bytes(tmp_path, b"..\n", "hall.txt").grid.name == "hall.txt"
    assert load_map("guide").grid.resolution == 1.0
    assert load_map("guide", resolution=0.05).grid.resolution == 0.05
    assert load_map("guide").grid.name == "guide"
    with pytest.raises(SettingError, match="MAP_RESOLUTION"):
        load_map("guide", resolution=0)


ONE_MORE = {
    "png": (png(10, 10, 8, 0, rows(*[[0] * 10] * 10)), "IMG_TOO_LARGE"),
    "bmp": (bmp(10, 10, 24, bytes(320)), "IMG_TOO_LARGE"),
    "pgm": (b"P5 10 10 255\n" + bytes(100), "IMG_TOO_LARGE"),
    "movingai": (b"type octile\nheight 10\nwidth 10\nmap\n" + b"..........\n" * 10, "MAP_TOO_LARGE"),
    "text": (b"..........\n" * 10, "MAP_TOO_LARGE"),
    "bundled": (b"", "MAP_TOO_LARGE"),
}


@pytest.mark.parametrize("form", ONE_MORE)
def test_the_limit_is_exact(tmp_path: Path, form: str) -> None:
    data, code = ONE_MORE[form]
    what = "guide" if form == "bundled" else put(tmp_path, data)
    assert load_map(what, max_cells=100).grid.blocked.size == 100
    with pytest.raises(LimitError) as caught:
        load_map(what, max_cells=99)
    assert (caught.value.code, caught.value.exit_code) == (code, 5)
    assert "100 cells" in str(caught.value)


@pytest.mark.parametrize("limit", [0, -1, 2**24 + 1, True, 1.5])
def test_a_limit_out_of_range(limit: int) -> None:
    with pytest.raises(SettingError, match="MAX_CELLS"):
        load_map("guide", max_cells=limit)


def test_a_file_longer_than_any_map_is_not_read(tmp_path: Path) -> None:
    with (tmp_path / "long").open("wb") as stream:
        stream.truncate(2**20 + 9)
    with pytest.raises(LimitError, match="FILE_TOO_LARGE"):
        load_map(tmp_path / "long", max_cells=1)


def test_too_many_obstacles_drawn(tmp_path: Path) -> None:
    with pytest.raises(LampyrisError, match="LIMIT"):
        load_bytes(tmp_path, (b"o" * 101 + b"\n") * 100)
    assert len(load_bytes(tmp_path, (b"o" * 100 + b"\n") * 100).obstacle_cells) == 10_000
