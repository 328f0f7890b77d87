"""Obstacles of a drive never overlap each other, at any time between two ticks either."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from test_sim_crowd_motion import line

from lampyris.io.maps.library import load
from lampyris.model.grid import Grid
from lampyris.model.obstacles import Track
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, Patrol, RandomWalk, Recorded
from lampyris.planning.incremental.dstar_lite import DStarLite
from lampyris.referee import check_drive
from lampyris.sim.continuous.drive import drive
from lampyris.sim.traffic.continuous_traffic import TrafficMotion
from lampyris.sim.traffic.motion_sources import Roster
from lampyris.sim.traffic.separation import Motions, beside_lanes
from lampyris.sim.world.cell_index import CellIndex
from lampyris.sim.world.trajectory import Trajectory, split
from sizes import some


def least_gap(tracks: list[Track], resolution: float, end: float, given: frozenset[int] = frozenset()):
    """The least gap between two rims, from every time at which somebody turns; metres and which two."""
    best = (np.inf, -1, -1, 0.0)
    for i, a in enumerate(tracks):
        for j, b in enumerate(tracks[:i]):
            if i in given and j in given:
                continue
            begin = max(a.t[0], b.t[0])
            times = np.unique(np.concatenate(([begin, end], a.t, b.t)))
            times = times[(times >= begin) & (times <= end)]
            way = (a.at(times) - b.at(times)) * resolution
            for p, q, t in zip(way[:-1], way[1:], times, strict=False):
                v = q - p
                share = np.clip(-(p @ v) / (v @ v), 0.0, 1.0) if v @ v > 0.0 else 0.0
                gap = float(np.hypot(*(p + share * v))) - a.radius - b.radius
                best = min(best, (gap, i, j, float(t)))
    return best


def test_the_drive_that_was_reported() -> None:
    """``lampyris drive env-3 --obstacles 20 --seed 1``: two centres were 0.447 m apart at 24.4 s."""
    found = load("env-3")
    scene = Scene(found.grid, found.start, found.goal, traffic=(RandomWalk(20),))
    run = drive(scene, DStarLite(), seed=1)
    assert check_drive(run) is None
    assert least_gap(list(run.tracks), 1.0, run.duration)[0] >= -1e-9


CROWDS = {
    "walkers": (RandomWalk(14),),
    "walkers that appear": (RandomWalk(16, rate=0.9),),
    "crossing": (Crossing(6),),
    "patrols": (
        Patrol(((1, 1), (10, 1), (10, 6), (1, 6))), Patrol(((10, 6), (1, 1))), Patrol(((1, 6), (10, 0))),
        Patrol(((5, 0), (5, 7))),
    ),
    "sized": (RandomWalk(4, radius=0.4), RandomWalk(2, radius=1.1), Crossing(1, radius=0.7)),
    "all": (RandomWalk(6), RandomWalk(4, rate=0.5), Crossing(3), Patrol(((1, 1), (10, 1), (10, 6)))),
    "recorded": (
        Recorded(((3, 3), (4, 4), (5, 3), (6, 4), (6, 5), (5, 5), (4, 4), (3, 3)), radius=0.3),
        RandomWalk(12), Crossing(2),
    ),
}  # fmt: skip


@pytest.mark.commit(5)
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("kind", CROWDS)
def test_no_two_obstacles_overlap_whatever_the_robot_does(kind: str, seed: int) -> None:
    """A robot that drives through the crowd and stops now and then, so that obstacles halt in mid-step."""
    rng = np.random.default_rng([11, seed])
    resolution = float(rng.choice([0.25, 1.0]))
    blocked = rng.random((8, 12)) < (
        0.1 if seed % 2 and kind not in ("patrols", "sized", "all", "recorded") else 0.0
    )
    blocked[3] = False
    grid = Grid(blocked, resolution=resolution)
    robot = Robot(radius=float(rng.choice([0.0, 0.3, 0.45])) * resolution, v_max=resolution)
    traffic = tuple(
        type(one)(**{**{f: getattr(one, f) for f in one.__slots__}, "radius": one.radius * resolution})
        for one in CROWDS[kind]
    )
    moves = "dissertation" if seed % 3 == 0 else "octile"
    scene = Scene(grid, (0, 3), (11, 3), moves, robot, traffic)
    roster = Roster()
    speed = float(rng.choice([0.3, 1.0, 3.0])) * resolution
    crowd = TrafficMotion(speed, seed).open(scene, roster)
    route = line((0.0, 3.0), (1.0, 0.0), 11.0 * resolution, resolution)
    s, v, until, push, end = 0.0, 0.0, 0, 0.5, 0.0
    for k in range(250):
        t, end = k * 0.1, (k + 1) * 0.1
        if k >= until:
            until, push = k + int(rng.integers(3, 25)), float(rng.choice([0.5, 0.5, -1.0, -1.0])) * resolution
        going = Trajectory(route, split(t, end, s, v, push if v < resolution or push < 0.0 else 0.0, None))
        crowd.advance(t, end, going)
        s, v = going.segments[-1].after(end)
        if s > 11.0 * resolution:
            s = 0.0
    tracks = list(roster.tracks(end, crowd.at))
    given = frozenset(k for k, body in enumerate(roster.obstacles) if body.kind == "recorded")
    gap, i, j, t = least_gap(tracks, resolution, end, given)
    assert gap >= -1e-9 * max(1.0, resolution), (i, j, t)
    pace = [np.hypot(*np.diff(one.xy, axis=0).T) * resolution / np.diff(one.t) for one in tracks]
    assert all((one <= crowd.top_speed * (1 + 1e-9)).all() for one in pace)
    moved = sum(len(np.unique(one.xy, axis=0)) > 1 for one in tracks)
    assert moved >= len(tracks) / 2  # they do not just stand


def test_a_step_is_clear_of_who_stands_and_of_who_moves() -> None:
    motions = Motions()
    for x, y in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0)):
        motions.add(x, y, 0.5)
    assert not motions.clear(0, (1.0, 0.0))  # where another one stands
    assert not motions.clear(0, (1.0, 1.0))
    motions.to[1] = (2.0, 0.0)
    assert motions.clear(0, (1.0, 0.0))  # behind one that goes straight on
    assert not motions.clear(2, (1.0, 0.0))  # round the corner they come within 0.71 of each other
    assert motions.clear(2, (1.0, 2.0))
    assert not motions.clear(0, (1.0, 1.0))


def test_two_that_come_towards_each_other_see_each_other_from_both_steps_away() -> None:
    motions = Motions()
    for x in (0.0, 3.0):
        motions.add(x, 0.0, 0.6)
    motions.to[1] = (2.0, 0.0)
    assert motions.near(0) == [1]
    assert not motions.clear(0, (1.0, 0.0))


def test_who_meets_a_halted_one_halts_and_so_on_down_the_line() -> None:
    motions = Motions()
    for x in range(5):
        motions.add(float(x), 0.0, 0.5)
    motions.begin([(float(x), 0.0) for x in range(5)])
    motions.to = [(x + 1.0, 0.0) for x in range(5)]
    motions.to[4] = motions.at[4]
    assert motions.settle({4}) == {0, 1, 2, 3}


@pytest.mark.nightly
@pytest.mark.parametrize("seed", some(range(10), 3))
def test_beside_a_lane_every_step_between_open_cells_is_clear_of_it(seed: int) -> None:
    """The rule of cells and corners is as good as looking at each step."""
    rng = np.random.default_rng([5, seed])
    track = [(6, 6)]
    for _ in range(8):
        dx, dy = (int(v) for v in rng.integers(-1, 2, 2))
        track.append((min(max(track[-1][0] + dx, 0), 12), min(max(track[-1][1] + dy, 0), 12)))
    radius, size = (float(rng.choice([0.5, 0.6, 0.9, 1.3, 2.0])) for _ in range(2))
    space = CellIndex(Grid(np.zeros((13, 13), dtype=bool)))
    barred = beside_lanes(space, [Recorded(tuple(track), size)], radius, 1.0)
    lane = Motions()
    for a, b in pairwise(track):
        lane.add(float(a[0]), float(a[1]), max(size, 0.5))
        lane.to[-1] = (float(b[0]), float(b[1]))
    for y in range(13):
        for x in range(13):
            for dx in (-1, 0, 1):
                for dy in (-1, 0, 1):
                    u, w = x + dx, y + dy
                    if not (0 <= u < 13 and 0 <= w < 13) or barred[y, x] or barred[w, u]:
                        continue
                    if dx and dy and (barred[y, u] or barred[w, x]):
                        continue
                    for share in np.linspace(0.0, 1.0, 9):
                        px, py = x + share * dx, y + share * dy
                        for (ax, ay), (bx, by) in zip(lane.at, lane.to, strict=True):
                            q, d = np.array([px - ax, py - ay]), np.array([bx - ax, by - ay])
                            along = np.clip(q @ d / (d @ d), 0.0, 1.0) if d @ d else 0.0
                            assert np.hypot(*(q - along * d)) >= radius + max(size, 0.5) - 1e-9
