"""``lampyris study``: many runs from one small file, kept, counted and compared.

``lampyris study STUDY`` runs it; a first word that is an action does that.
Heavy modules are imported when the verb runs, so that --help is instant.
"""

from __future__ import annotations

import json
import sys
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperGroup

from lampyris.cli import outputs, text
from lampyris.cli.option_errors import Command
from lampyris.cli.options import AllowOutside, Force, Json, MaxCells
from lampyris.cli.text import print_json, print_notes
from lampyris.errors import UsageError

if TYPE_CHECKING:
    from lampyris.cli.verbs.study.files import StudyOutputs
    from lampyris.study.analysis.table import ResultTable
    from lampyris.study.design.study import Study


class _StudyOrAction(TyperGroup):
    """A first word that is no action is the name of a study, or a file."""

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """``study FILE`` is ``study run FILE``, its options before or behind the name."""
        # Typer has its own click in new releases and the installed one in old ones: no type names both.
        if args and args[0] not in self.commands and args[0] not in ctx.help_option_names:
            args = ["run", *args]
        return super().parse_args(ctx, args)


app = typer.Typer(
    cls=_StudyOrAction,
    no_args_is_help=True,
    options_metavar="",
    subcommand_metavar="STUDY [OPTIONS] | ACTION ...",
    help="Run a study: maps x queries x planners x speed laws x traffic x seeds, in one store; an "
    "interrupted study can be resumed.",
    epilog="`lampyris study run --help` shows the options of `lampyris study STUDY`, `lampyris study list` "
    "the bundled studies. Exit codes: 0 every run has its row (failures too), 2 wrong "
    "arguments, 3 bad file or store, 5 limit, 130 interrupted (finished runs are kept).",
)

StoreFile = Annotated[
    Path,
    typer.Argument(metavar="STORE", help="The store of a study, as `lampyris study` writes it (.study.db)."),
]
CsvOut = Annotated[
    Path | None, typer.Option("--csv", metavar="FILE", help="Write a row for every run (.csv).")
]
ParquetOut = Annotated[
    Path | None,
    typer.Option("--parquet", metavar="FILE", help="The same as Parquet (the extra `parquet`)."),
]
LatexOut = Annotated[
    Path | None,
    typer.Option("--latex", metavar="FILE", help="Write the summary's tables for a paper (.tex)."),
]
Timing = Annotated[
    bool,
    typer.Option(
        "--timing",
        help="Include time and memory in the output: it is then no longer the same bytes each time.",
    ),
]
Films = Annotated[bool, typer.Option("--films/--no-films", help="Whether the report includes a few films.")]

Reference = Annotated[
    str | None,
    typer.Option(
        "--reference", metavar="NAME", help="The planner the others are compared with (default: the first)."
    ),
]


@app.command(cls=Command)
def run(
    study: Annotated[
        str,
        typer.Argument(metavar="STUDY", help="A study file (.yaml, .json), or the name of a bundled study."),
    ],
    store: Annotated[
        Path | None,
        typer.Option(
            "--store",
            metavar="FILE",
            help="Where results are stored (default: NAME.study.db in this folder).",
        ),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            "--workers", metavar="N", min=1, help="Number of worker processes (default: one per core)."
        ),
    ] = None,
    dask: Annotated[
        str | None,
        typer.Option(
            "--dask",
            metavar="tcp://HOST:PORT",
            help="Run on an existing Dask cluster (the extra `dask`).",
        ),
    ] = None,
    data: Annotated[
        Path | None,
        typer.Option(
            "--data", metavar="DIR", help="Folder of the maps and .scen files that the study names."
        ),
    ] = None,
    fresh: Annotated[bool, typer.Option("--fresh", help="Start over: discard what the store holds.")] = False,
    again: Annotated[
        str | None,
        typer.Option(
            "--again",
            metavar="ENDINGS",
            help="Repeat the runs with these endings: failed, timeout, refused, separated by commas.",
        ),
    ] = None,
    report: Annotated[
        Path | None, typer.Option("--report", metavar="FILE", help="Write the report (.html).")
    ] = None,
    films: Films = True,
    reference: Reference = None,
    csv: CsvOut = None,
    parquet: ParquetOut = None,
    latex: LatexOut = None,
    timing: Timing = False,
    allow_outside: AllowOutside = False,
    max_cells: MaxCells = None,
    dry_run: Annotated[
        bool,
        typer.Option("--dry-run", help="Print what would be run and where it would be stored; run nothing."),
    ] = False,
    json_: Json = False,
    force: Force = False,
) -> None:
    """Run a study, or resume it; the word `run` may be omitted."""
    from lampyris.cli.verbs.study.files import StudyOutputs
    from lampyris.cli.verbs.study.running import StudyRequest, run_study

    endings = () if again is None else tuple(word.strip() for word in again.split(","))
    request = StudyRequest(
        study, store, data, allow_outside, max_cells, workers, dask, fresh, dry_run, endings
    )
    out = StudyOutputs(json_, report, films, reference, csv, parquet, latex, timing, force)
    raise typer.Exit(run_study(request, out))


