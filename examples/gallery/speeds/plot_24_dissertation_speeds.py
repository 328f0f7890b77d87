"""
The dissertation's speed law
============================

Three speeds by the number of obstacles in the rings around each node.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), (37, 8), (5, 38), moves=lampyris.MOVES["dissertation"])
plan = lampyris.plan(scene, planner="ad-gso")
lampyris.plot.profile(lampyris.speed_profile(scene, plan, "dissertation"))
plt.show()
