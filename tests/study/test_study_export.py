"""Exports: what is written is what is in the table, the same bytes each time, and whole or not at all."""

from __future__ import annotations

import csv
import io
import os
import re
import sys
import threading
from pathlib import Path
from typing import Any

import pytest
from store_samples import names, rows, study

from lampyris.errors import LampyrisError, UsageError
from lampyris.report.html.table import Tab
from lampyris.study.analysis import export
from lampyris.study.analysis.export import latex, write_csv, write_latex, write_parquet
from lampyris.study.analysis.table import ResultTable, table_of
from lampyris.study.design.row import Row

HARD = [
    "",
    "a,b",
    'say "so"',
    "two\nlines",
    "cr\rlf\r\n",
    " spaced ",
    "=1+1",
    "+x",
    "-y",
    "@z",
    "\t",
    "é \u2028 \x00",
    "#;'",
]


def sample(more: dict[str, Any] | None = None, **study_words: Any) -> ResultTable:
    of = study(**study_words)
    given = rows(of)
    given = [
        Row(r.key, r.ending, {**r.metrics, **(more or {})}, r.timing, HARD[k % len(HARD)])
        for k, r in enumerate(given)
    ]
    return table_of(of, given)


def back(text: str, like: Any) -> Any:
    """A CSV cell as the type it had."""
    if isinstance(like, bool):
        return {"true": True, "false": False}[text]
    if like is None:
        return None if text == "" else text
    if isinstance(like, str) and like[:1] in ("=", "+", "-", "@", "\t", "\r"):
        assert text[0] == "'"
        text = text[1:]
    return type(like)(text)


# ---- CSV --------------------


@pytest.mark.parametrize("timing", [False, True])
def test_csv_gives_every_value_back(tmp_path: Path, timing: bool) -> None:
    table = sample()
    write_csv(tmp_path / "t.csv", table, timing=timing)
    text = (tmp_path / "t.csv").read_bytes().decode()
    header, *lines = csv.reader(io.StringIO(text, newline=""), strict=True)
    assert tuple(header) == table.names(timing=timing)
    assert ("cpu_s" in header) == timing
    assert len(lines) == len(table)
    for line, want in zip(lines, table.lines(timing=timing), strict=True):
        found = tuple(back(cell, like) for cell, like in zip(line, want, strict=True))
        assert repr(found) == repr(want)
    assert text.endswith("\n")
    assert "\r\n" not in text.replace("cr\rlf\r\n", "")
    assert names(tmp_path) == ["t.csv"]


def test_csv_without_timing_does_not_know_how_long_it_took(tmp_path: Path) -> None:
    of = study()
    slow = [Row(r.key, r.ending, r.metrics, {"cpu_s": 9.0, "strange_s": 1.0}, r.error) for r in rows(of)]
    for name, given in (("a", rows(of)), ("b", slow)):
        write_csv(tmp_path / name, table_of(of, given))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_what_a_spreadsheet_would_calculate_is_text_to_it(tmp_path: Path) -> None:
    """No cell begins as a formula, in quotes or not; numbers below zero are numbers still."""
    write_csv(tmp_path / "t.csv", sample())
    text = (tmp_path / "t.csv").read_text(encoding="utf-8")
    for word in ("=1+1", "+x", "-y", "@z"):
        assert f",'{word}," in text
    for line in csv.reader(io.StringIO(text, newline=""), strict=True):
        for cell in line:
            assert cell[:1] not in ("=", "+", "@", "\t", "\r")
            assert cell[:1] != "-" or float(cell) <= 0


