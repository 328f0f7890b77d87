"""Charts of the page: the dissertation's figures in kind, and ours beside them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from lampyris.report.charts.study_charts import COLOURS, bars
from lampyris.report.charts.svg import FAINT, GRID, INK, figure_of, inline
from lampyris.reproduce.runs.results import Results, pairs_of
from lampyris.reproduce.tables import printed_data, velocity
from lampyris.reproduce.tables.claims import PATHS
from lampyris.reproduce.tables.comparison import METHODS, seconds

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FIGURES: Mapping[str, str] = {"1": "4.8", "2": "4.9", "3": "4.10", "4": "4.11"}
"""Which figure of the dissertation shows each path."""


@dataclass(frozen=True, slots=True)
class Bars:
    """One of Figures 4.5 to 4.7: a column of Table 4.11 on environment 1."""

    figure: str
    column: str
    label: str
    ours: str
    ours_label: str


BARS = (
    Bars("4.5", "iterations", "iterations", "iterations", "iterations"),
    Bars("4.6", "path_cost", "what is printed as path cost", "printed", "the same, on env-1"),
    Bars("4.7", "time", "seconds", "plan_ms", "milliseconds, this machine"),
)


def pair_names() -> list[str]:
    """The five pairs of environment 1, for an axis."""
    return [f"{a[0]},{a[1]} to {b[0]},{b[1]}" for a, b in pairs_of("1")]


def as_printed(which: Bars) -> str:
    """A figure of the dissertation from the numbers of its table."""
    series = []
    for method in METHODS:
        rows = [r for r in printed_data.rows("4.11") if (r["environment"], r["method"]) == ("1", method)]
        texts = [r[which.column] for r in rows]
        values = [seconds(t) or 0.0 for t in texts] if which.column == "time" else [float(t) for t in texts]
        series.append((method, values))
    return bars(f"printed-{which.column}", pair_names(), series, which.label, "printed in Table 4.11")


def as_ours(which: Bars, found: Results) -> str:
    """The same with what our methods do on our env-1."""
    series = [(m, found.first[m][which.ours]) for m in METHODS]
    return bars(f"ours-{which.column}", pair_names(), series, which.ours_label, "ours, on env-1")


def lengths(found: Results) -> str:
    """What Figure 4.6 should have shown: lengths, all three of them."""
    series = [(m, found.first[m]["cost"]) for m in METHODS]
    return bars("ours-length", pair_names(), series, "length of the path (cells)", "ours, on env-1")


def path_speed(path: str) -> str:
    """One of Figures 4.8 to 4.11 in kind: the cells of the path, and the velocity at each of them."""
    table = PATHS[path]
    rows = printed_data.rows(table)
    figure = figure_of(7.6, 3.1)
    _draw_path(figure.add_axes((0.07, 0.16, 0.3, 0.74)), table)
    axes = figure.add_axes((0.47, 0.16, 0.52, 0.74))
    printed = [float(r["adaptive_velocity"]) for r in rows]
    ours = velocity.rule(table)
    axes.plot(range(len(ours)), ours, "-", color=COLOURS[0], linewidth=1.6)
    axes.plot(range(len(printed)), printed, "o", color=INK, markersize=4, markerfacecolor="none")
    odd = [(k, a) for k, (a, b) in enumerate(zip(printed, ours, strict=True)) if a != b]
    axes.plot(*_split(odd), "x", color=COLOURS[1], markersize=9, markeredgewidth=2)
    axes.set_ylim(0, 92)
    axes.set_title(
        "circles: printed; line: the law; crosses: not the same", fontsize=8, color=INK, loc="left"
    )
    axes.locator_params(axis="x", integer=True)
    _axes(axes, "node", "velocity units")
    return inline(figure, f"path-{path}")


def _draw_path(axes: Axes, table: str) -> None:
    cells = velocity.cells(table)
    xs, ys = [c[0] for c in cells], [c[1] for c in cells]
    axes.plot(xs, ys, "-o", color=COLOURS[0], linewidth=1.3, markersize=3)
    axes.plot(xs[:1], ys[:1], "s", color=COLOURS[1], markersize=6)
    axes.plot(xs[-1:], ys[-1:], "D", color=COLOURS[2], markersize=6)
    axes.invert_yaxis()
    axes.set_aspect("equal", adjustable="datalim")
    axes.set_title("square: start; diamond: end", fontsize=8.5, color=INK, loc="left")
    axes.locator_params(integer=True)
    _axes(axes, "x", "y")


def _axes(axes: Axes, xlabel: str, ylabel: str) -> None:
    axes.set_xlabel(xlabel, fontsize=8.5, color=INK)
    axes.set_ylabel(ylabel, fontsize=8.5, color=INK)
    axes.tick_params(labelsize=8, colors=FAINT, length=3, width=0.6)
    axes.grid(color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    for side in ("left", "bottom"):
        axes.spines[side].set_color(FAINT)


def sweep(found: Results) -> str:
    """Mean iterations and mean cost by nt with their intervals, beside the printed means of Table 4.9."""
    figure = figure_of(7.6, 3.0)
    names = [m.name.removeprefix("nt ") for m in found.nt]
    printed = {r["nt"]: r for r in printed_data.rows("4.9")}
    for k, (measure, column, label) in enumerate(
        (("iterations", "iterations", "mean iterations"), ("cost", "path_cost", "mean path cost (cells)"))
    ):
        axes = figure.add_axes((0.08 + 0.5 * k, 0.17, 0.41, 0.7))
        for at, m in enumerate(found.nt):
            value = m.means[measure]
            axes.plot([at, at], [value.low, value.high], color=COLOURS[0], linewidth=2)
            axes.plot([at], [value.value], "o", color=COLOURS[0], markersize=4.5)
        there = [(at, float(printed[n][column])) for at, n in enumerate(names) if n in printed]
        axes.plot(*_split(there), "x", color=INK, markersize=6)
        axes.set_xticks(range(len(names)), names)
        axes.set_title("dots: ours with intervals; crosses: Table 4.9", fontsize=8, color=INK, loc="left")
        _axes(axes, "nt", label)
    return inline(figure, "nt")


def _split(points: Sequence[tuple[float, float]]) -> tuple[list[float], list[float]]:
    return [p[0] for p in points], [p[1] for p in points]
