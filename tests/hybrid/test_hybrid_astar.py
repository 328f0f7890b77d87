"""Hybrid A*: every path passes the referee, its lower bound holds, and its ends are those asked for."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris import curves
from lampyris._core.cancellation import CancelToken
from lampyris.errors import SettingError
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import DRIVES, Polygon, Robot
from lampyris.model.scene import Scene
from lampyris.planning.base import Budget
from lampyris.planning.hybrid.hybrid_planner import HybridAStar
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.planning.lattice.primitives import angles
from lampyris.referee import check_plan
from reference.kernel_forms import use
from sizes import sized

FOOTPRINTS: dict[str, Polygon] = {
    "car": ((1.9, 0.6), (-0.5, 0.6), (-0.5, -0.6), (1.9, -0.6)),
    "square": ((0.45, 0.45), (-0.45, 0.45), (-0.45, -0.45), (0.45, -0.45)),
    "arrow": ((1.4, 0.0), (-0.7, 0.9), (-0.3, 0.0), (-0.7, -0.9)),
}
"""In cells of 1 m; the last is not convex."""
SETTINGS: tuple[dict[str, Any], ...] = (
    {},
    {"reverse": False},
    {"switch_cost": 0.0, "weight": 1.0},
    {"analytic": False},
    {"goal_tolerance": 1.5, "goal_yaw_tolerance": 0.5},
    {"headings": 36, "motion_length": 2.5},
)


def planned(scene: Scene, budget: Budget | None = None, **settings: Any) -> Plan:
    plan = HybridAStar(**settings).open(scene, np.random.default_rng(0)).plan(None, budget)
    if plan:
        assert check_plan(plan, scene) is None
    return plan


def scene_of(seed: int, drive: str, footprint: Polygon, *, on_lattice: bool = False) -> Scene:
    """A map with some walls; ends anywhere, or at states of a lattice."""
    rng = np.random.default_rng([seed, DRIVES.index(drive), len(footprint)])
    side = int(rng.integers(12, 26))
    walls = rng.random((side, side)) < rng.choice([0.01, 0.03, 0.08])
    grid = Grid(walls, resolution=0.5, origin=(1.0, -2.0, 0.0 if on_lattice else float(rng.uniform(-3, 3))))
    ends = []
    for _ in range(2):
        cell = rng.integers(0, side, 2) + (0.0 if on_lattice else rng.uniform(-0.4, 0.4, 2))
        yaw = angles(16)[rng.integers(16)] if on_lattice else float(rng.uniform(-math.pi, math.pi))
        ends.append((*grid.to_metres(cell).tolist(), yaw))
    robot = Robot(
        drive=drive,
        footprint=tuple((x / 2, y / 2) for x, y in footprint),
        turn_radius=1.0 if drive == "ackermann" else float(rng.choice([0.0, 0.8])),
    )
    return Scene(grid, start_pose=ends[0], goal_pose=ends[1], robot=robot)


@pytest.mark.commit(4)
@sized("maps", 2, 300)
@pytest.mark.parametrize("footprint", FOOTPRINTS)
@pytest.mark.parametrize("drive", DRIVES)
def test_every_path_passes_the_referee(drive: str, footprint: str, maps: int) -> None:
    found = 0
    for seed in range(maps):
        scene = scene_of(seed, drive, FOOTPRINTS[footprint])
        settings = SETTINGS[seed % len(SETTINGS)]
        path = planned(scene, Budget(expansions=300_000), **settings).pose_path
        if path is None:
            continue
        found += 1
        assert path.bound >= 1.0
        assert settings.get("reverse", True) or (path.gears >= 0).all()
        assert scene.start_pose is not None
        assert scene.goal_pose is not None
        assert path.poses[0] == pytest.approx(scene.start_pose, abs=1e-9)
        if not {"analytic", "goal_tolerance"} & set(settings):
            assert path.poses[-1, :2] == pytest.approx(scene.goal_pose[:2], abs=1e-5)
    assert found > 0


@pytest.mark.commit(1)
@sized("maps", 6, 400)
@pytest.mark.parametrize("drive", DRIVES)
def test_the_lower_bound_holds_for_the_best_path_of_a_lattice(drive: str, maps: int) -> None:
    """The same robot can drive that path, so that its length is not below the bound; and what separates is a wall."""
    both = solved = 0
    for seed in range(maps):
        scene = scene_of(1000 + seed, drive, FOOTPRINTS["car"], on_lattice=True)
        best = LatticePlanner(weight=1.0).open(scene, np.random.default_rng(0)).plan()
        plan = planned(scene, Budget(expansions=300_000))
        if best.pose_path is None or best.notes:
            continue
        solved += 1
        assert plan.status in (Status.FOUND, Status.NO_PATH)
        assert "separate" not in plan.detail
        if plan.pose_path is not None:
            both += 1
            assert plan.pose_path.lower_bound_m <= best.pose_path.cost_m * (1 + 1e-9)
    assert solved > 1
    assert both > 0.8 * solved - 1


@pytest.mark.parametrize("reverse", [True, False])
def test_without_walls_the_path_is_the_shortest_curve(reverse: bool) -> None:
    rng = np.random.default_rng(4)
    robot = Robot(
        footprint=((0.9, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.9, -0.3)), drive="ackermann", turn_radius=1.3
    )
    grid = Grid(np.zeros((200, 200), dtype=bool), resolution=0.1)
    for _ in range(10):
        ends = [(*rng.uniform(7, 13, 2).tolist(), float(rng.uniform(-3, 3))) for _ in range(2)]
        scene = Scene(grid, start_pose=ends[0], goal_pose=ends[1], robot=robot)
        path = planned(scene, reverse=reverse, reverse_cost=1.0, switch_cost=0.0).pose_path
        assert path is not None
        curve = (curves.reeds_shepp if reverse else curves.dubins)(ends[0], ends[1], 1.3)
        assert path.cost_m == pytest.approx(curve.length, rel=1e-9)
        assert path.length_m == pytest.approx(curve.length, rel=1e-6)
        assert path.bound == pytest.approx(1.0, abs=1e-6)


def parking() -> Scene:
    """A kerb with a gap of 5.6 m for a car of 4.4 m."""
    walls = np.zeros((40, 90), dtype=bool)
    walls[27:] = True
    walls[27:39, 30:58] = False
    car = ((3.6, 0.9), (-0.8, 0.9), (-0.8, -0.9), (3.6, -0.9))
    robot = Robot(footprint=car, drive="ackermann", turn_radius=4.0)
    return Scene(
        Grid(walls, resolution=0.2), start_pose=(3.0, 4.0, 0.0), goal_pose=(7.2, 1.4, 0.0), robot=robot
    )


@pytest.mark.nightly
def test_a_car_parks_in_a_gap_and_changes_gear_less_often_where_that_costs() -> None:
    few = planned(parking(), switch_cost=3.0).pose_path
    many = planned(parking(), switch_cost=0.0).pose_path
    assert few is not None
    assert many is not None
    assert 1 <= few.reversals < many.reversals
    assert (few.gears < 0).any()
    blind = planned(parking(), Budget(expansions=200_000), reverse=False)
    assert blind.status is Status.NO_PATH
    assert "at this resolution" in blind.detail


def test_a_robot_in_a_dead_end_turns_in_place_or_moves_sideways() -> None:
    walls = np.ones((30, 60), dtype=bool)
    walls[10:22, 2:58] = False
    grid = Grid(walls, resolution=0.1)
    footprint = ((0.4, 0.25), (-0.4, 0.25), (-0.4, -0.25), (0.4, -0.25))
    ends = {"start_pose": (5.0, 1.4, 0.0), "goal_pose": (1.0, 1.4, 0.0)}
    turning = Scene(grid, robot=Robot(footprint=footprint), **ends)  # type: ignore[arg-type]
    path = planned(turning, reverse=False).pose_path
    assert path is not None
    assert (path.gears == 0).any()
    assert (path.gears >= 0).all()
    sideways = Scene(grid, robot=Robot(footprint=footprint, drive="omnidirectional"), **ends)  # type: ignore[arg-type]
    path = planned(sideways).pose_path
    assert path is not None
    assert path.length_m == pytest.approx(4.0)
    assert np.ptp(path.poses[:, 2]) < 1e-9


@pytest.mark.parametrize("thin", [True, False])
def test_walls_that_separate_are_recognised_without_a_search(thin: bool) -> None:
    walls = np.zeros((20, 30), dtype=bool)
    walls[:, 15] = True
    side = 0.3 if thin else 1.6
    footprint = ((side, side), (-side, side), (-side, -side), (side, -side))
    robot = Robot(footprint=footprint)
    scene = Scene(Grid(walls), start_pose=(4.5, 10.5, 0.0), goal_pose=(25.5, 10.5, 0.0), robot=robot)
    plan = planned(scene)
    assert plan.status is Status.NO_PATH
    assert "separate" in plan.detail
    assert plan.expansions == 0
    walls[8:11, 15] = False
    narrow = planned(replace(scene, grid=Grid(walls)))
    assert narrow.status is (Status.FOUND if thin else Status.NO_PATH)


def test_both_forms_of_the_kernels_and_repeated_calls_give_the_same_poses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for drive in DRIVES:
        scene = scene_of(3, drive, FOOTPRINTS["square"])
        plans = []
        for form in ("plain", "compiled"):
            use(monkeypatch, form)
            session = HybridAStar(weight=1.2).open(scene, np.random.default_rng(0))
            plans += [session.plan(), session.plan()]
        assert all(plan.pose_path == plans[0].pose_path for plan in plans)
        assert len({plan.expansions for plan in plans}) == 1


def test_changes_of_the_map_obstacles_and_the_robot() -> None:
    walls = np.zeros((20, 30), dtype=bool)
    walls[:, 15] = True
    walls[4:9, 15] = False
    robot = Robot(footprint=FOOTPRINTS["square"])
    scene = Scene(Grid(walls), start_pose=(4.5, 10.5, 0.0), goal_pose=(25.5, 10.5, 0.0), robot=robot)
    session = HybridAStar().open(scene, np.random.default_rng(0))
    first = session.plan()
    door = tuple((15, y) for y in range(4, 9))
    assert session.plan(Change(obstacles=frozenset(door))).status is Status.HEMMED_IN
    assert session.plan(Change()).pose_path == first.pose_path
    assert session.plan(Change(blocked=door)).status is Status.NO_PATH
    assert session.plan(Change(freed=door)).pose_path == first.pose_path
    moved = session.plan(Change(robot=(20, 10)))
    assert moved.pose_path is not None
    assert moved.pose_path.cost_m < 8.0
    assert session.plan(Change(robot=(15, 0))).status is Status.START_OCCUPIED


def test_the_number_of_a_node_does_not_run_out() -> None:
    scene = Scene(Grid(np.zeros((9, 9), dtype=bool)), start_pose=(1.5, 1.5, 0.0), goal_pose=(7.5, 6.5, 0.0))
    session = HybridAStar(analytic=False).open(scene, np.random.default_rng(0))
    first = session.plan()
    assert session._search is not None
    session._search._first = 2**30 - 5
    for _ in range(3):
        assert session.plan().pose_path == first.pose_path
    assert session._search._first < 2**30


def test_ends_that_are_cells_or_have_tolerances() -> None:
    walls = np.zeros((20, 40), dtype=bool)
    walls[:10] = True
    walls[:, 20] = True
    robot = Robot(footprint=((2.0, 2.0), (-2.0, 2.0), (-2.0, -2.0), (2.0, -2.0)))
    grid = Grid(walls)
    cells = Scene(grid, (4, 15), (12, 14), robot=robot)
    plan = planned(cells)
    assert plan.poses is not None
    assert plan.poses[-1, :2] == pytest.approx(grid.to_metres((12, 14)), abs=1e-5)
    across = Scene(grid, start_pose=(4.5, 4.5, 0.0), goal_pose=(20.5, 4.5, 0.0), robot=robot)
    assert planned(across).status is Status.GOAL_OCCUPIED
    near = planned(across, goal_tolerance=5.0, goal_yaw_tolerance=0.3)
    assert near.status is Status.FOUND
    assert "within the tolerances" in near.notes[0]
    assert (
        planned(replace(across, start_pose=(20.5, 4.5, 0.0), start=(20, 15))).status is Status.START_OCCUPIED
    )


def test_a_search_that_is_stopped_says_so() -> None:
    scene = parking()
    assert planned(scene, Budget(expansions=1), analytic=False).status is Status.LIMIT
    stop = CancelToken()
    stop.set()
    assert lampyris.plan(scene, "hybrid-astar", budget=Budget(stop=stop)).status is Status.CANCELLED


def test_the_referee_sees_a_false_end_and_a_false_price() -> None:
    scene = parking()
    plan = planned(scene, switch_cost=1.0)
    path = plan.pose_path
    assert path is not None
    for attributes, rule in (({"switch_cost": 1.5}, "cost"), ({"switch_cost": 0.0}, "cost")):
        found = check_plan(replace(plan, attributes={**plan.attributes, **attributes}), scene)
        assert found is not None
        assert found.rule == rule
    for k, rule in ((0, "start"), (-1, "goal")):
        for axis in (0, 2):
            poses = path.poses.copy()
            poses[k, axis] += 0.01
            found = check_plan(replace(plan, pose_path=replace(path, poses=poses)), scene)
            assert found is not None
            assert found.rule == rule


def test_settings_out_of_range_are_refused() -> None:
    for settings in ({"weight": 0.5}, {"headings": 8}, {"motion_length": 1.0}, {"switch_cost": -1.0}):
        with pytest.raises(
            SettingError, match=f"hybrid-astar.*{next(iter(settings))}|{next(iter(settings))}"
        ):
            HybridAStar(**settings)  # type: ignore[arg-type]
