"""What a colour means: the dissertation's legend, and plain grey by the rule of ROS map servers.

Legend (dissertation, chapter 4; maps.md), exact colours only: black blocked, red start, gold goal, deep pink
moving obstacle. The dissertation takes *anything else* for free; here only light grey is. A grey pixel of
brightness p (0 to 1) has occ = 1 - p: blocked from 0.65 up, free up to 0.196, unknown between (the
thresholds nav2_map_server writes, compared in 32-bit floats as it does: 205, its own grey for unknown, is
then unknown). Any other colour is refused, and a pixel that is not wholly opaque is unknown. So a drawing
with soft edges gets walls that are a little too thick, never too thin.

Asked for, a picture is read in another way. By luminance: every colour, the legend's too, is the grey of its
Rec. 601 luma, ``(306 R + 601 G + 117 B) >> 10``, the weights by which GraphicsMagick turns a picture to grey
for Nav2 (in 1024ths, rounded down, so never to the lighter side), and the grey rule decides; there are no
marks then. As costmap values: the grey sample is the value itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.arrays import index_array
from lampyris.errors import plural
from lampyris.io.maps.formats.costmap import ALLOWED, NO_INFORMATION, read_costs
from lampyris.io.maps.formats.document import (
    BAD,
    BLOCKED,
    FREE,
    GOAL,
    OBSTACLE,
    START,
    UNKNOWN,
    CodeGrid,
    FileSource,
    Reading,
    first_bad,
    look_up,
    places_of,
)

OCCUPIED_FROM = np.float32(0.65)
FREE_UP_TO = np.float32(0.196)

LEGEND = {(255, 0, 0): START, (255, 215, 0): GOAL, (255, 20, 147): OBSTACLE}
"""Colours that are not grey. Black is blocked by the grey rule as well."""
SHADES = {
    FREE: (255, 255, 255),
    BLOCKED: (0, 0, 0),
    UNKNOWN: (205, 205, 205),
    START: (255, 0, 0),
    GOAL: (255, 215, 0),
    OBSTACLE: (255, 20, 147),
}
"""The colour each code is saved in."""

BRIGHTNESS = "a colour picture: its brightness decides (Rec. 601), not the legend of drawings"
"""What is noted of it."""
_COLOURS = "grey, or the legend: red start, gold (255,215,0) goal, deep pink (255,20,147) moving obstacle"


@dataclass(frozen=True, slots=True, eq=False)
class Pixels:
    """What a picture holds, before anyone says what it means.

    Parameters
    ----------
    samples : unsigned integers: grey, or indices of the palette, (height, width); or colours
        (height, width, 3).
    maxval : what grey samples call white; colours and palettes have 255.
    clear : bool (height, width), True where a pixel is not wholly opaque, or None.
    palette : uint8, (n, 3), the colours that indices mean, or None; then ``alpha``, uint8 (n,), says how
        opaque each is.
    left_out : bool (height, width), True where a run-length code skips the pixel, or None.
    halved : the file has 16 bits a channel, of which the decoder left the upper 8.
    scaled : the file has fewer than 8 bits of grey, which the decoder spread over 0 to 255.
    notes : what else there is to say.
    """

    samples: NDArray[Any]
    maxval: int = 255
    clear: NDArray[np.bool_] | None = None
    palette: NDArray[np.uint8] | None = None
    alpha: NDArray[np.uint8] | None = None
    left_out: NDArray[np.bool_] | None = None
    halved: bool = False
    scaled: bool = False
    notes: tuple[str, ...] = ()


def read_pixels(pixels: Pixels, source: FileSource) -> Reading:
    """What a picture says: codes by the legend and the grey rule, or as the source asks for.

    Raises
    ------
    FileError : an index beyond the palette; IMG_COLOUR, a colour that is neither grey nor of the legend; for
        costmap values also IMG_DEPTH and IMG_ALPHA.
    """
    if source.values == "costmap":
        reading = _read_costs(pixels, source)
    elif pixels.palette is None and pixels.samples.ndim == 2:
        reading = read_grey(pixels.samples, pixels.maxval, pixels.clear)
    elif source.colour == "luminance":
        grey, colourful = brightness(pixels, source)
        reading = read_grey(grey, 255, clear_of(pixels))
        if colourful:
            reading = replace(reading, notes=(BRIGHTNESS, *reading.notes))
    elif pixels.palette is not None:
        alpha = np.full(len(pixels.palette), 255, np.uint8) if pixels.alpha is None else pixels.alpha
        reading = read_palette(pixels.samples, pixels.palette, alpha, source)
    else:
        reading = read_colour(pixels.samples, pixels.clear, source)
    notes = (*pixels.notes, *reading.notes)
    if pixels.left_out is not None and (n := int(np.count_nonzero(pixels.left_out))):
        reading.codes[pixels.left_out] = UNKNOWN
        notes += (f"{plural(n, 'pixel')} the picture leaves out read as unknown",)
    reading = replace(reading, notes=notes)
    return reading if source.values == "costmap" else scaled_down(reading)


def scaled_down(reading: Reading) -> Reading:
    """A drawing in which each cell is a square of several pixels, as one of a pixel a cell; others as they are.

    The marks of start and goal tell: each that there is covers one square of the same side s > 1, at a multiple of s;
    the sides of the picture are multiples of s, and within each square of s x s pixels all codes are the same. Such a
    picture would be refused otherwise, for its second start or goal.
    """
    codes = reading.codes
    height, width = codes.shape
    sides: list[int] = []
    for mark in (START, GOAL):
        ys, xs = np.divmod(places_of(codes, mark), width)
        if ys.size:
            x, y = int(xs.min()), int(ys.min())
            side = int(xs.max()) - x + 1
            square = int(ys.max()) - y + 1 == side and ys.size == side * side
            sides.append(side if square and x % side == 0 == y % side else 1)
    s = min(sides, default=1) if min(sides, default=1) == max(sides, default=1) else 1
    if s == 1 or width % s or height % s:
        return reading
    squares = codes.reshape(height // s, s, width // s, s)
    first = squares[:, :1, :, :1]
    if not (squares == first).all():
        return reading
    note = f"each cell is drawn by {s} x {s} pixels: read as {width // s} x {height // s} cells"
    return replace(reading, codes=np.ascontiguousarray(first[:, 0, :, 0]), notes=(note, *reading.notes))


def brightness(pixels: Pixels, source: FileSource) -> tuple[NDArray[np.uint8], bool]:
    """8-bit grey (height, width) of a picture of colours or with a palette, and whether any pixel was not
    grey before.

    Raises
    ------
    FileError : IMG_CORRUPT, an index beyond the palette.
    """
    samples, palette = pixels.samples, pixels.palette
    if palette is None:
        return luma(samples), _has_colour(samples)
    _check_index(samples, len(palette), source)
    colourful = _has_colour(palette)
    if colourful:  # of a palette's colours perhaps none but greys are used
        colourful = _has_colour(
            palette[np.bincount(index_array(samples.ravel()), minlength=len(palette)) > 0]
        )
    return look_up(np.pad(luma(palette), (0, 256 - len(palette))), samples), colourful


def luma(rgb: NDArray[Any]) -> NDArray[np.uint8]:
    """Rec. 601 luma of colours (..., 3) as GraphicsMagick weighs it, in 1024ths, rounded down."""
    total = np.multiply(rgb[..., 0], 306, dtype=np.uint32)
    total += np.multiply(rgb[..., 1], 601, dtype=np.uint32)
    total += np.multiply(rgb[..., 2], 117, dtype=np.uint32)
    grey: NDArray[np.uint8] = (total >> np.uint32(10)).astype(np.uint8)
    return grey


def clear_of(pixels: Pixels) -> NDArray[np.bool_] | None:
    """Where a picture is not wholly opaque, bool (height, width), or None."""
    if pixels.alpha is not None and (pixels.alpha < 255).any():
        clear: NDArray[np.bool_] = (pixels.alpha < 255)[pixels.samples]
        return clear
    return pixels.clear


def _has_colour(rgb: NDArray[Any]) -> bool:
    return bool((rgb != rgb[..., :1]).any())


def _read_costs(pixels: Pixels, source: FileSource) -> Reading:
    """Costmap values: the grey itself, where it is 8 bits of grey and nothing else."""
    if pixels.maxval != 255 or pixels.scaled or pixels.halved:
        what = "16 bits a channel" if pixels.halved else f"white is {pixels.maxval}"
        what = "fewer than 8 bits of grey" if pixels.scaled else what
        raise source.error("IMG_DEPTH", what, allowed="8 bits of grey, white 255, for costmap values")
    grey = pixels.samples
    if pixels.palette is not None or grey.ndim == 3:
        grey, colourful = brightness(pixels, source)
        if colourful:
            rgb = pixels.samples if pixels.palette is None else pixels.palette
            odd = (rgb != rgb[..., :1]).any(axis=-1)
            x, y = first_bad(odd if pixels.palette is None else odd[pixels.samples])
            colour = rgb[y, x] if pixels.palette is None else rgb[pixels.samples[y, x]]
            shown = f"({colour[0]},{colour[1]},{colour[2]}) is not a costmap value"
            raise source.error("IMG_COLOUR", shown, f"pixel ({x},{y})", f"grey: {ALLOWED}")
    clear = clear_of(pixels)
    if clear is not None and clear.any():
        x, y = first_bad(clear)
        raise source.error(
            "IMG_ALPHA", "a transparent pixel has no costmap value", f"pixel ({x},{y})", ALLOWED
        )
    if pixels.left_out is not None:
        grey = np.where(pixels.left_out, np.uint8(NO_INFORMATION), grey)
    return read_costs(grey.astype(np.uint8, copy=False))  # digits of a plain PGM come as 64-bit numbers


def grey_table(maxval: int) -> CodeGrid:
    """The code of each sample 0 .. maxval."""
    occ = np.float32(1) - np.arange(maxval + 1, dtype=np.float32) / np.float32(maxval)
    codes = np.full(maxval + 1, UNKNOWN, dtype=np.uint8)
    codes[occ >= OCCUPIED_FROM] = BLOCKED
    codes[occ <= FREE_UP_TO] = FREE
    return codes


def read_grey(samples: NDArray[Any], maxval: int, transparent: NDArray[np.bool_] | None = None) -> Reading:
    """Codes of grey samples, unsigned integers (height, width), each at most ``maxval``."""
    table = grey_table(maxval)
    if samples.dtype == np.uint8:
        # Samples above maxval are the caller's to refuse; unknown is what they would be at worst.
        return _finish(
            look_up(np.pad(table, (0, 255 - maxval), constant_values=UNKNOWN), samples), transparent
        )
    return _finish(table[samples], transparent)


def read_palette(
    index: NDArray[np.uint8], colours: NDArray[np.uint8], alpha: NDArray[np.uint8], source: FileSource
) -> Reading:
    """Codes of palette indices (height, width); ``colours`` (n, 3) and ``alpha`` (n,) are the palette.

    Raises
    ------
    FileError : an index beyond the palette, a colour that is neither grey nor of the legend.
    """
    n = len(colours)
    _check_index(index, n, source)
    table = _colour_codes(colours)
    table[alpha < 255] = FREE  # a colour nobody sees need not be of the legend; it becomes unknown below
    codes = look_up(np.pad(table, (0, 256 - n), constant_values=BAD), index)
    if (table == BAD).any():
        wrong = codes == BAD
        if wrong.any():
            x, y = first_bad(wrong)
            raise _colour_error(source, x, y, colours[index[y, x]])
    return _finish(codes, (alpha < 255)[index] if (alpha < 255).any() else None)


def _check_index(index: NDArray[Any], n: int, source: FileSource) -> None:
    if n < 256 and int(index.max()) >= n:
        x, y = first_bad(index >= n)
        what = f"colour number {index[y, x]}; the palette has {n}"
        raise source.error("IMG_CORRUPT", what, f"pixel ({x},{y})")


def read_colour(rgb: NDArray[np.uint8], transparent: NDArray[np.bool_] | None, source: FileSource) -> Reading:
    """Codes of colours (height, width, 3).

    Raises
    ------
    FileError : a colour that is neither grey nor of the legend.
    """
    codes = _colour_codes(rgb)
    if transparent is not None:
        codes[transparent] = FREE
    wrong = codes == BAD
    if wrong.any():
        x, y = first_bad(wrong)
        raise _colour_error(source, x, y, rgb[y, x])
    return _finish(codes, transparent)


def _colour_codes(rgb: NDArray[np.uint8]) -> CodeGrid:
    """Codes of colours (..., 3), BAD where the colour is neither grey nor of the legend."""
    r, g, b = rgb[..., 0], rgb[..., 1], rgb[..., 2]
    codes = look_up(grey_table(255), g)
    odd = (r != g) | (g != b)
    if odd.any():
        codes[odd] = BAD
        for (lr, lg, lb), code in LEGEND.items():
            codes[(r == lr) & (g == lg) & (b == lb)] = code
    return codes


def _colour_error(source: FileSource, x: int, y: int, colour: NDArray[np.uint8]) -> Exception:
    r, g, b = (int(v) for v in colour)
    return source.error(
        "IMG_COLOUR",
        f"({r},{g},{b}) is not a colour of a map",
        f"pixel ({x},{y})",
        _COLOURS,
        'read it with colour="luminance", or save it as grey',
    )


def _finish(codes: CodeGrid, transparent: NDArray[np.bool_] | None) -> Reading:
    between = codes == UNKNOWN
    notes = []
    if transparent is not None and transparent.any():
        between &= ~transparent
        codes[transparent] = UNKNOWN
        notes.append(f"{plural(int(transparent.sum()), 'transparent pixel')} read as unknown")
    if n := int(np.count_nonzero(between)):
        notes.append(f"{plural(n, 'pixel')} between black and white read as unknown (blocked for planning)")
    return Reading(codes, tuple(notes))
