"""The library: names are looked up and never joined (W11); uploads under ids of ours; quotas."""

from __future__ import annotations

import io
import json
import os
import struct
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lampyris.app.engine.names import check_file_name, is_plain_name
from lampyris.app.engine.parse import scenario_of_request
from lampyris.app.engine.simulation import standing
from lampyris.app.server import library as room
from lampyris.app.server.library import Library, container
from lampyris.errors import FileError, LimitError
from lampyris.io.maps import library as bundled
from lampyris.io.maps.map_hash import map_hash
from lampyris.study.design.study_map import pack
from lampyris_selfcheck.reference.files.map_files import png, rows

SMALL = png(3, 2, 8, 0, rows([0, 255, 255], [255, 255, 0]))
OTHER = png(2, 2, 8, 0, rows([0, 255], [255, 255]))
YAML = b"""image: hall.pgm
resolution: 0.05
origin: [0, 0, 0]
negate: 0
occupied_thresh: 0.65
free_thresh: 0.196
"""

HOSTILE = (
    "../secret.txt", "..\\secret.txt", "../../etc/passwd", "....//secret.txt", "..", ".", "", "/", "\\",
    "/etc/passwd", "etc/passwd", "./map.png", "map.png/", "map.png/..", "sub/map.png", "sub\\map.png",
    "%2e%2e%2fsecret.txt", "%2e%2e/secret.txt", "..%2fsecret.txt", "%252e%252e%252fsecret.txt",
    "..%c0%afsecret.txt", "..\u2215secret.txt", "\uff0e\uff0e\uff0fsecret.txt", "..\u2044secret.txt",
    "map\u202egnp.txt", "map\u200b.png", "map.png\0", "map.png\0.txt", "\0", "map.png\n", "\r\nmap.png",
    "map.png ", " map.png", "map.png.", "C:\\Windows\\win.ini", "C:map.png", "c:",
    "\\\\host\\share\\map.png", "//host/share/map.png", "\\\\?\\C:\\x", "\\\\.\\pipe\\x", "a:b",
    "map.png:stream", "map.png::$DATA", "CON", "con.png", "NUL", "nul.txt", "PRN.map", "aux.yaml",
    "COM1", "com9.png", "LPT1.txt", "CONIN$", "-rf", ".hidden.png", "~/map.png", "$HOME/map.png",
    "file:///etc/passwd", "http://evil.example/a.png", "a" * 300, "a" * 61 + ".png.png", "link.png",
    "folder.png", "pipe.png", "m\u0430p.png", "MAP.PNG", "map.png*", "*",
)  # fmt: skip


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    maps = tmp_path / "maps"
    maps.mkdir()
    (maps / "map.png").write_bytes(SMALL)
    (tmp_path / "secret.txt").write_text("...\n")
    os.symlink(tmp_path / "secret.txt", maps / "link.png")
    (maps / "folder.png").mkdir()
    os.mkfifo(maps / "pipe.png")
    (maps / ".hidden.png").write_bytes(SMALL)
    (maps / "notes.odt").write_bytes(b"x")
    return maps


@pytest.fixture
def library(folder: Path, tmp_path: Path) -> Library:
    return Library(folder, tmp_path / "spool")


SEEN: list[str] = []
WATCHING = [False]
# What a name may lead to: folders being listed. What it may not: anything being opened.
_EVENTS = ("open", "os.remove", "os.symlink", "socket.getaddrinfo", "subprocess.Popen")
sys.addaudithook(lambda event, given: SEEN.append(repr(given)) if WATCHING[0] and event in _EVENTS else None)


def ids(library: Library, kind: str) -> list[str]:
    return [row["id"] for row in library.listing() if row["kind"] == kind]


def framed(data: bytes) -> list[tuple[str, bytes]]:
    found, at = [], 0
    while at < len(data):
        (size,) = struct.unpack_from("<I", data, at)
        found.append((chr(data[at + 4]), data[at + 5 : at + 4 + size]))
        at += 4 + size
    return found


def test_the_table_is_long_enough() -> None:
    assert len(set(HOSTILE)) >= 60


@pytest.mark.parametrize("name", HOSTILE, ids=ascii)
def test_a_hostile_name_opens_nothing_anywhere(
    library: Library, folder: Path, tmp_path: Path, name: str
) -> None:
    library.thumb("guide")
    SEEN.clear()
    WATCHING[0] = True
    before = sorted(tmp_path.rglob("*"))
    try:
        for way in (library.ground, library.thumb, library.packed, library.delete, library.bring_back):
            with pytest.raises(FileError) as found:
                way(name)
            assert found.value.code == "MAP"
            assert str(tmp_path) not in str(found.value)
            assert str(found.value).isprintable()
    finally:
        WATCHING[0] = False
    assert SEEN == []
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("name", HOSTILE, ids=ascii)
def test_an_upload_is_never_called_as_the_client_says(library: Library, tmp_path: Path, name: str) -> None:
    before = sorted(p for p in tmp_path.rglob("*") if "spool" not in p.parts)
    if _good(name):
        assert _known(library, name).startswith("up-")
    else:
        with pytest.raises(FileError, match="FILE_NAME") as found:
            check_file_name(name)
        assert str(found.value).isprintable()
    assert sorted(p for p in tmp_path.rglob("*") if "spool" not in p.parts) == before
    assert all(p.name.startswith("up-") for p in (tmp_path / "spool").glob("*"))


