"""What ``lampyris study`` does. Results go to stdout, progress and remarks to stderr."""

from __future__ import annotations

import os
import re
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

from lampyris._core.limits import MAX_CELLS
from lampyris._core.processors import processors
from lampyris.cli import INTERRUPTED, Interrupted, outputs, text, verbs
from lampyris.cli.request import known
from lampyris.errors import FileError, UsageError
from lampyris.study.design.row import Row
from lampyris.study.design.study import Study

if TYPE_CHECKING:
    from lampyris.study.analysis.findings import Summary
    from lampyris.study.analysis.table import ResultTable
    from lampyris.study.execution.execution import Execution
    from lampyris.study.store.store import Store


AGAIN = ("failed", "timeout", "refused")
"""Endings that may be another the next time: a worker died, the machine was busy, a planner was mended."""


@dataclass(frozen=True)
class Asked:
    """What was asked, as it was typed."""

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
        """Refuse what cannot be run again.

        Raises
        ------
        UsageError : OPTIONS; ENDING.
        """
        if self.again and (self.fresh or self.dry_run):
            raise UsageError("OPTIONS", "--again beside --fresh or --dry-run", allowed="one of them")
        for word in self.again:
            known("ENDING", "--again", word, AGAIN)

    def where(self) -> Execution:
        """Where it runs.

        Raises
        ------
        UsageError : workers of our own beside a cluster; a cluster without the package for it.
        SettingError : WORKERS: out of range.
        """
        from lampyris.study.execution.execution import Execution

        if self.dask is not None:
            if self.workers is not None:
                raise UsageError("OPTIONS", "--workers and --dask both given", allowed="one of them")
            needs("distributed", "--dask", "dask", "CLUSTER_MISSING")
        return Execution(workers=processors() if self.workers is None else self.workers, dask=self.dask)


@dataclass(frozen=True)
class Outputs:
    """What is to be printed and written."""

    json: bool = False
    report: Path | None = None
    films: bool = True
    reference: str | None = None
    csv: Path | None = None
    parquet: Path | None = None
    latex: Path | None = None
    timing: bool = False
    force: bool = False

    @property
    def files(self) -> tuple[Path, ...]:
        """All that are written."""
        return tuple(f for f in (self.csv, self.parquet, self.latex, self.report) if f is not None)

    def tell(self) -> None:
        """Say which files were written."""
        for file in self.files:
            if file != outputs.STDOUT:
                print(f"wrote {file}")

    def check(self, *others: Path) -> None:
        """Refuse at once what could not be done at the end; ``others`` are not to be written over."""
        self.check_apart(*others)
        outputs.check_outputs(
            self.force, json=self.json, csv=self.csv, parquet=self.parquet, latex=self.latex,
            report=self.report,
        )  # fmt: skip
        if self.parquet is not None:
            needs("pyarrow", "--parquet", "parquet", "PARQUET")

    def check_apart(self, *others: Path) -> None:
        """Refuse to write over what is read.

        Raises
        ------
        UsageError : OPTIONS.
        """
        for file in self.files:
            if any(os.path.realpath(file) == os.path.realpath(other) for other in others):
                raise UsageError("OPTIONS", f"{file} is read and written", allowed="a file of its own")


def needs(package: str, option: str, extra: str, code: str) -> None:
    """Refuse an option whose package is not installed."""
    if find_spec(package) is None:
        raise UsageError(
            code, f"needs the package {package}", where=option, todo=f"pip install 'lampyris[{extra}]'"
        )


def default_store(study: Study) -> Path:
    """Where a study is kept if nobody says: its name, in the working folder."""
    name = re.sub(r"[^\w.-]+", "-", study.name).strip("-.") or "study"
    return Path(f"{name}.study.db")


def run(asked: Asked, out: Outputs) -> int:
    """``lampyris study STUDY``. Returns the exit code."""
    from lampyris.study.design.study_file import load_study

    given = [Path(asked.study)] if os.path.lexists(asked.study) else []
    out.check(*given, *([asked.store] if asked.store is not None else []))
    asked.check_again()
    where = asked.where()
    limit = MAX_CELLS if asked.max_cells is None else asked.max_cells
    with verbs._working(f"reading {asked.study}", quiet=out.json):
        study = load_study(asked.study, data=asked.data, allow_outside=asked.allow_outside, max_cells=limit)
    verbs.remarks(study.notes)
    path = asked.store or default_store(study)
    out.check_apart(path)
    if out.reference is not None:
        from lampyris.study.analysis.runs import entrants_of

        known("REFERENCE", "--reference", out.reference, entrants_of(study))
    if asked.dry_run:
        return _dry(study, path, where, asked, out)
    if asked.fresh:
        _discard(path)
    if asked.again:
        _again(study, path, asked.again, quiet=out.json)
    return _run(study, path, where, out)


