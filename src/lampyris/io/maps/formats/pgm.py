"""The netpbm family: PGM (P2, P5), PBM (P1, P4) and colour PPM (P6), 8 and 16 bit.

Read here and not by Pillow, which spends 24 s on a comment of 50 MB, clips samples above maxval to white,
and makes 16-bit samples a mode whose conversion to 8 bits clips as well. A brightness is sample / maxval,
whatever maxval is.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris.io.maps.formats.colours import Pixels, read_pixels
from lampyris.io.maps.formats.document import FileSource, Reading, first_bad

HEADER_BYTES = 4096
_MAGIC = re.compile(rb"P[12456][\s#]")
# A token, after white space and comments. A comment ends with its line.
_TOKEN = re.compile(rb"(?:\s|#[^\n\r]*[\n\r])*([^\s#]+)")
_WHITE = b" \t\n\v\f\r"


@dataclass(frozen=True, slots=True)
class _Header:
    kind: int
    width: int
    height: int
    maxval: int
    end: int
    """Offset just behind the last header token."""


def looks_like(head: bytes) -> bool:
    """Whether a file begins like one of the family."""
    return _MAGIC.match(head) is not None


def read_pgm(source: FileSource) -> Reading:
    """Read one picture.

    Raises
    ------
    FileError : PGM_HEADER, PGM_TOKEN, PGM_SIZE, PGM_MAXVAL, PGM_SAMPLE, PGM_TRAILING, IMG_TRUNCATED,
        IMG_COLOUR.
    LimitError : IMG_TOO_LARGE, from the header.
    """
    return read_pixels(pixels_pgm(source), source)


def pixels_pgm(source: FileSource) -> Pixels:
    """The pixels of one picture, not yet interpreted: errors as of :func:`read_pgm`, but for IMG_COLOUR."""
    header = _header(source)
    source.check_size(header.width, header.height, "IMG_TOO_LARGE")
    if header.kind in (1, 2):
        samples = _plain(source, header)
    else:
        samples = _raw(source, header)
    if header.kind in (1, 4):
        return Pixels((1 - samples).astype(np.uint8), 1)  # in a bitmap 1 is black
    if header.kind == 6:
        return Pixels(samples.astype(np.uint8))
    if int(samples.max()) > header.maxval:
        x, y = first_bad(samples > header.maxval)
        raise source.error(
            "PGM_SAMPLE", f"sample {samples[y, x]}", f"pixel ({x},{y})", f"0 to {header.maxval}, the maxval"
        )
    return Pixels(samples.astype(np.uint16 if header.maxval > 255 else np.uint8, copy=False), header.maxval)


def _header(source: FileSource) -> _Header:
    head = source.data[:HEADER_BYTES]
    kind = head[1] - ord("0")
    offset = 2
    numbers: list[int] = []
    for what in ("width", "height") if kind in (1, 4) else ("width", "height", "maxval"):
        match = _TOKEN.match(head, offset)
        if match is None or match.end() == HEADER_BYTES:
            if len(source.data) > HEADER_BYTES:
                raise source.error("PGM_HEADER", f"header longer than {HEADER_BYTES} bytes")
            raise source.error("IMG_TRUNCATED", f"the file ends before the {what}")
        token = match[1].decode("latin-1")
        if not re.fullmatch(r"-?[0-9]{1,10}", token):
            long = token.lstrip("-").isdigit() and token.isascii()
            wrong = "number longer than 10 digits" if long else f"{source.quoted(token[:20])} is not a number"
            raise source.error("PGM_TOKEN", f"{what}: {wrong}", _line(source, match.start(1)))
        numbers.append(int(token))
        offset = match.end()
    width, height, maxval = numbers if len(numbers) == 3 else (*numbers, 1)
    for what, value in (("width", width), ("height", height)):
        if value < 1:
            raise source.error("PGM_SIZE", f"{what} {value}", allowed="1 or more")
    if not 1 <= maxval <= 65535:
        raise source.error("PGM_MAXVAL", str(maxval), allowed="1 to 65535")
    if kind == 6 and maxval != 255:
        raise source.error("PGM_MAXVAL", f"{maxval} in a colour picture", allowed="255")
    return _Header(kind, width, height, maxval, offset)


def _line(source: FileSource, offset: int) -> str:
    line = source.data.count(b"\n", 0, offset) + 1
    return f"line {line}"


def _raw(source: FileSource, header: _Header) -> NDArray[Any]:
    """Samples of a binary raster: (height, width), or (height, width, 3) for colour."""
    data, start = source.data, header.end + 1
    if start > len(data) or data[header.end] not in _WHITE:
        raise source.error("IMG_TRUNCATED", "the file ends before the raster")
    width, height = header.width, header.height
    wide = header.maxval > 255
    row = (
        (width + 7) // 8 if header.kind == 4 else width * (3 if header.kind == 6 else 1) * (2 if wide else 1)
    )
    size, there = row * height, len(data) - start
    if there < size:
        raise source.error("IMG_TRUNCATED", f"{there:,} of {size:,} bytes of samples")
    # Some programs end the file with an end of line; more than that is another picture or a wrong header.
    if there > size and data[start + size :] not in (b"\n", b"\r\n"):
        raise source.error("PGM_TRAILING", f"{there - size:,} bytes after the raster")
    flat = np.frombuffer(
        data, dtype=">u2" if wide else np.uint8, offset=start, count=size // (2 if wide else 1)
    )
    if header.kind == 4:
        return np.unpackbits(flat.reshape(height, row), axis=1)[:, :width]
    if header.kind == 6:
        return flat.reshape(height, width, 3)
    return flat.astype(np.uint16, copy=False).reshape(height, width) if wide else flat.reshape(height, width)


def _plain(source: FileSource, header: _Header) -> NDArray[Any]:
    """Samples of a raster written in digits, int64 or uint8 (height, width)."""
    raster = source.data[header.end :]
    need = header.width * header.height
    digits = b"01" if header.kind == 1 else b"0123456789"
    if raster.translate(None, digits + _WHITE):
        odd = re.search(rb"[^\s" + digits + rb"]", raster)
        assert odd is not None
        begin = max(raster.rfind(_WHITE[k : k + 1], 0, odd.start()) for k in range(len(_WHITE))) + 1
        token = raster[begin : begin + 20].split()[0].decode("latin-1")
        where = _line(source, header.end + begin)
        raise source.error("PGM_TOKEN", f"{source.quoted(token)} is not a number", where)
    if header.kind == 1:
        bits = raster.translate(None, _WHITE)  # a bitmap's digits need no space between them
        _count(source, len(bits), need)
        return (np.frombuffer(bits, dtype=np.uint8) - ord("0")).reshape(header.height, header.width)
    long = re.search(rb"[0-9]{11}", raster)
    if long is not None:
        where = _line(source, header.end + long.start())
        raise source.error("PGM_TOKEN", "number longer than 10 digits", where)
    value = np.fromstring(raster, dtype=np.int64, sep=" ")
    _count(source, value.size, need)
    return value.reshape(header.height, header.width)


def _count(source: FileSource, there: int, need: int) -> None:
    if there < need:
        raise source.error("IMG_TRUNCATED", f"{there:,} of {need:,} samples")
    if there > need:
        raise source.error("PGM_TRAILING", f"{there - need:,} samples after the raster")
