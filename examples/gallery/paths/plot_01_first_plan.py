"""
A path with a speed at each cell
================================

AD-GSO plans on a bundled map; the physical law says how fast each part may be driven, and why.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-1"), start=(37, 8), goal=(5, 38))
plan = lampyris.plan(scene, planner="ad-gso")
profile = lampyris.speed_profile(scene, plan)

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.5), constrained_layout=True)
lampyris.plot.scene(scene, ax=left)
lampyris.plot.path(plan, ax=left)
lampyris.plot.profile(profile, ax=right)
left.set_title(f"cost {plan.cost:.1f} cells, {plan.gap:.1%} above the optimum")
plt.show()
