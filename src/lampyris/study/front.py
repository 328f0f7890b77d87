"""Studies at the front door: run one from Python, with a store or without."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any

from lampyris.errors import SettingError, callable_or_none, file_name
from lampyris.study.analysis.table import ResultTable, table_of
from lampyris.study.design.row import Row
from lampyris.study.design.study import Study
from lampyris.study.execution import run as running
from lampyris.study.execution.execution import Execution, Progress


def run_study(
    study: Study | str | os.PathLike[str],
    store: str | os.PathLike[str] | None = None,
    *,
    workers: int = 1,
    dask: str | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> ResultTable:
    """Run a study, or the runs that its store lacks, and return the table of its results.

    Parameters
    ----------
    study : a study, a study file, or the name of a bundled study.
    store : where results are kept, as `lampyris study` keeps them: a run that is there is not run again.
        None: in memory only.
    workers : processes; with more than 1 the calling script needs the usual ``if __name__ == "__main__"``.
    dask : address of a Dask cluster, instead of processes.
    progress : called with the progress.

    Raises
    ------
    LampyrisError : of the file, of the store (another study's, damaged, in use), of the cluster.

    Examples
    --------
    >>> import lampyris
    >>> from pathlib import Path
    >>> _ = Path("s.yaml").write_text("{version: 1, maps: [{bundled: guide}], planners: [astar, gso]}")
    >>> table = lampyris.run_study("s.yaml")
    >>> len(table)
    8
    """
    from lampyris.study.design.study_file import load_study

    asked: Any = load_study(study) if isinstance(study, str | os.PathLike) else study
    if not isinstance(asked, Study):
        what = f"a {type(asked).__name__}"
        raise SettingError("TYPE", what, where="study", allowed="a Study, a file or a ready study's name")
    callable_or_none("progress", progress)
    where = Execution(workers=workers, dask=dask)
    if store is None:
        rows: dict[str, Row] = {}

        def remember(some: Sequence[Row]) -> None:
            rows.update((row.key, row) for row in some)

        running.run(asked, remember, where=where, progress=progress)
        return table_of(asked, rows)
    from lampyris.study.store.store import open_for

    with open_for(file_name("store", store), asked) as kept:

        def keep(some: Sequence[Row]) -> None:
            kept.add(some)

        running.run(asked, keep, done=kept.keys(), where=where, progress=progress)
        return table_of(asked, kept.scan())
