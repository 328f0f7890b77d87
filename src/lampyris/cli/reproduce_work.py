"""What ``lampyris reproduce`` does."""

from __future__ import annotations

import shlex
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from lampyris._core.processors import processors
from lampyris.cli import INTERRUPTED, Interrupted, study_show, text, verbs
from lampyris.errors import FileError, UsageError
from lampyris.report.html.table import Tab, Value

if TYPE_CHECKING:
    from lampyris.reproduce import Report, RunProgress

RUNS = "runs"
"""Folder of the stores, by which an earlier reproduction is known."""


def reproduce(out: Path, workers: int | None, quick: bool, as_json: bool, force: bool) -> int:
    """``lampyris reproduce``. Returns the exit code."""
    from lampyris.reproduce import reproduce as work

    _check(out, force)
    began = time.monotonic()
    if not as_json:
        print(f"every figure that the dissertation prints, and runs on our maps, into {out}", file=sys.stderr)
    with study_show.Watch(quiet=as_json) as watch:

        def tell(at: RunProgress) -> None:
            watch.say(at.name, at.done, at.total, "", at.seconds_left)

        try:
            made = work(out, workers=processors() if workers is None else workers, quick=quick, progress=tell)
        except KeyboardInterrupt:
            made = None
    if made is None:
        _interrupted(out)
    seconds = time.monotonic() - began
    if as_json:
        verbs.print_json(_record(made, quick, seconds))
    else:
        _show(made, seconds)
    return 0


def _check(out: Path, force: bool) -> None:
    """Refuse at once what could not be written at the end; an earlier reproduction is gone on with."""
    if out.exists() and not out.is_dir():
        raise FileError("FILE_WRITE", "not a folder", where=str(out), allowed="a folder, or a new name")
    if out.is_dir() and any(out.iterdir()) and not (out / RUNS).is_dir() and not force:
        raise UsageError(
            "EXISTS", "the folder holds something else", where=str(out), todo="give --force to write into it"
        )


def _interrupted(out: Path) -> NoReturn:
    """One line: what is kept, and how to go on."""
    again = shlex.join(["lampyris", *sys.argv[1:]])
    print(f"interrupted: what was run is kept in {out / RUNS}; go on with: {again}", file=sys.stderr)
    raise Interrupted(INTERRUPTED)


def _show(made: Report, seconds: float) -> None:
    """How many figures of each table got which verdict, the conclusion, and where the page is."""
    kinds = tuple(kind for kind, many in made.counts.items() if many)
    rows: list[tuple[Value, ...]] = []
    for name, counts in made.by_table().items():
        what = "what the text claims" if name == "text" else f"Table {name}"
        rows.append((what, sum(counts.values()), *(counts[kind] or None for kind in kinds)))
    rows.append(("all", made.figures, *(made.counts[kind] for kind in kinds)))
    header = ("", "figures", *kinds)
    study_show.tab(
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
    print(f"{runs:,} runs, {study_show.clock(seconds)}; the page: {made.page}")


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
