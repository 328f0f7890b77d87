"""Tracks of moving obstacles in seconds and metres, from CSV files and to them."""

from __future__ import annotations

import math
import os
from bisect import bisect_right
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from lampyris.errors import FileError, SettingError, plural
from lampyris.io.files import read_regular, write_file
from lampyris.io.text.csv_table import MAX_BYTES, CsvTable, table_of
from lampyris.io.tracks.csv_tracks import MAX_TICKS, read_track
from lampyris.model.grid import Grid
from lampyris.model.robot import Polygon
from lampyris.model.traffic import Recorded
from lampyris.typing import Floats, Points

COLUMNS = ("t", "x_m", "y_m", "radius_m")
_FASTER = 1.0 + 1e-9
"""An obstacle that needs exactly a tick for a cell must not need more by rounding."""


@dataclass(frozen=True, slots=True)
class TimedTrack:
    """Where one obstacle is over time; straight and uniform between two points, at rest before the first and after the last.

    Parameters
    ----------
    t : float64 (n,), seconds from 0 on, strictly rising; n >= 1.
    xy : float64 (n, 2), metres of the map frame.
    radius : metres; None: the file does not say.
    """

    t: Floats
    xy: Points
    radius: float | None = None

    @property
    def top_speed(self) -> float:
        """The maximum speed along one axis of the map frame, m/s: a step to a neighbouring cell takes no longer."""
        if len(self.t) < 2:
            return 0.0
        return float((np.abs(np.diff(self.xy, axis=0)).max(axis=1) / np.diff(self.t)).max())


def read_timed_track(path: str | os.PathLike[str]) -> TimedTrack:
    """Read a table with columns ``t`` (or ``t_s``), ``x_m``, ``y_m`` and perhaps ``radius_m``.

    Other columns are passed over, so that the CSV of a drive is a track as well. The radius is the greatest in its
    column.

    Raises
    ------
    FileError : FILE_MISSING, FILE_KIND; TRACK, with line and value: a column that is missing, what is no number;
        OBSTACLE_TIME: no row, a time below 0, times that do not rise.
    LimitError : FILE_TOO_LARGE, LIMIT.
    """
    name = os.fspath(path)
    return _timed(table_of(read_regular(name, MAX_BYTES), name, "TRACK", COLUMNS), name)


def _timed(table: CsvTable, name: str) -> TimedTrack:
    time = "t" if "t" in table.columns or "t_s" not in table.columns else "t_s"
    columns = table.find(time, "x_m", "y_m")
    wide = table.find("radius_m")[0] if "radius_m" in table.columns else None
    if not table.rows:
        raise FileError("OBSTACLE_TIME", "empty track", where=name, allowed="at least one row")
    rows: list[list[float]] = []
    radius = None
    for line, row in table.rows:
        numbers = [table.number(line, row, k) for k in columns]
        least = rows[-1][0] if rows else 0.0
        if numbers[0] < least or (rows and numbers[0] == least):
            allowed = f"more than {least:g} s: times rise" if rows else "0 or more"
            raise FileError("OBSTACLE_TIME", f"t = {numbers[0]:g} s", where=f"{name}:{line}", allowed=allowed)
        rows.append(numbers)
        if wide is not None:
            radius = max(radius or 0.0, table.number(line, row, wide, 0.0))
    array = np.array(rows)
    return TimedTrack(array[:, 0].copy(), array[:, 1:].copy(), radius)


def write_timed_track(path: str | os.PathLike[str], track: TimedTrack) -> None:
    """Write a track; all digits of every number, so that reading it gives the same track.

    Raises
    ------
    FileError : FILE_WRITE.
    """
    names = COLUMNS if track.radius is not None else COLUMNS[:3]
    lines = [",".join(names)]
    for t, (x, y) in zip(track.t.tolist(), track.xy.tolist(), strict=True):
        row = [t, x, y] if track.radius is None else [t, x, y, track.radius]
        lines.append(",".join(map(repr, row)))
    write_file(path, ("\n".join(lines) + "\n").encode())


