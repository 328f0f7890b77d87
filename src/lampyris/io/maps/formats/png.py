"""PNG pictures, one pixel a cell. The container is checked here, the pixels are decoded by Pillow.

What a decoder forgives is dangerous in a map: rows that are missing come out as colour 0, colours beyond
the palette as black, a transparent grey of a 2-bit picture is compared unscaled, 16-bit grey turned to 8
bits is clipped (a dark 16384 becomes white, that is free). So every checksum, the length of the pixel data,
palette and transparency are looked at here, and Pillow gets a file of the bare pixels: no text, profile or
time chunk reaches a parser. 16-bit colour (not grey) is read to its upper 8 bits, which never turns a pixel
free that is not; its alpha is read whole.
"""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lampyris._core.cancellation import uninterrupted
from lampyris.io.maps.formats.colours import Pixels, read_pixels
from lampyris.io.maps.formats.document import FileSource, Reading

MAGIC = b"\x89PNG\r\n\x1a\n"
MAX_TEXT = 2**20
MAX_CHUNKS = 2**18
_GREY, _RGB, _INDEX, _GREY_ALPHA, _RGBA = 0, 2, 3, 4, 6
_DEPTHS = {_GREY: (1, 2, 4, 8, 16), _RGB: (8, 16), _INDEX: (1, 2, 4, 8), _GREY_ALPHA: (8, 16), _RGBA: (8, 16)}
_KINDS = frozenset((b"IHDR", b"PLTE", b"IDAT", b"IEND", b"tRNS", b"acTL", b"zTXt", b"eXIf"))
_CHANNELS = {_GREY: 1, _RGB: 3, _INDEX: 1, _GREY_ALPHA: 2, _RGBA: 4}
# Adam7: first column, first row, column step, row step of each pass.
_PASSES = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))


@dataclass(slots=True)
class _Png:
    """The parts of a PNG that decide what its pixels are."""

    width: int
    height: int
    depth: int
    colour: int
    interlaced: bool
    header: bytes
    palette: bytes = b""
    transparency: bytes | None = None
    pixels: tuple[memoryview, ...] = ()
    notes: tuple[str, ...] = ()


def read_png(source: FileSource) -> Reading:
    """Read a PNG.

    Raises
    ------
    FileError : IMG_CORRUPT, IMG_TRUNCATED, IMG_SIZE, IMG_FRAMES or IMG_COLOUR.
    LimitError : IMG_TOO_LARGE, from the header and before anything is decoded.
    """
    return read_pixels(pixels_png(source), source)


def pixels_png(source: FileSource) -> Pixels:
    """The pixels of a PNG, not yet interpreted: errors as of :func:`read_png`, but for IMG_COLOUR."""
    png = _take_apart(source)
    _check_length(source, png)
    return _pixels(png, _decode(source, png))


def _take_apart(source: FileSource) -> _Png:
    """Header, palette, transparency and pixel data, every checksum verified."""
    chunks = _chunks(source)
    kind, body = next(chunks, (b"", memoryview(b"")))
    if kind != b"IHDR" or len(body) != 13:
        raise source.error("IMG_CORRUPT", "the header chunk IHDR is missing")
    png = _header(source, bytes(body))
    pixels: list[memoryview] = []
    notes: list[str] = []
    for kind, body in chunks:
        if kind == b"IDAT":
            pixels.append(body)
        elif kind == b"PLTE":
            if (
                len(body) % 3
                or not 3 <= len(body) <= 768
                or (png.colour == _INDEX and len(body) > 3 << png.depth)
            ):
                raise source.error("IMG_CORRUPT", f"a palette of {len(body)} bytes")
            png.palette = bytes(body)
        elif kind == b"tRNS":
            _check_transparency(source, png, body)
            png.transparency = bytes(body)
        elif kind == b"acTL" and len(body) >= 4 and (frames := struct.unpack_from(">I", body)[0]) > 1:
            raise source.error("IMG_FRAMES", f"{frames} frames", todo="give a single image")
        elif kind == b"zTXt":
            _check_text(source, bytes(body))
        elif kind == b"eXIf" and (turn := orientation_of(bytes(body))) not in (0, 1):
            notes.append(f"the EXIF orientation {turn} is ignored; a viewer may show the map turned")
        elif kind == b"IHDR" or (not kind[0] & 32 and kind != b"IEND"):
            raise source.error("IMG_CORRUPT", f"chunk{_kind(source, kind)} in a place or of a kind unknown")
    if png.colour == _INDEX and not png.palette:
        raise source.error("IMG_CORRUPT", "the palette is missing")
    png.pixels, png.notes = tuple(pixels), tuple(notes)
    return png


