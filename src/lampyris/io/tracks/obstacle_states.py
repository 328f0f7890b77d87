"""Moving obstacles as they are seen now, from a table: where each is, how large and how fast it may be."""

from __future__ import annotations

import os

import numpy as np

from lampyris._core import elementary
from lampyris.errors import FileError, LimitError
from lampyris.io.text.csv_table import read_table
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.traffic import MAX_OBSTACLES
from lampyris.typing import Points


def read_obstacle_states(path: str | os.PathLike[str], grid: Grid) -> ObstacleStates:
    """Read discs in continuous time: a table with a row for each.

    Columns ``x_m``, ``y_m`` (metres of the map frame), ``radius`` (metres), ``top_speed`` (m/s), and perhaps
    ``vx``, ``vy`` (m/s, map frame: y up); other columns are passed over. A header without a row says that
    there is nothing.

    Parameters
    ----------
    path : the file.
    grid : the map, for its frame.

    Raises
    ------
    FileError : FILE_MISSING, FILE_KIND; OBSTACLE_STATES_FILE: a column that is missing, a number out of its range,
        with line and value.
    LimitError : FILE_TOO_LARGE, LIMIT: more than 10,000.
    """
    names = ("x_m", "y_m", "radius", "top_speed")
    table = read_table(path, "OBSTACLE_STATES_FILE", names)
    if not table.columns:
        allowed = f"a first line with the columns {', '.join(names)}"
        raise FileError("OBSTACLE_STATES_FILE", "no header", where=table.where, allowed=allowed)
    if len(table.rows) > MAX_OBSTACLES:
        what = f"{len(table.rows):,} obstacles"
        raise LimitError("LIMIT", what, where=table.where, allowed=f"at most {MAX_OBSTACLES:,}")
    x, y, radius, top = table.find(*names)
    velocity = table.find("vx", "vy") if {"vx", "vy"} & set(table.columns) else ()
    places = [[table.number(line, row, k) for k in (x, y)] for line, row in table.rows]
    sizes = [[table.number(line, row, k, 0.0) for k in (radius, top)] for line, row in table.rows]
    velocities = [[table.number(line, row, k) for k in velocity] for line, row in table.rows]
    for (line, _), (_, speed), (vx, vy) in (
        zip(table.rows, sizes, velocities, strict=True) if velocity else ()
    ):
        fast = float(elementary.hypot(vx, vy))
        if fast > speed * (1 + 1e-9):
            what = f"a velocity of {fast:g} m/s"
            allowed = f"at most the top speed, {speed:g}"
            raise FileError("OBSTACLE_STATES_FILE", what, where=f"{table.where}:{line}", allowed=allowed)
    xy, size = (np.array(rows, dtype=np.float64).reshape(-1, 2) for rows in (places, sizes))
    v = _on_the_grid(np.array(velocities).reshape(-1, 2), grid) if velocity else None
    return ObstacleStates(grid.to_points(xy[:, 0], xy[:, 1]), size[:, 0], size[:, 1], v)


def _on_the_grid(v: Points, grid: Grid) -> Points:
    """Velocities of the map frame along the grid's own axes, y down."""
    cos, sin = elementary.direction(grid.origin[2])
    return np.stack((cos * v[:, 0] + sin * v[:, 1], sin * v[:, 0] - cos * v[:, 1]), axis=-1)
