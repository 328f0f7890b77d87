"""Work: everything that ``lampyris reproduce`` does, from the data to the page."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import MappingProxyType

from lampyris.errors import FileError
from lampyris.io.atomic_write import whole_file
from lampyris.reproduce.page import page, story
from lampyris.reproduce.runs import measured
from lampyris.reproduce.runs.measured import Costs
from lampyris.reproduce.runs.results import Results, results
from lampyris.reproduce.runs.runs import RunProgress, Tables, run_all
from lampyris.reproduce.tables import comparison, printed, printed_data
from lampyris.reproduce.tables.claims import Said
from lampyris.reproduce.tables.verdict import KINDS, Verdict, count
from lampyris.study.analysis.export import write_csv
from lampyris.study.analysis.table import ResultTable


@dataclass(frozen=True, slots=True, eq=False)
class Report:
    """What came of it.

    Parameters
    ----------
    tables : verdicts by printed table, in the order of the dissertation; ``text`` is its claims.
    counts : how many of each verdict, over all tables.
    conclusion : what AD-GSO gains and what it does not, one paragraph.
    runs : our runs by study.
    page, files : the page; it and all else that was written.
    """

    tables: Mapping[str, tuple[Verdict, ...]]
    counts: Mapping[str, int]
    conclusion: str
    runs: Mapping[str, int]
    page: Path
    files: tuple[Path, ...]

    @property
    def figures(self) -> int:
        """How many printed figures there are."""
        return sum(self.counts.values())

    def by_table(self) -> dict[str, dict[str, int]]:
        """How many of each verdict, table by table."""
        return {name: count(some) for name, some in self.tables.items()}


def reproduce(
    out: Path,
    *,
    workers: int = 2,
    quick: bool = False,
    progress: Callable[[RunProgress], None] | None = None,
) -> Report:
    """Judge every printed figure, run what can be run on our maps, and write the page.

    Parameters
    ----------
    out : a folder, made if it is not there. It gets ``index.html``, ``verdicts.csv``, ``verdicts.json``,
        ``claims_recomputed.csv``, and in ``runs`` the stores and tables of our runs: given again, what is in
        them is not run again. The page also tells of memory and times, which are measured each time.
    workers : processes.
    quick : fewer queries and seeds, in stores of their own.
    progress : is called with how far the runs are.

    Raises
    ------
    LampyrisError
        FILE_WRITE and other refusals of the system; a store that is damaged or in use; LIMIT and the like of
        studies.
    KeyboardInterrupt
        Ctrl-C: what was run stays.
    """
    folder = out / "runs"
    tables = run_all(folder, workers=workers, quick=quick, progress=progress)
    found, costs = results(tables), measured.measure(quick)
    judged = judge(found, costs)
    asked = {name: len(some) for name, some in _named(tables).items()}
    files = [
        _write(out / "index.html", page.words(judged, found, costs, asked)),
        _write(out / "verdicts.csv", verdicts_csv(judged)),
        _write(out / "verdicts.json", verdicts_json(judged, found, costs)),
        _write(out / "claims_recomputed.csv", claims_csv(judged["text"])),
    ]
    for name, some in _named(tables).items():
        place = folder / f"{name}{'-quick' if quick else ''}.csv"
        write_csv(place, some)
        files.append(place)
    counts = count(v for some in judged.values() for v in some)
    return Report(
        judged,
        MappingProxyType(counts),
        story.conclusion(found, costs),
        MappingProxyType(asked),
        files[0],
        tuple(files),
    )


def _named(tables: Tables) -> Mapping[str, ResultTable]:
    return {"nt": tables.nt, "static": tables.static, "moving": tables.moving}


def judge(found: Results, costs: Costs) -> Mapping[str, tuple[Verdict, ...]]:
    """Every verdict, with what our runs have to say beside it."""
    tables = {name: printed.verdicts(name) for name in printed_data.tables()}
    tables["4.11"] = printed.whole("4.11", comparison.part_two(found.by_pair))
    answers = {"best-nt": story.best_nt(found), "storage": story.storage(costs)}
    tables["text"] = tuple(
        _answered(v, answers.get(row["id"]))
        for row, v in zip(printed_data.rows("text"), tables["text"], strict=True)
    )
    return MappingProxyType(tables)


def _answered(verdict: Verdict, said: Said | None) -> Verdict:
    if said is None:
        return verdict
    return replace(verdict, ours=said.ours, verdict=said.verdict, why=said.why)


FIELDS = ("table", "where", "printed", "ours", "verdict", "why")


def verdicts_csv(tables: Mapping[str, tuple[Verdict, ...]]) -> str:
    """Every verdict, a row each."""
    rows = [tuple(getattr(v, name) for name in FIELDS) for some in tables.values() for v in some]
    return _csv(FIELDS, rows)


def claims_csv(some: tuple[Verdict, ...]) -> str:
    """The claims of abstract, text and conclusion."""
    rows = [
        (row["where"], row["what"], v.printed, v.ours, v.verdict, v.why)
        for row, v in zip(printed_data.rows("text"), some, strict=True)
    ]
    return _csv(("where", "claim", "printed", "recomputed", "verdict", "why"), rows)


def _csv(head: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(rows)
    return out.getvalue()


def verdicts_json(tables: Mapping[str, tuple[Verdict, ...]], found: Results, costs: Costs) -> str:
    """Verdicts, counts, conclusion and measurements for machines."""
    whole = {
        "source": printed_data.source()["source"],
        "kinds": dict(KINDS),
        "counts": count(v for some in tables.values() for v in some),
        "conclusion": story.conclusion(found, costs),
        "measured": asdict(costs),
        "tables": {
            name: {"counts": count(some), "verdicts": [asdict(v) for v in some]}
            for name, some in tables.items()
        },
    }
    return json.dumps(whole, indent=1, ensure_ascii=False) + "\n"


def _write(place: Path, words: str) -> Path:
    """Whole or not at all."""
    try:
        place.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FileError("FILE_WRITE", error.strerror or str(error), where=str(place.parent)) from None
    with whole_file(place) as file:
        file.write(words.encode("utf-8"))
    return place
