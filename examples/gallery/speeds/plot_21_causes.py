"""
Why the robot drives as fast as it does
=======================================

Each node of a profile names what limits its speed.
"""

from collections import Counter

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), (1, 1), (48, 48), robot=lampyris.Robot(radius=0.3))
sampled = lampyris.smooth(scene, lampyris.plan(scene, "astar"))
profile = lampyris.speed_profile(scene, sampled, "physical")

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4), constrained_layout=True, width_ratios=(2, 1))
lampyris.plot.profile(profile, ax=left)
causes = Counter(profile.cause).most_common()
right.barh([name for name, _ in causes][::-1], [count for _, count in causes][::-1])
right.set_xlabel("nodes")
plt.show()
