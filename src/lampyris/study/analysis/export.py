"""Export: a table as CSV or Parquet for other programs, and tables for people as LaTeX.

The same table gives the same bytes, of Parquet with the same release of pyarrow. What depends on the machine
is left out unless asked for.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Iterator, Sequence
from importlib import import_module
from itertools import islice
from typing import Any

from lampyris.errors import UsageError
from lampyris.io.atomic_write import whole_file
from lampyris.report.html.table import DASH, Tab, Value
from lampyris.study.analysis.table import TIMING, ResultTable

CHUNK = 8192
"""Rows that are written at once, and of a group of rows in Parquet."""
_NAMES: dict[str, frozenset[str]] = {
    "bool_": frozenset(("reproducible", "found", "arrived", "reference_ok")),
    "int64": frozenset(
        ("index", "seed", "collisions", "hits", "near_misses", "turns", "iterations", "expansions", "replans",
         "path_switches", "ticks", "reversals", "robots", "sum_of_costs", "shortest", "lower_bound", "makespan", "first_cost")
    ),
    "float64": frozenset(
        ("published", "near_m", "length_cells", "length_m", "length_any_angle", "cost", "optimal", "gap",
         "cost_m", "lower_bound_m", "bound", "ratio",
         "cost_to_go", "time_s", "speed_mean", "speed_least", "turn_deg", "smoothness", "clearance_mean_m",
         "clearance_least_m", "waits", "path_switches_per_100", *TIMING)
    ),
    "string": frozenset(
        ("key", "map", "query", "traffic", "planner", "law", "ending", "error", "outcome", "improvements",
         "cost_by_s", "notes")
    ),
}  # fmt: skip
"""What pyarrow calls the type of a column, narrowest first, and the names that have it."""
_QUOTED = re.compile(r'[,"\r\n]|^ |\s$')
"""Text that stands in quotes: what CSV asks for, and what some readers would trim."""
_FORMULA = re.compile(r"[=+\-@\t\r]")
"""How text begins that a spreadsheet calculates, in quotes or not. An apostrophe before it makes it text."""


def write_csv(path: str | os.PathLike[str], table: ResultTable, *, timing: bool = False) -> None:
    r"""Write a table as CSV: RFC 4180 but for ``\n`` at the end of lines, UTF-8, a header.

    Numbers have all their digits, yes and no are ``true`` and ``false``, a value that is not defined is
    empty. The file is there whole or not at all; one that is there is replaced. Text that begins as
    formulas do (= + - @, a tab) has an apostrophe before it, which is not its own.

    Raises
    ------
    FileError : FILE_WRITE.
    """
    with whole_file(path) as file:
        file.write((",".join(map(_cell, table.names(timing=timing))) + "\n").encode())
        for lines in _chunks(table.lines(timing=timing)):
            file.write(
                "".join(",".join(map(_cell, line)) + "\n" for line in lines).encode("utf-8", "replace")
            )


def write_parquet(path: str | os.PathLike[str], table: ResultTable, *, timing: bool = False) -> None:
    """Write a table as Parquet: whole numbers int64, others double, words strings, yes and no bool.

    A column has the type of its name, whatever is in it; a name that is not of lampyris, the type that holds
    its values. The file is there whole or not at all; one that is there is replaced.

    Raises
    ------
    UsageError : PARQUET: pyarrow is not installed.
    FileError : FILE_WRITE.
    """
    try:
        pa: Any = import_module("pyarrow")
        pq: Any = import_module("pyarrow.parquet")
    except ImportError:
        raise UsageError(
            "PARQUET", "pyarrow is not installed", todo="pip install 'lampyris[parquet]'", setting="parquet"
        ) from None
    names = table.names(timing=timing)
    schema = pa.schema([pa.field(name, getattr(pa, _type(name, table[name]))()) for name in names])
    with (
        whole_file(path) as file,
        pq.ParquetWriter(file, schema, compression="zstd", version="2.6", store_schema=False) as writer,
    ):
        for at in range(0, len(table), CHUNK):
            parts = [
                pa.array(_fitted(table[name][at : at + CHUNK], field.type), field.type)
                for name, field in zip(names, schema, strict=True)
            ]
            writer.write_table(pa.Table.from_arrays(parts, schema=schema), row_group_size=CHUNK)


def write_latex(path: str | os.PathLike[str], tabs: Tab | Iterable[Tab]) -> None:
    """Write tables as LaTeX, for ``\\\\usepackage{booktabs}``; title and note are the caption.

    The file is there whole or not at all; one that is there is replaced.

    Raises
    ------
    FileError : FILE_WRITE.
    """
    some = (tabs,) if isinstance(tabs, Tab) else tabs
    text = "\n".join(latex(tab) for tab in some)
    with whole_file(path) as file:
        file.write(f"% needs \\usepackage{{booktabs}}\n{text}".encode("utf-8", "replace"))


def latex(tab: Tab) -> str:
    """A table as LaTeX, ending with a line's end."""
    lines = [
        "\\begin{table}",
        "  \\centering",
        f"  \\caption{{{_tex(_sentence(tab.title))}{' ' + _tex(tab.note) if tab.note else ''}}}",
        f"  \\label{{tab:{re.sub('[^A-Za-z0-9-]', '-', tab.name)}}}",
        f"  \\begin{{tabular}}{{{tab.align}}}",
        "    \\toprule",
        f"    {_row([_tex(name) for name in tab.header])}",
        "    \\midrule",
    ]
    for values, texts in zip(tab.rows, tab.texts(), strict=True):
        lines.append(f"    {_row([_number(v, t) for v, t in zip(values, texts, strict=True)])}")
    return "\n".join([*lines, "    \\bottomrule", "  \\end{tabular}", "\\end{table}"]) + "\n"


