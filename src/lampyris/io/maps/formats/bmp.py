"""BMP pictures of 1, 4, 8, 24 and 32 bits, uncompressed or run-length coded.

Read here and not by Pillow, which fills palettes that are too short with greys of its own and pixels that a
run-length code skips with colour 0: both may be white, and white is free.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.io.maps.formats.colours import Pixels, read_pixels
from lampyris.io.maps.formats.document import FileSource, Reading

MAGIC = b"BM"
_HEADERS = (12, 40, 52, 56, 64, 108, 124)
_RGB, _RLE8, _RLE4, _FIELDS, _ALPHA_FIELDS = 0, 1, 2, 3, 6


@dataclass(frozen=True, slots=True)
class _Header:
    width: int
    height: int
    top_down: bool
    bits: int
    packing: int
    colours: int
    """Entries of the palette."""
    entry: int
    """Bytes of an entry: 4, or 3 in the oldest files."""
    palette: int
    """Offset of the palette (or of the masks in a 40-byte header)."""
    size: int
    """Bytes of the second header."""
    raster: int
    """Offset of the raster."""


def looks_like(head: bytes) -> bool:
    """Whether a file begins like a BMP: its two letters and a header of a known size."""
    return head.startswith(MAGIC) and len(head) >= 18 and struct.unpack_from("<I", head, 14)[0] in _HEADERS


def read_bmp(source: FileSource) -> Reading:
    """Read a BMP; a negative height means rows from the top.

    Raises
    ------
    FileError : BMP_HEADER, BMP_DEPTH, BMP_PACKING, IMG_SIZE, IMG_TRUNCATED, IMG_CORRUPT, IMG_COLOUR.
    LimitError : IMG_TOO_LARGE, from the header.
    """
    return read_pixels(pixels_bmp(source), source)


def pixels_bmp(source: FileSource) -> Pixels:
    """The pixels of a BMP, not yet interpreted: errors as of :func:`read_bmp`, but for IMG_COLOUR."""
    h = _header(source)
    source.check_size(h.width, h.height, "IMG_TOO_LARGE")
    if h.bits > 8:
        rgb, transparent = _true_colour(source, h)
        return Pixels(rgb, clear=transparent)
    table = _palette(source, h)
    if h.packing == _RGB:
        return Pixels(_indices(source, h), palette=table)
    index, painted = _run_lengths(source, h)
    return Pixels(index, palette=table, left_out=~painted)


def _header(source: FileSource) -> _Header:
    data = source.data
    try:
        raster, size = struct.unpack_from("<II", data, 10)
        if size == 12:
            width, height, _, bits = struct.unpack_from("<HHHH", data, 18)
            packing = used = 0
        else:
            width, height, _, bits, packing = struct.unpack_from("<iiHHI", data, 18)
            (used,) = struct.unpack_from("<I", data, 46)
    except struct.error:
        raise source.error("IMG_TRUNCATED", "the header ends early") from None
    if width < 1 or height == 0:
        raise source.error("IMG_SIZE", f"{width} x {height}", allowed="1 or more each")
    if bits not in (1, 4, 8, 24, 32):
        raise source.error("BMP_DEPTH", f"{bits} bits a pixel", allowed="1, 4, 8, 24, 32")
    fits = {_RGB: True, _RLE8: bits == 8, _RLE4: bits == 4, _FIELDS: bits == 32, _ALPHA_FIELDS: bits == 32}
    if not fits.get(packing, False) or (packing in (_RLE8, _RLE4) and height < 0):
        raise source.error(
            "BMP_PACKING", f"packing {packing} with {bits} bits", allowed="none, or run lengths"
        )
    colours = (used or 1 << bits) if bits <= 8 else 0
    if colours > 256 or colours > 1 << bits:
        raise source.error("IMG_CORRUPT", f"{colours} palette entries for {bits} bits")
    entry = 3 if size == 12 else 4
    if raster > len(data):
        raise source.error("IMG_TRUNCATED", "the file ends before the raster")
    if raster < 14 + size + colours * entry:
        raise source.error("IMG_CORRUPT", f"the raster begins at byte {raster}, inside the header")
    return _Header(width, abs(height), height < 0, bits, packing, colours, entry, 14 + size, size, raster)


def _rows(source: FileSource, h: _Header) -> NDArray[np.uint8]:
    """The raster's bytes, one row a row, row 0 on top."""
    stride = (h.width * h.bits + 31) // 32 * 4
    size, there = stride * h.height, len(source.data) - h.raster
    if there < size:
        raise source.error("IMG_TRUNCATED", f"{there:,} of {size:,} bytes of pixels")
    rows = np.frombuffer(source.data, np.uint8, count=size, offset=h.raster).reshape(h.height, stride)
    return rows if h.top_down else rows[::-1]


