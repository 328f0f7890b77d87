"""Study charts: what a study found, drawn from plain numbers as SVG that stands in a page.

Text stays text (set in the page's font; DejaVu Sans, by which it is measured, is wider than most) and the
colours of ink and paper are the page's own, light or dark. The same numbers give the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from lampyris.report.charts.chart_parts import (
    COLOURS,
    POINTS,
    STEPS,
    WIDE,
    ErrorBar,
    Steps,
    dot,
    dress,
    legend,
    look,
    room_for,
    short_ticks,
    thinned,
)  # fmt: skip
from lampyris.report.charts.svg import FAINT, INK, PAPER, clean, figure_of, inline

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

__all__ = ["COLOURS", "ErrorBar", "Steps", "bars", "curves", "density", "dots", "profiles", "scatter"]

DISSERTATION = ("#1f4fd8", "#2f9e44", INK)
"""Blue, green and black, as the dissertation says of its figures' bars; black is the page's ink."""
BARS = 3


def bars(
    name: str, groups: Sequence[str], series: Sequence[tuple[str, Sequence[float]]], label: str, xlabel: str
) -> str:
    """Bars side by side for each test run, as Figures 4.5 to 4.7 have them: blue, green, black, and means.

    Parameters
    ----------
    groups : the test runs.
    series : at most three, each with a value a run; NaN has no bar.
    """
    figure = figure_of(WIDE, 3.0)
    axes = figure.add_axes((0.115, 0.24, 0.875, 0.58))
    wide = 0.8 / len(series)
    tops = [v for _, values in series for v in values if math.isfinite(v)]
    for k, ((_, values), colour) in enumerate(zip(series, DISSERTATION, strict=False)):
        at = [g + (k - (len(series) - 1) / 2) * wide for g in range(len(groups))]
        axes.bar(at, [v if math.isfinite(v) else 0.0 for v in values], wide * 0.92, color=colour, linewidth=0)
        for x, v in zip(at, values, strict=True):
            if not math.isfinite(v):
                axes.text(x, 0, "×", ha="center", va="bottom", fontsize=8, color=FAINT)
        _swatch(axes, k, colour, _with_mean(series[k]))
    # A query goes on two lines: five of them stand side by side.
    axes.set_xticks(range(len(groups)), [clean(g, 24).replace(" to ", "\nto ") for g in groups])
    axes.set_xlim(-0.6, len(groups) - 0.4)
    axes.set_ylim(0, 1.05 * max(tops, default=1.0) or 1.0)
    dress(axes, xlabel, label, "y")
    short_ticks(axes.yaxis)
    axes.tick_params(axis="x", labelsize=8 if len(groups) <= 6 else 5.5, length=0)
    return inline(figure, name)


def _with_mean(one: tuple[str, Sequence[float]]) -> str:
    there = [v for v in one[1] if math.isfinite(v)]
    mean = math.fsum(there) / len(there) if there else math.nan
    mean_text = f"{mean:.0f}" if abs(mean) >= 1000 else f"{mean:.4g}"
    return f"{clean(one[0], 20)}, mean {mean_text}" if there else clean(one[0], 20)


def _swatch(axes: Axes, k: int, colour: str, words: str) -> None:
    """An entry of a legend above the axes, three in a row."""
    x, y = k % 3 / 3, 1.08 + 0.09 * (k // 3)
    axes.plot([x], [y], "s", color=colour, markersize=7, transform=axes.transAxes, clip_on=False)
    axes.text(x + 0.02, y, words, transform=axes.transAxes, va="center", fontsize=8, color=INK)


def dots(
    name: str,
    names: Sequence[str],
    panels: Sequence[tuple[str, Sequence[ErrorBar]]],
    label: str,
    *,
    share: bool = False,
) -> str:
    """Values with their intervals, a row for each name and a panel for each traffic case.

    A name has the colour that it has in all figures, in every panel. ``share``: the axis is 0 to 100 %.
    """
    rows, n = len(names), len(panels)
    left = room_for(names)
    width = max(WIDE, left + 1.75 * n)
    height = 0.95 + 0.24 * rows
    figure = figure_of(width, height)
    finite = [v for _, lines in panels for line in lines for v in line if math.isfinite(v)]
    for p, (title, lines) in enumerate(panels):
        span = (width - left - 0.15) / n / width
        at = (left / width + p * span, 0.52 / height, span * 0.93, 0.24 * rows / height)
        axes = figure.add_axes(at)
        for k, line in enumerate(lines):
            dot(axes, line, k, look(k)[0])
        axes.set_ylim(rows - 0.5, -0.5)
        axes.set_yticks(range(rows), [clean(w, 30) for w in names] if p == 0 else [])
        _limits(axes, finite, share)
        axes.set_title(clean(title, 26), fontsize=8.5, color=INK, loc="left", pad=6)
        dress(axes, label, "", "x")
        axes.tick_params(axis="y", length=0)
    return inline(figure, name)


def _limits(axes: Axes, finite: Sequence[float], share: bool) -> None:
    if share:
        axes.set_xlim(-3, 103)
        axes.set_xticks([0, 25, 50, 75, 100])
        return
    low, high = min(finite, default=0.0), max(finite, default=1.0)
    if low > 0 and high / low > 50:
        axes.set_xscale("log")
        axes.set_xlim(low / 1.3, high * 1.3)
        return
    pad = 0.06 * (high - low) or 0.5 * abs(high) or 1.0
    axes.set_xlim(low - pad, high + pad)


def density(
    name: str,
    counts: Sequence[float],
    series: Sequence[tuple[str, Sequence[ErrorBar]]],
    label: str,
    *,
    xlabel: str = "moving obstacles",
    share: bool = True,
) -> str:
    """Values over the number of obstacles or robots, with intervals; the curves stand a little apart to be seen.

    ``share``: the axis is 0 to 100 %.
    """
    figure = figure_of(WIDE, 3.0)
    axes = figure.add_axes((0.11, 0.17, 0.54, 0.78))
    step = 0.012 * ((max(counts) - min(counts)) or 1.0)
    for k, (_, lines) in enumerate(series):
        colour, dash, mark = look(k)
        x = [c + (k - (len(series) - 1) / 2) * step for c in counts]
        axes.plot(
            x,
            [v.value for v in lines],
            color=colour,
            linestyle=dash,
            linewidth=1.6,
            marker=mark,
            markersize=5,
        )
        for at, line in zip(x, lines, strict=True):
            axes.plot([at, at], [line.low, line.high], color=colour, linewidth=1.0)
    axes.set_xticks(list(counts), [f"{c:g}" for c in counts])
    if share:
        axes.set_ylim(-3, 103)
    else:
        _heights(axes, [v for _, lines in series for line in lines for v in line if math.isfinite(v)])
    dress(axes, xlabel, label, "y")
    legend(axes, [words for words, _ in series])
    return inline(figure, name)


def _heights(axes: Axes, finite: Sequence[float]) -> None:
    """A range for values that are no shares; on a log scale where they differ by more than 50 times."""
    low, high = min(finite, default=0.0), max(finite, default=1.0)
    if low > 0 and high / low > 50:
        axes.set_yscale("log")
        axes.set_ylim(low / 1.3, high * 1.3)
        _powers(axes.yaxis)
        return
    pad = 0.06 * (high - low) or 0.5 * abs(high) or 1.0
    axes.set_ylim(low - pad, high + pad)
    short_ticks(axes.yaxis)


def _powers(axis: Axis) -> None:
    """Ticks of a log axis as plain numbers, thousands and millions as such."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    def words(v: float, _: int) -> str:
        unit, sign = (1e6, " M") if v >= 1e6 else (1e3, " k") if v >= 1e4 else (1.0, "")
        return f"{v / unit:g}{sign}"

    axis.set_major_locator(LogLocator(10.0, (1.0,)))
    axis.set_major_formatter(FuncFormatter(words))
    axis.set_minor_formatter(NullFormatter())


