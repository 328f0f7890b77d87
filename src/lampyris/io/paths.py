"""A path from a file: where a robot is to drive, planned here or elsewhere.

Read are: a table (CSV) with columns ``x_m`` and ``y_m`` (metres of the map frame), as ``lampyris plan
--csv`` and ``lampyris speed --csv`` write it, or ``x`` and ``y``, or two columns of numbers without a
header; a ``nav_msgs/Path`` of ROS in JSON, or in YAML as ``ros2 topic echo`` prints it; and what ``lampyris
plan --json`` prints. Nothing but the file itself is opened.
"""

from __future__ import annotations

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lampyris.errors import FileError, LimitError, UsageError
from lampyris.io.files import read_regular
from lampyris.io.text.csv_table import GREATEST, table_of
from lampyris.io.text.strict_json import MAX_BYTES, JsonDocument, read_json
from lampyris.io.text.strict_yaml import YamlDocument, read_yaml, shown
from lampyris.model.grid import Grid, frozen
from lampyris.typing import Points

UNITS = ("metres", "cells")
MAX_POINTS = 100_000
YAML_BYTES = 2**20
YAML_VALUES = 40_000
"""Some 2,500 poses, read in 2 s; a longer one is quicker in JSON."""
_NEAR = 1e-6
"""Cells: a point so near the centre of one is meant to be there. Metres printed with all their digits come
back off by the last of them, and a path between two walls that touch would cut through one."""


@dataclass(frozen=True, slots=True, eq=False)
class PathPoints:
    """Points of a path as a file has them.

    Parameters
    ----------
    points : float64 (n, 2), n >= 1.
    frame : ``metres`` of the map frame, or ``cells``: the centre of cell (x, y) is at (x, y), y down.
    columns : the columns of a table that were seen; empty for others.
    map : what the file says of the map it was planned on (width, height, resolution, origin); None: nothing.
    notes : notes for the user.
    where : the file as the caller named it.
    """

    points: Points
    frame: str
    columns: tuple[str, ...] = ()
    map: tuple[int, int, float, tuple[float, ...]] | None = None
    notes: tuple[str, ...] = ()
    where: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", frozen(np.array(self.points, dtype=np.float64).reshape(-1, 2)))

    def on(self, grid: Grid) -> Points:
        """The points in cells of a map; (m, 2), those that repeat the one before left out.

        Raises
        ------
        FileError : PATH_MAP: it was planned on another map.
        """
        here = (grid.width, grid.height, grid.resolution, grid.origin)
        if self.map is not None and self.map != here:
            map_text = "{} x {} cells of {:g} m, origin {}".format(*self.map)
            raise FileError(
                "PATH_MAP",
                f"planned on a map of {map_text}",
                where=self.where,
                allowed="{} x {} cells of {:g} m, origin {}".format(*here),
                todo="give the map it was planned on",
            )
        xy = self.points
        if self.frame == "metres":
            xy = grid.to_points(xy[:, 0], xy[:, 1])
        near = np.round(xy)
        xy = np.where(np.abs(xy - near) <= _NEAR, near, xy)
        moves = np.ones(len(xy), dtype=np.bool_)
        moves[1:] = (xy[1:] != xy[:-1]).any(axis=1)
        return xy[moves]


