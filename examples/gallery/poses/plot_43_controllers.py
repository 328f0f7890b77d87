"""
Controllers that steer
======================

Pure pursuit and MPPI follow the same path; each command is filtered by a braking rule.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

robot = lampyris.Robot(footprint=[(0.4, 0.3), (-0.4, 0.3), (-0.4, -0.3), (0.4, -0.3)])
walls = np.zeros((100, 160), dtype=bool)
walls[:65, 50:53] = walls[35:, 105:108] = True
grid = lampyris.Grid(walls, resolution=0.1)
scene = lampyris.Scene(grid, start_pose=(2.0, 5.0, 0.0), goal_pose=(14.0, 5.0, 0.0), robot=robot)
figure, axes = plt.subplots(1, 2, figsize=(11, 5), constrained_layout=True)
for ax, name in zip(axes, ("pure-pursuit", "mppi"), strict=True):
    drive = lampyris.drive(scene, "lattice", controller=name, traffic=lampyris.RandomWalk(4), seed=2)
    lampyris.plot.drive(drive, ax=ax)
    ax.set_title(f"{name}: {drive.outcome} after {drive.duration:.1f} s")
plt.show()
