"""The lattice planner against an exhaustive search of the same lattice, and its sweeps against exact polygons."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lattice_scenes import FOOTPRINTS, optimum, scene_of
from shapely import affinity
from shapely.geometry import Polygon as Shape
from shapely.geometry import box

import lampyris
from lampyris._core.cancellation import CancelToken
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import DRIVES, Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.lattice.lattice import MARGIN
from lampyris.planning.lattice.lattice_planner import LatticePlanner, lattice_for
from lampyris.planning.lattice.primitives import HEADINGS, angles
from lampyris.referee import check_plan
from reference.kernel_forms import use
from sizes import sized, some


def planned(scene: Scene, budget: Budget | None = None, **settings: Any) -> Plan:
    """A plan without shortcuts, which leave the lattice."""
    plan = (
        LatticePlanner(**{"shortcut": False, **settings})
        .open(scene, np.random.default_rng(0))
        .plan(None, budget)
    )
    if plan:
        assert check_plan(plan, scene) is None
    return plan


@pytest.mark.parametrize("planner", ["lattice", "pad"])
def test_a_search_that_goes_on_in_compiled_form_finds_the_same(
    planner: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stops after a few expansions and goes on where it was."""
    robot = Robot(footprint=FOOTPRINTS["car"], drive="ackermann", turn_radius=2.0)
    grid = Grid(np.zeros((14, 20), dtype=bool))
    scene = Scene(grid, start_pose=(3.5, 5.5, 0.0), goal_pose=(16.5, 9.5, math.pi), robot=robot)
    made = []
    for few in (3, 10**9):
        monkeypatch.setattr("lampyris.planning.lattice.search.FEW", few)
        made.append(lampyris.plan(scene, planner, weight=1.2))
    assert made[0].expansions == made[1].expansions > 3
    assert made[0] == made[1]


@pytest.mark.commit(2)
@sized("maps", 4, 1000)
@pytest.mark.parametrize("footprint", FOOTPRINTS)
@pytest.mark.parametrize("drive", DRIVES)
def test_weight_one_finds_the_least_cost_and_greater_weights_keep_their_bound(
    drive: str, footprint: str, maps: int
) -> None:
    found = 0
    for seed in range(maps):
        scene = scene_of(seed, drive, FOOTPRINTS[footprint])
        status, least = optimum(scene, LatticePlanner(weight=1.0))
        plan = planned(scene, weight=1.0)
        assert plan.status is status, seed
        for weight in (1.4, 4.0):
            assert planned(scene, weight=weight).status is status
        if plan.pose_path is None:
            continue
        found += 1
        assert plan.pose_path.cost_m == pytest.approx(least, rel=1e-12)
        assert plan.bound == 1.0
        for weight in (1.4, 4.0):
            path = planned(scene, weight=weight).pose_path
            assert path is not None
            assert path.lower_bound_m <= least * (1 + 1e-9)
            assert least <= path.cost_m * (1 + 1e-9) <= weight * least * (1 + 2e-9)
            assert path.bound <= weight * (1 + 1e-6)
        last = planned(scene, weight=5.0, anytime=True)
        assert last.bound == 1.0
        assert last.pose_path is not None
        assert last.pose_path.cost_m == pytest.approx(least, rel=1e-12)
    assert found > 0


