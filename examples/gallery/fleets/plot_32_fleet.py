"""
Fifty robots that never collide
===============================

LaCAM* plans for all at once; the referee checks every pair of paths.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

grid = lampyris.load_grid("warehouse-200")
fleet = lampyris.random_fleet(grid, 50, seed=1)
plan = lampyris.plan_fleet(fleet, planner="lacam", seed=0)
ax = lampyris.plot.grid(grid)
for path in plan.paths:
    ax.plot(*grid.to_metres(np.array(path)).T, linewidth=0.8)
ax.set_title(f"makespan {plan.makespan}, sum of costs {plan.sum_of_costs}, at least {plan.lower_bound}")
plt.show()
