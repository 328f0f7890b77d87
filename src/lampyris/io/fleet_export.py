"""Fleets and their plans as files that other programs of the field read.

``.scen``: the queries as a MovingAI scenario, with the octile length of each robot's own shortest path. ``.json``: a problem
of the League of Robot Runners, with three files beside it. ``.txt``: the plan as the log that LaCAM and its visualiser use,
``key=value`` lines, then ``solution=`` and the cells of all robots tick by tick.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from lampyris.errors import UsageError
from lampyris.io.files import write_file
from lampyris.io.league_files import LeagueProblem, league_paths, write_league
from lampyris.io.maps.formats.document import MapQuery
from lampyris.io.maps.formats.movingai import write_scen
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.typing import Cell

ENDINGS = (".scen", ".json", ".txt")


def export_paths(path: str | os.PathLike[str]) -> tuple[Path, ...]:
    """The files that an export writes.

    Raises
    ------
    UsageError : ``SUFFIX``.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in ENDINGS:
        raise UsageError("SUFFIX", f"{os.fspath(path)!r}", where="--export", allowed=", ".join(ENDINGS))
    return league_paths(path) if suffix == ".json" else (Path(path),)


def write_fleet(
    plan: FleetPlan, fleet: Fleet, path: str | os.PathLike[str], lengths: Sequence[tuple[int, int] | None]
) -> tuple[Path, ...]:
    """Write a fleet (``.scen``, ``.json``) or its plan (``.txt``); the files that were written.

    Parameters
    ----------
    plan, fleet : what is written.
    path : is overwritten.
    lengths : straight and diagonal steps of each robot's shortest octile path; None: there is none. For ``.scen``.

    Raises
    ------
    UsageError : ``SUFFIX``: another ending; ``EXPORT``: a log without paths.
    SettingError, FileError : see :func:`lampyris.io.maps.formats.movingai.write_scen`.
    """
    files = export_paths(path)
    suffix = files[0].suffix.lower()
    if suffix == ".json":
        tasks = tuple((goal,) for goal in fleet.goals)
        return write_league(path, fleet.grid, LeagueProblem(fleet.starts, tasks))
    if suffix == ".scen":
        queries = [
            MapQuery(one.start, one.goal, octile=pair)
            for one, pair in zip(fleet.robots, lengths, strict=True)
        ]
        write_scen(path, queries, map_name=fleet.grid.name or "map", grid=fleet.grid)
    else:
        if not plan.paths:
            raise UsageError("EXPORT", "there are no paths to write", where="--export")
        write_file(path, _log(plan, fleet).encode())
    return files


def _log(plan: FleetPlan, fleet: Fleet) -> str:
    def listed(cells: tuple[Cell, ...]) -> str:
        return "".join(f"({x},{y})," for x, y in cells)

    rows = [
        ("agents", len(fleet.robots)),
        ("map_file", fleet.grid.name or "map"),
        ("solver", plan.planner),
        ("solved", int(bool(plan))),
        ("soc", plan.sum_of_costs or 0),
        ("soc_lb", plan.lower_bound or 0),
        ("makespan", plan.makespan or 0),
        ("seed", plan.seed),
        ("starts", listed(fleet.starts)),
        ("goals", listed(fleet.goals)),
        ("solution", ""),
    ]
    last = max(len(path) for path in plan.paths)
    ticks = [f"{t}:" + listed(tuple((int(x), int(y)) for x, y in plan.at(t).tolist())) for t in range(last)]
    return "\n".join([f"{key}={value}" for key, value in rows] + ticks) + "\n"