def _palette(source: FileSource, h: _Header) -> NDArray[np.uint8]:
    """Colours (n, 3)."""
    raw = np.frombuffer(source.data, np.uint8, count=h.colours * h.entry, offset=h.palette)
    return raw.reshape(h.colours, h.entry)[:, 2::-1]


def _indices(source: FileSource, h: _Header) -> NDArray[np.uint8]:
    rows = _rows(source, h)
    if h.bits == 1:
        rows = np.unpackbits(rows, axis=1)
    elif h.bits == 4:
        rows = np.stack((rows >> 4, rows & 15), axis=2).reshape(h.height, -1)
    return rows[:, : h.width]


def _true_colour(source: FileSource, h: _Header) -> tuple[NDArray[np.uint8], NDArray[np.bool_] | None]:
    """Colours (height, width, 3), and where they are not wholly opaque."""
    n = h.bits // 8
    pixels = _rows(source, h)[:, : h.width * n].reshape(h.height, h.width, n)
    if h.packing == _RGB:
        return pixels[:, :, 2::-1], None  # the fourth byte of a plain 32-bit pixel is unused
    masks = list(struct.unpack_from("<III", source.data, 54)) if len(source.data) >= 66 else []
    if h.packing == _ALPHA_FIELDS or h.size >= 56:
        masks += struct.unpack_from("<I", source.data, 66) if len(source.data) >= 70 else [0]
    place = {0xFF << (8 * k): k for k in range(4)}
    alpha = masks.pop() if len(masks) == 4 else 0
    wanted = [*masks, alpha] if alpha else masks
    if len(masks) != 3 or len(set(wanted)) != len(wanted) or not all(m in place for m in wanted):
        raise source.error("BMP_PACKING", "channels are not whole bytes", allowed="8 bits for each channel")
    rgb = np.stack([pixels[:, :, place[m]] for m in masks], axis=2)
    return rgb, (pixels[:, :, place[alpha]] < 255) if alpha else None


def _run_lengths(source: FileSource, h: _Header) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """Indices and which pixels were painted at all, both (height, width)."""
    data, at, width, half = source.data, h.raster, h.width, h.packing == _RLE4
    index, painted = bytearray(h.width * h.height), bytearray(h.width * h.height)
    x, y = 0, h.height - 1
    try:
        while (data[at], data[at + 1]) != (0, 1):
            count, value = data[at], data[at + 1]
            at += 2
            if count == 0 and value in (0, 2):
                dx, dy = (data[at], data[at + 1]) if value else (-x, 1)
                at += value
                x, y = x + dx, y - dy
                # Neither outside nor in place: so the picture's size bounds the work, whatever the
                # file's is.
                if y < -1 or x > width or (dx, dy) == (0, 0):
                    raise source.error("IMG_CORRUPT", f"a step of ({dx},{dy}) to pixel ({x},{y})")
                continue
            if count:
                run = bytes((value >> 4, value & 15)) * 128 if half else bytes((value,)) * count
            else:
                count = value
                length = (count + 1) // 2 if half else count
                run = data[at : at + length]
                if len(run) < length:
                    raise IndexError
                if half:
                    run = bytes(nibble for both in run for nibble in (both >> 4, both & 15))
                at += length + (length & 1)
            if y < 0 or x + count > width:
                raise source.error(
                    "IMG_CORRUPT", f"a run of {count} pixels leaves the picture", f"pixel ({x},{y})"
                )
            k = y * width + x
            index[k : k + count] = run[:count]
            painted[k : k + count] = b"\1" * count
            x += count
    except IndexError:
        raise source.error("IMG_TRUNCATED", f"the run lengths end early, in row {max(y, 0)}") from None
    shape = (h.height, h.width)
    return (
        np.frombuffer(index, dtype=np.uint8).reshape(shape),
        np.frombuffer(painted, dtype=np.bool_).reshape(shape),
    )
