"""
Dubins and Reeds-Shepp curves
=============================

The shortest curves of a car, ahead only and with reversing.
"""

import matplotlib.pyplot as plt

from lampyris import curves

figure, axes = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
ends = (0.0, 0.0, 0.0), (0.5, 1.0, 3.14159)
for ax, find in zip(axes, (curves.dubins, curves.reeds_shepp), strict=True):
    curve = find(*ends, turn_radius=1.0)
    poses = curve.poses(spacing=0.02)
    ax.plot(poses[:, 0], poses[:, 1])
    ax.quiver(*[[end[k] for end in ends] for k in (0, 1)], [1, -1], [0, 0], width=0.008)
    ax.set(aspect="equal", title=f"{find.__name__} {curve.word}: {curve.length:.2f} m")
plt.show()
