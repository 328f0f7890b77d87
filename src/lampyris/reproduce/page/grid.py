"""Grid: a printed table, cell by cell, each with its verdict and what it should be; ``grid.html.j2`` shows it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from lampyris.reproduce.tables import printed_data
from lampyris.reproduce.tables.verdict import (
    EXACT,
    GIVEN,
    IMPOSSIBLE,
    KINDS,
    MISPRINT,
    NOT_REPRODUCIBLE,
    ROUNDED,
    Verdict,
)

SIGNS: Mapping[str, str] = MappingProxyType(
    {EXACT: "✓", ROUNDED: "≈", GIVEN: "·", MISPRINT: "✗", NOT_REPRODUCIBLE: "?", IMPOSSIBLE: "⊘"}
)
"""A sign of each verdict: colour alone is not for everyone, nor for paper."""

_COLOURS = {IMPOSSIBLE: "--bad", MISPRINT: "--bad", NOT_REPRODUCIBLE: "--mild", ROUNDED: "--mild"}
"""Gravest first."""
CORRECTED = (MISPRINT, IMPOSSIBLE, ROUNDED)
"""Verdicts for which the correct value is shown."""
_SHOWN = 4
"""Places that a reason names before it counts the rest."""
MANY = 40
"""Rows from which on a table is folded."""
LONG = ("4.3", "4.4", "4.5", "4.6")
"""Tables that are carried in long form: a part, a number in it and a name."""


class PrintedTable(NamedTuple):
    """A table or a part of one; ``fold``: the title under which it is closed."""

    head: Sequence[str]
    rows: Sequence[tuple[str, Sequence[Sequence[Verdict]]]]
    note: str
    fold: str = ""


Reason = tuple[str, str, str]
"""A verdict, the places that have it, and why."""


def grid(table: str, verdicts: Sequence[Verdict]) -> list[PrintedTable]:
    """The table as printed, with signs; of one in long form its parts."""
    if table == "4.2":
        return [_square(verdicts)]
    if table in LONG:
        return _long(table, verdicts)
    return [_plain(table, verdicts)]


def colour(cell: Iterable[Verdict]) -> str | None:
    """The colour of the gravest verdict in a cell."""
    kinds = {v.verdict for v in cell}
    return next((colour for kind, colour in _COLOURS.items() if kind in kinds), None)


def _plain(table: str, verdicts: Sequence[Verdict]) -> PrintedTable:
    info = printed_data.about(table)
    found = {(f.index, f.column): v for f, v in zip(printed_data.figures(table), verdicts, strict=True)}
    heads = [_head(info["names"].get(c, c.replace("_", " "))) for c in info["figures"]]
    rows = []
    for k, row in enumerate(printed_data.rows(table)):
        label = ", ".join(row[key] for key in info["keys"] if row[key] and key not in info["figures"])
        cells = [[found[k, c]] if (k, c) in found else [] for c in info["figures"]]
        rows.append((label or str(k), cells))
    keys = [key.replace("_", " ") for key in info["keys"] if key not in info["figures"]]
    return PrintedTable([", ".join(keys) or "row", *heads], rows, info["note"])


def _head(name: str) -> str:
    return name.removesuffix(" itself") or "printed"


def _long(table: str, verdicts: Sequence[Verdict]) -> list[PrintedTable]:
    """A table for each part: a row for each number, a column for each name."""
    info = printed_data.about(table)
    parts: dict[str, dict[str, dict[str, Verdict]]] = {}
    for f, v in zip(printed_data.figures(table), verdicts, strict=True):
        row = parts.setdefault(f.row["part"], {}).setdefault(f.row["index"], {})
        row[f.row["name"]] = v
    header = parts.pop("header")[""]
    out = [PrintedTable(["header", "printed"], [(n, [[v]]) for n, v in header.items()], "")]
    for part, by in parts.items():
        names = list(dict.fromkeys(n for row in by.values() for n in row))
        rows = [(number, [[row[n]] if n in row else [] for n in names]) for number, row in by.items()]
        fold = f"{part}: {len(rows)} rows" if len(rows) > MANY else ""
        out.append(PrintedTable([part, *names], rows, info["note"] if part == "neighbour" else "", fold))
    return out


def _square(verdicts: Sequence[Verdict]) -> PrintedTable:
    """Table 4.2 as a map: luciferin above, back pointer below."""
    by: dict[tuple[int, int], list[Verdict]] = {}
    for f, v in zip(printed_data.figures("4.2"), verdicts, strict=True):
        by.setdefault(printed_data.cell(f.row["cell"]), []).append(v)
    rows = [(str(y), [by[x, y] for x in range(10)]) for y in range(10)]
    return PrintedTable(["y, x", *map(str, range(10))], rows, printed_data.about("4.2")["note"])


def reasons(verdicts: Iterable[Verdict]) -> tuple[list[Reason], list[Reason], int]:
    """Every reason once: those of what is amiss, those of what is exact or given, and of how many the latter."""
    grouped: dict[tuple[str, str], list[Verdict]] = {}
    for v in verdicts:
        grouped.setdefault((v.verdict, v.why), []).append(v)
    order = sorted(grouped, key=lambda key: (-list(KINDS).index(key[0]), -len(grouped[key])))
    quiet = [key for key in order if key[0] in (EXACT, GIVEN)]
    loud = [_reason(key, grouped[key]) for key in order if key not in quiet]
    return loud, [_reason(key, grouped[key]) for key in quiet], sum(len(grouped[key]) for key in quiet)


def _reason(key: tuple[str, str], some: Sequence[Verdict]) -> Reason:
    kind, why = key
    places = "; ".join(f"{v.where} ({v.printed}{_ours(v)})" for v in some[:_SHOWN])
    rest = f" and {len(some) - _SHOWN} more" if len(some) > _SHOWN else ""
    return kind, places + rest, why


def _ours(v: Verdict) -> str:
    return f" → {v.ours}" if v.ours and v.verdict in CORRECTED else ""
