"""Corners of a path of cells: rounded within half a step, or stops; limits have their effect."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

import lampyris
from lampyris import api, referee
from lampyris.errors import InternalFault, UsageError
from lampyris.model.grid import Grid
from lampyris.model.moves import MOVES, Moves
from lampyris.model.path import Path, path_of
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.motion.geometry.sampled_path import corners_of_path, sample_with_corners
from lampyris.motion.laws import registry as laws
from lampyris.typing import FloatGrid, Points
from lampyris_selfcheck.check import Ask, Part
from lampyris_selfcheck.checks.traffic import moving
from lampyris_selfcheck.checks.traffic.moving_drive import least_gap

LAWS = ("physical", "constant", "optimum", "blind", "uncertainty")


def bent(*, resolution: float = 1.0, **limits: float) -> tuple[Path, Scene]:
    """A path with a right angle, half a right angle and nothing near it."""
    scene = Scene(
        Grid(np.zeros((21, 21), bool), resolution=resolution), (0, 0), (15, 10), robot=Robot(**limits)
    )
    cells = [(k, 0) for k in range(6)] + [(5, k) for k in range(1, 6)] + [(5 + k, 5 + k) for k in range(1, 6)]
    return path_of(np.array([*cells, *((k, 10) for k in range(11, 16))]), scene.moves), scene


def test_arcs_fit_within_half_a_step() -> None:
    path, scene = bent(resolution=0.5)
    found = corners_of_path(path, 0.5, scene.robot)
    assert found.node.tolist() == [5, 10, 15]
    want = [0.25, 0.25 / math.tan(math.pi / 8), 0.25 / math.tan(math.pi / 8)]
    assert found.radius.tolist() == pytest.approx(want, rel=1e-14)
    assert found.stop.tolist() == [False, False, False]
    assert corners_of_path(path, 0.5, Robot(turn_radius=0.3)).stop.tolist() == [True, False, False]
    back = path_of(np.array([(0, 0), (1, 0), (0, 0)]), scene.moves)
    assert corners_of_path(back, 0.5, scene.robot).stop.tolist() == [True]
    course = sample_with_corners(path, 0.5, scene.robot)
    assert np.flatnonzero(course.curvature).tolist() == [4, 5, 6, 9, 10, 11, 14, 15, 16]


def arc_of(cells: list[tuple[int, int]], moves: Moves) -> Points:
    """Points on the arc at the middle one of three cells; none where the robot stops there."""
    found = corners_of_path(path_of(np.array(cells), moves), 1.0, Robot())
    if found.stop.any() or not len(found.node):
        return np.zeros((0, 2))
    before, node, after = np.array(cells, dtype=np.float64)
    radius, tangent = float(found.radius[0]), float(found.tangent[0])
    begin = node + tangent * (before - node) / np.hypot(*(before - node))
    end = node + tangent * (after - node) / np.hypot(*(after - node))
    inwards = (begin + end) / 2 - node
    centre = node + inwards / np.hypot(*inwards) * math.hypot(radius, tangent)
    mixed = [(begin - centre) * (1 - share) + (end - centre) * share for share in np.linspace(0, 1, 65)]
    return np.array([centre + radius * d / np.hypot(*d) for d in mixed])


def touched(a: tuple[int, int], b: tuple[int, int]) -> set[tuple[int, int]]:
    """The cells whose inside a straight step passes: anyone who may make the step, they are free."""
    points = np.linspace(a, b, 1201)
    near = np.abs(points - np.rint(points)).max(axis=1) < 0.5 - 1e-9
    return {(int(x), int(y)) for x, y in np.rint(points[near])}


CORNERS = [
    (kind, ((-a[0], -a[1]), (0, 0), b))
    for kind in ("dissertation", "octile", "four-connected", "sixteen-connected")
    for a in MOVES[kind].offsets
    for b in MOVES[kind].offsets
]


@pytest.mark.nightly
def test_an_arc_stays_within_the_cells_that_its_two_steps_touch() -> None:
    """So it meets no wall: whatever is blocked, these cells are not."""
    arcs = 0
    for kind, cells in CORNERS:
        points = arc_of(list(cells), MOVES[kind])
        arcs += len(points) > 0
        free = touched(*cells[:2]) | touched(*cells[1:])
        for x, y in points:
            inside = [
                (i, j)
                for i in range(math.floor(x), math.floor(x) + 2)
                for j in range(math.floor(y), math.floor(y) + 2)
                if max(abs(x - i), abs(y - j)) < 0.5 - 1e-9
            ]
            assert free.issuperset(inside), (kind, cells, (x, y))
    assert arcs == sum(len(MOVES[k].offsets) * (len(MOVES[k].offsets) - 2) for k in {k for k, _ in CORNERS})


def wall_gap(point: tuple[float, float] | FloatGrid, wall: tuple[int, int]) -> float:
    """Distance from a point to the square of a wall."""
    return math.hypot(*(max(abs(p - w) - 0.5, 0.0) for p, w in zip(point, wall, strict=True)))


@pytest.mark.nightly
def test_an_arc_is_no_nearer_to_a_wall_than_the_cells_around_its_two_steps() -> None:
    """A robot of some radius may stand in these, so there is room for it on the arc, too.

    Such a robot makes no knight's steps and cuts no corners: with a diagonal step all four cells around it
    have room for the robot.
    """
    for kind, cells in CORNERS:
        if kind != "octile":
            continue
        points = arc_of(list(cells), MOVES[kind])
        around = {(x, y) for (x0, y0), (x1, y1) in (cells[:2], cells[1:]) for x in (x0, x1) for y in (y0, y1)}
        for wall in itertools.product(range(-7, 8), repeat=2):
            if len(points) and wall not in around:
                room = min(wall_gap(cell, wall) for cell in around)
                assert min(wall_gap(p, wall) for p in points) >= room - 1e-9, (cells, wall)


@pytest.mark.parametrize("law", LAWS)
def test_a_lateral_limit_slows_a_plan_down(law: str) -> None:
    path, scene = bent()
    times = []
    for limit in (4.0, 1.0, 0.25, 0.01):
        there = replace(scene, robot=Robot(a_lat_max=limit))
        made = api.speed_profile(there, path, law)
        for k, radius in ((5, 0.5), (10, 0.5 / math.tan(math.pi / 8))):
            # An arc begins half-way to the neighbouring nodes: the robot is no faster than at these.
            fastest = np.square(made.v[k - 1 : k + 2]).max()
            assert fastest <= limit * radius * (1 + 1e-12)
        times.append(made.duration)
    assert times == sorted(times)
    assert times[0] < times[-1]
    if law == "physical":
        assert "curvature" in made.cause


@pytest.mark.parametrize("law", [*LAWS, "rpp"])
def test_a_turning_circle_makes_tight_corners_stops(law: str) -> None:
    path, scene = bent()
    scene = replace(scene, robot=Robot(turn_radius=1.0))
    made = api.speed_profile(scene, path, law)
    assert np.flatnonzero(made.v == 0.0).tolist() == [0, 5, 20]
    assert made.cause[5] == "turn"
    every = api.speed_profile(replace(scene, robot=Robot(turn_radius=5.0)), path, law)
    assert np.flatnonzero(every.v == 0.0).tolist() == [0, 5, 10, 15, 20]


def test_corners_next_to_each_other_may_all_be_stops() -> None:
    stairs = [(k // 2 + k % 2, k // 2) for k in range(12)]
    scene = Scene(Grid(np.zeros((9, 9), bool)), (0, 0), (6, 5), robot=Robot(turn_radius=2.0))
    made = api.speed_profile(scene, path_of(np.array(stairs), scene.moves))
    assert (made.v == 0.0).all()
    assert made.cause.count("turn") == 10
    assert (np.diff(made.t) > 0).all()


def test_a_law_may_leave_bends_aside_but_not_the_turning_circle() -> None:
    path, scene = bent(a_lat_max=0.01, turn_radius=1.0)
    made = api.speed_profile(scene, path, law_settings={"curvature": False})
    assert "curvature" not in made.cause
    assert made.cause[5] == "turn"


def test_the_referee_sees_corners_taken_too_fast() -> None:
    path, scene = bent(a_lat_max=0.1)
    bare = laws.profile(path, scene)
    assert referee.check_profile(bare, path, scene) is None
    found = referee.check_profile(bare, path, scene, corners=True)
    assert found is not None
    assert found.rule == "curvature"
    tight = replace(scene, robot=Robot(turn_radius=1.0))
    found = referee.check_profile(bare, path, tight, stops=True)
    assert found is not None
    assert (found.rule, found.where) == ("turn", "node 5")
    with pytest.raises(InternalFault):
        referee.demand(found)


def test_what_has_no_effect_is_refused() -> None:
    path, scene = bent()
    with pytest.raises(UsageError, match="spacing"):
        api.speed_profile(scene, path, spacing=0.1)
    course = api.smooth(scene, path)
    for given in ({"smooth": "straight"}, {"spacing": 0.1}):
        with pytest.raises(UsageError, match="OPTIONS"):
            api.speed_profile(scene, course, **given)  # type: ignore[arg-type]


def test_a_schedule_in_seconds_stops_in_corners_that_are_too_tight() -> None:
    scene = Scene(Grid(np.zeros((12, 12), bool)), (0, 0), (9, 3), robot=Robot(turn_radius=9.0))
    plan = lampyris.plan(scene, "sipp")
    assert plan.path is not None
    made = api.speed_profile(scene, plan, tick_seconds=1.0)
    corners = corners_of_path(plan.path, 1.0, scene.robot)
    assert corners.stop.any()
    assert made.cause.count("turn") == int(corners.stop.sum())
    assert not made.v[np.isin(made.s, plan.path.arc[corners.node[corners.stop]])].any()


def test_a_schedule_in_seconds_may_turn_back_on_itself() -> None:
    """Into a side cell and out again, until an obstacle has left the way (``moving``, seed 5, driven 114)."""
    cells = np.array([(2, 1), (1, 1), (0, 1), (1, 1), (2, 1), (3, 2), (4, 3)])
    late = Recorded(((4, 3),) * 12 + ((5, 3),))
    scene = Scene(Grid(np.zeros((5, 8), bool)), (2, 1), (4, 3), moves="dissertation", traffic=(late,))
    plan = Plan(Status.FOUND, "sipp", path_of(cells, scene.moves), schedule=np.arange(7))
    made = api.speed_profile(scene, plan, tick_seconds=4.0)
    (turn,) = (k for k, word in enumerate(made.cause) if word == "turn")
    assert (float(made.s[turn]), float(made.v[turn])) == (2.0, 0.0)
    assert "wait" in made.cause
    assert made.duration > 44.0, "not before the obstacle has left"
    gap, whom, _ = least_gap(made, plan, scene, 4.0)
    assert whom == 0
    assert gap > 0.0
    asked = moving.run(Ask(seed=5), Part("driven", 114, 1))
    assert not asked.failed


def test_a_schedule_in_seconds_minds_the_lateral_limit() -> None:
    scene = Scene(Grid(np.zeros((12, 12), bool)), (0, 0), (9, 3))
    plan = lampyris.plan(scene, "sipp")
    usual = api.speed_profile(scene, plan, tick_seconds=1.0).duration
    assert (
        api.speed_profile(replace(scene, robot=Robot(a_lat_max=0.01)), plan, tick_seconds=1.0).duration
        > usual
    )
