"""Every line of every MovingAI ``.scen`` in a folder: the exact planners find the published optimal length.

N. Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE TCIAIG 4(2):144-148, 2012. A kind is a file, a
case is a line; the planners take turns. A line that disagrees, or that cannot be read, is a failure and is
listed. Without a folder files of our own making are read: maps are drawn, lengths come from the reference of
the check ``random``, printed with two to eight digits.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

import numpy as np

from lampyris import movingai
from lampyris.errors import FileError, LampyrisError, UsageError
from lampyris.io.maps.formats.movingai import ScenQuery, grid_for
from lampyris.model.moves import MOVES
from lampyris.model.scene import Scene
from lampyris.movingai import Benchmark
from lampyris.referee import check_plan
from lampyris_selfcheck.check import KEPT_FAILURES, Ask, Check, Kind, Outcome, Part, Tally
from lampyris_selfcheck.checks.paths import drawn_maps, worlds
from lampyris_selfcheck.checks.paths.answers import asked, exact, in_cells
from lampyris_selfcheck.checks.paths.grid_costs import cost_at, costs_to
from lampyris_selfcheck.ledger import hash_of
from lampyris_selfcheck.reference.paths.path_cost import walked
from lampyris_selfcheck.reference.paths.search import cost_of

MADE = "made"
LINES = 25
"""Of a file of our own; all of one goal in five."""
MOST = 1e-4
"""Share of a published length by which ours may differ, beside half a unit of the last digit printed."""
MUST = "octile"


def _run(ask: Ask, part: Part) -> Outcome:
    tally = Tally(part)
    for number in part.numbers:
        try:
            if part.kind == MADE:
                benchmark, line = _made(ask, number // LINES), number % LINES
            else:
                benchmark, line = _read(ask.folder or Path(), part.kind), number
        except (LampyrisError, OSError) as error:
            tally.case("file refused")
            tally.fail(number, f"{part.kind}, line {number}: {error}", file=part.kind)
            continue
        name = exact()[number % len(exact())]
        query = benchmark.queries[line]
        try:
            off, fault = _difference(benchmark, query, name)
        except Exception as error:
            off, fault = None, f"raises {type(error).__name__}: {error}"
        slack = min(movingai.tolerances(benchmark.queries)[line], _loosest(query))
        if off is not None and abs(off) > slack:
            fault = f"{query.length + off!r} cells, published {query.length!r}, may differ by {slack:.2g}"
        tally.case(f"by {name}")
        if off is not None and query.length > 0:
            tally.measure("difference by length", abs(off) / query.length)
        if fault:
            where = f"{part.kind}, line {query.line}, {query.start} to {query.goal}, {name}"
            tally.fail(
                number, f"{where}: {fault}", file=part.kind, line=query.line, planner=name,
                start=query.start, goal=query.goal, length=query.length,
            )  # fmt: skip
    return tally.outcome()


def _loosest(query: ScenQuery) -> float:
    return max(MOST * query.length, 0.5 * 10.0**-query.decimals)


def _difference(benchmark: Benchmark, query: ScenQuery, name: str) -> tuple[float | None, str]:
    """Our length less the published one (None: no way), and what else is wrong.

    The length is counted along the way by the reference's own rules, not taken from the plan.
    """
    grid = grid_for(benchmark.document, query.start)
    scene = Scene(grid, query.start, query.goal, MOVES[MUST])
    plan = asked(name, scene)
    if plan.path is None:
        return None, f"answers {plan.status.value}, published {query.length!r}"
    broken = check_plan(plan, scene)
    if broken is not None:
        return None, f"the referee: {broken}"
    cells = [(x, y) for x, y in plan.path.cells.tolist()]
    if cells[0] != query.start or cells[-1] != query.goal:
        return None, f"goes from {cells[0]} to {cells[-1]}"
    fault, counts = walked(~grid.blocked, cells, MUST)
    if fault:
        return None, f"the way: {fault}"
    return in_cells(cost_of(counts, MUST), MUST, weighed=False) - query.length, ""


# ---- files of others -----------------------------------------------------------------------------


@lru_cache(maxsize=8)
def _files(folder: Path) -> Mapping[str, Path]:
    found = {p.relative_to(folder).as_posix(): p for p in sorted(folder.rglob("*.scen")) if p.is_file()}
    if not found:
        raise UsageError(
            "FOLDER",
            f"{folder} holds no .scen file",
            where="--folder",
            todo="name the folder of the benchmark",
        )
    return found


@lru_cache(maxsize=8)
def _maps(folder: Path) -> Mapping[str, Path]:
    """Maps by their own names: collections keep queries and maps in folders of their own."""
    return {p.name: p for p in sorted(folder.rglob("*.map"), reverse=True) if p.is_file()}


def _read(folder: Path, kind: str) -> Benchmark:
    found = _tried(folder, kind)
    if isinstance(found, Exception):
        raise found
    return found


@lru_cache(maxsize=1)
def _tried(folder: Path, kind: str) -> Benchmark | Exception:
    """The file read, or why it cannot be: that too is found out once and not for every line."""
    path = _files(folder)[kind]
    beside = path.with_name(path.name.removesuffix(".scen"))
    try:
        made = (
            movingai.load(path) if beside.is_file() else movingai.load(path, _maps(folder).get(beside.name))
        )
    except (LampyrisError, OSError) as error:
        return error
    if len(made.queries) != _lines(path):
        told = f"{len(made.queries)} queries are read, there are {_lines(path)} lines"
        return FileError("SCEN_LINE", told, where=str(path))
    return made


@lru_cache(maxsize=4096)
def _lines(path: Path) -> int:
    """Queries of a file, counted by no reader of ours; at least one, so that no file goes unmentioned."""
    lines = [line.split() for line in path.read_bytes().splitlines()]
    return max(1, sum(bool(words) and words[0].lower() != b"version" for words in lines))


# ---- files of our own ----------------------------------------------------------------------------


@lru_cache(maxsize=2)
def _made(ask: Ask, group: int) -> Benchmark:
    """A map and its queries, written and read again. Where nothing is free the map is drawn anew."""
    rng = ask.rng("scen", MADE, group)
    free = np.zeros((1, 1), dtype=np.bool_)
    while not free.any():
        width, height = (int(n) for n in rng.integers(5, 49, size=2))
        free = ~drawn_maps.walls(rng, width, height)
    letters = np.where(
        free, rng.choice(list(".G"), size=free.shape), rng.choice(list("@OT"), size=free.shape)
    )
    goals = [worlds.one(rng, free) for _ in range(5)]
    costs = costs_to(goals, free, MUST)
    digits = int(rng.integers(2, 9))
    lines = ["version 1"]
    for k in range(LINES):
        (gx, gy), field = goals[k % 5], costs[k % 5]
        sx, sy = worlds.one(rng, field >= 0)
        cost = cost_at(field, (sx, sy), MUST)
        assert cost is not None  # the start was drawn from where there is a way
        length = cost[0] + cost[1] * math.sqrt(2.0)
        words = (int(length / 4), "maps/of-our-own.map", width, height, sx, sy, gx, gy)
        lines.append("\t".join(map(str, words)) + f"\t{length:.{digits}f}")
    rows = ["".join(row) for row in letters.tolist()]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "of-our-own.map").write_text(
            "\n".join([f"type octile\nheight {height}\nwidth {width}\nmap", *rows, ""])
        )
        (Path(folder) / "of-our-own.map.scen").write_text("\n".join([*lines, ""]))
        return movingai.load(Path(folder) / "of-our-own.map.scen")


def _kinds(ask: Ask) -> Mapping[str, Kind]:
    if ask.folder is None:
        what = "lines of files of our own making, read back; give --folder for published ones"
        return {MADE: Kind(what, 500, 50_000, 500_000, chunk=500)}
    kinds = {}
    for name, path in _files(ask.folder).items():
        n = _lines(path)
        # As many to a part as are told whole: every line that disagrees is listed.
        kinds[name] = Kind(f"every line of {name}", n, n, n, chunk=KEPT_FAILURES, whole=n)
    return kinds


def _inputs(ask: Ask) -> str:
    """Of all that is read of a folder."""
    if ask.folder is None:
        return ""
    return hash_of([*_files(ask.folder).values(), *_maps(ask.folder).values()], ask.folder)


CHECK = Check(
    "scen",
    ("G5",),
    "the optimal lengths published with MovingAI maps are found",
    _kinds,
    _run,
    folder=True,
    inputs=_inputs,
)
