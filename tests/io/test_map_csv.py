"""CSV maps."""

from __future__ import annotations

import csv
import io
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import FileError, LimitError
from lampyris.io.maps.formats import csv as csv_file
from lampyris.io.maps.formats.csv import MARKER, csv_text
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.load import load_map
from lampyris_selfcheck.reference.files.map_files import cells, load_bytes, put


@pytest.mark.parametrize("separator", [b",", b";", b"\t", b", ", b" ;  "])
@pytest.mark.parametrize("line", [b"\n", b"\r\n", b" \n"])
@pytest.mark.parametrize("end", [b"", b"\n", b"\n\n \n"])
@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf"])
def test_occupancy(tmp_path: Path, separator: bytes, line: bytes, end: bytes, start: bytes) -> None:
    data = start + b"0,1,-1\n1,0,00".replace(b",", separator) + end
    found = load_bytes(tmp_path, data.replace(b"\n", line), "m.csv")
    assert cells(found) == [".#?", "#.."]
    assert (found.format, found.notes, found.grid.terrain) == ("csv", (), None)
    assert (found.start, found.goal, found.obstacle_cells) == (None, None, ())


@pytest.mark.parametrize("data", [b"0", b"1\n", b"-1\r\n"])
def test_one_cell(tmp_path: Path, data: bytes) -> None:
    assert cells(load_bytes(tmp_path, data, "m.csv")) == [{48: ".", 49: "#", 45: "?"}[data[0]]]


def test_one_column(tmp_path: Path) -> None:
    assert cells(load_bytes(tmp_path, b"0\n1\n0\n", "m.csv")) == [".", "#", "."]


COSTS = b"0,1,252\n253,254,255\n-1,63,0\n"


@pytest.mark.parametrize(
    ("marker", "name"),
    [
        ("# lampyris costmap\n", "m.csv"),
        ("\ufeff# lampyris costmap\r\n", "m.csv"),
        ("#lampyris costmap\n", "m.csv"),
        ("# Lampyris Costmap,,\n", "m.csv"),
        ("# lampyris costmap\n", "m"),
        ("", "m.csv"),
    ],
)
def test_costmap(tmp_path: Path, marker: str, name: str) -> None:
    path = put(tmp_path, marker.encode() + COSTS, name)
    for values in ("occupancy", "costmap") if marker else ("costmap",):
        found = load_map(path, values=values)
        assert cells(found) == ["...", "##?", "?.."]
        assert found.grid.terrain is not None
        assert found.grid.terrain.tolist() == [[0, 1, 252], [0, 0, 0], [0, 63, 0]]
        assert found.notes == ("read as costmap values: 3 cells of terrain, 1 to 252, 2 blocked, 2 unknown",)
        assert found.format == "csv"


def test_only_its_suffix_or_its_first_line_make_a_csv(tmp_path: Path) -> None:
    for name in ("m", "m.txt"):
        with pytest.raises(FileError, match="MAP_CELL"):
            load_bytes(tmp_path, b"0,1\n", name)
    found = load_bytes(tmp_path, f"{MARKER}\n0,9\n".encode(), "m.txt")
    assert found.format == "csv"
    assert found.notes[0] == "the file is called .txt and is csv; it was read as what it is"
    with pytest.raises(FileError, match=r"IMG_FORMAT.*zip"):
        load_bytes(tmp_path, b"PK\x03\x04", "m.csv")
    assert load_bytes(tmp_path, b"P2 1 1 255 0", "m.csv").format == "pgm"


