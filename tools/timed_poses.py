"""Arrivals among walkers with known tracks: the footprint by lattice-sipp and pad-sipp, and the disc around it by sipp.

    python tools/timed_poses.py [SCENES [DOOR]]

Random rooms of 48 x 48 cells with doors, 8 walkers each. All robots drive a cell in a tick. Of scenes that all solve, the
ticks of arrival, by the footprint's planners at two bounds; each answer is checked by the referee, which looks for contacts
with all walkers in continuous time. Expansions are those of all searches of a call; processor time is that of the call, map
included.
"""

from __future__ import annotations

import statistics
import sys
import time
from dataclasses import replace

import numpy as np

import lampyris
from lampyris.kernels._jit import compiled_only
from lampyris.model.plan import Status
from lampyris.referee import check_plan

OUTLINE = ((2.4, 1.2), (-1.4, 1.2), (-1.4, -1.2), (2.4, -1.2))
"""Cells: 3.8 x 2.4; the disc around it is 5.4 cells wide."""
WALKERS, TICKS = 8, 150


def rooms(rng: np.random.Generator, door: int) -> np.ndarray:
    """Four rooms with a door in each wall between two of them."""
    walls = np.zeros((48, 48), dtype=bool)
    walls[24, :] = walls[:, 24] = True
    for low in (0, 25):
        at = low + int(rng.integers(4, 22 - door))
        walls[24, at : at + door] = False
        at = low + int(rng.integers(4, 22 - door))
        walls[at : at + door, 24] = False
    return walls


def walk(rng: np.random.Generator, walls: np.ndarray) -> lampyris.Recorded:
    """A walker that keeps its direction for a while."""
    ys, xs = np.nonzero(~walls)
    k = int(rng.integers(len(xs)))
    x, y = int(xs[k]), int(ys[k])
    dx, dy = rng.integers(-1, 2, 2).tolist()
    track = [(x, y)]
    for _ in range(TICKS):
        if rng.random() < 0.1:
            dx, dy = rng.integers(-1, 2, 2).tolist()
        if 0 <= x + dx < 48 and 0 <= y + dy < 48 and not walls[y + dy, x + dx]:
            x, y = x + dx, y + dy
        else:
            dx, dy = rng.integers(-1, 2, 2).tolist()
        track.append((x, y))
    return lampyris.Recorded(tuple(track), radius=0.6)


NAMES = {
    "lattice-sipp 1.1": ("lattice-sipp", {}),
    "pad-sipp 1.1": ("pad-sipp", {}),
    "lattice-sipp 1.5": ("lattice-sipp", {"weight": 1.5}),
    "pad-sipp 1.5": ("pad-sipp", {"weight": 1.5}),
    "sipp": ("sipp", {}),
}
"""Planners and their settings by what the table calls them."""


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if sys.argv[1:] else 60
    door = int(sys.argv[2]) if sys.argv[2:] else 7
    rng = np.random.default_rng(26)
    ticks: dict[str, list[float]] = {name: [] for name in NAMES}
    spent: dict[str, list[float]] = {name: [] for name in NAMES}
    expanded: dict[str, list[int]] = {name: [] for name in NAMES}
    found = dict.fromkeys(NAMES, 0)
    contacts = dict.fromkeys(NAMES, 0)
    static = 0
    with compiled_only():
        for number in range(count):
            walls = rooms(rng, door)
            grid = lampyris.Grid(walls, resolution=1.0)
            ends = [
                tuple(int(v) for v in rng.integers(4, 20, 2)),
                tuple(int(v) for v in rng.integers(29, 44, 2)),
            ]
            poses = [(*grid.to_metres(cell).tolist(), float(rng.integers(4)) * np.pi / 2) for cell in ends]
            traffic = tuple(walk(rng, walls) for _ in range(WALKERS))
            robot = lampyris.Robot(footprint=OUTLINE, drive="differential")
            disc = lampyris.Robot(radius=robot.radius)
            posed = lampyris.Scene(
                grid, start_pose=poses[0], goal_pose=poses[1], robot=robot, traffic=traffic
            )
            round_ = lampyris.Scene(grid, start=ends[0], goal=ends[1], robot=disc, traffic=traffic)
            static += bool(lampyris.plan(replace(round_, traffic=()), "astar"))
            arrival = {}
            for name, (planner, settings) in NAMES.items():
                scene = round_ if planner == "sipp" else posed
                begin = time.thread_time()
                plan = lampyris.plan(scene, planner, **settings)
                if number:  # the first one loads kernels
                    spent[name].append(1e3 * (time.thread_time() - begin))
                expanded[name].append(plan.expansions)
                if plan.status is Status.FOUND:
                    verdict = check_plan(plan, scene)
                    contacts[name] += verdict is not None and verdict.rule == "contact"
                    assert verdict is None, verdict
                    found[name] += 1
                    path = plan.pose_path
                    arrival[name] = (
                        float(plan.schedule[-1]) if path is None else float(path.times[-1, 0]) * robot.v_max
                    )
            if len(arrival) == len(NAMES):
                for name, at in arrival.items():
                    ticks[name].append(at)
    print(f"{count} scenes; without walkers the disc has a path in {static}")
    for name in NAMES:
        every = f"{statistics.mean(ticks[name]):.1f} ticks" if ticks[name] else "-"
        print(
            f"{name:16} found {found[name]:3}; contacts {contacts[name]}; "
            f"arrival (mean of {len(ticks[name])} that all solve) {every}; "
            f"{statistics.median(expanded[name]):,.0f} expansions, {statistics.median(spent[name]):.1f} ms (medians)"
        )


if __name__ == "__main__":
    main()
