"""MovingAI benchmark files: ``.map`` and ``.scen``.

N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE TCIAIG 4(2):144-148, 2012. (0, 0) is the upper
left cell. ``.`` and ``G`` are passable; ``@``, ``O`` and ``T`` (tree) are not; ``S`` (swamp) is passable
from ground; ``W`` (water) is not passable from ground and so is blocked here.
"""

from __future__ import annotations

import os
import re
from dataclasses import dataclass

from lampyris.maps.document import BLOCKED, FREE, Reading, Source, plural, read_regular
from lampyris.maps.rows import read_rows
from lampyris.typing import Cell

MEANING = {".": FREE, "G": FREE, "S": FREE, "@": BLOCKED, "O": BLOCKED, "T": BLOCKED, "W": BLOCKED}
HEADER_BYTES = 4096
MAX_SCEN_LINES = 100_000
MAX_SCEN_BYTES = 2**26


def read_map(source: Source) -> Reading:
    """Read a ``.map``.

    Raises
    ------
    FileError : MAP_TYPE, MAP_HEADER, MAP_TRUNCATED, MAP_ROW or MAP_CELL, with the line.
    LimitError : the header asks for more cells than allowed.
    """
    height, width, start = _header(source)
    source.check_size(width, height)
    codes = read_rows(source, start, 5, width, height, MEANING)
    notes = []
    for character, what in (("S", "swamp (S) read as free"), ("W", "water (W) read as blocked")):
        # Behind the header every byte is a cell or an end of line.
        if n := source.data.count(character.encode(), start):
            notes.append(f"{plural(n, 'cell')} of {what}")
    return Reading(codes, tuple(notes))


def _header(source: Source) -> tuple[int, int, int]:
    """height, width, and the offset of the first row."""
    head = source.data[:HEADER_BYTES]
    offset = 0
    sizes = []
    for number, word in enumerate(("type", "height", "width", "map"), 1):
        end = head.find(b"\n", offset)
        if end < 0:
            raise source.error(
                "MAP_HEADER", "the header ends early", f"line {number}", "type, height, width, map"
            )
        text = head[offset:end].decode("ascii", "replace").strip()
        offset = end + 1
        if word == "type" and text.split() != ["type", "octile"]:
            raise source.error("MAP_TYPE", repr(text[:40]), "line 1", "type octile")
        if word == "map" and text != "map":
            raise source.error("MAP_HEADER", repr(text[:40]), "line 4", "map")
        if word in ("height", "width"):
            sizes.append(_dimension(source, text, number, word))
    return sizes[0], sizes[1], offset


def _dimension(source: Source, text: str, line: int, word: str) -> int:
    match = re.fullmatch(rf"{word}\s+([0-9]{{1,10}})", text)
    if match is None or int(match[1]) < 1:
        raise source.error("MAP_HEADER", repr(text[:40]), f"line {line}", f"{word} and a whole number >= 1")
    return int(match[1])


@dataclass(frozen=True, slots=True)
class ScenQuery:
    """One line of a ``.scen``.

    Parameters
    ----------
    line : its number in the file, from 1.
    bucket : the benchmark's class of length.
    map : name of the map, as written.
    width, height : size of that map, as written.
    start, goal : cells (x, y).
    length : published optimal length: octile, no corner cutting.
    decimals : digits after the point it was printed with; it is right to half a unit of the last.
    """

    line: int
    bucket: int
    map: str
    width: int
    height: int
    start: Cell
    goal: Cell
    length: float
    decimals: int


_NUMBER = re.compile(r"[0-9]{1,10}")
_LENGTH = re.compile(r"[0-9]{1,15}(?:\.([0-9]{1,18}))?(?:[eE][+-]?[0-9]{1,2})?")


def read_scen(path: str | os.PathLike[str]) -> tuple[ScenQuery, ...]:
    """Read a ``.scen``.

    Any white space between fields, ``version`` 1, 1.0 or none, blank lines and CRLF are accepted.

    Raises
    ------
    FileError : SCEN_VERSION, SCEN_LINE or SCEN_RANGE, with the line.
    LimitError : more than 64 MiB. (More than 100,000 lines is a FileError SCEN_LINES.)
    """
    source = Source(read_regular(path, MAX_SCEN_BYTES), os.fspath(path))
    lines = source.data.removeprefix(b"\xef\xbb\xbf").decode("utf-8", "replace").splitlines()
    if len(lines) > MAX_SCEN_LINES:
        raise source.error("SCEN_LINES", f"{len(lines):,} lines", allowed=f"at most {MAX_SCEN_LINES:,}")
    queries = []
    first = True
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        if first and line.split()[0].lower() == "version":
            if line.split()[1:] not in (["1"], ["1.0"], ["0"]):
                raise source.error("SCEN_VERSION", repr(line[:40]), f"line {number}", "version 1 or 1.0")
        else:
            queries.append(_scen_query(source, line, number))
        first = False
    return tuple(queries)


def _scen_query(source: Source, line: str, number: int) -> ScenQuery:
    fields = line.split("\t") if line.count("\t") == 8 else line.split()
    fields = [f.strip() for f in fields]
    where = f"line {number}"
    if len(fields) != 9:
        raise source.error("SCEN_LINE", f"{len(fields)} fields", where, "9 fields")
    whole = [fields[0], *fields[2:8]]
    length = _LENGTH.fullmatch(fields[8])
    if not all(_NUMBER.fullmatch(f) for f in whole) or length is None:
        wrong = next((f for f in whole if not _NUMBER.fullmatch(f)), fields[8])
        raise source.error("SCEN_LINE", f"{wrong[:40]!r} is not a number >= 0", where)
    bucket, width, height, x0, y0, x1, y1 = (int(f) for f in whole)
    for what, v, limit in (
        ("start x", x0, width),
        ("start y", y0, height),
        ("goal x", x1, width),
        ("goal y", y1, height),
    ):
        if v >= limit:
            side = "width" if what.endswith("x") else "height"
            raise source.error(
                "SCEN_RANGE", f"{what} {v}", where, f"0 to {limit - 1}: the map's {side} is {limit}"
            )
    # At most 15 digits and a two-digit exponent: the value is finite.
    decimals = len(length[1] or "")
    return ScenQuery(number, bucket, fields[1], width, height, (x0, y0), (x1, y1), float(fields[8]), decimals)


def looks_like(head: bytes) -> bool:
    """Whether a file begins like a ``.map``, rightly or wrongly written."""
    first = head.lstrip()[:40].split(None, 1)
    return bool(first) and first[0] in (b"type", b"height", b"width", b"map")
