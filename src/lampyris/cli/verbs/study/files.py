"""Files that a study writes: tables, the page, and the checks of their names."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from lampyris.cli import outputs
from lampyris.cli.progress import working
from lampyris.errors import UsageError

if TYPE_CHECKING:
    from lampyris.study.analysis.findings import Summary
    from lampyris.study.analysis.table import ResultTable
    from lampyris.study.design.study import Study


@dataclass(frozen=True)
class StudyOutputs:
    """What the actions of ``study`` print and write."""

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

    def print_written(self) -> None:
        """Print which files were written."""
        for file in self.files:
            if file != outputs.STDOUT:
                print(f"wrote {file}")

    def check(self, *others: Path) -> None:
        """Reject before any work what could not be written at the end; ``others`` are not to be overwritten."""
        self.check_apart(*others)
        outputs.check_outputs(
            self.force, json=self.json, csv=self.csv, parquet=self.parquet, latex=self.latex,
            report=self.report,
        )  # fmt: skip
        if self.parquet is not None:
            demand_package("pyarrow", "--parquet", "parquet", "PARQUET")

    def check_apart(self, *others: Path) -> None:
        """Reject outputs that would overwrite an input.

        Raises
        ------
        UsageError : OPTIONS.
        """
        for file in self.files:
            if any(os.path.realpath(file) == os.path.realpath(other) for other in others):
                raise UsageError("OPTIONS", f"{file} is read and written", allowed="a file of its own")


def demand_package(package: str, option: str, extra: str, code: str) -> None:
    """Reject an option whose package is not installed."""
    if find_spec(package) is None:
        raise UsageError(
            code, f"needs the package {package}", where=option, todo=f"pip install 'lampyris[{extra}]'"
        )


def summary_of(study: Study, table: ResultTable, reference: str | None = None) -> Summary:
    """The summary of a table."""
    from lampyris.study.analysis.runs import runs_of
    from lampyris.study.analysis.summary import summarise

    return summarise(runs_of(study, table.records()), reference=reference)


def write_files(study: Study, table: ResultTable, out: StudyOutputs) -> Summary:
    """Write the requested files and return the summary."""
    with working("counting", quiet=out.json):
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
            from lampyris.study.analysis.fleet_tables import tables_of

            with outputs.place(out.latex) as place:
                write_latex(place, tables_of(summary))
    if out.report is not None:
        from lampyris.study.page.page import write_page

        with working("writing the page", quiet=out.json):
            write_page(out.report, study, table, films=out.films, timing=out.timing, reference=out.reference)
    return summary