def read_path_points(path: str | os.PathLike[str], units: str | None = None) -> PathPoints:
    """Read a path.

    Parameters
    ----------
    path : the file. ``.json`` is JSON, ``.yaml`` and ``.yml`` are YAML, all else is a table, unless it begins
        like a JSON object.
    units : ``metres`` or ``cells``, of the columns ``x`` and ``y``; None: metres. A file that says itself
        what its numbers are is not asked: ``x_m`` and ``y_m`` and a ROS path are metres, the cells of a
        plan cells.

    Raises
    ------
    UsageError : UNITS: no such unit.
    FileError : FILE_MISSING, FILE_KIND; PATH_FILE: not such a file, or a number that is none, with line and value;
        what the readers of JSON and YAML say.
    LimitError : FILE_TOO_LARGE, LIMIT, JSON_SIZE, YAML_SIZE.
    """
    if units is not None and units not in UNITS:
        raise UsageError("UNITS", repr(units), where="units", allowed=" or ".join(UNITS))
    name = os.fspath(path)
    data = read_regular(name, MAX_BYTES)
    suffix = Path(name).suffix.lower()
    if suffix in (".yaml", ".yml"):
        # The line with which `ros2 topic echo` ends a message begins a second document.
        text = data.rstrip()
        text = text.removesuffix(b"---") if text.endswith(b"\n---") else text
        document = read_yaml(text, name, max_bytes=YAML_BYTES, max_values=YAML_VALUES)
        return _from_document(document)
    if suffix == ".json" or data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{":
        return _from_document(read_json(data, name))
    return _from_table(data, name, units)


def _from_table(data: bytes, name: str, units: str | None) -> PathPoints:
    table = table_of(data, name, "PATH_FILE", ("x", "y", "x_m", "y_m"))
    if not table.rows:
        raise FileError(
            "PATH_FILE", "no row of numbers", where=name, allowed="columns x_m,y_m or x,y, a row a point"
        )
    _few_enough(len(table.rows), f"{name}:{table.rows[-1][0]}")
    metric = {"x_m", "y_m"} <= set(table.columns)
    if table.columns:
        # Our own tables have both: those in metres are for everyone, those in cells are the plan's.
        metric = metric and not (units == "cells" and {"x", "y"} <= set(table.columns))
        columns = table.find("x_m", "y_m") if metric else table.find("x", "y")
    else:
        columns = (0, 1)
    frame = "metres" if metric else (units or "metres")
    points = [[table.number(line, row, k) for k in columns] for line, row in table.rows]
    return PathPoints(np.array(points), frame, table.columns, where=name)


def _few_enough(n: int, where: str) -> None:
    if n > MAX_POINTS:
        raise LimitError("LIMIT", f"{n:,} points", where=where, allowed=f"at most {MAX_POINTS:,}")


def _from_document(document: JsonDocument | YamlDocument) -> PathPoints:
    """A ROS path, alone or as rosbridge wraps it; or a plan of ours."""
    data = document.data
    key_path: tuple[str | int, ...] = ()
    if isinstance(data.get("msg"), dict) and "poses" not in data:
        data, key_path = data["msg"], ("msg",)
    if isinstance(data.get("poses"), list):
        return _from_poses(document, data, key_path)
    if "cells" in data and "planner" in data:
        return _from_plan(document, data)
    keys = ", ".join(shown(key) for key in list(document.data)[:5])
    what = f"an object with {keys}" if keys else "an empty object"
    allowed = "a nav_msgs/Path (`poses`), or what `lampyris plan --json` prints (`cells`)"
    raise FileError("PATH_FILE", what, where=document.at(), allowed=allowed)


def _from_poses(
    document: JsonDocument | YamlDocument, data: dict[str, Any], key_path: tuple[str | int, ...]
) -> PathPoints:
    key_path = (*key_path, "poses")
    _few_enough(len(data["poses"]), document.at(*key_path))
    points = []
    for k, stamped in enumerate(data["poses"]):
        # A PoseStamped; a PoseArray of the same name has the pose itself.
        pose, place = stamped, (*key_path, k)
        for step in ("pose", "position"):
            if step == "pose" and isinstance(pose, dict) and "position" in pose:
                continue
            if not isinstance(pose, dict) or not isinstance(pose.get(step), dict):
                raise FileError(
                    "PATH_FILE", f"pose {k} has no {step}", where=document.at(*place), allowed="pose.position"
                )
            pose, place = pose[step], (*place, step)
        points.append([_number(document, pose.get(axis), (*place, axis)) for axis in "xy"])
    if not points:
        raise FileError(
            "PATH_FILE", "a path without poses", where=document.at(*key_path), allowed="at least one"
        )
    header = data.get("header")
    frame = header.get("frame_id") if isinstance(header, dict) else None
    notes: tuple[str, ...] = ()
    if isinstance(frame, str) and frame not in ("", "map"):
        notes = (f"the path is in the frame {shown(frame)}; its numbers are taken for the map's",)
    return PathPoints(np.array(points), "metres", notes=notes, where=document.where)


def _from_plan(document: JsonDocument | YamlDocument, data: dict[str, Any]) -> PathPoints:
    cells = data["cells"]
    if not isinstance(cells, list) or not cells:
        what = "a plan that found no path" if not cells else f"{shown(cells)}"
        raise FileError("PATH_FILE", what, where=document.at("cells"), allowed="a list of cells [x, y]")
    _few_enough(len(cells), document.at("cells"))
    points = []
    for k, cell in enumerate(cells):
        if not isinstance(cell, list) or len(cell) != 2:
            raise FileError(
                "PATH_FILE", f"{shown(cell)}", where=document.at("cells", k), allowed="a cell [x, y]"
            )
        points.append([_number(document, cell[i], ("cells", k, i)) for i in (0, 1)])
    return PathPoints(np.array(points), "cells", map=_map_of(data.get("map")), where=document.where)


def _map_of(record: Any) -> tuple[int, int, float, tuple[float, ...]] | None:
    """Shape and place of the map a plan is of, where it tells them as we write them."""
    if not isinstance(record, dict):
        return None
    size = [record.get(key) for key in ("width", "height", "resolution")]
    origin = record.get("origin")
    numbers = [*size, *(origin if isinstance(origin, list) else ())]
    if len(numbers) != 6 or not all(isinstance(v, int | float) and not isinstance(v, bool) for v in numbers):
        return None
    width, height, resolution, *pose = numbers
    return width, height, float(resolution), tuple(map(float, pose))


def _number(document: JsonDocument | YamlDocument, value: Any, key_path: tuple[str | int, ...]) -> float:
    real = isinstance(value, int | float) and not isinstance(value, bool)
    if not real or not math.isfinite(value) or abs(value) > GREATEST:
        what = f"{key_path[-1]} is {shown(value)}" if value is not None else f"{key_path[-1]} is missing"
        allowed = f"a number from -{GREATEST:g} to {GREATEST:g}"
        raise FileError("PATH_FILE", what, where=document.at(*key_path), allowed=allowed)
    return float(value)
