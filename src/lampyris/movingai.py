"""Scen: the queries of a MovingAI ``.scen`` asked of a planner, and its answers beside the published lengths.

N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE TCIAIG 4(2):144-148, 2012. Every way that counts
as found here has been re-checked by the referee.
"""

from __future__ import annotations

import math
import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from lampyris import referee
from lampyris._core import defaults
from lampyris._core.limits import MAX_CELLS
from lampyris._core.scalars import SEED_RANGE, is_whole
from lampyris.errors import FileError, SettingError, shown
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.formats.movingai import ScenQuery, check_query, grid_for, read_scen
from lampyris.io.maps.load import load_map
from lampyris.kernels import loading
from lampyris.model.moves import Moves, moves_named
from lampyris.model.plan import Status
from lampyris.model.scene import Scene
from lampyris.planning.selection import chosen_planner

RELATIVE = 1e-5
"""How far a published length may be off beside its last digit: some were summed up in single precision."""

UNREACHABLE = (Status.NO_PATH, Status.GOAL_OCCUPIED)
"""What is said of a goal without a path to it: for who starts in water, all land is blocked."""


@dataclass(frozen=True, slots=True, eq=False)
class Benchmark:
    """A map and the queries about it.

    Parameters
    ----------
    name : the ``.scen`` as the caller named it.
    document : the map.
    queries : in the order of the file.
    notes : notes for the user.
    """

    name: str
    document: MapDocument
    queries: tuple[ScenQuery, ...]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class QueryResult:
    """What became of one query.

    Parameters
    ----------
    query : the line of the file.
    status : how the search ended.
    cost : of the path found, in cells; infinity where there is none.
    expansions : cells expanded.
    agrees : whether it is as it must be beside the published length: see :class:`QueryResults`.
    """

    query: ScenQuery
    status: Status
    cost: float
    expansions: int
    agrees: bool

    @property
    def ratio(self) -> float | None:
        """Cost by published length; None where there is no path, or the length is 0."""
        if not self.status or self.query.length == 0:
            return None
        return self.cost / self.query.length


@dataclass(frozen=True, slots=True, eq=False)
class QueryResults:
    """All queries of a run, answered.

    Parameters
    ----------
    planner : its name.
    moves : the step set.
    rule : what agreeing means: ``equal`` to the published length, to the digits it was printed with (planners
        that are optimal); ``not shorter`` than it (others); or just ``found``, when the moves are not the
        octile ones that the lengths are of.
    answers : in the order of the file.
    timing : seconds: ``plan_s``, ``referee_s``, ``total_s``, and of that ``loading_s``, which the others
        leave out; the only part that differs from run to run.
    """

    planner: str
    moves: Moves
    rule: str
    answers: tuple[QueryResult, ...]
    timing: Mapping[str, float] = field(default_factory=dict)

    @property
    def disagreements(self) -> tuple[QueryResult, ...]:
        """The answers that are not as they must be."""
        return tuple(a for a in self.answers if not a.agrees)

    @property
    def summary(self) -> dict[str, Any]:
        """``queries solved disagree unreachable expansions``, and the mean and worst ratio (None: none)."""
        return summed(self.answers)

    @property
    def buckets(self) -> dict[int, dict[str, Any]]:
        """The same for each bucket of the file, ascending."""
        by: dict[int, list[QueryResult]] = {}
        for answer in self.answers:
            by.setdefault(answer.query.bucket, []).append(answer)
        return {bucket: summed(by[bucket]) for bucket in sorted(by)}


def summed(answers: Sequence[QueryResult]) -> dict[str, Any]:
    """Counts over some answers; see :attr:`QueryResults.summary`."""
    ratios = [r for r in (a.ratio for a in answers) if r is not None]
    return {
        "queries": len(answers),
        "solved": sum(bool(a.status) for a in answers),
        "disagree": sum(not a.agrees for a in answers),
        "unreachable": sum(a.status in UNREACHABLE for a in answers),
        "expansions": sum(a.expansions for a in answers),  # bits: whole numbers
        "mean_ratio": math.fsum(ratios) / len(ratios) if ratios else None,
        "worst_ratio": max(ratios, default=None),
    }


def load(
    scen: str | os.PathLike[str], map_: str | os.PathLike[str] | None = None, *, max_cells: int = MAX_CELLS
) -> Benchmark:
    """Read a ``.scen`` and the map it is about, and check each query against the map.

    Parameters
    ----------
    scen : the file.
    map_ : the map, or the name of a bundled one, whatever the queries call it. None: the file of the same
        folder that they name (by its last part), or the one that the ``.scen`` is called after.
    max_cells : more cells than this are refused.

    Raises
    ------
    FileError : what is wrong in either file; SCEN_EMPTY; SCEN_MAP, PATH_OUTSIDE or FILE_MISSING (which map is
        meant); SCEN_SIZE (the map has another size). With the line.
    SceneError : START_OCCUPIED or GOAL_OCCUPIED, with the line.
    LimitError : the map is too large.
    """
    name = os.fspath(scen)
    queries = read_scen(name)
    if not queries:
        raise FileError("SCEN_EMPTY", "there is no query in it", where=name, allowed="one or more lines")
    document = load_map(beside(name, queries) if map_ is None else map_, max_cells=max_cells)
    if document.grid.terrain is not None:
        raise FileError(
            "SCEN_MAP",
            "a map with terrain",
            where=document.grid.name,
            allowed="plain ground, which is what the published lengths are of",
        )
    notes = document.notes
    if map_ is not None:
        others = dict.fromkeys(q.map for q in queries if _last(q.map) != document.grid.name)
        notes = (*(f"the queries name {other}; {document.grid.name} was given" for other in others), *notes)
        queries = tuple(replace(q, map=document.grid.name) for q in queries)
    for query in queries:
        check_query(query, document, name)
    return Benchmark(name, document, queries, notes)


