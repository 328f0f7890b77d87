"""From a name or a file to a MapDocument. The content decides what a file is, never its name alone."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

from lampyris._core import defaults
from lampyris._core.limits import MAX_CELLS
from lampyris._core.scalars import is_word
from lampyris.errors import FileError, SettingError, did_you_mean, of_kind, shown
from lampyris.io.files import read_regular
from lampyris.io.maps import library
from lampyris.io.maps.formats.document import FileSource, MapDocument, byte_limit, check_limit, document
from lampyris.io.maps.formats.npy import NUMPY

VALUES = ("occupancy", "costmap")
COLOURS = ("legend", "luminance")


def load_map(
    name_or_path: str | os.PathLike[str],
    *,
    resolution: float | None = None,
    max_cells: int = MAX_CELLS,
    allow_outside: bool = False,
    strict: bool = False,
    values: str = defaults.VALUES,
    colour: str = defaults.COLOUR,
    confined: bool = False,
) -> MapDocument:
    """Read a map: one of the bundled maps by its name, or a file.

    Parameters
    ----------
    name_or_path : a bundled name such as ``guide`` (write ``./guide`` for a file of that name), or a path.
    resolution : metres a cell; None is 1, for files that do not say.
    max_cells : more cells than this are refused, from the header, before anything is made for them.
    allow_outside : whether a ROS map's picture may be in any folder. Otherwise ``..`` must not lead out of
        the map's own; an absolute path, which Nav2 takes too, is followed with a note.
    strict : for untrusted files. What a ROS map has of the doubtful is refused, not noted: absolute paths
        and links that lead out of the folder, a negate other than 0 or 1, thresholds in the wrong order,
        unknown keys.
    values : what grey samples and numbers are: ``occupancy`` (black or 1 is a wall), or ``costmap``: costmap
        values of ROS 2, 0 free, 1 to 252 terrain, 253 and 254 blocked, 255 unknown. A bundled map and a CSV
        file with the line that marks it say so themselves.
    colour : what to do with a colour that is not of the legend: ``legend`` refuses it, ``luminance`` reads
        the picture as grey, marks and all. A ROS map's picture always is grey; a costmap's must be.
    confined : for maps that an untrusted scenario names: nothing out of the map's folder is opened, though
        what is only doubtful is still noted and read.

    Raises
    ------
    FileError : FILE_MISSING (neither a map nor a file), FILE_KIND (a directory, pipe or device), or what is
        wrong in it.
    LimitError : IMG_TOO_LARGE, MAP_TOO_LARGE or FILE_TOO_LARGE.
    SettingError : a resolution or limit out of its range, a resolution where the file has another, or VALUES:
        costmap values asked for where there are no numbers.
    """
    check_limit(max_cells)
    of_kind("allow_outside", allow_outside, bool)
    of_kind("strict", strict, bool)
    try:
        name = os.fsdecode(name_or_path)
    except TypeError:
        raise SettingError(
            "MAP_NAME", f"{type(name_or_path).__name__} given", allowed="a name or a path"
        ) from None
    for what, word, known in (("VALUES", values, VALUES), ("COLOUR", colour, COLOURS)):
        if not is_word(word, known):
            raise SettingError(what, shown(word), where=what.lower(), allowed=" or ".join(known))
    if isinstance(name_or_path, str) and library.is_bundled(name):
        if values != VALUES[0]:
            what, todo = "a bundled map says itself what its cells are", "leave the option out"
            raise SettingError("VALUES", what, where=name, todo=todo, setting="values")
        return library.load(name, resolution=resolution, max_cells=max_cells)
    try:
        data = read_regular(name, byte_limit(max_cells))
    except FileError as problem:
        if problem.code == "FILE_MISSING":
            raise _missing(name) from None
        raise
    source = FileSource(data, name, max_cells, allow_outside, strict, values, colour, confined)
    form, suffix, usual = NUMPY, Path(name).suffix.lower(), None
    if not form.begins(data) or suffix not in form.suffixes:
        from lampyris.io.maps.formats import table  # with all other readers

        form, usual = table.format_of(source), table.usual_format(suffix)
    reading = form.read(source)
    if usual is not None and usual is not form:
        note = f"the file is called {suffix} and is {form.name}; it was read as what it is"
        reading = replace(reading, notes=(note, *reading.notes))
    return document(reading, source, name=Path(name).name, format=form.name, resolution=resolution)


def _missing(name: str) -> FileError:
    try:
        beside = sorted(os.listdir(os.path.dirname(name) or "."))[:1000]
    except (OSError, ValueError):
        beside = []
    near = did_you_mean(os.path.basename(name), beside, 0.75) or did_you_mean(name, library.names())
    return FileError(
        "FILE_MISSING",
        "neither a file nor a bundled map",
        where=name if name.isprintable() and 0 < len(name) <= 200 else repr(name[:200]),
        allowed="a map file, or a name that `lampyris maps` lists",
        todo=near,
    )
