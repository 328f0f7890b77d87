"""
Glowworms that are robots
=========================

Sixty discs look for three sources by glowworm swarm optimisation, without touching each other.
"""

import matplotlib.pyplot as plt
import numpy as np

import lampyris

grid = lampyris.load_grid("env-6")
trace = lampyris.swarm_robots(grid, robots=60, seed=1, iterations=200, noise=0.05)
figure, ax = plt.subplots(figsize=(7, 4), constrained_layout=True)
for k, held in enumerate(np.array(trace.held).T, start=1):
    ax.plot(held, label=f"source {k}")
ax.set(xlabel="iteration", ylabel="robots at the source")
ax.legend()
plt.show()