@pytest.mark.parametrize(
    ("data", "code", "says"),
    [
        (b"0,1\n0,x\n", "CSV_CELL", "line 2 column 2: 'x'; allowed: 0 free, 1 blocked, -1 unknown"),
        (b"0,1\n,0\n", "CSV_CELL", "line 2 column 1: an empty cell"),
        (b"0,1,\n0,1,\n", "CSV_CELL", "line 1 column 3: an empty cell"),
        (
            b"0,1\n0,2\n",
            "CSV_CELL",
            "line 2 column 2: '2'; allowed: 0 free, 1 blocked, -1 unknown; costmap values are",
        ),
        (b"0,1\n0,-2\n", "CSV_CELL", "line 2 column 2: '-2'"),
        (
            b"0,1\n0,0.0\n",
            "CSV_CELL",
            "'0.0'; allowed: 0 free, 1 blocked, -1 unknown; whole numbers have no point",
        ),
        (b'"0","1"\n', "CSV_CELL", "quotation marks"),
        (b"0,1\n0,1 1\n", "CSV_CELL", "line 2 column 2: '1 1'"),
        (b"0,1\n0,1\t1\n", "CSV_CELL", "line 2 column 2: '1\\t1'"),
        (b"\t1\n", "CSV_CELL", "line 1 column 1: an empty cell"),  # the nightly maps found these two
        (b"0\t \n", "CSV_CELL", "line 1 column 2: an empty cell"),
        (b"0\t1\n\t\n", "CSV_CELL", "line 2 column 1: an empty cell"),
        (b"0,1\n,\n", "CSV_CELL", "line 2 column 1: an empty cell"),
        (b"0\t1\n\t\t\t\n", "CSV_CELL", "line 2 column 1: an empty cell"),
        (b"0,1\n1,0\r\r\r\n", "CSV_ROW", "line 2"),
        (b"0,1\r\r\n1,0\r\n", "CSV_ROW", "line 1"),
        (b"0,1\n1,0\n0,1\r\r\n1,0\r\n", "CSV_ROW", "line 3"),
        (b"0,1\n1,%bx\n" % (b"1" * 100_000), "CSV_CELL", "line 2 column 2"),
        (b"0\t1\n1\t0\t\t\n", "CSV_ROW", "4 cells"),
        (b"0,1\n1,0\v\n", "CSV_CELL", "line 2 column 2"),
        (b"0,1\n0,- 1\n", "CSV_CELL", "'- 1'"),
        (b"0,1\n0,+1\n", "CSV_CELL", "'+1'; allowed: 0 free, 1 blocked, -1 unknown"),
        (b"0,1\n0,--1\n", "CSV_CELL", "'--1'"),
        (b"0,1\n0,-\n", "CSV_CELL", "'-'"),
        (b"0,1\n0,00001\n", "CSV_CELL", "'00001'"),
        (b"0,1\n0,1e0\n", "CSV_CELL", "'1e0'"),
        (b"0,1\n0,%b\n" % (b"9" * 5000), "CSV_CELL", "'99999999999999999999'"),
        (b"0,1\n0;1\n", "CSV_CELL", "line 2 column 1: '0;1'"),
        (b"0,1\r0,1\r", "CSV_CELL", "line 1 column 2"),
        (
            b"0.0,1.0\n",
            "CSV_CELL",
            "line 1 column 1: '0.0'; allowed: 0 free, 1 blocked, -1 unknown; whole numbers",
        ),
        (b"2.54e+02,0e+00\n", "CSV_CELL", "numpy.savetxt writes them with fmt='%d'"),
        (
            b"0,1\n0,.5\n",
            "CSV_CELL",
            "line 2 column 2: '.5'; allowed: 0 free, 1 blocked, -1 unknown; whole numbers",
        ),
        (b"# made by hand\n0,1\n", "CSV_CELL", "no header and no comment"),
        (b"# lampyris occupancy\n0,1\n", "CSV_CELL", "no header and no comment"),
        (b"x,y\n1,1\n", "CSV_CELL", "line 1 column 1: 'x'"),
        (b"t;X;Y\n1;1;1\n", "CSV_CELL", "a recorded track, not of a map"),
        # Known by its first 64 cells: a row may have fifteen million, and all of them took 2 s.
        (b"a," * 64 + b"1\n", "CSV_CELL", "no header and no comment"),
        (b"#..#\n", "CSV_CELL", "line 1 column 1: '#..#'"),
        (b"0,\xff\n", "CSV_CELL", "line 1 column 2"),
        (b"0,1\n0\n", "CSV_TRUNCATED", "line 2: row 2 has 1 of 2 cells"),
        (b"0,1\n\n0,1\n", "CSV_TRUNCATED", "line 2: row 2 has 0 of 2"),
        (b"0\n\n0\n", "CSV_TRUNCATED", "line 2: row 2 has 0 of 1"),
        (b"0,1\n0,1,0\n0\n", "CSV_ROW", "line 2: 3 cells; allowed: 2, as in the first row"),
        (b"0,1,0\n0,1\n0,1,0,1\n", "CSV_TRUNCATED", "line 2"),
        (b"\n0,1\n", "CSV_EMPTY", "line 1"),
        (b" \n", "CSV_EMPTY", "line 1"),
        (b"# lampyris costmap\n", "CSV_EMPTY", "line 2"),
        (b"# lampyris costmap", "CSV_EMPTY", "line 2"),
        (
            b"# lampyris costmap\n0,256\n",
            "CSV_CELL",
            "line 2 column 2: '256'; allowed: 0 free, 1 to 252 terrain",
        ),
        (b"# lampyris costmap\n0,-2\n", "CSV_CELL", "line 2 column 2: '-2'"),
        ("0,1\n".encode("utf-16"), "CSV_TEXT", "UTF-16"),
        (b"0,\x001\n", "CSV_TEXT", ""),
        (b"", "IMG_EMPTY", "empty"),
    ],
)
def test_refused(tmp_path: Path, data: bytes, code: str, says: str) -> None:
    with pytest.raises(FileError) as caught:
        load_bytes(tmp_path, data, "m.csv")
    assert caught.value.code == code
    assert says in str(caught.value)
    assert len(str(caught.value)) < 400


