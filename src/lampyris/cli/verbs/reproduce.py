"""``lampyris reproduce``: what the dissertation prints, run again, with a verdict for every figure.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import shlex
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer

from lampyris._core.system import processors
from lampyris.cli import text
from lampyris.cli.exit_codes import INTERRUPTED, Interrupted
from lampyris.cli.options import Force, Json
from lampyris.cli.progress import ProgressDisplay, clock
from lampyris.cli.tables import print_tab
from lampyris.cli.text import print_json
from lampyris.errors import FileError, UsageError

if TYPE_CHECKING:
    from lampyris.report.html.table import Value
    from lampyris.reproduce import Report, RunProgress

RUNS = "runs"
"""Folder of the stores, by which an earlier reproduction is known."""


def reproduce(
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder for the page and its tables.")
    ] = Path("reproduction"),
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers", metavar="N", min=1, help="Number of worker processes (default: one per core)."
        ),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer paths and seeds: the same page in about a minute.")
    ] = False,
    json_: Json = False,
    force: Force = False,
) -> None:
    """Recompute the dissertation's printed figures and report which ones reproduce."""
    raise typer.Exit(reproduce_figures(out, workers, quick, json_, force))


def reproduce_figures(out: Path, workers: int | None, quick: bool, as_json: bool, force: bool) -> int:
    """Run the figures and write the page. Returns the exit code."""
    from lampyris.reproduce import reproduce as rerun

    _check(out, force)
    began = time.monotonic()
    if not as_json:
        print(f"every figure that the dissertation prints, and runs on our maps, into {out}", file=sys.stderr)
    with ProgressDisplay(quiet=as_json) as display:

        def report(at: RunProgress) -> None:
            display.update(at.name, at.done, at.total, "", at.seconds_left)

        try:
            made = rerun(
                out, workers=processors() if workers is None else workers, quick=quick, progress=report
            )
        except KeyboardInterrupt:
            made = None
    if made is None:
        _interrupted(out)
    seconds = time.monotonic() - began
    if as_json:
        print_json(_record(made, quick, seconds))
    else:
        _print(made, seconds)
    return 0


def _check(out: Path, force: bool) -> None:
    """Refuse at once what could not be written at the end; an earlier reproduction is continued."""
    if out.exists() and not out.is_dir():
        raise FileError("FILE_WRITE", "not a folder", where=str(out), allowed="a folder, or a new name")
    if out.is_dir() and any(out.iterdir()) and not (out / RUNS).is_dir() and not force:
        raise UsageError(
            "EXISTS", "the folder holds something else", where=str(out), todo="give --force to write into it"
        )


def _interrupted(out: Path) -> NoReturn:
    """Print what is kept and how to continue."""
    again = shlex.join(["lampyris", *sys.argv[1:]])
    print(f"interrupted: what was run is kept in {out / RUNS}; continue with: {again}", file=sys.stderr)
    raise Interrupted(INTERRUPTED)


def _print(made: Report, seconds: float) -> None:
    """Print how many figures of each table got which verdict, the conclusion, and where the page is."""
    from lampyris.report.html.table import Tab

    kinds = tuple(kind for kind, many in made.counts.items() if many)
    rows: list[tuple[Value, ...]] = []
    for name, counts in made.by_table().items():
        what = "what the text claims" if name == "text" else f"Table {name}"
        rows.append((what, sum(counts.values()), *(counts[kind] or None for kind in kinds)))
    rows.append(("all", made.figures, *(made.counts[kind] for kind in kinds)))
    header = ("", "figures", *kinds)
    print_tab(
        Tab(
            "verdicts",
            "what the dissertation prints",
            header,
            tuple(rows),
            align="l" + "r" * (len(header) - 1),
        )
    )
    text.line(made.conclusion)
    runs = sum(made.runs.values())
    print(f"{runs:,} runs, {clock(seconds)}; the page: {made.page}")


def _record(made: Report, quick: bool, seconds: float) -> dict[str, object]:
    """What ``--json`` prints."""
    return {
        "page": str(made.page),
        "files": [str(file) for file in made.files],
        "quick": quick,
        "figures": made.figures,
        "counts": dict(made.counts),
        "tables": made.by_table(),
        "runs": dict(made.runs),
        "conclusion": made.conclusion,
        "timing": {"wall_s": seconds},
    }
