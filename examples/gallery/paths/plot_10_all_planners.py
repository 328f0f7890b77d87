"""
Cost and work of all planners
=============================

Every planner on cells, on one query: how long its path is compared with the optimum, and how many nodes it expanded.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
plans = [lampyris.plan(scene, planner=name) for name in lampyris.list_planners()]
found = [plan for plan in plans if plan.gap is not None and plan.expansions]

figure, ax = plt.subplots(figsize=(9, 5), constrained_layout=True)
for plan in found:
    ax.plot(plan.expansions, 100 * plan.gap, "o", color="#1f7a5c")
    ax.annotate(
        plan.planner, (plan.expansions, 100 * plan.gap), xytext=(3, 3), textcoords="offset points", fontsize=7
    )
ax.set(xscale="log", xlabel="expansions", ylabel="above the optimum (%)")
plt.show()
