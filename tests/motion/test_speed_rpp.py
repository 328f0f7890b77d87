"""Regulated Pure Pursuit: the values that Nav2's own tests publish, its costs, its steering, its tracking."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from speed_courses import random_course

from lampyris.errors import SettingError
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.obstacles import ObstacleStates
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.compare import compare
from lampyris.motion.laws.rpp import (
    Rpp,
    approach_rule,
    cost_of,
    curvature_rule,
    proximity_rule,
    regulate,
    steered,
)

ONE = Rpp()
FREE = np.zeros(1, dtype=np.int64)


def command(v: float, kappa: float, cost: int = 0, left: float = 100.0, **settings: float) -> float:
    """The controller's speed at one place."""
    one = replace(ONE, **settings)
    found = regulate(v, np.array([kappa]), np.array([cost]), np.array([left]), 0.1, one)
    return float(min(cap.v[0] for cap in found))


@pytest.mark.parametrize(
    ("v", "kappa", "want"), [(0.0, 0.5, 0.25), (0.5, 1000.0, 0.25), (1.0, 0.7407, 0.5), (0.5, 0.0, 0.5)]
)
def test_the_values_of_nav2s_tests(v: float, kappa: float, want: float) -> None:
    """No speed asked for, an absurd bend, a radius of 1.35 m beyond 0.9 m and clamped to what is desired."""
    assert command(v, kappa) == pytest.approx(want, abs=1e-12)


def test_a_bend_of_two_thirds_the_radius_has_two_thirds_of_the_speed() -> None:
    assert command(0.5, 1 / 0.6) == pytest.approx(0.5 * 0.6 / 0.9, rel=1e-12)
    assert curvature_rule(0.5, np.array([-1 / 0.6, 1 / 0.9]), ONE).tolist() == pytest.approx([1 / 3, 0.5])


def test_cost_and_distance_are_each_others_inverse_but_for_rounding() -> None:
    d = np.array([0.0, 0.1, 0.11, 0.2, 0.3, 0.54, 0.56, math.inf])
    cost = cost_of(d, 0.1, ONE)
    want = [253, 253, *(math.floor(252 * math.exp(-3.0 * (x - 0.1))) for x in d[2:6]), 0, 0]
    assert cost.tolist() == want
    v = proximity_rule(0.5, cost, 0.1, ONE)
    # The whole number is cut, so the distance it stands for is never less.
    np.testing.assert_array_less(0.5 * d[2:6] / 0.6 - 1e-12, v[2:6])
    np.testing.assert_allclose(v[2:6], 0.5 * d[2:6] / 0.6, atol=0.01)
    assert v[6:].tolist() == [0.5, 0.5]


def test_unknown_and_free_costs_say_nothing() -> None:
    assert proximity_rule(0.5, np.array([0, 255]), 0.1, ONE).tolist() == [0.5, 0.5]
    half = proximity_rule(0.5, np.array([200]), 0.1, replace(ONE, scaling_gain=0.5))
    assert half[0] == pytest.approx(0.5 * proximity_rule(0.5, np.array([200]), 0.1, ONE)[0])


def test_the_approach_rule() -> None:
    v = np.array([0.5, 0.5, 0.5, 0.03])
    left = np.array([1.2, 0.6, 0.01, 0.5])
    assert approach_rule(v, left, ONE).tolist() == pytest.approx([0.5, 0.3, 0.05, 0.03])


def test_neither_bends_nor_walls_slow_below_the_least_but_the_approach_does() -> None:
    assert command(0.5, 50.0, cost=253) == 0.25
    assert command(0.5, 50.0, cost=253, left=0.1) == pytest.approx(0.05)
    assert command(0.2, 0.0, min_speed=0.05) == pytest.approx(0.2)


def bent(radius: float, resolution: float = 0.1) -> SampledPath:
    """One metre straight, a quarter of a circle, one metre straight."""
    line, arc = 1.0 / resolution, radius / resolution
    curve = Curve(
        np.array([[5.0, 5.0], [5.0 + line, 5.0], [5.0 + line + arc, 5.0 + arc]]),
        np.array([[1.0, 0.0], [1.0, 0.0], [0.0, 1.0]]),
        np.array([1.0, radius * math.pi / 2, 1.0]),
        np.array([0.0, 1.0 / radius, 0.0]),
        (5.0 + line + arc, 5.0 + arc + line),
        resolution,
    )
    return sample_curve(curve, resolution / 4)


