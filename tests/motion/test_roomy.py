"""Ways from elsewhere: what was given is what is driven, circles that were sampled are circles again."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from lampyris import api
from lampyris.io.maps.load import load_map
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.arc_sampling import circled
from lampyris.motion.geometry.deviation import deviation, length_of
from lampyris.motion.geometry.smoothing import drawn
from lampyris.typing import Points

RNG = np.random.default_rng(7)


@pytest.fixture(autouse=True)
def same_draws() -> None:
    """The same draws for a test whichever ran before it in this process."""
    global RNG
    RNG = np.random.default_rng(7)


OPEN = Grid(np.zeros((60, 60), dtype=bool), resolution=0.25)


def scene(grid: Grid = OPEN, **robot: Any) -> Scene:
    return Scene(grid, (1, 1), (2, 1), robot=Robot(**robot))


def circle(angles: Any, radius: float = 12.0) -> Points:
    return np.array([30.0, 30.0]) + radius * np.stack((np.cos(angles), np.sin(angles)), axis=-1)


def test_a_loop_is_driven_all_around() -> None:
    square = np.array([[10.0, 10], [40, 10], [40, 40], [10, 40], [10, 10]])
    # Half a step is at most half a knight's: arcs of 0.28 m radius.
    tight = 0.125 * np.sqrt(5)
    lines = api.smooth(scene(), square, method="none")
    assert lines.s[-1] == pytest.approx(30.0 - 3 * (2 - np.pi / 2) * tight, rel=1e-9)
    course = api.smooth(scene(), square)
    # Three corners of 1 m radius: each is shorter by 2 r - pi r / 2.
    assert course.s[-1] == pytest.approx(30.0 - 3 * (2 - np.pi / 2), rel=1e-9)
    assert deviation(square, course.xy, 0.01) == pytest.approx(4 * (np.sqrt(2) - 1), rel=0.01)
    assert api.smooth(scene(), square, method="straight").s[-1] == 0.0


@pytest.mark.parametrize("even", [True, False])
@pytest.mark.parametrize("turn_radius", [0.0, 2.5])
@pytest.mark.parametrize("a_lat_max", [1.0, 0.05])
def test_a_sampled_circle_has_its_radius(even: bool, turn_radius: float, a_lat_max: float) -> None:
    inner = np.linspace(0, 2 * np.pi, 401)[1:-1] if even else np.sort(RNG.uniform(0, 2 * np.pi, 399))
    points = circle(np.concatenate(([0.0], inner, [0.0])))
    there = scene(a_lat_max=a_lat_max, turn_radius=turn_radius)
    course = api.smooth(there, points)
    assert course.s[-1] == pytest.approx(2 * np.pi * 3, rel=1e-9)
    assert not course.stop.any()
    assert course.curve is not None
    bent = course.curve.lengths * np.abs(course.curve.curvature)
    assert bent.sum() == pytest.approx(2 * np.pi, abs=0.2)
    assert np.abs(course.curvature - 1 / 3).max() < 0.02 / 3
    made = api.speed_profile(there, course)
    assert made.v.max() == pytest.approx(min(1.0, np.sqrt(3 * a_lat_max)), rel=0.01)
    assert ("curvature" in made.cause) == (a_lat_max < 0.3)


def test_rounded_samples_keep_a_fair_radius() -> None:
    """To a hundredth of a cell they are on no circle; the corners of their lines are still wide."""
    points = np.round(circle(np.linspace(0, 3, 31)), 2)
    course = api.smooth(scene(a_lat_max=0.05), points)
    assert np.median(course.curvature[1:-1]) == pytest.approx(1 / 3, rel=0.05)


def test_lines_that_are_meant_stay_lines() -> None:
    octagon = circle(np.linspace(0, 2 * np.pi, 9))
    assert circled(octagon)[0].tolist() == octagon.tolist()
    row = np.stack((np.arange(1.0, 30.0), np.full(29, 5.0)), axis=-1)
    assert circled(row)[0].tolist() == row.tolist()
    course = api.smooth(scene(), row)
    assert course.curve is not None
    assert len(course.curve.lengths) == 1
    for _ in range(50):
        some = RNG.uniform(5, 50, (20, 2))
        assert circled(some)[0].tolist() == some.tolist()


def wander(k: int) -> Points:
    """Lines of 1 to 9 cells that turn by up to 1.8 radians."""
    rng = np.random.default_rng(k)
    heading = np.cumsum(rng.uniform(-1.8, 1.8, 8))
    step = rng.uniform(1, 9, 8)[:, None] * np.stack((np.cos(heading), np.sin(heading)), axis=-1)
    points = np.concatenate((np.zeros((1, 2)), np.cumsum(step, axis=0)))
    return points - points.min(axis=0) + 1.0


@pytest.mark.nightly
@pytest.mark.parametrize("spacing", [0.02, None])
def test_our_own_nodes_are_the_same_way_again(spacing: float | None) -> None:
    for k in range(20):
        grid = Grid(np.zeros((80, 80), dtype=bool), resolution=0.25)
        there = scene(grid, v_max=0.5 + 0.05 * k)
        course = api.smooth(there, wander(k), spacing=spacing)
        # Of a bend in which the nodes turn by more than half a radian less is known.
        sharp = bool(
            (np.diff(course.s) * np.minimum(course.curvature[1:], course.curvature[:-1])).max() > 0.5
        )
        again = api.smooth(there, course.xy, spacing=spacing)
        assert again.s[-1] == pytest.approx(course.s[-1], rel=1e-2 if sharp else 1e-6)
        one, two = api.speed_profile(there, course), api.speed_profile(there, again)
        assert two.duration == pytest.approx(one.duration, rel=0.05 if sharp else 0.01)
        assert (course.curvature > 0).any()


@pytest.mark.parametrize("name", ["env-1", "env-4", "guide", "maze-31"])
def test_planned_ways_come_back_from_their_nodes(name: str) -> None:
    document = load_map(name)
    query = document.queries[0]
    there = Scene(document.grid, query.start, query.goal, robot=Robot(radius=0.3))
    course = api.smooth(there, api.plan(there, "astar"))
    again = api.smooth(there, course.xy)
    assert again.s[-1] == pytest.approx(course.s[-1], rel=1e-6)
    one, two = api.speed_profile(there, course), api.speed_profile(there, again)
    assert two.duration == pytest.approx(one.duration, rel=0.01)


def test_a_circle_beside_a_wall_comes_no_nearer_than_its_samples() -> None:
    """Outside its chords there is no room: the circle is left as it was sampled."""
    blocked = np.zeros((60, 60), dtype=bool)
    blocked[:, 42:] = True
    grid = replace(OPEN, blocked=blocked)
    points = circle(np.linspace(-1.1, 1.1, 12), 11.5)
    robot = Robot(radius=0.05, a_lat_max=0.2)
    curve, lines = drawn(points, grid, robot, "arcs")
    assert lines.tolist() == points.tolist()
    wide, corners = drawn(points - (1.0, 0.0), grid, robot, "arcs")
    assert len(corners) > len(points)
    assert wide.length > curve.length


def test_none_leaves_the_lines_by_half_a_step_at_most() -> None:
    points = RNG.uniform(5, 50, (30, 2))
    course = api.smooth(scene(), points, method="none")
    assert course.curve is not None
    assert np.count_nonzero(course.curve.curvature) == 28
    assert not course.stop.any()
    # An arc leaves its corner by less than its tangent.
    assert deviation(points, course.xy, 0.1) < 0.5 * np.sqrt(5)
    assert course.s[-1] > (length_of(points) - 28 * np.sqrt(5)) * 0.25
    tight = api.smooth(scene(turn_radius=900.0), points, method="none")
    assert tight.stop.sum() == 28
    assert tight.s[-1] == pytest.approx(length_of(points) * 0.25, rel=1e-12)


@pytest.mark.nightly
def test_deviation_against_every_pair() -> None:
    for n, m in ((1, 1), (1, 5), (7, 3), (200, 333)):
        a, b = RNG.uniform(0, 9, (n, 2)), RNG.uniform(0, 9, (m, 2))

        def far(points: Points, line: Points) -> float:
            worst = 0.0
            for p in points:
                least = np.inf
                for u, v in pairwise(line) if len(line) > 1 else [(line[0], line[0])]:
                    d = v - u
                    size = float(d @ d)
                    share = min(max(float((p - u) @ d) / size, 0.0), 1.0) if size else 0.0
                    least = min(least, float(np.hypot(*(p - u - share * d))))
                worst = max(worst, least)
            return worst

        assert deviation(a, b, 1e9) == pytest.approx(max(far(a, b), far(b, a)), rel=1e-12)
        assert deviation(a, b, 0.5) >= deviation(a, b, 1e9) - 1e-12
