"""Page figures: which figures a study's page has, and the numbers that go into them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from lampyris.report.charts import chart_parts, pair_charts, study_charts
from lampyris.report.charts.study_charts import ErrorBar
from lampyris.report.html.render import PageFigure
from lampyris.study.analysis.findings import Estimate, Summary
from lampyris.study.analysis.measures import ALL, compared, solved_name
from lampyris.study.analysis.runs import Runs
from lampyris.study.analysis.summary import per_unit
from lampyris.study.design.traffic_labels import kind_words, traffic_words

BASELINES = ("dstar-lpso", "dstar16-lpso", "ad-gso")
"""The dissertation's three methods, in the order of its figures."""
MAX_RUNS = 12
"""Test runs of a bar chart in the dissertation's form."""
MAX_ROWS = 80
"""Entrants up to which figures are drawn: of more, nobody could read the names."""
MAX_LINES = 8
"""Curves over the number of obstacles; more would hide each other, and the panels above show the same."""


def _line(e: Estimate, scale: float) -> ErrorBar:
    return ErrorBar(e.value * scale, e.low * scale, e.high * scale)


def success(summary: Summary) -> list[PageFigure]:
    """Who came to the goal, by traffic case, and over the number of obstacles where that is what differs."""
    name = solved_name(summary.kind)
    if not summary.entries or name not in summary.entries[0].own:
        return []
    rows = {
        c: [_line(e.own[name], 100) for e in summary.entries if e.traffic == c] for c in summary.traffic_cases
    }
    panels = [(traffic_words(c), rows[c]) for c in summary.traffic_cases]
    drawn = study_charts.dots("success", summary.entrants, panels, ALL[name].title, share=True)
    words = "Share of all runs, with Wilson's interval for dependent runs."
    return [PageFigure(drawn, words, wide=True)]


def by_density(summary: Summary, runs: Runs) -> list[PageFigure]:
    """Success over the number of obstacles of one kind."""
    name = solved_name(summary.kind)
    traffic_cases = [c for c in runs.study.traffic_cases if c.count]
    kinds = {(c.kind, c.rate, c.radius, c.footprint, c.tracks) for c in traffic_cases}
    if len(traffic_cases) < 2 or len(kinds) != 1 or len(summary.entrants) > MAX_LINES or not runs.has(name):
        return []
    counts = [float(c.count) if c.kind != "none" else 0.0 for c in runs.study.traffic_cases]
    order = sorted(range(len(counts)), key=lambda k: counts[k])
    if len(set(counts)) < len(counts):
        return []
    curves = []
    for entrant in summary.entrants:
        own = [e.own[name] for e in summary.entries if e.entrant == entrant]
        curves.append((entrant, [_line(own[k], 100) for k in order]))
    drawn = study_charts.density("density", [counts[k] for k in order], curves, ALL[name].title)
    return [
        PageFigure(
            drawn, f"{ALL[name].title} over the number of obstacles ({kind_words(traffic_cases[0].kind)})."
        )
    ]


def honest(summary: Summary, names: Sequence[str] = ("cost", "time_s", "expansions")) -> list[PageFigure]:
    """Means with intervals over the worlds that all solved; over each one's own where there are none."""
    out = []
    for name in compared(tuple(names), summary.cost):
        panels = []
        for k, traffic in enumerate(summary.traffic_cases):
            some = [e for e in summary.entries if e.traffic == traffic]
            sides = [e.common if summary.common[k] else e.own for e in some]
            panels.append(
                (traffic_words(traffic), [_line(s[name], ALL[name].scale) for s in sides if name in s])
            )
        if not any(math.isfinite(line.value) for _, lines in panels for line in lines):
            continue
        drawn = study_charts.dots(f"mean-{name}", summary.entrants, panels, ALL[name].title)
        few = ", ".join(f"{n} of {summary.queries * summary.seeds}" for n in summary.common)
        words = f"Mean {ALL[name].title} with intervals over the worlds that all solved ({few}), by traffic."
        out.append(PageFigure(drawn, words, wide=True))
    return out


def profiles(summary: Summary) -> list[PageFigure]:
    """Performance profiles."""
    out = []
    for w in summary.within:
        curves = [
            (name, study_charts.Steps(p.ratios, p.shares))
            for name, p in zip(summary.entrants, w.profiles, strict=True)
        ]
        if not any(c.x for _, c in curves):
            continue
        n = w.profiles[0].n
        title = ALL[w.measure].title
        name = f"profile-{w.measure}-{summary.traffic_cases.index(w.traffic)}"
        drawn = study_charts.profiles(name, curves, f"{title}, times that of the best")
        words = (
            f"Performance profile by {title}, {traffic_words(w.traffic)}, {n} worlds; failures never arrive."
        )
        out.append(PageFigure(drawn, words))
    return out


def ranks(summary: Summary) -> list[PageFigure]:
    """Critical-difference diagrams."""
    out = []
    for o in summary.orders:
        r = o.ranking
        if r.n < 2 or len(summary.entrants) < 3:
            continue
        name = f"ranks-{o.measure}-{summary.traffic_cases.index(o.traffic)}"
        drawn = pair_charts.critical(name, summary.entrants, r.ranks, r.critical, o.groups)
        words = (
            f"Average ranks by {ALL[o.measure].title}, {traffic_words(o.traffic)}, {r.n} {summary.unit_many}; "
            "1 is the best; a bar joins those that do not differ."
        )
        out.append(PageFigure(drawn, words))
    return out


