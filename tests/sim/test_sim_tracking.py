"""Late commands: what they cost, and that they never cost safety or the robot's limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from sim_planners import grid_of
from test_sim_drive import random_run

from lampyris.io.maps.library import load
from lampyris.model.drive import AT_GOAL
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import RandomWalk
from lampyris.planning.graph.astar import AStar
from lampyris.referee import check_drive
from lampyris.sim.continuous.drive import DriveSimulation, drive
from sizes import some

ROOM = grid_of(*["." * 30] * 12)
SCENE = Scene(ROOM, (1, 2), (28, 9), robot=Robot(radius=0.3, v_max=1.0, a_max=0.6, d_max=1.0))


@pytest.mark.nightly
@pytest.mark.parametrize("tracking", ["velocity", "position"])
@pytest.mark.parametrize(("period", "delay"), some([(0.25, 0.1), (0.1, 0.0), (1.0, 0.5)]))
def test_late_commands_collide_with_nobody(tracking, period, delay):
    ends = []
    for seed in range(28):
        run = random_run(seed, tracking=tracking, command_period=period, delay=delay)
        if run is not None:
            assert check_drive(run) is None
            assert run.period == period
            ends.append(run.outcome)
    assert Outcome.COLLISION not in ends
    assert ends.count(Outcome.ARRIVED) >= (15 if period < 1.0 else 5)


@pytest.mark.parametrize("tracking", ["velocity", "position"])
def test_the_goal_is_reached_exactly(tracking):
    for period, delay, lag in ((0.05, 0.0, 0.0), (0.5, 0.3, 0.1), (1.0, 0.5, 0.4)):
        run = drive(SCENE, AStar(), tracking=tracking, command_period=period, delay=delay, lag=lag)
        assert run.outcome is Outcome.ARRIVED
        assert run.v[-1] == 0.0
        assert np.abs(run.at(np.array([run.duration]))[0] - (28.0, 9.0)).max() < 1e-8
        assert run.error > 0.0
        assert check_drive(run) is None


@pytest.mark.commit(1)
@pytest.mark.parametrize("tracking", ["velocity", "position"])
def test_the_last_command_lands(tracking):
    """A slow drive goes the last bit to the goal and to stops; it does not halve what is left for ever.

    Before it did so this drive by speeds stood 1e-7 cells short of its goal at the time limit, and the one
    with stops never came past the first.
    """
    how = {"tracking": tracking, "lag": 1.0, "delay": 0.1, "period": 0.05}
    robot = Robot(v_max=0.345)
    env = replace(load("env-1").grid, resolution=0.5)
    run = drive(Scene(env, (33, 22), (19, 42), robot=robot), AStar(), seed=739, **how)
    assert run.outcome is Outcome.ARRIVED
    assert run.s[-1] == run.curves[-1].length
    assert run.duration < run.optimum + 8.0
    assert check_drive(run) is None
    stiff = replace(robot, turn_radius=0.7)  # no arc within half a step is as wide
    run = drive(Scene(env, (33, 22), (19, 42), robot=stiff), AStar(), smooth="none", **how)
    stops = run.curves[0].stops
    assert run.outcome is Outcome.ARRIVED
    assert len(stops) >= 2
    assert run.duration < run.optimum + 8.0 * (1 + len(stops))
    assert check_drive(run) is None


def test_arrived_is_one_tolerance():
    """The simulation's "at the goal" is the referee's (tests/referee/test_referee_drive_places.py)."""
    one = DriveSimulation(Scene(ROOM, (1, 2), (28, 2)), AStar())
    end = one.state.leg.route.length
    assert one._at_goal(end - 0.9 * AT_GOAL)
    assert not one._at_goal(end - 1.1 * AT_GOAL)


def test_perfect_tracking_has_no_error():
    run = drive(SCENE, AStar())
    assert run.error == 0.0
    assert run.period == 0.1
    assert drive(SCENE, AStar(), command_period=0.7).period == 0.1  # says nothing when tracking is perfect


def test_delay_costs_error_and_speed_control_more_than_place_control():
    """At 10 commands a second and v = 1 m/s, a delay D alone is v D metres."""
    errors = {}
    for tracking in ("velocity", "position"):
        for delay in (0.0, 0.2, 0.4):
            run = drive(SCENE, AStar(), tracking=tracking, command_period=0.1, delay=delay)
            errors[tracking, delay] = run.error
            assert 0.5 * delay < run.error < delay + 0.5
    for tracking in ("velocity", "position"):
        assert errors[tracking, 0.0] < errors[tracking, 0.2] < errors[tracking, 0.4]


def test_the_error_is_what_the_story_says():
    """Speed control without delay lags its commands by lag + about half a step; never by more than both."""
    run = drive(SCENE, AStar(), tracking="velocity", command_period=0.1, lag=0.2)
    perfect = drive(SCENE, AStar())
    t = np.linspace(0.0, perfect.duration, 2000)
    between = np.sqrt(((run.at(t)[0] - perfect.at(t)[0]) ** 2).sum(axis=1)).max()
    assert run.error == pytest.approx(between, abs=0.3)


@pytest.mark.nightly
def test_the_margin_grows_with_the_delay():
    """Among walkers the robot keeps farther away the later its commands are, and takes longer."""
    scene = Scene(ROOM, (1, 2), (28, 9), robot=SCENE.robot, traffic=(RandomWalk(12),))
    mean = []
    for delay in (0.0, 0.25, 0.5):
        runs = [
            drive(
                scene, AStar(), seed=seed, tracking="velocity", command_period=0.1, delay=delay, give_up=200.0
            )
            for seed in range(3)
        ]
        assert all(r.outcome is not Outcome.COLLISION for r in runs)
        mean.append(np.mean([r.duration for r in runs]))
    assert mean[0] < mean[1] < mean[2]
