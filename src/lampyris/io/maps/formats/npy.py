"""NumPy ``.npy`` maps: a two-dimensional array, True or 1 blocked, False or 0 free, -1 unknown.

The header is read here, within limits and without pickle: ``numpy.load`` would warn about some old headers,
run a pickle if asked, and allocate what the header says before it looks at the size of the file. Values
such as 255 are refused: black = 0 is a wall in a picture and free space in an array, and no guess is safe.
Asked for, whole numbers are costmap values, and -1 is unknown there too.
"""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

from lampyris.io.maps.formats.costmap import ALLOWED, NO_INFORMATION, read_costs
from lampyris.io.maps.formats.document import BLOCKED, FREE, UNKNOWN, FileSource, Format, Reading, first_bad
from lampyris.typing import BoolGrid, ByteGrid, FloatGrid

MAGIC = b"\x93NUMPY"
HEADER_BYTES = 4096
_TYPE = re.compile(r"[|<>=]?(?:b1|[iu][1248])")
_REAL = re.compile(r"[<>=]?f[248]")
_GAP = r"[ \t]*+"  # \s would take a vertical tab or a no-break space too, which Python does not
_SHAPE = re.compile(rf"{_GAP}([0-9]{{1,10}})L?{_GAP},{_GAP}([0-9]{{1,10}})L?{_GAP},?{_GAP}")
_DESCR = re.compile(rf"'descr'{_GAP}:{_GAP}'([^']*)'")
# Patterns, not ast.literal_eval: that prints a SyntaxWarning for some inputs, and nothing here needs a
# parser.
_ENTRIES = (
    re.compile(rf"'fortran_order'{_GAP}:{_GAP}(True|False)\b"),
    re.compile(rf"'shape'{_GAP}:{_GAP}\(([^()]*)\)"),
)


@dataclass(frozen=True, slots=True)
class _Header:
    kind: str
    fortran: bool
    shape: str
    offset: int


def read_npy(source: FileSource) -> Reading:
    """Read a ``.npy``.

    Raises
    ------
    FileError : NPY_HEADER, NPY_TYPE, NPY_SHAPE, NPY_TRUNCATED, NPY_TRAILING or NPY_VALUE.
    LimitError : the header asks for more cells than allowed.
    """
    header = _header(source)
    if not _TYPE.fullmatch(header.kind):
        real = header.kind.lstrip("<>=|").startswith("f")
        todo = "save it as .astype(bool), or costmap values as .astype('uint8')" if real else ""
        what = f"element type {header.kind[:40]!r}"
        raise source.error("NPY_TYPE", what, allowed="bool, or whole numbers", todo=todo)
    cells = _cells(header, source)
    return read_costs(_costs(cells, source)) if source.values == "costmap" else Reading(_codes(cells, source))


def read_floats(source: FileSource) -> FloatGrid:
    """Read a ``.npy`` of real numbers, (height, width).

    Raises
    ------
    FileError, LimitError : as :func:`read_npy`.
    """
    header = _header(source)
    if not _REAL.fullmatch(header.kind):
        what = f"element type {header.kind[:40]!r}"
        raise source.error("NPY_TYPE", what, allowed="real numbers", todo="save it as .astype('float64')")
    # A signalling NaN of another width would warn; it is still none of the numbers asked for.
    with np.errstate(invalid="ignore"):
        return _cells(header, source).astype(np.float64, order="C")


def _cells(header: _Header, source: FileSource) -> np.ndarray[Any, Any]:
    """The array itself, (height, width)."""
    two = _SHAPE.fullmatch(header.shape)
    if two is None or int(two[1]) == 0 or int(two[2]) == 0:
        raise source.error("NPY_SHAPE", f"shape ({header.shape[:60]})", allowed="(height, width), not empty")
    height, width = int(two[1]), int(two[2])
    source.check_size(width, height)
    dtype = np.dtype(header.kind)
    size, there = height * width * dtype.itemsize, len(source.data) - header.offset
    if there != size:
        code = "NPY_TRUNCATED" if there < size else "NPY_TRAILING"
        raise source.error(
            code, f"{there} bytes of cells", allowed=f"{size}, for {height} x {width} of {dtype}"
        )
    flat = np.frombuffer(source.data, dtype=dtype, offset=header.offset)
    return flat.reshape((width, height)).T if header.fortran else flat.reshape((height, width))


def _codes(cells: np.ndarray[Any, Any], source: FileSource) -> np.ndarray[Any, np.dtype[np.uint8]]:
    if cells.dtype.kind == "b":
        # A stored bool may be any byte; what is not 0 is True, as NumPy itself has it.
        return _taken(cells.view(np.uint8) != 0)
    taken = cells != 0
    codes = _taken(taken)
    wrong = taken & (cells != 1)
    if cells.dtype.kind == "i":
        codes[cells == -1] = UNKNOWN
        wrong &= cells != -1
    if wrong.any():
        x, y = first_bad(wrong)
        raise source.error(
            "NPY_VALUE",
            str(cells[y, x]),
            f"cell ({x},{y})",
            "0 free, 1 blocked, -1 unknown",
            'save `blocked` as a bool array, or read costmap values with values="costmap"',
        )
    return codes


def _taken(taken: BoolGrid) -> np.ndarray[Any, np.dtype[np.uint8]]:
    """Codes of cells that are blocked or free: the truth values themselves, row by row."""
    assert (FREE, BLOCKED) == (False, True)
    return np.array(taken, order="C").view(np.uint8)


def _costs(cells: np.ndarray[Any, Any], source: FileSource) -> ByteGrid:
    if cells.dtype.kind == "b":
        raise source.error("NPY_TYPE", "bool has no costmap values", allowed="whole numbers")
    wrong = (cells < -1) | (cells > NO_INFORMATION)
    if wrong.any():
        x, y = first_bad(wrong)
        raise source.error("NPY_VALUE", str(cells[y, x]), f"cell ({x},{y})", f"{ALLOWED}, -1 unknown too")
    return cells.astype(np.uint8, order="C")  # -1 is 255 as a byte


def _header(source: FileSource) -> _Header:
    """The header's three entries, not yet interpreted, and the offset of the first cell."""
    data = source.data
    try:
        major = data[6]
        length, offset = (
            (struct.unpack_from("<H", data, 8)[0], 10)
            if major == 1
            else (struct.unpack_from("<I", data, 8)[0], 12)
        )
    except (IndexError, struct.error):
        raise source.error("NPY_HEADER", "the header ends early") from None
    if major not in (1, 2, 3):
        raise source.error("NPY_HEADER", f"version {major}", allowed="1, 2 or 3")
    if length > HEADER_BYTES:
        raise source.error("NPY_HEADER", f"{length} bytes of header", allowed=f"at most {HEADER_BYTES}")
    if offset + length > len(data):
        raise source.error("NPY_HEADER", "the header ends early")
    text = data[offset : offset + length].decode("latin-1")
    found = [entry.search(text) for entry in _ENTRIES]
    if not all(found):
        wrong = next(name for name, m in zip(("fortran_order", "shape"), found, strict=True) if m is None)
        raise source.error("NPY_HEADER", f"{wrong} is missing or malformed")
    order, shape = (m[1] for m in found if m is not None)
    kind = _DESCR.search(text)
    return _Header(kind[1] if kind else text, order == "True", shape, offset + length)


NUMPY = Format("numpy", (".npy",), lambda head: head.startswith(MAGIC), read_npy)
"""Its row in the table of formats; see :mod:`.table` for the others."""
