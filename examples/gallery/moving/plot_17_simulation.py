"""
A simulation among random walkers
=================================

The robot replans when something is in its way; the referee verifies every tick.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46))
run = lampyris.simulate(scene, planner="ad-gso", traffic=lampyris.RandomWalk(count=20), seed=7)
ax = lampyris.plot.trace(run)
ax.set_title(f"{run.outcome} in {run.ticks} ticks, {run.replans} replans, {run.collisions} collisions")
plt.show()
