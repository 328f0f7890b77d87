"""Costmap values: the same numbers from every format that has them, and nothing else taken for them."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import FileError, LampyrisError, SettingError
from lampyris.io.maps.formats.costmap import FROM_OCCUPANCY, TO_OCCUPANCY
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map
from lampyris_selfcheck.reference.files.map_files import adam7, bmp, cells, chunk, npy, png, put, rows

ROW = [0, 1, 100, 252, 253, 254, 255]
CELLS = ["....##?"]
TERRAIN = [0, 1, 100, 252, 0, 0, 0]
NOTE = "read as costmap values: 3 cells of terrain, 1 to 252, 2 blocked, 1 unknown"
GREYS = b"".join(bytes((v, v, v)) for v in range(256))
NPY = "{'descr': '%s', 'fortran_order': %s, 'shape': (1, 7), }"

FILES = {
    "png": png(7, 1, 8, 0, rows(ROW)),
    "png interlaced": png(7, 1, 8, 0, adam7([ROW]), interlace=1),
    "png palette": png(7, 1, 8, 3, rows(ROW), before=chunk(b"PLTE", GREYS)),
    "png colour, all grey": png(7, 1, 8, 2, rows([v for v in ROW for _ in "rgb"])),
    "png opaque alpha": png(7, 1, 8, 4, rows([w for v in ROW for w in (v, 255)])),
    "png opaque colour": png(7, 1, 8, 6, rows([w for v in ROW for w in (v, v, v, 255)])),
    "pgm 5": b"P5 7 1 255\n" + bytes(ROW),
    "pgm 2": b"P2 7 1 255\n0 1 100 252\n253 254 255\n",
    "ppm": b"P6 7 1 255\n" + bytes(v for v in ROW for _ in "rgb"),
    "bmp": bmp(7, 1, 8, bytes(ROW) + b"\0", palette=b"".join(bytes((v, v, v, 0)) for v in range(256))),
    "npy u1": npy(NPY % ("|u1", "False"), bytes(ROW)),
    "npy fortran": npy(NPY % ("|u1", "True"), bytes(ROW)),
    "npy i2": npy(NPY % ("<i2", "False"), np.array([*ROW[:-1], -1], dtype="<i2").tobytes()),
    "npy i8": npy(NPY % (">i8", "False"), np.array(ROW, dtype=">i8").tobytes()),
    "npy u8": npy(NPY % ("<u8", "False"), np.array(ROW, dtype="<u8").tobytes()),
}


def facts(document: MapDocument) -> tuple[list[str], list[int]]:
    """Cells and terrain of a map."""
    terrain = document.grid.terrain
    return cells(document), [0] * document.grid.blocked.size if terrain is None else terrain.ravel().tolist()


@pytest.mark.parametrize("kind", FILES)
def test_the_same_from_every_file(tmp_path: Path, kind: str) -> None:
    path = put(tmp_path, FILES[kind])
    found = load_map(path, values="costmap")
    assert facts(found) == (CELLS, TERRAIN)
    assert found.notes == (NOTE,)
    assert (found.start, found.goal, found.obstacle_cells) == (None, None, ())
    # Without being asked for, nothing of it is terrain, and no grey between is free.
    if kind.startswith("npy"):
        with pytest.raises(FileError, match=r"NPY_VALUE.*values=\"costmap\""):
            load_map(path)
    else:
        plain = load_map(path)
        assert facts(plain) == (["##?...."], [0] * 7)  # 100 is between black and white


def test_a_tall_map_keeps_its_rows(tmp_path: Path) -> None:
    samples = [[0, 7], [254, 9], [255, 200]]
    array = np.array(samples, dtype=np.uint8)
    out = io.BytesIO()
    np.save(out, np.asfortranarray(array))
    for data in (png(2, 3, 8, 0, rows(*samples)), out.getvalue()):
        assert facts(load_map(put(tmp_path, data), values="costmap")) == (
            ["..", "#.", "?."],
            [0, 7, 0, 9, 0, 200],
        )


@pytest.mark.parametrize(
    ("data", "says"),
    [
        ([0, 5, 5], "2 cells of terrain, all 5, 0 blocked, 0 unknown"),
        ([0, 254, 0], "no terrain, 1 blocked, 0 unknown"),
        ([255, 253, 1], "1 cell of terrain, all 1, 1 blocked, 1 unknown"),
    ],
)
def test_what_is_said_of_it(tmp_path: Path, data: list[int], says: str) -> None:
    found = load_map(put(tmp_path, b"P5 3 1 255\n" + bytes(data)), values="costmap")
    assert found.notes == (f"read as costmap values: {says}",)


REFUSED = {
    "16-bit png": (png(1, 1, 16, 0, b"\0\0\0"), "IMG_DEPTH", "white is 65535"),
    "16-bit colour": (png(1, 1, 16, 2, b"\0" + bytes(6)), "IMG_DEPTH", "16 bits a channel"),
    "1-bit png": (png(1, 1, 1, 0, b"\0\x80"), "IMG_DEPTH", "fewer than 8 bits"),
    "4-bit png": (png(2, 1, 4, 0, b"\0\x5f"), "IMG_DEPTH", "fewer than 8 bits"),
    "pgm of 100": (b"P2 1 1 100 100", "IMG_DEPTH", "white is 100"),
    "pgm of 65535": (b"P5 1 1 65535\n\0\0", "IMG_DEPTH", "white is 65535"),
    "bitmap": (b"P1 1 1 1", "IMG_DEPTH", "white is 1"),
    "red": (png(2, 1, 8, 2, rows([9, 9, 9, 255, 0, 0])), "IMG_COLOUR", "pixel (1,0): (255,0,0)"),
    "red in the palette": (
        png(2, 2, 8, 3, rows([0, 0], [0, 1]), before=chunk(b"PLTE", bytes([5, 5, 5, 255, 0, 0]))),
        "IMG_COLOUR",
        "pixel (1,1): (255,0,0)",
    ),
    "transparent": (png(2, 1, 8, 4, rows([9, 255, 9, 254])), "IMG_ALPHA", "pixel (1,0)"),
    "transparent grey": (png(2, 1, 8, 0, rows([9, 8]), before=chunk(b"tRNS", b"\0\x08")), "IMG_ALPHA", "(1,"),
    "transparent palette": (
        png(1, 1, 8, 3, rows([0]), before=chunk(b"PLTE", bytes(3)) + chunk(b"tRNS", b"\xfe")),
        "IMG_ALPHA",
        "pixel (0,0)",
    ),
    "npy bool": (npy("{'descr': '|b1', 'fortran_order': False, 'shape': (1, 1)}", b"\1"), "NPY_TYPE", "bool"),
    "npy float": (npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1)}", bytes(8)), "NPY_TYPE", ""),
    "npy 256": (npy(NPY % ("<u2", "False"), b"\0\1" * 7), "NPY_VALUE", "cell (0,0): 256"),
    "npy -2": (npy(NPY % ("|i1", "False"), b"\0" * 6 + b"\xfe"), "NPY_VALUE", "cell (6,0): -2"),
}  # fmt: skip


@pytest.mark.parametrize("kind", REFUSED)
def test_what_has_no_costmap_values(tmp_path: Path, kind: str) -> None:
    data, code, says = REFUSED[kind]
    with pytest.raises(FileError) as caught:
        load_map(put(tmp_path, data), values="costmap")
    assert caught.value.code == code
    assert says in str(caught.value)


def test_a_colour_that_is_not_used_does_no_harm(tmp_path: Path) -> None:
    data = png(1, 1, 8, 3, rows([1]), before=chunk(b"PLTE", bytes([255, 0, 0, 7, 7, 7])))
    assert facts(load_map(put(tmp_path, data), values="costmap")) == (["."], [7])


def test_pixels_that_runs_leave_out_are_unknown(tmp_path: Path) -> None:
    greys = b"".join(bytes((v, v, v, 0)) for v in range(256))
    data = bmp(3, 1, 8, bytes([1, 9, 0, 1]), palette=greys, packing=1)
    found = load_map(put(tmp_path, data), values="costmap")
    assert facts(found) == ([".??"], [9, 0, 0])
    assert found.notes == (
        "read as costmap values: 1 cell of terrain, all 9, 0 blocked, 2 unknown",
        "2 pixels the picture leaves out read as unknown",
    )


@pytest.mark.parametrize(
    ("data", "name"),
    [(b"..#\n", "a.txt"), (b"type octile\nheight 1\nwidth 1\nmap\n.\n", "a.map")],
)
def test_formats_without_numbers(tmp_path: Path, data: bytes, name: str) -> None:
    path = put(tmp_path, data, name)
    with pytest.raises(SettingError, match="VALUES"):
        load_map(path, values="costmap")
    load_map(path)


def test_words_that_are_none(tmp_path: Path) -> None:
    for options in ({"values": "cost"}, {"colour": "grey"}, {"values": ""}):
        for name in ("guide", put(tmp_path, b".", "a.txt")):
            with pytest.raises(SettingError, match=r"VALUES|COLOUR"):
                load_map(name, **options)  # type: ignore[arg-type]
    with pytest.raises(SettingError, match=r"VALUES.*bundled"):
        load_map("guide", values="costmap")


def test_the_way_to_occupancy_is_that_of_nav2() -> None:
    """Written out from ``costmap_2d_publisher.cpp``: char = 1 + (97 * (i - 1)) / 251 in C's whole numbers."""
    plain = [0] + [1 + int((97 * (c - 1)) / 251) for c in range(1, 253)] + [99, 100, -1]
    assert TO_OCCUPANCY.tolist() == plain
    # A few by hand: 97 * 2 = 194 < 251; 97 * 3 = 291; 97 * 126 = 12222 = 48 * 251 + 174; 97 * 251 = 97 * 251.
    assert [plain[c] for c in (1, 3, 4, 127, 252)] == [1, 1, 2, 49, 98]


