"""Spheres, tunnel and planned path of a round of planning with adaptive dimensionality."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.model.plan import PlanningRound
from lampyris.report import style
from lampyris.report.pictures.canvas import FigureLayout

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SPHERE = style.SPARE[4]
_TUNNEL = style.SPARE[1]
_PLANNED = style.SPARE[3]


def draw_rounds(axes: Axes, rounds: Sequence[PlanningRound], frame: FigureLayout) -> list[Any]:
    """Draw where the last round searched with headings, beneath the path; legend items.

    A last round that only proves the bound plans no path: tunnel and planned path are then those of the round before.
    """
    from matplotlib.collections import EllipseCollection, LineCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    items: list[Any] = []
    spheres = rounds[-1].spheres
    one = next((one for one in reversed(rounds) if one.planned), rounds[-1])
    if spheres:
        across = [2 * radius + 1 for _, radius in spheres]
        look: dict[str, Any] = {"facecolor": _faint(_SPHERE, 0.20), "edgecolor": _SPHERE}
        discs = EllipseCollection(
            across, across, np.zeros(len(across)), units="xy", offsets=[cell for cell, _ in spheres],
            offset_transform=axes.transData, linewidths=1.2, zorder=2.1, **look,
        )  # fmt: skip
        axes.add_collection(discs, autolim=False)
        items.append(Patch(label="sphere: searched with headings", linewidth=1.2, **look))
    if one.planned:
        line = [list(one.planned)] if len(one.planned) > 1 else [[one.planned[0], one.planned[0]]]
        wide: dict[str, Any] = {"capstyle": "round", "joinstyle": "round"}
        width = (2 * one.tunnel + 1) * frame.cell
        axes.add_collection(
            LineCollection(line, colors=[_faint(_TUNNEL, 0.30)], linewidths=width, zorder=2.0, **wide),
            autolim=False,
        )
        items.append(Patch(label="tunnel", facecolor=_faint(_TUNNEL, 0.30)))
        axes.plot(*np.array(line[0]).T, color=_PLANNED, linewidth=1.3, linestyle=(0, (4, 2)), zorder=2.9)
        items.append(
            Line2D([], [], color=_PLANNED, linewidth=1.3, linestyle=(0, (4, 2)), label="planned path")
        )
    return items


def _faint(colour: str, opacity: float) -> tuple[float, float, float, float]:
    """A colour with its opacity."""
    red, green, blue = (int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5))
    return red, green, blue, opacity
