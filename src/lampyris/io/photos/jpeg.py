"""JPEG photographs: the markers are checked here, the pixels are decoded by Pillow.

Pillow gets a file of what decides the pixels alone: tables, frames, scans and the two application segments that
say how colours are coded. No profile, comment, thumbnail or second picture reaches a parser. The size is looked at
before anything is decoded, and so is the number of scans: each of a progressive picture is a pass over all of it.

JPEG has no checksums: damaged data that still decode cannot be distinguished from good data.
"""

from __future__ import annotations

import io
import re
import struct
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import uninterrupted
from lampyris.io.maps.formats.colours import Pixels
from lampyris.io.maps.formats.document import FileSource
from lampyris.io.maps.formats.png import orientation_of

MAGIC = b"\xff\xd8\xff"
MAX_SCANS = 200
"""Passes over a picture; those of libjpeg's own script for progressive colour are 10."""
MAX_SEGMENTS = 10_000
_BASELINE, _EXTENDED, _PROGRESSIVE = 0xC0, 0xC1, 0xC2
_FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
_DHT, _RST0, _EOI, _SOS, _DQT, _DRI, _DNL = 0xC4, 0xD0, 0xD9, 0xDA, 0xDB, 0xDD, 0xDC
_JFIF, _EXIF, _ADOBE = 0xE0, 0xE1, 0xEE
_KEPT = frozenset({_DHT, _DQT, _DRI, _SOS, _JFIF, _ADOBE})
_NEXT = re.compile(rb"\xff+[^\x00\xff\xd0-\xd7]")
"""The marker that ends the data of a scan: neither a stuffed byte nor a restart."""


@dataclass(slots=True)
class _Jpeg:
    """The parts of a JPEG that decide what its pixels are; ``coded`` are bytes of its scans."""

    width: int = 0
    height: int = 0
    channels: int = 0
    scans: int = 0
    coded: int = 0
    turn: int = 0
    parts: list[bytes] = field(default_factory=list)


def pixels_jpeg(source: FileSource) -> Pixels:
    """The pixels of a JPEG of one or three channels, turned as its EXIF orientation says.

    Raises
    ------
    FileError : IMG_CORRUPT, IMG_TRUNCATED, IMG_SIZE, JPEG_CODING (12 bits, lossless or arithmetic coding),
        JPEG_CHANNELS (four channels for print).
    LimitError : IMG_TOO_LARGE, from the header and before anything is decoded.
    """
    jpeg = _take_apart(source)
    samples = _decode(source, jpeg)
    notes: tuple[str, ...] = ()
    if jpeg.turn in _EXIF_TURNS:
        samples = np.ascontiguousarray(_EXIF_TURNS[jpeg.turn](samples))
        notes = (f"turned or mirrored as its EXIF orientation {jpeg.turn} says",)
    return Pixels(samples, notes=notes)


_EXIF_TURNS: dict[int, Any] = {
    2: lambda a: a[:, ::-1],
    3: lambda a: a[::-1, ::-1],
    4: lambda a: a[::-1],
    5: lambda a: a.swapaxes(0, 1),
    6: lambda a: a[::-1].swapaxes(0, 1),
    7: lambda a: a[::-1, ::-1].swapaxes(0, 1),
    8: lambda a: a[:, ::-1].swapaxes(0, 1),
}
"""What shows a picture upright whose camera was held so, by EXIF orientation."""