def test_chunks_do_not_show(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    table = sample()
    write_csv(tmp_path / "a", table)
    monkeypatch.setattr(export, "CHUNK", 7)
    write_csv(tmp_path / "b", table)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


# ---- Parquet --------------------


def test_parquet_gives_every_value_back_in_fixed_types(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = sample({"arrived": True, "collisions": 0, "alpha": 2, "beta": 0.5, "gamma": "w", "delta": 2**80})
    write_parquet(tmp_path / "t", table, timing=True)
    found = parquet.read_table(tmp_path / "t")
    assert tuple(found.column_names) == table.names(timing=True)
    types = {f.name: str(f.type) for f in found.schema}
    want = {
        "index": "int64", "key": "string", "seed": "int64", "published": "double", "reproducible": "bool",
        "found": "bool", "arrived": "bool", "collisions": "int64", "hits": "int64", "cost": "double",
        "gap": "double", "outcome": "string", "expansions": "int64", "cpu_s": "double", "memory_b": "double",
        "reference_ok": "bool", "alpha": "int64", "beta": "double", "gamma": "string", "delta": "string",
    }  # fmt: skip
    assert {n: types[n] for n in want} == want
    for name in table.columns:
        column = [str(v) for v in table[name]] if name == "delta" else table[name]
        assert found[name].to_pylist() == column, name


def test_parquet_types_do_not_depend_on_what_is_there(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    schemas = []
    for k, table in enumerate((sample(), table_of(study(), {}), table_of(study(), rows(study())[:1]))):
        write_parquet(tmp_path / str(k), table)
        schemas.append(parquet.read_schema(tmp_path / str(k)))
    assert schemas[0] == schemas[1] == schemas[2]


def test_parquet_is_the_same_bytes_each_time(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    for name in ("a", "b"):
        write_parquet(tmp_path / name, sample())
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_columns_whose_values_do_not_fit_their_name_are_still_written(tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    of = study(1)
    values: list[dict[str, Any]] = [
        {"found": 1, "cost": 2**60, "ticks": 2.5, "mix": 1},
        {"found": False, "cost": 1.5, "ticks": 1, "mix": True},
        {"mix": "x"}, {"mix": 0.5},
    ]  # fmt: skip
    given = [Row(job.key, "done", v) for job, v in zip(of.jobs(), values, strict=True)]
    write_parquet(tmp_path / "t", table_of(of, given))
    found = parquet.read_table(tmp_path / "t")
    assert found["found"].to_pylist() == ["1", "false", None, None]
    assert found["cost"].to_pylist() == [str(2**60), "1.5", None, None]
    assert found["ticks"].to_pylist() == [2.5, 1.0, None, None]
    assert found["mix"].to_pylist() == ["1", "true", "x", "0.5"]


def test_parquet_without_pyarrow_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(UsageError, match=r"pip install 'lampyris\[parquet\]'"):
        write_parquet(tmp_path / "t", sample())
    assert names(tmp_path) == []


# ---- LaTeX --------------------

TAB = Tab(
    "way_1", "Ways & means", ("planner", "cost [cells]", "gap (%)"),
    (
        ("a_star {x}", 10.25, -0.5), ("[opt] 50% \\ #1 $ ~ ^", None, 3),
        ("1.2 ± 0.1 < 2 | é", float("nan"), 12.0),
    ),
    "30 queries, 10 seeds.", digits=(None, 1, 2),
)  # fmt: skip


def test_latex_is_a_booktabs_table(tmp_path: Path) -> None:
    assert latex(TAB).splitlines() == [
        r"\begin{table}",
        r"  \centering",
        r"  \caption{Ways \& means. 30 queries, 10 seeds.}",
        r"  \label{tab:way-1}",
        r"  \begin{tabular}{lrr}",
        r"    \toprule",
        r"    planner & cost {[}cells{]} & gap (\%) \\",
        r"    \midrule",
        r"    a\_star \{x\} & 10.2 & $-$0.50 \\",
        r"    {[}opt{]} 50\% \textbackslash{} \#1 \$ \textasciitilde{} \textasciicircum{} & -- & 3 \\",
        r"    1.2 $\pm$ 0.1 \textless{} 2 \textbar{} é & -- & 12.00 \\",
        r"    \bottomrule",
        r"  \end{tabular}",
        r"\end{table}",
    ]
    write_latex(tmp_path / "t.tex", TAB)
    assert (tmp_path / "t.tex").read_text(encoding="utf-8") == "% needs \\usepackage{booktabs}\n" + latex(TAB)
    write_latex(tmp_path / "t.tex", [TAB, TAB])
    assert (tmp_path / "t.tex").read_text(encoding="utf-8").count("\\begin{table}") == 2


def test_no_text_is_obeyed_by_latex() -> None:
    every = "".join(map(chr, range(0x250)))
    text = latex(Tab("n", every, (every,), ((every,),), every))
    body = re.sub(r"\\(begin|end|centering|caption|label|toprule|midrule|bottomrule)\b", "", text)
    known = (
        r"\\(textbackslash|textasciitilde|textasciicircum|textless|textgreater|textbar)\{\}|\\[{}&%$#_]|\\\\"
    )
    rest = re.sub(r"\$(\\pm|\\times|-)\$|" + known, "", body)
    assert not set(rest) & set("\\%$#_~^&")
    assert rest.count("{") == rest.count("}")
    assert all(c.isprintable() or c == "\n" for c in text)


# ---- whole files --------------------


def test_a_pipe_is_written_to_and_stays_a_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    got: list[bytes] = []
    reader = threading.Thread(target=lambda: got.append((tmp_path / "pipe").read_bytes()))
    reader.start()
    write_csv(tmp_path / "pipe", sample())
    reader.join()
    write_csv(tmp_path / "file", sample())
    assert got == [(tmp_path / "file").read_bytes()]
    assert (tmp_path / "pipe").is_fifo()


@pytest.mark.parametrize("write", [write_csv, write_parquet, lambda path, _: write_latex(path, TAB)])
def test_what_the_system_refuses_is_one_clear_line(tmp_path: Path, write: Any) -> None:
    (tmp_path / "folder").mkdir()
    for path in (
        tmp_path / "no" / "t",
        tmp_path / "folder",
        "/dev/full",
        tmp_path / ("x" * 300),
        tmp_path / "\0",
    ):
        with pytest.raises(LampyrisError) as caught:
            write(path, sample())
        assert caught.value.code == "FILE_WRITE"
        assert str(caught.value).isprintable()
    assert names(tmp_path) == ["folder"]