@app.command("list", cls=Command)
def list_(json_: Json = False) -> None:
    """List the bundled studies."""
    from lampyris.cli.verbs.study import tables
    from lampyris.study.design import bundled

    rows = [{"name": name, "about": bundled.about(name)} for name in bundled.names()]
    if json_:
        print_json({"studies": rows})
    else:
        tables.print_ready(rows)


@app.command(cls=Command)
def write(
    ready: Annotated[str, typer.Argument(metavar="READY", help="A name that `lampyris study list` lists.")],
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The copy (.yaml).")],
    force: Force = False,
) -> None:
    """Write a copy of a bundled study for editing."""
    from lampyris.io.files import write_file
    from lampyris.study.design import bundled

    content = bundled.text(ready)
    outputs.check_outputs(force, study=file)
    write_file(file, content.encode())
    print(f"wrote {file}")


@app.command(cls=Command)
def show(store: StoreFile, json_: Json = False) -> None:
    """Show the contents of a store: the study, its progress and its results so far."""
    _show_store(store, json_)


@app.command(cls=Command)
def export(
    store: StoreFile,
    csv: CsvOut = None,
    parquet: ParquetOut = None,
    latex: LatexOut = None,
    timing: Timing = False,
    json_: Json = False,
    force: Force = False,
) -> None:
    """Export a store as CSV, Parquet or LaTeX; the output depends only on the store."""
    from lampyris.cli.verbs.study.files import StudyOutputs

    out = StudyOutputs(json_, csv=csv, parquet=parquet, latex=latex, timing=timing, force=force)
    _export(store, out)


@app.command(cls=Command)
def report(
    store: StoreFile,
    page: Annotated[
        Path | None, typer.Argument(metavar="[PAGE]", help="The page (default: the store's name, .html).")
    ] = None,
    films: Films = True,
    reference: Reference = None,
    timing: Annotated[
        bool, typer.Option("--timing", help="With seconds and memory: no longer the same bytes each time.")
    ] = False,
    force: Force = False,
) -> None:
    """Write the report of a store: tables, figures, a few films; one file without scripts."""
    from lampyris.cli.verbs.study.files import StudyOutputs

    file = page_of(store) if page is None else page
    out = StudyOutputs(report=file, films=films, reference=reference, timing=timing, force=force)
    _export(store, out)


@app.command(cls=Command)
def film(
    store: StoreFile,
    row: Annotated[int, typer.Argument(metavar="ROW", help="Which run: its `index` in the CSV.")],
    out: Annotated[Path, typer.Argument(metavar="FILE", help="The film (.webp or .gif).")],
    force: Force = False,
) -> None:
    """Repeat one run of a store and draw it as a film."""
    _film(store, row, out, force=force)


