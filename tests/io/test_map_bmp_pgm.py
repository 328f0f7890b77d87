"""BMP and the netpbm family: what each pixel becomes, and what is refused."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from lampyris.errors import FileError, LimitError
from lampyris.io.maps.load import load_map
from lampyris_selfcheck.reference.files.map_files import bmp, cells, load_bytes, put

BW = bytes([0, 0, 0, 0, 255, 255, 255, 0])
RAMP = b"".join(bytes((v, v, v, 0)) for v in range(256))


@pytest.mark.parametrize("mode", ["1", "L", "P", "RGB"])
@pytest.mark.parametrize("width", [1, 7, 8, 9, 33])
def test_bmp_as_pillow_writes_it(tmp_path: Path, mode: str, width: int) -> None:
    rng = np.random.Generator(np.random.PCG64(width))
    grey = np.where(rng.random((5, width)) < 0.4, 0, 255).astype(np.uint8)
    Image.fromarray(grey).convert(mode).save(tmp_path / "a.bmp")
    found = load_map(tmp_path / "a.bmp")
    assert found.grid.blocked.tolist() == (grey == 0).tolist()
    assert (found.format, found.notes) == ("bmp", ())


def test_bmp_rows_from_the_bottom_or_from_the_top(tmp_path: Path) -> None:
    raster = bytes([0, 255, 0, 0]) + bytes([255, 255, 0, 0])
    assert cells(load_bytes(tmp_path, bmp(2, 2, 8, raster, palette=RAMP))) == ["..", "#."]
    assert cells(load_bytes(tmp_path, bmp(2, -2, 8, raster, palette=RAMP))) == ["#.", ".."]


def test_bmp_four_bits_and_palette_order(tmp_path: Path) -> None:
    # Entries are blue, green, red: this one is red, the start.
    palette = bytes([0, 0, 255, 0]) + bytes([255, 255, 255, 0]) + bytes(4)
    found = load_bytes(tmp_path, bmp(3, 1, 4, bytes([0x01, 0x20, 0, 0]), palette=palette, used=3))
    assert cells(found) == ["..#"]
    assert found.start == (0, 0)


def test_bmp_32_bits(tmp_path: Path) -> None:
    raster = bytes([255, 255, 255, 0, 0, 0, 0, 0])
    assert cells(load_bytes(tmp_path, bmp(2, 1, 32, raster))) == [".#"]  # the fourth byte is not alpha here
    masks = struct.pack("<IIII", 0xFF0000, 0xFF00, 0xFF, 0xFF000000)
    found = load_bytes(tmp_path, bmp(2, 1, 32, raster, packing=3, masks=masks, header=56))
    assert cells(found) == ["??"]


def test_bmp_run_lengths(tmp_path: Path) -> None:
    # Row 1 (bottom): 3 white, 1 black. Row 0: two as they are (black, white), the rest left out.
    runs = bytes([3, 1, 1, 0, 0, 0, 1, 0, 1, 1, 0, 1])
    found = load_bytes(tmp_path, bmp(4, 2, 8, runs, palette=BW, used=2, packing=1))
    assert cells(found) == ["#.??", "...#"]
    assert found.notes == ("2 pixels the picture leaves out read as unknown",)
    # The same with 4 bits: a run of alternating nibbles; then three as they are.
    runs = bytes([4, 0x10, 0, 0, 0, 3, 0x01, 0x00, 1, 0x11, 0, 1])
    found = load_bytes(tmp_path, bmp(4, 2, 4, runs, palette=BW, used=2, packing=2))
    assert cells(found) == ["#.#.", ".#.#"]


BAD_BMP = {
    "large": (bmp(60000, 60000, 24, b""), "IMG_TOO_LARGE"),
    "depth": (bmp(1, 1, 3, bytes(4)), "BMP_DEPTH"),
    "16 bits": (bmp(1, 1, 16, bytes(4)), "BMP_DEPTH"),
    "jpeg inside": (bmp(1, 1, 24, bytes(4), packing=4), "BMP_PACKING"),
    "odd masks": (
        bmp(1, 1, 32, bytes(4), packing=3, masks=struct.pack("<III", 0x7C00, 0x3E0, 0x1F)),
        "BMP_PACKING",
    ),
    "size": (bmp(0, 1, 24, b""), "IMG_SIZE"),
    "short": (bmp(4, 4, 24, bytes(47)), "IMG_TRUNCATED"),
    "header cut": (bmp(4, 4, 24, b"")[:30], "IMG_TRUNCATED"),
    "beyond the palette": (bmp(2, 1, 8, bytes([0, 9, 0, 0]), palette=BW, used=2), "IMG_CORRUPT"),
    "palette in the raster": (bmp(2, 1, 8, bytes(4), palette=BW, used=200), "IMG_CORRUPT"),
    "runs cut": (bmp(4, 2, 8, bytes([3, 1]), palette=BW, used=2, packing=1), "IMG_TRUNCATED"),
    "run too long": (bmp(4, 2, 8, bytes([5, 1, 0, 1]), palette=BW, used=2, packing=1), "IMG_CORRUPT"),
    "runs below": (bmp(1, 1, 8, bytes([0, 0, 1, 1, 0, 1]), palette=BW, used=2, packing=1), "IMG_CORRUPT"),
    "step on the spot": (
        bmp(1, 1, 8, bytes([0, 2, 0, 0, 0, 1]), palette=BW, used=2, packing=1),
        "IMG_CORRUPT",
    ),
    "colour": (bmp(1, 1, 24, bytes([255, 0, 0, 0])), "IMG_COLOUR"),
}


@pytest.mark.parametrize("case", BAD_BMP)
def test_bmp_refused(tmp_path: Path, case: str) -> None:
    data, code = BAD_BMP[case]
    with pytest.raises(LimitError if code == "IMG_TOO_LARGE" else FileError) as caught:
        load_bytes(tmp_path, data)
    assert caught.value.code == code


GOOD_PGM = {
    "P5": (b"P5\n4 1\n255\n\x00\x80\xcd\xff", "#??."),
    "P5 with comments": (b"P5 # a\n#b\n2#c\n 1\r\n# d\n255\n\x00\xff", "#."),
    "P5 ends its line": (b"P5 2 1 255\n\x00\xff\n", "#."),
    "P5 maxval 100": (b"P5 4 1 100\n\x00\x23\x50\x51", "##?."),  # 35 is occ 0.65; 80 occ 0.2; 81 occ 0.19
    "P5 16 bits": (b"P5 3 1 65535\n\x00\x00\x40\x00\xff\xff", "##."),
    "P5 16 bits, maxval 1000": (b"P5 3 1 1000\n\x00\x00\x01\x5e\x03\xe8", "##."),
    "P2": (b"P2 3 2 255\n0 255 128\n\n255\t0\r\n255 ", "#.?\n.#."),
    "P2 maxval 1": (b"P2 2 1 1 0 1", "#."),
    "P1": (b"P1 4 2\n0101\n1 0 1 0", ".#.#\n#.#."),
    "P4": (b"P4 10 2\n\x80\x40\x7f\x80", "#........#\n.########."),
    "P6": (b"P6 2 1 255\n\x00\x00\x00\xff\xff\xff", "#."),
    "1x1": (b"P5 1 1 255\n\xff", "."),
}


@pytest.mark.parametrize("case", GOOD_PGM)
def test_pgm_read(tmp_path: Path, case: str) -> None:
    data, expected = GOOD_PGM[case]
    found = load_bytes(tmp_path, data)
    assert cells(found) == expected.split("\n")
    assert found.format == "pgm"


BAD_PGM = {
    "maxval 0": (b"P5 1 1 0\n\0", "PGM_MAXVAL", "0; allowed: 1 to 65535"),
    "maxval 70000": (b"P5 1 1 70000\n\0\0", "PGM_MAXVAL", "70000"),
    "sample": (b"P5 3 1 100\n\0\0\xc8", "PGM_SAMPLE", "pixel (2,0): sample 200; allowed: 0 to 100"),
    "sample P2": (b"P2 2 1 100 0 101", "PGM_SAMPLE", "sample 101"),
    "negative": (b"P5 -5 5 255\n", "PGM_SIZE", "width -5"),
    "zero": (b"P5 0 0 255\n", "PGM_SIZE", "width 0"),
    "short": (b"P5 10 10 255\n" + bytes(37), "IMG_TRUNCATED", "37 of 100"),
    "short P2": (b"P2 3 3 255 0 0", "IMG_TRUNCATED", "2 of 9 samples"),
    "short 16": (b"P5 2 2 256\n" + bytes(7), "IMG_TRUNCATED", "7 of 8"),
    "no raster": (b"P5 2 2 255", "IMG_TRUNCATED", "before the raster"),
    "no height": (b"P5 2", "IMG_TRUNCATED", "before the height"),
    "more": (b"P5 1 1 255\n" + bytes(13), "PGM_TRAILING", "12 bytes"),
    "more P2": (b"P2 1 1 255 0 0", "PGM_TRAILING", "1 samples"),
    "token": (b"P2\n2 2\n255\n0 abc 0 0", "PGM_TOKEN", "line 4: 'abc' is not a number"),
    "long token": (b"P2 2 1 255\n0 " + b"1" * 200_000 + b" x1", "PGM_TOKEN", "line 2: 'x1' is not a number"),
    "long odd token": (b"P2 2 1 255\n0\n" + b"1" * 99_999 + b"x", "PGM_TOKEN", "line 3: '1111"),
    "minus": (b"P2 1 1 255 -1", "PGM_TOKEN", "'-1'"),
    "bit": (b"P1 2 1 02", "PGM_TOKEN", "'02'"),
    "long": (b"P5 " + b"9" * 1000 + b" 1 255\n", "PGM_TOKEN", "longer than 10 digits"),
    "long sample": (b"P2 1 1 255 " + b"0" * 11, "PGM_TOKEN", "longer than 10 digits"),
    "word": (b"P5 wide 1 255\n", "PGM_TOKEN", "width: 'wide'"),
    "colour": (b"P6 1 1 255\n\1\2\3", "IMG_COLOUR", "pixel (0,0): (1,2,3)"),
    "colour 16": (b"P6 1 1 65535\n" + bytes(6), "PGM_MAXVAL", "65535"),
}


@pytest.mark.parametrize("case", BAD_PGM)
def test_pgm_refused(tmp_path: Path, case: str) -> None:
    data, code, says = BAD_PGM[case]
    with pytest.raises(FileError) as caught:
        load_bytes(tmp_path, data)
    assert caught.value.code == code
    assert says in str(caught.value)


def test_pgm_a_long_comment_costs_nothing(tmp_path: Path, timely: Callable[..., Any]) -> None:
    path = put(tmp_path, b"P5\n#" + b"x" * 20_000_000 + b"\n2 2\n255\n" + bytes(4))
    with pytest.raises(FileError) as caught:
        timely(0.5, load_map, path)
    assert caught.value.code == "PGM_HEADER"


def test_pgm_too_large_is_seen_in_the_header(tmp_path: Path) -> None:
    with pytest.raises(LimitError) as caught:
        load_bytes(tmp_path, b"P5 60000 60000 255\n")
    assert caught.value.code == "IMG_TOO_LARGE"
