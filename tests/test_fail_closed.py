"""What a map does not say plainly is blocked or unknown, never free.

Random pictures, arrays and characters, small, in every format. What is free is decided here a second time,
from what was put into the file and in plain integers: a pixel that is opaque, of one grey in its three
channels, and light (at least 205/255 would be unknown, so 206 of 255), and nothing else.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import TypeAlias

import numpy as np
import pytest

from lampyris.errors import InputError
from lampyris.maps.document import MapDocument
from lampyris.maps.load import load_map
from lampyris.selfcheck.twins.map_files import bmp, chunk, npy, png

GREYS = (0, 1, 89, 90, 100, 128, 204, 205, 206, 254, 255)
LEGEND = ((255, 0, 0), (255, 215, 0), (255, 20, 147))
Made: TypeAlias = tuple[bytes, np.ndarray]
"""A file's bytes, and where a cell may be free: bool (height, width)."""
Maker: TypeAlias = Callable[[np.random.Generator, int, int], Made]


def light(sample: np.ndarray, maxval: int) -> np.ndarray:
    """1 - sample / maxval <= 0.196, in whole numbers; 205 of 255 (0.19608) is not."""
    return (maxval - sample.astype(np.int64)) * 1000 <= 196 * maxval


def levels(rng: np.random.Generator, shape: tuple[int, ...], maxval: int) -> np.ndarray:
    """Samples, of which half are near a threshold or an end."""
    near = np.array([round(g * maxval / 255) for g in GREYS], dtype=np.int64)
    jitter = rng.integers(-1, 2, shape) if maxval > 255 else 0
    some = np.clip(near[rng.integers(0, len(near), shape)] + jitter, 0, maxval)
    return np.where(rng.random(shape) < 0.5, some, rng.integers(0, maxval + 1, shape))


def lines(samples: np.ndarray) -> bytes:
    """Unfiltered PNG rows of whole bytes."""
    return b"".join(b"\0" + row.tobytes() for row in samples)


def bits(samples: np.ndarray, depth: int) -> np.ndarray:
    """Samples of 1, 2 or 4 bits, packed: rows of bytes."""
    each = np.arange(depth - 1, -1, -1)
    return np.packbits((samples[..., None] >> each & 1).reshape(len(samples), -1).astype(np.uint8), axis=1)


def png_grey(rng: np.random.Generator, width: int, height: int) -> Made:
    depth = int(rng.choice((1, 2, 4, 8, 16)))
    maxval = (1 << depth) - 1
    grey = levels(rng, (height, width), maxval)
    free = light(grey, maxval)
    extra = b""
    if rng.random() < 0.3:
        key = int(grey.ravel()[int(rng.integers(0, grey.size))])
        above = (int(rng.integers(0, 65536)) << depth) & 0xFFFF  # bits that a sample does not have
        extra = chunk(b"tRNS", struct.pack(">H", key | above * int(rng.integers(0, 2))))
        free &= grey != key
    raw = bits(grey, depth) if depth < 8 else grey.astype(">u2" if depth == 16 else np.uint8)
    return png(width, height, depth, 0, lines(raw), before=extra), free


def png_grey_alpha(rng: np.random.Generator, width: int, height: int) -> Made:
    deep = bool(rng.integers(0, 2))
    maxval = 65535 if deep else 255
    grey = levels(rng, (height, width), maxval)
    alpha = np.where(rng.random((height, width)) < 0.6, maxval, levels(rng, (height, width), maxval))
    raw = np.stack((grey, alpha), axis=2).astype(">u2" if deep else np.uint8)
    return png(width, height, 16 if deep else 8, 4, lines(raw)), light(grey, maxval) & (alpha == maxval)


def colours(rng: np.random.Generator, n: int) -> np.ndarray:
    """Grey, the legend, and now and then another colour, (n, 3)."""
    rgb = np.repeat(levels(rng, (n, 1), 255), 3, axis=1)
    marks = rng.random(n) < 0.1
    rgb[marks] = np.array(LEGEND)[rng.integers(0, 3, int(marks.sum()))]
    if rng.random() < 0.2:
        k = int(rng.integers(0, n))
        rgb[k, int(rng.integers(0, 3))] ^= int(rng.integers(1, 256))
    return rgb


def may_be_free(rgb: np.ndarray) -> np.ndarray:
    """Light grey, and the legend's marks, which stand on free cells."""
    grey = (rgb == rgb[..., :1]).all(axis=-1) & light(rgb[..., 0], 255)
    marks = np.array([(rgb == np.array(m)).all(axis=-1) for m in LEGEND]).any(axis=0)
    return grey | marks


