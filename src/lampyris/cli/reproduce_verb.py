"""``lampyris reproduce``: what the dissertation prints, run again, with a verdict for every figure.

Work is imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from lampyris.cli.options import Force, Json


def reproduce(
    out: Annotated[
        Path, typer.Option("--out", metavar="DIR", help="Folder of the page and its tables.")
    ] = Path("reproduction"),
    workers: Annotated[
        int | None, typer.Option("--workers", metavar="N", min=1, help="Processes (default: one a core).")
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Fewer paths and seeds: the same page in a minute or so.")
    ] = False,
    json_: Json = False,
    force: Force = False,
) -> None:
    """Run what the dissertation prints, and say of every figure whether it is so."""
    from lampyris.cli import reproduce_work as work

    raise typer.Exit(work.reproduce(out, workers, quick, json_, force))
