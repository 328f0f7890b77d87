"""
Cells of a quadtree
===================

Large free squares are one node each: few nodes, somewhat longer paths.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46))
plans = [lampyris.plan(scene, planner=name) for name in ("astar", "quadtree")]
ax = lampyris.plot.compare(plans, scene.grid)
ax.set_title(", ".join(f"{plan.planner}: {plan.expansions} expansions" for plan in plans))
plt.show()
