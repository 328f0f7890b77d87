"""Plain text and NumPy maps."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest

from lampyris.errors import FileError, LimitError
from lampyris_selfcheck.reference.files.map_files import cells, load_bytes, npy


@pytest.mark.parametrize("end", [b"", b"\n", b"\n\n\n", b"\n  \n"])
@pytest.mark.parametrize("start", [b"", b"\xef\xbb\xbf"])
@pytest.mark.parametrize("line", [b"\n", b"\r\n"])
def test_text(tmp_path: Path, start: bytes, end: bytes, line: bytes) -> None:
    found = load_bytes(tmp_path, (start + b"#.?S\nGo.o" + end).replace(b"\n", line))
    assert cells(found) == ["#.?.", "...."]
    assert (found.start, found.goal, found.obstacle_cells) == ((3, 0), (0, 1), ((1, 1), (3, 1)))
    assert found.format == "text"


@pytest.mark.parametrize(
    ("data", "code", "says"),
    [
        (b"#.#\n# #\n", "MAP_CELL", "line 2 column 2: ' '; allowed: one of # . ? S G o"),
        (b"#.#\n#@#\n", "MAP_CELL", "line 2 column 2: '@'"),
        (b"#.#\n#.\n", "MAP_TRUNCATED", "line 2: row 2 has 2 of 3 cells"),
        (b"#.#\n#. \n", "MAP_CELL", "line 2 column 3"),
        (b"#.#\n#.##\n", "MAP_ROW", "line 2: 4 cells; allowed: 3"),
        (b"#.#\n\n#.#\n", "MAP_TRUNCATED", "line 2: row 2 has 0 of 3"),
        (b"\n#.#\n", "MAP_EMPTY", "line 1"),
        (b"\n\n", "MAP_EMPTY", "line 1"),
        (b"hello\n", "MAP_CELL", "line 1 column 1: 'h'"),
        (b"SS\n", "START_TWICE", "(0, 0) and (1, 0)"),
        (
            b"..\n. \n",
            "MAP_CELL",
            "line 2 column 2: ' '; allowed: one of # . ? S G o; a free cell is written .",
        ),
        (b"..\n.@\n", "MAP_CELL", "'@'; allowed: one of # . ? S G o"),
        (
            b"1,0\n0,1\n",
            "MAP_CELL",
            "line 1 column 1: '1'; allowed: one of # . ? S G o; numbers, one a cell, are read",
        ),
        (b"-1 ; allowed: 0\n", "MAP_CELL", "a file called .csv"),
        (b"0\n", "MAP_CELL", "a file called .csv"),
        (b"#.#\r#.#\r", "MAP_ROW", "line 1: 8 cells"),
    ],
)
def test_text_refused(tmp_path: Path, data: bytes, code: str, says: str) -> None:
    with pytest.raises(FileError) as caught:
        load_bytes(tmp_path, data)
    assert caught.value.code == code
    assert says in str(caught.value)


@pytest.mark.parametrize("kind", ["?", "u1", "i1", "<i2", ">i4", "<u8", "<i8"])
@pytest.mark.parametrize("order", ["C", "F"])
def test_npy_as_numpy_writes_it(tmp_path: Path, kind: str, order: str) -> None:
    array = np.asarray([[0, 1, 1], [1, 0, 0]], dtype=kind, order=order)  # type: ignore[call-overload]
    out = io.BytesIO()
    np.save(out, array)
    found = load_bytes(tmp_path, out.getvalue())
    assert cells(found) == [".##", "#.."]
    assert found.format == "numpy"


def test_npy_unknown(tmp_path: Path) -> None:
    data = npy("{'descr':'|i1','fortran_order':False,'shape':(1,3)}", b"\x00\x01\xff", version=2)
    assert cells(load_bytes(tmp_path, data)) == [".#?"]


def test_npy_with_tabs_as_python_allows_them(tmp_path: Path) -> None:
    data = npy("{'descr':\t'|u1', 'fortran_order': False, 'shape'\t: (1,\t3), }", b"\0\1\0")
    assert np.load(io.BytesIO(data)).tolist() == [[0, 1, 0]]
    assert cells(load_bytes(tmp_path, data)) == [".#."]


OK = "{'descr': '|u1', 'fortran_order': False, 'shape': (2, 2), }"


@pytest.mark.parametrize(
    ("data", "code", "says"),
    [
        (npy(OK, b"\0\0\xff\0"), "NPY_VALUE", "cell (0,1): 255; allowed: 0 free, 1 blocked"),
        (npy(OK, b"\0\0\0"), "NPY_TRUNCATED", "3 bytes of cells; allowed: 4"),
        (npy(OK, bytes(5)), "NPY_TRAILING", "5 bytes"),
        (
            npy(OK.replace("|u1", "<f8"), bytes(32)),
            "NPY_TYPE",
            "'<f8'; allowed: bool, or whole numbers; save it as .astype(bool)",
        ),
        (npy(OK.replace("|u1", "|O"), b"cos\nsystem\n."), "NPY_TYPE", "|O"),
        (npy(OK.replace("'|u1'", "[('a', '<i4')]"), bytes(16)), "NPY_TYPE", ""),
        (npy(OK.replace("(2, 2)", "(4,)"), bytes(4)), "NPY_SHAPE", "shape (4,)"),
        (npy(OK.replace("(2, 2)", "(2, 2, 1)"), bytes(4)), "NPY_SHAPE", ""),
        (npy(OK.replace("(2, 2)", "(0, 2)"), b""), "NPY_SHAPE", ""),
        (npy(OK.replace("(2, 2)", "(-2, -2)"), bytes(4)), "NPY_SHAPE", ""),
        (npy(OK.replace("(2, 2)", "(2\v, 2)"), bytes(4)), "NPY_SHAPE", ""),  # the nightly fuzz found it
        (npy(OK.replace("(2, 2)", "(2,\xa02)"), bytes(4)), "NPY_SHAPE", ""),
        (npy(OK.replace("'shape': ", "'shape':\x85"), bytes(4)), "NPY_HEADER", "shape is missing"),
        (npy(OK.replace("'shape'", "'shap'"), bytes(4)), "NPY_HEADER", "shape is missing"),
        (npy(OK.replace("False", "0"), bytes(4)), "NPY_HEADER", "fortran_order"),
        (npy("[" * 3000, b""), "NPY_HEADER", ""),
        (npy(OK + " " * 5000, bytes(4)), "NPY_HEADER", "bytes of header"),
        (npy(OK, bytes(4), version=9), "NPY_HEADER", "version 9"),
        (b"\x93NUMPY", "NPY_HEADER", "ends early"),
        (b"\x93NUMPY\x01\0\xff\x0f{", "NPY_HEADER", "ends early"),
    ],
)
def test_npy_refused(tmp_path: Path, data: bytes, code: str, says: str) -> None:
    with pytest.raises(FileError) as caught:
        load_bytes(tmp_path, data)
    assert caught.value.code == code
    assert says in str(caught.value)


def test_npy_too_large_is_seen_in_the_header(tmp_path: Path) -> None:
    with pytest.raises(LimitError, match="MAP_TOO_LARGE"):
        load_bytes(tmp_path, npy(OK.replace("(2, 2)", "(999999, 999999)"), b""))
