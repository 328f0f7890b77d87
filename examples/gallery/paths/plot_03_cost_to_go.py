"""
The cost-to-go field
====================

The exact cost from every cell to the goal, and next to it luciferin, the field that AD-GSO descends.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), start=(8, 0), goal=(48, 46))
field = lampyris.solve_field(scene)

figure, axes = plt.subplots(1, 2, figsize=(11, 5), constrained_layout=True)
for ax, layer in zip(axes, ("cost", "luciferin"), strict=True):
    lampyris.plot.field(field, scene.grid, layer=layer, ax=ax)
    ax.set_title(layer)
plt.show()
