"""Arrivals among walkers with known tracks: the footprint by lattice-sipp, and the disc around it by sipp.

    python tools/timed_poses.py [SCENES [DOOR]]

Random rooms of 48 x 48 cells with doors, 8 walkers each. Both robots drive a cell in a tick. Of scenes that both solve,
the ticks of arrival; each answer is checked by the referee. Processor time of the call, map included.
"""

from __future__ import annotations

import statistics
import sys
import time

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


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if sys.argv[1:] else 60
    door = int(sys.argv[2]) if sys.argv[2:] else 7
    rng = np.random.default_rng(26)
    ticks: dict[str, list[float]] = {"lattice-sipp": [], "sipp": []}
    spent: dict[str, list[float]] = {name: [] for name in ticks}
    found = dict.fromkeys(ticks, 0)
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
            scenes = {
                "lattice-sipp": lampyris.Scene(
                    grid, start_pose=poses[0], goal_pose=poses[1], robot=robot, traffic=traffic
                ),
                "sipp": lampyris.Scene(grid, start=ends[0], goal=ends[1], robot=disc, traffic=traffic),
            }
            static += bool(
                lampyris.plan(lampyris.Scene(grid, start=ends[0], goal=ends[1], robot=disc), "astar")
            )
            arrival = {}
            for name, scene in scenes.items():
                begin = time.thread_time()
                plan = lampyris.plan(scene, name)
                if number:  # the first one loads kernels
                    spent[name].append(1e3 * (time.thread_time() - begin))
                if plan.status is Status.FOUND:
                    assert check_plan(plan, scene) is None
                    found[name] += 1
                    path = plan.pose_path
                    arrival[name] = (
                        float(plan.schedule[-1]) if path is None else float(path.times[-1, 0]) * robot.v_max
                    )
            if len(arrival) == 2:
                for name, at in arrival.items():
                    ticks[name].append(at)
    print(f"{count} scenes; without walkers the disc has a path in {static}")
    for name in ticks:
        both = f"{statistics.mean(ticks[name]):.1f} ticks" if ticks[name] else "-"
        print(
            f"{name:13} found {found[name]:3}; arrival (mean of {len(ticks[name])} that both solve) {both}; "
            f"{statistics.median(spent[name]):.1f} ms (median)"
        )


if __name__ == "__main__":
    main()