def _chunks(source: FileSource) -> Iterator[tuple[bytes, memoryview]]:
    """Kind and body of each chunk up to IEND, checksums verified."""
    data = memoryview(source.data)
    offset = len(MAGIC)
    for _ in range(MAX_CHUNKS):
        if offset + 12 > len(data):
            raise source.error("IMG_TRUNCATED", f"the file ends at byte {len(data)}, before its end chunk")
        length, kind = struct.unpack_from(">I4s", data, offset)
        end = offset + 12 + length
        if end > len(data):
            raise source.error(
                "IMG_TRUNCATED", f"the picture is cut off: chunk{_kind(source, kind)} ends early"
            )
        (checksum,) = struct.unpack_from(">I", data, end - 4)
        if zlib.crc32(data[offset + 4 : end - 4]) != checksum:
            raise source.error("IMG_CORRUPT", f"checksum of chunk{_kind(source, kind)} at byte {offset}")
        yield kind, data[offset + 8 : end - 4]
        if kind == b"IEND":
            return
        offset = end
    raise source.error("IMG_CORRUPT", f"more than {MAX_CHUNKS} chunks")


def _kind(source: FileSource, kind: bytes) -> str:
    """The kind of a chunk for a message, unless it may be anything of a file that must not be quoted."""
    return f" {kind.decode('latin-1')!r}" if source.quotes or kind in _KINDS else ""


def _header(source: FileSource, body: bytes) -> _Png:
    width, height, depth, colour, packing, filtering, interlace = struct.unpack(">IIBBBBB", body)
    if width < 1 or height < 1:
        raise source.error("IMG_SIZE", f"{width} x {height}", allowed="1 or more each")
    source.check_size(width, height, "IMG_TOO_LARGE")
    if depth not in _DEPTHS.get(colour, ()) or packing or filtering or interlace > 1:
        raise source.error(
            "IMG_CORRUPT", f"colour type {colour}, depth {depth}, method {packing}/{filtering}/{interlace}"
        )
    return _Png(width, height, depth, colour, interlace == 1, body)


