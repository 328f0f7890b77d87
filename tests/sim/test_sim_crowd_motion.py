"""The tick model's traffic in continuous time: legs without a gap, at stated speeds, giving way."""

from __future__ import annotations

import numpy as np
import pytest
from sim_planners import grid_of

from lampyris.errors import SettingError
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.sim.traffic.continuous_traffic import TrafficMotion
from lampyris.sim.traffic.motion_sources import Roster
from lampyris.sim.world.trajectory import CurveLookup, Segment, Trajectory, split
from sizes import some

ROOM = grid_of(*["." * 12] * 12)


def line(xy, heading, length, resolution=1.0):
    end = (xy[0] + heading[0] * length / resolution, xy[1] + heading[1] * length / resolution)
    return CurveLookup(
        Curve(np.array([xy]), np.array([heading]), np.array([length]), np.zeros(1), end, resolution)
    )


def standing(route, t, end):
    return Trajectory(route, [Segment(t, end, 0.0, 0.0, 0.0)])


def run(scene, seconds, *, speed=None, seed=0, period=0.1, going=None, roster=None):
    """All legs, with the crowd and the roster."""
    roster = Roster() if roster is None else roster
    crowd = TrafficMotion(speed, seed).open(scene, roster)
    route = line((float(scene.start[0]), float(scene.start[1])), (1.0, 0.0), 5.0)
    legs = []
    for k in range(round(seconds / period)):
        t, end = k * period, (k + 1) * period
        legs.append(crowd.advance(t, end, standing(route, t, end) if going is None else going(t, end)))
    return np.concatenate(legs), crowd, roster


def at(legs, body, t):
    row = legs[(legs[:, 0] == body) & (legs[:, 1] <= t) & (t <= legs[:, 2] + 1e-12)][-1]
    return row[3:5] + row[5:7] * (t - row[1])


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("period", [0.07, 0.4, 3.0])
def test_legs_follow_one_another_at_stated_speeds(seed, period):
    rng = np.random.default_rng(seed)
    blocked = rng.random((12, 12)) < 0.15
    blocked[0, 0] = blocked[11, 11] = False
    grid = Grid(blocked, resolution=0.5)
    spec = (RandomWalk(3), RandomWalk(2, rate=0.5), Crossing(1))
    scene = Scene(grid, (0, 0), (11, 11), robot=Robot(v_max=2.0), traffic=spec)
    route = line((0.0, 0.0), (1.0, 0.0), 5.0, 0.5)
    legs, crowd, roster = run(
        scene, 12.0, speed=1.0, seed=seed, period=period, going=lambda t, end: standing(route, t, end)
    )
    assert crowd.tick == 0.5
    for body in range(len(roster.obstacles)):
        own = legs[legs[:, 0] == body]
        assert (own[1:, 1] == own[:-1, 2]).all()
        ends = own[:, 3:5] + own[:, 5:7] * (own[:, 2] - own[:, 1])[:, None]
        assert np.abs(ends[:-1] - own[1:, 3:5]).max(initial=0.0) < 1e-12
        pace = np.sqrt((own[:, 5:7] ** 2).sum(axis=1)) * 0.5
        assert pace.max() <= roster.top_speed[body] == crowd.top_speed
        assert roster.radius[body] == 0.25


@pytest.mark.parametrize("seed", range(5))
def test_far_from_the_robot_it_is_the_tick_model(seed):
    """Crossing obstacles step as the tick model's do, one cell a tick, whatever the period."""
    from sim_planners import Scripted, fail

    from lampyris.sim.grid.loop import run as run_ticks

    track = Recorded(((0, 5), (0, 6), (1, 7)))
    scene = Scene(ROOM, (6, 0), (6, 11), traffic=(track,) if seed == 0 else (Crossing(1),))
    trace = run_ticks(scene, Scripted((fail(),)), seed=seed, ticks=15)
    legs, _, roster = run(scene, 15.0, speed=1.0, seed=seed, period=0.3)
    for tick in range(15):
        here = [
            tuple(at(legs, b, float(tick) + 1e-9).round(6).tolist()) for b in range(len(roster.obstacles))
        ]
        assert here == [(float(x), float(y)) for x, y in trace.obstacles_at(tick)]
    assert seed or roster.whole[0].xy.tolist() == [[0, 5], [0, 6], [1, 7]]
    assert [b.kind for b in roster.obstacles] == [b.kind for b in trace.obstacle_specs]


