"""How fast along a way, by which law and why; then the same way driven among ten walkers."""

import numpy as np

import lampyris
from lampyris.motion.laws.compare import compare

grid = lampyris.load_grid("env-3")
robot = lampyris.Robot(radius=0.3, v_max=1.0, a_max=0.5, d_max=1.0)
scene = lampyris.Scene(grid, start=(8, 0), goal=(48, 46), robot=robot)
plan = lampyris.plan(scene, planner="astar")
course = lampyris.smooth(scene, plan)
print(f"{course.s[-1]:.1f} m, {len(course)} nodes")

for entry in compare(course, scene, ["constant", "rpp", "physical", "optimum"]):
    broken = ", ".join(entry.broken) or "none"
    print(
        f"{entry.law:10} {entry.duration_s:6.1f} s, {entry.ratio:.2f} of the optimum; limits broken: {broken}"
    )
speeds = lampyris.speed_profile(scene, course, "physical")
slowest = int(np.where(speeds.s > 2.0, speeds.v, 9.0)[:-9].argmin())
print(
    f"slowest under way after {speeds.s[slowest]:.1f} m, {speeds.v[slowest]:.2f} m/s: {speeds.why(slowest)}"
)

run = lampyris.drive(scene, "astar", traffic=lampyris.RandomWalk(10), seed=7, law="physical")
print(f"{run.outcome} after {run.duration:.1f} s; the best without obstacles is {run.optimum:.1f} s")
seconds: dict[str, float] = {}
for cause, period in zip(run.cause, np.diff(run.t), strict=False):
    seconds[cause] = seconds.get(cause, 0.0) + period
print(
    "limited by",
    ", ".join(f"{cause} {seconds[cause]:.1f} s" for cause in sorted(seconds, key=lambda c: -seconds[c])),
)
