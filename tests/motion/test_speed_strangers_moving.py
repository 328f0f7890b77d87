"""Curves and moving obstacles under a stranger's hands: what is promised, held against brute force.

Curves are judged by the referee's own lines and arcs; pushes and caps by looking at 300 moments of the
braking that follows, with obstacles that come from anywhere; ways through tracks by the referee of drives.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pushes import push
from test_speed_strangers import bent_curve

from lampyris.errors import LampyrisError, SettingError
from lampyris.model.curve import Curve
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates, Track
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import Obstacle
from lampyris.motion.cap_values import Around
from lampyris.motion.geometry.curve import curve_of
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.profile import feasible_profile
from lampyris.motion.safety.moving_obstacles import MovingObstacles, moving_cap
from lampyris.motion.safety.passive_acceleration import rails_of
from lampyris.motion.timing.path_time import through_tracks
from lampyris.referee import check_drive
from lampyris.referee.geometry.lines_and_arcs import joins, nearest_wall, segment_to_squares

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "referee"))
from drive_builders import random_curve

from sizes import sized

NAN = float("nan")


# ---- curves ------------------------------------------------------------------------------------------


def free_polyline(rng: np.random.Generator, blocked: np.ndarray, most: int) -> np.ndarray:
    """Up to ``most`` points anywhere on the map whose lines enter no blocked square; some repeat."""
    height, width = blocked.shape
    x, y = np.nonzero(blocked.T)
    points: list[np.ndarray] = []
    for _ in range(200):
        kind = rng.random()
        p = rng.uniform((-0.5, -0.5), (width - 0.5, height - 0.5))
        if kind < 0.6:
            p = np.clip(np.rint(p), 0, (width - 1, height - 1))
        elif kind < 0.7:
            p = np.clip(np.rint(p) + 0.5, -0.5, (width - 0.5, height - 0.5))  # the corner of a cell
        elif kind < 0.8 and points:
            p = points[-1].copy()
        if len(x) and segment_to_squares(points[-1] if points else p, p, x, y).min() <= 0:
            continue
        points.append(p)
        if len(points) == most:
            break
    return np.array(points)


@pytest.mark.nightly
@sized("cases", 150, 300)
def test_curves_of_any_polyline_keep_their_promises(cases: int) -> None:
    rng = np.random.default_rng(511)
    made = bends = 0
    for k in range(cases):
        height, width = (int(v) for v in rng.integers(3, 25, 2))
        blocked = rng.random((height, width)) < float(rng.choice((0.0, 0.05, 0.2, 0.4)))
        res = float(rng.choice((0.05, 1.0, 3.0)))
        grid = Grid(blocked, resolution=res)
        radius = float(rng.choice((0.0, 1e-9, 0.2, 0.4, 0.5, 1.2)))
        robot = Robot(radius=radius * res, turn_radius=float(rng.choice((0.0, 0.5, 3.0))) * res)
        points = free_polyline(rng, blocked, int(rng.choice((1, 2, 3, 6, 15))))
        if len(points) == 0:
            continue
        curve = curve_of(points, grid, robot)
        x, y = np.nonzero(blocked.T)
        ends = list(pairwise(points)) or [(points[0], points[0])]
        there = min((segment_to_squares(a, b, x, y).min(initial=np.inf) for a, b in ends), default=np.inf)
        assert joins(curve, "curve", robot.turn_radius) is None, k
        assert nearest_wall(curve, 0.0, curve.length, grid, 3 * res) / res >= min(radius, there) - 2e-8, k
        assert curve.length <= np.hypot(*np.diff(points, axis=0).T).sum() * res * (1 + 1e-9) + 1e-12
        assert curve.end == tuple(points[-1].tolist())
        if len(curve.lengths):
            assert np.abs(curve.xy[0] - points[0]).max() < 1e-9
        made += 1
        bends += bool((curve.curvature != 0).any())
    assert made > 0.934 * cases
    assert bends > 0.05 * cases


@pytest.mark.parametrize(
    "points",
    [[], [[NAN, 1.0]], [[1.0, 1.0], [math.inf, 2.0]], [[1.0, 1.0], [99.0, 1.0]], [[1.0, 1.0], [1.0, 5.0]]],
)
def test_odd_polylines_are_refused_in_words(points: list[list[float]]) -> None:
    blocked = np.zeros((7, 7), dtype=bool)
    blocked[3] = True
    with pytest.raises(SettingError) as refusal:
        curve_of(np.array(points).reshape(-1, 2), Grid(blocked), Robot())
    assert refusal.value.code in ("PATH_POINTS", "PATH_OUTSIDE", "PATH_BLOCKED")


# ---- obstacles that may come from anywhere -----------------------------------------------------------


def bounds(course: SampledPath, robot: Robot) -> np.ndarray:
    """Speeds that the robot's own limits allow at each node."""
    with np.errstate(divide="ignore"):
        return np.minimum(robot.v_max, np.sqrt(robot.a_lat_max / course.curvature))


