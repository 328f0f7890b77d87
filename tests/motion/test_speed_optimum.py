"""The law `optimum` on courses, beside a dense reference that shares nothing with it."""

from __future__ import annotations

import math

import numpy as np
import pytest

import lampyris
from lampyris.model.curve import Curve
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.motion.geometry.acceleration_switches import with_switches
from lampyris.motion.geometry.sampled_path import SampledPath


def dense_optimum(curve: Curve, robot: Robot) -> float:
    """Seconds of the time optimum, by two sweeps over hundreds of places a piece.

    The limit of a place holds on both its sides, so the reference is slower than the true optimum; the more
    places there are, the less.
    """
    s, limit, still = [0.0], [0.0], set(curve.stops.tolist())
    for number, (length, bend) in enumerate(
        zip(curve.lengths.tolist(), np.abs(curve.curvature).tolist(), strict=True)
    ):
        most = min(robot.v_max**2, robot.a_lat_max / bend if bend else math.inf)
        limit[-1] = 0.0 if number in still else min(limit[-1], most)
        places = 200 + int(200 * length)
        begin = s[-1]
        s += [begin + length * k / places for k in range(1, places + 1)]
        limit += [most] * places
    limit[0] = limit[-1] = 0.0
    for k in range(1, len(s)):
        limit[k] = min(limit[k], limit[k - 1] + 2 * robot.a_max * (s[k] - s[k - 1]))
    for k in range(len(s) - 2, -1, -1):
        limit[k] = min(limit[k], limit[k + 1] + 2 * robot.d_max * (s[k + 1] - s[k]))
    v = [math.sqrt(x) for x in limit]
    return sum(2 * (s[k] - s[k - 1]) / (v[k] + v[k - 1]) for k in range(1, len(s)))


def drawn_course(rng: np.random.Generator) -> tuple[SampledPath, Scene] | None:
    """A course among scattered walls: cells of several sizes, turning circles of 0 to 5 cells, stops."""
    size = float(rng.choice([0.05, 0.25, 1.0]))
    blocked = rng.random((16, 16)) < float(rng.choice([0.0, 0.1, 0.25]))
    blocked[0, 0] = blocked[-1, -1] = False
    robot = Robot(
        v_max=float(rng.choice([0.5, 1.0, 3.0])),
        a_max=float(rng.choice([0.3, 0.5, 2.0])),
        d_max=float(rng.choice([0.3, 1.0, 2.0])),
        a_lat_max=float(rng.choice([0.3, 1.0])),
        turn_radius=size * float(rng.choice([0.0, 0.5, 1.0, 2.0, 5.0])),
    )
    scene = Scene(Grid(blocked, resolution=size), (0, 0), (15, 15), robot=robot)
    found = lampyris.plan(scene, "astar")
    if found.path is None:
        return None
    smooth = ("straight", "arcs", "none")[int(rng.integers(3))]
    spacing = None if rng.random() < 0.5 else size * float(rng.choice([0.5, 1.0, 4.0]))
    return lampyris.smooth(scene, found, method=smooth, spacing=spacing), scene  # type: ignore[arg-type]


@pytest.mark.commit(1)
@pytest.mark.parametrize("seed", range(6))
def test_optimum_is_the_optimum_whatever_the_turning_circle_and_the_cells(seed: int) -> None:
    """With a turning circle and cells of 1 m it was up to 14 % slower: its nodes were the course's alone."""
    rng, judged = np.random.default_rng([8, seed]), 0
    for _ in range(9):
        drawn = drawn_course(rng)
        if drawn is None:
            continue
        course, scene = drawn
        assert course.curve is not None
        made = lampyris.speed_profile(scene, course, "optimum")
        want = dense_optimum(course.curve, scene.robot)
        assert made.duration == pytest.approx(want, rel=2e-3)
        assert made.duration <= want * (1 + 1e-9)  # the reference is never quicker
        assert set(course.s.tolist()) <= set(made.s.tolist())
        judged += 1
    assert judged > 3


def test_nodes_are_put_where_the_acceleration_changes() -> None:
    """Two stops 2 m apart, a = 0.5 and d = 1 m/s2: up for 4/3 m, then down; or the top speed between."""
    points = np.array([[0.0, 0.0], [2.0, 0.0]])
    for v_max, at in ((9.0, [4 / 3]), (0.5, [0.25, 2 - 0.125])):
        scene = Scene(Grid(np.zeros((1, 3), dtype=np.bool_)), (0, 0), (2, 0), robot=Robot(v_max=v_max))
        course = lampyris.smooth(scene, points, spacing=1.0)
        made = lampyris.speed_profile(scene, course, "optimum")
        assert sorted(set(made.s.tolist()) - set(course.s.tolist())) == pytest.approx(at)
        finer = with_switches(course, np.array([0.0, min(1.0, v_max), 0.0]), scene.robot)
        assert finer.s.tolist() == made.s.tolist()
        assert made.xy is not None
        assert made.xy[:, 0].tolist() == pytest.approx(made.s.tolist())
    exact = math.sqrt(2 * 2.0 * 1.5 / (0.5 * 1.0))
    scene = Scene(Grid(np.zeros((1, 3), dtype=np.bool_)), (0, 0), (2, 0), robot=Robot(v_max=9.0))
    assert lampyris.speed_profile(scene, lampyris.smooth(scene, points), "optimum").duration == pytest.approx(
        exact
    )


def test_a_change_at_a_node_puts_no_second_one_beside_it() -> None:
    scene = Scene(Grid(np.zeros((1, 3), dtype=np.bool_)), (0, 0), (2, 0), robot=Robot(a_max=1.0, v_max=9.0))
    course = lampyris.smooth(scene, np.array([[0.0, 0.0], [2.0, 0.0]]), spacing=1.0)
    assert lampyris.speed_profile(scene, course, "optimum").s.tolist() == [0.0, 1.0, 2.0]