def curves(
    name: str, series: Sequence[tuple[str, Sequence[float], Sequence[float]]], xlabel: str, ylabel: str
) -> str:
    """Values against a count on a log scale, a curve of steps for each name."""
    figure = figure_of(WIDE, 3.0)
    axes = figure.add_axes((0.11, 0.17, 0.50, 0.78))
    for k, (_, x, y) in enumerate(series):
        colour, dash, _ = look(k)
        axes.step(x, y, where="post", color=colour, linestyle=dash, linewidth=1.7)
    axes.set_xscale("log")
    _powers(axes.xaxis)
    dress(axes, xlabel, ylabel, "both")
    legend(axes, [words for words, _, _ in series])
    return inline(figure, name)


def profiles(name: str, series: Sequence[tuple[str, Steps]], label: str) -> str:
    """Performance profiles: share of problems within each factor of the best, the factor on a log scale."""
    figure = figure_of(WIDE, max(3.0, 0.72 + 0.185 * len(series)))
    height = figure.get_figheight()
    axes = figure.add_axes((0.11, 0.5 / height, 0.54, 1 - 0.6 / height))
    far = max((s.x[-1] for _, s in series if s.x), default=1.0)
    end = max(1.1, far * 1.05)
    order = sorted(range(len(series)), key=lambda k: (-_area(series[k][1], end), k))
    for k in order:
        steps = series[k][1]
        colour, dash, _ = look(k)
        some = thinned(list(zip(steps.x, steps.y, strict=True)), STEPS)
        x, y = [1.0, *(v for v, _ in some), end], [0.0, *(100 * v for _, v in some)]
        axes.step(x, [*y, y[-1]], where="post", color=colour, linestyle=dash, linewidth=1.7)
    axes.set_xscale("log")
    axes.set_xlim(1.0, end)
    axes.set_ylim(-2, 102)
    _plain_log(axes, end)
    dress(axes, label, "problems (%)", "both")
    legend(axes, [series[k][0] for k in order], order)
    return inline(figure, name)


