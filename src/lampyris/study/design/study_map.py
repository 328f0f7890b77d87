"""Ground: a map as JSON can hold it, to be sent to a worker or kept in a store, and the map of it again.

Cells are packed eight to a byte, compressed and written in base64: 5 to 37 KB for the bundled maps of
512 x 512 cells. What comes from elsewhere is not trusted: the size is read first, checked, and nothing larger
is unpacked.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from lampyris._core.limits import MAX_CELLS
from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.text.strict_yaml import shown
from lampyris.model.grid import Grid
from lampyris.typing import BoolGrid, ByteGrid

FORMAT = 1
MAX_NAME = 1000
_FIELDS = ("format", "width", "height", "resolution", "origin", "name", "blocked", "unknown", "terrain")
_LEVEL = 6


def pack(grid: Grid) -> dict[str, Any]:
    """A map as plain data; :func:`unpack` gives the same map again, to the last bit."""
    return {
        "format": FORMAT,
        "width": grid.width,
        "height": grid.height,
        "resolution": grid.resolution,
        "origin": list(grid.origin),
        "name": grid.name[:MAX_NAME],
        "blocked": _packed(np.packbits(grid.blocked).tobytes()),
        "unknown": None if grid.unknown is None else _packed(np.packbits(grid.unknown).tobytes()),
        "terrain": None if grid.terrain is None else _packed(grid.terrain.tobytes()),
    }


def unpack(packed: Mapping[str, Any], expected: str | None = None, *, max_cells: int = MAX_CELLS) -> Grid:
    """The map of what :func:`pack` made.

    Parameters
    ----------
    packed : plain data, from anywhere.
    expected : hash that its cells must have (:func:`lampyris.io.maps.map_hash.map_hash`); None: any.
    max_cells : larger maps are refused before anything is made for them.

    Raises
    ------
    FileError : PACKED_MAP: not such data; PACKED_HASH: other cells than expected.
    LimitError : MAP_TOO_LARGE.
    SettingError : a resolution or an origin out of its range.
    """
    _check_fields(packed)
    width, height = _side(packed, "width"), _side(packed, "height")
    if width * height > max_cells:
        what = f"{width} x {height} is {width * height:,} cells"
        raise LimitError("MAP_TOO_LARGE", what, where="packed map", allowed=f"at most {max_cells:,} cells")
    origin = packed["origin"]
    if not (isinstance(origin, list | tuple) and len(origin) == 3 and all(map(_is_number, origin))):
        raise _wrong("origin", origin, "three numbers")
    name = packed["name"]
    if not (isinstance(name, str) and len(name) <= MAX_NAME):
        raise _wrong("name", name, f"text of at most {MAX_NAME:,} characters")
    if not _is_number(packed["resolution"]):
        raise _wrong("resolution", packed["resolution"], "a number")
    terrain = packed["terrain"]
    grid = Grid(
        _bits(packed, "blocked", width, height),
        None if packed["unknown"] is None else _bits(packed, "unknown", width, height),
        packed["resolution"],
        (origin[0], origin[1], origin[2]),
        name,
        None if terrain is None else _bytes_of(packed, "terrain", width, height),
    )
    if expected is not None and (given := map_hash(grid)) != expected:
        raise FileError(
            "PACKED_HASH", f"the map's hash is {given}", where="packed map", allowed=str(expected)[:64]
        )
    return grid


def _check_fields(packed: object) -> None:
    if not isinstance(packed, Mapping) or set(packed) != set(_FIELDS):
        found = ", ".join(map(str, list(packed)[:20])) if isinstance(packed, Mapping) else shown(packed)
        raise FileError("PACKED_MAP", f"fields {found}", where="packed map", allowed=", ".join(_FIELDS))
    if packed["format"] != FORMAT or isinstance(packed["format"], bool):
        raise _wrong("format", packed["format"], f"{FORMAT}")


def _side(packed: Mapping[str, Any], key: str) -> int:
    value = packed[key]
    if not isinstance(value, int) or isinstance(value, bool) or value < 1:
        raise _wrong(key, value, "a whole number >= 1")
    return value


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _wrong(key: str, value: object, allowed: str) -> LampyrisError:
    return FileError("PACKED_MAP", shown(value), where=f"packed map: {key}", allowed=allowed)


def _packed(raw: bytes) -> str:
    return base64.b64encode(zlib.compress(raw, _LEVEL)).decode("ascii")


def _bits(packed: Mapping[str, Any], key: str, width: int, height: int) -> BoolGrid:
    cells = width * height
    raw = np.frombuffer(_raw(packed, key, (cells + 7) // 8), dtype=np.uint8)
    grid: BoolGrid = np.unpackbits(raw, count=cells).astype(np.bool_).reshape(height, width)
    return grid


def _bytes_of(packed: Mapping[str, Any], key: str, width: int, height: int) -> ByteGrid:
    return np.frombuffer(_raw(packed, key, width * height), dtype=np.uint8).reshape(height, width)


def _raw(packed: Mapping[str, Any], key: str, size: int) -> bytes:
    """Exactly ``size`` bytes, and never memory for more, however much they claim to unfold to."""
    text = packed[key]
    # What cannot be compressed grows a little: 5 bytes for every 16 KB, and a head.
    most = 4 * ((size + size // 1000 + 64) // 3 + 1)
    if not isinstance(text, str) or len(text) > most:
        what = f"{len(text):,} characters" if isinstance(text, str) else shown(text)
        raise FileError("PACKED_MAP", what, where=f"packed map: {key}", allowed=f"at most {most:,} of base64")
    try:
        unfold = zlib.decompressobj()
        raw = unfold.decompress(base64.b64decode(text, validate=True), size + 1)
    except (binascii.Error, ValueError, zlib.error):
        raise _wrong(key, text, "compressed cells in base64") from None
    if len(raw) != size or not unfold.eof or unfold.unused_data:
        what = f"{len(raw):,} bytes" + ("" if unfold.eof else " and more, or cut short")
        raise FileError("PACKED_MAP", what, where=f"packed map: {key}", allowed=f"{size:,} bytes")
    return raw
