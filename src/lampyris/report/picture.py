"""Pictures of a plan: the map, the landscape beneath, the path by speed, and what matters on the way."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.field import Field, Gate
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.report import style
from lampyris.report.raster import draw_map
from lampyris.report.speed_chart import draw_speed
from lampyris.typing import Cell, FloatGrid

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_plan", "draw_speed"]

LAYERS = ("luciferin", "cost", "none")
DPI = 150

_LONG = 6.6
"""Longer side of the map, inches."""
_LEAST = 2.6
"""Shorter side of the map at least, inches."""
_PIXELS = 1200
"""Pixels of the map's longer side: a little more than are shown, so that cells stay square."""
_ROOM = 9
"""Points between two jumps at least; nearer rings would hide the path, and none is drawn."""
_MANY_GATES = 250
"""With more gates than this only those on the way are drawn; the rest would be a carpet."""


@dataclass(frozen=True, slots=True)
class _Frame:
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


def draw_plan(
    grid: Grid,
    plan: Plan,
    *,
    field: Field | None = None,
    profile: Profile | None = None,
    scene: Scene | None = None,
    layer: str = "luciferin",
    out: style.OutFile,
) -> None:
    """Draw a plan on its map, as PNG or SVG by the file's suffix.

    Walls are dark, unknown cells hatched; the landscape (``luciferin`` or ``cost`` of the field) lies
    beneath, or without one the terrain, ochre where it is dear; the path is coloured by the profile's
    speeds. Start, goal, gates (dead ends apart) and AD-GSO's jumps are marked; the legend stands below the
    map. The same arguments give the same bytes.

    Parameters
    ----------
    plan : may have failed: then the map, the ends and the reason are drawn.
    field : the landscape; None: none is drawn.
    profile : speeds; None: the path has one colour.
    scene : the ends, for a plan without a path.
    layer : ``luciferin``, ``cost`` or ``none``.
    out : name of the file, ``.png`` or ``.svg``.

    Raises
    ------
    UsageError : another suffix, or no such layer.
    FileError : the system refuses to write.
    """
    from matplotlib.figure import Figure

    suffix = style.suffix_of(out, (".png", ".svg"))
    if layer not in LAYERS:
        raise UsageError("LAYER", f"layer {layer!r}", allowed=", ".join(LAYERS))
    values = _layer(field, layer)
    frame = _frame(grid, bars=(profile is not None) + (values is not None))
    figure = Figure(figsize=(frame.width, frame.height), dpi=DPI, facecolor="white")
    axes = figure.add_axes(frame.box(frame.left, frame.bottom, frame.map_width, frame.map_height))
    _draw_ground(axes, grid, values, frame)
    items = _draw_gates(axes, plan, frame)
    items = _draw_path(axes, plan, profile, frame) + items
    items = _draw_ends(axes, plan, scene, frame) + items
    items += _patches(grid, values)
    _draw_bars(figure, frame, profile, values, layer)
    hidden = values is not None and grid.terrain is not None
    _draw_words(figure, frame, grid, plan, items, hidden)
    style.save(figure, out, suffix, DPI)


def _layer(field: Field | None, layer: str) -> FloatGrid | None:
    if field is None or layer == "none":
        return None
    return field.luciferin if layer == "luciferin" else field.cost


def _frame(grid: Grid, bars: int) -> _Frame:
    long = max(grid.width, grid.height)
    w = max(_LEAST, _LONG * grid.width / long)
    h = max(_LEAST, _LONG * grid.height / long)
    cell = 72 * min(w / grid.width, h / grid.height)
    width = 0.75 + w + (1.35 if bars else 0.35)
    return _Frame(max(width, 5.2), 0.8 + h + 1.25, 0.75, 1.25, w, h, cell)


def _draw_ground(axes: Axes, grid: Grid, values: FloatGrid | None, frame: _Frame) -> None:
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


def _draw_numbers(axes: Axes, values: FloatGrid, frame: _Frame) -> None:
    """The landscape in figures, as Table 4.2 prints it."""
    size = min(7.5, frame.cell / 6)
    for y, x in np.argwhere(np.isfinite(values)).tolist():
        # In the corner, where only a diagonal of the path can hide it.
        axes.text(
            x - 0.45, y - 0.43, f"{values[y, x]:.2f}", va="top", fontsize=size, color=style.INK, zorder=2
        )