def _good(name: str) -> bool:
    """Names that a person may give a file, though the folder lists none of that name."""
    return name in ("link.png", "folder.png", "pipe.png", "m\u0430p.png", "MAP.PNG", "a" * 61 + ".png.png")


def _known(library: Library, name: str) -> str:
    """Add a map of that name without the cost of a process."""
    grid = bundled.load("guide").grid
    known = {"ground": pack(grid), "start": None, "goal": None, "notes": [], "name": name}
    whole = pytest.MonkeyPatch()
    whole.setattr(room, "decode", lambda files: known)
    try:
        return str(library.add(b"")["id"])
    finally:
        whole.undo()


def test_only_regular_files_with_plain_names_are_listed(library: Library) -> None:
    assert ids(library, "folder") == ["map.png"]
    assert ids(library, "bundled") == list(bundled.names())
    assert ids(library, "upload") == []


def test_a_link_that_comes_in_the_place_of_a_file_is_not_followed(library: Library, folder: Path) -> None:
    listed = library._files()
    (folder / "map.png").unlink()
    os.symlink(folder.parent / "secret.txt", folder / "map.png")
    with pytest.raises(FileError):
        room._content(listed["map.png"])
    with pytest.raises(FileError, match="no such map"):
        library.ground("map.png")


@pytest.mark.parametrize("name", ["guide", "env-3", "hills-48"])
def test_a_bundled_map_for_the_page(library: Library, name: str) -> None:
    (kind, head), *parts = framed(library.ground(name))
    told = json.loads(head)
    found = bundled.load(name)
    assert kind == "H"
    assert (told["id"], told["kind"]) == (name, "bundled")
    assert (told["width"], told["height"]) == (found.grid.width, found.grid.height)
    assert told["hash"] == map_hash(found.grid)
    assert tuple(told["start"]) == found.start
    assert [k for k, _ in parts] == ["B"] * (1 + (found.grid.terrain is not None))
    cells = np.frombuffer(parts[0][1], np.uint8).reshape(found.grid.blocked.shape)
    assert np.array_equal(cells > 0, found.grid.blocked)
    if found.grid.terrain is not None:
        assert parts[1][1] == found.grid.terrain.tobytes()
    assert Image.open(io.BytesIO(library.thumb(name))).format == "PNG"
    assert library.packed(name) == {"bundled": name}


def test_a_map_of_the_folder_is_read_when_it_is_looked_at(library: Library, folder: Path) -> None:
    (row,) = (r for r in library.listing() if r["kind"] == "folder")
    assert row["width"] is None
    picture = Image.open(io.BytesIO(library.thumb("map.png")))
    assert picture.format == "PNG"
    (row,) = (r for r in library.listing() if r["kind"] == "folder")
    assert (row["width"], row["height"], row["free"]) == (3, 2, pytest.approx(4 / 6))
    (folder / "map.png").write_bytes(OTHER)
    (_, head), _ = framed(library.ground("map.png"))
    assert json.loads(head)["width"] == 2


def test_a_file_that_is_no_map_is_a_sentence(library: Library, folder: Path) -> None:
    (folder / "bad.png").write_bytes(b"hello")
    with pytest.raises(FileError) as found:
        library.ground("bad.png")
    assert found.value.code == "IMG_FORMAT"
    assert str(folder) not in str(found.value)


def test_a_ros_map_of_the_folder_has_its_picture(library: Library, folder: Path) -> None:
    (folder / "hall.yaml").write_bytes(YAML)
    (folder / "hall.pgm").write_bytes(b"P5\n2 1\n255\n\x00\xfe")
    (_, head), (_, cells) = framed(library.ground("hall.yaml"))
    assert json.loads(head)["resolution"] == 0.05
    assert cells == b"\1\0"


@pytest.mark.nightly
def test_an_upload_outlives_the_server_and_is_an_engines_map(
    library: Library, folder: Path, tmp_path: Path
) -> None:
    row = library.add(container({"My Map.png": SMALL}))
    assert (row["kind"], row["name"], row["width"]) == ("upload", "My Map.png", 3)
    assert library.add(container({"My Map.png": SMALL}))["id"] == row["id"]
    later = Library(folder, tmp_path / "spool")
    assert ids(later, "upload") == [row["id"]]
    scenario: dict[str, Any] = {"version": 1, "map": row["id"], "start": [1, 0], "goal": [0, 1]}
    found = scenario_of_request({"scenario": scenario, "ground": later.packed(row["id"])})
    assert found.scene.grid.blocked.tolist() == [[True, False, False], [False, False, True]]
    spool = tmp_path / "spool"
    assert (spool.stat().st_mode & 0o777, next(spool.iterdir()).stat().st_mode & 0o777) == (0o700, 0o600)
    later.delete(row["id"])
    assert ids(library, "upload") == []
    assert [path.name for path in spool.iterdir()] == [f"gone-{row['id']}.json"]