def test_the_mistake_is_found_in_any_piece(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(csv_file, "_PIECE", 7)
    text = [["0"] * 5 for _ in range(9)]
    for y in range(9):
        for x in range(5):
            changed = [row[:] for row in text]
            changed[y][x] = "7"
            data = "\r\n".join(",".join(row) for row in changed).encode()
            with pytest.raises(FileError, match=rf"line {y + 1} column {x + 1}: '7'"):
                load_bytes(tmp_path, data, "m.csv")
            changed[y][x] = "1"
            data = "\r\n".join(",".join(row) for row in changed).encode()
            expected = ["".join(".#"[int(c)] for c in row) for row in changed]
            assert cells(load_bytes(tmp_path, data, "m.csv")) == expected


def test_pieces_and_a_plain_reader_agree(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.Generator(np.random.PCG64(5))
    for piece in (1, 3, 64, 2**20):
        monkeypatch.setattr(csv_file, "_PIECE", piece)
        for _ in range(20):
            height, width = (int(v) for v in rng.integers(1, 12, 2))
            values = rng.integers(-1, 256, (height, width))
            text = "\n".join(",".join(map(str, row)) for row in values.tolist())
            plain = [[int(c) % 256 for c in row] for row in csv.reader(io.StringIO(text))]
            plain = [[254 if c == 253 else c for c in row] for row in plain]
            assert _costs(load_map(put(tmp_path, text.encode(), "m.csv"), values="costmap")) == plain


def _costs(found: MapDocument) -> list[list[int]]:
    """Costmap values of a document, 253 told from 254 no more."""
    grid = found.grid
    terrain = np.zeros_like(grid.blocked, dtype=int) if grid.terrain is None else grid.terrain.astype(int)
    unknown = grid.blocked & False if grid.unknown is None else grid.unknown
    return np.where(unknown, 255, np.where(grid.blocked, 254, terrain)).tolist()


def test_every_number_is_written_as_itself() -> None:
    values = np.arange(-1, 256, dtype=np.int16).reshape(1, -1)
    assert csv_text(values) == (",".join(map(str, range(-1, 256))) + "\n").encode()
    assert csv_text(np.array([[0], [-1]], dtype=np.int16)) == b"0\n-1\n"


def test_limits_are_counted_from_the_bytes(tmp_path: Path) -> None:
    path = put(tmp_path, b"0,0,0,0,0\n" * 20, "m.csv")
    assert load_map(path, max_cells=100).grid.blocked.size == 100
    with pytest.raises(LimitError, match=r"MAP_TOO_LARGE.*100 cells"):
        load_map(path, max_cells=99)
    # Counted before any number is looked at: these are none.
    with pytest.raises(LimitError, match="MAP_TOO_LARGE"):
        load_map(put(tmp_path, b"x,y,z\n" * 50, "m.csv"), max_cells=99)


def test_a_large_one_is_read_in_few_passes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Work, not time: the plain reading of cells is not called on a file that is well."""
    values = np.random.Generator(np.random.PCG64(1)).integers(-1, 256, (300, 400)).astype(np.int16)
    monkeypatch.setattr(csv_file, "_wrong", None)
    found = load_map(put(tmp_path, f"{MARKER}\n".encode() + csv_text(values), "m.csv"))
    expected = np.where(values == 253, 254, values % 256)
    assert _costs(found) == expected.tolist()


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"0,1\n1,0" + b" " * 3_000_000, None),
        (b"0,1\n1" + b" " * 3_000_000 + b",0\n", None),
        (b"0\t1\n1\t0" + b"\t" * 3_000_000, "line 2: 3,?000,?002 cells"),
        (b"0,1\n1,0" + b"," * 3_000_000 + b"\n", "line 2: 3,?000,?002 cells"),
    ],
)
def test_a_row_of_millions_of_blanks_or_cells_is_not_cut_up(
    tmp_path: Path, data: bytes, says: str | None
) -> None:
    path = put(tmp_path, data, "m.csv")
    tracemalloc.start()
    try:
        if says is None:
            assert cells(load_map(path)) == [".#", "#."]
        else:
            with pytest.raises(FileError, match=f"CSV_ROW.*{says}"):
                load_map(path)
        assert tracemalloc.get_traced_memory()[1] < 9 * len(data)  # it was 20 times as much and more
    finally:
        tracemalloc.stop()