def read_any_track(
    path: str | os.PathLike[str],
    grid: Grid,
    tick_s: float,
    *,
    radius: float = 0.0,
    footprint: Polygon | None = None,
    faster: str = "",
) -> Recorded:
    """A recorded obstacle from a track in cells and ticks, or in metres and seconds.

    A file is of the second kind if it has a column ``t`` or ``t_s``, ``x_m`` and ``y_m``, and no columns ``x``, ``y``. Its
    obstacle is then, at each tick, in the cell that holds its interpolated place.

    Parameters
    ----------
    path : the file.
    grid : whose cells.
    tick_s : seconds from one tick to the next.
    radius : metres; 0: what the file says.
    footprint : its outline; None: a disc.
    faster : what to do about an obstacle that drives farther than a cell in a tick, for the message.

    Raises
    ------
    FileError, LimitError : as :func:`read_timed_track` and :func:`lampyris.io.tracks.csv_tracks.read_track`.
    SettingError : OBSTACLE_SPEED: it drives farther than to a neighbouring cell in one tick; OBSTACLE_TIME: more than
        100,000 ticks.
    """
    found = timed_track(path)
    if found is None:
        return Recorded(read_track(path), radius, footprint)
    return recorded_from(
        found, grid, tick_s, name=os.fspath(path), radius=radius, footprint=footprint, faster=faster
    )


def timed_track(path: str | os.PathLike[str]) -> TimedTrack | None:
    """The track of a file in metres and seconds; None: the file has cells and ticks, or neither.

    Raises
    ------
    As :func:`read_timed_track`.
    """
    name = os.fspath(path)
    data = read_regular(name, MAX_BYTES)
    header = data.removeprefix(b"\xef\xbb\xbf").lstrip()[:4096].split(b"\n", 1)[0]
    columns = {word.strip() for word in header.decode("utf-8", "replace").split(",")}
    if not {"x_m", "y_m"} <= columns or {"x", "y"} <= columns:
        return None
    return _timed(table_of(data, name, "TRACK", COLUMNS), name)


def recorded_from(
    track: TimedTrack,
    grid: Grid,
    tick_s: float,
    *,
    name: str = "track",
    radius: float = 0.0,
    footprint: Polygon | None = None,
    faster: str = "",
) -> Recorded:
    """A track in metres and seconds as a recorded obstacle; see :func:`read_any_track`.

    Raises
    ------
    SettingError : OBSTACLE_SPEED, OBSTACLE_TIME.
    """
    times, points = track.t.tolist(), track.xy.tolist()
    ticks = math.ceil(times[-1] / tick_s * (1.0 - 1e-12))
    if ticks > MAX_TICKS:
        raise SettingError(
            "OBSTACLE_TIME", f"a track of {times[-1]:g} s, {ticks:,} ticks", where=name,
            allowed=f"at most {MAX_TICKS:,} ticks", todo="let its times begin at 0",
        )  # fmt: skip
    cells = [grid.to_cell(*_at(times, points, k * tick_s * _FASTER)) for k in range(ticks + 1)]
    for k, (a, b) in enumerate(pairwise(cells)):
        if max(abs(a[0] - b[0]), abs(a[1] - b[1])) > 1:
            raise SettingError(
                "OBSTACLE_SPEED",
                f"the obstacle drives from {a} to {b} in one tick of {tick_s:.4g} s, t = {k * tick_s:.4g} s",
                where=name, allowed=f"one cell a tick, {plural(1, 'cell')} is {grid.resolution:g} m", todo=faster,
            )  # fmt: skip
    return Recorded(tuple(cells), radius or track.radius or 0.0, footprint)


def _at(times: list[float], points: list[list[float]], t: float) -> tuple[float, float]:
    k = bisect_right(times, t)
    if k == 0 or k == len(times):
        x, y = points[0 if k == 0 else -1]
        return x, y
    (x0, y0), (x1, y1) = points[k - 1], points[k]
    share = (t - times[k - 1]) / (times[k] - times[k - 1])
    return x0 + share * (x1 - x0), y0 + share * (y1 - y0)
