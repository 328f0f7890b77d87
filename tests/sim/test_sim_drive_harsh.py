"""Drives under harsh settings that went wrong once; many more are in the check ``sim``, kind ``drive``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris.io.maps.library import load
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Crossing, RandomWalk, Recorded
from lampyris.planning import registry
from lampyris.planning.graph.astar import AStar
from lampyris.referee import check_drive
from lampyris.sim.continuous.drive import drive
from lampyris.sim.traffic.adversary import Adversary
from lampyris_selfcheck.checks.traffic.sim_scenes import PROMISE, harsh_drive
from lampyris_selfcheck.reference.files.use_files import GRIDS


def harsh_run(seed: int, near: float = 25.0, **fixed: object) -> Drive | None:
    """A drive with everything at its worst; None where the obstacles do not fit."""
    return harsh_drive(np.random.default_rng((seed, 5)), seed, near, **fixed)


def judge(run: Drive | None) -> bool:
    """Whether there was a drive; it must be lawful, and no law may collide that promised not to."""
    if run is None:
        return False
    assert check_drive(run) is None
    assert run.law not in PROMISE or run.law == "blind" or run.outcome is not Outcome.COLLISION
    return True


@pytest.mark.parametrize("seed", [1573])
def test_harsh_drives_that_were_refused_once(seed):
    """1573: a command to set off arrives while an obstacle that ran into the standing robot is on it."""
    run = harsh_run(seed)
    assert run is not None
    # Obstacles are drawn in another way since: whether it still meets one there is not for this test to say.
    assert run.outcome in (Outcome.COLLISION, Outcome.ARRIVED)
    assert judge(run)


@pytest.mark.commit(1)
@pytest.mark.parametrize("seed", [16, 29, 36])
def test_ways_round_obstacles_beside_walls(seed):
    """A radius just above half a cell: obstacles beside the plan's lines were once a leave to graze walls.

    Curves ran 0.250000001 m (29), 0.055 (16) and 0.082 m (36) from walls.
    """
    grid = replace(load("env-5").grid, resolution=0.5)
    spec = (RandomWalk(6), Crossing(3))
    scene = Scene(grid, (15, 22), (4, 11), robot=Robot(radius=0.256202), traffic=spec)
    how = {"patience": 1.0, "noise": 0.05, "obstacle_info": "tracks", "on_hit": "go-on", "time_limit": 60.0}
    run = drive(scene, AStar(), seed=seed, sources=[Adversary(1.0, count=2, wait=4.0)], give_up=30.0, **how)
    assert check_drive(run) is None


def test_brakes_that_stop_within_the_rounding_of_the_clock() -> None:
    """At 1,500 m/s2 a stop takes 4e-8 s; the clock's rounding at 17 s is worth 1.2e-12 m/s of it."""
    grid = Grid(GRIDS[0])
    robot = Robot(
        radius=0.3, v_max=3.2823617466797232, a_max=1.0, d_max=1508.4520586838746,
        a_lat_max=5.947838945236971e-06, turn_radius=0.300433398115674, jerk_max=1.0,
    )  # fmt: skip
    spec = (Recorded(track=((3, 4),), radius=0.3), RandomWalk(3))
    run = drive(Scene(grid, (9, 1), (11, 3), "four-connected", robot, spec), registry.make("dstar"))
    assert check_drive(run) is None
