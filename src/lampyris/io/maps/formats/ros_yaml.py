"""The YAML file of a ROS map_server map: its keys, their values, and where its picture is."""

from __future__ import annotations

import difflib
import math
import os
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lampyris.errors import FileError
from lampyris.io.maps.formats.document import FileSource
from lampyris.io.text.strict_yaml import YamlDocument, shown

MODES = ("trinary", "scale", "raw")
REQUIRED = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
MAX_ORIGIN = 1e9
"""Metres; farther off, 64-bit floats no longer tell the cells of a fine map apart."""
# yaml-cpp's words for a bool, each in small letters, in capitals or with one capital.
_BOOL = {
    form: word in ("y", "yes", "true", "on")
    for word in ("y", "yes", "true", "on", "n", "no", "false", "off")
    for form in (word, word.upper(), word.capitalize())
}
# A scheme (a Windows drive as well), a pipe, a share, what ImageMagick and shells would act upon.
_ODD_PATH = re.compile(r"^[A-Za-z][A-Za-z0-9+.-]*:|^//|^@|[|\\\x00-\x1f\x7f]")


@dataclass(frozen=True, slots=True)
class MapYaml:
    """What the YAML file says.

    Parameters
    ----------
    image : the picture, as written.
    resolution : metres a cell.
    origin : x, y (metres) and yaw (radians) of the lower-left corner of the lower-left pixel.
    negate : whether white is occupied.
    occupied_thresh, free_thresh : shares of blackness, 0 to 1.
    mode : ``trinary``, ``scale`` or ``raw``.
    """

    image: str
    resolution: float
    origin: tuple[float, float, float]
    negate: bool
    occupied_thresh: float
    free_thresh: float
    mode: str = "trinary"


@dataclass(slots=True)
class Doubts:
    """What Nav2 accepts although it is doubtful: noted, or refused for untrusted files."""

    strict: bool
    notes: list[str] = field(default_factory=list)

    def add(self, problem: FileError, taken: str) -> None:
        """Refuse, or note what was found and what it was taken for."""
        if self.strict:
            raise problem
        self.notes.append(f"{problem.where}: {problem.what}; {taken}")


def plain_path(name: str) -> bool:
    """Whether a name is a path and nothing else: no address, pipe, share, drive or control character."""
    return _ODD_PATH.search(name) is None


def check_keys(document: YamlDocument, doubts: Doubts) -> MapYaml:
    """The keys and values, each checked.

    Raises
    ------
    FileError : MAP_KEY, MAP_RESOLUTION, MAP_ORIGIN, MAP_THRESH, MAP_NEGATE or MAP_MODE.
    """
    data = document.data
    missing = [key for key in REQUIRED if key not in data]
    for key in data:
        if key not in (*REQUIRED, "mode"):
            _unknown_key(document, key, missing, doubts)
    if missing:
        names = " and ".join(f"`{key}`" for key in missing)
        todo = "" if "image" in data else "a map's YAML names its picture"
        verb = "is" if len(missing) == 1 else "are"
        raise document.error("MAP_KEY", f"{names} {verb} missing", allowed=", ".join(REQUIRED), todo=todo)
    name = data["image"]
    if not isinstance(name, str) or not name.strip():
        what = "`image` is empty" if name is None or name == "" else f"`image` is {shown(name)}"
        raise document.error("MAP_KEY", what, "image", allowed="the name of a PNG, BMP or PGM")
    resolution = _number(document, "MAP_RESOLUTION", "metres a cell, 1e-6 to 1000", "resolution")
    if not 1e-6 <= resolution <= 1000:
        raise document.error(
            "MAP_RESOLUTION", str(data["resolution"]), "resolution", allowed="1e-6 to 1000 metres a cell"
        )
    occupied, free = (_threshold(document, key) for key in ("occupied_thresh", "free_thresh"))
    if free >= occupied:
        problem = document.error(
            "MAP_THRESH", f"free_thresh {free} >= occupied_thresh {occupied}", "free_thresh"
        )
        doubts.add(problem, "where both hold, the cell is free")
    origin = _origin(document)
    return MapYaml(name, resolution, origin, _negate(document, doubts), occupied, free, mode_of(document))


def _unknown_key(document: YamlDocument, key: str, missing: list[str], doubts: Doubts) -> None:
    near = difflib.get_close_matches(key.lower(), (*REQUIRED, "mode"), 1)
    todo = f"did you mean `{near[0]}`?" if near else ""
    problem = FileError(
        "MAP_KEY",
        f"unknown key {shown(key)}",
        where=document.at_key(key),
        allowed=", ".join(REQUIRED),
        todo=todo,
    )
    if near and near[0] in missing:
        raise problem
    doubts.add(problem, " ".join(("it is left aside;", todo)) if near else "it is left aside")


