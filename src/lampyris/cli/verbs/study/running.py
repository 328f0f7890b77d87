"""``lampyris study STUDY``: run a study, or continue it, and keep what is done in a store."""

from __future__ import annotations

import os
import re
import shlex
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

from lampyris._core.limits import MAX_CELLS
from lampyris._core.system import processors
from lampyris.cli import outputs, text
from lampyris.cli.exit_codes import INTERRUPTED, Interrupted
from lampyris.cli.option_errors import check_choice
from lampyris.cli.progress import clock, working
from lampyris.cli.text import plural, print_json, print_notes
from lampyris.cli.verbs.study import tables
from lampyris.cli.verbs.study.files import StudyOutputs, demand_package, write_files
from lampyris.errors import FileError, UsageError
from lampyris.study.analysis.table import table_of
from lampyris.study.design.row import Row
from lampyris.study.design.serialize import demand_same
from lampyris.study.design.study import Study
from lampyris.study.execution.execution import Execution

if TYPE_CHECKING:
    from lampyris.study.store.store import Store

AGAIN = ("failed", "timeout", "refused")
"""Endings that may be another the next time: a worker died, the machine was busy, a planner was repaired."""


@dataclass(frozen=True)
class StudyRequest:
    """The options of ``study run``, as they were typed."""

    study: str
    store: Path | None
    data: Path | None
    allow_outside: bool
    max_cells: int | None
    workers: int | None
    dask: str | None
    fresh: bool
    dry_run: bool
    again: tuple[str, ...] = ()

    def check_again(self) -> None:
        """Reject ``--again`` where it contradicts another option or names no such ending.

        Raises
        ------
        UsageError : OPTIONS; ENDING.
        """
        if self.again and (self.fresh or self.dry_run):
            raise UsageError("OPTIONS", "--again together with --fresh or --dry-run", allowed="one of them")
        for word in self.again:
            check_choice("ENDING", "--again", word, AGAIN)

    def where(self) -> Execution:
        """The executor to run on.

        Raises
        ------
        UsageError : workers of our own beside a cluster; a cluster without the package for it.
        SettingError : WORKERS: out of range.
        """
        if self.dask is not None:
            if self.workers is not None:
                raise UsageError("OPTIONS", "--workers and --dask both given", allowed="one of them")
            demand_package("distributed", "--dask", "dask", "CLUSTER_MISSING")
        return Execution(workers=processors() if self.workers is None else self.workers, dask=self.dask)


def default_store(study: Study) -> Path:
    """Where a study is kept by default: its name, in the working folder."""
    name = re.sub(r"[^\w.-]+", "-", study.name).strip("-.") or "study"
    return Path(f"{name}.study.db")


def run_study(request: StudyRequest, out: StudyOutputs) -> int:
    """Run or continue a study. Returns the exit code."""
    from lampyris.study.design.study_file import load_study

    given = [Path(request.study)] if os.path.lexists(request.study) else []
    out.check(*given, *([request.store] if request.store is not None else []))
    request.check_again()
    where = request.where()
    limit = MAX_CELLS if request.max_cells is None else request.max_cells
    with working(f"reading {request.study}", quiet=out.json):
        study = load_study(
            request.study, data=request.data, allow_outside=request.allow_outside, max_cells=limit
        )
    print_notes(study.notes)
    path = request.store or default_store(study)
    out.check_apart(path)
    if out.reference is not None:
        from lampyris.study.analysis.runs import entrants_of

        check_choice("REFERENCE", "--reference", out.reference, entrants_of(study))
    if request.dry_run:
        return _print_dry_run(study, path, where, request, out)
    if request.fresh:
        _discard(path)
    if request.again:
        _forget(study, path, request.again, quiet=out.json)
    return _run(study, path, where, out)


def _run(study: Study, path: Path, where: Execution, out: StudyOutputs) -> int:
    """Run what is not done yet, then write and print the results."""
    from lampyris.study.execution import run as running
    from lampyris.study.store.store import open_for

    began = time.monotonic()
    store = open_for(path, study)
    try:
        study = _as_stored(study, store)
        before = store.keys()
        tally = tables.Tally(study)
        tally.add(store.scan())
        if not out.json:
            _announce(study, path, where, len(before))

        def keep(rows: Sequence[Row]) -> None:
            store.add(rows)
            tally.add(rows)

        try:
            with tables.StudyProgress(study, tally, quiet=out.json) as display:
                running.run(study, keep, done=before, where=where, progress=display.show)
        except KeyboardInterrupt:
            _interrupted(study, store, path)
        return _write_and_print(
            study, store, path, out, new=len(store.keys()) - len(before), seconds=time.monotonic() - began
        )
    finally:
        store.close()


