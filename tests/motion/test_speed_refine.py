"""Nodes where they help: courses refined, and ours beside the optimum of its caps found by other means."""

from __future__ import annotations

import numpy as np
import pytest
from speed_courses import random_course

from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.motion.geometry.clearance import wall_distance
from lampyris.motion.geometry.sampled_path import SampledPath, sample_curve
from lampyris.motion.laws import registry as laws
from lampyris.motion.laws.node_refinement import refined
from lampyris.motion.safety.surroundings import edge_room, edge_zones, reach_of, zones_at
from lampyris.referee.caps import check_caps


def optimum_of_same_caps(course: SampledPath, scene: Scene, spacing: float, creep: float = 0.1) -> float:
    """Seconds of the quickest drive under the caps as they are at points so close: plain passes in v^2."""
    assert course.curve is not None
    robot = scene.robot
    fine = sample_curve(course.curve, spacing)
    away = wall_distance(fine.xy, scene.grid, np.inf)
    stopping = np.sqrt(2 * robot.d_max * np.maximum(away - robot.radius, 0.0))
    cap = np.minimum(robot.v_max, np.maximum(creep * robot.v_max, stopping))
    if scene.zones is not None:
        x, y = np.floor(fine.xy + 0.5).astype(int).T
        cap = np.minimum(cap, scene.zones[y, x])
    square = np.minimum(cap**2, robot.a_lat_max / np.maximum(fine.curvature, 1e-12)).tolist()
    square[0] = square[-1] = 0.0
    for k in np.flatnonzero(fine.stop).tolist():
        square[k] = 0.0
    ds = np.diff(fine.s)
    for k, d in enumerate(ds.tolist()):
        square[k + 1] = min(square[k + 1], square[k] + 2 * robot.a_max * d)
    for k in range(len(ds) - 1, -1, -1):
        square[k] = min(square[k], square[k + 1] + 2 * robot.d_max * ds[k])
    v = np.sqrt(square)
    return float((2 * ds / (v[1:] + v[:-1])).sum())


@pytest.mark.nightly
def test_ours_is_near_the_optimum_of_its_own_caps_and_never_quicker() -> None:
    rng = np.random.default_rng(31)
    ratios = []
    for _ in range(40):
        course, scene = random_course(rng)
        if len(course) < 3:
            continue
        near = refined(course, scene)
        took = laws.profile(near, scene).duration
        best = optimum_of_same_caps(course, scene, course.resolution / 64)
        ratios.append(took / best)
    assert min(ratios) >= 1.0 - 1e-9
    assert max(ratios) < 1.25
    assert np.mean(ratios) < 1.1


def own_speeds(course: SampledPath, scene: Scene) -> np.ndarray:
    """What each edge allows over the mean of what its two ends allow for themselves."""
    assert course.curve is not None
    assert scene.zones is not None
    reach = reach_of(course, 9.0)
    away = wall_distance(course.xy, scene.grid, reach)
    robot, both = scene.robot, []
    for room, zone in (
        (away, zones_at(course.xy, scene.zones)),
        (edge_room(course, away, reach), edge_zones(course, scene.zones)),
    ):
        stopping = np.sqrt(2 * robot.d_max * np.maximum(room - robot.radius, 0.0))
        both.append(np.minimum(np.minimum(np.maximum(0.1 * robot.v_max, stopping), robot.v_max), zone))
    return both[1] / (0.5 * (both[0][1:] + both[0][:-1]))


@pytest.mark.nightly
def test_refining_keeps_the_nodes_and_never_makes_slower() -> None:
    rng = np.random.default_rng(32)
    more = quicker = 0
    for _ in range(40):
        course, scene = random_course(rng)
        near = refined(course, scene)
        at = np.searchsorted(near.s, course.s)
        assert (near.s[at] == course.s).all()
        for name in ("xy", "heading", "stop"):
            assert (getattr(near, name)[at] == getattr(course, name)).all()
        assert (near.curvature[at] == course.curvature).all()
        assert (np.diff(near.s) > 0).all()
        before, after = laws.profile(course, scene), laws.profile(near, scene)
        assert after.duration <= before.duration * (1 + 1e-9)
        parent = np.searchsorted(course.s, near.s[:-1], side="right") - 1
        done = np.diff(near.s) > 1.01 * np.diff(course.s)[parent] / 32
        assert (own_speeds(near, scene)[done] >= 0.9 * (1 - 1e-9)).all()
        assert near.curve is not None
        assert check_caps(after, near.curve, scene) is None
        more += len(near) > len(course)
        quicker += after.duration < before.duration * 0.99
    assert more > 20
    assert quicker > 10


def test_where_nothing_is_near_nothing_is_added() -> None:
    rng = np.random.default_rng(33)
    course, scene = random_course(rng, zones=False)
    nothing = Grid(np.zeros_like(scene.grid.blocked), resolution=course.resolution)
    free = Scene(nothing, (0, 0), (1, 1))
    assert refined(course, free) is course