def test_the_way_back_is_the_dearest_of_those_that_lead_there() -> None:
    for value in range(1, 99):
        sharers = [c for c in range(1, 253) if TO_OCCUPANCY[c] == value]
        assert FROM_OCCUPANCY[value] == max(sharers)
        assert 1 <= len(sharers) <= 3
    assert [int(FROM_OCCUPANCY[v]) for v in (0, 99, 100)] == [0, 253, 254]
    assert int(FROM_OCCUPANCY[np.int8(-1).view(np.uint8)]) == 255
    off = FROM_OCCUPANCY[TO_OCCUPANCY.view(np.uint8)].astype(int) - np.arange(256)
    assert (off.min(), off.max()) == (0, 2)


def ros(folder: Path, mode: str, pixels: list[int], free: float = 0.196) -> Path:
    """A ROS map of one row."""
    put(folder, b"P5 %d 1 255\n" % len(pixels) + bytes(pixels), "m.pgm")
    text = (
        f"image: m.pgm\nmode: {mode}\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
        f"occupied_thresh: 0.65\nfree_thresh: {free}\n"
    )
    return put(folder, text.encode(), "m.yaml")


def test_ros_raw(tmp_path: Path) -> None:
    path = ros(tmp_path, "raw", [0, 1, 49, 98, 99, 100, 101, 255])
    found = load_map(path, values="costmap")
    # 49: 97 (c - 1) from 48 * 251 = 12048 to 12298 gives c - 1 from 125 to 126, so 127.
    assert facts(found) == (["....##??"], [0, 3, 127, 252, 0, 0, 0, 0])
    assert found.notes == ("read as costmap values: 3 cells of terrain, 3 to 252, 2 blocked, 2 unknown",)
    assert found.occupancy is not None
    assert found.occupancy.tolist() == [[0, 1, 49, 98, 99, 100, -1, -1]]
    assert facts(load_map(path)) == ([".#####??"], [0] * 8)