@pytest.mark.commit(1)
@pytest.mark.parametrize("headings", HEADINGS)
def test_tolerances_and_ends_without_a_yaw_widen_the_goal(headings: int) -> None:
    wide = {"goal_tolerance": 1.5, "goal_yaw_tolerance": 0.8}
    for seed in range(8):
        scene = scene_of(100 + seed, "differential", FOOTPRINTS["square"])
        for settings in ({}, wide):
            planner = LatticePlanner(weight=1.0, headings=headings, **settings)  # type: ignore[arg-type]
            status, least = optimum(scene, planner)
            plan = planned(scene, weight=1.0, headings=headings, **settings)
            assert plan.status is status
            if plan.pose_path is not None:
                assert plan.pose_path.cost_m == pytest.approx(least, rel=1e-12)
        cells = Scene(scene.grid, scene.start, scene.goal, robot=scene.robot)
        status, least = optimum(cells, LatticePlanner(weight=1.0))
        plan = planned(cells, weight=1.0)
        assert plan.status is status
        if plan.pose_path is not None:
            assert plan.pose_path.cost_m == pytest.approx(least, rel=1e-12)


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    ("headings", "footprint"), some([(k, name) for name in reversed(FOOTPRINTS) for k in HEADINGS], 2)
)
def test_sweeps_hold_every_cell_that_the_footprint_touches_and_few_others(
    headings: int, footprint: str
) -> None:
    robot = Robot(drive="omnidirectional", footprint=FOOTPRINTS[footprint], turn_radius=3.0)
    scene = Scene(Grid(np.zeros((3, 3), dtype=bool)), (0, 0), (2, 2), robot=robot)
    lattice = lattice_for(scene, LatticePlanner(headings=headings))
    outline = Shape(FOOTPRINTS[footprint])
    rng = np.random.default_rng(headings)
    for k in rng.choice(len(lattice.primitives), 40, replace=False).tolist():
        one = lattice.primitives[k]
        first, last = lattice.sweep_first[k : k + 2]
        swept = {(x, y) for x, y in lattice.sweep[first:last].tolist()}
        # Where there is room for all discs around the sweep it is not looked at cell by cell.
        discs = slice(*lattice.disc_first[k : k + 2])
        apart = np.abs(lattice.sweep[first:last, None] - lattice.disc[None, discs]) + 0.5
        assert (np.sqrt((apart * apart).sum(axis=2)) <= lattice.disc_radius[discs] + 1e-6).any(axis=1).all()
        poses = one.poses(0.02, robot.radius)
        shapes = [
            affinity.translate(affinity.rotate(outline, yaw, (0, 0), use_radians=True), x, y)
            for x, y, yaw in poses[rng.choice(len(poses), min(len(poses), 25), replace=False)].tolist()
        ]
        for x in range(-9, 10):
            for y in range(-9, 10):
                square = box(x - 0.5, y - 0.5, x + 0.5, y + 0.5)
                if any(shape.intersection(square).area > 1e-9 for shape in shapes):
                    assert (x, -y) in swept
        dense = [
            affinity.translate(affinity.rotate(outline, yaw, (0, 0), use_radians=True), x, y)
            for x, y, yaw in poses.tolist()
        ]
        for x, y in swept:
            square = box(x - 0.5, -y - 0.5, x + 0.5, -y + 0.5)
            assert min(shape.distance(square) for shape in dense) <= math.sqrt(2) * MARGIN + 0.02


@pytest.mark.commit(2)
@pytest.mark.parametrize("headings", HEADINGS)
@pytest.mark.parametrize("drive", DRIVES)
def test_primitives_end_where_they_say_and_turn_no_tighter_than_the_robot(drive: str, headings: int) -> None:
    robot = Robot(drive=drive, footprint=FOOTPRINTS["car"], turn_radius=3.0)
    scene = Scene(Grid(np.zeros((3, 3), dtype=bool)), (0, 0), (2, 2), robot=robot)
    lattice = lattice_for(scene, LatticePlanner(headings=headings))
    for k, one in enumerate(lattice.primitives):
        poses = one.poses(0.1, 2.0)
        assert poses[-1, :2] == pytest.approx(one.cell, abs=1e-9)
        assert math.remainder(poses[-1, 2] - angles(headings)[one.end], 2 * math.pi) == pytest.approx(
            0, abs=1e-9
        )
        for length, turn in one.pieces:
            assert length == 0 or abs(length) >= 3.0 * abs(turn) * (1 - 1e-9)
        assert (one.length == 0) <= (drive != "ackermann")
        assert lattice.cost[k] > 0


def test_a_rectangle_passes_a_door_that_its_circumscribed_circle_does_not() -> None:
    walls = np.zeros((60, 80), dtype=bool)
    walls[:, 40:43] = True
    walls[20:34, 40:43] = False  # 0.7 m of 0.05 m cells
    robot = Robot(footprint=((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)))
    scene = Scene(
        Grid(walls, resolution=0.05), start_pose=(1.0, 1.5, 0.0), goal_pose=(3.0, 1.5, 0.0), robot=robot
    )
    plan = planned(scene)
    assert plan.status is Status.FOUND
    disc = Scene(scene.grid, scene.start, scene.goal, robot=Robot(radius=robot.radius))
    assert planned(disc).status is Status.NO_PATH


def test_changes_of_the_map_obstacles_and_the_robot() -> None:
    walls = np.zeros((20, 30), dtype=bool)
    walls[:, 15] = True
    walls[4:9, 15] = False
    robot = Robot(footprint=FOOTPRINTS["square"])
    scene = Scene(Grid(walls), start_pose=(4.5, 10.5, 0.0), goal_pose=(25.5, 10.5, 0.0), robot=robot)
    session = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0))
    first = session.plan()
    door = tuple((15, y) for y in range(4, 9))
    assert session.plan(Change(obstacles=frozenset(door))).status is Status.HEMMED_IN
    again = session.plan(Change())
    assert again.status is Status.FOUND
    assert again.pose_path == first.pose_path
    assert session.plan(Change(blocked=door)).status is Status.NO_PATH
    assert session.plan(Change(freed=door)).pose_path == first.pose_path
    moved = session.plan(Change(robot=(20, 10)))
    assert moved.pose_path is not None
    assert moved.pose_path.cost_m < 8.0
    fresh = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0))
    assert fresh.plan(None, Budget(expansions=3)).status is Status.LIMIT


