"""
A chain of links
================

An arm with four joints moves around a post; joints are released one by one as they are needed.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

walls = np.zeros((20, 20), dtype=bool)
walls[13:15, 17:19] = True
grid = lampyris.Grid(walls, resolution=0.5)
arm = lampyris.Chain(base=(6.0, 3.0), links=[0.8] * 4, widths=0.15, joint_limits=(-2.6, 2.6))
plan = lampyris.plan_chain(grid, arm, start=[-0.7, 0, 0, 0], goal=[0.7, 0, 0, 0])
ax = lampyris.plot.grid(grid)
for k in np.linspace(0, len(plan.configurations) - 1, 8).astype(int):
    angles = np.cumsum(plan.configurations[k])
    x = 6.0 + np.concatenate(([0], np.cumsum(0.8 * np.cos(angles))))
    y = 3.0 + np.concatenate(([0], np.cumsum(0.8 * np.sin(angles))))
    ax.plot(x, y, "o-", alpha=0.4 + 0.6 * k / len(plan.configurations), color="tab:green", markersize=3)
ax.set_title(f"{len(plan.released)} of 4 joints released")
plt.show()
