"""How large a map's file says it is, and whether it has as many cells: read here anew, for good files only.

A file that a reader took has to pass here as well: that is how it is seen that a reader stopped refusing.
Nothing is shared with the readers, and nothing is decoded that the size does not need.
"""

from __future__ import annotations

import math
import re
import struct
import zlib
from collections.abc import Callable, Mapping
from itertools import groupby

import numpy as np

_BOM = b"\xef\xbb\xbf"
_GAP = rb"(?:\s|#[^\n\r]*[\n\r])"
_PASSES = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
_MOST = 2**26
"""Bytes that are unpacked of a picture."""


class Uneven(ValueError):
    """A file that is not as large as it says, or not even."""


def size(data: bytes, form: str) -> tuple[int, int]:
    """Width and height of a map's file.

    Parameters
    ----------
    data : the file; of a ROS map its picture.
    form : what the reader took it for, as ``MapDocument.format`` has it.

    Raises
    ------
    Uneven : it has not the cells that it says, or its rows are not all of one length.
    """
    if form == "ros":
        form = "png" if data[:1] == b"\x89" else "bmp" if data[:2] == b"BM" else "pgm"
    try:
        width, height = _FORMS[form](data)
    except Uneven:
        raise
    except (IndexError, KeyError, ValueError, struct.error, zlib.error) as problem:
        raise Uneven(f"no {form}: {problem!r}") from None
    _demand(width >= 1 and height >= 1, f"{width} x {height}")
    return width, height


def _demand(holds: object, what: str) -> None:
    if not holds:
        raise Uneven(what)


def _png(data: bytes) -> tuple[int, int]:
    width, height, depth, colour, _, _, interlaced = struct.unpack_from(">IIBBBBB", data, 16)
    packed, at, kind = [], 8, b""
    while kind != b"IEND":
        length, kind = struct.unpack_from(">I4s", data, at)
        packed += [data[at + 8 : at + 8 + length]] * (kind == b"IDAT")
        at += 12 + length
    bits = depth * {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}[colour]
    need = 0
    for x, y, dx, dy in _PASSES if interlaced else ((0, 0, 1, 1),):
        across, down = len(range(x, width, dx)), len(range(y, height, dy))
        need += down * (1 + (across * bits + 7) // 8) if across else 0
    there = len(zlib.decompressobj().decompress(b"".join(packed), _MOST))
    _demand(there >= need, f"{there} of {need} bytes of pixels")
    return width, height


def _bmp(data: bytes) -> tuple[int, int]:
    raster, header = struct.unpack_from("<II", data, 10)
    if header == 12:
        width, height, _, bits = struct.unpack_from("<HHHH", data, 18)
        packing = 0
    else:
        width, height, _, bits, packing = struct.unpack_from("<iiHHI", data, 18)
    if packing in (1, 2):
        _runs(data[raster:], width, height, half=packing == 2)
    else:
        need = (width * bits + 31) // 32 * 4 * abs(height)
        _demand(len(data) - raster >= need, f"{len(data) - raster} of {need} bytes of pixels")
    return width, abs(height)


def _runs(data: bytes, width: int, height: int, *, half: bool) -> None:
    """Run lengths: each within its row, to the mark of the end."""
    at, x, y = 0, 0, 0
    while data[at : at + 2] != b"\0\1":
        count, value = data[at], data[at + 1]
        at += 2
        if count or value > 2:
            _demand(x + (count or value) <= width and y < height, "a run beyond its row")
            x += count or value
        elif value == 0:
            x, y = 0, y + 1
        else:
            x, y, at = x + data[at], y + data[at + 1], at + 2
        if not count and value > 2:
            at += (((value + 1) // 2 if half else value) + 1) // 2 * 2
    _demand(len(data) >= at + 2, "no end of the run lengths")


def _pnm(data: bytes) -> tuple[int, int]:
    kind = data[1] - ord("0")
    head = re.match(rb"P." + (_GAP + rb"+([0-9]+)") * (2 if kind in (1, 4) else 3), data)
    _demand(head, "no header")
    assert head is not None
    width, height, most = (*map(int, head.groups()), 1)[:3]
    rest = data[head.end() :]
    if kind in (1, 2):
        rest = re.sub(rb"#[^\n\r]*", b"", rest)
        there = len(re.findall(rb"[01]" if kind == 1 else rb"[0-9]+", rest))
        need = width * height
    else:
        there = len(rest) - 1
        row = (width + 7) // 8 if kind == 4 else width * (3 if kind == 6 else 1) * (2 if most > 255 else 1)
        need = row * height
    _demand(there >= need, f"{there} of {need} samples")
    return width, height


def _npy(data: bytes) -> tuple[int, int]:
    version = data[6]
    _demand(version in (1, 2, 3), f"version {version}")
    start, form = (10, "<H") if version == 1 else (12, "<I")
    (length,) = struct.unpack_from(form, data, 8)
    text = data[start : start + length].decode("latin-1")
    told = re.search(r"shape'[ \t:]*\(([0-9L, \t]*)\)", text)
    kind = re.search(r"'descr'[ \t:]*'([^']*)'", text)
    _demand(told and kind, text)
    assert told is not None
    assert kind is not None
    shape = [int(number) for number in re.findall("[0-9]+", told[1])]
    _demand(len(shape) == 2, text)
    need, there = math.prod(shape) * np.dtype(kind[1]).itemsize, len(data) - start - length
    _demand(need == there, f"{there} of {need} bytes of cells")
    return shape[1], shape[0]


def _rows(data: bytes) -> list[bytes]:
    """Lines without their ends; blank ones at the end of the file left out."""
    lines = data.removeprefix(_BOM).replace(b"\r\n", b"\n").split(b"\n")
    while lines and not lines[-1].strip():
        lines.pop()
    return lines


def _even(lengths: list[int]) -> tuple[int, int]:
    _demand(len(list(groupby(lengths))) == 1, f"rows of {lengths[:20]}")
    return lengths[0], len(lengths)


def _text(data: bytes) -> tuple[int, int]:
    return _even([len(row) for row in _rows(data)])


def _csv(data: bytes) -> tuple[int, int]:
    rows = _rows(data)
    if rows[0].lstrip().startswith(b"#"):
        rows = rows[1:]
    mark = next((m for m in (b",", b";", b"\t") if m in rows[0].strip()), b",")
    return _even([row.strip(b" \r" if mark == b"\t" else b" \t\r").count(mark) + 1 for row in rows])


def _movingai(data: bytes) -> tuple[int, int]:
    lines = _rows(data)
    height, width = (int(line.split()[1]) for line in lines[1:3])
    found = _even([len(row) for row in lines[4:]])
    _demand(found == (width, height), f"{width} x {height} said, {found} there")
    return width, height


_FORMS: Mapping[str, Callable[[bytes], tuple[int, int]]] = {
    "png": _png,
    "bmp": _bmp,
    "pgm": _pnm,
    "numpy": _npy,
    "csv": _csv,
    "text": _text,
    "movingai": _movingai,
}
