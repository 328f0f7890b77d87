"""
A map that the robot learns
===========================

Walls are unknown until a range sensor has seen them; unseen cells count as free.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46))
figure, axes = plt.subplots(1, 2, figsize=(11, 5), constrained_layout=True)
for ax, sensor in zip(axes, (None, lampyris.Sensor(8.0)), strict=True):
    run = lampyris.simulate(scene, planner="dstar-lite", sensor=sensor)
    lampyris.plot.trace(run, ax=ax)
    known = "sensor of 8 m" if sensor else "map known"
    ax.set_title(f"{known}: {run.ticks} ticks, {run.replans} replans")
plt.show()
