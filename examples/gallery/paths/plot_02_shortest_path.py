"""
AD-GSO compared with the shortest path
======================================

AD-GSO is greedy; A* is optimal. ``gap`` says how far a path is from the optimum.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
plans = [lampyris.plan(scene, planner=name) for name in ("ad-gso", "astar")]

ax = lampyris.plot.compare(plans, scene.grid)
ax.set_title(", ".join(f"{plan.planner}: {plan.cost:.1f} cells" for plan in plans))
plt.show()
