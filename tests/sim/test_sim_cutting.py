"""The adversary: where it waits, how it runs, and that it runs at the robot."""

from __future__ import annotations

import math

import numpy as np
import pytest
from test_sim_crowd_motion import line

from lampyris.errors import SettingError
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.sim.traffic.adversary import Adversary, line_is_clear, square_distances
from lampyris.sim.traffic.motion_sources import Opening, Roster, stream
from lampyris.sim.world.trajectory import CurveLookup, Segment, Trajectory


def opened(cutter, seed, blocked=None, robot=None):
    blocked = np.zeros((20, 20), dtype=bool) if blocked is None else blocked
    scene = Scene(Grid(blocked), (0, 10), (19, 10), robot=robot or Robot(radius=0.3))
    roster = Roster()
    route: CurveLookup = line((0.0, 10.0), (1.0, 0.0), 19.0)
    return cutter.open(Opening(scene, roster, stream(seed, 1), route)), roster, route, scene


@pytest.mark.nightly
def test_it_runs_straight_at_its_top_speed_off_walls():
    assert sum(runs_of(seed) for seed in range(10)) >= 10


def runs_of(seed):
    """How many of three cutters have run; everything else is held against them."""
    rng = np.random.default_rng(seed)
    blocked = rng.random((20, 20)) < 0.1
    blocked[10] = False
    running, roster, route, _ = opened(Adversary(1.5, count=3, wait=2.0), seed, blocked)
    legs = []
    for k in range(300):
        t, end = k * 0.1, (k + 1) * 0.1
        s = min(0.5 * t, 18.0)
        legs.append(running.advance(t, end, Trajectory(route, [Segment(t, end, s, 0.5, 0.0)])))
    table = np.concatenate(legs)
    assert len(roster.obstacles) == 3
    ran = 0
    for body in range(3):
        own = table[table[:, 0] == body]
        assert own[0, 1] == 0.0
        assert own[-1, 2] == pytest.approx(30.0)
        assert np.abs(own[1:, 1] - own[:-1, 2]).max() < 1e-12
        ends = own[:, 3:5] + own[:, 5:7] * (own[:, 2] - own[:, 1])[:, None]
        assert np.abs(ends[:-1] - own[1:, 3:5]).max() < 1e-9
        pace = np.sqrt((own[:, 5:7] ** 2).sum(axis=1))
        assert ((pace == 0.0) | (np.abs(pace - 1.5) < 1e-9)).all()
        assert pace.max() <= roster.top_speed[body]
        ran += int((pace > 0).any())
        away = np.abs(own[0, 3:5] - (0.0, 10.0)).max()
        assert away > 0.8
        for x, y in ends.tolist():
            gx = np.maximum(np.abs(np.argwhere(blocked)[:, 1] - x) - 0.5, 0)
            gy = np.maximum(np.abs(np.argwhere(blocked)[:, 0] - y) - 0.5, 0)
            assert np.hypot(gx, gy).min(initial=9.0) >= 0.5 - 1e-6
    tracks = roster.tracks(30.0, np.array([ends[-1]] * 3))
    assert all(t.t[-1] <= 30.0 for t in tracks)
    return ran


def test_it_meets_a_robot_that_does_not_mind():
    """Most runs come near a robot that drives on at one speed."""
    near = 0
    for seed in range(40):
        running, _, route, _ = opened(Adversary(1.0, wait=3.0, near=4.0), seed)
        least = math.inf
        for k in range(180):
            t, end = k * 0.1, (k + 1) * 0.1
            legs = running.advance(t, end, Trajectory(route, [Segment(t, end, t, 1.0, 0.0)]))
            for row in legs:
                gap = np.hypot(*(row[3:5] - route.at(row[1]))) - 0.8
                least = min(least, gap)
        near += least < 0.5
    assert near >= 10


@pytest.mark.parametrize(
    "given",
    [
        {"top_speed": 0.0},
        {"top_speed": float("inf")},
        {"count": -1},
        {"count": 1.5},
        {"wait": "long"},
        {"near": 0.0},
    ],
)
def test_settings_that_are_none(given):
    with pytest.raises(SettingError, match="CUTTER"):
        Adversary(**{"top_speed": 1.0, **given})


def test_lines_and_squares_against_a_slow_look():
    rng = np.random.default_rng(0)
    for _ in range(300):
        a, b = rng.uniform(0, 6, 2), rng.uniform(0, 6, 2)
        xs, ys = rng.integers(0, 7, 4).astype(float), rng.integers(0, 7, 4).astype(float)
        got = np.sqrt(square_distances(tuple(a), tuple(b), xs, ys))
        points = a + np.linspace(0, 1, 2001)[:, None] * (b - a)
        gx = np.maximum(np.abs(points[:, :1] - xs) - 0.5, 0)
        gy = np.maximum(np.abs(points[:, 1:] - ys) - 0.5, 0)
        slow = np.hypot(gx, gy).min(axis=0)
        assert (got <= slow + 1e-12).all()
        assert (got >= slow - 5e-3).all()


def test_a_line_beside_a_wall():
    blocked = np.zeros((5, 5), dtype=bool)
    blocked[2, 2] = True
    assert line_is_clear(blocked, (0.0, 1.0), (4.0, 1.0), 0.5)
    assert not line_is_clear(blocked, (0.0, 1.0), (4.0, 1.0), 0.51)
    assert not line_is_clear(blocked, (0.0, 2.0), (4.0, 2.0), 0.0)
    assert not line_is_clear(blocked, (0.0, 0.0), (5.0, 0.0), 0.1)  # off the map
