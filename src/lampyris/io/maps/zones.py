"""Speed zones: how fast a robot may be in each cell, from a mask of Nav2's speed filter or from numbers.

A mask is a ROS map (YAML and picture) in mode ``scale`` or ``raw``: 0 is no limit, 1 to 100 are per cent of
the robot's maximum speed, as Nav2's speed filter has them. A ``.npy`` or ``.csv`` holds metres a second
for each cell, row 0 on top; ``inf`` (in a CSV an empty field as well) is no limit. There is no speed zero:
where a robot must not be is for the map to say.
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from lampyris.errors import FileError, UsageError, plural
from lampyris.io.files import read_regular
from lampyris.io.maps.formats.document import FileSource, byte_limit, first_bad
from lampyris.io.maps.formats.npy import MAGIC, read_floats
from lampyris.io.maps.formats.ros import read_ros
from lampyris.io.maps.formats.ros_yaml import mode_of
from lampyris.io.text.csv_table import GREATEST, NUMBER, lines
from lampyris.io.text.strict_yaml import read_yaml
from lampyris.model.grid import Grid, frozen
from lampyris.typing import BoolGrid, FloatGrid

SUFFIXES = (".yaml", ".yml", ".npy", ".csv")
_ALLOWED = f"a speed > 0 in m/s, up to {GREATEST:g}, or inf for no limit"


def read_zones(
    path: str | os.PathLike[str],
    grid: Grid,
    v_max: float,
    *,
    allow_outside: bool = False,
    confined: bool = False,
) -> tuple[FloatGrid, tuple[str, ...]]:
    """Read speed zones.

    Parameters
    ----------
    path : the file.
    grid : the map; the zones must have its cells.
    v_max : the robot's maximum speed, m/s, of which a mask has per cents.
    allow_outside, confined : which pictures a YAML file may name: see :class:`lampyris.io.maps.formats.document.FileSource`.

    Returns
    -------
    zones : m/s, (height, width), infinity where there is no limit.
    notes : notes for the user.

    Raises
    ------
    UsageError : SUFFIX: another kind of file.
    FileError : ZONES_MODE: a mask in mode trinary; ZONES_MAP: another size, resolution or origin than the
        map's; ZONES_VALUE: a value that is no speed, with its cell; and what the readers of these files say.
    LimitError : larger than a map may be.
    """
    name = os.fspath(path)
    suffix = Path(name).suffix.lower()
    if suffix not in SUFFIXES:
        raise UsageError("SUFFIX", repr(suffix), where=name, allowed=", ".join(SUFFIXES))
    limit = grid.width * grid.height
    data = read_regular(name, max(2**16, 4 * byte_limit(limit)))
    source = FileSource(data, name, max(limit, 2**20), allow_outside, confined=confined)
    if suffix == ".npy":
        return frozen(_npy(source, grid)), ()
    if suffix == ".csv":
        return frozen(_csv(source, grid)), ()
    return _mask(source, grid, v_max)


def _mask(source: FileSource, grid: Grid, v_max: float) -> tuple[FloatGrid, tuple[str, ...]]:
    parsed = read_yaml(source.data, source.name)
    if mode_of(parsed) == "trinary":
        raise parsed.error(
            "ZONES_MODE",
            "mode trinary knows free, occupied and unknown, and no speeds",
            *(("mode",) if "mode" in parsed.data else ()),
            allowed="mode: scale, or raw",
        )
    reading = read_ros(source)
    assert reading.occupancy is not None
    value = reading.occupancy
    _same_size(source, value.shape, grid)
    geometry = (reading.resolution or 1.0, *reading.origin)
    if not np.allclose(geometry, (grid.resolution, *grid.origin), rtol=1e-9, atol=1e-9):
        place = "resolution {:g}, origin [{:g}, {:g}, {:g}]"
        allowed = "the map's, " + place.format(grid.resolution, *grid.origin)
        raise source.error("ZONES_MAP", place.format(*geometry), allowed=allowed)
    _refuse(source, value == -1, "unknown", "0 for no limit, 1 to 100 per cent of the robot's speed")
    zones = np.where(value == 0, np.inf, value.astype(np.float64) / 100 * v_max)
    notes = tuple(n for n in reading.notes if "occupancy 1 to 99" not in n)
    return frozen(zones), (*notes, f"{plural(int(np.count_nonzero(value)), 'cell')} with a speed limit")


def _npy(source: FileSource, grid: Grid) -> FloatGrid:
    if not source.data.startswith(MAGIC):
        raise source.error("NPY_HEADER", "not a NumPy file", allowed="what numpy.save writes")
    zones = read_floats(source)
    _same_size(source, zones.shape, grid)
    wrong = ~((zones > 0) & ((zones <= GREATEST) | np.isinf(zones)))
    x, y = first_bad(wrong)
    _refuse(source, wrong, f"{zones[y, x]}", _ALLOWED)
    return zones


def _csv(source: FileSource, grid: Grid) -> FloatGrid:
    zones = np.full((grid.height, grid.width), np.inf)
    y = 0
    for line, text in lines(source.data, source.name, "ZONES_VALUE", max_line=32 * grid.width + 2**16):
        if text.startswith("#") or (not text.strip() and grid.width > 1):
            continue
        mark = next((m for m in ";\t" if m in text), ",")
        fields = text.rstrip("\n").split(mark)
        if len(fields) != grid.width or y == grid.height:
            what = f"row {y + 1}" if y == grid.height else f"{plural(len(fields), 'field')} in row {y + 1}"
            allowed = f"the map's {grid.width} x {grid.height} cells"
            raise source.error("ZONES_MAP", what, f"line {line}", allowed)
        for x, word in enumerate(fields):
            word = word.strip()
            value = np.inf if word in ("", "inf") else float(word) if NUMBER.fullmatch(word) else -1.0
            if not (0 < value <= GREATEST or value == np.inf):
                raise source.error("ZONES_VALUE", repr(word[:40]), f"line {line}, field {x + 1}", _ALLOWED)
            zones[y, x] = value
        y += 1
    _same_size(source, (y, grid.width), grid)
    return zones


def _same_size(source: FileSource, shape: tuple[int, ...], grid: Grid) -> None:
    if shape != (grid.height, grid.width):
        what = f"{shape[1]} x {shape[0]} cells"
        raise source.error("ZONES_MAP", what, allowed=f"the map's {grid.width} x {grid.height} cells")


def _refuse(source: FileSource, wrong: BoolGrid, what: str, allowed: str) -> None:
    if wrong.any():
        x, y = first_bad(wrong)
        raise FileError("ZONES_VALUE", what, where=f"{source.name}: cell ({x},{y})", allowed=allowed)
