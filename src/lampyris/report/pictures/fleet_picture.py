"""A plan of a fleet on its map: every robot's path, a disc at its start, a square at its goal."""

from __future__ import annotations

from typing import Any

import numpy as np

from lampyris.errors import plural
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.report import style
from lampyris.report.pictures import canvas


def draw_fleet(plan: FleetPlan, fleet: Fleet, out: style.OutFile) -> None:
    """Draw a plan as PNG or SVG by the file's suffix; the same plan gives the same bytes.

    Parameters
    ----------
    plan : without paths the starts and goals alone are drawn.
    fleet : whose plan it is.

    Raises
    ------
    UsageError : another suffix.
    FileError : the system refuses to write.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    suffix = style.suffix_of(out, (".png", ".svg"))
    grid = fleet.grid
    figure, axes, frame = canvas.blank(grid, [], labels=["path", "robot at its start", "its goal", "wall"])
    colours = [
        tuple(part / 255 for part in style.FLEET[k % len(style.FLEET)]) for k in range(len(fleet.robots))
    ]
    size = float(np.clip(frame.cell * 0.75, 2.0, 14.0))
    if plan.paths:
        lines: Any = [path.astype(np.float64) for path in plan.paths]
        width = float(np.clip(frame.cell * 0.16, 0.4, 2.0))
        axes.add_collection(
            LineCollection(lines, colors=colours, linewidths=width, alpha=0.55, zorder=3), autolim=False
        )
    ends: list[tuple[str, Any, float, str, int]] = [
        ("its goal", fleet.goals, size * 0.7, "s", 4),
        ("robot at its start", fleet.starts, size, "o", 5),
    ]
    items: list[Any] = []
    for label, cells, points, marker, order in ends:
        xy = np.array(cells, dtype=np.float64)
        axes.scatter(
            xy[:, 0], xy[:, 1], s=points * points, c=colours, marker=marker, edgecolors=style.INK,
            linewidths=min(0.6, size / 10), zorder=order,
        )  # fmt: skip
        face = style.with_alpha(style.INK, 0.25)
        look: dict[str, Any] = {"marker": marker, "markerfacecolor": face, "markeredgecolor": style.INK}
        items.insert(0, Line2D([], [], linestyle="", markersize=7, label=label, **look))
    if plan.paths:
        items.append(Line2D([], [], color=style.FAINT, linewidth=1.5, label="path"))
    items += canvas.patches(grid, None)
    title = f"{plural(len(fleet.robots), 'robot')} on {grid.name or 'a map'}, {plan.planner}"
    words = plan.sentence
    if plan:
        words = f"makespan {plan.makespan}, sum of costs {plan.sum_of_costs}, lower bound {plan.lower_bound}"
    canvas.draw_words(figure, frame, title, words, canvas.size_of(grid), items)
    style.save(figure, out, suffix, canvas.DPI)