def least_gap(
    curve: Curve, robot: Robot, movers: ObstacleStates, s: float, v: float, a: float, seconds: float
) -> float:
    """What is left between the rims at worst while the robot pushes for so long and then brakes, sampled."""
    after = max(v + a * seconds, 0.0)
    first = seconds if v + a * seconds >= 0 else -v / a
    t = np.linspace(0.0, first + after / robot.d_max, 300)
    d = np.maximum(t - first, 0.0)
    pushed = np.minimum(t, first)
    way = s + pushed * (v + 0.5 * a * pushed) + d * (after - 0.5 * robot.d_max * d)
    xy = curve.at(np.minimum(way, curve.length))[0]
    apart = np.hypot(*np.moveaxis(xy[:, None] - movers.xy[None], 2, 0)) * curve.resolution
    comes = movers.top_speed * (movers.age + t[:, None])
    return float((apart - comes - movers.radius - robot.radius).min(initial=np.inf))


def somebody(rng: np.random.Generator, curve: Curve, s: float) -> ObstacleStates:
    """Up to four obstacles around a place of a curve, now and then right on it."""
    res, m = curve.resolution, int(rng.integers(0, 5))
    xy = curve.at(np.array([s]))[0] + rng.normal(size=(m, 2)) * float(rng.choice((0.5, 2.0, 5.0)))
    if m and rng.random() < 0.2:
        xy[0] = curve.at(np.array([s + 0.5 * res]))[0][0]
    radius = np.full(m, 0.3 * res * float(rng.choice((0, 1))))
    return ObstacleStates(
        xy, radius, res * rng.choice((0.0, 0.5, 2.0), size=m), age=float(rng.choice((0.0, 0.2)))
    )


@pytest.mark.nightly
@sized("cases", 170, 500)
def test_after_every_push_braking_is_safe(cases: int) -> None:
    rng = np.random.default_rng(512)
    bound = resort = 0
    for k in range(cases):
        res = float(rng.choice((0.1, 1.0)))
        curve = bent_curve(rng, res)
        course = sample_curve(curve, float(rng.choice((0.05, 0.3, 2.0))) * res)
        robot = Robot(
            radius=float(rng.choice((0.0, 0.3))) * res,
            v_max=res * float(rng.choice((0.5, 1.0, 3.0))),
            a_max=0.5 * res,
            d_max=res,
            a_lat_max=res,
        )
        profile = feasible_profile(
            course.s, [("limit", bounds(course, robot))], a_max=robot.a_max, d_max=robot.d_max
        )
        ceiling = profile.v**2
        s = float(rng.random() * course.s[-1])
        v = math.sqrt(np.interp(s, course.s, ceiling)) * float(rng.choice((0.0, 0.3, 0.9, 1 - 1e-9)))
        movers, period = somebody(rng, curve, s), float(rng.choice((0.02, 0.1, 0.5)))
        found = push(rails_of(course), ceiling, s, v, movers, robot, period)
        assert -robot.d_max <= found.a <= robot.a_max
        bound += found.cause == "moving obstacle"
        if found.a == -robot.d_max or (v == 0.0 and found.a == 0.0):
            resort += 1
            continue
        assert least_gap(curve, robot, movers, s, v, found.a, period) >= -1e-9 * res, k
        after = max(v + found.a * period, 0.0)
        to = s + (period * (v + 0.5 * found.a * period) if after > 0 else -0.5 * v * v / min(found.a, -1e-9))
        assert after**2 <= np.interp(to, course.s, ceiling) * (1 + 1e-9) + 1e-12, k
    assert bound > 0.2 * cases
    assert resort < 0.5 * cases


@pytest.mark.nightly
@sized("cases", 50, 150)
def test_at_the_cap_nobody_comes_near_before_the_robot_stands(cases: int) -> None:
    rng = np.random.default_rng(513)
    asked = 0
    for k in range(cases):
        res = float(rng.choice((0.1, 1.0)))
        curve = bent_curve(rng, res)
        course = sample_curve(curve, float(rng.choice((0.1, 1.0))) * res)
        robot = Robot(radius=0.3 * res, v_max=2 * res, a_max=res, d_max=res)
        scene = Scene(Grid(np.zeros((30, 30), dtype=bool), resolution=res), (15, 15), (1, 1), robot=robot)
        movers = somebody(rng, curve, float(rng.random() * curve.length))
        settings = MovingObstacles(
            reaction=float(rng.choice((0.0, 0.1, 0.5))), margin=float(rng.choice((0.0, 0.1))) * res
        )
        found = moving_cap(course, scene, settings, Around(obstacle_states=movers))
        cap = np.minimum(found[0].v, robot.v_max) if found else np.full(len(course), robot.v_max)
        for i in np.flatnonzero(cap > 0).tolist():
            left = least_gap(curve, robot, movers, float(course.s[i]), float(cap[i]), 0.0, settings.reaction)
            assert left >= settings.margin - 1e-9 * res, (k, i)
            asked += bool(cap[i] < robot.v_max)
    assert asked > 2 * cases


