"""
Three drive types
=================

The same start and goal for a differential, an Ackermann and an omnidirectional drive.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

walls = np.zeros((60, 100), dtype=bool)
walls[20:40, 45:55] = True
grid = lampyris.Grid(walls, resolution=0.1)
outline = [(0.8, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.8, -0.3)]
figure, axes = plt.subplots(3, 1, figsize=(7, 11), constrained_layout=True)
for ax, kind in zip(axes, ("differential", "ackermann", "omnidirectional"), strict=True):
    robot = lampyris.Robot(footprint=outline, drive=kind, turn_radius=1.0 if kind == "ackermann" else 0.0)
    scene = lampyris.Scene(grid, start_pose=(1.5, 3.0, 1.57), goal_pose=(8.5, 3.0, -1.57), robot=robot)
    drive = lampyris.drive(scene, "lattice", weight=1.1)
    lampyris.plot.drive(drive, ax=ax)
    ax.set_title(f"{kind}: {drive.duration:.1f} s")
plt.show()
