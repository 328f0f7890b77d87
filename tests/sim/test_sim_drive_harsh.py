"""Drives under harsh settings: whatever is asked for, each ends in an outcome that the referee believes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris.errors import SceneError
from lampyris.maps.library import load
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Crossing, Patrol, RandomWalk
from lampyris.motion.laws import LAWS
from lampyris.planners.ad_gso import AdGso
from lampyris.planners.astar import AStar
from lampyris.planners.theta_star import ThetaStar
from lampyris.referee import check_drive
from lampyris.sim.cutting import Cutter
from lampyris.sim.drive import drive

PROMISE = [law for law in LAWS if law not in ("dissertation", "rpp", "constant", "optimum")]
"""Laws that say they collide with nobody."""


def harsh_run(seed: int, near: float = 25.0, **fixed: object) -> Drive | None:
    """A drive with everything at its worst; None where the obstacles do not fit.

    Every third is on a bundled map, between two free cells at most ``near`` cells apart.
    """
    rng = np.random.default_rng((seed, 5))
    resolution = float(rng.choice([0.25, 0.5, 1.0]))
    if seed % 3 == 0:
        blocked = load(f"env-{1 + int(rng.integers(6))}").grid.blocked
    else:
        blocked = rng.random(rng.integers(8, 22, 2)) < rng.choice([0.0, 0.1, 0.2, 0.3])
    free = np.argwhere(~blocked)
    (sy, sx), *others = free[rng.integers(len(free), size=4)].tolist()
    about = free[np.abs(free - (sy, sx)).max(axis=1) <= near]
    gy, gx = about[rng.integers(len(about))].tolist()
    radius = float(rng.uniform(0, 0.45)) * float(rng.choice([0, 1, 1])) * resolution
    robot = Robot(
        radius=radius,
        v_max=float(rng.uniform(0.2, 2)),
        a_max=float(rng.uniform(0.2, 2)),
        d_max=float(rng.uniform(0.3, 2)),
        lat_max=float(rng.uniform(0.3, 2)),
        turn_radius=float(rng.choice([0, 0, rng.uniform(0, 2)])),
    )
    size = float(rng.choice([0, 0.3, 0.49])) * resolution
    rate = None if rng.random() < 0.5 else 0.5
    spec: list[RandomWalk | Crossing | Patrol] = [RandomWalk(int(rng.integers(0, 9)), rate=rate, radius=size)]
    if rng.random() < 0.5:
        spec.append(Crossing(int(rng.integers(1, 5))))
    if rng.random() < 0.4:
        spec.append(Patrol(tuple((x, y) for y, x in others), radius=size))
    cutters = [Cutter(float(rng.uniform(0.2, 2)), count=int(rng.integers(0, 4)), wait=5.0)]
    planner = (AStar(), ThetaStar(), AdGso())[int(rng.integers(3))]
    moves = str(rng.choice(["octile", "dissertation"]))
    law = str(rng.choice([*LAWS, "physical", "physical"]))
    settings: dict[str, object] = {
        "obstacle_speed": float(rng.uniform(0.1, 2)),
        "know": str(rng.choice(["positions", "velocities", "tracks"])),
        "tracking": str(rng.choice(["perfect", "velocity", "position"])),
        "period": float(rng.choice([0.05, 0.1, 0.3])),
        "command_period": None if rng.random() < 0.5 else float(rng.choice([0.05, 0.2, 0.5, 1.0])),
        "delay": float(rng.choice([0, rng.uniform(0, 0.4)])),
        "lag": float(rng.choice([0, 0.1, rng.uniform(0, 1)])),
        "noise": float(rng.choice([0, 0.05, rng.uniform(0, 0.2)])) * resolution,
        "patience": float(rng.choice([0, 0.5, 1, 5])),
        "give_up": 20.0,
        "on_hit": str(rng.choice(["end", "go-on"])),
        "smooth": str(rng.choice(["arcs", "none"])),
        "time_limit": 60.0,
        "law": law,
    } | fixed
    scene = Scene(Grid(blocked, resolution=resolution), (sx, sy), (gx, gy), moves, robot, tuple(spec))
    try:
        return drive(scene, planner, seed=seed, sources=cutters, **settings)  # type: ignore[arg-type]
    except SceneError:
        return None


def judge(run: Drive | None) -> bool:
    """Whether there was a drive; it must be lawful, and no law may collide that promised not to."""
    if run is None:
        return False
    assert check_drive(run) is None
    assert run.law not in PROMISE or run.law == "blind" or run.outcome is not Outcome.COLLISION
    return True


@pytest.mark.parametrize("block", range(8))
def test_harsh_drives_end_lawfully(block):
    assert sum(judge(harsh_run(seed)) for seed in range(7 + 4 * block, 11 + 4 * block)) >= 2


@pytest.mark.parametrize("seed", [1573])
def test_harsh_drives_that_were_refused_once(seed):
    """1573: a command to set off arrives while an obstacle that ran into the standing robot is on it."""
    run = harsh_run(seed)
    assert run is not None
    assert run.outcome is Outcome.COLLISION
    assert judge(run)


@pytest.mark.parametrize("seed", [16, 29, 36])
def test_ways_round_obstacles_beside_walls(seed):
    """A radius just above half a cell: obstacles beside the plan's lines were once a leave to graze walls.

    Curves ran 0.250000001 m (29), 0.055 (16) and 0.082 m (36) from walls.
    """
    grid = replace(load("env-5").grid, resolution=0.5)
    spec = (RandomWalk(6), Crossing(3))
    scene = Scene(grid, (15, 22), (4, 11), robot=Robot(radius=0.256202), traffic=spec)
    how = {"patience": 1.0, "noise": 0.05, "know": "tracks", "on_hit": "go-on", "time_limit": 60.0}
    run = drive(scene, AStar(), seed=seed, sources=[Cutter(1.0, count=2, wait=4.0)], give_up=30.0, **how)
    assert check_drive(run) is None


@pytest.mark.nightly
@pytest.mark.parametrize("block", range(20))
def test_harsh_drives_end_lawfully_two_thousand_times(block):
    for seed in range(1000 + 100 * block, 1100 + 100 * block):
        judge(harsh_run(seed))
