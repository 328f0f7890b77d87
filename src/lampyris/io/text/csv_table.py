"""Tables of numbers in text files: rows apart by lines, fields by commas, semicolons, tabs or spaces.

What reads a table says which columns it wants; others are passed over. A byte order mark, CRLF and blank
lines are accepted. Every mistake is reported with its line.
"""

from __future__ import annotations

import csv
import io
import math
import os
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from lampyris.errors import FileError, LimitError, did_you_mean
from lampyris.io.files import read_regular

MAX_BYTES = 2**24
MAX_LINES = 200_000
"""Blank ones are counted, too."""
MAX_LINE = 2**16
"""Bytes of a line."""
GREATEST = 1e9
"""Numbers beyond are a wrong unit: 64-bit floats no longer tell the cells of a fine map apart there."""
# Python's own reader takes 1_0, and digits of other scripts.
NUMBER = re.compile(r"[-+]?(?:[0-9]++(?:\.[0-9]*+)?|\.[0-9]++)(?:[eE][-+]?[0-9]{1,4})?", re.ASCII)


@dataclass(frozen=True, slots=True)
class CsvTable:
    """A table as its file has it.

    Parameters
    ----------
    where : the file as the caller named it.
    columns : names in the order of the file; empty where the file has no header.
    rows : line number and fields of each row.
    code : of its errors.
    header : line of the header; 1 where there is none.
    """

    where: str
    columns: tuple[str, ...]
    rows: tuple[tuple[int, list[str]], ...]
    code: str
    header: int = 1

    def find(self, *names: str) -> tuple[int, ...]:
        """Where columns stand.

        Raises
        ------
        FileError : one is missing, or there twice.
        """
        for name in names:
            if (n := self.columns.count(name)) != 1:
                what = f"{'more than one' if n else 'no'} column {name}"
                todo = "" if n else did_you_mean(name, self.columns)
                allowed = f"columns {' and '.join(names)}"
                raise FileError(
                    self.code, what, where=f"{self.where}:{self.header}", allowed=allowed, todo=todo
                )
        return tuple(self.columns.index(name) for name in names)

    def number(self, line: int, row: Sequence[str], k: int, least: float = -GREATEST) -> float:
        """The number in field ``k`` of a row.

        Raises
        ------
        FileError : there is no such field, or no number from ``least`` to 1e9 in it.
        """
        text = row[k].strip() if k < len(row) else ""
        name = self.columns[k] if k < len(self.columns) else f"field {k + 1}"
        value = float(text) if NUMBER.fullmatch(text) else math.nan
        if not least <= value <= GREATEST:
            what = f"{name} is {text[:40]!r}" if text else f"{name} is missing"
            allowed = f"a number from {least:g} to {GREATEST:g}"
            comma = "," in text and NUMBER.fullmatch(text.replace(",", ".")) is not None
            todo = "write decimals with a point" if comma else ""
            raise FileError(self.code, what, where=f"{self.where}:{line}", allowed=allowed, todo=todo)
        return value


def read_table(path: str | os.PathLike[str], code: str, names: Sequence[str]) -> CsvTable:
    """Read a table of numbers with a header, or without one.

    The header is the first line that is no row of numbers. Lines that begin with ``#`` are passed over, but
    for a first one that names two of the columns looked for: so other programs write a header.

    Parameters
    ----------
    path : the file.
    code : of the errors about what is in it.
    names : columns looked for.

    Raises
    ------
    FileError : FILE_MISSING, FILE_KIND; with the given code: text that is not UTF-8 or no table.
    LimitError : FILE_TOO_LARGE, more than 16 MiB; LIMIT, more than 200,000 lines, or a line of more than 64
    KiB.
    """
    name = os.fspath(path)
    return table_of(read_regular(name, MAX_BYTES), name, code, names)


def table_of(data: bytes, name: str, code: str, names: Sequence[str]) -> CsvTable:
    """The table in a file's bytes; see :func:`read_table`."""
    columns: tuple[str, ...] = ()
    rows: list[tuple[int, list[str]]] = []
    delimiter, header = "", 1
    for line, text in lines(data, name, code):
        bare = text.strip()
        comment = bare.startswith("#")
        if not bare or (comment and (columns or rows)):
            continue
        mark = delimiter or next((m for m in ";\t," if m in bare), " ")
        fields = _fields(bare.lstrip("# "), mark, f"{name}:{line}", code)
        if comment and sum(word in names for word in fields) < 2:
            continue
        delimiter = mark
        if not columns and not rows and not all(NUMBER.fullmatch(word) for word in fields):
            columns, header = tuple(fields), line
        else:
            rows.append((line, fields))
    return CsvTable(name, columns, tuple(rows), code, header)


def _fields(text: str, delimiter: str, where: str, code: str) -> list[str]:
    if delimiter == " ":
        return text.split()
    if '"' not in text:
        return [word.strip() for word in text.split(delimiter)]
    try:
        return [word.strip() for word in next(csv.reader([text], delimiter=delimiter, strict=True))]
    except csv.Error as problem:
        raise FileError(code, f"{problem}", where=where, allowed="CSV") from None


def lines(data: bytes, name: str, code: str, max_line: int = MAX_LINE) -> Iterator[tuple[int, str]]:
    """Number and text of each line: of 16 MiB of short ones a list would need twenty times as much.

    Raises
    ------
    FileError : with the given code: not UTF-8.
    LimitError : LIMIT: more lines, or longer ones, than a table may have.
    """
    stream = io.BytesIO(data.removeprefix(b"\xef\xbb\xbf").replace(b"\r\n", b"\n").replace(b"\r", b"\n"))
    for number, raw in enumerate(stream, 1):
        where = f"{name}:{number}"
        if len(raw) > max_line:
            raise LimitError("LIMIT", f"a line of {len(raw):,} bytes", where=where, allowed=f"{max_line:,}")
        if number > MAX_LINES:
            raise LimitError("LIMIT", "more lines", where=where, allowed=f"{MAX_LINES:,}")
        try:
            yield number, raw.decode("utf-8")
        except UnicodeDecodeError as problem:
            what = f"byte 0x{raw[problem.start]:02x} is not UTF-8"
            raise FileError(code, what, where=where, todo="save it as UTF-8") from None