@pytest.mark.commit(1)
@pytest.mark.parametrize("seed", some(range(30), 10))
def test_who_yields_never_runs_into_a_robot_that_stands(seed):
    """A robot that drives through a small room full of walkers and patrols, and stands now and then."""
    rng = np.random.default_rng(seed)
    grid = Grid(np.zeros((5, 14), dtype=bool), resolution=1.0)
    robot = Robot(radius=float(rng.choice([0.0, 0.2, 0.45])), v_max=1.0)
    spec = (RandomWalk(8), Patrol(((1, 4), (12, 4), (12, 0), (1, 0))), RandomWalk(1, radius=0.7))
    scene = Scene(grid, (0, 2), (13, 2), robot=robot, traffic=spec)
    roster = Roster()
    crowd = TrafficMotion(float(rng.choice([0.3, 1.0, 3.0])), seed).open(scene, roster)
    route = line((0.0, 2.0), (1.0, 0.0), 13.0)
    s, v, clear, until, push = 0.0, 0.0, {}, 0, 0.5
    for k in range(400):
        t, end = k * 0.1, (k + 1) * 0.1
        if k >= until:
            until, push = k + int(rng.integers(3, 25)), float(rng.choice([0.5, 0.5, -1.0, -1.0]))
        going = Trajectory(route, split(t, end, s, v, push if v < 1.0 or push < 0.0 else 0.0, None))
        legs = crowd.advance(t, end, going)
        s, v = going.segments[-1].after(end)
        if s > 12.0:
            break
        for row in legs:
            body = int(row[0])
            reach = (roster.radius[body] + robot.radius) - 1e-9
            for u in np.linspace(0.0, 1.0, 5):
                when = row[1] + u * (row[2] - row[1])
                where, fast = going.at(when)
                gap = np.hypot(*(row[3:5] + row[5:7] * (when - row[1]) - route.at(where))) - reach
                # Once clear of a robot that stands, it stays clear.
                assert fast > 0.0 or gap > 0.0 or not clear.get(body, True)
                clear[body] = gap > 0.0


def test_who_is_halted_goes_back_and_who_waits_goes_on():
    """A patrol in a lane is cut off in the middle of its step, turns back, and comes again later."""
    scene = Scene(
        grid_of("........."), (0, 0), (8, 0), robot=Robot(radius=0.4), traffic=(Patrol(((7, 0), (2, 0))),)
    )
    route = line((0.0, 0.0), (1.0, 0.0), 7.0)
    roster = Roster()
    crowd = TrafficMotion(1.0, 0).open(scene, roster)
    place = 0.0
    seen = []
    for k in range(120):
        t, end = k * 0.1, (k + 1) * 0.1
        if k == 23:
            place = 3.2  # it is somewhere between (5, 0) and (4, 0)
        if k == 70:
            place = 0.0
        legs = crowd.advance(t, end, Trajectory(route, [Segment(t, end, place, 0.0, 0.0)]))
        row = legs[-1]
        seen.append(float(row[3] + row[5] * (row[2] - row[1])))
    assert min(seen[23:70]) > 4.1  # it never came on
    assert max(seen[30:70]) >= 5.0 - 1e-9  # and went back
    assert min(seen[70:]) < 2.1  # then came again


@pytest.mark.commit(6)
@pytest.mark.parametrize("seed", range(20))
def test_a_patrol_that_is_cut_off_at_the_end_of_its_route_keeps_to_it(seed):
    """A robot that jumps to and fro in front of it; the patrol is late, turns, goes back, at any time."""
    rng = np.random.default_rng(seed)
    scene = Scene(
        grid_of("....."), (0, 0), (4, 0), robot=Robot(radius=0.2), traffic=(Patrol(((3, 0), (1, 0))),)
    )
    route, roster = line((0.0, 0.0), (1.0, 0.0), 4.0), Roster()
    crowd = TrafficMotion(1.0, 0).open(scene, roster)
    shuttle = crowd.traffic.drivers[0]
    for k in range(600):
        t, end = k * 0.1, (k + 1) * 0.1
        place = float(rng.choice([0.0, 1.6, 2.4, 4.0]))
        crowd.advance(t, end, Trajectory(route, [Segment(t, end, place, 0.0, 0.0)]))
        assert shuttle.route[shuttle.at] == crowd.world.where[0]
        assert 0.9 <= roster.corners[0][-1][1] <= 3.1


@pytest.mark.parametrize("speed", [0.0, -1.0, float("nan"), "fast", True])
def test_speeds_that_are_none(speed):
    with pytest.raises(SettingError, match="OBSTACLE_SPEED"):
        TrafficMotion(speed, 0).open(Scene(ROOM, (0, 0), (1, 0)), Roster())