def test_it_steers_for_a_point_so_far_off() -> None:
    course = bent(1.5)
    kappa = steered(course, 0.6)
    s = course.s
    inside = (s > 1.05) & (s < 1.0 + 1.5 * math.pi / 2 - 0.65)
    np.testing.assert_allclose(kappa[inside], 1 / 1.5, rtol=1e-3)
    assert kappa[s < 0.39].max() == 0.0
    assert 0.0 < kappa[np.argmin(np.abs(s - 0.7))] < 1 / 1.5
    assert kappa[s > s[-1] - 0.9].max() < 1e-6
    assert steered(sample_curve(bent(1.5).curve, 9.0), 0.6)[0] == 0.0  # type: ignore[arg-type]


def test_the_point_steered_for_is_found_by_hand() -> None:
    course = bent(0.4)
    xy = course.xy * course.resolution
    kappa = steered(course, 0.6)
    for i in range(0, len(course) - 1, 3):
        gap = np.hypot(*(xy[i:] - xy[i]).T)
        far = np.flatnonzero(gap >= 0.6)
        if len(far) == 0:
            continue
        j = int(far[0])
        share = np.linspace(0, 1, 2001)[:, None]
        line = xy[i + j - 1] + (xy[i + j] - xy[i + j - 1]) * share - xy[i]
        carrot = line[np.argmin(np.abs(np.hypot(*line.T) - 0.6))]
        h = course.heading[i]
        want = abs(2 * (h[0] * carrot[1] - h[1] * carrot[0]) / 0.36)
        assert kappa[i] == pytest.approx(want, rel=1e-3, abs=1e-4)


def scene_of(
    course: SampledPath, robot: Robot | None = None, walls: tuple[tuple[int, int], ...] = ()
) -> Scene:
    blocked = np.zeros((60, 60), dtype=np.bool_)
    for x, y in walls:
        blocked[y, x] = True
    grid = Grid(blocked, resolution=course.resolution)
    return Scene(grid, (0, 0), (1, 1), robot=robot or Robot(radius=0.1))


def test_it_brakes_in_the_corner_and_ours_before() -> None:
    course = bent(0.3)
    scene = scene_of(course, Robot(radius=0.1, v_max=2.0, a_lat_max=0.2))
    theirs, ours = compare(course, scene, [Rpp(desired=2.0), "physical"])
    assert theirs.broken == ("lateral",)
    assert ours.broken == ()
    assert "braking" in theirs.profile.cause
    assert theirs.peak_braking <= scene.robot.d_max * (1 + 1e-9)
    assert theirs.peak_accel <= scene.robot.a_max * (1 + 1e-9)


def test_where_the_command_can_be_followed_it_is_the_speed() -> None:
    course = bent(0.6)
    made = laws.profile(course, scene_of(course, Robot(a_max=50.0, d_max=50.0)), law="rpp")
    command_ = np.minimum.reduce([v for _, v in made.caps])
    followed = np.array([c in ("limit", "curvature", "clearance", "approach") for c in made.cause])
    assert followed.sum() > 0.9 * len(course)
    np.testing.assert_allclose(made.v[followed], command_[followed], rtol=1e-12)
    assert {"limit", "curvature", "approach", "start", "goal"} <= set(made.cause)
    assert made.v[-1] == 0.0


def test_walls_and_what_moves_slow_it_alike() -> None:
    course = bent(1.5)
    robot = Robot(radius=0.1, a_max=50.0, d_max=50.0)
    wall = laws.profile(course, scene_of(course, robot, ((10, 8),)), law="rpp")
    body = laws.profile(course, scene_of(course, robot), law="rpp", obstacles=[(10, 8)])
    disc = ObstacleStates(np.array([[10.0, 8.0]]), np.array([0.05]), np.array([1.0]))
    moving = laws.profile(course, scene_of(course, robot), law="rpp", obstacle_states=disc)
    free = laws.profile(course, scene_of(course, robot), law="rpp")
    assert wall.v.tolist() == body.v.tolist()
    assert (wall.v <= free.v).all()
    assert (moving.v <= free.v).all()
    assert wall.cause[np.argmin(wall.v[5:40]) + 5] == "clearance"
    assert moving.duration > free.duration


