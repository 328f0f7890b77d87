"""What planners of models of a map searched: edges and corners, ridges, leaves."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.model.plan import MapModel
from lampyris.report import style
from lampyris.report.pictures.canvas import FigureLayout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_EDGE = style.SPARE[1]
_CORNER = style.SPARE[3]
_RIDGE = style.SPARE[4]
_LEAF = style.SPARE[1]


def draw_model(axes: Axes, model: MapModel, frame: FigureLayout) -> list[Any]:
    """Draw a model of the map beneath the path; legend items."""
    items: list[Any] = []
    if len(model.lines):
        items.append(_edges(axes, model, frame))
    if model.kind == "visibility-graph" and len(model.points):
        items.append(_marks(axes, model, "o", min(5.0, 0.3 * frame.cell + 1.2), _CORNER, "corner, expanded"))
    if model.kind == "polyanya" and len(model.points):
        items.append(
            _marks(axes, model, "o", min(5.0, 0.3 * frame.cell + 1.2), _CORNER, "corner of the path")
        )
    if model.kind == "voronoi" and len(model.points):
        items.append(_marks(axes, model, "s", max(1.2, 0.62 * frame.cell), _RIDGE, "ridge of clearance"))
    if len(model.boxes):
        items.append(_leaves(axes, model, frame))
    return items


def _edges(axes: Axes, model: MapModel, frame: FigureLayout) -> Any:
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    few = len(model.lines) < 1500
    width, opacity = (0.8, 0.55) if few else (0.4, 0.25)
    lines = LineCollection(
        list(model.lines.reshape(-1, 2, 2)), colors=[_EDGE], linewidths=width, alpha=opacity, zorder=2.1
    )
    axes.add_collection(lines, autolim=False)
    return Line2D([], [], color=_EDGE, linewidth=1.2, label="edge of the visibility graph")


def _marks(axes: Axes, model: MapModel, marker: str, size: float, colour: str, label: str) -> Any:
    from matplotlib.lines import Line2D

    look: dict[str, Any] = {"marker": marker, "color": colour, "markeredgewidth": 0, "linestyle": ""}
    axes.plot(model.points[:, 0], model.points[:, 1], markersize=size, zorder=2.3, **look)
    return Line2D([], [], markersize=6, label=label, **look)


def _leaves(axes: Axes, model: MapModel, frame: FigureLayout) -> Any:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Patch

    x, y, side = (model.boxes[model.boxes[:, 3] == 1, k].astype(np.float64) for k in range(3))
    left, top = x - 0.5, y - 0.5
    right, low = left + side, top + side
    rings = np.stack([left, top, right, top, right, low, left, low, left, top], axis=1).reshape(-1, 5, 2)
    width = float(np.clip(frame.cell * 0.08, 0.25, 1.2))
    axes.add_collection(
        LineCollection(list(rings), colors=[_LEAF], linewidths=width, zorder=2.1), autolim=False
    )
    return Patch(facecolor="none", edgecolor=_LEAF, linewidth=1.2, label="free leaf of the quadtree")
