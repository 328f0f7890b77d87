"""Draw the picture of docs/poses.md: the same task for three kinds of drive, on the bundled office floor.

    python tools/three_drives.py docs/img/three-drives.png

The robot leaves a room and parks in a niche of the corridor, along its wall.
"""

from __future__ import annotations

import sys

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt

import lampyris
from lampyris.model.robot import DRIVES

LENGTH, WIDTH, RADIUS = 1.4, 0.7, 1.4
START, GOAL = (4.0, 4.0, 0.0), (14.0, 9.0, 0.0)


def office() -> lampyris.Grid:
    """The bundled office floor with cells of 0.25 m."""
    found = lampyris.load_grid("office-120", resolution=0.25)
    return found


def main(out: str) -> None:
    """Plan and draw."""
    grid = office()
    half = WIDTH / 2
    footprint = [(LENGTH - 0.3, half), (-0.3, half), (-0.3, -half), (LENGTH - 0.3, -half)]
    figure, axes = plt.subplots(1, 3, figsize=(15, 5.2), constrained_layout=True)
    for ax, kind in zip(axes, DRIVES, strict=True):
        radius = RADIUS if kind == "ackermann" else 0.0
        robot = lampyris.Robot(footprint=footprint, drive=kind, turn_radius=radius)
        scene = lampyris.Scene(grid, start_pose=START, goal_pose=GOAL, robot=robot)
        plan = lampyris.plan(scene, "lattice", weight=1.02)
        assert plan.pose_path is not None, (kind, plan.sentence)
        path = plan.pose_path
        lampyris.plot.grid(grid, ax=ax)
        for k in np.linspace(0, len(path.poses) - 1, 26).astype(int):
            x, y, yaw = path.poses[k]
            cos, sin = np.cos(yaw), np.sin(yaw)
            corners = np.array([(x + cos * a - sin * b, y + sin * a + cos * b) for a, b in footprint])
            ax.fill(*corners.T, facecolor="#fde9bd", edgecolor="#20242c", linewidth=0.7, alpha=0.9, zorder=3)
        for gear, colour in ((1, "#0072b2"), (-1, "#d55e00"), (0, "#cc79a7")):
            for k in np.flatnonzero(path.gears == gear):
                ax.plot(*path.poses[k : k + 2, :2].T, color=colour, linewidth=2.5, zorder=4)
        word = "turns in place" if kind == "differential" else f"{path.reversals} reversals"
        ax.set_title(f"{kind}: {path.length_m:.1f} m, {word}", loc="left", fontsize=12)
    figure.savefig(out, dpi=80)


if __name__ == "__main__":
    main(sys.argv[1])
