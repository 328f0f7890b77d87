"""
Speed laws on one path
======================

The same path under several laws.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), (8, 0), (48, 46), robot=lampyris.Robot(radius=0.3))
plan = lampyris.plan(scene, planner="astar")
profiles = {law: lampyris.speed_profile(scene, plan, law) for law in ("physical", "rpp", "optimum")}
ax = lampyris.plot.compare({f"{law}: {p.duration:.1f} s": p for law, p in profiles.items()})
plt.show()
