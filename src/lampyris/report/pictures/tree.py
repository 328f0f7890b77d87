"""The trees of a planner that samples."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from lampyris.report import style
from lampyris.report.pictures.canvas import FigureLayout
from lampyris.typing import Floats

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_LINE = style.SPARE[4]
_THIN = (0.35, 1.1)
"""Points: the least and the greatest width of a line."""


def draw_tree(axes: Axes, tree: Floats, frame: FigureLayout) -> Any:
    """Draw the lines of trees beneath the path; the legend item.

    Parameters
    ----------
    tree : float64 (m, 4): x, y of either end of each line, in cells.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    # The more lines there are, the thinner.
    width = float(np.clip(frame.cell * 6.0 / np.sqrt(len(tree)), *_THIN))
    lines = LineCollection(
        list(tree.reshape(-1, 2, 2)), colors=_LINE, linewidths=width, alpha=0.75, zorder=2.5
    )
    axes.add_collection(lines, autolim=False)
    return Line2D([], [], color=_LINE, linewidth=1.2, label="tree")
