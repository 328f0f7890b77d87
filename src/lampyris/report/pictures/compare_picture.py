"""Several paths across one map, each in its own colour and dash, and beneath them how fast each was driven."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from lampyris.model.grid import Grid
from lampyris.report import style
from lampyris.report.pictures import canvas
from lampyris.report.pictures.canvas import FigureLayout
from lampyris.typing import Cell, Floats, Points

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Dash: TypeAlias = str | tuple[float, tuple[float, ...]]

LOOKS: tuple[tuple[str, Dash], ...] = (
    ("#0072b2", "solid"),
    ("#d55e00", (0, (4, 1.2))),
    ("#009e73", (0, (1.4, 1.0))),
    ("#cc79a7", (0, (6, 1.2, 1.4, 1.2))),
    ("#20242c", (0, (2.6, 1.0))),
    ("#e69f00", (0, (5, 1.0, 1.2, 1.0, 1.2, 1.0))),
    ("#56b4e9", (0, (3.2, 2.0))),
    ("#882255", (0, (1.0, 1.6))),
)
"""Colour and dash of each path in turn: Okabe and Ito's colours, distinct by the dash alone as well."""

OBSTACLE = "obstacle, from where it began"

_CHART = 2.1
"""Height of the chart of speeds, inches."""
_OUTLINED = 4
"""Paths along which the robot is drawn; of more, at their ends alone."""
_BESIDE = 2.3
"""Points from one path to the next where they run together."""


