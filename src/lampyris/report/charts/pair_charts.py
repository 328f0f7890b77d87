"""Pair charts: how planners differ in the same worlds, and which differences are none."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from lampyris.report.charts.chart_parts import (
    POINTS,
    WIDE,
    ErrorBar,
    dot,
    dress,
    look,
    room_for,
    short_ticks,
    thinned,
)
from lampyris.report.charts.svg import FAINT, INK, clean, figure_of, inline

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def strips(name: str, rows_of: Sequence[tuple[int, str, Sequence[float], ErrorBar]], label: str) -> str:
    """Paired differences: a point a query with median and quartiles, above it the mean with its interval.

    Parameters
    ----------
    rows_of : of each row, which of all entrants it is (for its colour), its name, differences and mean.
    """
    names = [words for _, words, _, _ in rows_of]
    rows = len(names)
    left, height = room_for(names), 0.75 + 0.36 * rows
    figure = figure_of(WIDE, height)
    axes = figure.add_axes((left / WIDE, 0.52 / height, 0.97 - left / WIDE, 0.36 * rows / height))
    axes.axvline(0.0, color=FAINT, linewidth=1.0)
    for k, (number, _, values, mean) in enumerate(rows_of):
        colour = look(number)[0]
        # Points of one row are spread over its height by their place in it: nothing is drawn by chance.
        few = thinned(values, POINTS)
        spread = [k + 0.14 + 0.09 * ((i * 0.618034) % 1.0 - 0.5) * 2 for i in range(len(few))]
        axes.plot(few, spread, "o", color=colour, markersize=2.6, alpha=0.5, markeredgewidth=0)
        if values:
            _box(axes, sorted(values), k + 0.14, colour)
        dot(axes, mean, k - 0.2, colour)
    axes.set_ylim(rows - 0.5, -0.6)
    axes.set_yticks(range(rows), [clean(w, 30) for w in names])
    dress(axes, label, "", "x")
    axes.tick_params(axis="y", length=0)
    short_ticks(axes.xaxis)
    return inline(figure, name)


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
) -> str:
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
