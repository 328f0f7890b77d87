"""Draw the picture of docs/poses.md: a car parks.

python tools/parking.py docs/img/parking.png
"""

from __future__ import annotations

import sys

import numpy as np

import lampyris
from lampyris.report.pictures.plan_picture import draw_plan


def main(out: str) -> None:
    """Plan and draw."""
    walls = np.zeros((100, 140), dtype=bool)
    walls[[0, -1]] = walls[:, [0, -1]] = True
    walls[64:68, :100] = True
    for k in range(6):
        walls[2:30, 14 + 18 * k : 16 + 18 * k] = True
    grid = lampyris.Grid(walls, resolution=0.25, name="car park")
    footprint = [(3.6, 0.9), (-0.9, 0.9), (-0.9, -0.9), (3.6, -0.9)]
    robot = lampyris.Robot(
        footprint=footprint, drive="ackermann", turn_radius=5.0, v_max=3.0, a_max=1.0, d_max=2.0
    )
    scene = lampyris.Scene(grid, start_pose=(4.1, 4.1, 0.0), goal_pose=(15.1, 19.5, np.pi / 2), robot=robot)
    plan = lampyris.plan(scene, "lattice", weight=1.05)
    draw_plan(grid, plan, profile=lampyris.speed_profile(scene, plan), scene=scene, layer="none", out=out)


if __name__ == "__main__":
    main(sys.argv[1])