def _run(study: Study, path: Path, where: Execution, out: Outputs) -> int:
    """Run what is not done yet, then write and tell."""
    from lampyris.cli import study_show as show
    from lampyris.study.execution import run as running
    from lampyris.study.store.store import open_for

    began = time.monotonic()
    store = open_for(path, study)
    try:
        study = _as_stored(study, store)
        before = store.keys()
        tally = show.Tally(study)
        tally.add(store.scan())
        if not out.json:
            _announce(study, path, where, len(before))

        def keep(rows: Sequence[Row]) -> None:
            store.add(rows)
            tally.add(rows)

        try:
            with show.Board(study, tally, quiet=out.json) as board:
                running.run(study, keep, done=before, where=where, progress=board.show)
        except KeyboardInterrupt:
            _interrupted(study, store, path)
        return _tell(
            study, store, path, out, new=len(store.keys()) - len(before), seconds=time.monotonic() - began
        )
    finally:
        store.close()


def _again(study: Study, path: Path, endings: tuple[str, ...], *, quiet: bool) -> None:
    """Take runs that ended so out of the store of this study."""
    from lampyris.cli import study_show as show
    from lampyris.study.design.serialize import demand_same
    from lampyris.study.store.forget import forget
    from lampyris.study.store.store import Store

    with Store.open(path, writable=False) as store:
        demand_same(store.plain(), study, str(path))
    gone = forget(path, endings)
    if not quiet:
        print(f"{show.plural(gone, 'run')} ({', '.join(endings)}) will be run again", file=sys.stderr)


def _as_stored(study: Study, store: Store) -> Study:
    """The study by the names that its store was made with: the same store gives the same bytes."""
    from lampyris.study.design.serialize import study_plain

    if store.plain().get("called") == study_plain(study)["called"]:
        return study
    verbs.remarks((f"{store.path} keeps the names it was made with (name, about, labels)",))
    return replace(store.study(), notes=study.notes)


def _announce(study: Study, path: Path, where: Execution, done: int) -> None:
    """What will be run, where it is kept, and how much of it is there already."""
    from lampyris.cli import study_show as show

    print(f"{study.name}: {show.sizes(study)}", file=sys.stderr)
    how = f"on {where.dask}" if where.dask else f"by {show.plural(where.workers, 'worker')}"
    there = f"; {done:,} of {len(study):,} there already" if done else ""
    print(f"{how}, kept in {path}{there}", file=sys.stderr, flush=True)


def _interrupted(study: Study, store: Store, path: Path) -> NoReturn:
    """One line: what is kept, and how to go on."""
    import shlex

    words = ["lampyris", *(word for word in sys.argv[1:] if word != "--fresh")]
    there = f"{len(store.keys()):,} of {len(study):,} runs are kept in {path}"
    print(f"interrupted: {there}; go on with: {shlex.join(words)}", file=sys.stderr)
    raise Interrupted(INTERRUPTED)


def _dry(study: Study, path: Path, where: Execution, asked: Asked, out: Outputs) -> int:
    """Say what would be run."""
    from lampyris.cli import study_show as show
    from lampyris.study.design.serialize import demand_same
    from lampyris.study.store.store import Store

    done = 0
    if path.exists() and not asked.fresh:
        store = Store.open(path, writable=False)
        try:
            demand_same(store.plain(), study, str(path))
            done = len(store.keys())
        finally:
            store.close()
    if out.json:
        verbs.print_json(
            {
                **record(study, path),
                "notes": list(study.notes),
                "done": done,
                "workers": where.workers,
                "dask": where.dask,
            }
        )
        return 0
    how = f"on {where.dask}" if where.dask else show.plural(where.workers, "worker")
    text.facts(
        "",
        [
            *facts(study),
            ("store", f"{path}, {done:,} of {len(study):,} runs there already" if done else f"{path}, new"),
            ("would run", f"{plural_left(len(study) - done)}, {how}"),
        ],
    )
    return 0


def plural_left(n: int) -> str:
    """``1 run``; ``nothing``."""
    from lampyris.cli import study_show as show

    return show.plural(n, "run") if n else "nothing"


