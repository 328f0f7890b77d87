"""
Adaptive dimensionality
=======================

Planner ``pad`` plans in (x, y) where that is enough, and with the heading only within spheres that grow where the
path could not be tracked. Its bound is proven.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

walls = np.zeros((100, 160), dtype=bool)
walls[:70, 50:53] = walls[30:, 105:108] = True
grid = lampyris.Grid(walls, resolution=0.1)
outline = [(0.8, 0.25), (-0.3, 0.25), (-0.3, -0.25), (0.8, -0.25)]
robot = lampyris.Robot(footprint=outline, drive="ackermann", turn_radius=1.0)
scene = lampyris.Scene(grid, start_pose=(2.0, 5.0, 0.0), goal_pose=(14.0, 5.0, 3.14), robot=robot)
plan = lampyris.plan(scene, "pad", weight=1.1)
ax = lampyris.plot.grid(grid)
for centre, radius in plan.rounds[-1].spheres:
    ax.add_patch(plt.Circle(grid.to_metres(centre), radius * grid.resolution, color="tab:orange", alpha=0.25))
ax.plot(*plan.poses[:, :2].T)
ax.set_title(f"{plan.pose_path.length_m:.1f} m, at most {plan.bound:.3f} times the optimum of the lattice")
plt.show()
