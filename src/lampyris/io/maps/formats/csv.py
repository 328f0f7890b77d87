"""CSV maps: rows of whole numbers, one a cell, apart by commas, semicolons or tabs.

0 free, 1 blocked, -1 unknown, as in a NumPy map. A first line ``# lampyris costmap`` makes the numbers
costmap values whatever was asked for, so that such a file cannot be read as another map; -1 is unknown there
too. CRLF, a byte order mark, blanks beside numbers and blank lines at the end are accepted; where tabs are
what separates, they are no blanks. A header, a comment or a number in quotation marks is not accepted: a map
that begins a row lower would shift without a word.

The file is read in pieces of whole rows, each in a few passes of NumPy over its bytes; a piece that is not
well is read again cell by cell, to say where. ``csv.reader`` needs 0.25 to 1 s for 2048 x 2048 cells before
one of them is a number; this 0.13 to 0.17 s in all.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lampyris.io.maps.formats.costmap import ALLOWED, NO_INFORMATION, read_costs
from lampyris.io.maps.formats.document import BLOCKED, FREE, UNKNOWN, FileSource, Reading

MARKER = "# lampyris costmap"
SUFFIXES = (".csv",)
_BOM = b"\xef\xbb\xbf"
_PIECE = 2**20
"""Bytes of a piece; the rest of its last row is added."""
_DIGITS = 4
"""Characters of the longest number that can be right: ``-1`` and ``254``, and one zero too many."""
_HEADER = 64
"""Cells of a first row that are looked at to tell a header from a map."""
# Possessive, as all patterns for untrusted text: a cell of 20,000 digits and a letter took 8 s.
_FLOAT = re.compile(rb"[-+]?(?:[0-9]++(?:\.[0-9]*+)?|\.[0-9]++)(?:[eE][-+]?[0-9]++)?")
_OCCUPANCY = "0 free, 1 blocked, -1 unknown"


@dataclass(frozen=True, slots=True)
class _Shape:
    """Where the rows are and what they must be like."""

    start: int
    """Offset of the first row."""
    stop: int
    """Offset of the end of the last."""
    line: int
    """Its line number."""
    width: int
    height: int
    separator: int
    costmap: bool


def looks_like(head: bytes) -> bool:
    """Whether a file begins with the line that marks costmap values."""
    return _is_marker(head.removeprefix(_BOM).split(b"\n", 1)[0])


def read_csv(source: FileSource) -> Reading:
    """Read a CSV map.

    Raises
    ------
    FileError : CSV_CELL, CSV_ROW or CSV_TRUNCATED with the line, and the column counted in cells;
        CSV_EMPTY, CSV_TEXT (no text of one byte a character).
    LimitError : more cells than allowed, counted from the ends of line and the first row.
    """
    shape = _shape(source)
    values = np.empty((shape.height, shape.width), dtype=np.int16)
    done = 0
    for piece in _pieces(source.data, shape.start, shape.stop):
        rows = _rows(piece, shape)
        if rows is None:
            raise _wrong(source, piece, shape, shape.line + done)
        values[done : done + len(rows)] = rows
        done += len(rows)
    if shape.costmap:
        return read_costs(values.astype(np.uint8))  # -1 is 255 as a byte
    codes = np.where(values == 0, np.uint8(FREE), np.uint8(BLOCKED))
    codes[values == -1] = UNKNOWN
    return Reading(codes)


def csv_text(values: NDArray[np.int16]) -> bytes:
    """Rows of numbers -1 to 255, (height, width), as text."""
    table = np.zeros((257, _DIGITS), dtype=np.uint8)
    for value in range(-1, NO_INFORMATION + 1):
        table[value, :-1] = np.frombuffer(f"{value}".encode().ljust(_DIGITS - 1, b"\0"), dtype=np.uint8)
    table[:, -1] = ord(",")
    cells = table[values]
    cells[:, -1, -1] = ord("\n")
    return cells.tobytes().translate(None, b"\0")


def _shape(source: FileSource) -> _Shape:
    """Rows and columns, counted and not yet read."""
    data = source.data
    if data.startswith((b"\xff\xfe", b"\xfe\xff")) or b"\0" in data[:4096]:
        raise source.error("CSV_TEXT", "this is UTF-16 or no text", todo="save it as plain or UTF-8 text")
    start = len(_BOM) if data.startswith(_BOM) else 0
    line, costmap = 1, source.values == "costmap"
    first = _line(data, start)
    if _is_marker(first):
        costmap = True
        start, line = start + len(first) + 1, 2
        first = _line(data, start)
    if not first.strip():
        raise source.error(
            "CSV_EMPTY", "no row of numbers", f"line {line}", ALLOWED if costmap else _OCCUPANCY
        )
    # A tab at an end of the line separates too: there is an empty cell beside it.
    separators = [c for c in b",;\t" if c in first]
    separator = separators[0] if separators else ord(",")
    width = first.strip(b" \r").count(separator) + 1
    # Rows are counted by ends of line up to the last that is not blank; nothing is cut up for it. Where tabs
    # separate, a row of them is a row of empty cells.
    stop = len(data.rstrip(b" \r\n" if separator == ord("\t") else b" \t\r\n"))
    height = data.count(b"\n", start, stop) + 1
    source.check_size(width, height)
    # What follows the last cell is not read with the rows; a CR alone may have been the end of a row there.
    if b"\r" in _line(data, stop).removesuffix(b"\r"):
        raise _ends(source, line + height - 1)
    return _Shape(start, stop, line, width, height, separator, costmap)


def _line(data: bytes, start: int) -> bytes:
    end = data.find(b"\n", start)
    return data[start : end if end >= 0 else len(data)]


def _is_marker(line: bytes) -> bool:
    # A spreadsheet that saves the file again fills the line up with separators.
    return b"".join(line.strip(b" \t\r,;").split()).lower() == MARKER.replace(" ", "").encode()


def _pieces(data: bytes, start: int, stop: int) -> Iterator[bytes]:
    """The rows, so many bytes at a time; each piece ends with a newline."""
    while start < stop:
        end = data.find(b"\n", min(start + _PIECE, stop), stop)
        end = stop if end < 0 else end
        yield data[start:end] + b"\n"
        start = end + 1


def _rows(piece: bytes, shape: _Shape) -> NDArray[np.int16] | None:
    """The numbers of some rows, int16 (rows, width), or None where anything is wrong with them."""
    if b"\r" in piece:
        piece = piece.replace(b"\r\n", b"\n")
    # First what costs least: a row may have a hundred million cells too many.
    if piece.count(shape.separator) != piece.count(b"\n") * (shape.width - 1):
        return None
    blanks = b" " if shape.separator == ord("\t") else b" \t"
    if any(blank in piece for blank in (b" ", b"\t")) and (stripped := _without(piece, blanks)) is not None:
        piece = stripped
    flat = np.frombuffer(piece, dtype=np.uint8)
    newline = flat == ord("\n")
    ends = np.flatnonzero(newline | (flat == shape.separator))
    rows = int(np.count_nonzero(newline))
    if ends.size != rows * shape.width or not newline[ends[shape.width - 1 :: shape.width]].all():
        return None
    begins = np.empty_like(ends)
    begins[0], begins[1:] = 0, ends[:-1] + 1
    minus = flat[begins] == ord("-")
    digits = ends - begins - minus
    if int(digits.min()) < 1 or int(digits.max()) > _DIGITS:
        return None
    value = np.zeros(ends.size, dtype=np.int16)
    for k in range(int(digits.max())):
        # Beyond a number's first digit stands a zero; the offset may be negative there, and means nothing.
        digit = flat[ends - 1 - k] - np.uint8(ord("0"))
        digit[digits <= k] = 0
        if int(digit.max()) > 9:
            return None
        value += digit * np.int16(10**k)
    if minus.any():
        value[minus] *= -1
    low, high = -1, NO_INFORMATION if shape.costmap else 1
    if int(value.min()) < low or int(value.max()) > high:
        return None
    return value.reshape(rows, shape.width)


def _without(piece: bytes, blanks: bytes) -> bytes | None:
    """Blanks taken away, or None where one stands inside a number and would make two of it one."""
    flat = np.frombuffer(piece, dtype=np.uint8)
    keeps = np.ones(256, dtype=np.bool_)
    keeps[list(blanks)] = False
    kept = np.flatnonzero(keeps[flat])
    apart = np.diff(kept) > 1
    numeral = (flat[kept] >= ord("-")) & (flat[kept] <= ord("9"))
    if (apart & numeral[:-1] & numeral[1:]).any():
        return None
    return piece.translate(None, blanks)


def _wrong(source: FileSource, piece: bytes, shape: _Shape, line: int) -> Exception:
    """What is wrong with some rows, the first mistake first."""
    allowed = ALLOWED + ", -1 unknown too" if shape.costmap else _OCCUPANCY
    high = NO_INFORMATION if shape.costmap else 1
    separator = bytes((shape.separator,))
    for number, row in enumerate(piece.split(b"\n")[:-1], line):
        lone = b"\r" in row.removesuffix(b"\r")
        row = row.rstrip(b"\r")
        blanks = b" " if separator == b"\t" else b" \t"
        cells = row.split(separator, shape.width) if row.strip(blanks) else []
        for column, cell in enumerate(cells[: shape.width], 1):
            word = cell.strip(b" \t")
            digits = word.removeprefix(b"-")
            if 1 <= len(digits) <= _DIGITS and digits.isdigit() and -1 <= int(word) <= high:
                continue
            at = f"line {number} column {column}"
            shown = repr(word[:20].decode("utf-8", "replace")) if word else "an empty cell"
            return source.error(
                "CSV_CELL", shown, at, allowed, _advice(word, row, shape, number == shape.line)
            )
        if len(cells) < shape.width:
            what = f"row {number - shape.line + 1} has {len(cells)} of {shape.width} cells"
            return source.error(
                "CSV_TRUNCATED", what, f"line {number}", f"{shape.width} cells, as in the first row"
            )
        if len(cells) > shape.width:
            what, allowed = f"{row.count(separator) + 1} cells", f"{shape.width}, as in the first row"
            return source.error("CSV_ROW", what, f"line {number}", allowed)
        if lone:
            return _ends(source, number)
    return _ends(source, line)


def _ends(source: FileSource, line: int) -> Exception:
    what = "rows that cannot be distinguished"
    return source.error("CSV_ROW", what, f"line {line}", "ends of line: LF or CRLF")


def _advice(word: bytes, row: bytes, shape: _Shape, first: bool) -> str:
    """What may have been meant."""
    if _FLOAT.fullmatch(word) and not word.lstrip(b"+-").isdigit():
        return "whole numbers have no point and no exponent; numpy.savetxt writes them with fmt='%d'"
    if first:
        # A header is known by its beginning; the row may have fifteen million cells, and those took 2 s.
        cells = row.split(bytes((shape.separator,)), _HEADER)[:_HEADER]
        names = {cell.strip(b" \t\"'").lower() for cell in cells}
        if {b"x", b"y"} <= names:
            return "a header of columns x and y is that of a recorded track, not of a map"
        if not any(cell.isdigit() for cell in names):
            return "a CSV map has numbers only, no header and no comment"
    if not shape.costmap and word.isdigit() and len(word) <= 3 and int(word) <= NO_INFORMATION:
        return f'costmap values are read with values="costmap", or after a first line {MARKER!r}'
    if word[:1] in (b'"', b"'"):
        return "numbers stand without quotation marks"
    return ""
