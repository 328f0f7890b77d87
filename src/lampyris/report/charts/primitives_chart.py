"""The chart of motion primitives: every motion of a lattice from one place."""

from __future__ import annotations

import math

from lampyris.model.lattice.motion_primitives import MotionPrimitives
from lampyris.report import style

DPI = 150
_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7")
"""Of headings 0, 1, 2, 3, and again from 4 on."""


def draw_primitives(primitives: MotionPrimitives, out: style.OutFile) -> None:
    """Draw all motions over the cells that they pass, coloured by the heading they begin at; PNG or SVG by the suffix.

    Turns in place are arcs around the start, and are drawn at a distance of half a cell.

    Raises
    ------
    UsageError : another suffix.
    FileError : the system refuses to write.
    """
    from matplotlib.figure import Figure

    suffix = style.suffix_of(out, (".png", ".svg"))
    cell = primitives.resolution
    reach = max(float(abs(one.poses[:, :2]).max()) for one in primitives.motions) + cell
    figure = Figure(figsize=(6.0, 6.4), dpi=DPI, facecolor="white")
    axes = figure.add_axes((0.1, 0.07, 0.87, 0.86))
    lines = math.floor(reach / cell)
    if lines <= 60:
        for k in range(-lines, lines + 2):
            axes.axhline((k - 0.5) * cell, color="#e5e7eb", linewidth=0.5)
            axes.axvline((k - 0.5) * cell, color="#e5e7eb", linewidth=0.5)
    for one in primitives.motions:
        x, y, yaw = one.poses.T
        colour = _COLOURS[one.start % len(_COLOURS)]
        if one.cell == (0, 0) and float(abs(one.poses[:, :2]).max()) < 1e-6:
            points = [(0.5 * cell * math.cos(a), 0.5 * cell * math.sin(a)) for a in yaw.tolist()]
            axes.plot([a for a, _ in points], [b for _, b in points], color=colour, linewidth=0.8, alpha=0.6)
            continue
        axes.plot(x, y, color=colour, linewidth=1.1)
        tip = (x[-1] + 0.4 * cell * math.cos(yaw[-1]), y[-1] + 0.4 * cell * math.sin(yaw[-1]))
        axes.plot([x[-1], tip[0]], [y[-1], tip[1]], color=colour, linewidth=0.8)
        axes.plot(x[-1:], y[-1:], "o", color=colour, markersize=2.5)
    axes.set_xlim(-reach, reach)
    axes.set_ylim(-reach, reach)
    axes.set_aspect("equal")
    axes.set_xlabel("m", fontsize=9, color=style.INK)
    axes.tick_params(labelsize=8, colors=style.FAINT)
    title = (
        f"{len(primitives.motions)} primitives at {len(primitives.headings)} headings, cells of {cell:g} m"
    )
    figure.text(0.02, 0.975, title, fontsize=10, fontweight="bold", color=style.INK, va="top")
    style.save(figure, out, suffix, DPI)
