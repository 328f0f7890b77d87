"""
BIT*: batches of samples
========================

Batch informed trees search the samples of each batch in the order of the cost that a path through them could have.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-6"), start=(2, 2), goal=(47, 46))
plan = lampyris.plan(scene, planner="bit-star", seed=1)
ax = lampyris.plot.scene(scene)
lampyris.plot.path(plan.waypoints, scene.grid, ax=ax)
ax.set_title(f"{plan.any_angle_length:.2f} cells")
plt.show()
