"""
A car parks
===========

Hybrid A* with exact Reeds-Shepp ends: ahead, then back into the gap.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

walls = np.zeros((80, 160), dtype=bool)
walls[64:, :60] = walls[64:, 112:] = True
grid = lampyris.Grid(walls, resolution=0.1)
outline = [(3.2, 0.8), (-0.8, 0.8), (-0.8, -0.8), (3.2, -0.8)]
car = lampyris.Robot(footprint=outline, drive="ackermann", turn_radius=4.0, v_max=1.0)
scene = lampyris.Scene(grid, start_pose=(3.0, 4.0, 0.0), goal_pose=(7.2, 0.9, 0.0), robot=car)
plan = lampyris.plan(scene, "hybrid-astar")
ax = lampyris.plot.drive(lampyris.drive(scene, "hybrid-astar"))
ax.set_title(f"{plan.pose_path.length_m:.1f} m, {plan.pose_path.reversals} changes of gear")
plt.show()
