"""
RRT-Connect and RRT*
====================

RRT-Connect finds a path soon; RRT* goes on, and its path gets shorter with each sample.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(28, 7), goal=(26, 26))
first = lampyris.plan(scene, planner="rrt-connect", seed=1)
best = lampyris.plan(scene, planner="rrt-star", seed=1, samples=3000)

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), constrained_layout=True)
lampyris.plot.scene(scene, ax=left)
for k, plan in enumerate((first, best)):
    lampyris.plot.path(plan.waypoints, scene.grid, ax=left, color=f"C{k}", label=plan.planner)
left.legend()
right.plot(best.best_by_iteration)
right.set(xlabel="batch of samples", ylabel="length of the best path (cells)")
plt.show()