def test_what_is_deleted_can_be_had_again(tmp_path: Path) -> None:
    library = Library(None, tmp_path / "spool")
    row = library.add(container({"a.png": SMALL}))
    before = library.ground(row["id"])
    uploads = lambda: [one["id"] for one in library.listing() if one["kind"] == "upload"]  # noqa: E731
    library.delete(row["id"])
    assert uploads() == []
    with pytest.raises(FileError):
        library.ground(row["id"])
    # A server that is started later has it still.
    library = Library(None, tmp_path / "spool")
    library.bring_back(row["id"])
    assert uploads() == [row["id"]]
    assert library.ground(row["id"]) == before
    library.bring_back(row["id"])
    library.delete(row["id"])
    assert library.add(container({"a.png": SMALL}))["id"] == row["id"]
    library.bring_back(row["id"])
    assert len(os.listdir(tmp_path / "spool")) == 1
    for id in ("up-none", "gone-" + row["id"], "env-3", "../a"):
        with pytest.raises(FileError):
            library.bring_back(id)


@pytest.mark.nightly
def test_what_is_deleted_goes_for_good_after_a_day_or_where_room_is_needed(tmp_path: Path) -> None:
    spool = tmp_path / "spool"
    library = Library(None, spool, most_files=2)
    one, two = (library.add(container({"a.png": data}))["id"] for data in (SMALL, OTHER))
    library.delete(one)
    os.utime(spool / f"gone-{one}.json", (0, 0))
    library.delete(two)
    with pytest.raises(FileError):
        library.bring_back(one)
    library.bring_back(two)
    library.delete(two)
    library.add(container({"a.png": SMALL}))
    three = png(2, 3, 8, 0, rows([0, 255], [255, 255], [255, 255]))
    library.add(container({"a.png": three}))
    with pytest.raises(FileError):
        library.bring_back(two)
    assert len(os.listdir(spool)) == 2


def test_only_uploads_are_deleted(library: Library, folder: Path) -> None:
    for id in ("guide", "map.png"):
        with pytest.raises(FileError, match="MAP_FIXED"):
            library.delete(id)
    assert (folder / "map.png").exists()


def test_quotas(folder: Path, tmp_path: Path) -> None:
    few = Library(folder, tmp_path / "few", most_files=2)
    for name in ("a.png", "b.png"):
        _known(few, name)
    with pytest.raises(LimitError, match="LIBRARY_FULL"):
        _known(few, "c.png")
    _known(few, "a.png")  # it is there already
    small = Library(folder, tmp_path / "small", most_bytes=100)
    with pytest.raises(LimitError, match="LIBRARY_FULL"):
        _known(small, "a.png")
    assert ids(small, "upload") == []


def test_a_stored_upload_that_was_damaged_is_left_out(library: Library, tmp_path: Path) -> None:
    id = _known(library, "a.png")
    file = tmp_path / "spool" / f"{id}.json"
    file.write_bytes(file.read_bytes()[:50])
    assert ids(library, "upload") == []
    with pytest.raises((FileError, ValueError)):
        library.ground(id)


def test_a_folder_that_is_not_there_is_empty(tmp_path: Path) -> None:
    library = Library(tmp_path / "none", tmp_path / "spool")
    assert ids(library, "folder") == ids(library, "upload") == []


@pytest.mark.parametrize("name", ["map.png", "a", "A-1_b.c", "9.map", "console.png", "com10"])
def test_plain_names(name: str) -> None:
    assert is_plain_name(name)


@pytest.mark.parametrize("name", ["Café plan.png", "Halle (2).pgm", "étage-1.map", "地図.png", "a_b.yaml"])
def test_names_that_people_give_files(name: str) -> None:
    assert check_file_name(name) == name


def test_obstacles_drawn_in_a_map_reach_the_page(folder: Path, library: Library) -> None:
    """From the folder and from an upload; the page makes random walkers of them."""
    (folder / "drawn.txt").write_text("S.o.\n....\no..G\n")
    row = library.add(container({"drawn.txt": b"S.o.\n....\no..G\n"}))
    for name in ("drawn.txt", row["id"]):
        (_, head), (_, cells) = framed(library.ground(name))
        assert json.loads(head)["obstacle_cells"] == [[2, 0], [0, 2]]
        assert cells == bytes(12)
    (_, head), *_ = framed(library.ground("map.png"))
    assert json.loads(head)["obstacle_cells"] == []
    asked = {
        "version": 1, "map": row["id"], "start": [0, 0], "goal": [3, 2], "simulate": {},
        "obstacles": [{"kind": "random-walk", "count": 2, "starts": [[2, 0], [0, 2]]}],
    }  # fmt: skip
    found = scenario_of_request({"scenario": asked, "ground": library.packed(row["id"])})
    assert [cell for _, cell in standing(found)] == [(2, 0), (0, 2)]
