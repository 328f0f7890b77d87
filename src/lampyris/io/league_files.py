"""Problems of the League of Robot Runners: a map, starts of robots, and a list of tasks.

https://github.com/MAPF-Competition/Start-Kit, "Input_Output_Format". A problem is a JSON file that names three others,
relative to its own folder: ``mapFile`` (a MovingAI ``.map``, in which ``E`` and ``S`` are free cells, too), ``agentFile`` and
``taskFile``. These two begin with a count; then each line has the start of a robot, or the locations of a task in order, apart
by commas. A location is ``row * width + column``. Lines that begin with ``#`` are comments.

The League's robots turn in place, which takes ticks, and get new tasks as they finish. As a :class:`lampyris.Fleet` a
problem is one question without turning: robot k goes to the first location of task k.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lampyris._core.scalars import is_whole
from lampyris.errors import FileError, LampyrisError, LimitError, SceneError, plural
from lampyris.io.files import read_regular, write_file
from lampyris.io.maps.save import save_map
from lampyris.io.text.strict_json import JsonDocument
from lampyris.io.text.strict_yaml import shown
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.grid import Grid
from lampyris.typing import Cell

MAX_BYTES = 2**25
"""Of a list of agents or tasks."""
MAX_LINES = 1_000_000
_LINE = re.compile(rb"[0-9]{1,9}(?:[ \t]*,[ \t]*[0-9]{1,9})*,?")
_KEYS = ("mapFile", "agentFile", "taskFile", "teamSize")


@dataclass(frozen=True, slots=True)
class LeagueProblem:
    """A problem as its files have it.

    Parameters
    ----------
    starts : of the robots, cells (x, y).
    tasks : the locations of each task, in order.
    reveal : how many tasks are known at a time, as a multiple of the robots.
    where : the place of each start and of each task, for messages.
    """

    starts: tuple[Cell, ...]
    tasks: tuple[tuple[Cell, ...], ...]
    reveal: float = 1.0
    where: tuple[tuple[str, ...], tuple[str, ...]] = ((), ())

    def fleet(self, grid: Grid, robots: int | None = None) -> Fleet:
        """The first robots as one question: robot k goes to the first location of task k.

        Raises
        ------
        FileError : LEAGUE: fewer robots or tasks than asked for; FLEET: two robots with one start or goal; with file and line.
        SceneError : a start or a goal on a blocked cell, with the same.
        """
        count = len(self.starts) if robots is None else robots
        for what, there in (("robot", len(self.starts)), ("task", len(self.tasks))):
            if there < count:
                raise FileError(
                    "LEAGUE", f"{plural(there, what)} for {plural(count, 'robot')}",
                    where=(self.where[what == "task"] or ("",))[-1], todo=f"ask for at most {plural(there, 'robot')}",
                )  # fmt: skip
        agents = [Agent(self.starts[k], self.tasks[k][0]) for k in range(count)]
        try:
            return Fleet(grid, agents)
        except LampyrisError as fault:
            index, _, end = fault.where.removeprefix("robots[").partition("]")
            if not index.isdigit() or not self.where[0]:
                raise
            is_goal = end.startswith(".goal")
            kind = SceneError if isinstance(fault, SceneError) else FileError
            place = self.where[is_goal][int(index)]
            raise kind(
                fault.code, f"robot {index}: {fault.what}", where=place, allowed=fault.allowed
            ) from None


def is_league(data: dict[str, Any]) -> bool:
    """Whether a JSON object is a problem of the League, rightly or wrongly written."""
    return "agentFile" in data or "taskFile" in data


def league_map(path: str | os.PathLike[str], document: JsonDocument) -> Path:
    """The map that a problem names.

    Raises
    ------
    FileError : LEAGUE.
    """
    return _beside(Path(path), document, "mapFile")


def read_league(path: str | os.PathLike[str], document: JsonDocument, grid: Grid) -> LeagueProblem:
    """A problem from its JSON file.

    Parameters
    ----------
    path : of the file; the others are relative to its folder.
    document : what is in it.
    grid : its map.

    Raises
    ------
    FileError : LEAGUE: a key is missing or no text, a list is none or shorter than it says, a location is beyond the map;
        what reading the files says. With line.
    LimitError : FILE_TOO_LARGE; LEAGUE_LINES.
    """
    data = document.data
    for key in _KEYS:
        if key not in data:
            raise FileError("LEAGUE", f"no {key}", where=document.at(), allowed=", ".join(_KEYS))
    size = data["teamSize"]
    if not is_whole(size, 1):
        raise FileError(
            "LEAGUE",
            f"teamSize is {shown(size)}",
            where=document.at("teamSize"),
            allowed="a whole number >= 1",
        )
    reveal = data.get("numTasksReveal", 1)
    if isinstance(reveal, bool) or not isinstance(reveal, int | float) or not 0 < reveal <= 1e6:
        raise FileError(
            "LEAGUE", f"numTasksReveal is {shown(reveal)}", where=document.at("numTasksReveal"),
            allowed="a number > 0, at most 1e6",
        )  # fmt: skip
    agents, at = _locations(_beside(Path(path), document, "agentFile"), grid, single=True)
    if size > len(agents):
        what = f"teamSize is {size}, but {plural(len(agents), 'robot')} are in agentFile"
        raise FileError("LEAGUE", what, where=document.at("teamSize"), allowed=f"at most {len(agents)}")
    tasks, task_at = _locations(_beside(Path(path), document, "taskFile"), grid, single=False)
    starts = tuple(one[0] for one in agents[:size])
    return LeagueProblem(starts, tuple(tasks), float(reveal), (tuple(at[:size]), tuple(task_at)))


def _beside(path: Path, document: JsonDocument, key: str) -> Path:
    name = document.data.get(key)
    if not isinstance(name, str) or not name or "\0" in name or Path(name).is_absolute():
        raise FileError(
            "LEAGUE", f"{key} is {shown(name)}", where=document.at(key) if key in document.data else document.at(),
            allowed="the name of a file, relative to this one",
        )  # fmt: skip
    return path.parent / name


def _locations(path: Path, grid: Grid, *, single: bool) -> tuple[list[tuple[Cell, ...]], list[str]]:
    """The rows of a list of agents or tasks, and where each stands."""
    name = os.fspath(path)
    data = read_regular(name, MAX_BYTES)
    if data.count(b"\n") > MAX_LINES:
        raise LimitError("LEAGUE_LINES", "too many lines", where=name, allowed=f"at most {MAX_LINES:,}")
    lines = data.removeprefix(b"\xef\xbb\xbf").split(b"\n")
    rows: list[tuple[Cell, ...]] = []
    places: list[str] = []
    count: int | None = None
    cells = grid.width * grid.height
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if not text or text.startswith(b"#"):
            continue
        if count is not None and len(rows) == count:
            break
        where = f"{name}: line {number}"
        if _LINE.fullmatch(text) is None:
            allowed = "whole numbers apart by commas" if count is not None else "how many lines follow"
            raise FileError(
                "LEAGUE", shown(text[:40].decode("ascii", "replace")), where=where, allowed=allowed
            )
        values = [int(word) for word in text.rstrip(b",").split(b",")]
        if count is None:
            count = values[0]
            if count == 0:
                raise FileError("LEAGUE", "no line", where=where, allowed="one or more")
            continue
        if single:
            values = values[:1]
        for value in values:
            if value >= cells:
                allowed = f"0 to {cells - 1}: row * {grid.width} + column"
                raise FileError("LEAGUE", f"location {value}", where=where, allowed=allowed)
        rows.append(tuple((value % grid.width, value // grid.width) for value in values))
        places.append(where)
    if count is None or len(rows) < count:
        what = "no count" if count is None else f"{plural(len(rows), 'line')} of {count}"
        raise FileError("LEAGUE", what, where=name, allowed="a count, and so many lines")
    return rows, places


def write_league(path: str | os.PathLike[str], grid: Grid, problem: LeagueProblem) -> tuple[Path, ...]:
    """Write a problem: PATH, and beside it files of the same name that end in ``.map``, ``.agents`` and ``.tasks``.

    Parameters
    ----------
    path : of the JSON file.
    grid : the map.
    problem : of this map.

    Returns
    -------
    The files that were written. Files that exist are overwritten.

    Raises
    ------
    FileError : FILE_WRITE.
    """
    files = league_paths(path)

    def listed(rows: Sequence[Sequence[Cell]]) -> bytes:
        lines = (",".join(str(y * grid.width + x) for x, y in row) for row in rows)
        return ("\n".join((str(len(rows)), *lines)) + "\n").encode()

    names = [one.name for one in files]
    record = dict(zip(("mapFile", "agentFile", "taskFile"), names[1:], strict=True)) | {
        "teamSize": len(problem.starts),
        "numTasksReveal": problem.reveal,
    }
    save_map(grid, files[1])
    write_file(files[2], listed([(start,) for start in problem.starts]))
    write_file(files[3], listed(problem.tasks))
    write_file(files[0], (json.dumps(record, indent=2) + "\n").encode())
    return files


def league_paths(path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """The files of :func:`write_league`."""
    one = Path(path)
    return one, *(one.with_suffix(suffix) for suffix in (".map", ".agents", ".tasks"))