def beside(name: str, queries: Sequence[ScenQuery]) -> Path:
    """The map that a ``.scen`` is about. No other folder than its own is looked into."""
    first = queries[0]
    for query in queries:
        where = f"{name}: line {query.line}"
        if ".." in re.split(r"[/\\]", query.map):
            raise FileError(
                "PATH_OUTSIDE",
                f"map {query.map[:60]!r} is outside the file's folder",
                where=where,
                todo="say which map is meant with map=FILE",
            )
        if _last(query.map) != _last(first.map):
            raise FileError(
                "SCEN_MAP",
                f"map {query.map[:60]!r}, and {first.map[:60]!r} in line {first.line}",
                where=where,
                allowed="queries about one map",
            )
    folder, own = Path(name).parent, Path(name).name
    stem = re.sub(r"\.scen$", "", own, flags=re.IGNORECASE)
    for one in (_last(first.map), stem, f"{stem}.map"):
        if one and one != own and _is_file(folder / one):
            return folder / one
    raise FileError(
        "FILE_MISSING",
        f"map {_last(first.map)[:60]!r} is not in the folder of the file",
        where=f"{name}: line {first.line}",
        todo="put it there, or give map=FILE",
    )


def _last(name: str) -> str:
    """The last part of a path, written for whichever system."""
    return re.split(r"[/\\]", name)[-1]


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # names that no file can have
        return False


def tolerances(queries: Sequence[ScenQuery]) -> list[float]:
    """How far an optimal length may be from each published one: half a unit of the last digit printed.

    At least 1e-5 of the length. A whole number in a file that has digits after the point elsewhere was
    printed without its zeros and is exact. (Taken as rounded, "6" would let 5.83 pass.)
    """
    zeros_cut = any(q.decimals for q in queries)
    return [
        max(RELATIVE * q.length, 0.0 if zeros_cut and not q.decimals else float(f"5e-{q.decimals + 1}"))
        for q in queries
    ]


def ask(
    benchmark: Benchmark,
    planner: str = defaults.QUERY_PLANNER,
    moves: str = "octile",
    *,
    seed: int = 0,
    limit: int | None = None,
    progress: Callable[[int], None] | None = None,
    planner_settings: Mapping[str, Any] | None = None,
    **settings: Any,
) -> QueryResults:
    """Ask a planner every query.

    Parameters
    ----------
    benchmark : map and queries.
    planner : a name (see ``lampyris planners``).
    moves : the step set; only octile moves can be compared with the published lengths.
    seed : every query draws from a stream of its own, by its line.
    limit : only so many queries, the first; None: all.
    progress : called with the number of queries answered.
    planner_settings : the planner's, for those that have the name of an argument of this function.
    settings : the planner's.

    Raises
    ------
    UsageError, SettingError : no such planner, setting or moves, a value out of its range.
    InternalFault : the referee refused a path; a fault of lampyris.
    """
    chosen = chosen_planner(
        ask, planner, planner_settings, settings, moves=moves, seed=seed, limit=limit, progress=progress
    )
    if limit is not None and not is_whole(limit, 1):
        raise SettingError.of("LIMIT", "limit", shown(limit), allowed="a whole number >= 1")
    if not is_whole(seed, 0):
        raise SettingError.of("SEED", "seed", shown(seed), allowed=SEED_RANGE)
    began, loaded = time.perf_counter(), loading.seconds()
    steps = moves_named(moves)
    rule = "found" if steps.name != "octile" else "equal" if chosen.traits.optimal else "not shorter"
    # The digits of the whole file count, however few queries are asked.
    slack = tolerances(benchmark.queries)
    answers = []
    spent = {"plan_s": 0.0, "referee_s": 0.0}
    # A session of its own for each query: opening one takes 0.16 ms on 512 x 512 cells, so that queries with
    # a common goal are not worth gathering.
    for k, query in enumerate(benchmark.queries[:limit]):
        scene = Scene(grid_for(benchmark.document, query.start), query.start, query.goal, steps)
        stream = np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, query.line))))
        at = loading.wall()
        found = chosen.open(scene, stream).plan()
        planned = loading.wall()
        referee.demand(referee.check_plan(found, scene))
        spent["plan_s"] += planned - at
        spent["referee_s"] += loading.wall() - planned
        agrees = bool(found) and _agrees(found.cost - query.length, rule, slack[k])
        answers.append(QueryResult(query, found.status, found.cost, found.expansions, agrees))
        if progress is not None:
            progress(k + 1)
    made = QueryResults(planner, steps, rule, tuple(answers))
    return replace(
        made,
        timing={**spent, "total_s": time.perf_counter() - began, "loading_s": loading.seconds() - loaded},
    )


def _agrees(difference: float, rule: str, slack: float) -> bool:
    """Whether a path found is as long as it may be: ``difference`` is its length less the published one."""
    return rule == "found" or (difference >= -slack and (rule != "equal" or difference <= slack))
