"""
A drive in continuous time
==========================

Real accelerations, and for each moment the reason for the speed.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), (1, 1), (48, 48), robot=lampyris.Robot(radius=0.3))
run = lampyris.drive(scene, "astar", traffic=[lampyris.RandomWalk(10), lampyris.Crossing(2)], seed=4)

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), constrained_layout=True)
lampyris.plot.drive(run, ax=left)
t = np.linspace(0.0, run.duration, 600)
right.plot(t, run.at(t)[1])
right.set(xlabel="time (s)", ylabel="speed (m/s)", title=f"{run.outcome} after {run.duration:.1f} s")
plt.show()