@pytest.mark.nightly
def test_the_field_of_the_goal_is_repaired_after_a_change() -> None:
    walls = np.zeros((80, 90), dtype=bool)
    walls[:60, 45] = True
    robot = Robot(footprint=FOOTPRINTS["square"])
    scene = Scene(Grid(walls), start_pose=(4.5, 10.5, 0.0), goal_pose=(85.5, 70.5, 0.0), robot=robot)
    session = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0))
    session.plan()
    solved = session._field.work
    rng = np.random.default_rng(3)
    for k in range(6):
        x, y = int(rng.integers(2, 40)), int(rng.integers(2, 60))
        walls = walls.copy()
        walls[y, x] ^= True
        change = Change(blocked=((x, y),)) if walls[y, x] else Change(freed=((x, y),))
        if k % 3 == 2:
            change = Change(change.robot, frozenset({(30, 30), (31, 30)}), change.blocked, change.freed)
        plan = session.plan(change)
        fresh = LatticePlanner(weight=1.0).open(
            Scene(Grid(walls), start_pose=scene.start_pose, goal_pose=scene.goal_pose, robot=robot),
            np.random.default_rng(0),
        )
        again = fresh.plan(Change(obstacles=change.obstacles))
        assert plan == again
        assert plan.expansions == again.expansions
    assert session._field.work - solved < 0.2 * 6 * solved


@pytest.mark.parametrize("form", ["plain", "compiled"])
def test_the_number_of_a_search_does_not_run_out(form: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """It stands above the cost in 64 bits, and starts over where it would reach the sign."""
    use(monkeypatch, form)
    scene = Scene(Grid(np.zeros((9, 9), dtype=bool)), start_pose=(1.5, 1.5, 0.0), goal_pose=(7.5, 6.5, 0.0))
    session = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0))
    first = session.plan()
    assert session._search is not None
    for number in (2**15 - 3, 2**16 - 3):
        session._search._memory.run = number
        for _ in range(4):
            assert session.plan(None, Budget(expansions=50_000)).pose_path == first.pose_path


@pytest.mark.parametrize(
    "limit",
    [
        pytest.param({"expansions": 3_000}, id="expansions"),
        pytest.param({"seconds": 0.4}, id="seconds", marks=pytest.mark.nightly),
    ],
)
def test_an_anytime_search_keeps_its_path_at_the_end_of_its_budget(limit: dict[str, Any]) -> None:
    walls = np.zeros((400, 400), dtype=bool)
    walls[60:, 200] = True
    robot = Robot(footprint=FOOTPRINTS["square"], drive="ackermann", turn_radius=6.0)
    scene = Scene(Grid(walls), start_pose=(20.5, 20.5, 0.0), goal_pose=(380.5, 20.5, 1.0), robot=robot)
    prefer_compiled_search(scene)
    plan = lampyris.plan(scene, "lattice", anytime=True, weight=20.0, budget=Budget(**limit))
    assert plan.status is Status.FOUND
    assert plan.bound is not None
    assert plan.bound <= 20.0
    assert plan.detail.startswith("Stopped improving at the ")
    stop = CancelToken()
    stop.set()
    assert lampyris.plan(scene, "lattice", anytime=True, budget=Budget(stop=stop)).status is Status.CANCELLED


def prefer_compiled_search(scene: Scene) -> None:
    """Have the kernels loaded, so that the seconds are for searching."""
    assert lampyris.plan(scene, "lattice", weight=20.0)


def test_a_goal_beside_a_wall_or_with_a_tolerance_across_one_is_reached() -> None:
    walls = np.zeros((20, 40), dtype=bool)
    walls[:10] = True
    walls[:, 20] = True
    robot = Robot(footprint=((2.0, 2.0), (-2.0, 2.0), (-2.0, -2.0), (2.0, -2.0)))
    for y in np.arange(7.0, 9.0, 0.1):
        scene = Scene(Grid(walls), start_pose=(4.5, 4.5, 0.0), goal_pose=(9.5, float(y), 0.0), robot=robot)
        plan = planned(scene, weight=1.0)
        assert plan.status in (Status.FOUND, Status.GOAL_OCCUPIED), y
        assert plan.status is Status.FOUND or y > 7.9
    across = Scene(Grid(walls), start_pose=(4.5, 4.5, 0.0), goal_pose=(20.5, 4.5, 0.0), robot=robot)
    assert planned(across).status is Status.GOAL_OCCUPIED
    assert planned(across, goal_tolerance=5.0).status is Status.FOUND
    assert planned(across, goal_tolerance=1e3).status is Status.FOUND
