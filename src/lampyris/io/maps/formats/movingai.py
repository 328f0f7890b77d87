"""MovingAI benchmark files: ``.map`` and ``.scen``.

N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE TCIAIG 4(2):144-148, 2012. (0, 0) is the upper
left cell. ``.`` and ``G`` are passable; ``@`` and ``O`` (out of bounds) and ``T`` (trees) are not; ``S``
(swamp) is passable from ground; ``W`` (water) is traversable, but not from ground. In maps of the League of Robot Runners ``E``
(emitter) and ``S`` (service point) are free.

A map is read for a robot on the ground: swamp is free, water is blocked. What each cell is made of stays in
``MapDocument.surface``, so that a map that is written again keeps its letters, and so that a query which
begins in water can be asked in the water alone (:func:`grid_for`).
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import PurePosixPath

import numpy as np

from lampyris.errors import FileError, LimitError, SceneError, SettingError, plural
from lampyris.io.files import read_regular, write_file
from lampyris.io.maps.formats.character_rows import read_rows
from lampyris.io.maps.formats.costmap import no_numbers
from lampyris.io.maps.formats.document import (
    BAD,
    BLOCKED,
    FREE,
    CodeGrid,
    FileSource,
    MapDocument,
    MapQuery,
    Reading,
    look_up,
)
from lampyris.model.grid import Grid
from lampyris.typing import Cell

MEANING = {".": FREE, "G": FREE, "S": FREE, "E": FREE, "@": BLOCKED, "O": BLOCKED, "T": BLOCKED, "W": BLOCKED}
PLAIN, SWAMP, WATER, TREES, OUT, GROUND, EMITTER = range(7)
"""What ``MapDocument.surface`` holds. Plain is ``.`` where a cell is free and ``@`` where it is blocked."""
SURFACES = {".": PLAIN, "G": GROUND, "S": SWAMP, "E": EMITTER, "@": PLAIN, "O": OUT, "T": TREES, "W": WATER}
_LETTERS = tuple(MEANING)
_CODES, _SURFACES = (
    np.array([table.get(c, BAD) for c in _LETTERS] + [BAD] * (256 - len(_LETTERS)), dtype=np.uint8)
    for table in (MEANING, SURFACES)
)
HEADER_BYTES = 4096
_BOM = b"\xef\xbb\xbf"
MAX_SCEN_LINES = 100_000
MAX_SCEN_BYTES = 2**24


def read_map(source: FileSource) -> Reading:
    """Read a ``.map``.

    Raises
    ------
    FileError : MAP_TYPE, MAP_HEADER, MAP_TRUNCATED, MAP_ROW or MAP_CELL, with the line.
    LimitError : the header asks for more cells than allowed.
    SettingError : VALUES, costmap values asked for.
    """
    no_numbers(source, "a MovingAI map")
    height, width, start = _header(source)
    source.check_size(width, height)
    letters = read_rows(source, start, 5, width, height, {c: k for k, c in enumerate(_LETTERS)})
    surface = look_up(_SURFACES, letters)
    notes = []
    for character, what in (("S", "swamp (S) read as free"), ("W", "water (W) read as blocked")):
        # Behind the header every byte is a cell or an end of line.
        if n := source.data.count(character.encode(), start):
            notes.append(f"{plural(n, 'cell')} of {what}")
    return Reading(look_up(_CODES, letters), tuple(notes), surface=surface if surface.any() else None)


def letters_of(codes: CodeGrid, surface: CodeGrid | None) -> CodeGrid:
    """The characters to write, as bytes, uint8 (height, width).

    ``codes`` (FREE, BLOCKED or UNKNOWN) decide what is passable; the surface says which of its letters a cell
    has, where it agrees.
    """
    letters = np.where(codes == FREE, np.uint8(ord(".")), np.uint8(ord("@")))
    if surface is not None:
        for letter, kind in SURFACES.items():
            if kind != PLAIN:
                letters[(surface == kind) & ((codes == FREE) == (MEANING[letter] == FREE))] = ord(letter)
    return letters


def grid_for(document: MapDocument, start: Cell) -> Grid:
    """The grid in which a query that begins at ``start`` may move.

    By the published rules ground and swamp are one country and water is another: water is traversable, but
    not from ground, so a robot that starts in water stays in it. For such a start this is a new grid with all but
    water blocked; for any other it is ``document.grid`` itself, and so the same for all of them.
    """
    surface = document.surface
    if surface is None or not document.grid.contains(start) or surface[start[1], start[0]] != WATER:
        return document.grid
    return replace(document.grid, blocked=surface != WATER, unknown=None, terrain=None)


def letter_at(document: MapDocument, cell: Cell) -> str:
    """The character a ``.map`` has for a cell of the map."""
    x, y = cell
    blocked = document.grid.blocked[y : y + 1, x : x + 1]
    surface = None if document.surface is None else document.surface[y : y + 1, x : x + 1]
    codes = np.where(blocked, np.uint8(BLOCKED), np.uint8(FREE))
    return chr(int(letters_of(codes, surface)[0, 0]))


def _header(source: FileSource) -> tuple[int, int, int]:
    """height, width, and the offset of the first row."""
    head = source.data[:HEADER_BYTES]
    offset = len(_BOM) if head.startswith(_BOM) else 0
    sizes = []
    for number, word in enumerate(("type", "height", "width", "map"), 1):
        end = head.find(b"\n", offset)
        if end < 0:
            raise source.error(
                "MAP_HEADER", "the header ends early", f"line {number}", "type, height, width, map"
            )
        # As bytes: of text, Python takes separators of records and units for blanks, too.
        line = head[offset:end].strip()
        text = line.decode("ascii", "replace")
        offset = end + 1
        if word == "type" and line.split() != [b"type", b"octile"]:
            raise source.error("MAP_TYPE", repr(text[:40]), "line 1", "type octile")
        if word == "map" and text != "map":
            raise source.error("MAP_HEADER", repr(text[:40]), "line 4", "map")
        if word in ("height", "width"):
            sizes.append(_dimension(source, text, number, word))
    return sizes[0], sizes[1], offset


def _dimension(source: FileSource, text: str, line: int, word: str) -> int:
    match = re.fullmatch(rf"{word}\s+([0-9]{{1,10}})", text, re.ASCII)
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
    LimitError : more than 16 MiB; SCEN_LINES, more than 100,000 lines.
    """
    source = FileSource(read_regular(path, MAX_SCEN_BYTES), os.fspath(path))
    data = source.data.removeprefix(_BOM).replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    # Counted before they are cut up: of 16 MiB of ends of line a list would need 128.
    if (many := data.count(b"\n") + (not data.endswith(b"\n"))) > MAX_SCEN_LINES:
        allowed = f"at most {MAX_SCEN_LINES:,}"
        raise LimitError("SCEN_LINES", f"{many:,} lines", where=source.name, allowed=allowed)
    queries = []
    first = True
    for number, raw in enumerate(data.split(b"\n"), 1):
        line = raw.decode("utf-8", "replace")
        if not line.strip():
            continue
        if first and line.split()[0].lower() == "version":
            if line.split()[1:] not in (["1"], ["1.0"], ["0"]):
                raise source.error("SCEN_VERSION", repr(line[:40]), f"line {number}", "version 1 or 1.0")
        else:
            queries.append(_scen_query(source, line, number))
        first = False
    return tuple(queries)


