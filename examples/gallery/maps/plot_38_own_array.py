"""
A map of an array
=================

Any boolean array is a map: True is blocked, row 0 is the top.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

rng = np.random.default_rng(4)
blocked = rng.random((40, 60)) < 0.25
blocked[0, 0] = blocked[-1, -1] = False
scene = lampyris.Scene(lampyris.Grid(blocked, resolution=0.1), start=(0, 0), goal=(59, 39))
plan = lampyris.plan(scene, planner="fastest")
ax = lampyris.plot.scene(scene)
if plan.path is not None:
    lampyris.plot.path(plan, ax=ax)
ax.set_title(plan.status.sentence)
plt.show()
