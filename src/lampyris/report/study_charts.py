"""Study charts: what a study found, drawn from plain numbers as SVG that stands in a page.

Text stays text (set in the page's font; DejaVu Sans, by which it is measured, is wider than most) and the
colours of ink and paper are the page's own, light or dark. The same numbers give the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from lampyris.report.html import Markup
from lampyris.report.svg_page import FAINT, GRID, INK, PAPER, clean, figure_of, inline

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a63d2", "#7d8590")
"""Okabe and Ito's without yellow, that cannot be seen on white, and black, that is the ink; a violet and a
grey for more. After eight comes the next kind of line and mark, so that 24 can be told apart."""
DASHES = ("solid", (0, (5, 2)), (0, (1.5, 1.5)))
MARKS = ("o", "s", "^", "D", "v", "P", "X", "<")
DISSERTATION = ("#1f4fd8", "#2f9e44", INK)
"""Blue, green and black, as the dissertation says of its figures' bars; black is the page's ink."""
BARS = 3
WIDE = 5.8
"""Inches of a figure: beside another on a wide screen, its words are as large as those of the page."""


class Line(NamedTuple):
    """A value with its interval; NaN where there is none."""

    value: float
    low: float
    high: float


class Steps(NamedTuple):
    """A curve of steps: after each x the share y."""

    x: tuple[float, ...]
    y: tuple[float, ...]


def look(k: int) -> tuple[str, Any, str]:
    """Colour, line and mark of the k-th of many."""
    n = len(COLOURS)
    return COLOURS[k % n], DASHES[k // n % len(DASHES)], MARKS[(k + k // n) % len(MARKS)]


def bars(
    name: str, groups: Sequence[str], series: Sequence[tuple[str, Sequence[float]]], label: str, xlabel: str
) -> Markup:
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
    _dress(axes, xlabel, label, "y")
    _short_ticks(axes.yaxis)
    axes.tick_params(axis="x", labelsize=8 if len(groups) <= 6 else 5.5, length=0)
    return inline(figure, name)


def _with_mean(one: tuple[str, Sequence[float]]) -> str:
    there = [v for v in one[1] if math.isfinite(v)]
    mean = math.fsum(there) / len(there) if there else math.nan
    told = f"{mean:.0f}" if abs(mean) >= 1000 else f"{mean:.4g}"
    return f"{clean(one[0], 20)}, mean {told}" if there else clean(one[0], 20)


def _swatch(axes: Axes, k: int, colour: str, words: str) -> None:
    """An entry of a legend above the axes, three in a row."""
    x, y = k % 3 / 3, 1.08 + 0.09 * (k // 3)
    axes.plot([x], [y], "s", color=colour, markersize=7, transform=axes.transAxes, clip_on=False)
    axes.text(x + 0.02, y, words, transform=axes.transAxes, va="center", fontsize=8, color=INK)


def dots(
    name: str,
    names: Sequence[str],
    panels: Sequence[tuple[str, Sequence[Line]]],
    label: str,
    *,
    share: bool = False,
) -> Markup:
    """Values with their intervals, a row for each name and a panel for each crowd; ``share``: 0 to 100 %."""
    rows, n = len(names), len(panels)
    left = _room_for(names)
    width = max(WIDE, left + 1.75 * n)
    height = 0.95 + 0.24 * rows
    figure = figure_of(width, height)
    finite = [v for _, lines in panels for line in lines for v in line if math.isfinite(v)]
    for p, (title, lines) in enumerate(panels):
        span = (width - left - 0.15) / n / width
        at = (left / width + p * span, 0.52 / height, span * 0.93, 0.24 * rows / height)
        axes = figure.add_axes(at)
        for k, line in enumerate(lines):
            _dot(axes, line, k, COLOURS[p % len(COLOURS)] if share else look(k)[0])
        axes.set_ylim(rows - 0.5, -0.5)
        axes.set_yticks(range(rows), [clean(w, 30) for w in names] if p == 0 else [])
        _limits(axes, finite, share)
        axes.set_title(clean(title, 26), fontsize=8.5, color=INK, loc="left", pad=6)
        _dress(axes, label, "", "x")
        axes.tick_params(axis="y", length=0)
    return inline(figure, name)


def _dot(axes: Axes, line: Line, k: float, colour: str) -> None:
    if not math.isfinite(line.value):
        axes.text(0.02, k, "none", transform=axes.get_yaxis_transform(), va="center", fontsize=8, color=FAINT)
        return
    if math.isfinite(line.low):
        axes.plot([line.low, line.high], [k, k], color=colour, linewidth=2.0, solid_capstyle="butt")
    axes.plot([line.value], [k], "o", color=colour, markersize=5, markeredgecolor=PAPER, markeredgewidth=0.6)


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
    name: str, counts: Sequence[float], series: Sequence[tuple[str, Sequence[Line]]], label: str
) -> Markup:
    """Shares over the number of obstacles, with intervals; the curves stand a little apart to be seen."""
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
    axes.set_ylim(-3, 103)
    _dress(axes, "moving obstacles", label, "y")
    _legend(axes, [words for words, _ in series])
    return inline(figure, name)


def profiles(name: str, series: Sequence[tuple[str, Steps]], label: str) -> Markup:
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
        y = [0.0, *(100 * v for v in steps.y)]
        axes.step(
            [1.0, *steps.x, end], [*y, y[-1]], where="post", color=colour, linestyle=dash, linewidth=1.7
        )
    axes.set_xscale("log")
    axes.set_xlim(1.0, end)
    axes.set_ylim(-2, 102)
    _plain_log(axes, end)
    _dress(axes, label, "problems (%)", "both")
    _legend(axes, [series[k][0] for k in order], order)
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
) -> Markup:
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
        axes.plot(x, y, mark, color=colour, markersize=3, alpha=0.45, linestyle="", markeredgewidth=0)
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
    _dress(axes, xlabel, ylabel, "both")
    _legend(axes, [words for words, _, _ in series], marks=True)
    return inline(figure, name)


def strips(name: str, rows_of: Sequence[tuple[int, str, Sequence[float], Line]], label: str) -> Markup:
    """Paired differences: a point a query with median and quartiles, above it the mean with its interval.

    Parameters
    ----------
    rows_of : of each row, which of all entrants it is (for its colour), its name, differences and mean.
    """
    names = [words for _, words, _, _ in rows_of]
    rows = len(names)
    left, height = _room_for(names), 0.75 + 0.36 * rows
    figure = figure_of(WIDE, height)
    axes = figure.add_axes((left / WIDE, 0.52 / height, 0.97 - left / WIDE, 0.36 * rows / height))
    axes.axvline(0.0, color=FAINT, linewidth=1.0)
    for k, (number, _, values, mean) in enumerate(rows_of):
        colour = look(number)[0]
        # Points of one row are spread over its height by their place in it: nothing is drawn by chance.
        spread = [k + 0.14 + 0.09 * ((i * 0.618034) % 1.0 - 0.5) * 2 for i in range(len(values))]
        axes.plot(values, spread, "o", color=colour, markersize=2.6, alpha=0.5, markeredgewidth=0)
        if values:
            _box(axes, sorted(values), k + 0.14, colour)
        _dot(axes, mean, k - 0.2, colour)
    axes.set_ylim(rows - 0.5, -0.6)
    axes.set_yticks(range(rows), [clean(w, 30) for w in names])
    _dress(axes, label, "", "x")
    axes.tick_params(axis="y", length=0)
    _short_ticks(axes.xaxis)
    return inline(figure, name)


def _short_ticks(axis: Axis) -> None:
    """At most six ticks; where there are tens of thousands, thousands and millions as such."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    def words(v: float, _: int) -> str:
        most = max(map(abs, axis.get_view_interval()))
        unit, sign = (1e6, " M") if most >= 1e6 else (1e3, " k") if most >= 1e4 else (1.0, "")
        return (f"{v / unit:g}{sign}" if v else "0").replace("-", "−")

    axis.set_major_locator(MaxNLocator(6))
    axis.set_major_formatter(FuncFormatter(words))


