"""Page: what was printed, what is true, and why, for a researcher to read from top to bottom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from lampyris.report.html.render import PageFigure, render
from lampyris.report.html.table import Tab, Value
from lampyris.reproduce.page import charts, story
from lampyris.reproduce.page.grid import CORRECTED, LONG, MANY, SIGNS, colour, grid, reasons
from lampyris.reproduce.runs.measured import Costs
from lampyris.reproduce.runs.results import Difference, Method, Results
from lampyris.reproduce.tables import printed_data
from lampyris.reproduce.tables.comparison import METHODS
from lampyris.reproduce.tables.verdict import KINDS, Verdict, count
from lampyris.study.analysis import compare

TITLE = "The dissertation, reproduced"
Tables = Mapping[str, Sequence[Verdict]]


def words(tables: Tables, found: Results, costs: Costs, asked: Mapping[str, int]) -> str:
    """The whole page.

    Parameters
    ----------
    tables : verdicts by printed table.
    asked : runs by study.
    """
    every = [v for some in tables.values() for v in some]
    about = printed_data.source()
    return render(
        "reproduce/page/page.html.j2",
        title=TITLE,
        source=about["source"],
        transcribed=about["transcribed"],
        figures=len(every),
        verdicts=", ".join(f"{many} {kind}" for kind, many in count(every).items()),
        runs=", ".join(f"{many:,} of {name}" for name, many in asked.items()),
        conclusion=story.conclusion(found, costs),
        summary=_summary(tables),
        kinds=KINDS,
        signs=SIGNS,
        colour=colour,
        corrected=CORRECTED,
        best_nt=story.best_nt(found).why,
        flat=_flat(found),
        sweep=PageFigure(
            charts.sweep(found), "Table 4.9 in kind: means by nt. Other maps, so levels differ."
        ),
        nt_means=_methods("nt-means", "AD-GSO by nt on env-1 to env-6", found.nt, SWEEP),
        nt_differences=_differences(
            "nt-differences", "Each nt against nt = 10, in the same queries", found.nt_differences
        ),
        comparison=_comparison(found),
        bars=[_bars(which, found) for which in charts.BARS],
        charts=_charts(found),
        costs=costs,
        storage=_sentence(story.storage(costs).why),
        memory=_memory(costs),
        printed=[_printed(name, some) for name, some in tables.items()],
        foot="Made by lampyris reproduce. The page loads and runs nothing.",
    )


def _summary(tables: Tables) -> Tab:
    kinds = list(KINDS)
    rows: list[tuple[Value, ...]] = []
    for name, some in tables.items():
        found = count(some)
        rows.append((_name(name), printed_data.about(name)["title"], len(some), *(found[k] for k in kinds)))
    every = count(v for some in tables.values() for v in some)
    rows.append(("all", "", sum(every.values()), *(every[k] for k in kinds)))
    head = ("table", "what", "figures", *(f"{SIGNS[k]} {k}" for k in kinds))
    return Tab("verdicts", "Printed figures and their verdicts", head, tuple(rows))


def _name(name: str) -> str:
    return "text" if name == "text" else f"Table {name}"


def _interval(value: compare.Interval, digits: int) -> str:
    if value.n == 0 or value.value != value.value:
        return "-"
    if value.low != value.low:
        return f"{value.value:,.{digits}f}"
    return f"{value.value:,.{digits}f} [{value.low:,.{digits}f}, {value.high:,.{digits}f}]"


def _methods(name: str, title: str, some: Sequence[Method], columns: Sequence[tuple[str, str, int]]) -> Tab:
    """Methods side by side."""
    rows: list[tuple[Value, ...]] = []
    for m in some:
        values = [_interval(m.means[c], d) for c, _, d in columns]
        n = max(v.n for v in m.means.values())
        time = "-" if m.plan_ms != m.plan_ms else f"{m.plan_ms:.2f}"
        rows.append((m.name, f"{n} [{m.runs:,} runs]", _interval(_percent(m.solved), 0), *values, time))
    head = ("method", "queries", "solved (%)", *(h for _, h, _ in columns), "planning (ms)")
    align = "l" + "r" * (len(head) - 1)
    return Tab(name, title, head, tuple(rows), MEANS, align)


def _percent(share: compare.Interval) -> compare.Interval:
    return compare.Interval(100 * share.value, 100 * share.low, 100 * share.high, share.n)


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def _differences(name: str, title: str, some: Iterable[Difference]) -> Tab:
    rows: list[tuple[Value, ...]] = []
    for d in some:
        p = "< 0.001" if d.holm < 0.001 else f"{d.holm:.3f}"
        sign = "yes" if d.sure else "no"
        pairs = f"{d.test.less} / {d.test.equal} / {d.test.more}"
        mean = _interval(d.mean, 0 if d.what == "expansions" else 2)
        what = f"{NAMES.get(d.what, d.what)}: {d.a} − {d.b}"
        rows.append((what, mean, f"{d.share:+.1f} %", pairs, d.mean.n, p, sign))
    head = ("difference", "mean", "share", "less / equal / more", "queries", "p (Holm)", "significant")
    return Tab(name, title, head, tuple(rows), NOTE, "lrrrrrl")


NAMES = {"cost": "length", "cost_to_go": "sum of cost-to-go"}
NOTE = (
    f"The unit is the query, its seeds averaged; intervals of {100 * compare.LEVEL:.0f} % by bootstrap over "
    f"queries (BCa, {compare.RESAMPLES:,} resamples, seed 0); Wilcoxon's signed-rank test, its p corrected "
    "by Holm for all rows of this table; significant: below 0.05."
)
MEANS = (
    "Means over queries with intervals (bootstrap over queries, seed 0); planning time: median, this machine."
)


SWEEP = (("iterations", "iterations", 2), ("cost", "length (cells)", 2), ("gap", "gap", 4))
STATIC = (
    ("iterations", "iterations", 1), ("cost", "length (cells)", 1), ("cost_to_go", "sum of cost-to-go", 0),
    ("expansions", "expansions", 0), ("gap", "gap", 3),
)  # fmt: skip
MOVING = (*STATIC[:-1], ("ticks", "ticks", 1), ("waits", "waits", 2), ("collisions", "collisions", 2))
"""Columns of the methods' tables: measure, head and digits."""


