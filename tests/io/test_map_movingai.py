"""MovingAI ``.map`` and ``.scen``."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lampyris.errors import FileError, LampyrisError, LimitError
from lampyris.io.maps.formats.movingai import ScenQuery, read_scen
from lampyris.io.maps.load import load_map
from lampyris_selfcheck.reference.files.map_files import cells, load_bytes, put

HEAD = b"type octile\nheight 2\nwidth 7\nmap\n"


def test_every_character(tmp_path: Path) -> None:
    found = load_bytes(tmp_path, HEAD + b".G@OTSW\nWS....@\n")
    assert cells(found) == ["..###.#", "#.....#"]
    assert found.format == "movingai"
    assert found.notes == ("2 cells of swamp (S) read as free", "2 cells of water (W) read as blocked")


@pytest.mark.parametrize(
    "data",
    [
        HEAD + b".......\n@@@@@@@",
        HEAD + b".......\n@@@@@@@\n\n \n",
        (HEAD + b".......\n@@@@@@@\n").replace(b"\n", b"\r\n"),
        (HEAD + b".......\n@@@@@@@").replace(b"\n", b"\r\n"),
        b"type  octile \nheight\t2\nwidth 07\nmap \n.......\n@@@@@@@\n",
    ],
)
def test_line_ends_and_white_space(tmp_path: Path, data: bytes) -> None:
    assert cells(load_bytes(tmp_path, data)) == [".......", "#######"]


BAD = {
    "tile": (HEAD.replace(b"octile", b"tile"), "MAP_TYPE", "line 1: 'type tile'; allowed: type octile"),
    "order": (b"height 2\ntype octile\nwidth 7\nmap\n", "MAP_TYPE", "line 1"),
    "no height": (b"type octile\nwidth 7\nmap\n", "MAP_HEADER", "line 2"),
    "minus": (HEAD.replace(b" 2", b" -4"), "MAP_HEADER", "line 2: 'height -4'"),
    "zero": (HEAD.replace(b" 2", b" 0"), "MAP_HEADER", "line 2"),
    "half": (HEAD.replace(b" 2", b" 4.5"), "MAP_HEADER", "line 2"),
    "x": (HEAD.replace(b" 7", b" x"), "MAP_HEADER", "line 3"),
    "a separator of records": (HEAD.replace(b" 2", b" 2\x1e"), "MAP_HEADER", "line 2"),
    "a separator of units": (HEAD.replace(b" 2", b"\x1f2"), "MAP_HEADER", "line 2"),
    "a separator in the type": (HEAD.replace(b"e octile", b"e\x1eoctile"), "MAP_TYPE", "line 1"),
    "no map": (HEAD.replace(b"map", b"mop"), "MAP_HEADER", "line 4"),
    "header only": (b"type octile\nheight 2\n", "MAP_HEADER", "line 3: the header ends early"),
    "no rows": (HEAD, "MAP_TRUNCATED", "0 of 2 rows"),
    "short row": (HEAD + b".......\n...\n", "MAP_TRUNCATED", "line 6: row 2 has 3 of 7 cells"),
    "short last": (HEAD + b".......\n......\n", "MAP_TRUNCATED", "line 6: row 2 has 6 of 7 cells"),
    "missing row": (HEAD + b".......\n", "MAP_TRUNCATED", "1 of 2 rows"),
    "long row": (HEAD + b".......\n........\n", "MAP_ROW", "line 6: 8 cells; allowed: 7, the width"),
    "shifted rows": (HEAD + b"......\n........\n", "MAP_TRUNCATED", "line 5: row 1 has 6 of 7"),
    "more rows": (HEAD + b".......\n" * 3, "MAP_ROW", "line 7: 3 rows"),
    "X": (HEAD + b".......\n..X....\n", "MAP_CELL", "line 6 column 3: 'X'; allowed: one of . G S E @ O T W"),
    "digit": (HEAD + b"0......\n.......\n", "MAP_CELL", "line 5 column 1: '0'"),
    "NUL": (HEAD + b".......\n......\0\n", "MAP_CELL", "line 6 column 7: byte 0"),
    "not ASCII": (HEAD + b".......\n.....\xc3\xa9\n", "MAP_CELL", "line 6 column 6: byte 195"),
    "old Mac": (HEAD + b".......\r.......\r", "MAP_", "line 5"),
}


@pytest.mark.parametrize("case", BAD)
def test_refused(tmp_path: Path, case: str) -> None:
    data, code, says = BAD[case]
    with pytest.raises(FileError) as caught:
        load_bytes(tmp_path, data, "a.map")
    assert caught.value.code.startswith(code)
    assert says in str(caught.value)


def test_too_large_is_seen_in_the_header(tmp_path: Path) -> None:
    with pytest.raises(LimitError, match="MAP_TOO_LARGE"):
        load_bytes(tmp_path, HEAD.replace(b" 2", b" 2000000000"))


def test_the_benchmark_maps_equal_a_plain_reading(movingai: Path, timely: Callable[..., Any]) -> None:
    files = sorted(movingai.glob("*.map"))
    assert files
    for path in files:
        lines = path.read_text().split("\n")
        height, width = int(lines[1].split()[1]), int(lines[2].split()[1])
        plain = [[c not in ".GS" for c in line] for line in lines[4 : 4 + height]]
        found = timely(0.5, load_map, path)
        assert (found.grid.height, found.grid.width) == (height, width)
        assert found.grid.blocked.tolist() == plain


def test_the_benchmark_queries_lie_on_free_cells(movingai: Path) -> None:
    for path in sorted(movingai.glob("*.scen")):
        queries = read_scen(path)
        assert len(queries) == sum(1 for line in path.read_text().split("\n") if line.strip()) - 1
        blocked = load_map(path.with_suffix("")).grid.blocked
        for q in queries:
            assert (q.height, q.width) == blocked.shape
            assert not blocked[q.start[1], q.start[0]]
            assert not blocked[q.goal[1], q.goal[0]]


LINE = "3\tmaps/a b.map\t10\t20\t1\t2\t9\t19\t12.50"


def test_scen(tmp_path: Path) -> None:
    expected = ScenQuery(2, 3, "maps/a b.map", 10, 20, (1, 2), (9, 19), 12.5, 2)
    assert read_scen(put(tmp_path, f"version 1\n{LINE}\n".encode())) == (expected,)
    crlf = f"version 1.0\r\n{LINE}\r\n\r\n \r\n".encode()
    assert read_scen(put(tmp_path, crlf)) == (expected,)
    spaces = LINE.replace("a b", "ab").replace("\t", "  ")
    assert read_scen(put(tmp_path, spaces.encode()))[0].line == 1
    assert read_scen(put(tmp_path, b"version 1\n")) == ()
    whole = LINE.replace("12.50", "12")
    assert read_scen(put(tmp_path, whole.encode()))[0].decimals == 0


@pytest.mark.parametrize(
    ("text", "code", "says"),
    [
        ("version 7\n", "SCEN_VERSION", "line 1: 'version 7'"),
        (f"version 1\n\n{LINE[:-6].replace(' ', '')}", "SCEN_LINE", "line 3: 8 fields; allowed: 9 fields"),
        ("type octile\nheight 2\n", "SCEN_LINE", "line 1: 2 fields; allowed: 9 fields; this is a map"),
        ("x\n", "SCEN_LINE", "line 1: 1 field; allowed: 9 fields"),
        (LINE.replace("12.50", "nan"), "SCEN_LINE", "'nan'"),
        (LINE.replace("12.50", "-1"), "SCEN_LINE", "'-1'"),
        (LINE.replace("12.50", "1e999"), "SCEN_LINE", "1e999"),
        (
            LINE.replace("\t9\t", "\t10\t"),
            "SCEN_RANGE",
            "line 1: goal x 10; allowed: 0 to 9: the map's width is 10",
        ),
        (LINE.replace("\t2\t", "\t20\t"), "SCEN_RANGE", "start y 20"),
        (LINE.replace("\t1\t", "\t-1\t"), "SCEN_LINE", "'-1'"),
        (LINE.replace("\t1\t", "\t1.0\t"), "SCEN_LINE", "'1.0'"),
        ("\n" * 100_001, "SCEN_LINES", "100,001"),
    ],
)
def test_scen_refused(tmp_path: Path, text: str, code: str, says: str) -> None:
    with pytest.raises(LampyrisError) as caught:
        read_scen(put(tmp_path, text.encode()))
    assert caught.value.code == code
    assert says in str(caught.value)


def test_scen_missing(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="FILE_MISSING"):
        read_scen(tmp_path / "no.scen")
