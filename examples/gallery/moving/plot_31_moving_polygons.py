"""
Obstacles with a shape
======================

A forklift drives through the hall; the car waits for its outline, not for a circle around it.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

grid = lampyris.Grid(np.zeros((60, 80), dtype=bool), resolution=0.05)
robot = lampyris.Robot(footprint=[(0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)])
fork = [(0.25, 0.1), (-0.15, 0.1), (-0.15, -0.1), (0.25, -0.1)]
forklift = lampyris.Recorded([(50, y) for y in range(8, 50)], footprint=fork)
scene = lampyris.Scene(
    grid, start_pose=(1.0, 1.5, 0.0), goal_pose=(3.0, 1.5, 0.0), robot=robot, traffic=forklift
)
drive = lampyris.drive(scene, "lattice")
ax = lampyris.plot.drive(drive)
ax.set_title(f"{drive.outcome} after {drive.duration:.1f} s")
plt.show()