def _area(steps: Steps, end: float) -> float:
    """Area below a profile over the log of the factor: the order of the legend."""
    x = [*(math.log(v) for v in steps.x), math.log(end)]
    return math.fsum(y * (b - a) for y, a, b in zip(steps.y, x, x[1:], strict=False)) + 1e-9 * sum(
        steps.y[-1:]
    )


def _plain_log(axes: Axes, end: float) -> None:
    """Ticks of a log axis that begins at 1, as plain numbers."""
    from matplotlib.ticker import NullFormatter, NullLocator

    steps = (1.0, 1.05, 1.1, 1.2, 1.5, 2.0, 5.0, 10.0, 100.0, 1e3, 1e4, 1e5, 1e6)
    ticks = [v for v in steps if v <= end]
    apart = math.log(end) / 9
    kept = [ticks[0]]
    for v in ticks[1:]:
        if math.log(v / kept[-1]) >= apart:
            kept.append(v)
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xticks(kept, [f"{v:g}" if v < 1e6 else f"{v:.0e}" for v in kept])


def scatter(
    name: str, series: Sequence[tuple[str, Sequence[float], Sequence[float]]], xlabel: str, ylabel: str
) -> str:
    """Two measures against each other, a point a query; the large mark is the mean of what both have."""
    figure = figure_of(WIDE, max(3.0, 0.72 + 0.185 * len(series)))
    height = figure.get_figheight()
    axes = figure.add_axes((0.11, 0.5 / height, 0.54, 1 - 0.6 / height))
    log, tall = [], 0.0
    for k, (_, xs, ys) in enumerate(series):
        both = [(x, y) for x, y in zip(xs, ys, strict=True) if math.isfinite(x) and math.isfinite(y)]
        if not both:
            continue
        colour, _, mark = look(k)
        x, y = zip(*both, strict=True)
        log += list(x)
        tall = max(tall, *y)
        few = zip(*thinned(both, POINTS), strict=True)
        axes.plot(*few, mark, color=colour, markersize=3, alpha=0.45, linestyle="", markeredgewidth=0)
        mid = (math.fsum(x) / len(x), math.fsum(y) / len(y))
        axes.plot(*([v] for v in mid), mark, color=colour, markersize=8, markeredgecolor=PAPER, zorder=4)
    if log and min(log) > 0 and max(log) / min(log) > 30:
        axes.set_xscale("log")
    if tall > 50:
        axes.set_yscale("symlog", linthresh=1.0)
        ticks = [v for v in (0, 1, 3, 10, 30, 100, 300, 1000, 10000) if v <= tall]
        axes.set_yticks(ticks, [f"{v}" for v in ticks])
        axes.tick_params(axis="y", which="minor", length=0)
        axes.set_ylim(-0.15, tall * 1.2)
    dress(axes, xlabel, ylabel, "both")
    legend(axes, [words for words, _, _ in series], marks=True)
    return inline(figure, name)
