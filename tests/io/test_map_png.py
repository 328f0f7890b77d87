"""PNG: what each pixel becomes, and what is refused. Expected cells are written by hand."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.maps.load import load_map
from lampyris_selfcheck.reference.files.map_files import (
    SIGNATURE,
    adam7,
    cells,
    chunk,
    load_bytes,
    png,
    put,
    rows,
)


def test_grey_is_read_by_the_thresholds_of_map_servers(tmp_path: Path) -> None:
    # occ = 1 - v/255: 89 is 0.651 (blocked from 0.65), 90 is 0.647; 205 is 0.19608 (free to 0.196).
    found = load_bytes(tmp_path, png(8, 1, 8, 0, rows([0, 89, 90, 127, 205, 206, 254, 255])))
    assert cells(found) == ["##???..."]
    assert found.format == "png"
    assert found.notes == ("3 pixels between black and white read as unknown (blocked for planning)",)
    assert found.grid.blocked.tolist() == [[True] * 5 + [False] * 3]


def test_sixteen_bit_grey_is_scaled_not_clipped(tmp_path: Path) -> None:
    values = [
        0,
        16384,
        22937,
        22938,
        52690,
        52691,
        65535,
    ]  # 0.35 * 65535 = 22937.25; 0.804 * 65535 = 52690.14
    raw = b"\0" + b"".join(struct.pack(">H", v) for v in values)
    assert cells(load_bytes(tmp_path, png(7, 1, 16, 0, raw))) == ["###??.."]


@pytest.mark.parametrize(
    ("depth", "raw", "expected"),
    [
        (1, b"\0\xa5", ".#.##.#."),
        (2, b"\0\x1b\x1b", "##?.##?."),  # 0, 85 (occ 0.667), 170, 255
        (4, b"\0\x05\x6c\xde\xf0", "##??...#"),  # 0, 5 = 85, 6 = 102, 12 = 204, 13 = 221, 14, 15, 0
    ],
)
def test_few_bits(tmp_path: Path, depth: int, raw: bytes, expected: str) -> None:
    assert cells(load_bytes(tmp_path, png(8, 1, depth, 0, raw))) == [expected]


LEGEND = [(0, 0, 0), (255, 0, 0), (255, 215, 0), (255, 20, 147), (255, 255, 255), (128, 128, 128)]


def _marks(tmp_path: Path, data: bytes) -> None:
    found = load_bytes(tmp_path, data)
    assert cells(found) == ["#....?"]
    assert (found.start, found.goal, found.obstacle_cells) == ((1, 0), (2, 0), ((3, 0),))


def test_the_legend_in_every_colour_type(tmp_path: Path) -> None:
    flat = [v for c in LEGEND for v in c]
    _marks(tmp_path, png(6, 1, 8, 2, rows(flat)))
    _marks(tmp_path, png(6, 1, 8, 6, rows([v for c in LEGEND for v in (*c, 255)])))
    _marks(tmp_path, png(6, 1, 16, 2, rows([v for w in flat for v in (w, w)])))
    palette = chunk(b"PLTE", bytes(flat))
    _marks(tmp_path, png(6, 1, 8, 3, rows(range(6)), before=palette))
    _marks(tmp_path, png(6, 1, 4, 3, b"\0\x01\x23\x45", before=palette))


def test_palette_is_colours_not_indices(tmp_path: Path) -> None:
    data = png(2, 1, 8, 3, rows([0, 1]), before=chunk(b"PLTE", bytes([255] * 3 + [0] * 3)))
    assert cells(load_bytes(tmp_path, data)) == [".#"]


@pytest.mark.parametrize(
    "data",
    [
        png(3, 1, 8, 4, rows([255, 254, 255, 255, 0, 0])),
        png(3, 1, 8, 6, rows([255, 255, 255, 254, 255, 255, 255, 255, 1, 2, 3, 0])),
        png(
            3,
            1,
            8,
            3,
            rows([0, 1, 2]),
            before=chunk(b"PLTE", bytes([255] * 9)) + chunk(b"tRNS", b"\xfe\xff\x00"),
        ),
        png(3, 1, 8, 0, rows([9, 255, 9]), before=chunk(b"tRNS", b"\0\x09")),
        png(3, 1, 2, 0, b"\0\xb8", before=chunk(b"tRNS", b"\0\2")),  # 2, 3, 2 of two bits each
        png(3, 1, 8, 2, rows([7, 7, 8, 255, 255, 255, 7, 7, 8]), before=chunk(b"tRNS", b"\0\7\0\7\0\x08")),
        png(3, 1, 16, 4, b"\0" + b"\xff\xff\xfe\xff" + b"\xff" * 4 + b"\0\0\0\0"),
    ],
    ids=["LA", "RGBA", "P", "L", "L2", "RGB", "LA16"],
)
def test_what_is_not_opaque_is_unknown(tmp_path: Path, data: bytes) -> None:
    found = load_bytes(tmp_path, data)
    assert cells(found) == ["?.?"]
    assert found.notes == ("2 transparent pixels read as unknown",)


def test_two_bit_transparency_is_compared_unscaled(tmp_path: Path) -> None:
    # Grey 1 of 0..3 is 85 when scaled: comparing 85 with the 1 of the file would miss it.
    data = png(4, 1, 2, 0, b"\0\x1b", before=chunk(b"tRNS", b"\0\1"))
    assert cells(load_bytes(tmp_path, data)) == ["#??."]


def test_interlaced(tmp_path: Path) -> None:
    rng = np.random.Generator(np.random.PCG64(1))
    samples = np.where(rng.random((11, 13)) < 0.4, 0, 255)
    found = load_bytes(tmp_path, png(13, 11, 8, 0, adam7(samples.tolist()), interlace=1))
    assert found.grid.blocked.tolist() == (samples == 0).tolist()
    short = adam7(samples.tolist())[:-3]
    with pytest.raises(FileError) as caught:
        load_bytes(tmp_path, png(13, 11, 8, 0, short, interlace=1))
    assert caught.value.code == "IMG_TRUNCATED"


GOOD = png(4, 3, 8, 0, rows([0, 255, 255, 0], [255] * 4, [0] * 4))
RED = [255, 0, 0]
GOLD = [255, 215, 0]
BAD = {
    "rows missing": (png(2, 4, 8, 0, rows([255, 255])), "IMG_TRUNCATED", "3 of 12"),
    "cut": (GOOD[:60], "IMG_TRUNCATED", ""),
    "no end": (png(1, 1, 8, 0, b"\0\0", end=False), "IMG_TRUNCATED", "end chunk"),
    "header only": (SIGNATURE, "IMG_TRUNCATED", ""),
    "checksum": (GOOD[:20] + b"\x05" + GOOD[21:], "IMG_CORRUPT", "checksum of chunk 'IHDR'"),
    "width 0": (png(0, 1, 8, 0, b""), "IMG_SIZE", "0 x 1"),
    "depth": (png(1, 1, 3, 0, b"\0\0"), "IMG_CORRUPT", "depth 3"),
    "bad filter": (png(1, 1, 8, 0, b"\x09\0"), "IMG_CORRUPT", ""),
    "pixels are noise": (
        SIGNATURE + chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 0, 0, 0, 0)) + chunk(b"IDAT", b"noise"),
        "IMG_TRUNCATED",
        "",
    ),
    "animated": (
        png(1, 1, 8, 0, b"\0\0", before=chunk(b"acTL", struct.pack(">II", 2, 0))),
        "IMG_FRAMES",
        "2 frames",
    ),
    "no palette": (png(1, 1, 8, 3, b"\0\0"), "IMG_CORRUPT", "palette"),
    "beyond the palette": (
        png(2, 1, 8, 3, rows([0, 200]), before=chunk(b"PLTE", bytes(6))),
        "IMG_CORRUPT",
        "pixel (1,0): colour number 200; the palette has 2",
    ),
    "text bomb": (
        png(1, 1, 8, 0, b"\0\0", before=chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(3 << 20)))),
        "IMG_CORRUPT",
        "text chunk too large",
    ),
    "unknown critical chunk": (png(1, 1, 8, 0, b"\0\0", before=chunk(b"ABCD")), "IMG_CORRUPT", "ABCD"),
    "colour": (
        png(2, 2, 8, 2, rows([0] * 6, [0, 0, 0, 255, 0, 1])),
        "IMG_COLOUR",
        "pixel (1,1): (255,0,1)",
    ),
    "colour in a palette": (
        png(1, 1, 8, 3, rows([1]), before=chunk(b"PLTE", bytes([0, 0, 0, 1, 2, 3]))),
        "IMG_COLOUR",
        "pixel (0,0): (1,2,3)",
    ),
    "two starts": (
        png(2, 2, 8, 2, rows([*RED, 0, 0, 0], [0, 0, 0, *RED])),
        "START_TWICE",
        "(0, 0) and (1, 1)",
    ),
    "three goals": (
        png(3, 1, 8, 2, rows(GOLD * 3)),
        "GOAL_TWICE",
        "(0, 0) and (1, 0) (and 1 more)",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_refused(tmp_path: Path, case: str) -> None:
    data, code, says = BAD[case]
    with pytest.raises(FileError) as caught:
        load_bytes(tmp_path, data)
    assert caught.value.code == code
    assert says in str(caught.value)
    assert str(tmp_path / "m") in str(caught.value)
    assert caught.value.exit_code == 3


@pytest.mark.parametrize("side", [4097, 13_000, 60_000, 2**31 - 1])
def test_too_large_is_seen_in_the_header(tmp_path: Path, side: int, timely: Callable[..., Any]) -> None:
    path = put(tmp_path, png(side, side, 8, 6, b""))
    with pytest.raises(LimitError) as caught:
        timely(0.2, load_map, path)
    assert (caught.value.code, caught.value.exit_code) == ("IMG_TOO_LARGE", 5)


def test_a_palette_colour_nobody_uses_is_no_matter(tmp_path: Path) -> None:
    data = png(1, 1, 8, 3, rows([0]), before=chunk(b"PLTE", bytes([0, 0, 0, 1, 2, 3])))
    assert cells(load_bytes(tmp_path, data)) == ["#"]


def test_an_orientation_is_named_and_not_followed(tmp_path: Path) -> None:
    exif = b"MM\0*" + struct.pack(">IHHHIHH", 8, 1, 0x0112, 3, 1, 6, 0)
    found = load_bytes(tmp_path, png(2, 1, 8, 0, rows([0, 255]), before=chunk(b"eXIf", exif)))
    assert cells(found) == ["#."]
    assert "orientation 6 is ignored" in found.notes[0]


def test_never_free_by_accident(tmp_path: Path) -> None:
    """Any 8-bit colour at all: free only if it is light grey or a mark of the legend."""
    rng = np.random.Generator(np.random.PCG64(5))
    for colour in rng.integers(0, 256, (300, 3)).tolist() + [[v, v, v] for v in range(256)]:
        light = colour[0] == colour[1] == colour[2] and colour[0] >= 206
        data = png(1, 1, 8, 2, rows(colour))
        if colour[0] == colour[1] == colour[2]:
            assert load_bytes(tmp_path, data).grid.blocked[0, 0] == (not light)
        else:
            with pytest.raises(LampyrisError, match="IMG_COLOUR"):
                load_bytes(tmp_path, data)