def test_knowledge_that_is_no_number_is_none() -> None:
    for field in ("xy", "radius", "top_speed"):
        given: dict[str, Any] = {"xy": [[1.0, 1.0]], "radius": [0.3], "top_speed": [0.5]}
        given[field] = [[NAN, 1.0]] if field == "xy" else [NAN]
        with pytest.raises(LampyrisError):
            ObstacleStates(**given)
    course = sample_curve(bent_curve(np.random.default_rng(1), 1.0), 0.5)
    for age in (NAN, -1.0, 9.0):
        old = ObstacleStates(np.array([[0.0, 0.0]]), np.array([0.3]), np.array([0.5]), age=age)
        around = Around(obstacle_states=old)
        scene = Scene(Grid(np.zeros((30, 30), dtype=bool)), (15, 15), (1, 1))
        assert (moving_cap(course, scene, MovingObstacles(), around)[0].v == 0).all()


# ---- tracks that are known ---------------------------------------------------------------------------


def walkers(rng: np.random.Generator, curve: Curve, count: int) -> list[Track]:
    """Obstacles of which most come near the way at some time; some appear late, some stand on it."""
    res, tracks = curve.resolution, []
    for _ in range(count):
        n = int(rng.integers(1, 9))
        t = np.cumsum(rng.random(n) * 5 + 0.05) - (0.0 if rng.random() < 0.5 else 1.0)
        steps = rng.normal(size=(n, 2))
        pace = rng.choice((0.0, 0.3, 0.69), size=(n, 1))
        steps *= pace * np.diff(t, prepend=t[0])[:, None] / np.hypot(*steps.T)[:, None]
        xy = np.cumsum(steps, axis=0)
        mid = curve.at(np.array([rng.random() * curve.length]))[0][0]
        xy += mid + rng.normal(size=2) * 0.5 - xy[int(rng.integers(n))]
        tracks.append(Track(t, xy, 0.4 * res * float(rng.choice((0, 1))), 0.7 * res))
    return tracks


@sized("cases", 15, 90)
def test_ways_through_tracks_touch_nobody(cases: int) -> None:
    """Judged as drives: limits, discs against discs; and never quicker than with nobody about."""
    rng = np.random.default_rng(514)
    minded = blocked = 0
    for k in range(cases):
        res = float(rng.choice((0.2, 1.0)))
        start = (int(rng.integers(8, 16)), int(rng.integers(8, 16)))
        curve = random_curve(rng, start, 24, res, int(rng.integers(1, 5)))
        robot = Robot(radius=0.4 * res * float(rng.choice((0, 1))), v_max=res, a_max=0.5 * res, d_max=res)
        robot = replace(robot, a_lat_max=res)
        course = sample_curve(curve, float(rng.choice((0.1, 0.5, 3.0))) * res)
        cap, tracks = bounds(course, robot), walkers(rng, curve, int(rng.integers(0, 4)))
        alone = through_tracks(course, cap, robot, [])
        try:
            p = through_tracks(course, cap, robot, tracks)
        except SettingError as refusal:
            blocked += refusal.code == "PROFILE_BLOCKED"
            continue
        assert p.duration >= alone.duration * (1 - 1e-9)
        goal = (round(curve.end[0]), round(curve.end[1]))
        scene = Scene(Grid(np.zeros((24, 24), dtype=bool), resolution=res), start, goal, robot=robot)
        n, bodies = len(p.v), tuple(Obstacle("recorded", one.radius, False) for one in tracks)
        drive = Drive(
            scene, "", p.law, 0, Outcome.ARRIVED, (curve,), p.t, p.s, p.v, p.a, np.zeros(n, int), p.cause,
            p.cause_index, tuple(tracks), bodies, (), 0.1,
        )  # fmt: skip
        verdict = check_drive(drive)
        assert verdict is None, (k, verdict)
        minded += "wait" in p.cause or "moving obstacle" in p.cause
    assert minded > 0.09 * cases
    assert blocked < 0.5 * cases
