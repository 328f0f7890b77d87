"""What the actions of ``lampyris study`` do: with a store, and with the studies that come ready."""

from __future__ import annotations

import sys
from dataclasses import asdict
from pathlib import Path

from lampyris.cli import outputs, text, verbs
from lampyris.cli import study_work as work
from lampyris.errors import UsageError
from lampyris.study.analysis.table import ResultTable
from lampyris.study.design.study import Study


def _stored(path: Path) -> tuple[Study, ResultTable]:
    """What a store holds; it is not written to."""
    from lampyris.study.analysis.table import table_of
    from lampyris.study.store.store import Store

    with Store.open(path, writable=False) as store:
        study = store.study()
        return study, table_of(study, store.scan())


def show(path: Path, as_json: bool) -> int:
    """``lampyris study show``. Returns the exit code."""
    from lampyris.cli import study_show

    study, table = _stored(path)
    summary = work.summary_of(study, table)
    counts = study_show.endings(table["ending"])
    if as_json:
        record = {**work.record(study, path), "done": len(table), "endings": counts}
        verbs.print_json({**record, "summary": summary.as_json()})
        return 0
    there = f"{len(table):,} of {len(study):,}: {study_show.told(counts)}"
    text.facts("", [*work.facts(study), ("there", there)])
    study_show.summary(summary)
    return 0


def export(path: Path, out: work.Outputs) -> int:
    """``lampyris study export`` and ``study report``. Returns the exit code."""
    if not out.files:
        raise UsageError("OPTIONS", "nothing to write", allowed="--csv, --parquet or --latex FILE")
    out.check(path)
    study, table = _stored(path)
    work.write(study, table, out)
    if out.json:
        files = [str(f) for f in out.files]
        verbs.print_json({**work.record(study, path), "done": len(table), "files": files})
        return 0
    if table.missing:
        verbs.remarks((f"{len(table):,} of {len(study):,} runs are there; the others are left out",))
    with outputs.text_beside(*out.files):
        out.tell()
    return 0


def page_of(store: Path) -> Path:
    """The page of a store if nobody names one: its name, in the working folder."""
    return Path(f"{store.name.removesuffix('.db').removesuffix('.study')}.html")


def repair(path: Path, out: Path | None, study: str | None, data: Path | None, as_json: bool) -> int:
    """``lampyris study repair``. Returns the exit code."""
    from lampyris.study.design.study_file import load_study
    from lampyris.study.store.repair import repair as mend

    if data is not None and study is None:
        raise UsageError("OPTIONS", "--data without --study", allowed="the study whose files are there")
    mended = mend(path, out, study=None if study is None else load_study(study, data=data))
    if as_json:
        verbs.print_json({"store": str(out or path), **asdict(mended)})
        return 0
    print(f"{out or path}: {mended.kept:,} runs kept, {mended.lost:,} lost")
    verbs.remarks(tuple(mended.notes))
    return 0


def list_ready(as_json: bool) -> int:
    """``lampyris study list``. Returns the exit code."""
    from lampyris.study.design import bundled

    rows = [{"name": name, "about": bundled.about(name)} for name in bundled.names()]
    if as_json:
        verbs.print_json({"studies": rows})
    else:
        from lampyris.cli import study_show

        study_show.ready(rows)
    return 0


def write(name: str, file: Path, force: bool) -> int:
    """``lampyris study write``. Returns the exit code."""
    from lampyris.io.files import write_file
    from lampyris.study.design import bundled

    words = bundled.text(name)
    outputs.check_outputs(force, study=file)
    write_file(file, words.encode())
    print(f"wrote {file}")
    return 0


def schema() -> int:
    """``lampyris study schema``. Returns the exit code."""
    import json

    from lampyris.study.design.study_file import json_schema

    sys.stdout.write(json.dumps(json_schema(), indent=2) + "\n")
    return 0
