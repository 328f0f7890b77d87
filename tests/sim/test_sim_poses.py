"""Drives of robots with a shape and a heading: the path exactly, turns that take time, the footprint against discs."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import lampyris
from lampyris.errors import SceneError, SettingError, UsageError
from lampyris.kernels.motion.footprint_distance import wall_gaps
from lampyris.model.change import Change
from lampyris.model.curve import PoseCurve
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.model.plan import Status
from lampyris.model.robot import DRIVES, Robot
from lampyris.model.scene import Scene
from lampyris.model.trace import Outcome
from lampyris.model.traffic import RandomWalk, Recorded
from lampyris.motion.geometry.pose_curve import (
    backwards,
    curve_of_poses,
    joined,
    part_of,
    pose_at,
    standing_at,
)
from lampyris.motion.geometry.shape_clearance import footprint_clearance
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.referee import check_drive
from lampyris.referee.caps import footprint_room
from lampyris.referee.drive import measure
from lampyris.referee.geometry.moving_footprint import signed_distance, times_within
from lampyris.sim.continuous.drive import drive
from lampyris.sim.continuous.pose_replanner import PoseReplanner
from lampyris.sim.sensor import ObstacleMessage
from lampyris.sim.traffic.continuous_traffic import comes_nearer
from lampyris.sim.world.pose_lookup import PoseLookup
from lampyris_selfcheck.check import Ask
from lampyris_selfcheck.checks.traffic.pose_drives import draw, outline

BOX = ((0.5, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.5, -0.2))
ELL = ((0.6, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.1, -0.3), (0.1, 0.1), (0.6, 0.1))


def hall(door: int = 14) -> Grid:
    walls = np.zeros((60, 80), dtype=np.bool_)
    walls[:, 40:43] = True
    walls[20 : 20 + door, 40:43] = False
    return Grid(walls, resolution=0.05)


def scene_of(kind: str = "differential", shape=BOX, traffic=(), goal=(3.0, 1.5, 3.1), **robot) -> Scene:
    radius = 0.4 if kind == "ackermann" else 0.0
    made = Robot(footprint=shape, drive=kind, **{"turn_radius": radius, **robot})
    return Scene(hall(), start_pose=(1.0, 1.5, 0.0), goal_pose=goal, robot=made, traffic=traffic)


# ---- the curve --------------------


@pytest.mark.nightly
@pytest.mark.parametrize("kind", DRIVES)
def test_a_curve_passes_every_pose_of_its_path(kind: str) -> None:
    scene = scene_of(kind)
    path = lampyris.plan(scene, "lattice", weight=1.5).pose_path
    assert path is not None
    curve = curve_of_poses(path, scene.grid, scene.robot)
    arm = scene.robot.radius
    along = np.concatenate(([0.0], np.cumsum(path.steps_in(arm))))
    assert curve.length == pytest.approx(along[-1])
    assert curve.length == pytest.approx(path.length_m + arm * path.turned_in_place)
    places = scene.grid.frame.to_metres(curve.at(along)[0])
    assert np.abs(places - path.poses[:, :2]).max() < 1e-9
    off = np.remainder(curve.yaw_at(along) - path.poses[:, 2] + math.pi, 2 * math.pi) - math.pi
    assert np.abs(off).max() < 1e-9
    if kind == "ackermann":
        assert not curve.in_place.any()
    assert np.allclose(curve.turn[~curve.in_place], -curve.curvature[~curve.in_place])


@pytest.mark.nightly
@pytest.mark.parametrize("kind", DRIVES)
def test_parts_of_a_curve_backwards_and_joined_are_where_it_is(kind: str) -> None:
    scene = scene_of(kind)
    path = lampyris.plan(scene, "lattice", weight=1.5).pose_path
    assert path is not None
    curve, rng = curve_of_poses(path, scene.grid, scene.robot), np.random.default_rng(3)
    for _ in range(40):
        a, b = np.sort(rng.uniform(0, curve.length, 2)).tolist()
        one = part_of(curve, a, b)
        s = rng.uniform(0, b - a, 20)
        for other, there in ((one, a + s), (backwards(one), b - s)):
            assert other.length == pytest.approx(b - a)
            assert np.abs(other.at(s)[0] - curve.at(there)[0]).max() < 1e-9
            away = np.remainder(other.yaw_at(s) - curve.yaw_at(there) + math.pi, 2 * math.pi) - math.pi
            assert np.abs(away).max() < 1e-9
        whole = joined(part_of(curve, 0.0, a), part_of(curve, a, curve.length)) if a > 0 else curve
        s = rng.uniform(0, curve.length, 20)
        assert np.abs(whole.at(s)[0] - curve.at(s)[0]).max() < 1e-9
        # A border is a stop where the curve stops, and at no other place.
        begins = np.round(whole.begins[whole.stops], 9)
        assert set(np.round(curve.begins[curve.stops], 9)) <= set(begins)
        assert all(any(abs(x - y) < 1e-6 for y in (*curve.begins[curve.stops], a)) for x in begins)


def test_a_turn_to_the_other_side_is_a_stop() -> None:
    poses = np.array([(0, 0, 0), (0, 0, 0.4), (0, 0, 0.1), (1, 0.1 * 0, 0.1)], dtype=np.float64)
    poses[3, :2] = math.cos(0.1), math.sin(0.1)
    path = PosePath(poses, np.array([0, 0, 1]), 1.0, 1.0)
    curve = curve_of_poses(path, hall(), Robot(footprint=BOX))
    assert curve.gears.tolist() == [0, 0, 1]
    assert curve.stops.tolist() == [1, 2]
    arm = Robot(footprint=BOX).radius
    assert curve.lengths == pytest.approx([0.4 * arm, 0.3 * arm, 1.0])


# ---- distances --------------------


def lookup(shape, kind: str = "differential") -> tuple[PoseLookup, Scene]:
    scene = scene_of(kind, shape=shape)
    plan = lampyris.plan(scene, "lattice", weight=2.0)
    assert plan.pose_path is not None
    return PoseLookup(curve_of_poses(plan.pose_path, scene.grid, scene.robot)), scene


@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", DRIVES)
def test_distances_from_the_footprint_are_those_of_the_referee(kind: str) -> None:
    route, scene = lookup(ELL if kind != "ackermann" else BOX, kind)
    rng = np.random.default_rng(5)
    points = rng.uniform((0, 0), (79, 59), (60, 2))
    res = scene.grid.resolution
    shape = np.array(scene.robot.footprint)
    for s in rng.uniform(0, route.length, 40).tolist():
        x, y, yaw = pose_at(route.poses, s, scene.grid)
        place = np.tile(scene.grid.frame.to_points(x, y) * res, (len(points), 1))
        wanted = signed_distance(shape, place, np.full(len(points), yaw), points * res)
        assert np.abs(route.gaps(s, points) - wanted).max() < 1e-9
    for _ in range(40):
        a, b = np.sort(rng.uniform(0, route.length, 2)).tolist()
        least = np.min([route.gaps(s, points) for s in np.linspace(a, b, 60)], axis=0)
        bound = route.least_gaps(a, b, points)
        assert (bound <= least + 1e-9).all()
        step = float(route.poses.movement.max()) * (b - a) / 60
        assert (bound >= least - step - 1e-6).all()


def test_clearance_of_a_footprint_is_that_of_every_edge_and_every_square() -> None:
    rng = np.random.default_rng(8)
    for turn in range(30):
        blocked = rng.random((30, 30)) < 0.05
        blocked[:2, :2] = False
        grid = Grid(blocked, resolution=0.1)
        shape = outline(rng, 0.1)
        robot = Robot(footprint=shape)
        n = 12
        xy, yaw = rng.uniform(3, 26, (n, 2)), rng.uniform(-3, 3, n)
        none = np.zeros(0)
        curve = PoseCurve(
            xy[:1], np.array([(0.0, 0.0)]), np.array([1.0]), np.zeros(1), (float(xy[0, 0]), float(xy[0, 1])), 0.1,
            yaw=yaw[:1], turn=np.array([1.0 / robot.radius]), end_yaw=float(yaw[0] + 1 / robot.radius),
            outline=np.array(shape), states=none,
        )  # fmt: skip
        s = np.linspace(0, 0.99, n)
        at = np.tile(xy[:1], (n, 1))
        found = footprint_clearance(curve, s, at, grid, 1.5)
        wanted = footprint_room(
            curve.yaw_at(s), at, Scene(grid, (0, 0), (1, 1), robot=robot), np.full(n, 1.5)
        )
        inside = found == 0.0
        assert np.abs(found - wanted)[~inside & np.isfinite(found)].max(initial=0.0) < 1e-8, turn
        assert (np.isfinite(found) == np.isfinite(wanted))[~inside].all()


@pytest.mark.nightly
def test_a_wall_within_the_footprint_is_at_distance_0() -> None:
    blocked = np.zeros((9, 9), dtype=np.bool_)
    blocked[4, 4] = True
    vx, vy = np.array([3.0, -3.0, -3.0, 3.0]), np.array([3.0, 3.0, -3.0, -3.0])
    room, gap = np.empty((2, 4)), np.array([2.0])
    one = np.array([5.0]), np.array([4.0]), np.array([1.0]), np.array([0.0])
    wall_gaps(blocked.ravel(), 9, 9, vx, vy, *one, room[0], room[1], gap)
    assert gap.tolist() == [0.0]


def test_times_on_a_standing_footprint_are_those_at_which_it_is_near() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        shape = np.array(outline(rng, 0.5))
        place, yaw = rng.uniform(-1, 1, 2), float(rng.uniform(-3, 3))
        at, velocity = rng.uniform(-3, 3, 2), rng.uniform(-2, 2, 2)
        limit = float(rng.uniform(0.01, 0.6))
        spans = times_within(shape, place, yaw, at, velocity, limit, 2.0)
        t = np.linspace(0, 2, 401)
        points = at + velocity * t[:, None]
        gaps = signed_distance(shape, np.tile(place, (401, 1)), np.full(401, yaw), points)
        within = np.zeros(401, dtype=np.bool_)
        for t0, t1 in spans:
            assert t0 < t1
            within |= (t >= t0) & (t <= t1)
        clear = np.abs(gaps - limit) > 1e-6
        assert (within == (gaps < limit))[clear].all()


def test_a_disc_on_a_path_of_poses_meets_obstacles_when_a_disc_does() -> None:
    """A one-vertex outline with a margin, along a straight line: the times are known."""
    poses = np.array([(0.5, 1.0, 0.0), (3.5, 1.0, 0.0)])
    grid = Grid(np.zeros((40, 80), dtype=np.bool_), resolution=0.05)
    curve = curve_of_poses(PosePath(poses, np.array([1]), 3.0, 3.0), grid, Robot(radius=0.25))
    route = PoseLookup(curve)
    x, y = grid.frame.to_points(2.5, 1.0).tolist()
    segments = np.array([(0.0, 0.0, 1.0, 0.0, 3.0)])
    legs = np.array([(0.0, 3.0, x, y, 0.0, 0.0)])
    t, who = route.first_contact(segments, legs, np.array([0.25]), np.zeros(1, dtype=np.int64))
    assert (t, who) == (pytest.approx(1.5, abs=1e-5), 0)
    box = PoseLookup(curve_of_poses(PosePath(poses, np.array([1]), 3.0, 3.0), grid, Robot(footprint=BOX)))
    t, who = box.first_contact(segments, legs, np.array([0.25]), np.zeros(1, dtype=np.int64))
    assert (t, who) == (pytest.approx(2.5 - 0.5 - 0.5 - 0.25, abs=1e-5), 0)
    beside = np.array([(0.0, 3.0, x, y + (0.2 + 0.25) / 0.05 + 0.001, 0.0, 0.0)])
    assert box.first_contact(segments, beside, np.array([0.25]), np.zeros(1, dtype=np.int64)) == (
        math.inf,
        -1,
    )


# ---- drives --------------------


@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", DRIVES)
def test_a_robot_follows_its_poses_and_arrives(kind: str) -> None:
    scene = scene_of(kind, yaw_rate_max=0.8)
    made = lampyris.drive(scene, "lattice", weight=1.5)
    assert made.arrived
    assert made.optimum is not None
    path = lampyris.plan(scene, "lattice", weight=1.5).pose_path
    assert path is not None
    t = np.linspace(0, made.duration, 400)
    driven = made.poses(t)
    assert driven[0] == pytest.approx(path.poses[0])
    assert driven[-1] == pytest.approx(path.poses[-1])
    for pose in path.poses[:: max(1, len(path.poses) // 50)]:
        d = driven - pose
        d[:, 2] = np.remainder(d[:, 2] + math.pi, 2 * math.pi) - math.pi
        assert np.abs(d).max(axis=1).min() < 0.05
    turn = np.remainder(np.diff(driven[:, 2]) + math.pi, 2 * math.pi) - math.pi
    assert np.abs(turn).max() <= 0.8 * (t[1] - t[0]) * (1 + 1e-6)
    # A robot as it is drives through a door that the circle around it does not fit.
    assert scene.robot.radius * 2 > 14 * 0.05
    assert lampyris.plan(scene, "astar").status is Status.NO_PATH


def test_turning_in_place_takes_time() -> None:
    robot = Robot(footprint=BOX, yaw_rate_max=0.5, a_max=1e3, d_max=1e3)
    grid = Grid(np.zeros((60, 60), dtype=np.bool_), resolution=0.05)
    scene = Scene(grid, start_pose=(1.5, 1.5, 0.0), goal_pose=(1.5, 1.5, math.pi / 2), robot=robot)
    made = lampyris.drive(scene, "lattice", turn_cost=0.01)
    assert made.arrived
    assert made.duration == pytest.approx(math.pi / 2 / 0.5, rel=0.04)
    plan = lampyris.plan(scene, "lattice", turn_cost=0.01)
    assert lampyris.speed_profile(scene, plan).duration == pytest.approx(math.pi / 2 / 0.5, rel=0.04)
    free = replace(scene, robot=replace(robot, yaw_rate_max=None))
    # The farthest vertex goes at v_max.
    assert lampyris.speed_profile(free, plan).duration == pytest.approx(math.pi / 2 * robot.radius, rel=0.04)


def test_a_drive_that_begins_at_its_goal_has_arrived() -> None:
    scene = scene_of(goal=(1.0, 1.5, 0.0), traffic=RandomWalk(2))
    made = lampyris.drive(scene, "lattice")
    assert made.arrived
    assert made.duration == 0.0


def blocked_way(kind: str, **more):
    """An obstacle walks into the way and stays there."""
    y = 60 - 1 - 30
    track = tuple((43, k) for k in (*range(4, y + 1), *[y] * 4000))
    free = Grid(np.zeros((60, 80), dtype=np.bool_), resolution=0.05)
    robot = Robot(footprint=BOX, drive=kind, turn_radius=0.3 if kind == "ackermann" else 0.0, v_max=0.5)
    scene = Scene(
        free,
        start_pose=(0.6, 1.5, 0.0),
        goal_pose=(3.0, 1.5, 0.0),
        robot=robot,
        traffic=Recorded(track, 0.15),
    )
    return drive(
        scene, LatticePlanner(weight=1.5), patience=1.0, obstacle_speed=0.9, time_limit=120.0, **more
    )


@pytest.mark.commit(1)
@pytest.mark.parametrize("kind", DRIVES)
def test_a_blocked_robot_finds_another_path_from_where_it_stands(kind: str) -> None:
    made = blocked_way(kind)
    assert check_drive(made) is None
    assert made.arrived, made.detail
    assert made.replans >= 1
    assert len(made.curves) >= 2
    # It stood between two states: the new path begins with what leads to one of them.
    assert all(isinstance(curve, PoseCurve) for curve in made.curves)
    poses = made.poses(np.linspace(0, made.duration, 2000))
    step = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    assert step.max() <= 0.5 * made.duration / 1999 + 1e-6


@pytest.mark.parametrize("number", [1608, 1701])
def test_a_robot_that_stands_rounding_errors_away_from_a_state_finds_another_path(number: int) -> None:
    """Regression: it asked for the path to that state, of less than 1e-12 m, which has no arcs."""
    case = draw(Ask().rng("pose-drives", "perfect", number))
    assert check_drive(drive(case.scene, case.planner, **case.settings)) is None


def test_a_session_begins_at_the_pose_of_a_change() -> None:
    scene = scene_of()
    session = LatticePlanner().open(scene, np.random.default_rng(0))
    pose = (*scene.grid.to_metres((20, 20)).tolist(), math.pi / 2)
    path = session.plan(Change(pose=pose)).pose_path
    assert path is not None
    assert path.poses[0] == pytest.approx(pose)
    with pytest.raises(SceneError):
        session.plan(Change(pose=(-5.0, 0.0, 0.0)))


def test_the_clearance_cap_is_that_of_the_footprint() -> None:
    """A long nose passes a wall: the profile is slower there than its inscribed disc would be."""
    nose = ((1.5, 0.2), (-0.2, 0.2), (-0.2, -0.2), (1.5, -0.2))
    scene = scene_of(shape=nose, goal=(3.0, 1.5, 0.0), v_max=2.0)
    plan = lampyris.plan(scene, "lattice", weight=1.0)
    made = lampyris.speed_profile(scene, plan)
    assert plan.pose_path is not None
    curve = curve_of_poses(plan.pose_path, scene.grid, scene.robot)
    room = footprint_clearance(curve, made.s, curve.at(made.s)[0], scene.grid, 5.0)
    held = [k for k, cause in enumerate(made.cause) if cause == "clearance"]
    assert held
    for k in held:
        assert made.v[k] <= max(0.1 * 2.0, math.sqrt(2 * room[k])) + 1e-9
    disc = replace(
        scene, robot=replace(scene.robot, footprint=((0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)))
    )
    assert made.duration > lampyris.speed_profile(disc, plan).duration


def test_the_dissertations_law_and_ticks_refuse_poses() -> None:
    with pytest.raises(UsageError, match="dissertation"):
        lampyris.drive(scene_of(), "lattice", law="dissertation")
    with pytest.raises(UsageError, match="plans poses"):
        lampyris.simulate(scene_of(), "lattice")


@pytest.mark.nightly
@pytest.mark.commit(1)
@pytest.mark.parametrize("law", ["rpp", "optimum", "constant"])
def test_other_laws_drive_poses_as_the_referee_sees_it(law: str) -> None:
    made = lampyris.drive(scene_of("ackermann", traffic=RandomWalk(4)), "lattice", law=law, seed=2)
    assert made.law == law


@pytest.mark.nightly
def test_who_minds_nobody_drives_into_somebody() -> None:
    """The time optimum and obstacles that do not yield: contacts are found, and the referee agrees."""
    y = 60 - 1 - 30
    track = tuple((30, k) for k in (*range(2, 58), *range(58, 2, -1)) * 3)
    free = Grid(np.zeros((60, 80), dtype=np.bool_), resolution=0.05)
    seen = set()
    for kind in DRIVES:
        for late in range(3):
            robot = Robot(footprint=ELL, drive=kind, turn_radius=0.4 if kind == "ackermann" else 0.0)
            walk = tuple((x + 3 * late, k) for x, k in track)
            start, goal = (0.6, 1.5, 0.0), (3.3, 0.05 * y, 0.0)
            scene = Scene(free, start_pose=start, goal_pose=goal, robot=robot, traffic=Recorded(walk, 0.2))
            made = drive(scene, LatticePlanner(), law="optimum", obstacle_speed=0.5 + 0.3 * late)
            assert check_drive(made) is None
            seen.add(made.outcome)
            if made.outcome is Outcome.COLLISION:
                assert abs(measure(made)["gap"]) < 1e-6
    assert Outcome.COLLISION in seen


def test_states_and_turns_in_drives_survive_dictionaries() -> None:
    made = lampyris.drive(scene_of("differential"), "lattice", weight=2.0)
    assert lampyris.Drive.from_dict(made.to_dict()) == made
    with pytest.raises(SettingError):
        Robot(yaw_rate_max=0.0)


def test_an_obstacle_that_leaves_the_base_and_comes_nearer_to_the_front_is_seen_to_come_nearer() -> None:
    """A yielding obstacle beside a long car ran into its standing front: it was going away from the base at the rear."""
    grid = Grid(np.zeros((40, 60), dtype=bool), resolution=0.1)
    car = Robot(footprint=((3.0, 0.5), (-0.5, 0.5), (-0.5, -0.5), (3.0, -0.5)))
    route = PoseLookup(standing_at((1.5, 2.05, 0.0), grid, car))
    x, y = grid.frame.to_points(1.5, 2.05).tolist()
    at = np.array([[x + 25.0, y - 9.0], [x + 25.0, y - 9.0], [x + 25.0, y - 9.0]])
    to = at + np.array([[2.0, 1.0], [2.0, 0.0], [2.0, -1.0]])  # y points down: inwards, along, outwards
    away = at - (x, y)
    assert ((to - at) * away).sum(axis=1)[:2].min() > 0.0
    assert comes_nearer(route, 0.0, at, to).tolist() == [True, False, False]


@pytest.mark.parametrize(("expansions", "tried"), [(7, True), (0, False), (20_000, False)])
def test_a_robot_whose_pose_is_cut_off_begins_elsewhere_on_its_path(
    expansions: int, tried: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Only where the search ended close around it: a long search says that there is no way from a cell farther on, either."""
    scene = scene_of()
    replanner = PoseReplanner(scene, LatticePlanner(), 0, "none", None)
    nobody = ObstacleMessage(0.0, np.zeros((0, 2)), np.zeros(0), np.zeros(0))
    plan = replanner.first(nobody)
    curve = replanner.curve(plan, (0.0, 0.0), None)
    assert curve is not None
    leg = replanner.leg(curve, lambda samples: None)
    here = pose_at(leg.route.poses, 0.5, scene.grid)
    whole = replanner.session.plan

    def shut_in(change: Change, budget: object = None) -> lampyris.Plan:
        assert change.pose is not None
        if math.dist(change.pose[:2], here[:2]) < 1e-3:
            return lampyris.Plan(Status.NO_PATH, "lattice", expansions=expansions)
        return whole(change, None)

    monkeypatch.setattr(replanner.session, "plan", shut_in)
    answer, onward = replanner.again(leg, 0.5, None, 0.1)
    assert (onward is not None) is tried
    assert bool(answer) is tried
    if onward is not None:
        assert isinstance(onward, PoseCurve)
        assert pose_at(onward, 0.0, scene.grid) == pytest.approx(here, abs=1e-9)
