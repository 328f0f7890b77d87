"""
Terrain
=======

Cells may cost more than others, by the values of a ROS costmap (0 to 252): the path goes around what is expensive.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

terrain = np.zeros((40, 60), dtype=np.uint8)
terrain[10:30, 20:40] = 120
grid = lampyris.Grid(np.zeros((40, 60), dtype=bool), terrain=terrain)
scene = lampyris.Scene(grid, start=(3, 20), goal=(56, 20))
plan = lampyris.plan(scene, planner="astar")
ax = lampyris.plot.scene(scene)
lampyris.plot.path(plan, ax=ax)
plt.show()
