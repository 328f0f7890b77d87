"""Files made by hand for the map tests: every byte is put there, no library writes them."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterable, Sequence
from pathlib import Path

from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map

SIGNATURE = b"\x89PNG\r\n\x1a\n"


def chunk(kind: bytes, body: bytes = b"") -> bytes:
    """One PNG chunk with its checksum."""
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


def png(
    width: int,
    height: int,
    depth: int,
    colour: int,
    raw: bytes,
    *,
    before: bytes = b"",
    interlace: int = 0,
    end: bool = True,
) -> bytes:
    """A PNG of the given filtered rows; ``before`` goes between header and pixels."""
    head = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, interlace)
    body = SIGNATURE + chunk(b"IHDR", head) + before + chunk(b"IDAT", zlib.compress(raw))
    return body + (chunk(b"IEND") if end else b"")


def rows(*lines: Iterable[int]) -> bytes:
    """Unfiltered rows of 8-bit samples."""
    return b"".join(b"\0" + bytes(line) for line in lines)


def bmp(
    width: int,
    height: int,
    bits: int,
    raster: bytes,
    *,
    palette: bytes = b"",
    packing: int = 0,
    used: int = 0,
    masks: bytes = b"",
    header: int = 40,
) -> bytes:
    """A BMP with a 40-byte header (or a longer one whose rest is ``masks``)."""
    info = struct.pack("<IiiHHIIiiII", header, width, height, 1, bits, packing, len(raster), 0, 0, used, 0)
    start = 14 + len(info) + len(masks) + len(palette)
    return b"BM" + struct.pack("<IHHI", start + len(raster), 0, 0, start) + info + masks + palette + raster


def npy(header: str, body: bytes, version: int = 1) -> bytes:
    """An ``.npy`` with this header text."""
    text = header.encode("latin-1") + b"\n"
    size = struct.pack("<H" if version == 1 else "<I", len(text))
    return b"\x93NUMPY" + bytes((version, 0)) + size + text + body


def put(folder: Path, data: bytes, name: str = "m") -> Path:
    """Write a file."""
    path = folder / name
    path.write_bytes(data)
    return path


def load_bytes(folder: Path, data: bytes, name: str = "m") -> MapDocument:
    """Load these bytes as a file."""
    return load_map(put(folder, data, name))


def cells(document: MapDocument) -> list[str]:
    """A map as rows of ``#`` blocked, ``?`` unknown, ``.`` free."""
    grid = document.grid
    unknown = grid.blocked & False if grid.unknown is None else grid.unknown
    return [
        "".join("?" if u else "#" if b else "." for b, u in zip(brow, urow, strict=True))
        for brow, urow in zip(grid.blocked.tolist(), unknown.tolist(), strict=True)
    ]


def adam7(samples: Sequence[Sequence[int]]) -> bytes:
    """Unfiltered interlaced 8-bit grey rows."""
    height, width = len(samples), len(samples[0])
    out = b""
    for x0, y0, dx, dy in (
        (0, 0, 8, 8),
        (4, 0, 8, 8),
        (0, 4, 4, 8),
        (2, 0, 4, 4),
        (0, 2, 2, 4),
        (1, 0, 2, 2),
        (0, 1, 1, 2),
    ):
        for y in range(y0, height, dy):
            line = [samples[y][x] for x in range(x0, width, dx)]
            if line:
                out += b"\0" + bytes(line)
    return out
