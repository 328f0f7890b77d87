"""The distribution of an uncertain outcome, and which setting carries it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.report import style
from lampyris.report.charts.chart_parts import COLOURS
from lampyris.report.charts.speed_chart import DPI
from lampyris.report.charts.svg import clean
from lampyris.typing import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TITLES = {"duration": "arrival time", "length": "length of the path", "energy": "energy"}
_BINS = 60


def draw_uncertainty(
    sample: Floats,
    shares: Mapping[str, tuple[float, float, float | None]],
    of: str,
    unit: str,
    nominal: float | None,
    out: style.OutFile,
) -> None:
    """Draw the density of an outcome and bars of its Sobol indices, as PNG or SVG by the file's suffix.

    Parameters
    ----------
    sample : outcomes of random inputs, (n,).
    shares : first-order and total index of each setting, and the standard error of the total one or None.
    of, unit : what the outcome is.
    nominal : the outcome at the settings as they are; None: not drawn.

    Raises
    ------
    UsageError : another suffix.
    FileError : the system refuses to write.
    """
    from matplotlib.figure import Figure

    suffix = style.suffix_of(out, (".png", ".svg"))
    rows = len(shares)
    height = 4.2 + 0.42 * rows
    figure = Figure(figsize=(8.0, height), dpi=DPI, facecolor="white")
    bars_high = (0.42 * rows + 0.15) / height
    upper = figure.add_axes((0.15, bars_high + 1.35 / height, 0.8, 2.05 / height))
    lower = figure.add_axes((0.15, 0.55 / height, 0.8, bars_high))
    title = f"Distribution of the {_TITLES.get(of, of or 'outcome')}"
    figure.text(0.02, 1.0 - 0.12 / height, title, fontsize=12, fontweight="bold", color=style.INK, va="top")
    _draw_density(upper, sample, of, unit, nominal)
    _draw_shares(lower, shares)
    style.save(figure, out, suffix, DPI)


def _draw_density(axes: Axes, sample: Floats, of: str, unit: str, nominal: float | None) -> None:
    low, median, high = np.quantile(sample, (0.05, 0.5, 0.95)).tolist()
    spread = float(sample.max() - sample.min())
    bins: Any = _BINS if spread > 1e-9 * max(abs(median), 1e-300) else [median - 0.5, median + 0.5]
    axes.axvspan(low, high, color=COLOURS[0], alpha=0.12, linewidth=0)
    axes.hist(sample, bins=bins, density=True, color=COLOURS[0], alpha=0.85)
    axes.set_ylim(0.0, 1.22 * axes.get_ylim()[1])
    marks: dict[str, Any] = {
        "transform": axes.get_xaxis_transform(),
        "fontsize": 8.5,
        "color": style.INK,
        "va": "top",
    }
    axes.axvline(median, color=style.INK, linewidth=1.4)
    axes.text(median, 0.985, f" median {median:.4g}", ha="left", **marks)
    for value, word, side in ((low, "5 % ", "right"), (high, " 95 %", "left")):
        axes.text(value, 0.86, word, ha=side, **{**marks, "color": style.FAINT})
        axes.axvline(value, color=style.FAINT, linewidth=0.8)
    if nominal is not None:
        axes.axvline(nominal, color=COLOURS[1], linewidth=1.4, linestyle="--")
        left = nominal < median
        low, high = axes.get_xlim()
        if left and nominal - low < 0.16 * (high - low):  # no room for the words
            axes.set_xlim(nominal - 0.16 / 0.84 * (high - nominal), high)
        elif not left and high - nominal < 0.16 * (high - low):
            axes.set_xlim(low, nominal + 0.16 / 0.84 * (nominal - low))
        place = {"ha": "right" if left else "left", **marks, "color": COLOURS[1]}
        axes.text(nominal, 0.985 if left else 0.74, f" as set {nominal:.4g} ", **place)
    axes.set_xlabel(
        f"{_TITLES.get(of, of or 'outcome')}{f' ({unit})' if unit else ''}", fontsize=9, color=style.INK
    )
    axes.set_ylabel("density", fontsize=9, color=style.INK)
    _plain(axes)


def _draw_shares(axes: Axes, shares: Mapping[str, tuple[float, float, float | None]]) -> None:
    """A bar for each setting, the greatest on top: by itself, and the rest together with others."""
    order = sorted(shares, key=lambda name: shares[name][1])
    label = "standard error"
    for k, name in enumerate(order):
        alone, total, error = shares[name]
        first = max(0.0, alone)
        together = max(0.0, total - first)
        words = ("by itself", "together with others") if k == 0 else (None, None)
        axes.barh(k, first, height=0.62, color=COLOURS[0], label=words[0])
        axes.barh(k, together, left=first, height=0.62, color=COLOURS[4], label=words[1])
        end = first + together
        if error:
            axes.errorbar(end, k, xerr=error, color=style.INK, capsize=3.0, linewidth=1.0, label=label)
            end, label = end + error, "_nolegend_"
        axes.text(end + 0.01, k, f"{max(first, total):.1%}", va="center", fontsize=8.5, color=style.INK)
    axes.set_yticks(range(len(order)), [clean(name, 20) for name in order], fontsize=9)
    axes.set_xlim(0.0, 1.12)
    axes.set_xticks((0.0, 0.25, 0.5, 0.75, 1.0), ("0", "25 %", "50 %", "75 %", "100 %"))
    axes.set_ylim(-0.6, len(order) - 0.4)
    axes.set_xlabel("share of the variance", fontsize=9, color=style.INK)
    axes.legend(
        frameon=False, fontsize=8.5, labelcolor=style.INK, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3,
        borderaxespad=0.1,
    )  # fmt: skip
    _plain(axes)


def _plain(axes: Axes) -> None:
    axes.tick_params(labelsize=8.5, colors=style.INK, length=3, width=0.6)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
