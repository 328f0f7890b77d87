"""Controllers that steer: what they drive, the braking rule, and what is refused."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from shapely.geometry import Polygon, box
from shapely.ops import unary_union

import lampyris
from lampyris.errors import SettingError, UsageError
from lampyris.model.curve import PoseCurve
from lampyris.model.drive import Drive
from lampyris.model.robot import DRIVES
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.steering import CONTROLLERS, Mppi, PurePursuit, controller_settings
from lampyris.model.trace import Outcome
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.referee import check_drive
from lampyris.referee.drive import measure
from lampyris.report.data.following import following
from lampyris.sim.steering.arc import Arc, RobotPose, RobotShape
from lampyris.sim.steering.control import Steer, View, stopping_speed
from lampyris.sim.steering.controller_choice import drive, simulation_of
from lampyris.sim.steering.reference import PathProgress, sections_of
from lampyris.sim.steering.sampling import PathIntegral
from lampyris.sim.steering.steered_drive import SteeredSimulation
from lampyris.sim.steering.walls import WallMap

NAMES = tuple(CONTROLLERS)
FOOTPRINT = [(0.5, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.5, -0.2)]
SMALL = {"mppi": {"samples": 150, "steps": 30}, "dwa": {"yaw_rates": 11, "directions": 5}}


def _scene(
    drive_type: str, obstacles: int = 0, start: tuple[float, float, float] = (1.0, 2.0, 0.0), **robot: Any
) -> lampyris.Scene:
    walls = np.zeros((40, 60), dtype=bool)
    walls[:, 26:28] = True
    walls[12:28, 26:28] = False
    radius = 0.6 if drive_type == "ackermann" else 0.0
    made = lampyris.Robot(footprint=FOOTPRINT, drive=drive_type, turn_radius=radius, **robot)
    grid = lampyris.Grid(walls, resolution=0.1)
    traffic = (lampyris.RandomWalk(obstacles),) if obstacles else ()
    return lampyris.Scene(grid, start_pose=start, goal_pose=(5.0, 2.5, 0.3), robot=made, traffic=traffic)


def _drive(scene: lampyris.Scene, controller: str, **more: Any) -> Drive:
    settings = {"controller_settings": SMALL.get(controller, {}), "time_limit": 90.0} | more
    return drive(scene, LatticePlanner(weight=1.5), controller=controller, **settings)


@pytest.mark.commit(2)
@pytest.mark.parametrize("drive_type", DRIVES)
@pytest.mark.parametrize("controller", NAMES)
def test_arrives_and_is_accepted_by_the_referee(controller: str, drive_type: str) -> None:
    made = _drive(_scene(drive_type), controller)
    assert made.outcome is Outcome.ARRIVED, made.detail
    assert check_drive(made) is None
    assert made.controller == controller
    assert len(made.curves) == 1
    assert len(made.paths) == len(made.path_times) >= 1
    found = following(made)
    assert 0.0 < found["cross_track_mean"] <= found["cross_track_max"] < 0.6
    end = made.poses(np.array([made.duration]))[0]
    assert np.hypot(end[0] - 5.0, end[1] - 2.5) < 0.25 + 0.1
    assert found["contacts"] == 0


@pytest.mark.nightly
@pytest.mark.parametrize("controller", NAMES)
def test_no_contact_while_moving_among_obstacles(controller: str) -> None:
    met = 0
    for seed, drive_type in enumerate(DRIVES):
        made = _drive(
            _scene(drive_type, obstacles=6), controller, seed=seed, obstacle_speed=0.8, time_limit=40.0
        )
        assert check_drive(made) is None
        assert measure(made)["collisions"] == 0
        met += np.isfinite(measure(made)["gap"])
    assert met >= 2


def test_gives_up_before_a_passage_that_stays_blocked() -> None:
    """Recoveries and the returns from them are no progress, though the robot moves."""
    walls = np.zeros((40, 60), dtype=bool)
    walls[:, 36:38] = True
    walls[16:25, 36:38] = False
    comes = tuple((46, min(2 + k, 20)) for k in range(19)) + tuple((max(45 - k, 37), 20) for k in range(900))
    scene = lampyris.Scene(
        lampyris.Grid(walls, resolution=0.1),
        start_pose=(1.0, 2.0, 0.0),
        goal_pose=(5.0, 2.0, 0.0),
        robot=lampyris.Robot(footprint=FOOTPRINT),
        traffic=(lampyris.Recorded(comes, radius=0.3),),
    )
    made = _drive(scene, "pure-pursuit", patience=2.0, give_up=12.0, obstacle_speed=1.0, on_hit="go-on")
    assert made.outcome is Outcome.BLOCKED, made.detail
    assert 12.0 < made.duration < 30.0
    assert made.replans > 2


@pytest.mark.nightly
def test_without_the_braking_rule_there_are_contacts() -> None:
    outcomes = []
    for seed in range(6):
        scene = _scene("differential", obstacles=20, d_max=0.4)
        made = _drive(
            scene, "pure-pursuit", seed=seed, obstacle_speed=1.0, law="optimum", safety_filter="none"
        )
        assert check_drive(made) is None
        outcomes.append(made.outcome)
    assert Outcome.COLLISION in outcomes


class _Straight:
    """A controller that drives straight on as fast as it can, whatever is there."""

    def begin(self, view: View) -> None:
        pass

    def steer(self, view: View) -> Steer:
        return Steer(Arc(view.pose.yaw, 0.0, 0.0), view.shape.robot.v_max, "limit")


@pytest.mark.commit(1)
@pytest.mark.parametrize("drive_type", DRIVES)
def test_the_braking_rule_stops_a_blind_controller_before_a_wall_and_none_does_not(drive_type: str) -> None:
    scene = _scene(drive_type, start=(1.0, 3.6, 0.0))
    ends = {}
    for rule in ("none", "braking"):
        simulation = SteeredSimulation(
            scene, LatticePlanner(weight=1.5), _Straight(), PurePursuit(rotate_angle=4.0), controller="pure-pursuit",
            safety_filter=rule, time_limit=8.0,
        )  # fmt: skip
        for _ in range(45):
            simulation.step()
        made = simulation.drive()
        assert check_drive(made) is None
        ends[rule] = made
    none, ruled = ends["none"], ends["braking"]
    assert none.outcome is Outcome.COLLISION
    assert "wall" in none.detail
    assert none.v[-1] > 0.5
    assert check_drive(replace(none, moments=())) is not None
    # The wall begins at x = 2.6 m, half a metre before it the base stands, and as near as a period's push allows.
    x = float(ruled.poses(np.array([ruled.duration]))[0, 0])
    assert ruled.v[-1] == 0.0
    assert 2.0 < x < 2.1
    assert "obstacle" in ruled.cause


def test_the_referee_refuses_steering_that_the_drive_cannot_do() -> None:
    made = _drive(_scene("omnidirectional"), "pure-pursuit")
    assert check_drive(made) is None
    for drive_type in ("differential", "ackermann"):
        other = replace(made.scene, robot=replace(made.scene.robot, drive=drive_type))
        assert check_drive(replace(made, scene=other)) is not None


@pytest.mark.nightly
def test_the_same_seed_gives_the_same_drive() -> None:
    scene = _scene("differential", obstacles=4)
    first, again, other = (_drive(scene, "mppi", seed=s, time_limit=6.0) for s in (3, 3, 4))
    assert first == again
    assert not np.array_equal(first.s[: len(other.s)], other.s[: len(first.s)])


@pytest.mark.nightly
def test_limits_are_kept() -> None:
    robot = {"a_max": 0.4, "d_max": 0.7, "v_max": 0.9, "a_lat_max": 0.3, "yaw_rate_max": 0.5}
    for controller in NAMES:
        made = _drive(_scene("differential", **robot), controller)
        curve = made.curves[0]
        assert isinstance(curve, PoseCurve)
        piece = curve.pieces_at(made.s)
        assert (np.abs(curve.turn[piece]) * made.v <= 0.5 + 1e-6).all()
        moves = ~curve.in_place[piece]
        assert (np.abs(curve.curvature[piece]) * made.v**2 * moves <= 0.3 + 1e-6).all()
        assert made.v.max() <= 0.9 + 1e-9
        assert -0.7 - 1e-9 <= made.a.min() <= made.a.max() <= 0.4 + 1e-9


@pytest.mark.nightly
def test_regulated_pursuit_is_slower_in_bends_and_near_walls_than_it_would_like() -> None:
    free = _drive(
        _scene("differential"), "rpp", controller_settings={"scaling_distance": 1e-6, "min_radius": 1e-6}
    )
    made = _drive(_scene("differential"), "rpp")
    assert "clearance" in made.cause
    assert made.duration > free.duration


@pytest.mark.nightly
@pytest.mark.parametrize("seed", range(4))
def test_the_free_part_of_an_arc_is_that_of_its_outlines(seed: int) -> None:
    rng = np.random.default_rng(seed)
    walls = rng.random((30, 30)) < 0.03
    walls[12:19, 12:19] = False
    grid = lampyris.Grid(walls, resolution=0.1)
    solid = unary_union([box(x - 0.5, -y - 0.5, x + 0.5, -y + 0.5) for y, x in np.argwhere(walls).tolist()])
    shape = RobotShape(
        lampyris.Robot(footprint=[(0.25, 0.12), (-0.1, 0.15), (-0.1, -0.1), (0.2, -0.1)]), grid
    )
    room = WallMap(shape)
    stopped = 0
    for _ in range(60):
        pose = RobotPose(1.5, -1.5, float(rng.uniform(-3, 3)))
        bend = float(rng.uniform(-2, 2))
        arc = Arc(pose.yaw, bend, bend) if rng.random() < 0.8 else shape.spin(bend)
        free = room.free(pose, arc, 1.2)

        def outline(s: float, pose: RobotPose = pose, arc: Arc = arc) -> Polygon:
            x, y, yaw = shape.along(pose, arc, s)
            c, q = np.cos(yaw), np.sin(yaw)
            return Polygon([((x + c * a - q * b) / 0.1, (y + q * a + c * b) / 0.1) for a, b in shape.outline])

        assert all(outline(s).distance(solid) > 0.0 for s in np.linspace(0.0, free, 60))
        if free < 1.2:
            stopped += 1
            assert outline(free).distance(solid) < 0.01 or free == 0.0
    assert stopped > 5


def test_a_period_and_braking_end_within_what_is_left() -> None:
    rng = np.random.default_rng(1)
    for left, v, period, d_max in rng.uniform((0.0, 0.0, 0.01, 0.1), (3.0, 1.0, 0.5, 3.0), (200, 4)):
        v1 = stopping_speed(left, v, period, d_max)
        if v1 > 0.0:
            assert 0.5 * (v + v1) * period + v1 * v1 / (2 * d_max) == pytest.approx(left, abs=1e-9)


def test_sections_end_where_the_robot_stops() -> None:
    scene = _scene("ackermann")
    ends = {"start_pose": (1.0, 2.0, 0.0), "goal_pose": (1.0, 1.2, 3.1)}
    back = lampyris.Scene(scene.grid, robot=scene.robot, **ends)  # type: ignore[arg-type]
    plan = lampyris.plan(back, "lattice", shortcut=False)
    assert plan.pose_path is not None
    curve = lampyris.drive(back, "lattice", time_limit=0.1, shortcut=False).curves[0]
    assert isinstance(curve, PoseCurve)
    sections = sections_of(curve)
    assert [one.last for one in sections] == [False] * (len(sections) - 1) + [True]
    assert {one.gear for one in sections} >= {1, -1}
    for one, after in itertools.pairwise(sections):
        assert one.s[-1] == after.s[0]
    progress = PathProgress(curve, 0.5)
    progress.update(RobotPose(float(sections[0].x[0]), float(sections[0].y[0]) + 0.1, 0.0))
    assert progress.s == pytest.approx(0.0, abs=0.05)
    assert abs(progress.beside) == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize(
    ("given", "error"),
    [
        ({"controller": "teb"}, SettingError),
        ({"controller": "rpp", "controller_settings": {"samples": 5}}, SettingError),
        ({"controller": "mppi", "controller_settings": {"samples": 1}}, SettingError),
        ({"controller": "exact", "controller_settings": {"samples": 100}}, SettingError),
        ({"controller": "rpp", "controller_settings": [1]}, SettingError),
        ({"controller": "rpp", "tracking": "velocity"}, SettingError),
        ({"safety_filter": "maybe"}, SettingError),
    ],
)
def test_wrong_settings_are_refused(given: dict[str, Any], error: type[Exception]) -> None:
    with pytest.raises(error):
        lampyris.drive(_scene("differential"), "lattice", **given)


def test_a_planner_of_cells_is_refused() -> None:
    with pytest.raises(UsageError, match="plans no headings"):
        lampyris.drive(_scene("differential"), "astar", controller="rpp")


def test_settings_come_complete() -> None:
    made = controller_settings("mppi", {"samples": 99})
    assert made == DriveSettings(controller="mppi", controller_settings={"samples": 99}).steering
    assert controller_settings("exact", {}) is None


@pytest.mark.parametrize("gap", [0.9e-4, 1e-6, 1e-8])
def test_a_robot_that_all_but_touches_a_wall_can_leave_it_but_not_come_nearer(gap: float) -> None:
    """The wall is to the left; gaps are in cells."""
    walls = np.zeros((40, 60), dtype=bool)
    walls[19, :] = True  # its lower rim is at y = -1.95 m
    robot = lampyris.Robot(footprint=FOOTPRINT, drive="omnidirectional")
    scene = lampyris.Scene(
        lampyris.Grid(walls, resolution=0.1),
        start_pose=(1.0, 0.5, 0.0),
        goal_pose=(5.0, 0.5, 0.0),
        robot=robot,
    )
    shape = RobotShape(robot, scene.grid)
    wall_map = WallMap(shape)
    rim = -0.1 * 19.5
    pose = RobotPose(3.0, rim - 0.2 - gap * 0.1, 0.0)
    assert wall_map.free(pose, Arc(0.5 * np.pi, 0.0, 0.0), 0.5) <= gap * 0.1
    assert wall_map.free(pose, Arc(-0.5 * np.pi, 0.0, 0.0), 0.5) == 0.5
    assert wall_map.free(pose, Arc(-0.1, 0.0, 0.0), 0.5) == 0.5
    assert wall_map.free(pose, Arc(0.1, 0.0, 0.0), 0.5) <= 1e-4 * 0.1 / 0.09
    assert wall_map.free(pose, Arc(0.0, 0.0, 2.0, True), 0.3) <= 1e-4, "to turn brings a corner into the wall"
    inside = RobotPose(3.0, rim - 0.2 + 1e-6, 0.0)
    assert wall_map.free(inside, Arc(-0.5 * np.pi, 0.0, 0.0), 0.5) == 0.0


def test_noise_is_other_noise_when_its_window_begins_again() -> None:
    """Windows of one horizon in a long drive: none is as one before, and pairs are uncorrelated."""
    settings = controller_settings("mppi", {"samples": 200, "steps": 20})
    assert isinstance(settings, Mppi)
    one = PathIntegral(settings, np.random.default_rng(0))
    simulation = simulation_of(_scene("differential"), LatticePlanner(weight=1.5), controller="mppi")
    assert isinstance(simulation, SteeredSimulation)
    simulation.step()
    one.begin(simulation.view(0.1))
    first = [part.copy() for part in one._noise[:2]]
    seen = {tuple(part[:50].tobytes() for part in first)}
    for _ in range(30):
        for _ in range(64):
            one._move_window(2)
        seen.add(tuple(part[:50].tobytes() for part in one._noise[:2]))
        assert abs(np.corrcoef(first[0] * first[1], one._noise[0] * one._noise[1])[0, 1]) < 0.1
        assert np.sort(np.abs(one._noise[0])).tobytes() == np.sort(np.abs(first[0])).tobytes()
    assert len(seen) == 31


@pytest.mark.parametrize("planner", ["lattice", "pad"])
def test_controllers_that_steer_follow_paths_without_shortcuts(planner: str) -> None:
    """Shortcuts graze corners; the exact controller alone follows them."""
    scene = _scene("ackermann")
    exact, steered = (
        lampyris.drive(scene, planner, time_limit=0.1, controller=controller)
        for controller in ("exact", "pure-pursuit")
    )
    plain = lampyris.plan(scene, planner, shortcut=False).pose_path
    with_shortcuts = lampyris.plan(scene, planner).pose_path
    assert plain is not None
    assert with_shortcuts is not None
    assert steered.paths[0].length == pytest.approx(plain.length_m, rel=1e-6)
    assert exact.curves[0].length == pytest.approx(with_shortcuts.length_m, rel=1e-6)
    assert exact.curves[0].length < steered.paths[0].length - 0.01
