"""Fleets from files: MovingAI ``.scen`` files and lists of agents.

R. Stern et al., "Multi-agent pathfinding: definitions, variants, and benchmarks", SoCS 2019: an instance with n robots is
the first n lines of a ``.scen``. The last column of a line is an octile length and is not used.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from lampyris._core.scalars import in_range
from lampyris.errors import FileError, LampyrisError, SceneError, plural
from lampyris.io.files import read_regular
from lampyris.io.league_files import is_league, league_map, read_league
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.formats.movingai import check_query, read_scen
from lampyris.io.text.csv_table import GREATEST, table_of
from lampyris.io.text.strict_json import MAX_BYTES, JsonDocument, read_json
from lampyris.io.text.strict_yaml import YamlDocument, read_yaml, shown
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.fleet.lifelong import FleetTask
from lampyris.model.grid import Grid
from lampyris.model.robot import GREATEST as GREATEST_RADIUS
from lampyris.model.robot import Robot
from lampyris.typing import Cell

YAML_BYTES = 2**20
YAML_VALUES = 40_000
"""Some 5,000 robots, read in 2 s; more are quicker in JSON or CSV."""
_CELLS = ("start_x", "start_y", "goal_x", "goal_y")
_METRES = ("start_x_m", "start_y_m", "goal_x_m", "goal_y_m")
_RADIUS = "radius"
_ALLOWED = (
    "agents: a list of {start: [x, y], goal: [x, y]} (cells) or {start_m: ..., goal_m: ...} (metres), each with a radius "
    "(metres) if you like"
)


@dataclass(frozen=True, slots=True)
class FleetFile:
    """A fleet as its file has it.

    Parameters
    ----------
    fleet : the robots on the map.
    notes : notes for the user.
    tasks : those of a problem of the League of Robot Runners, for lifelong fleets; None: the file knows no tasks.
    """

    fleet: Fleet
    notes: tuple[str, ...] = ()
    tasks: tuple[FleetTask, ...] | None = None


def read_scen_fleet(
    path: str | os.PathLike[str], document: MapDocument, robots: int | None = None
) -> FleetFile:
    """The first robots of a MovingAI ``.scen``.

    Parameters
    ----------
    path : the file.
    document : the map; it must have the size that the lines say. Another name is noted.
    robots : how many lines; None: all.

    Raises
    ------
    FileError : what :func:`lampyris.io.maps.formats.movingai.read_scen` says; SCEN_SIZE: a map of another size;
        SCEN_LINES: fewer lines than robots; FLEET: two robots with one start or one goal. With the line.
    SceneError : START_OCCUPIED or GOAL_OCCUPIED, with the line.
    """
    name = os.fspath(path)
    queries = read_scen(name)
    _demand(len(queries), robots, name, "SCEN_LINES", "line")
    queries = queries[:robots]
    own = document.grid.name
    others = dict.fromkeys(q.map for q in queries if Path(q.map.replace("\\", "/")).name != own)
    agents: list[_Placed] = []
    for query in queries:
        query = replace(query, map=own)
        check_query(query, document, name)
        agents.append((partial(str, f"{name}: line {query.line}"), query.start, query.goal, None))
    notes = tuple(f"the lines name {other}; {own or 'another map'} was given" for other in others)
    return FleetFile(_fleet(document.grid, agents), notes)


def read_agents(
    path: str | os.PathLike[str], grid: Grid, robots: int | None = None, *, lifelong: bool = False
) -> FleetFile:
    """The first robots of a list of agents.

    YAML and JSON have a list ``agents`` of mappings with ``start`` and ``goal``, cells [x, y] from the top left, or
    ``start_m`` and ``goal_m``, metres of the map frame, and perhaps ``radius``, metres. A table (CSV) has the columns
    ``start_x``, ``start_y``, ``goal_x``, ``goal_y`` in cells, or the same with ``_m`` in metres, a row a robot, and
    perhaps ``radius``.

    Parameters
    ----------
    path : the file. ``.json`` is JSON, ``.yaml`` and ``.yml`` are YAML, all else is a table, unless it begins like a
        JSON object. A JSON object with ``agentFile`` is a problem of the League of Robot Runners
        (:mod:`lampyris.io.league_files`) of this map.
    grid : the map.
    robots : how many; None: all.
    lifelong : whether the fleet is lifelong: of a League problem the tasks are then used, and no note says that
        they are not.

    Raises
    ------
    FileError : AGENTS: not such a file, or fewer robots in it; FLEET: two robots with one start or one goal; what the
        readers of JSON, YAML and tables say. With line and column, or the line.
    SceneError : an end outside the map or blocked, with the same.
    LimitError : FILE_TOO_LARGE, LIMIT, JSON_SIZE, YAML_SIZE.
    """
    name = os.fspath(path)
    data = read_regular(name, MAX_BYTES)
    suffix = Path(name).suffix.lower()
    if suffix in (".yaml", ".yml"):
        agents = _listed(read_yaml(data, name, max_bytes=YAML_BYTES, max_values=YAML_VALUES), grid)
    elif suffix == ".json" or data.removeprefix(b"\xef\xbb\xbf").lstrip()[:1] == b"{":
        document = read_json(data, name)
        if is_league(document.data):
            return _league(name, document, grid, robots, lifelong)
        agents = _listed(document, grid)
    else:
        agents = _tabled(data, name, grid)
    _demand(len(agents), robots, name, "AGENTS", "agent")
    return FleetFile(_fleet(grid, agents[:robots]))


def _league(name: str, document: JsonDocument, grid: Grid, robots: int | None, lifelong: bool) -> FleetFile:
    problem = read_league(name, document, grid)
    fleet = problem.fleet(grid, robots)
    notes = []
    own, named = grid.name, league_map(name, document).name
    if named != own:
        notes.append(f"{name} names the map {named}; {own or 'another map'} was given")
    left = len(problem.tasks) - len(fleet.robots)
    if not lifelong and (left or any(len(task) > 1 for task in problem.tasks)):
        notes.append(
            "each robot goes to the first location of one task; the others are not used, but by a lifelong fleet"
        )
    return FleetFile(fleet, tuple(notes), tuple(FleetTask(task) for task in problem.tasks))


_Placed = tuple[Callable[[], str], Cell, Cell, float | None]
"""Where an agent stands in its file (worked out when there is something to say of it), its start, its goal, its radius."""


def _demand(there: int, robots: int | None, name: str, code: str, what: str) -> None:
    if there == 0:
        raise FileError(code, f"there is no {what} in it", where=name, allowed="one or more")
    if robots is not None and there < robots:
        raise FileError(
            code, f"{plural(there, what)} for {plural(robots, 'robot')}", where=name,
            todo=f"ask for at most {plural(there, 'robot')}",
        )  # fmt: skip


def _fleet(grid: Grid, agents: Sequence[_Placed]) -> Fleet:
    """The fleet; its errors name the place in the file."""
    try:
        return Fleet(
            grid,
            [
                Agent(start, goal, None if radius is None else Robot(radius=radius))
                for _, start, goal, radius in agents
            ],
        )
    except LampyrisError as fault:
        index, _, end = fault.where.removeprefix("robots[").partition("]")
        if not index.isdigit():
            raise
        kind = SceneError if isinstance(fault, SceneError) else FileError
        what = f"robot {index}: {end.removeprefix('.')} {fault.what}"
        raise kind(fault.code, what, where=agents[int(index)][0](), allowed=fault.allowed) from None


def _radius(value: object, where: str) -> float:
    """A radius in metres.

    Raises
    ------
    FileError : AGENTS: it is none.
    """
    if not in_range(value, 0.0, GREATEST_RADIUS):
        allowed = f"0 to {GREATEST_RADIUS:g} metres"
        raise FileError("AGENTS", f"radius is {shown(value)}", where=where, allowed=allowed)
    return float(value)


def _listed(document: JsonDocument | YamlDocument, grid: Grid) -> list[_Placed]:
    data = document.data
    for key in data:
        if key != "agents":
            raise FileError("AGENTS", f"unknown key {shown(key)}", where=document.at(key), allowed=_ALLOWED)
    listed = data.get("agents")
    if not isinstance(listed, list):
        what = "no list agents" if listed is None else f"agents is {shown(listed)}"
        raise FileError("AGENTS", what, where=document.at(), allowed=_ALLOWED)
    found: list[_Placed] = []
    for k, one in enumerate(listed):
        if not isinstance(one, dict):
            raise FileError("AGENTS", shown(one), where=document.at("agents", k), allowed=_ALLOWED)
        for key in one:
            if key not in ("start", "goal", "start_m", "goal_m", _RADIUS):
                raise FileError(
                    "AGENTS",
                    f"unknown key {shown(key)}",
                    where=document.at("agents", k, key),
                    allowed=_ALLOWED,
                )
        ends = [_end(document, k, one, what, grid) for what in ("start", "goal")]
        radius = _radius(one[_RADIUS], document.at("agents", k, _RADIUS)) if _RADIUS in one else None
        found.append((partial(document.at, "agents", k), ends[0], ends[1], radius))
    return found


def _end(document: JsonDocument | YamlDocument, k: int, one: dict[str, Any], what: str, grid: Grid) -> Cell:
    keys = [key for key in (what, f"{what}_m") if key in one]
    if len(keys) != 1:
        twice = f"both {what} and {what}_m" if keys else f"no {what}"
        raise FileError(
            "AGENTS", twice, where=document.at("agents", k), allowed=f"one of {what} and {what}_m"
        )
    key, pair = keys[0], one[keys[0]]
    metric = key.endswith("_m")
    numbers = pair if isinstance(pair, list) and len(pair) == 2 else ()
    kind = (int, float) if metric else (int,)
    right = all(isinstance(v, kind) and not isinstance(v, bool) and abs(v) <= GREATEST for v in numbers)
    if not numbers or not right:
        allowed = "two numbers x, y: metres" if metric else "two whole numbers x, y: a cell"
        raise FileError(
            "AGENTS", f"{key} is {shown(pair)}", where=document.at("agents", k, key), allowed=allowed
        )
    x, y = numbers
    return grid.to_cell(float(x), float(y)) if metric else (int(x), int(y))


def _tabled(data: bytes, name: str, grid: Grid) -> list[_Placed]:
    table = table_of(data, name, "AGENTS", (*_CELLS, *_METRES, _RADIUS))
    metric = set(_METRES) <= set(table.columns)
    columns = table.find(*(_METRES if metric else _CELLS))
    sized = table.find(_RADIUS)[0] if _RADIUS in table.columns else None
    found: list[_Placed] = []
    for line, row in table.rows:
        numbers = [table.number(line, row, k) for k in columns]
        where = f"{name}:{line}"
        if not metric and any(v != math.floor(v) for v in numbers):
            what = f"{_CELLS[[v != math.floor(v) for v in numbers].index(True)]} is not whole"
            raise FileError("AGENTS", what, where=where, allowed="whole numbers: cells")
        ends = [
            grid.to_cell(numbers[k], numbers[k + 1]) if metric else (int(numbers[k]), int(numbers[k + 1]))
            for k in (0, 2)
        ]
        radius = None if sized is None else _radius(table.number(line, row, sized), where)
        found.append((partial(str, where), ends[0], ends[1], radius))
    return found
