"""Draw the picture of docs/poses.md: the same task for three kinds of drive, in rooms of the bundled office floor.

    python tools/three_drives.py docs/img/three-drives.png

Cells of the map are half a metre, laid out as 4 x 4 of 0.125 m: doors are 1 m wide, the corridor 1.5 m.
"""

from __future__ import annotations

import math
import sys

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

import lampyris
from lampyris.model.robot import DRIVES
from lampyris.report import style

FOOTPRINT = [(0.8, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.8, -0.3)]
START, GOAL = (8.0, 11.0, 0.0), (18.5, 9.7, -math.pi / 2)
PART = (6.0, 28.0, 5.8, 14.2)
"""Metres of the map that are shown: least and greatest x, least and greatest y."""
GEARS = ((1, "ahead, or to a side", "#0072b2"), (-1, "in reverse", "#d55e00"))


def main(out: str) -> None:
    """Plan and draw."""
    office = lampyris.load_grid("office-120")
    grid = lampyris.Grid(np.kron(office.blocked, np.ones((4, 4), dtype=bool)), resolution=0.125)
    figure, axes = plt.subplots(3, 1, figsize=(11, 14.5), constrained_layout=True)
    for ax, kind in zip(axes, DRIVES, strict=True):
        robot = lampyris.Robot(
            footprint=FOOTPRINT, drive=kind, turn_radius=1.0 if kind == "ackermann" else 0.0
        )
        scene = lampyris.Scene(grid, start_pose=START, goal_pose=GOAL, robot=robot)
        plan = lampyris.plan(scene, "lattice", weight=1.02)
        path = plan.pose_path
        assert path is not None, (kind, plan.status.sentence)
        lampyris.plot.grid(grid, ax=ax)
        ends = np.concatenate(([0.0], np.cumsum(path.steps_in(0.4))))
        for s in np.linspace(0.0, ends[-1], 34):
            x, y, yaw = path.poses[int(np.argmin(np.abs(ends - s)))]
            cos, sin = math.cos(yaw), math.sin(yaw)
            corners = np.array([(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in FOOTPRINT])
            ax.fill(*corners.T, facecolor="#fde9bd", edgecolor="#20242c", linewidth=0.6, alpha=0.75, zorder=3)
        for gear, _, colour in GEARS:
            for k in np.flatnonzero(path.gears == gear):
                ax.plot(*path.poses[k : k + 2, :2].T, color=colour, linewidth=2.5, zorder=4)
        ax.plot(*START[:2], "o", color=style.START, markersize=8, zorder=5)
        ax.plot(*GOAL[:2], "*", color=style.GOAL, markeredgecolor="#20242c", markersize=15, zorder=5)
        ax.set(xlim=PART[:2], ylim=PART[2:], xlabel="x (m)", ylabel="y (m)", aspect="equal")
        ax.set_title(f"{kind}: {path.length_m:.1f} m, {path.reversals} changes of gear", loc="left")
    lines = [Line2D([], [], color=colour, linewidth=2.5, label=word) for _, word, colour in GEARS]
    lines.append(Line2D([], [], marker="o", linestyle="", color=style.START, label="start"))
    lines.append(Line2D([], [], marker="*", linestyle="", color=style.GOAL, markersize=12, label="goal"))
    lines.append(Patch(facecolor="#fde9bd", edgecolor="#20242c", label="robot to scale, 1.1 x 0.6 m"))
    figure.legend(handles=lines, loc="outside lower center", ncols=5, frameon=False)
    figure.savefig(out, dpi=75)


if __name__ == "__main__":
    main(sys.argv[1])
