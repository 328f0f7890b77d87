"""
Paths at any angle
==================

Theta* leaves the grid's eight directions; the visibility graph is exact among paths of straight segments.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46))
ax = lampyris.plot.scene(scene)
for k, name in enumerate(("astar", "theta-star", "visibility-graph")):
    plan = lampyris.plan(scene, planner=name)
    line = plan.path.cells if plan.waypoints is None else plan.waypoints
    length = np.hypot(*np.diff(line.astype(float), axis=0).T).sum()
    lampyris.plot.path(line, scene.grid, ax=ax, color=f"C{k}", label=f"{name}: {length:.2f} m")
ax.legend()
plt.show()
