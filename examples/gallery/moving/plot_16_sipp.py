"""
Obstacles that are known in advance
===================================

SIPP plans in space and time when the tracks of obstacles are known: it waits where waiting is better.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46))
figure, axes = plt.subplots(1, 2, figsize=(11, 5), constrained_layout=True)
for ax, name in zip(axes, ("astar", "sipp"), strict=True):
    run = lampyris.simulate(scene, planner=name, traffic=lampyris.RandomWalk(count=30), seed=3)
    lampyris.plot.trace(run, ax=ax)
    ax.set_title(f"{name}: {run.outcome}, {run.ticks} ticks, {run.replans} replans")
plt.show()
