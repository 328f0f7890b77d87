"""
The safest path
===============

The Voronoi planner keeps the maximum distance from walls that any path can keep.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46))
plans = [lampyris.plan(scene, planner=name) for name in ("astar", "voronoi")]
lampyris.plot.compare(plans, scene.grid)
plt.show()