def _scen_query(source: FileSource, line: str, number: int) -> ScenQuery:
    fields = line.split("\t") if line.count("\t") == 8 else line.split()
    fields = [f.strip() for f in fields]
    where = f"line {number}"
    if len(fields) != 9:
        todo = "this is a map; its queries are in a file called .scen" if fields[:1] == ["type"] else ""
        raise source.error("SCEN_LINE", plural(len(fields), "field"), where, "9 fields", todo)
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


def check_query(query: ScenQuery, document: MapDocument, name: str) -> None:
    """Whether a line of a ``.scen`` can be asked of this map.

    Parameters
    ----------
    query : the line.
    document : the map, with its surface.
    name : the ``.scen`` file, for messages.

    Raises
    ------
    FileError : SCEN_SIZE (the line is about a map of another size; the published rule would have the map
        scaled, which no published map needs) or SCEN_MAP (of another name; folders do not matter).
    SceneError : START_OCCUPIED or GOAL_OCCUPIED.
    """
    where = f"{name}: line {query.line}"
    grid = document.grid
    if (query.width, query.height) != (grid.width, grid.height):
        size = f"{query.width} x {query.height}"
        allowed = f"{grid.width} x {grid.height}, the map's size"
        raise FileError("SCEN_SIZE", size, where=where, allowed=allowed)
    named = PurePosixPath(query.map.replace("\\", "/")).name
    if document.format == "movingai" and named != grid.name:
        allowed = f"{grid.name!r}, the map's name"
        raise FileError("SCEN_MAP", repr(query.map[:60]), where=where, allowed=allowed)
    for what, cell in (("start", query.start), ("goal", query.goal)):
        letter = letter_at(document, cell)
        # Water is no mistake of the line: a robot that starts there stays there, and one that does not cannot come
        # there, which is an answer.
        if document.grid.blocked[cell[1], cell[0]] and letter != "W":
            at = f"{what} ({cell[0]},{cell[1]}) is {letter!r}"
            raise SceneError(f"{what.upper()}_OCCUPIED", at, where=where, allowed="a passable cell")


