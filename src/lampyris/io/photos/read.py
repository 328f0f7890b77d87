"""The grey levels of a photograph: a JPEG, PNG, BMP or PGM file, or an array, of one or three channels."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import uninterrupted
from lampyris._core.limits import MAX_CELLS
from lampyris.errors import LimitError, SettingError
from lampyris.io.files import read_regular
from lampyris.io.maps.formats import bmp, pgm
from lampyris.io.maps.formats import png as image
from lampyris.io.maps.formats.colours import Pixels, brightness, clear_of, luma
from lampyris.io.maps.formats.document import FileSource, byte_limit, check_limit, look_up
from lampyris.io.photos import jpeg

FORMATS = "JPEG, PNG, BMP, PGM or binary PPM"


@dataclass(frozen=True, slots=True, eq=False)
class GreyPhoto:
    """The levels of a photograph.

    Parameters
    ----------
    levels : uint8, (height, width), row 0 on top.
    clear : bool (height, width), True where a pixel is not wholly opaque and its level means nothing, or None.
    name : of the file, without its folder; empty for an array.
    notes : sentences about how it was read.
    """

    levels: NDArray[np.uint8]
    clear: NDArray[np.bool_] | None = None
    name: str = ""
    notes: tuple[str, ...] = ()


def read_photo(
    path: str | os.PathLike[str], channel: str = "luma", *, max_cells: int = MAX_CELLS
) -> GreyPhoto:
    """Read a photograph; the content decides what the file is, never its name.

    Parameters
    ----------
    path : the file.
    channel : ``luma`` (Rec. 601, rounded down), ``red``, ``green`` or ``blue``; grey pictures have one channel, which
        is all of these.
    max_cells : more pixels than this are refused, from the header.

    Raises
    ------
    FileError : FILE_MISSING, FILE_KIND, IMG_EMPTY, IMG_FORMAT, or what is wrong in the file.
    LimitError : IMG_TOO_LARGE or FILE_TOO_LARGE.
    """
    name = os.fsdecode(path)
    source = FileSource(read_regular(name, byte_limit(check_limit(max_cells))), name, max_cells)
    head = source.data[:4096]
    if not head:
        raise source.error("IMG_EMPTY", "the file is empty")
    if head.startswith(jpeg.MAGIC):
        pixels = jpeg.pixels_jpeg(source)
    elif head.startswith(image.MAGIC):
        pixels = image.pixels_png(source)
    elif bmp.looks_like(head):
        pixels = bmp.pixels_bmp(source)
    elif pgm.looks_like(head):
        pixels = pgm.pixels_pgm(source)
    else:
        raise image.not_a_picture(source, FORMATS)
    levels, notes = _levels(pixels, channel, source)
    clear = clear_of(pixels)
    if pixels.left_out is not None and pixels.left_out.any():
        clear = pixels.left_out
    return GreyPhoto(levels, clear, os.path.basename(name), (*pixels.notes, *notes))


def photo_of(samples: object, channel: str = "luma", *, max_cells: int = MAX_CELLS) -> GreyPhoto:
    """The levels of an array, uint8 (height, width) or (height, width, 3) in red, green and blue.

    Raises
    ------
    SettingError : ``PHOTO``: another shape or type.
    LimitError : ``IMG_TOO_LARGE``.
    """
    is_array = isinstance(samples, np.ndarray)
    if not isinstance(samples, np.ndarray) or samples.dtype != np.uint8 or not _fits(samples.shape):
        given = f"{samples.dtype} of shape {samples.shape}" if is_array else f"a {type(samples).__name__}"  # type: ignore[attr-defined]
        allowed = "a file's name, or uint8 of shape (height, width) or (height, width, 3)"
        raise SettingError("PHOTO", given, where="photo", allowed=allowed)
    height, width = samples.shape[:2]
    if height * width > check_limit(max_cells):
        what = f"{width} x {height} is {height * width:,} pixels"
        raise LimitError("IMG_TOO_LARGE", what, where="photo", allowed=f"at most {max_cells:,} pixels")
    return GreyPhoto(_channel(samples, channel) if samples.ndim == 3 else samples)


def median_of(levels: NDArray[np.uint8], side: int) -> NDArray[np.uint8]:
    """Each level replaced by the median of the square of so many pixels around it; the edge is repeated outside.

    Parameters
    ----------
    levels : uint8 (height, width).
    side : odd.
    """
    if side == 1:
        return levels
    with uninterrupted():
        from PIL import Image, ImageFilter

    padded = np.pad(levels, side // 2, mode="edge")
    height, width = padded.shape
    picture = Image.frombytes("L", (width, height), padded.tobytes())
    filtered = np.asarray(picture.filter(ImageFilter.MedianFilter(side)), dtype=np.uint8)
    inner = slice(side // 2, -(side // 2))
    return np.ascontiguousarray(filtered[inner, inner])


def _fits(shape: tuple[int, ...]) -> bool:
    return min(shape, default=0) > 0 and (len(shape) == 2 or (len(shape) == 3 and shape[2] == 3))


def _channel(rgb: NDArray[np.uint8], channel: str) -> NDArray[np.uint8]:
    if channel == "luma":
        return luma(rgb)
    return np.ascontiguousarray(rgb[..., ("red", "green", "blue").index(channel)])


def _levels(pixels: Pixels, channel: str, source: FileSource) -> tuple[NDArray[np.uint8], tuple[str, ...]]:
    """8-bit levels (height, width), and what to note of them."""
    samples: NDArray[Any] = pixels.samples
    if pixels.palette is not None:
        grey, _ = brightness(pixels, source)  # refuses indices beyond the palette
        if channel == "luma":
            return grey, ()
        column = _channel(pixels.palette, channel)
        return look_up(np.pad(column, (0, 256 - len(column))), samples), ()
    if samples.ndim == 3:
        return _channel(samples, channel), ("16 bits a channel were read to their upper 8",) * pixels.halved
    if pixels.maxval == 255:
        return samples.astype(np.uint8, copy=False), ()
    levels = samples.astype(np.uint32) * 255 // pixels.maxval
    return levels.astype(np.uint8), (f"grey of 0 to {pixels.maxval} was scaled to 0 to 255",)
