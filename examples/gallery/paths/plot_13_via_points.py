"""
Via points in the best order
============================

The order is exact for up to 12 points.
"""

import matplotlib.pyplot as plt

import lampyris

points = [(20, 30), (5, 20), (44, 5)]
scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
tour = lampyris.plan(scene.through(points, order="best"), planner="astar")
ax = lampyris.plot.scene(scene)
lampyris.plot.path(tour, ax=ax)
for k, cell in enumerate(tour.via, start=1):
    x, y = scene.grid.to_metres(cell)
    ax.annotate(
        str(k), (x, y), weight="bold", ha="center", va="center", bbox={"boxstyle": "circle", "fc": "white"}
    )
plt.show()
