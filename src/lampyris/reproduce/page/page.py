"""Page: what was printed, what is true, and why, for a researcher to read from top to bottom."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from lampyris.report.html.page import Markup, figure, fold, items, join, page, paragraph, section, table, tag
from lampyris.report.html.table import Tab, Value
from lampyris.reproduce.page import charts, story
from lampyris.reproduce.page.grid import LONG, MANY, SIGNS, grid, reasons
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
    parts = [
        *_opening(tables, asked),
        section("conclusion", "In one paragraph", paragraph(story.conclusion(found, costs))),
        section("summary", "Verdicts by table", _summary(tables), _legend()),
        section("nt", "Is nt = 10 best?", *_sweep(found)),
        section("comparison", "The comparison on our maps", *_comparison(found)),
        section("figures", "Its figures in kind", *_figures(found)),
        section("memory", "Memory and time", *_costs(costs)),
        section("printed", "Every printed table", *_printed(tables)),
        section("source", "Source and method", *_source()),
    ]
    foot = "Made by lampyris reproduce. The page loads and runs nothing."
    return page(TITLE, *parts, foot=foot)


def _opening(tables: Tables, asked: Mapping[str, int]) -> list[Markup]:
    every = [v for some in tables.values() for v in some]
    found = count(every)
    told = ", ".join(f"{many} {kind}" for kind, many in found.items())
    s = printed_data.source()["source"]
    links = [
        ("conclusion", "Conclusion"),
        ("summary", "Verdicts"),
        ("nt", "nt"),
        ("comparison", "Comparison"),
        ("figures", "Figures"),
        ("memory", "Memory"),
        ("printed", "Every table"),
        ("source", "Source"),
    ]
    runs = ", ".join(f"{many:,} of {name}" for name, many in asked.items())
    return [
        tag(
            "p",
            f"{s['author']}, ",
            tag("em", s["title"]),
            f" ({s['kind']}, {s['place']}, {s['date']}): each of the {len(every):,} figures that its tables, "
            f"abstract, text and conclusion print, with a verdict: {told}. Beside them stand our own runs "
            f"({runs}) on our own maps, as its six maps are lost.",
            class_="lead",
        ),
        tag("nav", items(tag("a", name, href=f"#{anchor}") for anchor, name in links)),
    ]


def _summary(tables: Tables) -> Markup:
    kinds = list(KINDS)
    rows: list[tuple[Value, ...]] = []
    for name, some in tables.items():
        found = count(some)
        rows.append((_name(name), printed_data.about(name)["title"], len(some), *(found[k] for k in kinds)))
    every = count(v for some in tables.values() for v in some)
    rows.append(("all", "", sum(every.values()), *(every[k] for k in kinds)))
    head = ("table", "what", "figures", *(f"{SIGNS[k]} {k}" for k in kinds))
    tab = Tab("verdicts", "Printed figures and their verdicts", head, tuple(rows))
    return table(tab, classes=[*([""] * (len(rows) - 1)), "total"])


def _name(name: str) -> str:
    return "text" if name == "text" else f"Table {name}"


def _legend() -> Markup:
    return items(join((tag("b", f"{SIGNS[k]} {k}"), f": {what}.")) for k, what in KINDS.items())


def _interval(value: compare.Interval, digits: int) -> str:
    if value.n == 0 or value.value != value.value:
        return "-"
    if value.low != value.low:
        return f"{value.value:,.{digits}f}"
    return f"{value.value:,.{digits}f} [{value.low:,.{digits}f}, {value.high:,.{digits}f}]"


def _methods(
    name: str, title: str, some: Sequence[Method], columns: Sequence[tuple[str, str, int]], note: str
) -> Markup:
    """Methods side by side; intervals beneath their values, or the widest needs scrolling at 1280 pixels."""
    rows: list[tuple[Value, ...]] = []
    for m in some:
        values = [_interval(m.means[c], d) for c, _, d in columns]
        n = max(v.n for v in m.means.values())
        time = "-" if m.plan_ms != m.plan_ms else f"{m.plan_ms:.2f}"
        rows.append((m.name, f"{n} [{m.runs:,} runs]", _interval(_percent(m.solved), 0), *values, time))
    head = ("method", "queries", "solved (%)", *(h for _, h, _ in columns), "planning (ms)")
    align = "l" + "r" * (len(head) - 1)
    return tag("div", table(Tab(name, title, head, tuple(rows), note, align)), class_="stacked")


def _percent(share: compare.Interval) -> compare.Interval:
    return compare.Interval(100 * share.value, 100 * share.low, 100 * share.high, share.n)


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}."


def _differences(name: str, title: str, some: Iterable[Difference]) -> Markup:
    rows: list[tuple[Value, ...]] = []
    for d in some:
        p = "< 0.001" if d.holm < 0.001 else f"{d.holm:.3f}"
        sign = "yes" if d.sure else "no"
        pairs = f"{d.test.less} / {d.test.equal} / {d.test.more}"
        mean = _interval(d.mean, 0 if d.what == "expansions" else 2)
        what = f"{NAMES.get(d.what, d.what)}: {d.a} − {d.b}"
        rows.append((what, mean, f"{d.share:+.1f} %", pairs, d.mean.n, p, sign))
    head = ("difference", "mean", "share", "less / equal / more", "queries", "p (Holm)", "told apart")
    return table(Tab(name, title, head, tuple(rows), NOTE, "lrrrrrl"))


NAMES = {"cost": "length", "cost_to_go": "sum of cost-to-go"}
NOTE = (
    f"The unit is the query, its seeds averaged; intervals of {100 * compare.LEVEL:.0f} % by bootstrap over "
    f"queries (BCa, {compare.RESAMPLES:,} resamples, seed 0); Wilcoxon's signed-rank test, its p corrected "
    "by Holm for all rows of this table; told apart: below 0.05."
)
MEANS = (
    "Means over queries with intervals (bootstrap over queries, seed 0); planning time: median, this machine."
)


def _sweep(found: Results) -> list[Markup]:
    said = story.best_nt(found)
    columns = (("iterations", "iterations", 2), ("cost", "length (cells)", 2), ("gap", "gap", 4))
    return [
        paragraph(
            f"Printed: nt = 10 is best, from ten paths. Here: {said.why}. Static maps, gates ignored, one "
            "run a query, as greedy AD-GSO draws nothing. From nt = 16 on nothing changes any more: on these "
            "queries two rings never held so many acceptable cells, so the third was always opened."
            if _flat(found)
            else f"Printed: nt = 10 is best, from ten paths. Here: {said.why}."
        ),
        figure(charts.sweep(found), "Table 4.9 in kind: means by nt. Other maps, so levels differ."),
        _methods("nt-means", "AD-GSO by nt on env-1 to env-6", found.nt, columns, MEANS),
        _differences("nt-differences", "Each nt against nt = 10, in the same queries", found.nt_differences),
    ]


def _flat(found: Results) -> bool:
    """Whether the largest three values of nt give the same means."""
    last = [(m.means["iterations"].value, m.means["cost"].value) for m in found.nt[-3:]]
    return len(set(last)) == 1


def _comparison(found: Results) -> list[Markup]:
    way = (
        ("iterations", "iterations", 1),
        ("cost", "length (cells)", 1),
        ("cost_to_go", "sum of cost-to-go", 0),
        ("expansions", "expansions", 0),
    )
    both = (
        "Both columns of cost, for every method: the length of the way, and the sum of cost-to-go over its "
        "cells, which the dissertation prints as the path cost of the two hybrids of D* (for the improved "
        "one over every second cell) and not of its own. As in its comparison, mixed and AD-GSO find gates "
        "on the way, and improved closes them beforehand; AD-GSO with gates closed is the like of improved."
    )
    return [
        paragraph(both),
        _methods("static-means", "Nothing moves: pairs of Table 4.11 on our maps", found.static,
                 (*way, ("gap", "gap", 3)), MEANS),
        _differences("static-differences", "Paired differences", found.static_differences),
        _methods("moving-means", "Among 20 random walkers, which yield to the robot", found.moving,
                 (*way, ("ticks", "ticks", 1), ("waits", "waits", 2), ("collisions", "collisions", 2)),
                 MEANS),
        _differences("moving-differences", "Paired differences", found.moving_differences),
    ]  # fmt: skip


def _figures(found: Results) -> list[Markup]:
    out = []
    for which in charts.BARS:
        pair = tag("div", charts.as_printed(which), charts.as_ours(which, found), class_="pair")
        words = f"Figure {which.figure} in kind: as printed in Table 4.11, environment 1, and ours on env-1."
        if which.column == "path_cost":
            words += " Ours of the improved method is summed over every cell, the printed over every second."
        out.append(figure(pair, words + _missing(found, which.ours), wide=True))
    words = "What a figure of path cost should show: lengths of all three, in the same unit."
    words += _missing(found, "cost")
    out.append(figure(charts.lengths(found), words))
    for path, name in charts.FIGURES.items():
        words = (
            f"Figure {name} in kind: path {path} as printed (misprinted cells corrected) and its velocities."
        )
        out.append(figure(charts.path_speed(path), words))
    return out


def _missing(found: Results, measure: str) -> str:
    """What the mark without a bar means, where there is one."""
    gone = any(v != v for m in METHODS for v in found.first[m][measure])
    more = " A grey × stands for a pair without runs (--quick makes two of the five) or without a way."
    return more if gone else ""


def _costs(costs: Costs) -> list[Markup]:
    rows = tuple((k.planner, k.kept / 1000, k.peak / 1000) for k in costs.kept)
    head = ("planner", "kept (kB)", "peak while planning (kB)")
    note = (
        f"Medians over six queries, one a map of {costs.cells:,} cells, by tracemalloc; both hybrids find or "
        "close gates, which takes fields of their own. This machine, this Python."
    )
    return [
        paragraph(_sentence(story.storage(costs).why)),
        table(Tab("memory", "What a session holds after one plan", head, rows, note, digits=(None, 1, 1))),
        paragraph(
            f"Times, medians of {costs.queries} queries, compiled loops warm: the field alone "
            f"{1000 * costs.field_s:.3f} ms, a whole plan of AD-GSO {1000 * costs.plan_s:.3f} ms, one jump "
            f"{1000 * costs.jump_s:.4f} ms (plan less field, over its jumps), a whole plan of A* "
            f"{1000 * costs.astar_s:.3f} ms."
        ),
    ]


def _printed(tables: Tables) -> list[Markup]:
    out = [paragraph("Point at a figure for its reason; the reasons stand below each table, too.")]
    for name, some in tables.items():
        found = count(some)
        told = ", ".join(f"{SIGNS[k]} {many} {k}" for k, many in found.items() if many)
        inside = join((grid(name, some), reasons(some)))
        long = name not in LONG and len(printed_data.rows(name)) > MANY and name != "4.2"
        shown = (
            fold(f"the table, {len(printed_data.rows(name))} rows, and its reasons", inside)
            if long
            else inside
        )
        anchor = f"table-{name.replace('.', '-')}"
        title = f"{_name(name)}: {printed_data.about(name)['title']}"
        out.append(section(anchor, title, paragraph(f"{len(some)} figures: {told}."), shown, level=3))
    return out


def _source() -> list[Markup]:
    return [
        paragraph(printed_data.source()["transcribed"]),
        paragraph(
            "Ours are computed by the code that plans for everybody: the field, AD-GSO and the speed law "
            "with their default settings. What needs one of the lost maps is held against bounds: the octile "
            "distance, the parity of steps of 1 and 1.4, the reach of an iteration, the most that a sum of "
            "cost-to-go can be."
        ),
    ]
