"""Small random maps of every format, and where a cell of them may be free.

What is free is decided here a second time, from what was put into the file and in plain integers: a pixel
that is opaque, of one grey in its three channels, and light (205 of 255 is unknown, so 206 and more), and
nothing else. That is free, too: a reader that takes everything for a wall is no reader.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np

from lampyris_selfcheck.reference.files.map_files import adam7, bmp, chunk, npy, png

GREYS = (0, 1, 89, 90, 100, 128, 204, 205, 206, 254, 255)
LEGEND = ((255, 0, 0), (255, 215, 0), (255, 20, 147))
Made: TypeAlias = tuple[bytes, np.ndarray]
"""A file's bytes, and where a cell may be free: bool (height, width)."""
Maker: TypeAlias = Callable[[np.random.Generator, int, int], Made]
"""Makes one of that width and height."""


@dataclass(frozen=True)
class Sort:
    """A sort of files.

    Parameters
    ----------
    make : makes one.
    file : what it is called.
    values, colour : how it is read.
    beside : a file that names it, and is what is read; nothing if it is read itself.
    exact : whether each cell that may be free is. Otherwise a grey within a rounding of the threshold may be
        taken for the darker: scaled to 8 bits downwards, or compared in 32-bit floats.
    """

    make: Maker
    file: str = "m"
    values: str = "occupancy"
    colour: str = "legend"
    beside: str = ""
    exact: bool = True


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
    found: np.ndarray = grey | marks
    return found


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
    free = np.zeros((height, width), dtype=np.bool_)
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
            # In a map of one column a blank is a blank line, and those are no rows at the end.
            some = odd if width > 1 else "".join(odd.split())
            cells.ravel()[int(rng.integers(0, cells.size))] = some[int(rng.integers(0, len(some)))]
        if height == 1 and cells[0, -1] == "\r":
            cells[0, -1] = "?"  # with the newline it would be an end of line, as Windows writes it
        text = "".join("".join(row) + "\n" for row in cells)
        return (head.format(width=width, height=height) + text).encode("latin-1"), np.isin(cells, list(free))

    return make


def csv_file(rng: np.random.Generator, width: int, height: int) -> Made:
    values = rng.choice((0, 0, 1, -1), (height, width))
    words = [[str(int(v)) for v in row] for row in values]
    if rng.random() < 0.3:
        some = ODD_NUMBERS if width > 1 else [word for word in ODD_NUMBERS if word.strip()]
        words[int(rng.integers(height))][int(rng.integers(width))] = str(rng.choice(some))
    between = str(rng.choice((",", ";", "\t")))
    text = "".join(between.join(row) + "\n" for row in words)
    return text.encode("latin-1"), np.array([[_is_zero(word) for word in row] for row in words])


def _is_zero(word: str) -> bool:
    return word.strip(" ") in ("0", "00", "-0", "+0")


def pbm(rng: np.random.Generator, width: int, height: int) -> Made:
    """Bitmaps: 1 is black."""
    black = rng.integers(0, 2, (height, width))
    if rng.integers(0, 2):
        digits = "\n".join(" ".join(map(str, row)) for row in black.tolist())
        if rng.random() < 0.2:
            digits = digits[:-1] + str(rng.choice(list("23x")))
            black[-1, -1] = 1
        return f"P1 {width} {height}\n{digits}\n".encode(), black == 0
    return f"P4 {width} {height}\n".encode() + bits(black, 1).tobytes(), black == 0


def png_interlaced(rng: np.random.Generator, width: int, height: int) -> Made:
    grey = levels(rng, (height, width), 255)
    return png(width, height, 8, 0, adam7(grey.tolist()), interlace=1), light(grey, 255)


def luminance(rng: np.random.Generator, width: int, height: int) -> Made:
    """Every colour is its luma, in 1024ths rounded down; marks mean nothing."""
    rgb = rng.integers(0, 256, (height, width, 3))
    rgb = np.where(rng.random((height, width, 1)) < 0.5, np.maximum(rgb, 190), rgb)
    luma = (306 * rgb[..., 0] + 601 * rgb[..., 1] + 117 * rgb[..., 2]) >> 10
    if rng.integers(0, 2):
        return png(width, height, 8, 2, lines(rgb.astype(np.uint8))), light(luma, 255)
    return f"P6 {width} {height} 255\n".encode() + rgb.astype(np.uint8).tobytes(), light(luma, 255)


