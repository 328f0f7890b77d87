"""From a bundled map to a timed path, and a run among twenty moving obstacles."""

import lampyris

grid = lampyris.load_grid("env-3")
scene = lampyris.Scene(grid, start=(8, 0), goal=(48, 46))
plan = lampyris.plan(scene, planner="ad-gso")
speeds = lampyris.speed_profile(scene, plan)
print(f"{plan.status}: {plan.cost:.2f} cells in {plan.iterations} jumps, {plan.gap:.1%} above the best")
print(
    f"{speeds.duration:.1f} s; fastest {speeds.v.max():.2f} m/s; the third node is limited by {speeds.cause[2]}"
)

run = lampyris.simulate(scene, planner="ad-gso", traffic=lampyris.RandomWalk(count=20), seed=7)
print(f"{run.outcome} after {run.ticks} ticks, {run.replans} replans, {run.collisions} collisions")
