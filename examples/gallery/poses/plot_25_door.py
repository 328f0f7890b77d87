"""
A footprint that fits through a door
====================================

A robot of 0.6 x 0.4 m passes a door of 0.7 m, its circumscribed circle of 0.72 m does not.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

walls = np.zeros((60, 80), dtype=bool)
walls[:, 40:43] = True
walls[23:37, 40:43] = False
grid = lampyris.Grid(walls, resolution=0.05)
robot = lampyris.Robot(footprint=[(0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)], drive="differential")
scene = lampyris.Scene(grid, start_pose=(1.0, 0.8, 0.0), goal_pose=(3.2, 2.4, 1.57), robot=robot)
drive = lampyris.drive(scene, "lattice")
ax = lampyris.plot.drive(drive)
ax.set_title(f"{drive.outcome} after {drive.duration:.1f} s")
plt.show()