def _forget(study: Study, path: Path, endings: tuple[str, ...], *, quiet: bool) -> None:
    """Remove the runs with these endings from the store of this study."""
    from lampyris.study.store.store import Store

    with Store.open(path) as store:
        demand_same(store.plain(), study, str(path))
        gone = store.forget(endings)
    if not quiet:
        print(f"{plural(gone, 'run')} ({', '.join(endings)}) will be run again", file=sys.stderr)


def _as_stored(study: Study, store: Store) -> Study:
    """The study by the names that its store was made with: the same store gives the same bytes."""
    from lampyris.study.design.serialize import study_plain

    if store.plain().get("called") == study_plain(study)["called"]:
        return study
    print_notes((f"{store.path} keeps the names it was made with (name, about, labels)",))
    return replace(store.study(), notes=study.notes)


def _announce(study: Study, path: Path, where: Execution, done: int) -> None:
    """What will be run, where it is kept, and how much of it is there already."""
    print(f"{study.name}: {tables.sizes(study)}", file=sys.stderr)
    how = f"on {where.dask}" if where.dask else f"by {plural(where.workers, 'worker')}"
    there = f"; {done:,} of {len(study):,} there already" if done else ""
    print(f"{how}, kept in {path}{there}", file=sys.stderr, flush=True)


def _interrupted(study: Study, store: Store, path: Path) -> NoReturn:
    """Print what is kept and how to continue."""
    words = ["lampyris", *(word for word in sys.argv[1:] if word != "--fresh")]
    there = f"{len(store.keys()):,} of {len(study):,} runs are kept in {path}"
    print(f"interrupted: {there}; continue with: {shlex.join(words)}", file=sys.stderr)
    raise Interrupted(INTERRUPTED)


def _print_dry_run(
    study: Study, path: Path, where: Execution, request: StudyRequest, out: StudyOutputs
) -> int:
    """Print what would be run."""
    from lampyris.study.store.store import Store

    done = 0
    if path.exists() and not request.fresh:
        store = Store.open(path, writable=False)
        try:
            demand_same(store.plain(), study, str(path))
            done = len(store.keys())
        finally:
            store.close()
    if out.json:
        print_json(
            {
                **tables.record(study, path),
                "notes": list(study.notes),
                "done": done,
                "workers": where.workers,
                "dask": where.dask,
            }
        )
        return 0
    how = f"on {where.dask}" if where.dask else plural(where.workers, "worker")
    left = len(study) - done
    runs_left = plural(left, "run") if left else "nothing"
    text.facts(
        "",
        [
            *tables.facts(study),
            ("store", f"{path}, {done:,} of {len(study):,} runs there already" if done else f"{path}, new"),
            ("would run", f"{runs_left}, {how}"),
        ],
    )
    return 0


def _discard(path: Path) -> None:
    """Delete a store; no other file, and no store that another process writes to. A link to it stays a link.

    Raises
    ------
    FileError : STORE_READ: the path cannot be followed; STORE_FORMAT: the file is no store; STORE_BUSY; STORE_WRITE.
    """
    from lampyris.study.store.file import look, real, sidecar
    from lampyris.study.store.lock import StoreLock

    path = real(path)  # where the lock and the log are
    if not os.path.lexists(path):
        return
    try:
        look(path)
    except FileError as fault:
        if fault.code not in ("STORE_DAMAGED", "STORE_VERSION"):
            raise
    with StoreLock(path):
        try:
            # The store itself last: killed before that, `--fresh` finds it and begins again.
            for file in (sidecar(path, "-wal"), sidecar(path, "-shm"), path):
                file.unlink(missing_ok=True)
        except OSError as error:
            raise FileError("STORE_WRITE", error.strerror or str(error), where=str(path)) from None


def _write_and_print(
    study: Study, store: Store, path: Path, out: StudyOutputs, *, new: int, seconds: float
) -> int:
    """Write the requested files and print how it went."""
    table = table_of(study, store.scan())
    summary = write_files(study, table, out)
    counts = tables.endings(table["ending"])
    if out.json:
        answer = {**tables.record(study, path), "notes": list(study.notes)}
        answer |= {"done": len(table), "new": new, "endings": counts}
        answer |= {"summary": summary.as_json(), "files": [str(f) for f in out.files]}
        print_json({**answer, "timing": {"wall_s": seconds}})
        return 0
    with outputs.text_beside(*out.files):
        done = f"{len(table):,} of {len(study):,} runs: {tables.endings_text(counts)}"
        text.line(f"{done}; {new:,} new, {clock(seconds)}")
        tables.print_summary(summary)
        out.print_written()
    return 0
