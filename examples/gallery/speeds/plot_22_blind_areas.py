"""
Blind areas
===========

Before a corner that hides what may come, the robot slows so that it could stop for it.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), (1, 1), (48, 48), robot=lampyris.Robot(radius=0.3))
sampled = lampyris.smooth(scene, lampyris.plan(scene, "astar"))
plain = lampyris.speed_profile(scene, sampled, "physical")
blind = lampyris.speed_profile(scene, sampled, "physical", law_settings={"blind": True, "blind.reach": 4.0})
lampyris.plot.compare({"physical": plain, "with blind areas": blind})
plt.show()