def _cell(value: Any) -> str:
    """A value as CSV holds it."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return "true" if value else "false"
    if not isinstance(value, str):
        return repr(value)
    text: str = f"'{value}" if _FORMULA.match(value) else value
    return '"' + text.replace('"', '""') + '"' if _QUOTED.search(text) else text


def _chunks(lines: Iterator[tuple[Any, ...]]) -> Iterator[list[tuple[Any, ...]]]:
    while some := list(islice(lines, CHUNK)):
        yield some


def _type(name: str, values: Sequence[Any]) -> str:
    """Type of a column: its name's, or if a value does not fit, the narrowest that holds them all."""
    own = next((type_ for type_, names in _NAMES.items() if name in names), None)
    return next(t for t in ((own,) if own else ()) + tuple(_NAMES) if _fits(t, values, known=bool(own)))


def _fits(type_: str, values: Sequence[Any], *, known: bool) -> bool:
    """Whether a column of that type holds the values; where there are none, doubles are as good as any."""
    found = {type(v) for v in values} - {type(None)}
    if not found and not known:
        return type_ == "float64"
    if type_ == "bool_":
        return found <= {bool}
    if type_ == "string":
        return True
    most = 2**63 - 1 if type_ == "int64" else 2**53
    small = all(abs(v) <= most for v in values if type(v) is int)
    return small and found <= ({int} if type_ == "int64" else {int, float})


def _fitted(values: Sequence[Any], type_: object) -> list[Any]:
    """Values that pyarrow takes for that type."""
    if str(type_) == "string":
        return [v if v is None or isinstance(v, str) else _cell(v) for v in values]
    if str(type_) == "double":
        return [v if v is None else float(v) for v in values]
    return list(values)


def _row(cells: Iterable[str]) -> str:
    return " & ".join(cells) + " \\\\"


def _sentence(text: str) -> str:
    return text if text.endswith((".", "?", "!")) else f"{text}."


def _number(value: Value, text: str) -> str:
    """A value's text; a minus sign is one, and not a hyphen."""
    if text == DASH and value != DASH:
        return "--"
    if isinstance(value, str):
        return _tex(text)
    return f"$-${_tex(text[1:])}" if text.startswith("-") else _tex(text)


_TEX = {
    "\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#",
    "_": r"\_", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "<": r"\textless{}",
    ">": r"\textgreater{}", "|": r"\textbar{}", "[": "{[}", "]": "{]}",
    "±": r"$\pm$", "×": r"$\times$", "≤": r"$\leq$", "≥": r"$\geq$", "–": "--", "−": "$-$",
}  # fmt: skip


def _tex(text: str) -> str:
    """Text that LaTeX sets as it stands: what it would obey is spelled out, what nobody can see is a space.

    Square brackets stand in braces: at the beginning of a row one would be the option of the line before.
    """
    return "".join(_TEX.get(c, c if c.isprintable() else " ") for c in text)