def png_colour(rng: np.random.Generator, width: int, height: int) -> Made:
    rgb = colours(rng, width * height).reshape(height, width, 3)
    free = may_be_free(rgb)
    if rng.integers(0, 2):
        alpha = np.where(rng.random((height, width)) < 0.7, 255, rng.integers(0, 256, (height, width)))
        raw = np.dstack((rgb, alpha))
        if rng.integers(0, 2):
            # 16 bits: the colour's lower byte is left aside, that of the alpha is not.
            low = np.where(rng.random(raw.shape) < 0.8, raw, rng.integers(0, 256, raw.shape))
            deep = (raw << 8 | low).astype(">u2")
            return png(width, height, 16, 6, lines(deep)), free & (deep[..., 3] == 65535)
        return png(width, height, 8, 6, lines(raw.astype(np.uint8))), free & (alpha == 255)
    return png(width, height, 8, 2, lines(rgb.astype(np.uint8))), free


def png_palette(rng: np.random.Generator, width: int, height: int) -> Made:
    depth = int(rng.choice((1, 2, 4, 8)))
    n = int(rng.integers(1, min(1 << depth, 20) + 1))
    rgb = colours(rng, n)
    # One index in fifty lies beyond the palette.
    index = rng.integers(0, n, (height, width))
    index[rng.random((height, width)) < 0.02] = (1 << depth) - 1
    alpha = np.where(rng.random(n) < 0.8, 255, rng.integers(0, 256, n))
    free = np.zeros(256, dtype=bool)
    free[:n] = may_be_free(rgb) & (alpha == 255)
    extra = chunk(b"PLTE", rgb.astype(np.uint8).tobytes()) + chunk(b"tRNS", alpha.astype(np.uint8).tobytes())
    raw = bits(index, depth) if depth < 8 else index.astype(np.uint8)
    return png(width, height, depth, 3, lines(raw), before=extra), free[index]


