"""A map on paper: the ground, the ends, colour bars beside it, title above, legend below."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris._core.cancellation import uninterrupted
from lampyris.model.grid import Grid
from lampyris.report import style
from lampyris.report.pictures.raster import draw_map
from lampyris.typing import FloatGrid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 150

_LONG = 6.6
"""Longer side of the map, inches."""
_LEAST = 2.6
"""Shorter side of the map at least, inches."""
_PIXELS = 1200
"""Pixels of the map's longer side: a little more than are shown, so that cells stay square."""


@dataclass(frozen=True, slots=True)
class FigureLayout:
    """Where things stand, inches: width and height of the figure, the map's box, and points a cell."""

    width: float
    height: float
    left: float
    bottom: float
    map_width: float
    map_height: float
    cell: float

    def box(self, x: float, y: float, w: float, h: float) -> tuple[float, float, float, float]:
        return (x / self.width, y / self.height, w / self.width, h / self.height)


def frame_of(grid: Grid, bars: int) -> FigureLayout:
    """Room for a map and so many colour bars beside it."""
    long = max(grid.width, grid.height)
    w = max(_LEAST, _LONG * grid.width / long)
    h = max(_LEAST, _LONG * grid.height / long)
    cell = 72 * min(w / grid.width, h / grid.height)
    width = 0.75 + w + (1.35 if bars else 0.35)
    return FigureLayout(max(width, 5.2), 0.8 + h + 1.25, 0.75, 1.25, w, h, cell)


def blank(
    grid: Grid,
    bars: Sequence[tuple[Any, float, str]],
    values: FloatGrid | None = None,
    labels: Sequence[str] = (),
    below: float = 0.0,
) -> tuple[Figure, Axes, FigureLayout]:
    """A figure with the map, a landscape on it if there is one, and colour bars beside it.

    ``labels``: those of the legend to come, where there may be more than three rows of them. ``below``:
    inches that are kept free beneath the legend.
    """
    with uninterrupted():
        from matplotlib.figure import Figure

    frame = frame_of(grid, len(bars))
    more = 0.2 * max(0, _rows(labels, frame) - 3) + below
    if more > 0:
        frame = replace(frame, height=frame.height + more, bottom=frame.bottom + more)
    figure = Figure(figsize=(frame.width, frame.height), dpi=DPI, facecolor="white")
    axes = figure.add_axes(frame.box(frame.left, frame.bottom, frame.map_width, frame.map_height))
    draw_ground(axes, grid, values, frame)
    draw_bars(figure, frame, bars)
    return figure, axes, frame


def size_of(grid: Grid) -> str:
    """``50 x 50 cells of 0.05 m``."""
    return f"{grid.width} x {grid.height} cells of {grid.resolution:g} m"


def draw_ground(axes: Axes, grid: Grid, values: FloatGrid | None, frame: FigureLayout) -> None:
    """Map and landscape as one image, then the cells' lines and numbers where there is room for them."""
    from matplotlib.ticker import FixedLocator, MaxNLocator

    raster = draw_map(grid, _PIXELS, values, style.landscape_colours())
    rows, columns = raster.rgb.shape[:2]
    # Blocks at the far edges may hang over; the extent says how far, so that a cell is where its number is.
    right, lower = columns / raster.scale - 0.5, rows / raster.scale - 0.5
    shown = "nearest" if raster.scale >= 1 else "antialiased"
    axes.imshow(raster.rgb, extent=(-0.5, right, lower, -0.5), interpolation=shown, zorder=0)
    axes.set(xlim=(-0.5, grid.width - 0.5), ylim=(grid.height - 0.5, -0.5), aspect="equal", anchor="C")
    axes.set_xlabel("x (cells)", fontsize=9, color=style.INK)
    axes.set_ylabel("y (cells)", fontsize=9, color=style.INK)
    axes.tick_params(labelsize=8, colors=style.INK, length=3, width=0.6)
    for side in axes.spines.values():
        side.set(linewidth=0.8, color=style.INK)
    for axis, count in ((axes.xaxis, grid.width), (axes.yaxis, grid.height)):
        if count * frame.cell < 40:
            axis.set_major_locator(FixedLocator([0]))
        elif count <= 20:
            axis.set_major_locator(FixedLocator(range(count)))
        else:
            axis.set_major_locator(MaxNLocator(10, integer=True, steps=[1, 2, 5, 10]))
        if frame.cell >= 6:
            axis.set_minor_locator(FixedLocator([k + 0.5 for k in range(count - 1)]))
    if frame.cell >= 6:
        axes.grid(which="minor", color="white", linewidth=min(0.8, frame.cell / 24), alpha=0.55, zorder=1)
        axes.tick_params(which="minor", length=0)
    if values is not None and frame.cell >= 30:
        _draw_numbers(axes, values, frame)


def _draw_numbers(axes: Axes, values: FloatGrid, frame: FigureLayout) -> None:
    """The landscape in figures, as Table 4.2 prints it."""
    size = min(7.5, frame.cell / 6)
    for y, x in np.argwhere(np.isfinite(values)).tolist():
        # In the corner, where only a diagonal of the path can hide it.
        axes.text(
            x - 0.45, y - 0.43, f"{values[y, x]:.2f}", va="top", fontsize=size, color=style.INK, zorder=2
        )


