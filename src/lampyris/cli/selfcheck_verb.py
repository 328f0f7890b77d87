"""``lampyris selfcheck``: the promises, each a command.

Work is imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lampyris.cli.options import Json

Names = Annotated[
    list[str] | None, typer.Argument(metavar="[NAME]...", help="Which checks (default: all; see --list).")
]
Size = Annotated[
    str, typer.Option("--size", help="commit (minutes in all), nightly (hours) or release (a day).")
]
Only = Annotated[str | None, typer.Option("--only", metavar="KIND", help="One kind of cases alone.")]
First = Annotated[int, typer.Option("--first", metavar="K", help="Number of the first case.", min=0)]
Cases = Annotated[
    int | None, typer.Option("--cases", metavar="N", help="Cases of each kind (default: the size's).", min=1)
]
Seed = Annotated[int, typer.Option("--seed", help="Root of every draw: same seed, same cases.", min=0)]
Folder = Annotated[
    Path | None,
    typer.Option("--folder", metavar="DIR", help="Input data: MovingAI maps, for `scen`."),
]
Workers = Annotated[
    int | None, typer.Option("--workers", metavar="N", help="Processes (default: one a core).", min=1)
]
Ledger = Annotated[
    Path | None,
    typer.Option("--ledger", metavar="FILE", help="Keep what is done, and go on from there the next time."),
]
Failures = Annotated[
    Path | None,
    typer.Option("--failures", metavar="DIR", help="Write each failing case to a file."),
]
Record = Annotated[
    Path | None, typer.Option("--record", metavar="FILE", help="Append what came of it (JSON lines).")
]
List = Annotated[bool, typer.Option("--list", help="Print the checks and their kinds of cases.")]


def selfcheck(
    names: Names = None,
    size: Size = "commit",
    only: Only = None,
    first: First = 0,
    cases: Cases = None,
    seed: Seed = 1,
    folder: Folder = None,
    workers: Workers = None,
    ledger: Ledger = None,
    failures: Failures = None,
    record: Record = None,
    list_: List = False,
    json_: Json = False,
) -> None:
    """Try what is promised: cases, failures, seconds, seed of each check.

    Exits with 0 only if all hold, with 6 if a promise is broken.
    """
    from lampyris.cli import selfcheck_work as work
    from lampyris.selfcheck.check import Ask
    from lampyris.selfcheck.runner import Range

    asked = work.Asked(
        tuple(names or ()),
        Ask(seed, size, folder, work.processes(workers)),
        Range(only, first, cases),
        ledger,
        failures,
        record,
        json_,
    )
    raise typer.Exit(work.list_checks(asked) if list_ else work.selfcheck(asked))
