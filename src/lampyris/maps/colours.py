"""What a colour means: the dissertation's legend, and plain grey by the rule of ROS map servers.

Legend (chapter 4; method.md section 1), exact colours only: black blocked, red start, gold goal, deep pink
moving obstacle. The dissertation takes *anything else* for free; here only light grey is. A grey pixel of
brightness p (0 to 1) has occ = 1 - p: blocked from 0.65 up, free up to 0.196, unknown between (the
thresholds nav2_map_server writes, compared in 32-bit floats as it does: 205, its own grey for unknown, is
then unknown). Any other colour is refused, and a pixel that is not wholly opaque is unknown. So a drawing
with soft edges gets walls that are a little too thick, never too thin.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.maps.document import (
    BAD,
    BLOCKED,
    BODY,
    FREE,
    GOAL,
    START,
    UNKNOWN,
    CodeGrid,
    Reading,
    Source,
    first_bad,
    look_up,
    plural,
)

OCCUPIED_FROM = np.float32(0.65)
FREE_UP_TO = np.float32(0.196)

LEGEND = {(255, 0, 0): START, (255, 215, 0): GOAL, (255, 20, 147): BODY}
"""Colours that are not grey. Black is blocked by the grey rule as well."""
SHADES = {
    FREE: (255, 255, 255),
    BLOCKED: (0, 0, 0),
    UNKNOWN: (205, 205, 205),
    START: (255, 0, 0),
    GOAL: (255, 215, 0),
    BODY: (255, 20, 147),
}
"""The colour each code is saved in."""

_ALLOWED = "grey, or the legend: red start, gold (255,215,0) goal, deep pink (255,20,147) moving obstacle"


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
    notes : what else there is to say.
    """

    samples: NDArray[Any]
    maxval: int = 255
    clear: NDArray[np.bool_] | None = None
    palette: NDArray[np.uint8] | None = None
    alpha: NDArray[np.uint8] | None = None
    left_out: NDArray[np.bool_] | None = None
    halved: bool = False
    notes: tuple[str, ...] = ()


def read_pixels(pixels: Pixels, source: Source) -> Reading:
    """Codes of a picture by the legend and the grey rule.

    Raises
    ------
    FileError : an index beyond the palette, a colour that is neither grey nor of the legend.
    """
    if pixels.palette is not None:
        alpha = np.full(len(pixels.palette), 255, np.uint8) if pixels.alpha is None else pixels.alpha
        reading = read_palette(pixels.samples, pixels.palette, alpha, source)
    elif pixels.samples.ndim == 3:
        reading = read_colour(pixels.samples, pixels.clear, source)
    else:
        reading = read_grey(pixels.samples, pixels.maxval, pixels.clear)
    notes = (*pixels.notes, *reading.notes)
    if pixels.left_out is not None and (n := int(np.count_nonzero(pixels.left_out))):
        reading.codes[pixels.left_out] = UNKNOWN
        notes += (f"{plural(n, 'pixel')} the picture leaves out read as unknown",)
    return Reading(reading.codes, notes)


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
    index: NDArray[np.uint8], colours: NDArray[np.uint8], alpha: NDArray[np.uint8], source: Source
) -> Reading:
    """Codes of palette indices (height, width); ``colours`` (n, 3) and ``alpha`` (n,) are the palette.

    Raises
    ------
    FileError : an index beyond the palette, a colour that is neither grey nor of the legend.
    """
    n = len(colours)
    if n < 256 and int(index.max()) >= n:
        x, y = first_bad(index >= n)
        raise source.error(
            "IMG_CORRUPT", f"colour number {index[y, x]}; the palette has {n}", f"pixel ({x},{y})"
        )
    table = _colour_codes(colours)
    table[alpha < 255] = FREE  # a colour nobody sees need not be of the legend; it becomes unknown below
    codes = look_up(np.pad(table, (0, 256 - n), constant_values=BAD), index)
    if (table == BAD).any():
        wrong = codes == BAD
        if wrong.any():
            x, y = first_bad(wrong)
            raise _colour_error(source, x, y, colours[index[y, x]])
    return _finish(codes, (alpha < 255)[index] if (alpha < 255).any() else None)


def read_colour(rgb: NDArray[np.uint8], transparent: NDArray[np.bool_] | None, source: Source) -> Reading:
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


def _colour_error(source: Source, x: int, y: int, colour: NDArray[np.uint8]) -> Exception:
    r, g, b = (int(v) for v in colour)
    return source.error(
        "IMG_COLOUR",
        f"({r},{g},{b}) is not a colour of a map",
        f"pixel ({x},{y})",
        _ALLOWED,
        "save it as grey",
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
