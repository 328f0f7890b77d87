"""The referee refuses every kind of wrong path of poses, and lays footprints on the map as shapely does."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from shapely import affinity
from shapely.geometry import MultiPolygon, box
from shapely.geometry import Polygon as Shape

import lampyris
from lampyris.model.grid import Grid
from lampyris.model.path import PosePath
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.referee import check_plan
from lampyris.referee.geometry.footprint import overlapped, placed
from sizes import sized

CAR = ((0.9, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.9, -0.3))


def car_plan() -> tuple[Plan, Scene]:
    walls = np.zeros((80, 120), dtype=bool)
    walls[:, 60] = True
    walls[30:45, 60] = False
    robot = Robot(footprint=CAR, drive="ackermann", turn_radius=0.8)
    scene = Scene(
        Grid(walls, resolution=0.1),
        start_pose=(2.05, 2.05, 0.0),
        goal_pose=(10.05, 6.05, math.pi),
        robot=robot,
    )
    plan = LatticePlanner(shortcut=False).open(scene, np.random.default_rng(0)).plan()
    assert plan.pose_path is not None
    assert check_plan(plan, scene) is None
    return plan, scene


def with_poses(plan: Plan, change: Callable[[np.ndarray], None]) -> Plan:
    path = plan.pose_path
    assert path is not None
    poses = path.poses.copy()
    change(poses)
    return replace(plan, pose_path=replace(path, poses=poses))


def shifted(poses: np.ndarray) -> None:
    poses[:, 1] += 1.0


def off_at_the_start(poses: np.ndarray) -> None:
    poses[:, 0] += 0.3


def turned_at_the_goal(poses: np.ndarray) -> None:
    poses[-1, 2] += 0.5


def sideways(poses: np.ndarray) -> None:
    poses[len(poses) // 2, 2] += 0.002


def sparse(plan: Plan) -> Plan:
    path = plan.pose_path
    assert path is not None
    return replace(
        plan, pose_path=PosePath(path.poses[::2], path.gears[::2], path.cost_m, path.lower_bound_m)
    )


def cheaper(plan: Plan) -> Plan:
    path = plan.pose_path
    assert path is not None
    return replace(plan, pose_path=replace(path, cost_m=path.cost_m * 0.99, lower_bound_m=0.0))


def in_reverse(plan: Plan) -> Plan:
    path = plan.pose_path
    assert path is not None
    return replace(plan, pose_path=replace(path, gears=-path.gears.astype(np.int64)))


@pytest.mark.parametrize(
    ("rule", "change"),
    [
        ("start", lambda plan: with_poses(plan, shifted)),
        ("start", lambda plan: with_poses(plan, off_at_the_start)),
        ("goal", lambda plan: with_poses(plan, turned_at_the_goal)),
        ("drive", lambda plan: with_poses(plan, sideways)),
        ("dense", sparse),
        ("cost", cheaper),
        ("drive", in_reverse),
    ],
)
def test_each_defect_is_named(rule: str, change: Callable[[Plan], Plan]) -> None:
    plan, scene = car_plan()
    found = check_plan(change(plan), scene)
    assert found is not None
    assert found.rule == rule


def test_walls_turning_circle_and_drive_are_the_scenes() -> None:
    plan, scene = car_plan()
    path = plan.pose_path
    assert path is not None
    middle = path.poses[len(path.poses) // 2]
    walls = scene.grid.blocked.copy()
    x, y = scene.grid.to_cell(middle[0], middle[1])
    walls[y, x] = True
    found = check_plan(plan, replace(scene, grid=replace(scene.grid, blocked=walls)))
    assert found is not None
    assert found.rule == "footprint"
    wide = check_plan(plan, replace(scene, robot=replace(scene.robot, turn_radius=1.4)))
    assert wide is not None
    assert wide.rule == "turn_radius"
    turning = replace(scene, robot=replace(scene.robot, drive="differential", turn_radius=0.0))
    plan = LatticePlanner(reverse=False).open(turning, np.random.default_rng(0)).plan()
    assert check_plan(plan, turning) is None
    assert plan.pose_path is not None
    if (plan.pose_path.gears == 0).any():
        found = check_plan(plan, replace(turning, robot=replace(turning.robot, drive="ackermann")))
        assert found is not None
        assert found.rule == "drive"


@sized("cases", 400, 100_000)
def test_footprints_on_the_map_agree_with_shapely(cases: int) -> None:
    rng = np.random.default_rng(26)
    outlines = [np.array(CAR) * 4, np.array([(2.0, 0.0), (-1.0, 1.3), (-0.4, 0.0), (-1.0, -1.3)])]
    walls = rng.random((16, 16)) < 0.1
    squares = MultiPolygon([box(x - 0.5, y - 0.5, x + 0.5, y + 0.5) for y, x in np.argwhere(walls).tolist()])
    hits = 0
    for case in range(cases):
        outline = outlines[case % 2]
        x, y = rng.uniform(-1, 17, 2).tolist()
        yaw = float(rng.uniform(-math.pi, math.pi)) if case % 3 else float(rng.integers(4)) * math.pi / 2
        vertices = placed(outline, x, y, yaw)
        mirrored = Shape([(a, -b) for a, b in outline.tolist()])  # rows point down
        shape = affinity.translate(affinity.rotate(mirrored, -yaw, (0, 0), use_radians=True), x, y)
        assert shape.exterior.hausdorff_distance(Shape(vertices).exterior) < 1e-9
        area = shape.intersection(squares).area
        hit = overlapped(vertices, walls)
        hits += hit is not None
        if area > 1e-4:
            assert hit is not None
        if hit is not None:
            assert walls[hit[1], hit[0]]
            assert shape.intersects(box(hit[0] - 0.5, hit[1] - 0.5, hit[0] + 0.5, hit[1] + 0.5))
    assert cases // 10 < hits < cases


@pytest.mark.parametrize("name", ["lattice", "hybrid-astar", "pose-rrt-connect", "pad"])
def test_answers_without_a_path_state_what_they_are_judged_by(name: str) -> None:
    """True ones are accepted; a planner whose ends are exact is held to the footprint there."""
    walls = np.zeros((40, 60), dtype=bool)
    walls[:, 30] = True
    walls[:4, :4] = True
    robot = Robot(footprint=CAR, drive="differential", turn_radius=0.8)
    free, inside, beyond = (1.537, 1.512, 0.7), (0.15, 3.85, 0.0), (4.52, 2.03, 0.2)
    exact = name in ("hybrid-astar", "pose-rrt-connect")
    for start, goal, status in (
        (free, beyond, Status.NO_PATH),
        (inside, free, Status.START_OCCUPIED),
        (free, inside, Status.GOAL_OCCUPIED),
    ):
        scene = Scene(Grid(walls, resolution=0.1), start_pose=start, goal_pose=goal, robot=robot)
        plan = lampyris.plan(scene, name)
        assert plan.status is status
        assert plan.attributes["reverse_cost"] >= 1.0
        assert check_plan(plan, scene) is None
        for other in (Status.START_OCCUPIED, Status.GOAL_OCCUPIED, Status.NO_PATH):
            if other is not status and exact:
                assert check_plan(replace(plan, status=other), scene) is not None
    scene = Scene(Grid(walls, resolution=0.1), start_pose=free, goal_pose=(1.6, 1.5, 0.75), robot=robot)
    lie = Plan(Status.NO_PATH, name, attributes={"goal_tolerance": 0.5, "goal_yaw_tolerance": 0.6})
    broken = check_plan(lie, scene)
    assert broken is not None
    assert "tolerances" in broken.sentence