def _take_apart(source: FileSource) -> _Jpeg:
    """Frame, orientation and what the decoder needs, up to the end of the first picture."""
    data, jpeg = source.data, _Jpeg(parts=[MAGIC[:2]])
    at = 2
    for _ in range(MAX_SEGMENTS):
        if at + 4 > len(data):
            break
        if data[at] != 0xFF:
            raise source.error("IMG_CORRUPT", f"no marker at byte {at}")
        kind = data[at + 1]
        if kind == 0xFF:  # a fill byte
            at += 1
            continue
        if kind in (_EOI, 0x00, 0x01) or _RST0 <= kind < _EOI:
            raise source.error("IMG_CORRUPT", f"marker {kind:#04x} at byte {at} before any pixels")
        (length,) = struct.unpack_from(">H", data, at + 2)
        end = at + 2 + length
        if length < 2:
            raise source.error("IMG_CORRUPT", f"a segment of {length} bytes at byte {at}")
        if end > len(data):
            break
        body = data[at + 4 : end]
        if kind in _FRAMES:
            _frame(source, jpeg, kind, body)
        elif kind == _EXIF and body.startswith(b"Exif\0\0") and not jpeg.turn:
            jpeg.turn = orientation_of(body[6:])
        elif kind == _DNL:
            raise source.error("JPEG_CODING", "the height stands behind the pixels", allowed="in the header")
        if kind in _FRAMES or kind in _KEPT:
            jpeg.parts.append(data[at:end])
        at = end
        if kind == _SOS:
            if not jpeg.channels:
                raise source.error("IMG_CORRUPT", "a scan before any frame")
            jpeg.scans += 1
            if jpeg.scans > MAX_SCANS:
                raise source.error("IMG_CORRUPT", f"more than {MAX_SCANS} scans")
            match = _NEXT.search(data, at)
            if match is None:
                break
            end = match.end() - 2
            jpeg.parts.append(data[at:end])
            jpeg.coded += end - at
            at = end
            if data[at + 1] == _EOI:
                _enough(source, jpeg)
                jpeg.parts.append(b"\xff\xd9")
                return jpeg
    else:
        raise source.error("IMG_CORRUPT", f"more than {MAX_SEGMENTS} segments")
    raise source.error("IMG_TRUNCATED", f"the file ends at byte {len(data)}, before its end marker")


def _frame(source: FileSource, jpeg: _Jpeg, kind: int, body: bytes) -> None:
    if jpeg.channels:
        raise source.error("IMG_CORRUPT", "a second frame")
    if len(body) < 6 or len(body) != 6 + 3 * body[5]:
        raise source.error("IMG_CORRUPT", f"a frame header of {len(body)} bytes")
    depth, height, width, channels = struct.unpack_from(">BHHB", body)
    if kind not in (_BASELINE, _EXTENDED, _PROGRESSIVE) or depth != 8:
        what = f"{depth} bits, coding process {kind - 0xC0}"
        raise source.error("JPEG_CODING", what, allowed="8 bits, baseline, extended or progressive Huffman")
    if width < 1 or height < 1:
        raise source.error("IMG_SIZE", f"{width} x {height}", allowed="1 or more each")
    if channels not in (1, 3):
        todo = "save it in red, green and blue"
        raise source.error("JPEG_CHANNELS", f"{channels} channels", allowed="1 (grey) or 3", todo=todo)
    source.check_size(width, height, "IMG_TOO_LARGE")
    jpeg.width, jpeg.height, jpeg.channels = width, height, channels


def _enough(source: FileSource, jpeg: _Jpeg) -> None:
    """Refuse what has less than a bit for each block of 8 x 8 pixels: the decoder would make grey of the rest."""
    blocks = -(-jpeg.width // 8) * -(-jpeg.height // 8)
    if 8 * jpeg.coded < blocks:
        what = f"{jpeg.coded:,} bytes of pixel data for {blocks:,} blocks of 8 x 8 pixels"
        raise source.error("IMG_TRUNCATED", what)


def _decode(source: FileSource, jpeg: _Jpeg) -> NDArray[np.uint8]:
    """The pixels as Pillow has them: (height, width), or (height, width, 3) in red, green and blue."""
    with uninterrupted():
        from PIL import Image

    try:
        with Image.open(io.BytesIO(b"".join(jpeg.parts)), formats=["JPEG"]) as picture:
            picture.load()
            samples: NDArray[np.uint8] = np.array(picture, dtype=np.uint8)
    except Exception as problem:
        # Pillow's decoders raise half a dozen built-in types; whatever it is, the file is at fault.
        raise source.error("IMG_CORRUPT", f"pixels cannot be decoded ({problem})") from None
    expected = (jpeg.height, jpeg.width) if jpeg.channels == 1 else (jpeg.height, jpeg.width, 3)
    if samples.shape != expected:
        raise source.error("IMG_CORRUPT", f"decoded to {samples.shape}")
    return samples
