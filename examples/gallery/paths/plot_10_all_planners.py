"""
Cost and work of all planners
=============================

Every planner on cells, on one query: how many nodes it expanded, and how far the cost of its path is above the optimum.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
plans = [lampyris.plan(scene, planner=name) for name in lampyris.list_planners()]
found = [plan for plan in plans if plan.gap is not None and plan.expansions]
found.sort(key=lambda plan: plan.expansions)

figure, ax = plt.subplots(figsize=(6.4, 7), constrained_layout=True)
for row, plan in enumerate(found):
    best = plan.gap < 1e-9
    ax.plot(plan.expansions, row, "o", color="#1f7a5c" if best else "#d95f02")
    if not best:
        ax.annotate(
            f"+{100 * plan.gap:.1f} %",
            (plan.expansions, row),
            (6, -3),
            textcoords="offset points",
            fontsize=7,
        )
ax.set_yticks(range(len(found)), [plan.planner for plan in found], fontsize=7)
ax.set(
    xscale="log",
    xlabel="expansions",
    title="green: the optimal cost; orange: above it",
    ylim=(-1, len(found)),
)
ax.grid(axis="y", linewidth=0.3)
plt.show()
