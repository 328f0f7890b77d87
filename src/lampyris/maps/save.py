"""From a map to a file.

The ending of the name says in which format; what a format cannot hold stands in this table.

=========  ======================================  =========================================
ending     written                                 left out
=========  ======================================  =========================================
.png       palette of the legend                   nothing
.txt       one character a cell                    nothing
.pgm       P5: 255 free, 205 unknown, 0 blocked    start, goal and moving obstacles
.npy       bool; int8 with -1 where unknown        start, goal and moving obstacles
.map       MovingAI, ``.`` and ``@``               those, and that a cell is unknown (``@``)

.yaml      ROS: YAML and ``.pgm``, as Nav2         start, goal and moving obstacles
=========  ======================================  =========================================

Resolution and origin are in ``.yaml`` alone. Reading the file again gives the same blocked cells in every
format.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lampyris.errors import UsageError
from lampyris.maps.colours import SHADES
from lampyris.maps.document import (
    BLOCKED,
    BODY,
    FREE,
    GOAL,
    START,
    UNKNOWN,
    CodeGrid,
    MapDocument,
    grid_codes,
    write_file,
)
from lampyris.maps.movingai import letters_of
from lampyris.maps.ros import SUFFIXES
from lampyris.maps.ros_write import save_ros
from lampyris.maps.text import MEANING
from lampyris.model.grid import Grid


def save_map(what: MapDocument | Grid, path: str | os.PathLike[str]) -> None:
    """Write a map, in the format that the ending of ``path`` names: .png, .txt, .pgm, .npy, .map or .yaml.

    With .yaml goes a picture of the same name; :func:`lampyris.maps.ros_write.save_ros` has more to choose.

    Raises
    ------
    UsageError : another ending.
    FileError : the file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() in SUFFIXES:
        save_ros(what, target)
        return
    write = WRITERS.get(target.suffix.lower())
    if write is None:
        raise UsageError(
            "MAP_ENDING", repr(target.suffix), where=str(target), allowed=", ".join((*WRITERS, *SUFFIXES))
        )
    if write is _movingai and isinstance(what, MapDocument):
        write_file(target, _movingai(codes_of(what), what.surface))
        return
    write_file(target, write(codes_of(what)))


def codes_of(what: MapDocument | Grid) -> CodeGrid:
    """The codes of a map, uint8 (height, width). A mark wins over its cell, start and goal over obstacles."""
    codes = grid_codes(what if isinstance(what, Grid) else what.grid)
    if isinstance(what, MapDocument):
        for x, y in what.bodies:
            codes[y, x] = BODY
        for cell, code in ((what.goal, GOAL), (what.start, START)):
            if cell is not None:
                codes[cell[1], cell[0]] = code
    return codes


def _bare(codes: CodeGrid) -> CodeGrid:
    """Codes without marks: they stand on free cells."""
    return np.where(codes > UNKNOWN, np.uint8(FREE), codes)


def _png(codes: CodeGrid) -> bytes:
    from PIL import Image

    picture = Image.frombytes("P", codes.shape[::-1], codes.tobytes())
    picture.putpalette([v for code in sorted(SHADES) for v in SHADES[code]])
    out = io.BytesIO()
    picture.save(out, format="PNG")
    return out.getvalue()


def _pgm(codes: CodeGrid) -> bytes:
    shades = np.array([SHADES[code][0] for code in (FREE, BLOCKED, UNKNOWN)], dtype=np.uint8)
    head = f"P5\n{codes.shape[1]} {codes.shape[0]}\n255\n".encode()
    return head + shades[_bare(codes)].tobytes()


def _lines(codes: CodeGrid, characters: str) -> bytes:
    """Rows of characters, one for each code in order."""
    return _with_ends(np.frombuffer(characters.encode(), dtype=np.uint8)[codes])


def _with_ends(rows: CodeGrid) -> bytes:
    return np.pad(rows, ((0, 0), (0, 1)), constant_values=ord("\n")).tobytes()


def _text(codes: CodeGrid) -> bytes:
    by_code = {code: character for character, code in MEANING.items()}
    return _lines(codes, "".join(by_code[code] for code in sorted(by_code)))


def _movingai(codes: CodeGrid, surface: CodeGrid | None = None) -> bytes:
    height, width = codes.shape
    letters = letters_of(_bare(codes), surface)
    return f"type octile\nheight {height}\nwidth {width}\nmap\n".encode() + _with_ends(letters)


def _npy(codes: CodeGrid) -> bytes:
    bare = _bare(codes)
    cells = np.array([0, 1, -1], dtype=np.int8)[bare] if (bare == UNKNOWN).any() else bare == BLOCKED
    out = io.BytesIO()
    np.save(out, cells, allow_pickle=False)
    return out.getvalue()


WRITERS: dict[str, Callable[[CodeGrid], bytes]] = {
    ".png": _png,
    ".txt": _text,
    ".pgm": _pgm,
    ".npy": _npy,
    ".map": _movingai,
}
"""A writer for each ending."""