def _draw_path(axes: Axes, plan: Plan, profile: Profile | None, frame: _Frame) -> list[Any]:
    """The path over a dark casing, coloured by the mean speed of each step; rings where AD-GSO jumped to."""
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    if plan.path is None or len(plan.path.cells) < 2:
        return []
    xy = plan.path.cells.astype(np.float64)
    width = float(np.clip(frame.cell * 0.22, 2.0, 5.5))
    for colour, wider in (("white", 3.0), (style.INK, 1.8)):
        look: dict[str, Any] = {"color": colour, "linewidth": width + wider, "zorder": 3}
        axes.plot(xy[:, 0], xy[:, 1], solid_capstyle="round", solid_joinstyle="round", **look)
    items: list[Any] = []
    if profile is None:
        axes.plot(xy[:, 0], xy[:, 1], color=style.START, linewidth=width, solid_capstyle="round", zorder=4)
        items.append(Line2D([], [], color=style.START, linewidth=3, label="path"))
    else:
        lines = LineCollection(
            list(np.stack((xy[:-1], xy[1:]), axis=1)),
            cmap=style.speed_map(),
            linewidths=width,
            capstyle="round",
            zorder=4,
        )
        lines.set_array((profile.v[:-1] + profile.v[1:]) / 2)
        lines.set_clim(0, _top_speed(profile))
        axes.add_collection(lines, autolim=False)
        items.append(Line2D([], [], color=style.speed_map()(0.6), linewidth=3, label="path, by speed"))
    if plan.jumps and frame.cell * plan.path.arc[-1] / len(plan.jumps) >= _ROOM:
        ends = np.array([j.chosen for j in plan.jumps])
        size = float(np.clip(frame.cell * 0.2, 3.2, 8))
        ring: dict[str, Any] = {"marker": "o", "markerfacecolor": "white", "markeredgecolor": style.INK}
        ring |= {"linestyle": ""}
        axes.plot(
            ends[:, 0], ends[:, 1], markersize=size, markeredgewidth=max(0.8, size / 5.5), zorder=5, **ring
        )
        items.append(Line2D([], [], markersize=6, markeredgewidth=1.2, label="jump of the walk", **ring))
    return items


def _top_speed(profile: Profile) -> float:
    return float(profile.v.max()) or 1.0