def differences(summary: Summary) -> list[PageFigure]:
    """Paired differences from the reference."""
    out = []
    for name in compared(("cost", "time_s", "expansions"), summary.cost):
        for k, traffic in enumerate(summary.traffic_cases):
            some = [p for p in summary.pairs if p.measure == name and p.traffic == traffic and p.each]
            if not any(any(p.each) for p in some):
                continue
            drawn = pair_charts.strips(
                f"differences-{name}-{k}",
                [
                    (summary.entrants.index(p.entrant), p.entrant, p.each, _line(p.difference, 1.0))
                    for p in some
                ],
                f"{ALL[name].title}, less that of {summary.reference}",
            )
            words = (
                f"Differences from {summary.reference}, {traffic_words(traffic)}: {_points(summary)}, its box "
                "median and quartiles; above it the mean with its interval."
            )
            out.append(PageFigure(drawn, words))
    return out


def trade(summary: Summary, runs: Runs) -> list[PageFigure]:
    """Gap against expansions: what shorter paths cost."""
    if not (runs.has("gap") and runs.has("expansions")):
        return []
    out = []
    for c, traffic in enumerate(summary.traffic_cases):
        series = []
        for e, entrant in enumerate(summary.entrants):
            x = per_unit(runs.of_solved("expansions")[:, c, :, e])
            y = 100 * per_unit(runs.values["gap"][:, c, :, e])
            series.append((entrant, x.tolist(), y.tolist()))
        drawn = study_charts.scatter(f"trade-{c}", series, "expansions", "gap to the shortest path (%)")
        words = f"Work and quality, {traffic_words(traffic)}: {_points(summary)}, the large mark their mean."
        out.append(PageFigure(drawn, words))
    return out


def _points(summary: Summary) -> str:
    units = summary.queries if summary.unit == "query" else summary.seeds
    most = chart_parts.POINTS
    return f"a point a {summary.unit}" + (f" ({most} of {units} drawn)" if units > most else "")


def dissertation_form(summary: Summary, runs: Runs, timing: bool) -> list[PageFigure]:
    """The three bar charts of Figures 4.5 to 4.7: each test run on the first map, three methods, one seed.

    Where the dissertation's three methods are here, the cost of the first two is the sum of the cost-to-go
    and that of the third the length, as it printed them; else the cost of the first three.
    """
    study = runs.study
    three, printed = _three(runs)
    here = [k for k, w in enumerate(study.worlds) if w.ground.hash == study.worlds[0].ground.hash][:MAX_RUNS]
    if len(three) < 2:
        return []
    honest = "The same runs by the true length of the path, for all three: what Figure 4.6 says it shows."
    work = "cpu_s" if timing and runs.has("cpu_s") else "expansions"
    charts = (
        ("4.5", ("iterations",) * 3, "iterations", "Figure 4.5 in its form: iterations of each test run."),
        ("4.6", printed, "path cost", "Figure 4.6 in its form. " + _cost_note(printed)),
        ("4.6 true", ("cost",) * 3 if printed[0] != "cost" else (), ALL["cost"].title, honest),
        (
            "4.7", (work,) * 3, ALL[work].title,
            "Figure 4.7 in its form: "
            + ("seconds of each test run, on this machine." if work == "cpu_s" else
               "expansions in the place of seconds, which depend on the machine."),
        ),
    )  # fmt: skip
    out = []
    groups = [study.worlds[k].query for k in here]
    for figure, names, label, words in charts:
        series = []
        for e, name in zip(three, names, strict=False):
            values = runs.values[name][here, 0, 0, e] if runs.has(name) else np.full(len(here), np.nan)
            series.append((summary.entrants[e], values.tolist()))
        if any(math.isfinite(v) for _, values in series for v in values):
            where = f"{study.worlds[0].ground.name}, {traffic_words(summary.traffic_cases[0])}, first seed"
            drawn = study_charts.bars(
                f"form-{figure.replace('.', '-').replace(' ', '-')}", groups, series, label, where
            )
            out.append(PageFigure(drawn, words))
    return out


def _three(runs: Runs) -> tuple[list[int], tuple[str, str, str]]:
    """The entrants of the bar charts, and which metric is the cost of each."""
    study, laws = runs.study, len(runs.study.laws)
    first: dict[str, int] = {}
    for k, planner in enumerate(study.planners):
        first.setdefault(planner.name, k * laws)
    if all(name in first for name in BASELINES):
        return [first[name] for name in BASELINES], ("cost_to_go", "cost_to_go", "cost")
    return list(range(min(study_charts.BARS, len(runs.entrants)))), ("cost", "cost", "cost")


def _cost_note(printed: Sequence[str]) -> str:
    if "cost_to_go" not in printed:
        return "Cost of each test run, the same measure for all."
    return (
        "Its cost column held two measures: of the first two methods the sum of the cost-to-go over the "
        "cells visited, of AD-GSO the length of the path. They cannot be compared; the true costs are in the "
        "figure with intervals."
    )
