"""Pictures of a plan: the map, the landscape beneath, the path by speed, and the gates on the path."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.errors import UsageError
from lampyris.model.field import Field, Gate
from lampyris.model.grid import Grid
from lampyris.model.plan import MapModel, Plan
from lampyris.model.profile import Profile
from lampyris.model.scene import Scene
from lampyris.report import style
from lampyris.report.charts.speed_chart import draw_speed
from lampyris.report.pictures import canvas
from lampyris.report.pictures.canvas import FigureLayout
from lampyris.report.pictures.footprints import draw_footprints
from lampyris.report.pictures.map_models import draw_model
from lampyris.report.pictures.regions import draw_rounds
from lampyris.report.pictures.tree import draw_tree
from lampyris.typing import Cells, FloatGrid, Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["draw_plan", "draw_speed"]

LAYERS = ("luciferin", "cost", "none")

_ROOM = 9
"""Points between two jumps at least; nearer rings would hide the path, and none is drawn."""
_MANY_GATES = 250
"""With more gates than this only those on the path are drawn; the rest would be a carpet."""


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
    beneath, or without one the terrain, ochre where it is costly; the path is coloured by the profile's
    speeds.
    Of the planner ``pad`` spheres, tunnel and planned path of the last round are drawn, of planners of models of the
    map the edges, ridges or leaves that they searched, of planners that sample their trees. Start, goal, gates
    (dead ends apart) and AD-GSO's jumps are marked; the legend stands below the
    map. The map is that of the plan, before any edit of a simulation. The same arguments give the same bytes.

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
    suffix = style.suffix_of(out, (".png", ".svg"))
    if layer not in LAYERS:
        raise UsageError.of("LAYER", "layer", repr(layer), allowed=", ".join(LAYERS))
    values = _layer(field, layer)
    bars = _bars(profile, values, layer)
    figure, axes, frame = canvas.blank(grid, bars, values)
    items = _draw_gates(axes, plan, frame)
    if plan.pose_path is not None and scene is not None:
        items = draw_footprints(axes, plan.pose_path, grid, scene.robot) + items
    if plan.rounds:
        items = draw_rounds(axes, plan.rounds, frame) + items
    if plan.map_model is not None:
        items = draw_model(axes, plan.map_model, frame) + items
    if plan.tree is not None and len(plan.tree):
        items = [draw_tree(axes, plan.tree, frame), *items]
    if (plan.map_model is not None or plan.tree is not None) and plan.waypoints is not None:
        items.append(_draw_lines(axes, plan.waypoints, frame))
    items = _draw_path(axes, plan, profile, frame) + items
    if plan.path is not None:
        first, last = plan.path.cells[[0, -1]].tolist()
        items = canvas.draw_ends(axes, first, last, frame) + items
    elif scene is not None:
        items = canvas.draw_ends(axes, scene.start, scene.goal, frame) + items
    if plan.via:
        items.append(canvas.draw_via(axes, plan.via, frame))
    items += canvas.patches(grid, values)
    title = f"{plan.planner} on {grid.name or 'a map'}"
    canvas.draw_words(figure, frame, title, _subtitle(plan), _foot(grid, plan, values), items)
    style.save(figure, out, suffix, canvas.DPI)


def _layer(field: Field | None, layer: str) -> FloatGrid | None:
    if field is None or layer == "none":
        return None
    return field.luciferin if layer == "luciferin" else field.cost


def _draw_path(axes: Axes, plan: Plan, profile: Profile | None, frame: FigureLayout) -> list[Any]:
    """The path over a dark casing, coloured by the mean speed of each step; rings where AD-GSO jumped to."""
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    if plan.path is None or len(plan.path.cells) < 2:
        return []
    xy = plan.path.cells.astype(np.float64)
    width = float(np.clip(frame.cell * 0.22, 2.0, 5.5))
    if plan.pose_path is not None:
        width = min(width, 2.5)
        if profile is not None and profile.xy is not None:
            xy = profile.xy
    for colour, wider in (("white", 3.0), (style.INK, 1.8)):
        look: dict[str, Any] = {"color": colour, "linewidth": width + wider, "zorder": 3}
        axes.plot(xy[:, 0], xy[:, 1], solid_capstyle="round", solid_joinstyle="round", **look)
    items: list[Any] = []
    if profile is None:
        axes.plot(xy[:, 0], xy[:, 1], color=style.PATH, linewidth=width, solid_capstyle="round", zorder=4)
        items.append(Line2D([], [], color=style.PATH, linewidth=3, label="path"))
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


def _draw_gates(axes: Axes, plan: Plan, frame: FigureLayout) -> list[Any]:
    """Gates as diamonds: full on the path, hollow elsewhere; a dead end is crossed out."""
    from matplotlib.lines import Line2D

    on_path = {g.cell for g in plan.gates_on_path}
    gates = plan.gates_in_map if len(plan.gates_in_map) <= _MANY_GATES else plan.gates_on_path
    size = float(np.clip(frame.cell * 0.36, 4.5, 13))
    items = []
    kinds: list[tuple[str, list[Gate], str]] = [
        ("gate on the path", [g for g in gates if g.cell in on_path], style.GATE),
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


def _bars(profile: Profile | None, values: FloatGrid | None, layer: str) -> list[tuple[Any, float, str]]:
    """Colour bars: speed, then the landscape."""
    bars: list[tuple[Any, float, str]] = []
    if profile is not None:
        bars.append((style.speed_map(), _top_speed(profile), f"speed ({profile.units})"))
    if values is not None:
        finite = values[np.isfinite(values)]
        if not finite.size:
            return bars
        top = float(finite.max())
        what = "luciferin (lower is better)" if layer == "luciferin" else "cost to the goal (cells)"
        bars.append((style.landscape_map(), top or 1.0, what))
    return bars


def _foot(grid: Grid, plan: Plan, values: FloatGrid | None) -> str:
    """The map's size, and what of the map or the plan is not seen."""
    size = canvas.size_of(grid)
    if values is not None and grid.terrain is not None:
        size += "; the terrain lies under the landscape (layer none shows it)"
    if len(plan.gates_in_map) > _MANY_GATES:
        size += f"; {len(plan.gates_in_map)} gates in the map, those off the path not drawn"
    return size