def write_scen(
    path: str | os.PathLike[str], queries: Sequence[MapQuery | ScenQuery], *, map_name: str, grid: Grid
) -> None:
    """Write a ``.scen`` of version 1, fields apart by tabs.

    Parameters
    ----------
    path : is overwritten.
    queries : stored queries of a map, or lines of another ``.scen``; of these start, goal and length count.
    map_name : what the lines call the map.
    grid : the map, for its size.

    The bucket is the length divided by 4, rounded down, as in the published files; lengths have 8 decimals.

    Raises
    ------
    SettingError : SCEN_MAP (a name that no reader would take for one field), SCEN_RANGE (an end outside the
        map), SCEN_LENGTH (a query whose shortest path is not known), SCEN_LINES (too many).
    FileError : FILE_WRITE.
    """
    where = os.fspath(path)
    if not map_name.strip() or map_name != map_name.strip() or not map_name.isprintable():
        raise SettingError("SCEN_MAP", repr(map_name), where=where, allowed="a name of printable characters")
    if len(queries) >= MAX_SCEN_LINES:
        allowed = f"at most {MAX_SCEN_LINES - 1:,}"
        raise SettingError("SCEN_LINES", plural(len(queries), "line"), where=where, allowed=allowed)
    lines = ["version 1"]
    for number, query in enumerate(queries, 2):
        at = f"{where}: line {number}"
        for cell in (query.start, query.goal):
            if not grid.contains(cell):
                allowed = f"cells of a map of {grid.width} x {grid.height}"
                raise SettingError("SCEN_RANGE", f"({cell[0]}, {cell[1]})", where=at, allowed=allowed)
        length = _length(query, at)
        (x0, y0), (x1, y1) = query.start, query.goal
        fields = (int(length // 4), map_name, grid.width, grid.height, x0, y0, x1, y1, f"{length:.8f}")
        lines.append("\t".join(map(str, fields)))
    write_file(path, ("\n".join(lines) + "\n").encode())


def _length(query: MapQuery | ScenQuery, where: str) -> float:
    if isinstance(query, ScenQuery):
        length = query.length
    elif query.octile is None:
        raise SettingError("SCEN_LENGTH", "the shortest path is not known", where=where)
    else:
        length = query.octile[0] + query.octile[1] * math.sqrt(2)
    if not 0 <= length < 10**15:
        raise SettingError("SCEN_LENGTH", f"length {length}", where=where, allowed="0 to 10^15, exclusive")
    return length


def looks_like(head: bytes) -> bool:
    """Whether a file begins like a ``.map``, rightly or wrongly written."""
    first = head.removeprefix(_BOM).lstrip()[:40].split(None, 1)
    return bool(first) and first[0] in (b"type", b"height", b"width", b"map")
