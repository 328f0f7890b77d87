"""Rows 52 to 60: MovingAI maps."""

from __future__ import annotations

from bad_inputs.case import Case, bad_map, good_map
from bad_inputs.pictures import LIMIT

HEAD = b"type octile\nheight 2\nwidth 4\nmap\n"
ROWS = b"....\n.@@.\n"
CELLS = ("....", ".##.")
CHARACTERS = ". G S E @ O T W"


def _header(old: bytes, new: bytes) -> bytes:
    assert HEAD.count(old) == 1
    return HEAD.replace(old, new) + ROWS


CASES: list[Case] = [
    bad_map(52, "tile", "m.map", _header(b"octile", b"tile"), "MAP_TYPE", "line 1", "'type tile'", "octile"),
    bad_map(
        52,
        "another order",
        "m.map",
        b"height 2\ntype octile\nwidth 4\nmap\n" + ROWS,
        "MAP_TYPE",
        "line 1",
        "'height 2'",
        "type octile",
    ),
    bad_map(53, "no height", "m.map", _header(b"height 2\n", b""), "MAP_HEADER", "line 2", "'width 4'"),
    *(
        bad_map(53, value, "m.map", _header(b"height 2", f"height {value}".encode()), "MAP_HEADER", "line 2",
                f"'height {value}'", "a whole number >= 1")
        for value in ("-4", "0", "4.5", "x")
    ),
    bad_map(
        54,
        "2000000000 rows",
        "m.map",
        _header(b"height 2", b"height 2000000000"),
        "MAP_TOO_LARGE",
        "8,000,000,000 cells",
        LIMIT,
        exit=5,
    ),
    bad_map(55, "short row", "m.map", HEAD + b"....\n.@\n", "MAP_TRUNCATED", "line 6: row 2 has 2 of 4"),
    bad_map(55, "fewer rows", "m.map", HEAD + b"....\n", "MAP_TRUNCATED", "line 6", "1 of 2 rows"),
    bad_map(55, "no rows", "m.map", HEAD, "MAP_TRUNCATED", "line 5", "0 of 2 rows"),
    bad_map(56, "long row", "m.map", HEAD + b"....\n.....\n", "MAP_ROW", "line 6: 5 cells", "4, the width"),
    bad_map(56, "extra rows", "m.map", HEAD + ROWS + b"....\n", "MAP_ROW", "line 7: 3 rows", "2, the height"),
    bad_map(57, "X", "m.map", HEAD + b"....\n..X.\n", "MAP_CELL", "line 6 column 3: 'X'", CHARACTERS),
    bad_map(57, "digit", "m.map", HEAD + b"0...\n....\n", "MAP_CELL", "line 5 column 1: '0'", CHARACTERS),
    bad_map(57, "NUL", "m.map", HEAD + b"....\n...\0\n", "MAP_CELL", "line 6 column 4: byte 0", CHARACTERS),
    good_map(
        58,
        "swamp and water",
        "m.map",
        HEAD + b".GS.\nTW@O\n",
        ("....", "####"),
        "1 cell of swamp (S)",
        "1 cell of water (W) read as blocked",
    ),
    good_map(59, "CRLF", "m.map", (HEAD + ROWS).replace(b"\n", b"\r\n"), CELLS),
    good_map(59, "blank lines", "m.map", HEAD + ROWS + b"\n\n", CELLS),
    good_map(59, "no last end of line", "m.map", (HEAD + ROWS).rstrip(), CELLS),
    bad_map(60, "no map line", "m.map", _header(b"map\n", b""), "MAP_HEADER", "line 4", "'....'", "map"),
]  # fmt: skip