def costs(rng: np.random.Generator, width: int, height: int) -> Made:
    """Costmap values: 253 and 254 are blocked, 255 is unknown."""
    near = rng.choice((0, 1, 252, 253, 254, 255), (height, width))
    value = np.where(rng.random((height, width)) < 0.7, near, rng.integers(0, 256, (height, width)))
    kind = int(rng.integers(0, 4))
    if kind == 0:
        return png(width, height, 8, 0, lines(value.astype(np.uint8))), value <= 252
    if kind == 1:
        return f"P5 {width} {height} 255\n".encode() + value.astype(np.uint8).tobytes(), value <= 252
    if kind == 2:
        header = f"{{'descr': '|u1', 'fortran_order': False, 'shape': ({height}, {width}), }}"
        return npy(header, value.astype(np.uint8).tobytes()), value <= 252
    words = [[str(rng.choice(("255", "-1"))) if v == 255 else str(v) for v in row] for row in value.tolist()]
    if rng.random() < 0.2:
        words[0][0] = str(rng.choice(("256", "-2", "1e2", "x")))
        value[0, 0] = 255
    marked = "# lampyris costmap\n" + "".join(",".join(row) + "\n" for row in words)
    return marked.encode(), value <= 252


def ros(rng: np.random.Generator, width: int, height: int) -> tuple[bytes, np.ndarray, str]:
    """A picture, where it may be free, and the words of the map that names it.

    Thresholds, negate, mode and alpha as they come: free is what Nav2 calls 0, and never what is clear.
    """
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
    words = YAML.format(mode=mode, negate=int(negate), occupied=high / 1000, free=low / 1000)
    return png(width, height, 8, 4, lines(raw)), may, words


YAML = (
    "image: m.pgm\nmode: {mode}\nresolution: 1\norigin: [0, 0, 0]\nnegate: {negate}\n"
    "occupied_thresh: {occupied}\nfree_thresh: {free}\n"
)
PLAIN_YAML = YAML.format(mode="trinary", negate=0, occupied=0.65, free=0.196)
ODD_NUMBERS = ("2", "-2", "0.5", "1e0", "0x0", "nan", "", " ", '"0"', "00", "\u00b2", "255", "- 1")
ODD = "".join(chr(c) for c in range(256) if chr(c) not in "\n.GS@OTW#?o\0")
MOVINGAI = "type octile\nheight {height}\nwidth {width}\nmap\n"
SORTS: dict[str, Sort] = {
    "PNG, grey": Sort(png_grey),
    "PNG, grey and alpha": Sort(png_grey_alpha, exact=False),
    "PNG, colour": Sort(png_colour),
    "PNG, palette": Sort(png_palette),
    "PNG, interlaced": Sort(png_interlaced),
    "BMP": Sort(bmp_any),
    "BMP, runs": Sort(bmp_runs),
    "PGM": Sort(pgm),
    "PBM": Sort(pbm),
    "PPM": Sort(ppm),
    "NumPy": Sort(numpy_file),
    "CSV": Sort(csv_file, "m.csv"),
    "MovingAI": Sort(characters(".G@OTSW", ODD, ".GS", MOVINGAI)),
    "text": Sort(characters("..##?", ODD, ".SGo", "")),
    "luminance": Sort(luminance, colour="luminance"),
    "costmap": Sort(costs, values="costmap"),
    "ROS, grey of any depth": Sort(png_grey, "m.pgm", beside=PLAIN_YAML, exact=False),
    "ROS, grey and alpha": Sort(png_grey_alpha, "m.pgm", beside=PLAIN_YAML, exact=False),
    "ROS, PGM": Sort(pgm, "m.pgm", beside=PLAIN_YAML, exact=False),
}
"""Every sort of file that a map may be, but ROS maps of any thresholds (:func:`ros`)."""
