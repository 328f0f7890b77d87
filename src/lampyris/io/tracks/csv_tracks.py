"""Recorded tracks of moving obstacles, from CSV files."""

from __future__ import annotations

import csv
import math
import os
import re
from collections.abc import Iterator

from lampyris.errors import FileError, LimitError
from lampyris.io.files import read_regular
from lampyris.io.text.csv_table import MAX_BYTES, lines
from lampyris.typing import Cell

MAX_TICKS = 100_000
ALLOWED = "columns x and y, a row a tick; or t,x_m,y_m[,radius_m] in seconds and metres"
_NUMBER = re.compile(r"\s*[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]{1,4})?\s*", re.ASCII)
_WHOLE = re.compile(r"\s*[-+]?[0-9]{1,10}\s*", re.ASCII)


def read_track(path: str | os.PathLike[str]) -> tuple[Cell, ...]:
    """A recorded track: a CSV with columns ``x`` and ``y``, cells from the top left, one row a tick.

    Other columns are passed over, so that the CSV of a simulation or a plan is a track as well. Only ``tick``
    counts where it is there: it starts at 0 and rises from row to row, and between two rows the obstacle
    stays where it was. A byte order mark and CRLF are accepted.

    Raises
    ------
    FileError : FILE_MISSING, FILE_KIND; TRACK, with line and value: no such columns, not whole numbers;
        OBSTACLE_TIME: no row at all, or ticks that do not rise from 0.
    LimitError : FILE_TOO_LARGE, more than 16 MiB; LIMIT, more than 100,000 ticks or 200,000 lines, or a line
        of more than 64 KiB.
    """
    return _read(path, headed=False)[0]


def read_headed_track(path: str | os.PathLike[str]) -> tuple[tuple[Cell, ...], tuple[float, ...]]:
    """As :func:`read_track`, with the headings of a column ``yaw``.

    Returns
    -------
    Cells, and the heading in each, radians counterclockwise in the map frame; none without that column.

    Raises
    ------
    FileError : as there, and TRACK: a yaw that is no finite number.
    """
    return _read(path, headed=True)


def _read(path: str | os.PathLike[str], *, headed: bool) -> tuple[tuple[Cell, ...], tuple[float, ...]]:
    name = os.fspath(path)
    data = read_regular(name, MAX_BYTES)
    if not data.strip():
        raise FileError("TRACK", "empty file", where=name, allowed=ALLOWED)
    rows = _rows(data, name)
    _, header = next(rows, (1, []))
    columns = [word.strip() for word in header]
    for need in ("x", "y"):
        if columns.count(need) != 1:
            what = f"{'no' if need not in columns else 'more than one'} column {need}"
            raise FileError("TRACK", what, where=f"{name}:1", allowed=ALLOWED)
    wanted = [columns.index("x"), columns.index("y")]
    if "tick" in columns:
        wanted.append(columns.index("tick"))
    turned = columns.index("yaw") if headed and columns.count("yaw") == 1 else None
    cells: list[Cell] = []
    yaws: list[float] = []
    for line, row in rows:
        if not any(word.strip() for word in row):
            continue
        x, y, *tick = (_whole(row, k, columns[k], f"{name}:{line}") for k in wanted)
        if tick:
            if tick[0] < len(cells) or (tick[0] and not cells):
                least = f"at least {len(cells)}" if cells else "0 in the first row"
                raise FileError(
                    "OBSTACLE_TIME", f"tick {tick[0]}", where=f"{name}:{line}", allowed=f"{least}: ticks rise"
                )
            cells += cells[-1:] * min(tick[0] - len(cells), MAX_TICKS)
            yaws += yaws[-1:] * (len(cells) - len(yaws))
        cells.append((x, y))
        if turned is not None:
            yaws.append(_angle(row, turned, f"{name}:{line}"))
        if len(cells) > MAX_TICKS:
            raise LimitError(
                "LIMIT", "a longer track", where=f"{name}:{line}", allowed=f"{MAX_TICKS:,} ticks"
            )
    if not cells:
        raise FileError("OBSTACLE_TIME", "empty track", where=name, allowed="at least one row")
    return tuple(cells), tuple(yaws)


def _rows(data: bytes, name: str) -> Iterator[tuple[int, list[str]]]:
    """Line numbers and fields."""
    reader = csv.reader((text for _, text in lines(data, name, "TRACK")), strict=True)
    try:
        for row in reader:
            yield reader.line_num, row
    except csv.Error as problem:
        raise FileError("TRACK", f"{problem}", where=f"{name}:{reader.line_num}", allowed="CSV") from None


def _whole(row: list[str], k: int, column: str, where: str) -> int:
    text = row[k] if k < len(row) else ""
    if _WHOLE.fullmatch(text) is None:
        raise FileError("TRACK", f"{column} is {text[:40]!r}", where=where, allowed="a whole number")
    return int(text)


def _angle(row: list[str], k: int, where: str) -> float:
    text = row[k] if k < len(row) else ""
    if _NUMBER.fullmatch(text) is None or not math.isfinite(float(text)):
        raise FileError("TRACK", f"yaw is {text[:40]!r}", where=where, allowed="a finite number: radians")
    return float(text)
