"""
How uncertain limits spread the arrival time
============================================

Polynomial chaos in a few dozen runs, and which setting carries the spread.
"""

import matplotlib.pyplot as plt

import lampyris

scene = lampyris.Scene(lampyris.load_grid("env-3"), (1, 1), (47, 47), robot=lampyris.Robot(radius=0.15))
made = lampyris.propagate_uncertainty(
    scene, {"v_max": "0.8:1.2", "a_max": "normal(0.5,0.05)"}, planner="astar"
)
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4), constrained_layout=True)
left.plot(list(made.quantiles.values()), list(made.quantiles), "o-")
left.set(
    xlabel="duration (s)",
    ylabel="probability",
    title=f"{made.mean:.1f} s, sd {made.sd:.2f} s, {made.runs} runs",
)
right.bar(list(made.sobol), [index.total for index in made.sobol.values()])
right.set_ylabel("total Sobol index")
plt.show()
