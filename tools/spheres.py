"""Draw the picture of docs/poses.md: spheres, tunnel and path of the planner pad.

python tools/spheres.py docs/img/spheres.png
"""

from __future__ import annotations

import sys

import numpy as np

import lampyris
from lampyris.report.pictures.plan_picture import draw_plan

FINER = 4
"""Cells of 0.5 m are cut into so many by as many."""


def main(out: str) -> None:
    """Plan and draw."""
    rooms = lampyris.load_grid("office-120").blocked[26:80, 40:]
    walls = np.kron(rooms, np.ones((FINER, FINER), dtype=bool))
    grid = lampyris.Grid(walls, resolution=0.5 / FINER, name="a part of office-120")
    footprint = [(0.8, 0.25), (-0.3, 0.25), (-0.3, -0.25), (0.8, -0.25)]
    robot = lampyris.Robot(
        footprint=footprint, drive="ackermann", turn_radius=1.0, v_max=1.5, a_max=0.8, d_max=1.5
    )
    start, goal = (9.4, 4.0, -1.57), (14.5, 23.4, 3.14)
    scene = lampyris.Scene(grid, start_pose=start, goal_pose=goal, robot=robot)
    plan = lampyris.plan(scene, "pad", weight=1.05)
    draw_plan(grid, plan, scene=scene, layer="none", out=out)
    for one in plan.rounds:
        print(
            f"{len(one.spheres)} spheres, planned {one.planned_m}, tracked {one.tracked_m}, at least {one.lower_bound_m}; "
            f"{one.low_expansions} + {one.high_expansions} + {one.tracking_expansions} expansions"
        )


if __name__ == "__main__":
    main(sys.argv[1])
