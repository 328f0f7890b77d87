"""From a map to a file.

The ending of the name says in which format; what a format cannot hold stands in this table.

=========  ========================================  =========================================
ending     written                                   left out
=========  ========================================  =========================================
.png       palette of the legend                     terrain
.txt       one character a cell                      terrain
.pgm       P5: 255 free, 205 unknown, 0 blocked      terrain, start, goal and moving obstacles
.npy       bool; int8 with -1 where unknown          terrain, start, goal and moving obstacles
.csv       0, 1 and -1 where unknown                 start, goal and moving obstacles
.map       MovingAI, ``.`` and ``@``, or the         those, terrain, and that a cell is unknown
           letters the map came with                 (``@``)
.yaml      ROS: YAML and ``.pgm``, as Nav2           terrain, start, goal and moving obstacles
=========  ========================================  =========================================

As costmap values (:mod:`lampyris.io.maps.formats.costmap`) .png, .pgm, .npy and .csv hold terrain: 8-bit grey, uint8, or
numbers after a line that marks them. Start, goal and moving obstacles are then left out of a .png too. A
.yaml holds them as occupancies 1 to 98, as Nav2 publishes a costmap, which rounds them by 2 at most. A .csv
is written so by itself when the map has terrain; the others must be requested, because the reader needs
the same option.

Resolution and origin are in ``.yaml`` alone. Reading the file again gives the same blocked cells in every
format.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lampyris._core.cancellation import uninterrupted
from lampyris.errors import UsageError
from lampyris.io.files import write_file
from lampyris.io.maps.formats.colours import SHADES
from lampyris.io.maps.formats.costmap import costs_of
from lampyris.io.maps.formats.csv import MARKER, csv_text
from lampyris.io.maps.formats.document import (
    BLOCKED,
    FREE,
    GOAL,
    OBSTACLE,
    START,
    UNKNOWN,
    CodeGrid,
    MapDocument,
    grid_codes,
)
from lampyris.io.maps.formats.movingai import letters_of
from lampyris.io.maps.formats.plain_text import MEANING
from lampyris.io.maps.formats.ros import SUFFIXES
from lampyris.io.maps.formats.ros_write import save_ros
from lampyris.model.grid import Grid
from lampyris.typing import ByteGrid


def save_map(what: MapDocument | Grid, path: str | os.PathLike[str], *, values: str | None = None) -> None:
    """Write a map, in the format that the ending of ``path`` names.

    Parameters
    ----------
    what : the map.
    path : ends in .png, .txt, .pgm, .npy, .csv, .map or .yaml, and is overwritten. With .yaml goes a picture
        of the same name; :func:`lampyris.io.maps.formats.ros_write.save_ros` has more to choose.
    values : ``occupancy``, or ``costmap`` for the formats that have numbers. None is occupancy, but for a
        .csv of a map with terrain.

    Raises
    ------
    UsageError : another ending, or VALUES: costmap values where there are no numbers.
    FileError : the file cannot be written.
    """
    target = Path(path)
    ending = target.suffix.lower()
    if ending not in WRITERS and ending not in SUFFIXES:
        allowed = ", ".join((*WRITERS, *SUFFIXES))
        raise UsageError("MAP_ENDING", repr(target.suffix), where=str(target), allowed=allowed)
    values = values_for(what, target, values)
    if ending in SUFFIXES:
        save_ros(what, target, values=values)
    elif values == "costmap":
        write_file(target, COST_WRITERS[ending](costs_of(what if isinstance(what, Grid) else what.grid)))
    elif ending == ".map" and isinstance(what, MapDocument):
        write_file(target, _movingai(codes_of(what), what.surface))
    else:
        write_file(target, WRITERS[ending](codes_of(what)))


def values_for(what: MapDocument | Grid, path: str | os.PathLike[str], values: str | None) -> str:
    """What the numbers of a file will be, ``occupancy`` or ``costmap``, when it is asked for ``values``.

    Raises
    ------
    UsageError : VALUES.
    """
    ending = Path(path).suffix.lower()
    if values is None:
        grid = what if isinstance(what, Grid) else what.grid
        return "costmap" if ending == ".csv" and grid.terrain is not None else "occupancy"
    if values not in ("occupancy", "costmap"):
        raise UsageError("VALUES", repr(values), where="values", allowed="occupancy or costmap")
    if values == "costmap" and not holds_terrain(path):
        allowed = ", ".join((*COST_WRITERS, *SUFFIXES))
        said = f"{ending} has no costmap values"
        raise UsageError("VALUES", said, where=str(path), allowed=allowed, setting="values")
    return values


def holds_terrain(path: str | os.PathLike[str]) -> bool:
    """Whether a file of this ending can be written as costmap values."""
    return Path(path).suffix.lower() in (*COST_WRITERS, *SUFFIXES)


def codes_of(what: MapDocument | Grid) -> CodeGrid:
    """The codes of a map, uint8 (height, width). A mark wins over its cell, start and goal over obstacles."""
    codes = grid_codes(what if isinstance(what, Grid) else what.grid)
    if isinstance(what, MapDocument):
        for x, y in what.obstacle_cells:
            codes[y, x] = OBSTACLE
        for cell, code in ((what.goal, GOAL), (what.start, START)):
            if cell is not None:
                codes[cell[1], cell[0]] = code
    return codes


def _bare(codes: CodeGrid) -> CodeGrid:
    """Codes without marks: they stand on free cells."""
    return np.where(codes > UNKNOWN, np.uint8(FREE), codes)


def _png(codes: CodeGrid) -> bytes:
    with uninterrupted():
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


def _csv(codes: CodeGrid) -> bytes:
    return csv_text(np.array([0, 1, -1], dtype=np.int16)[_bare(codes)])


def _cost_png(costs: ByteGrid) -> bytes:
    with uninterrupted():
        from PIL import Image

    out = io.BytesIO()
    Image.frombytes("L", costs.shape[::-1], costs.tobytes()).save(out, format="PNG")
    return out.getvalue()


def _cost_pgm(costs: ByteGrid) -> bytes:
    return f"P5\n{costs.shape[1]} {costs.shape[0]}\n255\n".encode() + costs.tobytes()


def _cost_npy(costs: ByteGrid) -> bytes:
    out = io.BytesIO()
    np.save(out, costs, allow_pickle=False)
    return out.getvalue()


def _cost_csv(costs: ByteGrid) -> bytes:
    return f"{MARKER}\n".encode() + csv_text(costs.astype(np.int16))


WRITERS: dict[str, Callable[[CodeGrid], bytes]] = {
    ".png": _png,
    ".txt": _text,
    ".pgm": _pgm,
    ".npy": _npy,
    ".csv": _csv,
    ".map": _movingai,
}
"""A writer for each ending."""
COST_WRITERS: dict[str, Callable[[ByteGrid], bytes]] = {
    ".png": _cost_png,
    ".pgm": _cost_pgm,
    ".npy": _cost_npy,
    ".csv": _cost_csv,
}
"""A writer of costmap values, for the endings that can have them."""
