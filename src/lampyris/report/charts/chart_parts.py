"""Chart parts: what the figures of a study have in common: looks, points with intervals, legends, axes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from lampyris.report.charts.svg import FAINT, GRID, INK, PAPER, clean

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis

COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#8a63d2", "#7d8590")
"""Okabe and Ito's without yellow, that cannot be seen on white, and black, that is the ink; a violet and a
grey for more. After eight comes the next kind of line and mark, so that 24 can be distinguished."""
DASHES = ("solid", (0, (5, 2)), (0, (1.5, 1.5)))
MARKS = ("o", "s", "^", "D", "v", "P", "X", "<")
POINTS = 120
"""Points of one row or name at most: of more every k-th is drawn; means and boxes are of all."""
STEPS = 250
"""Steps of a curve at most, likewise."""
WIDE = 5.8
"""Inches of a figure: beside another on a wide screen, its words are as large as those of the page."""


class ErrorBar(NamedTuple):
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


def dot(axes: Axes, line: ErrorBar, k: float, colour: str) -> None:
    """A value with its interval in row ``k``; a word where there is none."""
    if not math.isfinite(line.value):
        axes.text(0.02, k, "none", transform=axes.get_yaxis_transform(), va="center", fontsize=8, color=FAINT)
        return
    if math.isfinite(line.low):
        axes.plot([line.low, line.high], [k, k], color=colour, linewidth=2.0, solid_capstyle="butt")
    axes.plot([line.value], [k], "o", color=colour, markersize=5, markeredgecolor=PAPER, markeredgewidth=0.6)


def short_ticks(axis: Axis) -> None:
    """At most six ticks; where there are tens of thousands, thousands and millions as such."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    def words(v: float, _: int) -> str:
        most = max(map(abs, axis.get_view_interval()))
        unit, sign = (1e6, " M") if most >= 1e6 else (1e3, " k") if most >= 1e4 else (1.0, "")
        return (f"{v / unit:g}{sign}" if v else "0").replace("-", "−")

    axis.set_major_locator(MaxNLocator(6))
    axis.set_major_formatter(FuncFormatter(words))


def legend(
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


def room_for(names: Sequence[str]) -> float:
    """Inches left of the axes for names at their side."""
    return 0.25 + 0.082 * max((len(clean(n, 30)) for n in names), default=4)


def dress(axes: Axes, xlabel: str, ylabel: str, grid: str) -> None:
    """Labels, ticks, grid and edges of axes."""
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


def thinned(values: Sequence[Any], most: int) -> list[Any]:
    """At most so many of some values, evenly by their place, the first and the last among them."""
    n = len(values)
    return list(values) if n <= most else [values[k * (n - 1) // (most - 1)] for k in range(most)]
