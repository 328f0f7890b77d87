"""Tables: rows in the order of the jobs, the same anyone who ran them and in whatever order."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from store_samples import filled, rows, study

from lampyris.report.data.measures import METRICS
from lampyris.study.analysis.table import LABELS, TIMING, ResultTable, code_of, table_of
from lampyris.study.design.row import Row
from lampyris.study.store.store import Store


def same(a: ResultTable, b: ResultTable) -> bool:
    """Whether two tables are equal, types and all."""
    return repr((a.columns, a.metrics, a.timing, a.asked)) == repr((b.columns, b.metrics, b.timing, b.asked))


def test_columns_stand_in_the_documented_order() -> None:
    of = study()
    table = table_of(of, {row.key: row for row in rows(of)})
    first = ("index", "key", *LABELS, "ending", "error", "reproducible")
    assert tuple(table.columns) == (*first, *METRICS, *TIMING)
    assert table.names() == (*first, *METRICS)
    assert table.names(timing=True) == tuple(table.columns)
    assert len(table) == table.asked == 40
    assert table.missing == table.strange == 0


def test_every_value_stands_in_its_row_and_nothing_else_does() -> None:
    of = study()
    given = rows(of)
    table = table_of(of, given)
    for k, job in enumerate(of.jobs()):
        assert [table[n][k] for n in ("index", "key", "ending", "error")] == [
            k, job.key, given[k].ending, given[k].error,
        ]  # fmt: skip
        assert {n: table[n][k] for n in LABELS} == job.labels
        for names, values in ((METRICS, given[k].metrics), (TIMING, given[k].timing)):
            assert {n: table[n][k] for n in names} == {n: values.get(n) for n in names}
            assert all(type(table[n][k]) is type(values[n]) for n in values)
    assert table["planner"][:2] == ["astar", "glowworms, 8"]
    assert set(table["published"]) == {9.0}
    assert [tuple(line) for line in table.lines()][3] == tuple(table[n][3] for n in table.names())


def test_the_order_in_which_rows_come_does_not_matter(tmp_path: Path) -> None:
    of = study()
    given = rows(of)
    want = table_of(of, given)
    rng = np.random.Generator(np.random.PCG64(3))
    for _ in range(5):
        mixed = [given[k] for k in rng.permutation(len(given)).tolist()]
        assert same(table_of(of, mixed), want)
        assert same(table_of(of, {row.key: row for row in mixed}), want)
    filled(tmp_path / "a", of, 7, mixed)
    with Store.open(tmp_path / "a", writable=False) as store:
        assert same(table_of(store.study(), store.rows()), want)
        assert same(table_of(store.study(), store.scan()), want)


def test_jobs_without_a_row_are_counted_and_rows_without_a_job_too() -> None:
    of = study()
    given = rows(of)
    other = [Row("0" * 64, "done"), Row("f" * 64, "failed", {"strange": 1.0})]
    table = table_of(of, [*given[30:33], *other, given[2]])
    assert table["index"] == [2, 30, 31, 32]
    assert (table.asked, table.missing, table.strange) == (40, 36, 2)
    assert "strange" not in table.columns
    empty = table_of(of, {})
    assert len(empty) == 0
    assert empty.missing == 40
    assert list(empty.columns) == list(table.columns)
    assert list(empty.lines()) == []


def test_names_that_come_late_are_none_before_and_stand_after_the_known() -> None:
    of = study(1)
    given = [
        Row(
            job.key,
            "done",
            {"zeta": k, "cost": 1.0} if k == 2 else {"alpha": "x"} if k == 1 else {},
            {"gpu_s": 1.0},
        )
        for k, job in enumerate(of.jobs())
    ]
    table = table_of(of, given)
    assert table.metrics == (*METRICS, "alpha", "zeta")
    assert table.timing == (*TIMING, "gpu_s")
    assert table["zeta"] == [None, None, 2, None]
    assert table["alpha"] == [None, "x", None, None]
    assert table["cost"] == [None, None, 1.0, None]
    assert table["cpu_s"] == [None] * 4


def test_runs_under_a_budget_in_seconds_are_marked() -> None:
    for seconds, word in ((None, True), (2.0, False)):
        of = study(seconds=seconds)
        assert set(table_of(of, rows(of))["reproducible"]) == {word}


def test_records_are_the_rows_again() -> None:
    of = study()
    given = [
        Row(r.key, "refused", r.metrics, r.timing, "MOVES: unknown") if k == 4 else r
        for k, r in enumerate(rows(of))
    ]
    for k, (index, ending, code, numbers) in enumerate(table_of(of, given).records()):
        assert (index, ending) == (k, given[k].ending)
        assert code == ("MOVES" if k == 4 else "X" if given[k].error else "")
        found = {n: v for n, v in numbers.items() if v is not None}
        assert found == {n: v for n, v in {**given[k].metrics, **given[k].timing}.items() if v is not None}


@pytest.mark.parametrize(
    ("error", "code"),
    [
        ("", ""), ("error[NO_PATH]: map: there is none", "NO_PATH"), ("SECONDS: more than 2 s", "SECONDS"),
        ("FAULT: ValueError: x", "FAULT"), ("no code: here", ""), ("WORKER_DIED", "WORKER_DIED"),
        ("A B: c", ""),
    ],
)  # fmt: skip
def test_codes_of_errors(error: str, code: str) -> None:
    assert code_of(error) == code


@pytest.mark.nightly
def test_a_table_of_a_hundred_thousand_rows() -> None:
    of = study(25_000)
    given = rows(of)
    table = table_of(of, reversed(given))
    assert table["key"] == [row.key for row in given]
    assert table["cost"] == [row.metrics["cost"] for row in given]
