"""
Motion primitives
=================

The lattice's motions are generated from the robot's limits; those of Nav2 and SBPL files can be read instead.
"""

import matplotlib.pyplot as plt

import lampyris

robot = lampyris.Robot(drive="ackermann", turn_radius=0.5, radius=0.2)
primitives = lampyris.motion_primitives(robot, resolution=0.05)
figure, ax = plt.subplots(figsize=(6, 6))
for motion in primitives.motions:
    ax.plot(motion.poses[:, 0], motion.poses[:, 1], color=f"C{motion.start % 10}")
ax.set(aspect="equal", xlabel="x (m)", ylabel="y (m)", title="motions of all 16 headings")
plt.show()