@app.command(cls=Command)
def repair(
    store: StoreFile,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="FILE",
            help="The repaired store (default: in place of the old one, which is kept).",
        ),
    ] = None,
    study: Annotated[
        str | None,
        typer.Option("--study", metavar="STUDY", help="The study file, if the store's own copy is damaged."),
    ] = None,
    data: Annotated[
        Path | None, typer.Option("--data", metavar="DIR", help="Folder of that study's files.")
    ] = None,
    json_: Json = False,
) -> None:
    """Keep every readable run of a damaged store; the study repeats the others."""
    _repair_store(store, out, study, data, json_)


@app.command(cls=Command)
def schema() -> None:
    """Print the JSON Schema of study files."""
    from lampyris.study.design.study_file import json_schema

    sys.stdout.write(json.dumps(json_schema(), indent=2) + "\n")


def _stored(path: Path) -> tuple[Study, ResultTable]:
    """What a store holds; it is not written to."""
    from lampyris.study.analysis.table import table_of
    from lampyris.study.store.store import Store

    with Store.open(path, writable=False) as store:
        study = store.study()
        return study, table_of(study, store.scan())


def _show_store(path: Path, as_json: bool) -> None:
    """Print what a store holds."""
    from lampyris.cli.verbs.study import files, tables

    study, table = _stored(path)
    summary = files.summary_of(study, table)
    counts = tables.endings(table["ending"])
    if as_json:
        record = {**tables.record(study, path), "done": len(table), "endings": counts}
        print_json({**record, "summary": summary.as_json()})
        return
    there = f"{len(table):,} of {len(study):,}: {tables.endings_text(counts)}"
    text.facts("", [*tables.facts(study), ("there", there)])
    tables.print_summary(summary)


def _export(path: Path, out: StudyOutputs) -> None:
    """Write what a store holds; for ``study export`` and ``study report``."""
    from lampyris.cli.verbs.study import files, tables

    if not out.files:
        raise UsageError("OPTIONS", "nothing to write", allowed="--csv, --parquet or --latex FILE")
    out.check(path)
    study, table = _stored(path)
    files.write_files(study, table, out)
    if out.json:
        written = [str(f) for f in out.files]
        print_json({**tables.record(study, path), "done": len(table), "files": written})
        return
    if table.missing:
        print_notes((f"{len(table):,} of {len(study):,} runs are there; the others are left out",))
    with outputs.text_beside(*out.files):
        out.print_written()


def page_of(store: Path) -> Path:
    """The default page of a store: its name, in the working folder."""
    return Path(f"{store.name.removesuffix('.db').removesuffix('.study')}.html")


def _film(store: Path, row: int, out: Path, *, force: bool) -> None:
    from lampyris.errors import LimitError, SettingError
    from lampyris.study.execution.worker import TimeUp
    from lampyris.study.page.films import draw_run
    from lampyris.study.store.store import Store

    outputs.check_outputs(force, film=out)
    with Store.open(store, writable=False) as there:
        study = there.study()
    if not 0 <= row < len(study):
        allowed = f"a whole number, 0 to {len(study) - 1:,}: the column `index`"
        raise SettingError.of("ROW", "row", f"{row}", allowed=allowed)
    job = next(one for one in study.jobs() if one.index == row)
    try:
        draw_run(job, study, out)
    except TimeUp:
        allowed = f"{study.seconds:g} s, the study's budget"
        raise LimitError("SECONDS", "the run was not done in time", allowed=allowed) from None
    outputs.print_written(out)


def _repair_store(path: Path, out: Path | None, study: str | None, data: Path | None, as_json: bool) -> None:
    """Keep every run of a damaged store that can be read."""
    from lampyris.study.design.study_file import load_study
    from lampyris.study.store.repair import repair as repair_store

    if data is not None and study is None:
        raise UsageError("OPTIONS", "--data without --study", allowed="the study whose files are there")
    repaired = repair_store(path, out, study=None if study is None else load_study(study, data=data))
    if as_json:
        print_json({"store": str(out or path), **asdict(repaired)})
        return
    print(f"{out or path}: {repaired.kept:,} runs kept, {repaired.lost:,} lost")
    print_notes(tuple(repaired.notes))