def test_ros_scale(tmp_path: Path) -> None:
    # occ of 255, 191, 128, 0 is 0, 0.25098, 0.49804, 1; scaled from 0.196 to 0.65: 0, 12, 67, 100.
    found = load_map(ros(tmp_path, "scale", [255, 191, 128, 0]), values="costmap")
    assert found.occupancy is not None
    assert found.occupancy.tolist() == [[0, 12, 67, 100]]
    assert facts(found) == (["...#"], [0, int(FROM_OCCUPANCY[12]), int(FROM_OCCUPANCY[67]), 0])


def test_ros_trinary(tmp_path: Path) -> None:
    found = load_map(ros(tmp_path, "trinary", [255, 205, 0]), values="costmap")
    assert facts(found) == ([".?#"], [0, 0, 0])
    assert found.notes == ("read as costmap values: no terrain, 1 blocked, 1 unknown",)
    odd = load_map(ros(tmp_path, "trinary", [205], free=0.25), values="costmap")
    assert odd.notes[0].startswith("1 pixel of grey 205, which map savers write for unknown, read as free")


def test_the_limit_comes_first(tmp_path: Path) -> None:
    with pytest.raises(LampyrisError, match="IMG_TOO_LARGE"):
        load_map(put(tmp_path, FILES["png"]), values="costmap", max_cells=6)
