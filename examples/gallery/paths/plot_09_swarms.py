"""
Particles, glowworms, ants
==========================

Swarm planners are seeded with the shortest path; unseeded they search for it themselves, and may find none.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
names = ("pso", "gso", "ant-system", "mmas-dstar")
plans = [lampyris.plan(scene, planner=name, seed=1) for name in names]
ax = lampyris.plot.compare(plans, scene.grid)
ax.set_title(", ".join(f"{plan.planner}: +{plan.gap:.1%}" for plan in plans), fontsize=9)
plt.show()
