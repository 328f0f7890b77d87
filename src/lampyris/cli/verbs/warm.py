"""``lampyris warm``: compile every kernel now, so that nobody waits for it later.

Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Annotated

import typer

from lampyris._core.system import processors
from lampyris.cli.options import Json
from lampyris.cli.text import plural, print_json

TENTHS = 10


def warm(
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers", metavar="N", min=1, help="Number of worker processes (default: one per core)."
        ),
    ] = None,
    json_: Json = False,
) -> None:
    """Compile the kernels that large maps need, once per machine, and print where they are cached."""
    raise typer.Exit(warm_kernels(processors() if workers is None else workers, json_))


def warm_kernels(workers: int, as_json: bool) -> int:
    """Compile what is not compiled yet, and print where it is kept. Returns the exit code."""
    from lampyris.warming import warm as compile_all

    began = time.monotonic()
    with _bar(quiet=as_json) as report:
        done = compile_all(report, workers)
    seconds = time.monotonic() - began
    if as_json:
        print_json(
            {
                "kernels": done.kernels,
                "versions": done.versions,
                "made": done.made,
                "kept": done.versions - done.made,
                "folders": [str(folder) for folder in done.folders],
                "bytes": done.size,
                "seconds": round(seconds, 3),
            }
        )
        return 0
    made = "nothing was left to compile" if not done.made else f"{done.made:,} compiled in {seconds:.0f} s"
    print(f"{plural(done.kernels, 'kernel')} in {plural(done.versions, 'version')}: {made}.")
    for folder in done.folders:
        print(f"kept in {folder}")
    print(f"{done.size / 1e6:.1f} MB in all")
    return 0


@contextmanager
def _bar(*, quiet: bool) -> Iterator[Callable[[int, int, str], None] | None]:
    """Show a bar on stderr at a terminal; elsewhere print a line for every tenth."""
    if quiet:
        yield None
    elif sys.stderr.isatty():
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

        columns = BarColumn(), MofNCompleteColumn(), TimeElapsedColumn(), TextColumn("{task.description}")
        with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
            task = progress.add_task("looking what there is to compile", total=None)
            yield lambda done, total, name: progress.update(
                task, completed=done, total=total, description=name
            )
    else:
        last = -1

        def line(done: int, total: int, name: str) -> None:
            nonlocal last
            tenth = TENTHS * done // max(1, total)
            if tenth > last:
                last = tenth
                print(f"compiled: {done} of {total}", file=sys.stderr, flush=True)

        yield line
