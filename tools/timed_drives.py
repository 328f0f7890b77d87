"""Drives among walkers with known tracks: those that follow planned times, and those whose planner knows no times.

    python tools/timed_drives.py [SCENES [DOOR]]

The scenes of tools/timed_poses.py with cells of 0.5 m; top speed 1 m/s, 1 m/s2. The law ``physical`` promises no contact
while the robot moves, whatever it knows; ``optimum`` looks at no obstacle, so that the planned times alone keep it off them.
Every drive is checked by the referee.
"""

from __future__ import annotations

import statistics
import sys
from typing import Any

import numpy as np

import lampyris
from lampyris.errors import SceneError
from lampyris.kernels._jit import compiled_only
from lampyris.referee.drive import check_drive, measure
from timed_poses import OUTLINE, WALKERS, rooms, walk

TURN = {"turn_cost": 1.4}
"""A turn in place as slow as the farthest point of the robot, which is 1.34 m away, allows."""
KINDS: dict[str, tuple[str, dict[str, Any], dict[str, Any]]] = {
    "lattice": ("lattice", {"weight": 1.1, **TURN}, {}),
    "lattice-sipp": ("lattice-sipp", TURN, {}),
    "lattice-sipp 0.6": ("lattice-sipp", {"speed_fraction": 0.6, **TURN}, {}),
    "pad-sipp 0.6": ("pad-sipp", {"speed_fraction": 0.6, **TURN}, {}),
    "lattice, optimum": ("lattice", {"weight": 1.1, **TURN}, {"law": "optimum"}),
    "lattice-sipp 0.8, optimum": ("lattice-sipp", {"speed_fraction": 0.8, **TURN}, {"law": "optimum"}),
}
"""Planner, its settings and those of the drive, by what the table calls them."""


def main() -> None:
    """Print the table."""
    count = int(sys.argv[1]) if sys.argv[1:] else 40
    door = int(sys.argv[2]) if sys.argv[2:] else 7
    rng = np.random.default_rng(26)
    drives: dict[str, list[lampyris.Drive]] = {name: [] for name in KINDS}
    contacts = dict.fromkeys(KINDS, 0)
    left_out = 0
    with compiled_only():
        for number in range(count):
            walls = rooms(rng, door)
            grid = lampyris.Grid(walls, resolution=0.5)
            ends = [rng.integers(4, 20, 2), rng.integers(29, 44, 2)]
            poses = [(*grid.to_metres(end).tolist(), float(rng.integers(4)) * np.pi / 2) for end in ends]
            traffic = tuple(walk(rng, walls) for _ in range(WALKERS))
            traffic = tuple(lampyris.Recorded(one.track, radius=0.25) for one in traffic)
            robot = lampyris.Robot(
                footprint=[(x / 2, y / 2) for x, y in OUTLINE], v_max=1.0, a_max=1.0, d_max=1.0
            )
            scene = lampyris.Scene(
                grid, start_pose=poses[0], goal_pose=poses[1], robot=robot, traffic=apart(traffic)
            )
            try:
                for name, (planner, settings, own) in KINDS.items():
                    drive = lampyris.drive(
                        scene,
                        planner,
                        seed=number,
                        planner_settings=settings,
                        on_hit="go-on",
                        time_limit=150.0,
                        **own,
                    )
                    assert check_drive(drive) is None, check_drive(drive)
                    contacts[name] += measure(drive)["collisions"]
                    drives[name].append(drive)
            except SceneError:
                left_out += 1
                for made in drives.values():
                    del made[number - left_out + 1 :]
    every = [k for k in range(count - left_out) if all(made[k].arrived for made in drives.values())]
    print(
        f"{count - left_out} scenes ({left_out} left out: walkers that a drive does not take); all arrive in {len(every)}"
    )
    for name, made in drives.items():
        seconds = statistics.mean(made[k].duration for k in every) if every else float("nan")
        hits = sum(moment.word == "hit" for one in made for moment in one.moments)
        late = [float(one.lateness[-1]) for one in made if one.lateness is not None and one.arrived]
        said = (
            f"; at the end {statistics.median(late):.2f} s late (median; at most {max(late):.1f})"
            if late
            else ""
        )
        print(
            f"{name:26} arrived {sum(one.arrived for one in made)}, contacts while moving {contacts[name]}, run into "
            f"{hits} times; {seconds:.1f} s; {sum(one.replans for one in made)} new paths{said}"
        )


def apart(traffic: tuple[lampyris.Recorded, ...]) -> tuple[lampyris.Recorded, ...]:
    """Those whose tracks never come near each other."""
    kept: list[lampyris.Recorded] = []
    for one in traffic:
        here = np.array(one.track)
        if all(np.abs(here - np.array(other.track)).max(axis=1).min() > 2 for other in kept):
            kept.append(one)
    return tuple(kept)


if __name__ == "__main__":
    main()
