"""
How the sum of costs grows with a fleet
=======================================

Compared with the lower bound, by planner and number of robots.
"""

import matplotlib.pyplot as plt

import lampyris

grid = lampyris.load_grid("rooms-20")
figure, ax = plt.subplots(figsize=(8, 4.5), constrained_layout=True)
counts = (5, 10, 20, 30, 40)
for name in ("pibt", "prioritised-sipp", "lacam"):
    plans = [lampyris.plan_fleet(lampyris.random_fleet(grid, n, seed=2), planner=name) for n in counts]
    solved = [
        (n, p.sum_of_costs / p.lower_bound) for n, p in zip(counts, plans, strict=True) if p.status == "found"
    ]
    ax.plot(*zip(*solved, strict=True), "o-", label=name)
ax.set(xlabel="robots", ylabel="sum of costs / lower bound")
ax.legend()
plt.show()
