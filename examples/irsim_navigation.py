"""Plan in IR-SIM with lampyris, and have IR-SIM's own runner drive the robot along the path.

pip install lampyris ir-sim
python examples/irsim_navigation.py
"""

import os
import tempfile

os.environ.setdefault("MPLBACKEND", "Agg")

import irsim

from lampyris.irsim import IrsimPlanner

WORLD = """
world: {height: 10, width: 10, step_time: 0.1, sample_time: 0.1, offset: [0, 0], collision_mode: stop}
robot:
  - kinematics: {name: diff}
    shape: {name: circle, radius: 0.2}
    state: [1, 1, 0]
    goal: [9, 9, 0]
    goal_threshold: 0.15
    vel_max: [1.0, 3.0]
    behavior: {name: dash}
obstacle:
  - {shape: {name: rectangle, length: 6, width: 0.4}, state: [3, 4, 0]}
  - {shape: {name: rectangle, length: 6, width: 0.4}, state: [7, 7, 0]}
  - {shape: {name: circle, radius: 0.8}, state: [8, 2.2, 0]}
"""

with tempfile.TemporaryDirectory() as folder:
    world = os.path.join(folder, "world.yaml")
    with open(world, "w", encoding="utf-8") as file:
        file.write(WORLD)
    env = irsim.make(world, display=False)
robot = env.robot
planner = IrsimPlanner(env.get_map(0.1), "theta-star", radius=0.3)
path = planner.planning(robot.state, robot.goal)
if path is None:
    raise SystemExit(f"no path: {planner.plan.status}")
print(f"{planner.plan!r}; {path.shape[1]} waypoints")
robot.set_goal([[x, y, 0.0] for x, y in path.T[::-1][1:].tolist()])
for _ in range(1000):
    env.step()
    if env.done():
        break
print(f"arrived: {robot.arrive}, collision: {robot.collision}, {env.time:.1f} s")
env.end()
