"""A swarm on its map: every robot's path, the robots at the end, and the sources with what they hold."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.model.swarm.swarm_trace import SwarmTrace
from lampyris.report import style
from lampyris.report.pictures import canvas
from lampyris.typing import FloatGrid, Points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_NOBODY = (0.45, 0.47, 0.51)
"""Colour of a robot that no source holds."""
_LABELS = (
    "path of a robot", "robot that a source holds at the end", "robot that none holds", "source", "capture radius",
)  # fmt: skip


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
    suffix = style.suffix_of(out, (".png", ".svg"))
    grid, settings = trace.grid, trace.settings
    radius, capture = settings.radius, settings.capture_radius
    assert radius is not None
    assert capture is not None
    figure, axes, frame = canvas.blank(grid, [], labels=[*_LABELS, "wall"])
    if signal is not None:
        edge = (-0.5, grid.width - 0.5, grid.height - 0.5, -0.5)
        colours = style.landscape_map().reversed()
        axes.imshow(
            np.ma.masked_invalid(signal), cmap=colours, extent=edge, interpolation="nearest", zorder=0.5
        )
    points = grid.to_points(trace.xy[..., 0], trace.xy[..., 1])
    peaks = grid.to_points(trace.source_xy[..., 0], trace.source_xy[..., 1])
    faces = [_NOBODY if k < 0 else _rgb(k) for k in trace.holder.tolist()]
    _lines(axes, points, faces, {"linewidths": 0.7, "alpha": 0.4})
    moving = (peaks != peaks[0]).any(axis=(0, 2))
    _lines(axes, peaks[:, moving], style.INK, {"linewidths": 0.9})
    ring = {"facecolors": "none", "linestyles": "--", "linewidths": 0.8, "zorder": 4}
    _circles(axes, peaks[-1], capture / grid.resolution, ring)
    _circles(
        axes, points[-1], radius / grid.resolution, {"facecolors": faces, "linewidths": 0.4, "zorder": 5}
    )
    _mark_sources(axes, trace, peaks[-1], capture / grid.resolution * frame.cell)
    title = f"{trace.robots} robots on {grid.name or 'a map'}, {settings.method}"
    held = ", ".join(map(str, trace.held[-1].tolist()))
    words = f"{trace.sentence} {trace.iterations} iterations, seed {trace.seed}; held {held}"
    items = [*_legend(), *canvas.patches(grid, None)]
    canvas.draw_words(figure, frame, title, words, canvas.size_of(grid), items)
    style.save(figure, out, suffix, canvas.DPI)


def _lines(axes: Axes, tracks: Points, colours: Any, look: dict[str, Any]) -> None:
    """A line for each column of (moments, n, 2), cells."""
    from matplotlib.collections import LineCollection

    lines: Any = list(tracks.transpose(1, 0, 2))
    axes.add_collection(LineCollection(lines, colors=colours, zorder=3, **look), autolim=False)


def _circles(axes: Axes, centres: Points, radius: float, look: dict[str, Any]) -> None:
    """Circles of one radius in cells."""
    from matplotlib.collections import EllipseCollection

    wide = np.full(len(centres), 2 * radius)
    where: dict[str, Any] = {"units": "xy", "offsets": centres, "offset_transform": axes.transData}
    circles = EllipseCollection(wide, wide, np.zeros(len(centres)), edgecolors=style.INK, **where, **look)
    axes.add_collection(circles, autolim=False)


def _mark_sources(axes: Axes, trace: SwarmTrace, peaks: Points, above: float) -> None:
    """A cross at each source, cells, and beyond ``above`` points over it how many robots it holds."""
    axes.plot(peaks[:, 0], peaks[:, 1], "+", color=style.INK, markersize=9, markeredgewidth=1.6, zorder=6)
    for k, (x, y) in enumerate(peaks.tolist()):
        axes.annotate(
            str(int(trace.held[-1, k])), (x, y), (0, 12.6 + above), textcoords="offset points", ha="center", va="bottom",
            fontsize=9, fontweight="bold", color=style.INK, zorder=7, annotation_clip=True,
            bbox={"facecolor": "white", "alpha": 0.75, "edgecolor": "none", "pad": 1.2},
        )  # fmt: skip


def _legend() -> list[Any]:
    """Entries for paths, robots, sources and capture radius."""
    from matplotlib.lines import Line2D

    disc: dict[str, Any] = {"marker": "o", "linestyle": "", "markersize": 7, "markeredgecolor": style.INK}
    return [
        Line2D([], [], color=style.FAINT, linewidth=1.0, label=_LABELS[0]),
        Line2D([], [], markerfacecolor=_rgb(0), label=_LABELS[1], **disc),
        Line2D([], [], markerfacecolor=_NOBODY, label=_LABELS[2], **disc),
        Line2D([], [], color=style.INK, marker="+", linestyle="", markersize=9, label=_LABELS[3]),
        Line2D([], [], color=style.INK, linestyle="--", linewidth=0.8, label=_LABELS[4]),
    ]


def _rgb(k: int) -> tuple[float, float, float]:
    r, g, b = style.FLEET[k % len(style.FLEET)]
    return r / 255, g / 255, b / 255
