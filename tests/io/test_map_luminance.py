"""``colour="luminance"``: a picture of any colours as grey, by Rec. 601 weights in 1024ths, rounded down."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import FileError
from lampyris.io.maps.formats.colours import BRIGHTNESS, luma
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map
from lampyris_selfcheck.reference.files.map_files import bmp, cells, chunk, png, put, rows

# (306 R + 601 G + 117 B) >> 10, by hand; then occ = 1 - grey / 255: blocked from 0.65, free up to 0.196.
BY_HAND = {
    (255, 0, 0): (76, "#"),  # 78,030; the legend's start
    (255, 215, 0): (202, "?"),  # 78,030 + 129,215 = 207,245; the legend's goal: occ 0.208
    (255, 20, 147): (104, "?"),  # 78,030 + 12,020 + 17,199 = 107,249; occ 0.592
    (0, 255, 0): (149, "?"),  # 153,255
    (0, 0, 255): (29, "#"),  # 29,835
    (255, 255, 0): (225, "."),  # 231,285; occ 0.118
    (200, 210, 206): (206, "."),  # 61,200 + 126,210 + 24,102 = 211,512; 206.55: occ 0.1922
    (200, 209, 206): (205, "?"),  # 210,911; 205.97, rounded down: occ 0.19608 is above 0.196
    (0, 0, 0): (0, "#"),
    (255, 255, 255): (255, "."),
    (205, 205, 205): (205, "?"),
}
CELLS = ["".join(cell for _, cell in BY_HAND.values())]


def read(folder: Path, data: bytes) -> MapDocument:
    """A file read by luminance."""
    return load_map(put(folder, data), colour="luminance")


def test_the_formula() -> None:
    for colour, (grey, _) in BY_HAND.items():
        assert int(luma(np.array(colour, dtype=np.uint8))) == grey
    every = np.repeat(np.arange(256, dtype=np.uint8)[:, None], 3, axis=1)
    assert luma(every).tolist() == list(range(256))


def test_every_kind_of_colour_picture(tmp_path: Path) -> None:
    flat = [v for colour in BY_HAND for v in colour]
    n = len(BY_HAND)
    reds = b"".join(bytes((b, g, r)) for r, g, b in BY_HAND)
    files = [
        png(n, 1, 8, 2, rows(flat)),
        png(n, 1, 8, 6, rows([v for colour in BY_HAND for v in (*colour, 255)])),
        png(n, 1, 16, 2, b"\0" + bytes(b for v in flat for b in (v, 128))),  # the upper 8 bits of 16
        png(n, 1, 8, 3, rows(range(n)), before=chunk(b"PLTE", bytes(flat))),
        b"P6 %d 1 255\n" % n + bytes(flat),
        bmp(n, 1, 24, reds + bytes(-len(reds) % 4)),
    ]
    for data in files:
        found = read(tmp_path, data)
        assert cells(found) == CELLS
        assert found.notes[0] == BRIGHTNESS
        assert (found.start, found.goal, found.obstacle_cells) == (None, None, ())


def test_without_it_the_colour_is_named(tmp_path: Path) -> None:
    with pytest.raises(FileError) as caught:
        load_map(put(tmp_path, png(2, 1, 8, 2, rows([255, 255, 255, 0, 255, 0]))))
    assert caught.value.code == "IMG_COLOUR"
    assert "pixel (1,0): (0,255,0)" in str(caught.value)
    assert caught.value.todo == 'read it with colour="luminance", or save it as grey'


def test_grey_pictures_are_what_they_were(tmp_path: Path) -> None:
    for data in (
        png(4, 1, 8, 0, rows([0, 100, 205, 255])),
        png(2, 1, 16, 0, b"\0\x40\0\xff\xff"),
        png(4, 1, 8, 2, rows([0, 0, 0, 100, 100, 100, 205, 205, 205, 255, 255, 255])),
        b"P5 2 1 100\n\x00\x64",
        b"P1 2 1 01",
    ):
        plain = load_map(put(tmp_path, data))
        found = read(tmp_path, data)
        assert cells(found) == cells(plain)
        assert found.notes == plain.notes


def test_what_is_not_opaque_is_unknown(tmp_path: Path) -> None:
    alpha = png(2, 1, 8, 6, rows([0, 255, 255, 254, 255, 255, 0, 255]))
    assert cells(read(tmp_path, alpha)) == ["?."]
    palette = chunk(b"PLTE", bytes([255, 255, 0, 255, 255, 0])) + chunk(b"tRNS", b"\0")
    found = read(tmp_path, png(2, 1, 8, 3, rows([0, 1]), before=palette))
    assert cells(found) == ["?."]
    assert found.notes[1:] == ("1 transparent pixel read as unknown",)
    with pytest.raises(FileError, match="IMG_CORRUPT"):
        read(tmp_path, png(1, 1, 8, 3, rows([2]), before=palette))


def test_a_costmap_is_not_made_of_colours(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="IMG_COLOUR"):
        load_map(put(tmp_path, png(1, 1, 8, 2, rows([9, 8, 9]))), colour="luminance", values="costmap")
