"""
Maps of many formats
====================

Bundled maps; files of ROS, MovingAI, pictures and arrays are read by the same function.
"""

import matplotlib.pyplot as plt

import lampyris

names = ("env-1", "rooms-100", "office-120", "warehouse-200")
figure, axes = plt.subplots(2, 2, figsize=(9, 8), constrained_layout=True)
for ax, name in zip(axes.flat, names, strict=True):
    lampyris.plot.grid(lampyris.load_grid(name), ax=ax)
    ax.set_title(name)
plt.show()
