"""Shortcuts of paths of the lattice: cheaper, free, the same every time, and not where they would be wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import lampyris
from lampyris import curves
from lampyris.kernels.curves.sampling import sample
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.robot import DRIVES, Polygon, Robot
from lampyris.model.scene import Scene
from lampyris.planning.lattice.lattice_planner import LatticePlanner
from lampyris.planning.lattice.map import ClearanceMap
from lampyris.planning.lattice.poses import states_near
from lampyris.planning.lattice.primitives import angles
from lampyris.planning.lattice.shortcut import ShortcutShape, shortened
from lampyris.referee import check_plan
from sizes import sized

FOOTPRINTS: dict[str, Polygon] = {
    "car": ((1.9, 0.6), (-0.5, 0.6), (-0.5, -0.6), (1.9, -0.6)),
    "arrow": ((1.4, 0.0), (-0.7, 0.9), (-0.3, 0.0), (-0.7, -0.9)),
}
"""In cells of 1 m; the last is not convex."""


def scene_of(seed: int, drive: str, footprint: Polygon, side: int = 32) -> Scene:
    rng = np.random.default_rng([seed, DRIVES.index(drive), len(footprint), 7])
    walls = rng.random((side, side)) < rng.choice([0.0, 0.01, 0.03, 0.05])
    ends = [(*(rng.random(2) * side).tolist(), float(rng.uniform(-math.pi, math.pi))) for _ in range(2)]
    robot = Robot(drive=drive, footprint=footprint, turn_radius=float(rng.choice([1.0, 2.5])))
    grid = Grid(walls)
    start, goal = (at_a_state(grid, pose) for pose in ends)
    return Scene(grid, start_pose=start, goal_pose=goal, robot=robot)


def at_a_state(grid: Grid, pose: tuple[float, float, float]) -> tuple[float, float, float]:
    """The nearest pose of the lattice, so that what shortcuts do is apart from what curves to other poses cost."""
    (cell, heading), *_ = states_near(grid, 16, pose)
    x, y = grid.to_metres(cell).tolist()
    return x, y, math.remainder(angles(16)[heading], 2 * math.pi)


def planned(scene: Scene, **settings: object) -> Plan:
    return LatticePlanner(**settings).open(scene, np.random.default_rng(0)).plan()  # type: ignore[arg-type]


@pytest.mark.commit(1)
@sized("maps", 3, 300)
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("name", FOOTPRINTS)
def test_the_cost_never_rises_and_the_referee_accepts(name: str, drive: str, maps: int) -> None:
    shorter = 0
    for seed in range(maps):
        scene = scene_of(seed, drive, FOOTPRINTS[name])
        settings = {
            "reverse": seed % 3 > 0,
            "turn_cost": (0.5, 3.0)[seed % 2],
            "reverse_cost": (1.0, 2.0)[seed % 2],
        }
        plain, plan = planned(scene, shortcut=False, **settings), planned(scene, **settings)
        assert plain.status is plan.status
        if plan.pose_path is None or plain.pose_path is None:
            continue
        assert check_plan(plan, scene) is None
        path, old = plan.pose_path, plain.pose_path
        assert path.cost_m <= old.cost_m
        assert path.lower_bound_m <= min(path.cost_m, old.lower_bound_m)
        assert np.abs(path.poses[[0, -1], :2] - old.poses[[0, -1], :2]).max() < 1e-6
        turned = np.remainder(path.poses[[0, -1], 2] - old.poses[[0, -1], 2] + math.pi, 2 * math.pi) - math.pi
        assert np.abs(turned).max() < 1e-6
        if not settings["reverse"]:
            assert (path.gears >= 0).all()
        assert planned(scene, **settings).pose_path == path
        if path.cost_m < old.cost_m:
            shorter += 1
            assert plan.attributes["lattice_cost"] == pytest.approx(old.cost_m)
        else:
            assert path == old
            assert "lattice_cost" not in plan.attributes
    assert shorter > maps // 4


@pytest.mark.parametrize("reverse", [True, False])
def test_without_walls_the_path_is_the_shortest_curve(reverse: bool) -> None:
    robot = Robot(
        footprint=((0.9, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.9, -0.3)), drive="ackermann", turn_radius=1.3
    )
    grid = Grid(np.zeros((200, 200), dtype=bool), resolution=0.1)
    rng = np.random.default_rng(4)
    for _ in range(8):
        cells = rng.integers(60, 140, (2, 2)).tolist()
        yaws = [angles(16)[k] for k in rng.integers(16, size=2)]
        start, goal = (
            (*grid.to_metres((x, y)).tolist(), yaw) for (x, y), yaw in zip(cells, yaws, strict=True)
        )
        scene = Scene(grid, start_pose=start, goal_pose=goal, robot=robot)
        path = planned(scene, reverse=reverse, reverse_cost=1.0).pose_path
        assert path is not None
        best = (curves.reeds_shepp if reverse else curves.dubins)(start, goal, 1.3).length
        assert path.cost_m == pytest.approx(best, rel=1e-9)
        assert path.length_m == pytest.approx(best, rel=1e-4)


def test_a_robot_that_turns_in_place_drives_straight_and_sideways_moves_straight() -> None:
    grid = Grid(np.zeros((60, 60), dtype=bool), resolution=0.1)
    box = ((0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2))
    start, goal = (*grid.to_metres((10, 10)).tolist(), 0.0), (*grid.to_metres((43, 27)).tolist(), 0.0)
    straight = 0.1 * math.sqrt(33 * 33 + 17 * 17)
    bearing = math.atan2(17, 33)
    for drive, cost in (("differential", straight + 2 * bearing * 0.01), ("omnidirectional", straight)):
        robot = Robot(footprint=box, drive=drive, turn_radius=1.0)
        scene = Scene(grid, start_pose=start, goal_pose=goal, robot=robot)
        path = planned(scene, turn_cost=0.01).pose_path
        assert path is not None
        assert path.cost_m == pytest.approx(cost, rel=1e-6)


def test_a_curve_that_costs_less_but_hits_a_wall_is_not_taken() -> None:
    """A detour around one blocked cell stays one."""
    walls = np.zeros((30, 30), dtype=bool)
    robot = ShortcutShape(((0.9, 0.4), (-0.4, 0.4), (-0.4, -0.4), (0.9, -0.4)), "ackermann", 2.0, 1.0, 1.0)
    detour = np.array(
        [
            (3.0, 1.2, 0.0),
            (3.0, 0.0, 0.0),
            (6.0, -2.4, 0.0),
            (3.0, 0.0, 0.0),
            (3.0, 1.2, 0.0),
            (0.5, 0.0, 0.0),
        ]
    )
    first = np.array([5.0, 15.0, 0.0])
    end = np.zeros(3 * len(detour))
    sample(*first, *detour.T.copy(), np.ones(len(detour), dtype=np.int64), end)
    assert end[-2] == pytest.approx(15.0, abs=0.1)
    free = shortened(first, detour, robot, ClearanceMap(Grid(walls), 8))
    walls[15, 13] = True
    kept = shortened(first, detour, robot, ClearanceMap(Grid(walls), 8))
    shortest = math.hypot(end[-3] - 5.0, end[-2] - 15.0)
    assert robot.costs(free).sum() == pytest.approx(shortest, rel=0.01)
    assert 1.02 * shortest < robot.costs(kept).sum() <= robot.costs(detour).sum()


def test_terrain_and_primitives_of_files_take_no_shortcuts() -> None:
    scene = scene_of(3, "ackermann", FOOTPRINTS["car"])
    scene = replace(scene, grid=Grid(np.zeros((32, 32), dtype=bool)))
    assert "lattice_cost" in planned(scene).attributes
    given = lampyris.motion_primitives(scene.robot, 1.0)
    for there, settings in (
        (replace(scene, grid=replace(scene.grid, terrain=np.full((32, 32), 9, dtype=np.uint8))), {}),
        (scene, {"primitives": given}),
    ):
        assert planned(there, **settings).pose_path == planned(there, shortcut=False, **settings).pose_path