def _draw_ends(axes: Axes, plan: Plan, scene: Scene | None, frame: _Frame) -> list[Any]:
    from matplotlib.lines import Line2D

    ends: list[tuple[str, Cell, str, str, float]] = []
    size = float(np.clip(frame.cell * 0.42, 8, 18))
    if plan.path is not None:
        first, last = plan.path.cells[0].tolist(), plan.path.cells[-1].tolist()
    elif scene is not None:
        first, last = list(scene.start), list(scene.goal)
    else:
        return []
    ends = [
        ("start", (first[0], first[1]), "o", style.START, size * 0.8),
        ("goal", (last[0], last[1]), "*", style.GOAL, size * 1.35),
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


def _draw_gates(axes: Axes, plan: Plan, frame: _Frame) -> list[Any]:
    """Gates as diamonds: full on the way, hollow elsewhere; a dead end is crossed out."""
    from matplotlib.lines import Line2D

    on_path = {g.cell for g in plan.gates_on_path}
    gates = plan.gates_in_map if len(plan.gates_in_map) <= _MANY_GATES else plan.gates_on_path
    size = float(np.clip(frame.cell * 0.36, 4.5, 13))
    items = []
    kinds: list[tuple[str, list[Gate], str]] = [
        ("gate on the way", [g for g in gates if g.cell in on_path], style.GATE),
        ("gate", [g for g in gates if g.cell not in on_path and not g.dead_end], "none"),
        ("gate, dead end", [g for g in gates if g.cell not in on_path and g.dead_end], "none"),
    ]
    for name, some, face in kinds:
        if not some:
            continue
        xy = np.array([g.cell for g in some])
        look: dict[str, Any] = {"marker": "D", "markerfacecolor": face, "markeredgecolor": style.GATE}
        look |= {"linestyle": ""}
        axes.plot(xy[:, 0], xy[:, 1], markersize=size, markeredgewidth=max(1.0, size / 7), zorder=4.5, **look)
        shown: Any = Line2D([], [], markersize=7, markeredgewidth=1.4, label=name, **look)
        if name.endswith("dead end"):
            cross: dict[str, Any] = {"marker": "x", "color": style.GATE, "linestyle": ""}
            thick = max(1.0, size / 7)
            axes.plot(xy[:, 0], xy[:, 1], markersize=size * 0.62, markeredgewidth=thick, zorder=4.5, **cross)
            shown = (shown, Line2D([], [], markersize=4.2, markeredgewidth=1.4, **cross))
        items.append(shown)
    return items


def _patches(grid: Grid, values: FloatGrid | None) -> list[Any]:
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
        items.append(patch(style.CUT_OFF, "no way to the goal"))
    if values is None and grid.terrain is not None:
        shades, (least, most) = style.terrain_colours(), style.terrain_range(grid.terrain)
        label = style.terrain_label(least, most)
        some = dict.fromkeys((least, (least + most) // 2, most))
        items.append(tuple(patch(tuple(shades[c].tolist()), label) for c in some))
    return items


def _draw_bars(
    figure: Figure, frame: _Frame, profile: Profile | None, values: FloatGrid | None, layer: str
) -> None:
    """Colour bars beside the map: speed above, landscape below."""
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    bars: list[tuple[Any, float, str]] = []
    if profile is not None:
        bars.append((style.speed_map(), _top_speed(profile), f"speed ({profile.units})"))
    if values is not None:
        finite = values[np.isfinite(values)]
        top = float(finite.max()) if finite.size else 0.0
        what = "luciferin (lower is better)" if layer == "luciferin" else "cost to the goal (cells)"
        bars.append((style.landscape_map(), top or 1.0, what))
    gap = 0.3
    each = (frame.map_height - gap * (len(bars) - 1)) / max(1, len(bars))
    for k, (colours, top, label) in enumerate(bars):
        low = frame.bottom + (len(bars) - 1 - k) * (each + gap)
        axes = figure.add_axes(frame.box(frame.left + frame.map_width + 0.3, low, 0.16, each))
        bar = figure.colorbar(ScalarMappable(Normalize(0, top), colours), cax=axes)
        bar.set_label(label, fontsize=9, color=style.INK)
        bar.ax.tick_params(labelsize=8, colors=style.INK, length=3, width=0.6)
        bar.outline.set_linewidth(0.6)


def _draw_words(
    figure: Figure, frame: _Frame, grid: Grid, plan: Plan, items: list[Any], hidden: bool
) -> None:
    """Title above, legend and the map's size below; ``hidden``: the map has terrain that is not seen."""
    from matplotlib.legend_handler import HandlerTuple

    name = grid.name or "a map"
    top = frame.height - 0.16
    x = 0.2 / frame.width
    title = f"{plan.planner} on {name}"
    figure.text(x, top / frame.height, title, fontsize=13, fontweight="bold", color=style.INK, va="top")
    room = int((frame.width - 0.4) * 72 / 4.9)
    words = textwrap.shorten(_told(plan), 3 * room, placeholder=" ...")
    figure.text(
        x, (top - 0.28) / frame.height, textwrap.fill(words, room), fontsize=9, color=style.FAINT, va="top"
    )  # fmt: skip
    size = f"{grid.width} x {grid.height} cells of {grid.resolution:g} m"
    if hidden:
        size += "; the terrain lies under the landscape (layer none shows it)"
    if len(plan.gates_in_map) > _MANY_GATES:
        size += f"; {len(plan.gates_in_map)} gates in the map, those off the way not drawn"
    figure.text(x, 0.1 / frame.height, size, fontsize=8, color=style.FAINT, va="bottom")
    if items:
        labels = [(item[0] if isinstance(item, tuple) else item).get_label() for item in items]
        wide = sum(0.58 + 0.064 * len(label) for label in labels)
        rows = max(1, -(-int(100 * wide) // int(100 * (frame.width - 0.4))))
        figure.legend(
            items,
            labels,
            loc="upper left",
            bbox_to_anchor=(x, (frame.bottom - 0.5) / frame.height),
            bbox_transform=figure.transFigure,
            ncols=-(-len(items) // rows),
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


def _is_shades(item: Any) -> bool:
    from matplotlib.patches import Patch

    return isinstance(item, tuple) and isinstance(item[0], Patch)


def _told(plan: Plan) -> str:
    """What a plan says of itself, in one line."""
    if plan.path is None:
        return plan.sentence
    parts = [f"cost {plan.cost:.6g}"]
    if plan.optimal_cost is not None and plan.gap is not None:
        parts += [f"optimal {plan.optimal_cost:.6g}", f"gap {plan.gap:.1%}"]
    parts.append(f"{plan.iterations} iteration" + ("s" if plan.iterations != 1 else ""))
    parts.append(f"{plan.expansions} expansions")
    if plan.gates_met:
        parts.append("replanned at " + ", ".join(f"({x}, {y})" for x, y in plan.gates_met))
    return "  ·  ".join(parts)
