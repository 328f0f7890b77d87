"""
Inflation, as Nav2 does it
==========================

With inflated walls the path keeps to the middle of corridors.
"""

import matplotlib.pyplot as plt

import lampyris

grid = lampyris.load_grid("env-3", resolution=0.1)
robot = lampyris.Robot(radius=0.05)
inflated = lampyris.inflate(grid, robot, inflation_radius=0.5, cost_scaling_factor=4.0)
ax = lampyris.plot.grid(inflated)
for name, one, colour in (("without", grid, "C0"), ("with inflation", inflated, "C3")):
    scene = lampyris.Scene(one, start=(8, 0), goal=(48, 46), robot=robot)
    lampyris.plot.path(lampyris.plan(scene, planner="astar"), ax=ax, color=colour, label=name)
ax.legend()
plt.show()
