"""The robot's speed tick by tick, and the dissertation's example driven through."""

from __future__ import annotations

import numpy as np
import pytest
from sim_planners import Breadth, Scripted, drive, grid_of, row

from lampyris.io.maps import library
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Recorded
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.sim.grid.loop import run
from lampyris_selfcheck.reference.motion.sim_monitor import Monitor


@pytest.mark.parametrize("law", ["physical", "dissertation"])
def test_on_a_still_map_the_speeds_are_the_profile_of_the_path(law):
    """Tick by tick, with a way cut at the horizon, must give what one profile of the whole path gives."""
    rng = np.random.default_rng(5)
    for seed in range(8):
        blocked = rng.random((25, 25)) < 0.2
        blocked[0, 0] = blocked[24, 24] = False
        robot = Robot(v_max=3.0, a_max=0.7, d_max=0.9) if seed % 2 else Robot()
        scene = Scene(Grid(blocked), (0, 0), (24, 24), "dissertation", robot)
        trace = run(scene, Breadth(), law=law)
        if not trace.arrived:
            continue
        whole = laws.profile(trace.path, scene, law=law)
        assert trace.law == law
        assert trace.units == whole.units
        assert trace.speed.tolist() == pytest.approx(whole.v.tolist(), rel=1e-12, abs=1e-12)
        assert trace.cause == whole.cause


def test_it_stands_while_it_waits_and_starts_again_from_rest():
    # Shut from tick 4 on, when the robot drives; opened at tick 9.
    track = ((9, 1),) * 4 + ((8, 0),) + ((7, 0),) * 5 + ((8, 1), (9, 2))
    grid = grid_of("............", "............", "............")
    scene = Scene(grid, (0, 0), (11, 0), traffic=Recorded(track))
    trace = run(scene, Scripted((drive(row(0, 0, 11)),)), law="dissertation")
    waiting = [t for t, c in enumerate(trace.cause) if c == "waiting"]
    assert waiting
    assert all(trace.speed[t] == 0 for t in waiting)
    assert trace.speed[max(waiting) + 1] <= 20
    assert trace.speed[min(waiting) - 1] > 0
    rise = np.diff(trace.speed)
    assert rise.max() <= 28


def test_a_near_obstacle_slows_the_robot_down():
    grid = Grid(np.zeros((9, 30), dtype=bool))
    alone = run(Scene(grid, (0, 4), (29, 4)), Scripted((drive(row(4, 0, 29)),)), law="dissertation")
    track = ((15, 5),)
    near = run(
        Scene(grid, (0, 4), (29, 4), traffic=Recorded(track)),
        Scripted((drive(row(4, 0, 29)),)),
        law="dissertation",
    )
    assert alone.speed[15] == 80
    assert near.speed[14:17].tolist() == [74.0] * 3
    assert near.cause[15] == "ring 1"


# ---- the guide ---------------------------------------------------------------------------------------------


def test_the_guide_with_an_obstacle_that_enters_7_1():
    """12.4 alone; 13.2 when one enters (7, 1) once the robot stands on (7, 2) (method.md, "The walk")."""
    guide = library.load("guide")
    planner = registry.make("ad-gso", {})
    scene = Scene(guide.grid, (0, 9), (7, 0), "dissertation")
    calm = run(scene, planner)
    assert calm.cost == pytest.approx(12.4)
    assert calm.iterations == 4
    assert calm.robot[8].tolist() == [7, 2]
    # It comes from (8, 2), beside the way, and enters (7, 1) in the tick after the robot has come to (7, 2).
    track = ((9, 3),) * 8 + ((8, 2), (7, 1), (7, 1))
    trace = run(Scene(guide.grid, (0, 9), (7, 0), "dissertation", traffic=Recorded(track)), planner)
    assert trace.outcome is Outcome.ARRIVED
    assert [tuple(c) for c in trace.robot.tolist()] == [
        (0, 9), (1, 8), (2, 7), (3, 7), (4, 6), (5, 5), (5, 4), (6, 3), (7, 2), (6, 1), (7, 0),
    ]  # fmt: skip
    assert trace.cost == pytest.approx(13.2)
    assert (trace.replans, trace.waits) == (1, 0)
    assert Monitor(trace).faults() == []
