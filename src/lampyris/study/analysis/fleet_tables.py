"""Tables of studies of fleets: each measure by the number of robots, planners side by side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from lampyris.report.data.fleets.measures import X, costs_by_seconds, improvements_of
from lampyris.report.html.table import DASH, Tab, Value
from lampyris.study.analysis.findings import Estimate, Summary
from lampyris.study.analysis.measures import ALL
from lampyris.study.analysis.runs import Runs, Words
from lampyris.study.analysis.summary_tables import (
    estimate_text,
    map_tabs,
    order_tabs,
    pair_tabs,
    places_of,
    sample,
    tabs,
)

BY_NUMBER = (
    "found",
    "throughput",
    "service_ticks",
    "utilisation",
    "robots_arrived",
    "lateness_mean_s",
    "lateness_max_s",
    "wait_order_s",
    "duration_s",
    "contacts",
    "in_motion",
    "ratio",
    "sum_of_costs",
    "makespan",
    "iterations",
    "expansions",
    "plan_s",
    "cpu_s",
    "memory_b",
)
"""Measures that have a table by the number of robots, as far as a study has them."""
_ABOUT = {
    "iterations": "what the planner counts and a budget limits: configurations, neighbourhoods, ticks, searches or nodes",
    "expansions": "states that the planner made: configurations, ticks, states of a cell and an interval or a tick",
}
_SOLVED_BY_ALL = ("ratio",)


def tables_of(summary: Summary, runs: Runs | None = None) -> tuple[Tab, ...]:
    """Every table of a summary; of fleets by the number of robots."""
    if summary.kind != "fleet":
        return tabs(summary)
    return (
        *number_tabs(summary),
        *(improvement_tabs(summary, runs) if runs is not None else ()),
        *pair_tabs(summary),
        *order_tabs(summary),
        *map_tabs(summary),
    )


def numbers_of(summary: Summary) -> list[int]:
    """The number of robots of each traffic case."""
    return [int(label.split()[0]) for label in summary.traffic_cases]


def case_of(label: str) -> int | str:
    """What a row of a table is called: the number of robots, and what else a study compares."""
    number, _, more = label.partition(" robots")
    return f"{number}{more}" if more else int(number)


def number_tabs(summary: Summary) -> tuple[Tab, ...]:
    """A table for each measure: a row for each number of robots, a column for each planner."""
    out = []
    for name in BY_NUMBER:
        own = _table(summary, name, common=False)
        out += [] if own is None else [own]
        if name in _SOLVED_BY_ALL and _differs(summary, name):
            common = _table(summary, name, common=True)
            out += [] if common is None else [common]
    return tuple(out)


def _differs(summary: Summary, name: str) -> bool:
    """Whether the runs of fleets that all solved are fewer than the solved ones of a planner."""
    return any(e.own[name].runs != e.common[name].runs for e in summary.entries if name in e.common)


def _table(summary: Summary, name: str, *, common: bool) -> Tab | None:
    """One measure; None where nobody has a value."""
    measure = ALL[name]
    sides: dict[tuple[str, str], Mapping[str, Estimate]] = {
        (e.traffic, e.entrant): (e.common if common else e.own) for e in summary.entries
    }
    if not any(name in side and side[name].units for side in sides.values()):
        return None
    runs = {(e.traffic, e.entrant): e.runs for e in summary.entries}
    places = places_of(*(s[name].value * measure.scale for s in sides.values() if name in s))
    if name == "found":
        places = 1
    rows: list[tuple[Value, ...]] = []
    for traffic in summary.traffic_cases:
        texts = []
        for entrant in summary.entrants:
            side = sides[traffic, entrant]
            behind = None if common or name == "found" else runs[traffic, entrant]
            texts.append(estimate_text(side[name], measure.scale, behind, places) if name in side else DASH)
        most = max(runs[traffic, entrant] for entrant in summary.entrants)
        there = summary.common[summary.traffic_cases.index(traffic)] if common else most
        rows.append((case_of(traffic), there, *texts))
    title = title_of(name)
    title = title[0].upper() + title[1:]
    title += " of the fleets that all planners solved" if common else " by number of robots"
    note = _note(summary, name, common)
    header = ("robots", "runs", *summary.entrants)
    word = f"{'common' if common else 'by-number'}-{name.replace('_', '-')}"
    return Tab(word, title, header, tuple(rows), note, "r" * len(header))


def title_of(name: str) -> str:
    """What a measure is called in studies of fleets."""
    return "solved (%)" if name == "found" else ALL[name].title


def _note(summary: Summary, name: str, common: bool) -> str:
    words = sample(summary)
    if name == "found":
        return f"Of all runs, those that failed among them; intervals are Wilson's. {words}"
    if common:
        return f"Planners that solved none with so many robots are left out. {words}"
    about = _ABOUT.get(name, ALL[name].about)
    return f"{about[0].upper()}{about[1:]}. {words} n: the runs behind a mean, where some have no value."


def improvement_tabs(summary: Summary, runs: Runs) -> tuple[Tab, ...]:
    """How much planners that go on improving have lowered the cost of their first plans."""
    rows: list[tuple[Value, ...]] = []
    for c, traffic in enumerate(summary.traffic_cases):
        for e, entrant in enumerate(summary.entrants):
            pairs = falls(runs, c, e)
            if not any(len(steps) > 1 for steps, _ in pairs):
                continue
            first = float(np.mean([steps[0][1] / bound for steps, bound in pairs]))
            last = float(np.mean([steps[-1][1] / bound for steps, bound in pairs]))
            half = float(np.median([_halfway(steps) for steps, _ in pairs]))
            lower = f"{100 * (1 - last / first):.2f}"
            numbers = f"{first:.4f}", f"{last:.4f}", lower, f"{half:,.0f}"
            rows.append((case_of(traffic), entrant, len(pairs), *numbers))
    if not rows:
        return ()
    header = (
        "robots",
        "",
        "runs",
        "first cost / shortest",
        "last cost / shortest",
        "lower by (%)",
        "iterations to half of it",
    )
    note = (
        "Means over the solved runs of planners that improve their plans. The last column is the median of the iterations "
        "after the first plan by which a plan had half of its improvement."
    )
    return (
        Tab("improvement", "Cost while the planner improves its plan", header, tuple(rows), note, "rlrrrrr"),
    )


def falls(runs: Runs, traffic: int, entrant: int) -> list[tuple[list[tuple[int, int]], float]]:
    """Of each solved run, iterations and costs of its plans, and the sum of its shortest paths."""
    if not (runs.has("shortest") and runs.has("sum_of_costs")):
        return []
    return _with_bounds(runs, runs.improvements, improvements_of, traffic, entrant)


def falls_by_seconds(runs: Runs, traffic: int, entrant: int) -> list[tuple[list[tuple[float, int]], float]]:
    """The same with CPU seconds since planning began in place of iterations."""
    if not (runs.has("shortest") and runs.has("sum_of_costs")):
        return []
    return _with_bounds(runs, runs.cost_by_s, costs_by_seconds, traffic, entrant)


def _with_bounds(
    runs: Runs, words: Words, parse: Callable[[str], list[tuple[X, int]]], traffic: int, entrant: int
) -> list[tuple[list[tuple[X, int]], float]]:
    texts = words[:, traffic, :, entrant].ravel().tolist()
    bounds = runs.of_solved("shortest")[:, traffic, :, entrant].ravel().tolist()
    return [(parse(text), bound) for text, bound in zip(texts, bounds, strict=True) if text and bound > 0]


def _halfway(steps: Sequence[tuple[int, int]]) -> int:
    middle = (steps[0][1] + steps[-1][1]) / 2
    return next(iteration for iteration, cost in steps if cost <= middle) - steps[0][0]
