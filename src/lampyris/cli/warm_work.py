"""What ``lampyris warm`` does."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from lampyris.cli import verbs
from lampyris.cli.study_show import plural

TENTHS = 10


def warm(as_json: bool) -> int:
    """``lampyris warm``. Returns the exit code."""
    from lampyris.warming import warm as work

    began = time.monotonic()
    with _bar(quiet=as_json) as tell:
        done = work(tell)
    seconds = time.monotonic() - began
    if as_json:
        verbs.print_json(
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
    """A bar on stderr for people at a terminal; elsewhere a line with every tenth."""
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