def _check_transparency(source: FileSource, png: _Png, body: memoryview) -> None:
    fits = {_GREY: len(body) == 2, _RGB: len(body) == 6, _INDEX: 1 <= len(body) <= len(png.palette) // 3}
    if not fits.get(png.colour, False):
        raise source.error("IMG_CORRUPT", f"a transparency of {len(body)} bytes for colour type {png.colour}")


def _check_text(source: FileSource, body: bytes) -> None:
    """Refuse packed text that unpacks to more than a megabyte; the text itself is not used."""
    packed = body[body.find(b"\0") + 2 :]
    try:
        size = len(zlib.decompressobj().decompress(packed, MAX_TEXT + 1))
    except zlib.error:
        raise source.error("IMG_CORRUPT", "a text chunk cannot be unpacked") from None
    if size > MAX_TEXT:
        raise source.error(
            "IMG_CORRUPT", "text chunk too large", allowed=f"at most {MAX_TEXT:,} bytes unpacked"
        )


def orientation_of(body: bytes) -> int:
    """The EXIF orientation, 0 where there is none to be found."""
    order = {b"II": "<", b"MM": ">"}.get(body[:2])
    try:
        if order is None:
            return 0
        (at,) = struct.unpack_from(order + "I", body, 4)
        (entries,) = struct.unpack_from(order + "H", body, at)
        for k in range(min(entries, 256)):
            tag, kind, _, value = struct.unpack_from(order + "HHIH", body, at + 2 + 12 * k)
            if (tag, kind) == (0x0112, 3):
                return int(value)
    except struct.error:
        pass
    return 0


def _check_length(source: FileSource, png: _Png) -> None:
    """Unpack the pixel data once, keeping none of it, to see that no row is missing."""
    bits = _CHANNELS[png.colour] * png.depth
    need = 0
    for x0, y0, dx, dy in _PASSES if png.interlaced else ((0, 0, 1, 1),):
        w, h = -(-(png.width - x0) // dx), -(-(png.height - y0) // dy)
        if w > 0 and h > 0:
            need += h * (1 + (w * bits + 7) // 8)
    there = 0
    stream = zlib.decompressobj()
    try:
        for part in png.pixels:
            there += len(stream.decompress(part, 2**20))
            while stream.unconsumed_tail and there <= need:
                there += len(stream.decompress(stream.unconsumed_tail, 2**20))
            if stream.eof or there > need:
                break
        if there <= need and not stream.eof:
            there += len(stream.flush())
    except zlib.error as problem:
        raise source.error("IMG_CORRUPT", f"pixel data cannot be unpacked ({problem})") from None
    if there < need:
        raise source.error(
            "IMG_TRUNCATED", f"the picture is cut off: pixel data ends early: {there:,} of {need:,} bytes"
        )


def _decode(source: FileSource, png: _Png) -> NDArray[Any]:
    """The pixels as Pillow has them: (height, width) or (height, width, channels).

    Of 16 bits a channel it leaves the upper 8, and an alpha of 65534 would pass for opaque: here what is not
    wholly opaque has less than 255.
    """
    if png.depth < 16 or png.colour not in (_GREY_ALPHA, _RGBA):
        return _unpacked(source, png, png.header)
    if png.colour == _GREY_ALPHA:
        # Four bytes a pixel, filtered as those of 8-bit colour with alpha are: taken for such, all are there.
        four = _unpacked(source, png, png.header[:8] + bytes((8, _RGBA)) + png.header[10:])
        return np.dstack((four[..., 0], four[..., 2:].min(axis=2)))
    samples = _unpacked(source, png, png.header).copy()
    lower = _unpacked(source, png, png.header, rawmode="RGBA;16L")
    np.minimum(samples[..., 3], lower[..., 3], out=samples[..., 3])
    return samples


def _unpacked(source: FileSource, png: _Png, header: bytes, rawmode: str = "") -> NDArray[Any]:
    """What Pillow makes of the pixels under a header; of which bytes, ``rawmode`` can say."""
    with uninterrupted():
        from PIL import Image

    # Rebuilt bare: transparency is left to us, a palette is needed only to be there.
    parts = [MAGIC, _chunk(b"IHDR", header)]
    if png.palette:
        parts.append(_chunk(b"PLTE", png.palette))
    parts += [_chunk(b"IDAT", b"".join(png.pixels)), _chunk(b"IEND", b"")]
    try:
        with Image.open(io.BytesIO(b"".join(parts)), formats=["PNG"]) as picture:
            if rawmode:
                picture.tile = [tile._replace(args=rawmode) for tile in picture.tile]
            picture.load()
            samples = np.asarray(picture)
    except Exception as problem:
        # Pillow's decoders raise half a dozen built-in types; whatever it is, the file is at fault.
        raise source.error("IMG_CORRUPT", f"pixels cannot be decoded ({problem})") from None
    if samples.shape[:2] != (png.height, png.width):
        raise source.error("IMG_CORRUPT", f"decoded to {samples.shape}")
    return samples


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(body, zlib.crc32(kind)))


def _pixels(png: _Png, samples: NDArray[Any]) -> Pixels:
    """Samples with their palette and what is transparent."""
    notes = png.notes
    key = None
    if png.transparency is not None and png.colour != _INDEX:
        # Two bytes a sample, of which samples of fewer bits have the lower ones.
        key = np.frombuffer(png.transparency, dtype=">u2") & ((1 << png.depth) - 1)
    if png.colour == _INDEX:
        colours = np.frombuffer(png.palette, dtype=np.uint8).reshape(-1, 3)
        alpha = np.full(len(colours), 255, dtype=np.uint8)
        if png.transparency is not None:
            alpha[: len(png.transparency)] = np.frombuffer(png.transparency, dtype=np.uint8)
        return Pixels(samples, palette=colours, alpha=alpha, notes=notes)
    if png.colour == _GREY:
        maxval = 65535 if png.depth == 16 else 255
        if samples.dtype == np.bool_:
            samples = samples.astype(np.uint8) * np.uint8(255)
        # Pillow scales 1, 2 and 4 bits to 8; the transparent grey is written unscaled.
        clear = (
            None
            if key is None
            else samples == int(key[0]) * (255 // ((1 << png.depth) - 1) if png.depth < 8 else 1)
        )
        grey = samples.astype(np.uint16, copy=False) if maxval > 255 else samples
        return Pixels(grey, maxval, clear, notes=notes, scaled=png.depth < 8)
    halved = png.depth == 16
    if png.colour == _RGB:
        # Of 16-bit colours only the upper byte is left: more pixels may match, and they become unknown, not
        # free.
        clear = None if key is None else (samples == (key >> 8 if halved else key)).all(axis=2)
        return Pixels(samples[..., :3], clear=clear, halved=halved, notes=notes)
    clear = samples[..., -1] < 255
    shades = samples[..., 0] if samples.shape[2] == 2 else samples[..., :3]
    return Pixels(shades, clear=clear, halved=halved, notes=notes)


_FOREIGN = (
    (b"GIF8", "GIF"),
    (b"II*\0", "TIFF"),
    (b"MM\0*", "TIFF"),
    (b"\xff\xd8\xff", "JPEG"),
    (b"RIFF", "WebP or another RIFF file"),
    (b"\0\0\0\x0cjP", "JPEG 2000"),
    (b"P3", "a plain PPM"),
    (b"P7", "PAM"),
    (b"<svg", "SVG"),
    (b"<?xml", "XML or SVG"),
    (b"%PDF", "PDF"),
    (b"PK\x03\x04", "a zip archive"),
    (b"\x1f\x8b", "a gzip archive"),
)
_PICTURES = ("GIF", "TIFF", "JPEG", "WebP or another RIFF file", "JPEG 2000", "a plain PPM", "PAM", "SVG")


def foreign(head: bytes) -> str:
    """The name of a well-known format that is not read here; empty if it is none."""
    return next((name for magic, name in _FOREIGN if head.lstrip(b" \r\n\t").startswith(magic)), "")


def not_a_picture(source: FileSource, allowed: str) -> Exception:
    """An error about a file that is none of the pictures read here, to be raised: what it is instead."""
    head = source.data[:4096]
    if name := foreign(head):
        todo = "save it as PNG" if name in _PICTURES else ""
        if name == "JPEG":
            todo += ", or make a map of it by `lampyris maps segment`"
        return source.error("IMG_FORMAT", f"this is {name}", allowed=allowed, todo=todo)
    shown = "".join(chr(b) if 32 <= b < 127 else f"\\x{b:02x}" for b in head[:4])
    starts = f' (starts with "{shown}")' if source.quotes else ""
    pictures = "a JPEG, PNG, BMP or PGM" if allowed.startswith("JPEG") else "a PNG, BMP or PGM"
    return source.error("IMG_FORMAT", f"not {pictures}{starts}", allowed=allowed)
