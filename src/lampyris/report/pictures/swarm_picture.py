"""A swarm on its map: every robot's path, the robots at the end, and the sources with what they hold."""

from __future__ import annotations

from typing import Any

import numpy as np

from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.report import style
from lampyris.report.pictures import canvas
from lampyris.typing import FloatGrid


def draw_swarm(trace: SwarmTrace, out: style.OutFile, *, signal: FloatGrid | None = None) -> None:
    """Draw a swarm as PNG or SVG by the file's suffix; the same trace gives the same bytes.

    Parameters
    ----------
    trace : of a swarm.
    signal : (height, width), >= 0: drawn beneath; None: nothing.

    Raises
    ------
    UsageError : another suffix.
    FileError : the system refuses to write.
    """
    from matplotlib.collections import EllipseCollection, LineCollection
    from matplotlib.lines import Line2D

    suffix = style.suffix_of(out, (".png", ".svg"))
    grid, settings = trace.grid, trace.settings
    radius, capture = settings.radius, settings.capture_radius
    assert radius is not None
    assert capture is not None
    labels = [
        "path of a robot",
        "robot that a source holds at the end",
        "robot that none holds",
        "source",
        "capture radius",
    ]
    figure, axes, frame = canvas.blank(grid, [], labels=[*labels, "wall"])
    if signal is not None:
        shown = np.ma.masked_invalid(signal)
        edge = (-0.5, grid.width - 0.5, grid.height - 0.5, -0.5)
        axes.imshow(
            shown, cmap=style.landscape_map().reversed(), extent=edge, interpolation="nearest", zorder=0.5
        )
    points = grid.to_points(trace.xy[..., 0], trace.xy[..., 1])
    peaks = grid.to_points(trace.source_xy[..., 0], trace.source_xy[..., 1])
    by = trace.holder
    colours = [(0.45, 0.47, 0.51) if k < 0 else _rgb(k) for k in by.tolist()]
    lines: Any = list(points.transpose(1, 0, 2))
    axes.add_collection(
        LineCollection(lines, colors=colours, linewidths=0.7, alpha=0.4, zorder=3), autolim=False
    )
    moving = [peaks[:, k] for k in range(peaks.shape[1]) if (peaks[:, k] != peaks[0, k]).any()]
    axes.add_collection(LineCollection(moving, colors=style.INK, linewidths=0.9, zorder=3), autolim=False)
    for centres, metres, look in (
        (
            peaks[-1],
            capture,
            {
                "facecolors": "none",
                "edgecolors": style.INK,
                "linestyles": "--",
                "linewidths": 0.8,
                "zorder": 4,
            },
        ),
        (
            points[-1],
            radius,
            {"facecolors": colours, "edgecolors": style.INK, "linewidths": 0.4, "zorder": 5},
        ),
    ):
        wide = np.full(len(centres), 2 * metres / grid.resolution)
        axes.add_collection(
            EllipseCollection(
                wide,
                wide,
                np.zeros(len(centres)),
                units="xy",
                offsets=centres,
                offset_transform=axes.transData,
                **look,
            ),
            autolim=False,
        )
    axes.plot(
        peaks[-1, :, 0], peaks[-1, :, 1], "+", color=style.INK, markersize=9, markeredgewidth=1.6, zorder=6
    )
    for k, (x, y) in enumerate(peaks[-1].tolist()):
        axes.annotate(
            str(int(trace.held[-1, k])), (x, y), (0, 0.5 * 72 * 0.35 + capture / grid.resolution * frame.cell),
            textcoords="offset points", ha="center", va="bottom", fontsize=9, fontweight="bold", color=style.INK, zorder=7,
            annotation_clip=True, bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1.2},
        )  # fmt: skip
    disc: dict[str, Any] = {"marker": "o", "linestyle": "", "markersize": 7, "markeredgecolor": style.INK}
    items: list[Any] = [
        Line2D([], [], color=style.FAINT, linewidth=1.0, label=labels[0]),
        Line2D([], [], markerfacecolor=_rgb(0), label=labels[1], **disc),
        Line2D([], [], markerfacecolor=(0.45, 0.47, 0.51), label=labels[2], **disc),
        Line2D([], [], color=style.INK, marker="+", linestyle="", markersize=9, label=labels[3]),
        Line2D([], [], color=style.INK, linestyle="--", linewidth=0.8, label=labels[4]),
        *canvas.patches(grid, None),
    ]
    title = f"{trace.robots} robots on {grid.name or 'a map'}, {settings.method}"
    held = ", ".join(map(str, trace.held[-1].tolist()))
    words = f"{trace.sentence} {trace.iterations} iterations, seed {trace.seed}; held {held}"
    canvas.draw_words(figure, frame, title, words, canvas.size_of(grid), items)
    style.save(figure, out, suffix, canvas.DPI)


def _rgb(k: int) -> tuple[float, float, float]:
    r, g, b = style.FLEET[k % len(style.FLEET)]
    return r / 255, g / 255, b / 255