@dataclass(frozen=True, slots=True, eq=False)
class DrawnPath:
    """One path on the picture.

    Parameters
    ----------
    name : who found it.
    subtitle : its text in the legend, in a few words.
    xy : float64 (n, 2), cells; empty: no path was found.
    outlines : the robot at places along the path, each float64 (k, 2), cells; none: a robot without a heading.
    """

    name: str
    subtitle: str
    xy: Points
    outlines: tuple[Points, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Speeds:
    """Speed over distance.

    Parameters
    ----------
    name : what the line is of.
    subtitle : its text, in a few words.
    s, v : distance and speed, (n,).
    units : of the speed.
    path : number of the path whose colour it has; None: it is of a law, and has the law's colour.
    """

    name: str
    subtitle: str
    s: Floats
    v: Floats
    units: str
    path: int | None = None


def look_of(k: int) -> tuple[str, Dash]:
    """Colour and dash of path number ``k``; after the last colour they begin again with another dash."""
    colour, dash = LOOKS[k % len(LOOKS)]
    return (colour, dash) if k < len(LOOKS) else (colour, LOOKS[(k + k // len(LOOKS)) % len(LOOKS)][1])


def draw_paths(
    grid: Grid,
    start: Cell,
    goal: Cell,
    paths: Sequence[DrawnPath],
    out: style.OutFile,
    *,
    title: str,
    subtitle: str,
    speeds: Sequence[Speeds] = (),
    speeds_title: str = "",
    tracks: Sequence[Points] = (),
) -> None:
    """Draw paths on their map, as PNG or SVG by the file's suffix; the same arguments give the same bytes.

    Where paths run together they are drawn side by side, the first on the left as one drives.

    Parameters
    ----------
    paths : at least one.
    title, subtitle : above the map.
    speeds : lines of the chart beneath; those whose units are not the first one's are left out, and named.
    speeds_title : above the chart.
    tracks : of moving obstacles, cells; drawn faintly, a ring where each begins.

    Raises
    ------
    UsageError : another suffix.
    FileError : the system refuses to write.
    """
    suffix = style.suffix_of(out, (".png", ".svg"))
    labels = [*(_label(path) for path in paths), "start", "goal", *([OBSTACLE] if tracks else [])]
    figure, axes, frame = canvas.blank(
        grid, [], None, [*labels, *_ground_labels(grid)], _CHART + 0.6 if speeds else 0.0
    )
    items = _draw_tracks(axes, tracks, frame)
    drawn = _draw_all(axes, paths, frame)
    ends = canvas.draw_ends(axes, start, goal, frame)
    foot = canvas.size_of(grid) + _draw_speeds(figure, frame, speeds, speeds_title)
    canvas.draw_words(
        figure, frame, title, subtitle, foot, [*drawn, *ends, *items, *canvas.patches(grid, None)]
    )
    style.save(figure, out, suffix, canvas.DPI)


def _label(path: DrawnPath) -> str:
    return f"{path.name}: {path.subtitle}"


def _ground_labels(grid: Grid) -> list[str]:
    """Of the legend's entries for the kinds of ground."""
    items = canvas.patches(grid, None)
    return [str((item[0] if isinstance(item, tuple) else item).get_label()) for item in items]


def _draw_all(axes: Axes, paths: Sequence[DrawnPath], frame: FigureLayout) -> list[Any]:
    """All paths, each beside the others; their legend entries."""
    from matplotlib.collections import PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.patheffects import Normal, Stroke

    found = [k for k, path in enumerate(paths) if len(path.xy) > 1]
    # Side by side they are at most a cell wide, where that leaves anything to be seen.
    step = min(_BESIDE, max(frame.cell / max(1, len(found)), 1.1))
    width = float(np.clip(0.82 * step, 1.1, 2.4))
    items: list[Any] = []
    for k, path in enumerate(paths):
        colour, dash = look_of(k)
        look: dict[str, Any] = {"color": colour, "linestyle": dash}
        if k not in found:
            items.append(Line2D([], [], marker="x", linestyle="", color=colour, label=_label(path)))
            continue
        aside = (found.index(k) - (len(found) - 1) / 2) * step
        # A robot drawn to scale is where its path is.
        xy = path.xy if path.outlines else beside(path.xy, aside / frame.cell)
        line = axes.plot(
            xy[:, 0], xy[:, 1], linewidth=width, zorder=4 + 0.01 * k, dash_capstyle="butt",
            solid_joinstyle="round", dash_joinstyle="round", **look,
        )[0]  # fmt: skip
        if path.outlines:
            shown = path.outlines if len(found) <= _OUTLINED else path.outlines[-1:]
            fill = style.with_alpha(colour, 0.06)
            axes.add_collection(
                PolyCollection(list(shown), facecolor=fill, edgecolor=colour, linewidths=0.6, zorder=3),
                autolim=False,
            )
        line.set_path_effects([Stroke(linewidth=width + 0.9, foreground="white", alpha=0.9), Normal()])
        items.append(Line2D([], [], linewidth=2.2, label=_label(path), **look))
    return items


def beside(xy: Points, aside: float) -> Points:
    """A polyline moved to its right by ``aside`` cells, as one drives it; its corners stay corners.

    At a sharp turn the corner is no farther away than one and a half times that.
    """
    if len(xy) < 2 or aside == 0.0:
        return xy
    step = np.diff(xy, axis=0)
    keep = np.concatenate(([True], (step != 0).any(axis=1)))
    xy = xy[keep]
    if len(xy) < 2:
        return xy
    step = np.diff(xy, axis=0)
    length = np.sqrt((step * step).sum(axis=1, keepdims=True))
    # Columns grow to the right and rows downwards: to the right of (dx, dy) is (-dy, dx).
    right = np.column_stack((-step[:, 1], step[:, 0])) / length
    before, after = np.vstack((right[:1], right)), np.vstack((right, right[-1:]))
    both = before + after
    size = np.sqrt((both * both).sum(axis=1, keepdims=True))
    # Where the path turns back on itself there is no side that both lines share: the first one's is taken.
    middle = np.where(size > 1e-9, both / np.where(size > 1e-9, size, 1.0), before)
    cosine = (middle * before).sum(axis=1, keepdims=True)
    out: Points = xy + aside * middle / np.maximum(cosine, 2 / 3)
    return out


def _draw_tracks(axes: Axes, tracks: Sequence[Points], frame: FigureLayout) -> list[Any]:
    """Where obstacles went."""
    from matplotlib.lines import Line2D

    if not tracks:
        return []
    look: dict[str, Any] = {"color": style.FAINT, "linewidth": 0.7}
    ring: dict[str, Any] = {"marker": "o", "markerfacecolor": "white", "markeredgecolor": style.FAINT}
    size = float(np.clip(frame.cell * 0.35, 2.5, 6))
    for xy in tracks:
        axes.plot(xy[:, 0], xy[:, 1], alpha=0.45, zorder=2, **look)
        axes.plot(xy[:1, 0], xy[:1, 1], markersize=size, markeredgewidth=0.8, zorder=3, linestyle="", **ring)
    return [Line2D([], [], markersize=5, markeredgewidth=0.8, label=OBSTACLE, **ring, **look)]


def _draw_speeds(figure: Figure, frame: FigureLayout, speeds: Sequence[Speeds], title: str) -> str:
    """The chart beneath; which of the lines it leaves out, for the line at the foot."""
    if not speeds:
        return ""
    units = speeds[0].units
    shown = [one for one in speeds if one.units == units]
    others = [one.name for one in speeds if one.units != units]
    room = 2.3
    width = frame.width - frame.left - room - 0.1
    axes = figure.add_axes(frame.box(frame.left, 0.78, width, _CHART - 0.45))
    handles = []
    for k, one in enumerate(shown):
        # A law with other settings than its own looks like no law's own line, and like no other's.
        own = one.path is None and one.name in style.LAWS
        colour, dash = style.law_look(one.name) if own else look_of(k if one.path is None else one.path)
        label = f"{one.name}: {one.subtitle}" if one.subtitle else one.name
        handles += axes.plot(one.s, one.v, color=colour, linestyle=dash, linewidth=1.5, label=label)
    axes.set_xlabel("distance along the path (m)" if units == "m/s" else "distance along the path (cells)")
    axes.set_ylabel(f"speed ({units})")
    for label_ in (axes.xaxis.label, axes.yaxis.label):
        label_.set(fontsize=9, color=style.INK)
    axes.set_xlim(0, max(float(one.s[-1]) for one in shown) or 1.0)
    axes.set_ylim(0, 1.08 * (max(float(one.v.max()) for one in shown) or 1.0))
    axes.tick_params(labelsize=8, colors=style.INK, length=3, width=0.6)
    axes.grid(axis="y", color="#e3e5e9", linewidth=0.7, zorder=0)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    top = (0.78 + _CHART - 0.45 + 0.1) / frame.height
    figure.text(0.2 / frame.width, top, title, fontsize=9.5, fontweight="bold", color=style.INK, va="bottom")
    figure.legend(
        handles=handles, loc="upper left", frameon=False, fontsize=8.5, borderaxespad=0, labelcolor=style.INK,
        bbox_to_anchor=((frame.left + width + 0.12) / frame.width, (0.78 + _CHART - 0.45) / frame.height),
        handlelength=2.4,
    )  # fmt: skip
    return f"; in other units, not drawn: {', '.join(others)}" if others else ""