def _subtitle(plan: Plan) -> str:
    """What a plan says of itself, in one line."""
    if plan.path is None:
        return plan.sentence
    parts = [f"cost {plan.cost:.6g}"]
    if plan.pose_path is not None:
        poses = plan.pose_path
        parts = [f"{poses.length_m:.4g} m", f"{poses.reversals} reversals", f"bound {poses.bound:.3g}"]
    if plan.optimal_cost is not None and plan.gap is not None:
        parts += [f"optimal {plan.optimal_cost:.6g}", f"gap {plan.gap:.1%}"]
    if plan.any_angle_length is not None and plan.map_model is None:
        parts = [f"lines {plan.any_angle_length:.6g} cells", "cell by cell: " + ", ".join(parts)]
    parts.append(f"{plan.iterations} iteration" + ("s" if plan.iterations != 1 else ""))
    parts.append(f"{plan.expansions} expansions")
    if plan.map_model is not None:
        parts += _model_words(plan, plan.map_model)
    if plan.gates_met:
        parts.append("replanned at " + ", ".join(f"({x}, {y})" for x, y in plan.gates_met))
    return "  ·  ".join(parts)


def _model_words(plan: Plan, model: MapModel) -> list[str]:
    """What a model of the map says of the path."""
    words = [f"{count} {name}" for name, count in model.counts.items() if name != "region"]
    if plan.any_angle_length is not None:
        words.insert(0, f"lines {plan.any_angle_length:.6g} cells")
    if model.bound is not None:
        words.insert(1, f"bound in the plane {model.bound:.6g}")
    if model.clearance is not None:
        words.insert(0, f"least clearance {model.clearance:.3g} cells, the greatest there is")
    return words


def _draw_lines(axes: Axes, waypoints: Cells | Floats, frame: FigureLayout) -> Any:
    """The straight lines of a path at any angle, above its cells; the legend item."""
    from matplotlib.lines import Line2D

    width = float(np.clip(frame.cell * 0.12, 1.2, 2.4))
    look: dict[str, Any] = {"color": style.INK, "marker": "o", "markersize": 2.2 * width, "linewidth": width}
    look |= {"markerfacecolor": "white", "markeredgecolor": style.INK, "markeredgewidth": 0.8 * width}
    axes.plot(waypoints[:, 0], waypoints[:, 1], zorder=5.2, **look)
    return Line2D([], [], label="straight lines", **look)
