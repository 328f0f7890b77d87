"""The chart of a segmented photograph: its histogram, the thresholds, and which classes are free."""

from __future__ import annotations

import numpy as np

from lampyris.model.photos.segmented_photo import LEVELS, SegmentedPhoto
from lampyris.report import style

DPI = 150
_FREE, _NOT_FREE = "#009e73", "#7d8590"
_THRESHOLD = "#d55e00"
_WIDE, _MIDDLING, _NARROW = 24, 10, 6
"""Levels of a class from which its name and share, its number and share, and its number alone have room above it."""
_TOO_HIGH = 4.0
"""A level with so many times the pixels of the 99th percentile is cut off at the top of the chart."""


def draw_histogram(made: SegmentedPhoto, out: style.OutFile) -> None:
    """Draw how many pixels have each level, coloured by whether their class is free; PNG or SVG by the suffix.

    Raises
    ------
    UsageError : another suffix.
    FileError : the system refuses to write.
    """
    from matplotlib.figure import Figure

    suffix = style.suffix_of(out, (".png", ".svg"))
    figure = Figure(figsize=(8.0, 3.9), dpi=DPI, facecolor="white")
    axes = figure.add_axes((0.095, 0.15, 0.885, 0.64))
    many = made.histogram.astype(np.float64)
    top = float(many.max())
    usual = float(np.percentile(many[many > 0], 99.0))
    cut = top > _TOO_HIGH * usual
    top = _TOO_HIGH * usual if cut else top
    levels = np.arange(LEVELS)
    last = len(made.thresholds)
    for c, (low, high, pixels) in enumerate(made.ranges()):
        free = c in made.free
        here = slice(low, high + 1)
        axes.bar(
            levels[here], np.minimum(many[here], top), width=1.0, color=_FREE if free else _NOT_FREE,
            hatch=None if free else "////", edgecolor="white", linewidth=0.0,
        )  # fmt: skip
        share = pixels / max(int(made.histogram.sum()), 1)
        width, kind = high + 1 - low, "free" if free else "blocked"
        words = (
            f"{c}: {kind}\n{share:.0%}"
            if width >= _WIDE
            else f"{c}\n{share:.0%}"
            if width >= _MIDDLING
            else f"{c}"
        )
        raised = 1.1 if width < _NARROW and c % 2 else 1.02
        axes.text(
            (low + high) / 2, raised * top, words, ha="center", va="bottom",
            fontsize=8, color=_FREE if free else style.INK, fontweight="bold" if free else "normal",
        )  # fmt: skip
    behind = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
    for level in made.thresholds:
        axes.axvline(level + 0.5, color=_THRESHOLD, linewidth=1.3)
        axes.text(
            level + 1.2,
            0.98 * top,
            f"{level}",
            fontsize=8,
            color=_THRESHOLD,
            va="top",
            rotation=90,
            bbox=behind,
        )
    axes.set_xlim(-0.5, LEVELS - 0.5)
    axes.set_ylim(0.0, top)
    axes.set_xticks([0, 32, 64, 96, 128, 160, 192, 224, 255])
    axes.set_xlabel(f"grey level ({made.settings.channel})", fontsize=9, color=style.INK)
    axes.set_ylabel("pixels", fontsize=9, color=style.INK)
    axes.tick_params(labelsize=8, colors=style.FAINT)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    wanted = made.settings
    title = f"{made.grid.name or 'a photograph'}: {last} threshold{'s' * (last != 1)} by {wanted.criterion}, {wanted.by}"
    figure.text(0.012, 0.975, title, fontsize=10, fontweight="bold", color=style.INK, va="top")
    words = f"score {made.score:.5g} of at most {made.optimum:.5g}, gap {made.gap:.2%}"
    words += "; columns cut off at the top are higher" if cut else ""
    figure.text(0.988, 0.97, words, fontsize=8.5, color=style.FAINT, va="top", ha="right")
    style.save(figure, out, suffix, DPI)