def _box(axes: Axes, values: Sequence[float], y: float, colour: str) -> None:
    """Median and quartiles, by linear interpolation."""
    q1, mid, q3 = (_quantile(values, q) for q in (0.25, 0.5, 0.75))
    x = [q1, q3, q3, q1, q1]
    axes.plot(x, [y - 0.12, y - 0.12, y + 0.12, y + 0.12, y - 0.12], color=colour, linewidth=0.9)
    axes.plot([mid, mid], [y - 0.12, y + 0.12], color=INK, linewidth=1.4)


def _quantile(values: Sequence[float], q: float) -> float:
    at = q * (len(values) - 1)
    k = math.floor(at)
    return values[k] + (at - k) * (values[min(k + 1, len(values) - 1)] - values[k])


def critical(
    name: str, names: Sequence[str], ranks: Sequence[float], distance: float, sets: Sequence[Sequence[int]]
) -> Markup:
    """A critical-difference diagram (Demsar 2006): a line of ranks, a bar for each set without difference."""
    order = sorted(range(len(names)), key=lambda k: (ranks[k], k))
    half = (len(order) + 1) // 2
    bars_high = 0.13 * max(1, len(sets))
    height = 0.75 + bars_high + 0.2 * half
    figure = figure_of(WIDE, height)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(0, WIDE)
    axes.set_ylim(height, 0)
    k = max(2, len(names))

    def x(rank: float) -> float:
        return 1.95 + 1.9 * (rank - 1) / (k - 1)

    top = 0.55
    axes.plot([x(1), x(k)], [top, top], color=INK, linewidth=1.2)
    for rank in range(1, k + 1) if k <= 12 else sorted({1, *range(4, k, 4), k}):
        axes.plot([x(rank)] * 2, [top - 0.06, top], color=INK, linewidth=1.0)
        axes.text(x(rank), top - 0.09, f"{rank}", ha="center", va="bottom", fontsize=8, color=FAINT)
    if math.isfinite(distance):
        shown = min(distance, k - 1.0)
        axes.plot([x(1), x(1 + shown)], [0.2, 0.2], color=INK, linewidth=2.0, solid_capstyle="butt")
        words = f"critical difference {distance:.2f}" + ("" if distance <= k - 1 else ", beyond all ranks")
        axes.text(x(1 + shown) + 0.06, 0.2, words, va="center", fontsize=8, color=INK)
    for n, group in enumerate(sets):
        ends = [x(ranks[group[0]]) - 0.05, x(ranks[group[-1]]) + 0.05]
        y = top + 0.1 + 0.13 * n
        axes.plot(ends, [y, y], color=INK, linewidth=3.2, solid_capstyle="butt")
    below = top + bars_high
    for place, one in enumerate(order):
        left = place < half
        y = below + 0.17 + 0.2 * (place if left else len(order) - 1 - place)
        side, align = (1.8, "right") if left else (4.0, "left")
        colour = look(one)[0]
        axes.plot([x(ranks[one]), x(ranks[one]), side], [top, y, y], color=colour, linewidth=1.1)
        words = f"{clean(names[one], 20)}  {ranks[one]:.2f}"
        axes.text(side + (-0.06 if left else 0.06), y, words, ha=align, va="center", fontsize=8.5, color=INK)
    return inline(figure, name)


