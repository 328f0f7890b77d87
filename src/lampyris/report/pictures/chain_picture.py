"""A chain on its map: where its links are along a plan, and the path of its tip."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.errors import file_name, of_kind
from lampyris.model.chain.chain_plan import ChainPlan
from lampyris.report import style
from lampyris.report.pictures import canvas
from lampyris.typing import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SHOWN = 14
"""Configurations drawn between start and goal."""
_FINE = 400
"""Points of the tip's path."""


def draw_chain(plan: ChainPlan, out: style.OutFile) -> None:
    """Draw a plan of a chain as PNG or SVG by the file's suffix; the same plan gives the same bytes.

    The chain at the start and at the goal, faint outlines in between, and the path of its tip. Without a
    plan, only the start and the goal.

    Parameters
    ----------
    plan : to be drawn.
    out : the file; an existing one is replaced.

    Raises
    ------
    SettingError : ``TYPE``: ``out`` is no name of a file.
    UsageError : another suffix.
    FileError : the system refuses to write.

    Examples
    --------
    >>> import lampyris
    >>> import numpy as np
    >>> arm = lampyris.Chain((5.0, 5.0), links=[1.0, 1.0], widths=0.2)
    >>> plan = lampyris.plan_chain(lampyris.Grid(np.zeros((10, 10), dtype=bool)), arm, [0.0, 0.0], [1.5, 0.5])
    >>> lampyris.draw_chain(plan, "arm.svg")
    """
    of_kind("plan", plan, ChainPlan)
    out = file_name("out", out)
    suffix = style.suffix_of(out, (".png", ".svg"))
    grid, chain = plan.grid, plan.chain
    labels = ["start", "goal", "on the way", "path of the tip", "base", "wall"]
    figure, axes, frame = canvas.blank(grid, [], labels=labels)
    items: list[Any] = []
    if plan.configurations is not None and len(plan.configurations) > 1:
        items += _motion(axes, plan, frame.cell)
    for q, colour, name in ((plan.start, style.START, "start"), (plan.goal, style.GOAL, "goal")):
        items.insert(len(items) if name == "goal" else 0, _links(axes, plan, q, name, colour, 0.85))
    base = grid.to_points(*chain.base)
    items.append(_mark(axes, base))
    items += canvas.patches(grid, None)
    words = plan.status.sentence
    if plan.configurations is not None:
        words = (
            f"{len(plan.configurations)} configurations  ·  {len(plan.released)} of {chain.joints} joints released  ·  "
            f"{plan.samples} samples  ·  {plan.nodes} nodes  ·  {plan.checks} checks"
        )
    title = f"{plan.planner}, {chain.joints} links on {grid.name or 'a map'}"
    canvas.draw_words(figure, frame, title, words, canvas.size_of(grid), items)
    style.save(figure, out, suffix, canvas.DPI)


def _corners(plan: ChainPlan, q: Floats) -> list[Floats]:
    """The outline of each link, in cells (y down), float64 (4, 2)."""
    points = plan.chain.joint_points(q)
    made = []
    for k, width in enumerate(plan.chain.widths):
        along = points[k + 1] - points[k]
        aside = np.array([-along[1], along[0]]) * (width / 2.0 / math.sqrt(float(along @ along)))
        ring = np.array([points[k] - aside, points[k + 1] - aside, points[k + 1] + aside, points[k] + aside])
        made.append(plan.grid.to_points(ring[:, 0], ring[:, 1]))
    return made


def _links(axes: Axes, plan: ChainPlan, q: Floats, name: str, colour: str, opacity: float) -> Any:
    from matplotlib.collections import PolyCollection
    from matplotlib.patches import Patch

    look: dict[str, Any] = {"facecolor": colour, "edgecolor": style.INK, "alpha": opacity, "linewidth": 0.8}
    axes.add_collection(PolyCollection(_corners(plan, q), zorder=4.0, **look), autolim=False)
    return Patch(label=name, **look)


def _motion(axes: Axes, plan: ChainPlan, cell: float) -> list[Any]:
    """Faint outlines at even distances along the motion, and the path of the tip."""
    from matplotlib.collections import PolyCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    rows = plan.configurations
    assert rows is not None
    steps = np.concatenate(([0.0], np.cumsum(np.abs(np.diff(rows, axis=0)).sum(axis=1))))

    def at(share: float) -> Floats:
        return np.array([np.interp(share * steps[-1], steps, rows[:, k]) for k in range(rows.shape[1])])

    look: dict[str, Any] = {"facecolor": "none", "edgecolor": style.FAINT, "linewidth": 0.6, "alpha": 0.7}
    rings = [
        ring for k in range(1, _SHOWN + 1) for ring in _corners(plan, _clipped(plan, at(k / (_SHOWN + 1))))
    ]
    axes.add_collection(PolyCollection(rings, zorder=3.0, **look), autolim=False)
    tips = np.array([plan.chain.joint_points(_clipped(plan, at(k / _FINE)))[-1] for k in range(_FINE + 1)])
    xy = plan.grid.to_points(tips[:, 0], tips[:, 1])
    line: dict[str, Any] = {"color": style.SPARE[3], "linewidth": max(1.2, 0.06 * cell)}
    axes.plot(xy[:, 0], xy[:, 1], zorder=4.6, **line)
    return [Patch(label="on the way", **look), Line2D([], [], label="path of the tip", **line)]


def _clipped(plan: ChainPlan, q: Floats) -> Floats:
    """Within the limits, which interpolation may miss by a rounding."""
    low, high = np.array(plan.chain.joint_limits).T
    return np.clip(q, low, high)


def _mark(axes: Axes, base: Floats) -> Any:
    from matplotlib.lines import Line2D

    look: dict[str, Any] = {
        "marker": "o",
        "markerfacecolor": "white",
        "markeredgecolor": style.INK,
        "linestyle": "",
    }
    axes.plot([base[0]], [base[1]], markersize=8, markeredgewidth=1.6, zorder=6, **look)
    return Line2D([], [], markersize=8, markeredgewidth=1.6, label="base", **look)
