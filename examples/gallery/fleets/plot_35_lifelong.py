"""
Tasks without end
=================

Robots that have done a task get the next one; how many tasks a tick do fleets of several sizes do?
"""

import matplotlib.pyplot as plt

import lampyris

grid = lampyris.load_grid("rooms-20")
figure, ax = plt.subplots(figsize=(7, 4), constrained_layout=True)
counts = (5, 10, 20, 40)
runs = [lampyris.lifelong_fleet(lampyris.random_fleet(grid, n, seed=1), 200) for n in counts]
ax.plot(counts, [run.throughput for run in runs], "o-")
ax.set(xlabel="robots", ylabel="tasks done a tick")
plt.show()
