"""Grid: a printed table as HTML, cell by cell, each with its verdict and what it should be."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType

from lampyris.report.html.page import Markup, fold, items, join, tag
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
"""A sign of each verdict: colour alone is not for everybody, nor for paper."""

_COLOURS = {MISPRINT: "--bad", IMPOSSIBLE: "--bad", ROUNDED: "--mild", NOT_REPRODUCIBLE: "--mild"}
_SHOWN = 4
"""Places that a reason names before it counts the rest."""
MANY = 40
"""Rows from which on a table is folded."""
LONG = ("4.3", "4.4", "4.5", "4.6")
"""Tables that are carried in long form: a part, a number in it and a name."""


def grid(table: str, verdicts: Sequence[Verdict]) -> Markup:
    """The table as printed, with signs; every cell tells its reason when it is pointed at."""
    if table == "4.2":
        return _square(verdicts)
    if table in LONG:
        return _long(table, verdicts)
    return _plain(table, verdicts)


def cell(v: Verdict) -> Markup:
    """What is printed, the sign of its verdict, and what it should be or ours, if that is told."""
    what = [v.printed, " ", tag("b", SIGNS[v.verdict])]
    if v.ours and v.verdict in (MISPRINT, IMPOSSIBLE, ROUNDED):
        should, _, more = v.ours.partition("; ")
        what += [" → ", should]
        what += [tag("br"), tag("small", more)] if more else []
    elif v.ours and v.verdict == NOT_REPRODUCIBLE:
        what += [tag("br"), tag("small", v.ours)]
    return tag("span", *what, title=f"{v.verdict}: {v.why}")


def _style(some: Iterable[Verdict]) -> str | None:
    """The colour of the gravest verdict in a cell."""
    kinds = {v.verdict for v in some}
    kind = next((k for k in (IMPOSSIBLE, MISPRINT, NOT_REPRODUCIBLE, ROUNDED) if k in kinds), None)
    return None if kind is None else f"background: var({_COLOURS[kind]})"


def _plain(table: str, verdicts: Sequence[Verdict]) -> Markup:
    info = printed_data.about(table)
    found = {(f.index, f.column): v for f, v in zip(printed_data.figures(table), verdicts, strict=True)}
    heads = [_head(info["names"].get(c, c.replace("_", " "))) for c in info["figures"]]
    rows = []
    for k, row in enumerate(printed_data.rows(table)):
        label = ", ".join(row[key] for key in info["keys"] if row[key] and key not in info["figures"])
        cells = [found.get((k, c)) for c in info["figures"]]
        rows.append((label or str(k), [[v] if v is not None else [] for v in cells]))
    keys = [key.replace("_", " ") for key in info["keys"] if key not in info["figures"]]
    return _table([", ".join(keys) or "row", *heads], rows, info["note"])


def _head(name: str) -> str:
    return name.removesuffix(" itself") or "printed"


def _long(table: str, verdicts: Sequence[Verdict]) -> Markup:
    """A table for each part: a row for each number, a column for each name."""
    info = printed_data.about(table)
    parts: dict[str, dict[str, dict[str, Verdict]]] = {}
    for f, v in zip(printed_data.figures(table), verdicts, strict=True):
        row = parts.setdefault(f.row["part"], {}).setdefault(f.row["index"], {})
        row[f.row["name"]] = v
    out = [_table(["header", "printed"], [(n, [[v]]) for n, v in parts.pop("header")[""].items()], "")]
    for part, by in parts.items():
        names = list(dict.fromkeys(n for row in by.values() for n in row))
        rows = [(number, [[row[n]] if n in row else [] for n in names]) for number, row in by.items()]
        made = _table([part, *names], rows, info["note"] if part == "neighbour" else "")
        out.append(fold(f"{part}: {len(rows)} rows", made) if len(rows) > MANY else made)
    return tag("div", *out, class_="films")


def _square(verdicts: Sequence[Verdict]) -> Markup:
    """Table 4.2 as a map: luciferin above, back pointer below."""
    info = printed_data.about("4.2")
    by: dict[tuple[int, int], list[Verdict]] = {}
    for f, v in zip(printed_data.figures("4.2"), verdicts, strict=True):
        by.setdefault(printed_data.cell(f.row["cell"]), []).append(v)
    rows = [(str(y), [by[x, y] for x in range(10)]) for y in range(10)]
    return _table(["y, x", *map(str, range(10))], rows, info["note"])


def _table(head: Sequence[str], rows: Sequence[tuple[str, Sequence[Sequence[Verdict]]]], note: str) -> Markup:
    top = tag("thead", tag("tr", *(tag("th", h, scope="col") for h in head)))
    body = []
    for label, cells in rows:
        shown = (
            tag("td", join((cell(v) for v in some), Markup("<br>")), style=_style(some)) for some in cells
        )
        body.append(join((Markup("\n"), tag("tr", tag("th", label, scope="row"), *shown))))
    whole = tag("table", top, tag("tbody", *body))
    beneath = tag("p", note, class_="note") if note else Markup("")
    return tag("div", tag("div", whole, class_="scroll", tabindex=0), beneath, class_="tab")


def reasons(verdicts: Iterable[Verdict]) -> Markup:
    """Every reason once, with the figures that it is the reason of; those that are in order are folded."""
    grouped: dict[tuple[str, str], list[Verdict]] = {}
    for v in verdicts:
        grouped.setdefault((v.verdict, v.why), []).append(v)
    order = sorted(grouped, key=lambda key: (-list(KINDS).index(key[0]), -len(grouped[key])))
    loud = [_reason(key, grouped[key]) for key in order if key[0] not in (EXACT, GIVEN)]
    quiet = [_reason(key, grouped[key]) for key in order if key[0] in (EXACT, GIVEN)]
    parts = [items(loud)] if loud else []
    if quiet:
        many = sum(len(grouped[key]) for key in order if key[0] in (EXACT, GIVEN))
        parts.append(fold(f"{many} figures that are exact or given", items(quiet)))
    return join(parts)


def _reason(key: tuple[str, str], some: Sequence[Verdict]) -> Markup:
    kind, why = key
    places = [f"{v.where} ({v.printed}{_ours(v)})" for v in some[:_SHOWN]]
    rest = f" and {len(some) - _SHOWN} more" if len(some) > _SHOWN else ""
    return join((tag("b", f"{SIGNS[kind]} {kind}"), f": {'; '.join(places)}{rest}. ", tag("em", f"{why}.")))


def _ours(v: Verdict) -> str:
    return f" → {v.ours}" if v.ours and v.verdict in (MISPRINT, IMPOSSIBLE, ROUNDED) else ""
