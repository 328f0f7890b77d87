"""
A limit on jerk
===============

With a maximum jerk the acceleration changes gradually.
"""

import matplotlib.pyplot as plt

import lampyris

grid = lampyris.load_grid("env-1")
profiles = {}
for jerk in (None, 0.3):
    scene = lampyris.Scene(grid, (1, 1), (48, 48), robot=lampyris.Robot(radius=0.3, jerk_max=jerk))
    sampled = lampyris.smooth(scene, lampyris.plan(scene, "astar"))
    profiles["no limit" if jerk is None else f"{jerk} m/s³"] = lampyris.speed_profile(scene, sampled)
lampyris.plot.compare(profiles)
plt.show()
