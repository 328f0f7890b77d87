"""The page of all benchmarks, from their records."""

from __future__ import annotations

from typing import Any

from benchmarks.figures import Figure, Spread, figures_of
from benchmarks.limits import limit_of

_START = """# Benchmarks

`make bench` runs everything below and writes this page and `docs/benchmarks.json`{took}. `make bench-quick`
does less of it, prints the results and writes no file. Implementations are called alternately in one run; tables give the
median of repeated rounds with the quartiles. Ratios carry over to other machines, seconds do not.
`make bench-compare OLD=FILE` compares a run with an older record, ratio by ratio.

A line that begins **SHORT** is a claim that does not hold on this machine. What limits it, measured in the same run, is stated
below it, with the claim as it holds.
"""


def page(records: list[dict[str, Any]]) -> str:
    """The whole page in Markdown."""
    parts = [_START.format(took=_took(records)), _claims(records)]
    parts += [section(record) for record in records]
    return "\n".join(parts)


def _took(records: list[dict[str, Any]]) -> str:
    """How long the sections took together, where every one of them says."""
    told = [record["about"].get("took", "").split(" ")[0] for record in records]
    if not told or not all(seconds.isdigit() for seconds in told):
        return ""
    return f"; the sections below took {sum(int(seconds) for seconds in told):,} s together"


def _claims(records: list[dict[str, Any]]) -> str:
    lines = ["## Claims", ""]
    for record in records:
        held = [v for v in record["verdicts"] if v["holds"]]
        short = [v for v in record["verdicts"] if not v["holds"]]
        told = f"- [{record['title']}](#{_anchor(record['title'])}): {len(held)} hold"
        limited = sum(bool(limit_of(record, v["text"])) for v in short)
        lines.append(told + (f", **{len(short)} short** ({limited} with the limit shown)" if short else ""))
    return "\n".join(lines) + "\n"


def section(record: dict[str, Any]) -> str:
    """One section: what was timed, with what, the verdicts, the tables, the figures."""
    lines = [f"## {record['title']}", "", record["how"].strip(), ""]
    lines += ["Measured with " + ", ".join(f"{k} {v}" for k, v in record["about"].items()) + ".", ""]
    for v in record["verdicts"]:
        lines.append(f"- {'holds' if v['holds'] else '**SHORT**'}: {v['text']}")
        if not v["holds"]:
            limit = limit_of(record, v["text"])
            lines.append(f"  **Limit**: {limit}." if limit else "  No limit of it has been measured.")
    if record["verdicts"]:
        lines.append("")
    for table in record["tables"]:
        lines += markdown(table["heads"], table["rows"], table["title"])
    if record["figures"] and not record["tables"]:
        lines += figure_table(figures_of(record))
    elif record["figures"]:
        lines += _notes(figures_of(record))
    return "\n".join(lines)


def figure_table(figures: list[Figure]) -> list[str]:
    """Figures as a table, for sections that made none of their own."""
    rows = []
    for f in figures:
        ratio = "" if f.ratio is None else f"{f.ratio:.3g} x"
        if f.asked is not None:
            ratio += f" (target: {f.asked:g})"
        rows.append(
            (
                f.task,
                spread(f.ours),
                f.unit,
                f.rival or "",
                spread(f.theirs) if f.theirs else "",
                ratio,
                f.note,
            )
        )
    return markdown(
        ("task", "lampyris (quartiles)", "unit", "compared with", "its result", "ratio", "note"), rows, ""
    )


def _notes(figures: list[Figure]) -> list[str]:
    """What figures have to say that no table says, each note once."""
    tasks: dict[str, list[str]] = {}
    for f in figures:
        if f.note:
            tasks.setdefault(f.note, []).append(f.task)
    lines = []
    for note, of in tasks.items():
        more = f" and {len(of) - 3} more" if len(of) > 3 else ""
        lines.append(f"- {'; '.join(of[:3])}{more}: {note}")
    return [*lines, ""] if lines else []


def spread(s: Spread) -> str:
    """``3.4 (3.3 to 3.6)``; the middle alone where it was measured once."""
    return f"{s.middle:.3g}" if s.n == 1 else f"{s.middle:.3g} ({s.low:.3g} to {s.high:.3g})"


def markdown(heads: Any, rows: Any, title: str) -> list[str]:
    """A table in Markdown, a blank line after it."""
    lines = [f"**{title}**", ""] if title else []
    lines.append("| " + " | ".join(heads) + " |")
    lines.append("|" + "---|" * len(heads))
    lines += ["| " + " | ".join(str(c).replace("|", "\\|") for c in row) + " |" for row in rows]
    return [*lines, ""]


def _anchor(title: str) -> str:
    kept = "".join(c for c in title.lower() if c.isalnum() or c in " -")
    return kept.replace(" ", "-")