def _number(document: YamlDocument, code: str, allowed: str, *key_path: str | int) -> float:
    value: Any = document.data
    for step in key_path:
        value = value[step]
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    quoted = isinstance(value, str) and re.fullmatch(r"[-+.0-9eE]+", value) is not None
    todo = "take the quotation marks away" if quoted else ""
    raise document.error(code, f"{shown(value)} is not a number", *key_path, allowed=allowed, todo=todo)


def _threshold(document: YamlDocument, key: str) -> float:
    value = _number(document, "MAP_THRESH", "0 to 1", key)
    if not 0 <= value <= 1:
        raise document.error("MAP_THRESH", f"{key} {value}", key, allowed="0 to 1")
    return value


def _origin(document: YamlDocument) -> tuple[float, float, float]:
    allowed = "3 numbers: x and y in metres, yaw in radians"
    given = document.data["origin"]
    if not isinstance(given, list) or len(given) != 3:
        what = f"{len(given)} values" if isinstance(given, list) else shown(given)
        raise document.error("MAP_ORIGIN", what, "origin", allowed=allowed)
    x, y, yaw = (_number(document, "MAP_ORIGIN", allowed, "origin", k) for k in range(3))
    for k, value in enumerate((x, y, yaw)):
        if not (math.isfinite(value) and abs(value) <= MAX_ORIGIN):
            raise document.error(
                "MAP_ORIGIN", str(given[k]), "origin", k, allowed=f"-{MAX_ORIGIN:g} to {MAX_ORIGIN:g}"
            )
    return x, y, yaw


def _negate(document: YamlDocument, doubts: Doubts) -> bool:
    value = document.data["negate"]
    if isinstance(value, int):
        if value not in (0, 1):
            problem = document.error("MAP_NEGATE", f"negate {value}", "negate", allowed="0, 1, true or false")
            doubts.add(problem, "read as 1: white is occupied")
        return bool(value)
    if isinstance(value, str) and value in _BOOL:
        return _BOOL[value]
    raise document.error("MAP_NEGATE", f"negate {shown(value)}", "negate", allowed="0, 1, true or false")


def mode_of(document: YamlDocument) -> str:
    """How grey is read: ``trinary``, ``scale`` or ``raw``.

    Raises
    ------
    FileError : MAP_MODE: none of them.
    """
    value = document.data.get("mode", "trinary")
    word = value.lower() if isinstance(value, str) else ""
    if word not in MODES:
        near = difflib.get_close_matches(word, MODES, 1)
        raise document.error(
            "MAP_MODE",
            f"mode {shown(value)}",
            "mode",
            allowed=", ".join(MODES),
            todo=f"did you mean {near[0]}?" if near else "",
        )
    return word


def image_path(document: YamlDocument, name: str, source: FileSource, doubts: Doubts) -> str:
    """The picture's path; nothing is looked for before its form is known to be harmless.

    Raises
    ------
    FileError : PATH_FORM, PATH_OUTSIDE.
    """
    if not plain_path(name):
        raise document.error(
            "PATH_FORM",
            f"{shown(name)} is not a plain file name",
            "image",
            allowed="a path with / between its parts; no address, drive, pipe or share",
        )
    folder = os.path.dirname(source.name) or "."
    wanted = os.path.expanduser(name) if name.startswith("~/") else name
    absolute = os.path.isabs(wanted)
    # The name alone is put in order: what `..` means in the folder's own path is the system's to say.
    parts = os.path.normpath(wanted)
    path = parts if absolute else os.path.join(folder, parts)
    leaves = absolute or parts == os.pardir or parts.startswith(os.pardir + os.sep)
    # Links are followed to see where they lead only for untrusted files: an installed ROS package is made of links.
    closed = source.strict or source.confined
    if not (leaves or closed) or source.allow_outside or _inside(path, folder):
        return path
    problem = document.error(
        "PATH_OUTSIDE",
        f"{shown(name)} is outside the map's folder",
        "image",
        todo="put the picture beside it, or give allow_outside=True if you trust the map",
    )
    if not absolute or source.confined:
        raise problem
    doubts.add(problem, "an absolute path, followed as Nav2 does")
    return path


def _inside(path: str, folder: str) -> bool:
    return Path(os.path.realpath(path)).is_relative_to(os.path.realpath(folder))