def draw_ends(axes: Axes, start: Sequence[float], goal: Sequence[float], frame: FigureLayout) -> list[Any]:
    """Start and goal, cells; their legend entries."""
    from matplotlib.lines import Line2D

    size = float(np.clip(frame.cell * 0.42, 8, 18))
    ends: list[tuple[str, Sequence[float], str, str, float]] = [
        ("start", start, "o", style.START, size * 0.8),
        ("goal", goal, "*", style.GOAL, size * 1.35),
    ]
    items = []
    for name, (x, y), marker, colour, points in ends:
        look: dict[str, Any] = {"marker": marker, "markerfacecolor": colour, "linestyle": ""}
        for edge, thick, order in (("white", 2.2, 6), (style.INK, 0.7, 7)):
            how: dict[str, Any] = {"markeredgecolor": edge, "markeredgewidth": thick, "zorder": order}
            axes.plot([x], [y], markersize=points, clip_on=False, **how, **look)
        size = 11 if marker == "*" else 8
        items.append(Line2D([], [], markersize=size, markeredgecolor=style.INK, label=name, **look))
    return items


def draw_via(axes: Axes, via: Sequence[Sequence[float]], frame: FigureLayout) -> Any:
    """Via points with their numbers in the order of visits; their legend entry."""
    from matplotlib.lines import Line2D

    size = float(np.clip(frame.cell * 0.42, 9, 18))
    look: dict[str, Any] = {
        "marker": "s",
        "markerfacecolor": "white",
        "markeredgecolor": style.INK,
        "linestyle": "",
    }
    for k, (x, y) in enumerate(via, 1):
        axes.plot([x], [y], markersize=size, clip_on=False, zorder=7, **look)
        axes.text(x, y, f"{k}", ha="center", va="center", fontsize=size * 0.6, color=style.INK, zorder=8)
    return Line2D([], [], markersize=8, label="via point", **look)


def patches(grid: Grid, values: FloatGrid | None) -> list[Any]:
    """Legend entries for the kinds of ground."""
    from matplotlib.patches import Patch

    def patch(colour: tuple[int, int, int], label: str, **more: Any) -> Any:
        face = (colour[0] / 255, colour[1] / 255, colour[2] / 255)
        return Patch(facecolor=face, edgecolor=style.FAINT, linewidth=0.5, label=label, **more)

    items = []
    unknown = grid.unknown if grid.unknown is not None else np.zeros_like(grid.blocked)
    if (grid.blocked & ~unknown).any():
        items.append(patch(style.WALL, "wall"))
    if (grid.blocked & unknown).any():
        items.append(patch(style.UNKNOWN, "unknown", hatch="////"))
    if values is not None and (~grid.blocked & ~np.isfinite(values)).any():
        items.append(patch(style.CUT_OFF, "no path to the goal"))
    if values is None and grid.terrain is not None:
        shades, (least, most) = style.terrain_colours(), style.terrain_range(grid.terrain)
        label = style.terrain_label(least, most)
        some = dict.fromkeys((least, (least + most) // 2, most))
        items.append(tuple(patch(tuple(shades[c].tolist()), label) for c in some))
    return items


def draw_bars(figure: Figure, frame: FigureLayout, bars: Sequence[tuple[Any, float, str]]) -> None:
    """Colour bars beside the map, from the top down: colours, greatest value, what it is."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    gap = 0.3
    each = (frame.map_height - gap * (len(bars) - 1)) / max(1, len(bars))
    for k, (colours, top, label) in enumerate(bars):
        low = frame.bottom + (len(bars) - 1 - k) * (each + gap)
        axes = figure.add_axes(frame.box(frame.left + frame.map_width + 0.3, low, 0.16, each))
        bar = figure.colorbar(ScalarMappable(Normalize(0, top), colours), cax=axes)
        bar.set_label(label, fontsize=9, color=style.INK)
        bar.ax.tick_params(labelsize=8, colors=style.INK, length=3, width=0.6)
        bar.outline.set_linewidth(0.6)


def draw_words(
    figure: Figure, frame: FigureLayout, title: str, subtitle: str, foot: str, items: list[Any]
) -> None:
    """Title and subtitle above; legend, and a line at the foot, below."""
    from matplotlib.legend_handler import HandlerTuple

    top = frame.height - 0.16
    x = 0.2 / frame.width
    figure.text(x, top / frame.height, title, fontsize=13, fontweight="bold", color=style.INK, va="top")
    room = int((frame.width - 0.4) * 72 / 4.9)
    words = textwrap.shorten(subtitle, 3 * room, placeholder=" ...")
    figure.text(
        x, (top - 0.28) / frame.height, textwrap.fill(words, room), fontsize=9, color=style.FAINT, va="top"
    )  # fmt: skip
    figure.text(x, 0.1 / frame.height, foot, fontsize=8, color=style.FAINT, va="bottom")
    if items:
        labels = [(item[0] if isinstance(item, tuple) else item).get_label() for item in items]
        figure.legend(
            items,
            labels,
            loc="upper left",
            bbox_to_anchor=(x, (frame.bottom - 0.5) / frame.height),
            bbox_transform=figure.transFigure,
            ncols=_columns(labels, frame),
            frameon=False,
            fontsize=8.5,
            borderaxespad=0,
            borderpad=0,
            # The shades of terrain stand side by side; other tuples are marks on top of each other.
            handler_map={i: HandlerTuple(None, 0) for i in items if _is_shades(i)},
            handletextpad=0.6,
            columnspacing=1.4,
            labelcolor=style.INK,
        )


def _columns(labels: Sequence[str], frame: FigureLayout) -> int:
    """Columns of a legend: as many as fit, each as wide as its longest label."""
    for columns in range(len(labels), 1, -1):
        parts = np.array_split([len(label) for label in labels], columns)
        if sum(0.58 + 0.064 * int(part.max()) for part in parts) <= frame.width - 0.4:
            return columns
    return 1


def _rows(labels: Sequence[str], frame: FigureLayout) -> int:
    """Rows of a legend."""
    return -(-len(labels) // _columns(labels, frame)) if labels else 0


def _is_shades(item: Any) -> bool:
    from matplotlib.patches import Patch

    return isinstance(item, tuple) and isinstance(item[0], Patch)