def facts(study: Study) -> list[tuple[str, str]]:
    """What a study is."""
    from lampyris.cli import study_show as show
    from lampyris.study.design.traffic_labels import crowd_words

    budget = [f"{study.expansions:,} expansions a call"] if study.expansions is not None else []
    budget += [f"{study.seconds:g} s a run (results depend on the machine)"] if study.seconds else []
    rows = [
        ("study", study.name),
        ("asks", study.about),
        ("runs", show.sizes(study)),
        ("maps", ", ".join(ground.name for ground in study.grounds.values())),
        ("planners", ", ".join(who.called for who in study.planners)),
        ("laws", ", ".join(who.called for who in study.laws)),
        ("crowds", "; ".join(crowd_words(crowd.label) for crowd in study.crowds)),
        ("budget", ", ".join(budget) or "none"),
    ]
    return [(key, value) for key, value in rows if value]


def _discard(path: Path) -> None:
    """Throw a store away; no other file, and none that somebody writes to.

    Raises
    ------
    FileError : STORE_FORMAT: the file is no store; STORE_BUSY; STORE_WRITE.
    """
    from lampyris.study.store.file import look, sidecar
    from lampyris.study.store.lock import StoreLock

    if not os.path.lexists(path):
        return
    try:
        look(path)
    except FileError as fault:
        if fault.code not in ("STORE_DAMAGED", "STORE_VERSION"):
            raise
    hold = StoreLock(path)
    try:
        # The store itself last: killed before that, `--fresh` finds it and begins again.
        for file in (sidecar(path, "-wal"), sidecar(path, "-shm"), path):
            file.unlink(missing_ok=True)
    except OSError as error:
        raise FileError("STORE_WRITE", error.strerror or str(error), where=str(path)) from None
    finally:
        hold.release(remove=True)


def _tell(study: Study, store: Store, path: Path, out: Outputs, *, new: int, seconds: float) -> int:
    """Write what was asked for and say how it went."""
    from lampyris.cli import study_show as show
    from lampyris.study.analysis.table import table_of

    table = table_of(study, store.scan())
    summary = write(study, table, out)
    counts = show.endings(table["ending"])
    if out.json:
        told = {**record(study, path), "notes": list(study.notes)}
        told |= {"done": len(table), "new": new, "endings": counts}
        told |= {"summary": summary.as_json(), "files": [str(f) for f in out.files]}
        verbs.print_json({**told, "timing": {"wall_s": seconds}})
        return 0
    with outputs.text_beside(*out.files):
        done = f"{len(table):,} of {len(study):,} runs: {show.told(counts)}"
        text.line(f"{done}; {new:,} new, {show.clock(seconds)}")
        show.summary(summary)
        out.tell()
    return 0


def record(study: Study, path: Path) -> dict[str, Any]:
    """What a study is, for machines."""
    return {
        "study": study.name,
        "kind": study.kind,
        "store": str(path),
        "runs": len(study),
        "maps": len(study.grounds),
        "queries": len(study.worlds),
        "crowds": [crowd.label for crowd in study.crowds],
        "seeds": len(study.seeds),
        "planners": [who.called for who in study.planners],
        "laws": [who.called for who in study.laws],
        "budget": {"expansions": study.expansions, "seconds": study.seconds},
    }


def summary_of(study: Study, table: ResultTable, reference: str | None = None) -> Summary:
    """The summary of a table."""
    from lampyris.study.analysis.runs import runs_of
    from lampyris.study.analysis.summary import summarise

    return summarise(runs_of(study, table.records()), reference=reference)


def write(study: Study, table: ResultTable, out: Outputs) -> Summary:
    """Write the files that were asked for; the summary."""
    with verbs._working("counting", quiet=out.json):
        summary = summary_of(study, table, out.reference)
        if out.csv is not None:
            from lampyris.study.analysis.export import write_csv

            with outputs.place(out.csv) as place:
                write_csv(place, table, timing=out.timing)
        if out.parquet is not None:
            from lampyris.study.analysis.export import write_parquet

            write_parquet(out.parquet, table, timing=out.timing)
        if out.latex is not None:
            from lampyris.study.analysis.export import write_latex
            from lampyris.study.analysis.summary_tables import tabs

            with outputs.place(out.latex) as place:
                write_latex(place, tabs(summary))
    if out.report is not None:
        from lampyris.study.page.page import write_page

        with verbs._working("writing the page", quiet=out.json):
            write_page(out.report, study, table, films=out.films, timing=out.timing, reference=out.reference)
    return summary
