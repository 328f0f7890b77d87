"""
The fastest path is not the shortest
====================================

Planner ``fastest-time`` minimises travel time under the speed law's caps near walls and in corners.
"""

import matplotlib.pyplot as plt

import lampyris

robot = lampyris.Robot(radius=0.3, v_max=1.5)
scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46), robot=robot)
found = {}
for name in ("astar", "fastest-time"):
    plan = lampyris.plan(scene, planner=name)
    seconds = lampyris.speed_profile(scene, plan).duration
    found[f"{name}: {seconds:.1f} s"] = plan
lampyris.plot.compare(found, scene.grid)
plt.show()