def _legend(
    axes: Axes, words: Sequence[str], order: Sequence[int] | None = None, *, marks: bool = False
) -> None:
    """Names right of the axes, one below the other."""
    figure: Any = axes.figure
    high = figure.get_figheight() * axes.get_position().height
    for row, (text, k) in enumerate(zip(words, order or range(len(words)), strict=True)):
        colour, dash, mark = look(k)
        y = 1.0 - (0.1 + 0.185 * row) / high
        at: dict[str, Any] = {"transform": axes.transAxes, "clip_on": False, "color": colour}
        if marks:
            axes.plot([1.07], [y], mark, markersize=6, linestyle="", **at)
        else:
            axes.plot([1.04, 1.11], [y, y], linestyle=dash, linewidth=1.8, **at)
        axes.text(1.14, y, clean(text, 22), transform=axes.transAxes, va="center", fontsize=8.5, color=INK)


def _room_for(names: Sequence[str]) -> float:
    """Inches left of the axes for names at their side."""
    return 0.25 + 0.082 * max((len(clean(n, 30)) for n in names), default=4)


def _dress(axes: Axes, xlabel: str, ylabel: str, grid: str) -> None:
    axes.set_xlabel(clean(xlabel, 60), fontsize=9, color=INK)
    axes.set_ylabel(clean(ylabel, 40), fontsize=9, color=INK)
    axes.tick_params(labelsize=8.5, colors=INK, length=3, width=0.6)
    axes.tick_params(axis="x", which="minor", length=2, width=0.5, colors=INK, labelsize=7)
    axes.grid(axis=grid, color=GRID, linewidth=0.8)  # type: ignore[arg-type]
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(FAINT)
        axes.spines[side].set_linewidth(0.8)