@pytest.mark.nightly
def test_it_stands_where_the_course_says_and_keeps_the_robots_limits() -> None:
    rng = np.random.default_rng(5)
    stops = 0
    for _ in range(60):
        course, scene = random_course(rng)
        made = laws.profile(course, scene, law="rpp")
        stops += int(course.stop.sum())
        assert (made.v[course.stop] == 0.0).all()
        assert (np.array(made.cause)[course.stop] == "turn").all()
        assert (made.a <= scene.robot.a_max * (1 + 1e-9)).all()
        assert (-made.a <= scene.robot.d_max * (1 + 1e-9)).all()
        assert (made.v <= min(0.5, scene.robot.v_max)).all()
        assert made.v[-1] == 0.0
    assert stops > 8


@pytest.mark.nightly
def test_cause_and_cap_agree_and_braking_says_where_it_ends() -> None:
    """At every node of random courses: the cap that is named is met, and braking is that for its node."""
    rng = np.random.default_rng(11)
    met = {"command": 0, "halt": 0, "nothing": 0}
    for k in range(150):
        course, scene = random_course(rng)
        if k % 3 == 0:
            scene = replace(scene, robot=replace(scene.robot, d_max=0.1))
        desired = float(rng.uniform(0.3, 3.0))
        v0 = 0.0 if k % 2 else min(0.2, scene.robot.v_max)
        try:
            made = laws.profile(course, scene, law=Rpp(desired=desired), v0=v0)
        except SettingError:
            continue
        caps, x, d_max = dict(made.caps), made.v**2, scene.robot.d_max
        least = np.minimum.reduce(list(caps.values()))
        for i, cause in enumerate(made.cause):
            of = int(made.cause_index[i])
            assert cause == "braking" or of == -1
            if cause in caps:
                assert made.v[i] == pytest.approx(caps[cause][i], rel=1e-6)
                assert caps[cause][i] == least[i]
            elif cause == "acceleration":
                assert made.v[i] <= least[i] * (1 + 1e-9)
            elif cause == "braking" and of < 0:
                assert made.v[i] > least[i]
                met["nothing"] += 1
            elif cause == "braking":
                assert of > i
                assert set(made.cause[i:of]) == {"braking"}
                halt = made.cause[of] in ("turn", "goal")
                assert halt or made.cause[of] in caps
                fall = 2 * d_max * (course.s[of] - course.s[i])
                # The last edge before a command is met may be driven gentler.
                assert x[i] <= (x[of] + fall) * (1 + 1e-9)
                met["halt" if halt else "command"] += 1
    assert min(met.values()) > 20, met


def test_hard_braking_past_a_halt_is_told() -> None:
    course = bent(0.3)
    made = laws.profile(course, scene_of(course), law="rpp", v0=9.0, on_infeasible="brake")
    assert made.v[-1] > 0.0
    assert set(made.cause[1:]) == {"braking"}
    assert set(made.cause_index.tolist()) == {-1}


def test_a_start_too_fast_for_the_goal_is_refused_and_for_a_command_is_not() -> None:
    course = bent(0.3)
    scene = scene_of(course)
    made = laws.profile(course, scene, law="rpp", v0=0.9)
    assert made.v[0] == 0.9
    assert made.cause[1] == "braking"
    short = sample_curve(
        Curve(np.array([[5.0, 5.0]]), np.array([[1.0, 0.0]]), np.array([0.1]), np.zeros(1), (6.0, 5.0), 0.1),
        0.01,
    )
    with pytest.raises(SettingError, match="PROFILE_INFEASIBLE"):
        laws.profile(short, scene, law="rpp", v0=0.9)


@pytest.mark.parametrize(
    "bad", [{"scaling_gain": 1.5}, {"desired": 0.0}, {"lookahead": -1.0}, {"min_radius": "a"}]
)
def test_settings_are_checked(bad: dict[str, Any]) -> None:
    with pytest.raises(SettingError) as raised:
        Rpp(**bad)
    assert (raised.value.code, raised.value.where) == ("LAW_SETTING", f"rpp.{next(iter(bad))}")


def test_a_start_faster_than_the_robot_can_drive_is_refused() -> None:
    """It was taken, and the first nodes were faster than v_max."""
    course, scene = random_course(np.random.default_rng(3))
    with pytest.raises(SettingError, match="PROFILE_INFEASIBLE"):
        laws.profile(course, scene, law="rpp", v0=scene.robot.v_max * 1.001)
    braked = laws.profile(course, scene, law="rpp", v0=scene.robot.v_max * 1.001, on_infeasible="brake")
    assert braked.v[0] == scene.robot.v_max * 1.001
