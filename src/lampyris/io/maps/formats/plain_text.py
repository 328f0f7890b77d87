"""Plain text maps: one character a cell, one line a row.

``#`` blocked, ``.`` free, ``?`` unknown, ``S`` start, ``G`` goal, ``o`` a moving obstacle. A space means
nothing: editors take spaces away at the ends of lines and put them in at the beginnings, and the map would
shift without a word.
"""

from __future__ import annotations

import re

from lampyris.io.maps.formats.character_rows import read_rows
from lampyris.io.maps.formats.costmap import no_numbers
from lampyris.io.maps.formats.document import (
    BLOCKED,
    FREE,
    GOAL,
    OBSTACLE,
    START,
    UNKNOWN,
    FileSource,
    Reading,
)

_NUMBERS = re.compile(rb"-?[0-9]{1,4}[ \t]{0,8}[-,;\t0-9\r\n]")
MEANING = {"#": BLOCKED, ".": FREE, "?": UNKNOWN, "S": START, "G": GOAL, "o": OBSTACLE}


def read_text(source: FileSource) -> Reading:
    """Read a text map. CRLF, a byte order mark and blank lines at the end are accepted.

    Raises
    ------
    FileError : MAP_CELL, MAP_ROW or MAP_TRUNCATED with line and column; MAP_EMPTY when there is no row.
    LimitError : more cells than allowed.
    SettingError : VALUES, costmap values asked for.
    """
    no_numbers(source, "a text map")
    data = source.data
    start = 3 if data.startswith(b"\xef\xbb\xbf") else 0
    end = data.find(b"\n", start)
    width = len(data[start : end if end >= 0 else len(data)].rstrip(b"\r"))
    # Rows are counted by ends of line up to the last that is not blank; nothing is cut up for it.
    height = data.count(b"\n", start, len(data.rstrip())) + 1
    if width == 0 or not data.strip():
        raise source.error("MAP_EMPTY", "the first line is empty", "line 1", "one of " + " ".join(MEANING))
    source.check_size(width, height)
    if _NUMBERS.match(data, start):
        allowed, todo = "one of " + " ".join(MEANING), "numbers, one a cell, are read from a file called .csv"
        raise source.error("MAP_CELL", repr(chr(data[start])), "line 1 column 1", allowed, todo)
    return Reading(read_rows(source, start, 1, width, height, MEANING))
