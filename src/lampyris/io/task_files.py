"""Tasks of a lifelong fleet from a table (CSV)."""

from __future__ import annotations

import os

from lampyris.errors import FileError
from lampyris.io.files import read_regular
from lampyris.io.text.csv_table import MAX_BYTES, table_of
from lampyris.model.fleet.lifelong import FleetTask
from lampyris.model.grid import Grid
from lampyris.typing import Cell

_ONE = ("release", "x", "y")
_TWO = ("release", "pickup_x", "pickup_y", "delivery_x", "delivery_y")


def read_tasks(path: str | os.PathLike[str], grid: Grid) -> tuple[FleetTask, ...]:
    """The tasks of a table, a row a task: ticks, and cells from the top left.

    Its columns are ``release``, ``x``, ``y``, or ``release``, ``pickup_x``, ``pickup_y``, ``delivery_x``, ``delivery_y``.

    Raises
    ------
    FileError : TASKS: not such a table, or a cell that is blocked or outside the map. With the line.
    LimitError : FILE_TOO_LARGE, LIMIT.
    """
    name = os.fspath(path)
    table = table_of(read_regular(name, MAX_BYTES), name, "TASKS", tuple(dict.fromkeys((*_ONE, *_TWO))))
    columns = table.find(*(_TWO if "pickup_x" in table.columns else _ONE))
    made = []
    for line, row in table.rows:
        numbers = [table.number(line, row, k, 0.0) for k in columns]
        where = f"{name}:{line}"
        if any(v % 1 for v in numbers):
            raise FileError(
                "TASKS", "a number that is not whole", where=where, allowed="whole ticks and cells"
            )
        release, *places = (int(v) for v in numbers)
        stops: list[Cell] = list(zip(places[::2], places[1::2], strict=True))
        for x, y in stops:
            if not grid.contains((x, y)) or grid.blocked[y, x]:
                state = "blocked" if grid.contains((x, y)) else "outside the map"
                raise FileError("TASKS", f"({x}, {y}) is {state}", where=where, allowed="free cells")
        made.append(FleetTask(stops, release))
    if not made:
        raise FileError("TASKS", "there is no task in it", where=name, allowed="one or more")
    return tuple(made)