def _flat(found: Results) -> bool:
    """Whether the largest three values of nt give the same means."""
    last = [(m.means["iterations"].value, m.means["cost"].value) for m in found.nt[-3:]]
    return len(set(last)) == 1


def _comparison(found: Results) -> list[tuple[Tab, Tab]]:
    """Means of methods, and their differences."""
    static = "Nothing moves: pairs of Table 4.11 on our maps"
    moving = "Among 20 random walkers, which yield to the robot"
    return [
        (
            _methods("static-means", static, found.static, STATIC),
            _differences("static-differences", "Paired differences", found.static_differences),
        ),
        (
            _methods("moving-means", moving, found.moving, MOVING),
            _differences("moving-differences", "Paired differences", found.moving_differences),
        ),
    ]


def _bars(which: charts.Bars, found: Results) -> tuple[str, str, str]:
    """A chart as printed, ours, and what they show."""
    words = f"Figure {which.figure} in kind: as printed in Table 4.11, environment 1, and ours on env-1."
    if which.column == "path_cost":
        words += " Ours of the improved method is summed over every cell, the printed over every second."
    return charts.as_printed(which), charts.as_ours(which, found), words + _missing(found, which.ours)


def _charts(found: Results) -> list[PageFigure]:
    words = "What a figure of path cost should show: lengths of all three, in the same unit."
    out = [PageFigure(charts.lengths(found), words + _missing(found, "cost"))]
    for path, name in charts.FIGURES.items():
        words = (
            f"Figure {name} in kind: path {path} as printed (misprinted cells corrected) and its velocities."
        )
        out.append(PageFigure(charts.path_speed(path), words))
    return out


def _missing(found: Results, measure: str) -> str:
    """What the mark without a bar means, where there is one."""
    gone = any(v != v for m in METHODS for v in found.first[m][measure])
    more = " A grey × stands for a pair without runs (--quick makes two of the five) or without a path."
    return more if gone else ""


def _memory(costs: Costs) -> Tab:
    rows = tuple((k.planner, k.kept / 1000, k.peak / 1000) for k in costs.kept)
    head = ("planner", "kept (kB)", "peak while planning (kB)")
    note = (
        f"Medians over six queries, one a map of {costs.cells:,} cells, by tracemalloc; both hybrids find or "
        "close gates, which takes fields of their own. This machine, this Python."
    )
    return Tab("memory", "What a session holds after one plan", head, rows, note, digits=(None, 1, 1))


def _printed(name: str, some: Sequence[Verdict]) -> dict[str, Any]:
    """One printed table; a long one is closed until it is asked for."""
    rows = len(printed_data.rows(name))
    long = name not in LONG and rows > MANY and name != "4.2"
    return {
        "anchor": f"table-{name.replace('.', '-')}",
        "title": f"{_name(name)}: {printed_data.about(name)['title']}",
        "count": len(some),
        "verdicts": ", ".join(f"{SIGNS[k]} {many} {k}" for k, many in count(some).items() if many),
        "tables": grid(name, some),
        "reasons": reasons(some),
        "fold": f"the table, {rows} rows, and its reasons" if long else "",
    }
