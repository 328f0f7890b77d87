"""Figures of studies of fleets: each measure over the number of robots, and the cost while planners improve their plans."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import product

from lampyris.report.charts import study_charts
from lampyris.report.charts.study_charts import ErrorBar
from lampyris.report.html.render import PageFigure
from lampyris.study.analysis.findings import Summary
from lampyris.study.analysis.fleet_tables import falls, falls_by_seconds, title_of
from lampyris.study.analysis.measures import ALL
from lampyris.study.analysis.runs import Runs
from lampyris.study.design.study import StudyTraffic
from lampyris.study.design.traffic_labels import traffic_words

MAX_LINES = 12
"""Curves of one figure; more would hide each other."""
POINTS = 48
"""Iterations or seconds at which a curve of costs is worked out."""
LEAST_SECONDS = 1e-4
"""Where a curve begins at the earliest: its axis is logarithmic."""
_AXES = {
    "robots": "number of robots",
    "radius (m)": "radius of the robots",
    "share of moves delayed": "chance of a delay",
}
_DRAWN = (
    "found", "throughput", "service_ticks", "utilisation", "lateness_mean_s", "contacts", "ratio", "makespan", "expansions",
    "plan_s",
)  # fmt: skip


def number_figures(summary: Summary, cases: Sequence[StudyTraffic]) -> list[PageFigure]:
    """Measures over what a study compares, the number of robots first, with intervals."""
    axis, values, groups = _axis(cases)
    if len(summary.entrants) * len(groups) > MAX_LINES:
        return []
    out = []
    for name in _DRAWN:
        if name == "plan_s" and not any("plan_s" in e.own for e in summary.entries):
            continue
        measure = ALL[name]
        series = []
        for entrant, (words, members) in product(summary.entrants, groups.items()):
            mine = [e.own.get(name) for e in summary.entries if e.entrant == entrant]
            bars = [
                ErrorBar(math.nan, math.nan, math.nan)
                if e is None
                else ErrorBar(e.value * measure.scale, e.low * measure.scale, e.high * measure.scale)
                for e in mine
            ]
            series.append((f"{entrant}, {words}" if words else entrant, [bars[k] for k in members]))
        if not any(math.isfinite(bar.value) for _, bars in series for bar in bars):
            continue
        drawn = study_charts.density(
            f"robots-{name}",
            values,
            series,
            title_of(name),
            xlabel=axis,
            share=name == "found",
        )
        words = f"{title_of(name)[0].upper()}{title_of(name)[1:]} over the {_AXES[axis]}, with intervals."
        if name != "found":
            words += " Each planner over the runs that it solved."
        out.append(PageFigure(drawn, words))
    return out


def _axis(cases: Sequence[StudyTraffic]) -> tuple[str, list[float], dict[str, list[int]]]:
    """The axis of figures, its values, and the cases of each line in their order."""
    columns = {
        "robots": [float(one.count) for one in cases],
        "radius (m)": [one.radius for one in cases],
        "share of moves delayed": [one.rate or 0.0 for one in cases],
    }
    axis = next((name for name, column in columns.items() if len(set(column)) > 1), "robots")
    values = sorted(set(columns[axis]))
    others = [name for name, column in columns.items() if name != axis and len(set(column)) > 1]
    groups: dict[str, list[int]] = {}
    for k in sorted(range(len(cases)), key=lambda k: columns[axis][k]):
        words = ", ".join(f"{name.removesuffix(' (m)')} {columns[name][k]:g}" for name in others)
        groups.setdefault(words, []).append(k)
    return axis, values, groups


def improvement_figures(summary: Summary, runs: Runs) -> list[PageFigure]:
    """The mean cost over its lower bound against iterations, a figure for each number of robots."""
    out = []
    for c, traffic in enumerate(summary.traffic_cases):
        series = []
        for e, entrant in enumerate(summary.entrants):
            pairs = falls(runs, c, e)
            if not any(len(steps) > 1 for steps, _ in pairs):
                continue
            last = max(max(steps[-1][0] - steps[0][0] for steps, _ in pairs), 2)
            grid = sorted({round(last ** (k / (POINTS - 1))) for k in range(POINTS)})  # bits: a figure
            costs = [
                math.fsum(_cost_at(steps, at) / bound for steps, bound in pairs) / len(pairs) for at in grid
            ]
            series.append((f"{entrant}, {len(pairs)} runs", [float(at) for at in grid], costs))
        if series:
            drawn = study_charts.curves(
                f"improvement-{c}", series, "iterations after the first plan", "cost / shortest"
            )
            words = (
                f"Sum of costs over the shortest paths against the planner's iterations, {traffic_words(traffic)}: mean of "
                "solved runs. "
                "Iterations of different planners are different work."
            )
            out.append(PageFigure(drawn, words))
    return out


def time_figures(summary: Summary, runs: Runs) -> list[PageFigure]:
    """The mean cost over its lower bound against CPU seconds of planning, a figure for each number of robots.

    A curve begins where all solved runs of its planner have a plan. The first plan of planners that do not improve theirs
    remains to the end.
    """
    out = []
    for c, traffic in enumerate(summary.traffic_cases):
        found = {
            entrant: pairs
            for e, entrant in enumerate(summary.entrants)
            if (pairs := falls_by_seconds(runs, c, e))
        }
        if not any(len(steps) > 1 for pairs in found.values() for steps, _ in pairs):
            continue
        end = max(steps[-1][0] for pairs in found.values() for steps, _ in pairs)
        series = []
        for entrant, pairs in found.items():
            first = max(LEAST_SECONDS, *(steps[0][0] for steps, _ in pairs))
            last = max(end, first)
            grid = [first * (last / first) ** (k / (POINTS - 1)) for k in range(POINTS)]  # bits: a figure
            costs = [
                math.fsum(_cost_by(steps, at) / bound for steps, bound in pairs) / len(pairs) for at in grid
            ]
            series.append((f"{entrant}, {len(pairs)} runs", grid, costs))
        drawn = study_charts.curves(f"cost-by-s-{c}", series, "CPU seconds of planning", "cost / shortest")
        words = (
            f"Sum of costs over the shortest paths against CPU seconds of planning, {traffic_words(traffic)}: mean of each "
            "planner's solved runs, from the second at which all of these have a plan. The first plan of planners that do not "
            "improve theirs remains to the end. Seconds are of this machine, as the workers state them."
        )
        out.append(PageFigure(drawn, words))
    return out


def _cost_by(steps: list[tuple[float, int]], at: float) -> int:
    """The cost of the best plan at a CPU second; of the first plan before that."""
    return next((cost for seconds, cost in reversed(steps) if seconds <= at), steps[0][1])


def _cost_at(steps: list[tuple[int, int]], at: float) -> int:
    """The cost of the best plan so many iterations after the first."""
    return next(cost for iteration, cost in reversed(steps) if iteration - steps[0][0] <= at)
