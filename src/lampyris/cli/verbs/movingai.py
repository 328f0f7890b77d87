"""``lampyris movingai``: all queries of a MovingAI ``.scen``, beside the published lengths.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from lampyris._core.limits import MAX_CELLS
from lampyris.cli import outputs, text
from lampyris.cli.option_errors import check_choice
from lampyris.cli.options import moves_name
from lampyris.cli.outputs import print_written
from lampyris.cli.progress import counting
from lampyris.cli.text import print_json, print_notes

if TYPE_CHECKING:
    from lampyris.movingai import Benchmark, QueryResult, QueryResults

DISAGREED = 3
COLUMNS = (
    "line", "bucket", "start_x", "start_y", "goal_x", "goal_y", "published", "ours", "status", "agrees",
    "expansions",
)  # fmt: skip
RULES = {
    "equal": "equal to the published length, to the digits it is printed with",
    "not shorter": "no shorter than the published optimum",
    "found": "found; the published lengths are of octile moves",
}
"""What agreeing means, in words."""


def movingai(
    file: Annotated[Path, typer.Argument(metavar="MAP.scen", help="A file of queries.")],
    map_: Annotated[
        str | None,
        typer.Option("--map", metavar="FILE", help="The map (default: the one next to the queries)."),
    ] = None,
    planner: Annotated[
        str, typer.Option("--planner", metavar="NAME", help="Name of the planner: see `lampyris planners`.")
    ] = "astar",
    moves: Annotated[
        str,
        typer.Option(
            "--moves",
            metavar="dissertation|octile|four-connected|sixteen-connected",
            help="octile, to which the lengths refer; dissertation, four-connected or sixteen-connected.",
            callback=moves_name,
        ),
    ] = "octile",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A setting of the planner; repeatable."),
    ] = None,
    seed: Annotated[
        int, typer.Option("--seed", metavar="N", help="Seed of all random draws: same seed, same answers.")
    ] = 0,
    limit: Annotated[
        int | None, typer.Option("--limit", metavar="N", help="Run only the first N queries.")
    ] = None,
    json_: Annotated[bool, typer.Option("--json", help="Print the result as JSON, by bucket.")] = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="Exit with code 3 if any query disagrees.")
    ] = False,
    csv: Annotated[
        Path | None, typer.Option("--csv", metavar="FILE", help="Write a row for each query.")
    ] = None,
    max_cells: Annotated[
        int | None,
        typer.Option("--max-cells", metavar="N", min=1, max=MAX_CELLS, help="Refuse maps with more cells."),
    ] = None,
    no_timing: Annotated[
        bool, typer.Option("--no-timing", help="Omit timings, so that repeated calls print identical JSON.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite files that exist.")] = False,
) -> None:
    """Run every query of a MovingAI .scen file and compare with the published lengths."""
    from lampyris import movingai as benchmarks
    from lampyris.cli.request import parse_settings
    from lampyris.model.moves import MOVES

    check_choice("MOVES", "--moves", moves, MOVES)
    outputs.check_outputs(force, json=json_, csv=csv)
    given = parse_settings(planner, settings or [])
    benchmark = benchmarks.load(file, map_, max_cells=MAX_CELLS if max_cells is None else max_cells)
    if not json_:
        print_notes(benchmark.notes)
    many = min(len(benchmark.queries), limit or len(benchmark.queries))
    with counting(f"{planner} on {benchmark.document.grid.name}", f"of {many}", quiet=json_) as tick:
        made = benchmarks.ask(benchmark, planner, moves, seed=seed, limit=limit, progress=tick, **given)
    if csv is not None:
        with outputs.place(csv) as place:
            _write_csv(place, made)
    if json_:
        record = _record(benchmark, made, given, seed)
        print_json({**record, "timing": {}} if no_timing else record)
    else:
        with outputs.text_beside(csv):
            _print(benchmark, made, csv)
    raise typer.Exit(DISAGREED if strict and made.disagreements else 0)


def _record(benchmark: Benchmark, made: QueryResults, settings: dict[str, Any], seed: int) -> dict[str, Any]:
    """What ``--json`` prints; all of it but ``timing`` is decided by the files, the settings and the seed."""
    from lampyris.io.maps.map_hash import map_hash
    from lampyris.report.data.serialize import grid_record

    grid = benchmark.document.grid
    return {
        "scen": Path(benchmark.name).name,
        "map": {**grid_record(grid), "hash": map_hash(grid)},
        "notes": list(benchmark.notes),
        "planner": made.planner,
        "settings": settings,
        "moves": made.moves.name,
        "seed": seed,
        "rule": RULES[made.rule],
        **made.summary,
        "disagreements": [_answer_record(a) for a in made.disagreements],
        "buckets": [{"bucket": bucket, **counts} for bucket, counts in made.buckets.items()],
        "timing": dict(made.timing),
    }


def _answer_record(answer: QueryResult) -> dict[str, Any]:
    query = answer.query
    return {
        "line": query.line,
        "start": list(query.start),
        "goal": list(query.goal),
        "published": query.length,
        "ours": answer.cost if answer.status else None,
        "status": answer.status.value,
    }


def _write_csv(out: Path, made: QueryResults) -> None:
    import csv
    import io

    from lampyris.io.files import write_file

    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(COLUMNS)
    for answer in made.answers:
        q = answer.query
        ours = repr(answer.cost) if answer.status else ""
        ends = (q.line, q.bucket, *q.start, *q.goal)
        outcome = (answer.status.value, "yes" if answer.agrees else "no", answer.expansions)
        writer.writerow((*ends, repr(q.length), ours, *outcome))
    write_file(out, buffer.getvalue().encode())


def _print(benchmark: Benchmark, made: QueryResults, csv: Path | None) -> None:
    """Print the verdict, every disagreement, then the counts."""
    summary, wrong = made.summary, made.disagreements
    verdict = f"{len(wrong)} of {summary['queries']} disagree"
    text.line(verdict, style=f"bold {'red' if wrong else 'green'}")
    if wrong:
        columns = ("line", "start", "goal", "published", "ours", "status")
        cells = []
        for a in wrong:
            q = a.query
            ours = f"{a.cost:.{max(q.decimals, 5)}f}" if a.status else "-"
            ends = (str(q.line), str(q.start), str(q.goal))
            cells.append((*ends, f"{q.length:.{q.decimals}f}", ours, a.status.value))
        text.table("", columns, cells, right=("line", "published", "ours"), boxed=True)
    grid = benchmark.document.grid
    rows = [
        ("map", f"{grid.name}, {grid.width} x {grid.height} cells"),
        ("planner", f"{made.planner}, {made.moves.name} moves"),
        ("agrees", RULES[made.rule]),
        ("solved", f"{summary['solved']} of {summary['queries']}, {summary['unreachable']} unreachable"),
    ]
    if made.rule != "equal" and summary["mean_ratio"] is not None:
        ratios = f"mean {summary['mean_ratio']:.5f}, worst {summary['worst_ratio']:.5f}"
        rows.append(("to the published length", ratios))
    times = f"{made.timing['total_s']:.2f} s, of which planning {made.timing['plan_s']:.2f} s"
    rows += [("expansions", f"{summary['expansions']:,}"), ("time", times)]
    text.facts("", rows)
    print_written(csv)