def bmp_any(rng: np.random.Generator, width: int, height: int) -> Made:
    depth = int(rng.choice((1, 4, 8, 24, 32)))
    top_down = bool(rng.integers(0, 2))
    if depth > 8:
        rgb = colours(rng, width * height).reshape(height, width, 3)
        free, palette, used = may_be_free(rgb), b"", 0
        spare = rng.integers(0, 256, (height, width, 1))
        raw = np.dstack((rgb[..., ::-1], spare))[..., : depth // 8].astype(np.uint8).reshape(height, -1)
    else:
        used = int(rng.integers(1, min(1 << depth, 20) + 1))
        table = colours(rng, used)
        index = rng.integers(0, used, (height, width))
        index[rng.random((height, width)) < 0.02] = (1 << depth) - 1
        known = np.zeros(256, dtype=bool)
        known[:used] = may_be_free(table)
        free = known[index]
        palette = np.pad(table[:, ::-1], ((0, 0), (0, 1))).astype(np.uint8).tobytes()
        raw = bits(index, depth) if depth < 8 else index.astype(np.uint8)
    raw = np.pad(raw, ((0, 0), (0, -raw.shape[1] % 4)))
    raster = (raw if top_down else raw[::-1]).tobytes()
    return bmp(width, -height if top_down else height, depth, raster, palette=palette, used=used), free


def bmp_runs(rng: np.random.Generator, width: int, height: int) -> Made:
    """Run lengths of whole rows, some cut short: what they leave out is unknown."""
    used = int(rng.integers(2, 9))
    table = colours(rng, used)
    known = may_be_free(table)
    free = np.zeros((height, width), dtype=bool)
    code = b""
    for y in range(height - 1, -1, -1):
        x = 0
        while x < width and rng.random() > 0.1:
            n, k = int(rng.integers(1, width - x + 1)), int(rng.integers(0, used))
            code += bytes((n, k))
            free[y, x : x + n] = known[k]
            x += n
        code += b"\0\0"
    palette = np.pad(table[:, ::-1], ((0, 0), (0, 1))).astype(np.uint8).tobytes()
    return bmp(width, height, 8, code + b"\0\1", palette=palette, used=used, packing=1), free


def pgm(rng: np.random.Generator, width: int, height: int) -> Made:
    plain = bool(rng.integers(0, 2))
    maxval = int(rng.choice((1, 2, 100, 254, 255, 256, 1000, 65535)))
    grey = levels(rng, (height, width), maxval)
    free = light(grey, maxval)
    if rng.random() < 0.2 and maxval not in (255, 65535):
        grey.ravel()[int(rng.integers(0, grey.size))] = maxval + 1  # out of range: refused, not clipped
        free[:] = False
    head = f"P{2 if plain else 5}\n{width} {height}\n{maxval}\n".encode()
    if plain:
        return head + b" ".join(b"%d" % int(v) for v in grey.ravel()) + b"\n", free
    return head + grey.astype(">u2" if maxval > 255 else np.uint8).tobytes(), free


def ppm(rng: np.random.Generator, width: int, height: int) -> Made:
    rgb = colours(rng, width * height).reshape(height, width, 3)
    return f"P6 {width} {height} 255\n".encode() + rgb.astype(np.uint8).tobytes(), may_be_free(rgb)


def numpy_file(rng: np.random.Generator, width: int, height: int) -> Made:
    kind = str(rng.choice(("|b1", "|u1", "|i1", "<i2", ">i4", "<u8")))
    odd = (2, 255, -128) if "i" in kind else (2, 254, 255)
    values = rng.choice((0, 1), (height, width)).astype(np.int64)
    if "i" in kind:
        values[rng.random((height, width)) < 0.2] = -1
    if rng.random() < 0.3:
        values.ravel()[int(rng.integers(0, values.size))] = int(rng.choice(odd))
    body = (values & 0xFF).astype(np.uint8) if kind in ("|b1", "|u1", "|i1") else values.astype(kind)
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': ({height}, {width}), }}"
    return npy(header, body.tobytes()), values == 0


def characters(good: str, odd: str, free: str, head: str) -> Maker:
    def make(rng: np.random.Generator, width: int, height: int) -> Made:
        cells = np.array(list(good))[rng.integers(0, len(good), (height, width))]
        if rng.random() < 0.3:
            cells.ravel()[int(rng.integers(0, cells.size))] = odd[int(rng.integers(0, len(odd)))]
        text = "".join("".join(row) + "\n" for row in cells)
        return (head.format(width=width, height=height) + text).encode("latin-1"), np.isin(cells, list(free))

    return make


ODD = "".join(chr(c) for c in range(256) if chr(c) not in "\n.GS@OTW#?o\0")
MAKERS: dict[str, Maker] = {
    "png grey": png_grey,
    "png grey and alpha": png_grey_alpha,
    "png colour": png_colour,
    "png palette": png_palette,
    "bmp": bmp_any,
    "bmp runs": bmp_runs,
    "pgm": pgm,
    "ppm": ppm,
    "npy": numpy_file,
    "movingai": characters(".G@OTSW", ODD, ".GS", "type octile\nheight {height}\nwidth {width}\nmap\n"),
    "text": characters("..##?", ODD, ".SGo", ""),
}

YAML = (
    "image: m.pgm\nmode: {mode}\nresolution: 1\norigin: [0, 0, 0]\nnegate: {negate}\n"
    "occupied_thresh: {occupied}\nfree_thresh: {free}\n"
)


def found_free(document: MapDocument) -> np.ndarray:
    grid = document.grid
    free = ~grid.blocked
    if grid.unknown is not None:
        assert not (free & grid.unknown).any(), "unknown counts as blocked"
    return free


def judge(path: Path, may: np.ndarray) -> tuple[int, int]:
    """Load, compare; how many cells were free, and whether it was refused (not for its size)."""
    try:
        document = load_map(path)
    except InputError:
        return 0, 1
    free = found_free(document)
    assert free.shape == may.shape
    wrong = free & ~may
    assert not wrong.any(), f"{np.argwhere(wrong)[0]} is free; {path.read_bytes()!r}"
    return int(free.sum()), 0


@pytest.mark.parametrize("kind", MAKERS)
def test_only_what_is_plainly_free_is_free(tmp_path: Path, kind: str) -> None:
    rng = np.random.Generator(np.random.PCG64(list(kind.encode())))
    path = tmp_path / "m"
    free = refused = 0
    for _ in range(840):
        width, height = (int(n) for n in rng.integers(1, 8, 2))
        data, may = MAKERS[kind](rng, width, height)
        path.write_bytes(data)
        some, no = judge(path, may)
        free += some
        refused += no
    assert free > 300, "hardly anything was free: the rule was not put to the test"
    assert kind in ("png grey", "png grey and alpha") or refused > 20


def test_ros_maps(tmp_path: Path) -> None:
    """Thresholds, negate, mode and alpha as they come: free is what Nav2 calls 0, and never what is clear."""
    rng = np.random.Generator(np.random.PCG64(205))
    path = tmp_path / "m.yaml"
    free = unknown = 0
    for _ in range(840):
        width, height = (int(n) for n in rng.integers(1, 8, 2))
        mode = str(rng.choice(("trinary", "scale", "raw")))
        negate = bool(rng.integers(0, 2))
        low, high = sorted(int(n) for n in rng.integers(0, 1001, 2))
        high += high == low
        grey = levels(rng, (height, width), 255)
        alpha = np.where(rng.random((height, width)) < 0.7, 255, rng.integers(0, 256, (height, width)))
        occ = grey if negate else 255 - grey
        if mode == "raw":
            may = grey == 0
        else:
            # A unit of slack: thresholds are compared as 32-bit floats, this as whole numbers. In the mode
            # scale, what is less than half a hundredth on the way to occupied is rounded to 0.
            reach = 255 * low + 1 + (255 * (high - low) // 200 if mode == "scale" else 0)
            may = (occ * 1000 <= reach) & (alpha == 255)
        raw = np.stack((grey, alpha), axis=2).astype(np.uint8)
        (tmp_path / "m.pgm").write_bytes(png(width, height, 8, 4, lines(raw)))
        words = YAML.format(mode=mode, negate=int(negate), occupied=high / 1000, free=low / 1000)
        path.write_text(words)
        document = load_map(path)
        some = found_free(document)
        assert not (some & ~may).any(), words
        free += int(some.sum())
        unknown += int(np.count_nonzero(alpha < 255))
    assert free > 300
    assert unknown > 300
