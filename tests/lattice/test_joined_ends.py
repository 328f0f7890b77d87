"""Paths of the lattice that begin and end at any pose: exactly there, free, and within the bound that is stated."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from lattice_scenes import FOOTPRINTS, motions_of, scene_of

import lampyris
from lampyris import curves
from lampyris.model.change import Change
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import DRIVES, Robot
from lampyris.model.scene import Scene
from lampyris.planning.lattice.ends.joined_end import JoinedEnd, heuristic_of, joined_end
from lampyris.planning.lattice.goal_field import GoalField
from lampyris.planning.lattice.lattice import UNIT
from lampyris.planning.lattice.lattice_planner import LatticePlanner, LatticeSession
from lampyris.planning.lattice.map import LatticeMap
from lampyris.planning.lattice.pad.pad_planner import PadPlanner
from lampyris.planning.lattice.poses import to_cells
from lampyris.referee import check_plan
from lampyris_selfcheck.reference.paths.lattice import least_costs
from sizes import sized

BESIDE = 1e-6


def session_of(
    scene: Scene, planner: type[LatticePlanner | PadPlanner] = LatticePlanner, **settings: Any
) -> LatticeSession:
    return planner(**settings).open(scene, np.random.default_rng(0))


def misses(plan: Plan, scene: Scene) -> list[float]:
    """Metres and radians by which the ends of a path miss the poses that are asked for."""
    assert plan.pose_path is not None
    found = []
    for pose, asked in zip(plan.pose_path.poses[[0, -1]], (scene.start_pose, scene.goal_pose), strict=True):
        assert asked is not None
        turned = abs(math.remainder(float(pose[2]) - asked[2], 2 * math.pi))
        found.append(max(float(np.abs(pose[:2] - asked[:2]).max()), turned))
    return found


@pytest.mark.commit(2)
@sized("maps", 4, 300)
@pytest.mark.parametrize("footprint", FOOTPRINTS)
@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("planner", [LatticePlanner, PadPlanner])
def test_costs_and_bounds_are_those_of_an_exhaustive_search_with_the_curves(
    planner: type[LatticePlanner | PadPlanner], drive: str, footprint: str, maps: int
) -> None:
    """Of all curves to the states around the start, motions, and curves from the states around the goal."""
    exact = 0
    for seed in range(200, 200 + maps):
        scene = scene_of(seed, drive, FOOTPRINTS[footprint])
        session = session_of(scene, planner, weight=1.0)
        plan, lattice_map = session.plan(), session.lattice_map
        plain = session_of(scene, planner, weight=1.0, shortcut=False).plan()
        if plain:
            assert plan
        if not plan:
            continue
        assert check_plan(plan, scene) is None, seed
        robot = session.curves()
        assert scene.start_pose is not None
        assert scene.goal_pose is not None
        start, goal = (
            joined_end(to_cells(scene.grid, *pose), robot, lattice_map, into=into)
            for pose, into in ((scene.start_pose, False), (scene.goal_pose, True))
        )
        if start is None or goal is None:
            continue
        assert max(misses(plan, scene)) < BESIDE
        begun = {
            (*lattice_map.cell(cell), h): cost
            for (cell, h), cost in zip(start.states, start.costs, strict=True)
        }
        best = least_costs(scene.grid.blocked.tolist(), motions_of(lattice_map.lattice), (), begun=begun)
        ends = [
            best[(*lattice_map.cell(cell), h)] + cost
            for (cell, h), cost in zip(goal.states, goal.costs, strict=True)
            if (*lattice_map.cell(cell), h) in best
        ]
        if not ends:
            continue  # then the nearest states are tried
        exact += 1
        least, path = min(ends) / UNIT, plan.pose_path
        assert path is not None
        stated = plan.attributes.get("lattice_cost", path.cost_m)
        assert stated == pytest.approx(least, abs=1e-4)
        assert path.cost_m <= least + 1e-4
        assert path.lower_bound_m <= least + 1e-9
        for weight in (1.4, 3.0):
            other = session_of(scene, planner, weight=weight).plan()
            assert check_plan(other, scene) is None
            assert other.bound is not None
            assert other.pose_path is not None
            assert other.bound <= weight * (1 + 1e-5)
            assert other.pose_path.lower_bound_m <= least + 1e-9
            assert max(misses(other, scene)) < BESIDE
    assert exact > 0


def test_the_curve_to_a_state_is_the_shortest_and_leads_there() -> None:
    robot = Robot(
        footprint=((0.9, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.9, -0.3)), drive="ackermann", turn_radius=2.5
    )
    scene = Scene(
        Grid(np.zeros((40, 40), dtype=bool)),
        start_pose=(20.3, 19.8, 0.7),
        goal_pose=(5.0, 5.0, 0.0),
        robot=robot,
    )
    session = session_of(scene, reverse_cost=1.0)
    grid, lattice_map = scene.grid, session.lattice_map
    assert scene.start_pose is not None
    for into in (False, True):
        end = joined_end(to_cells(grid, *scene.start_pose), session.curves(), lattice_map, into=into)
        assert end is not None
        assert end.costs == sorted(end.costs)
        for (index, heading), cost in zip(end.states, end.costs, strict=True):
            state = (*grid.to_metres(lattice_map.cell(index)).tolist(), lattice_map.lattice.angles[heading])
            ends = (state, scene.start_pose) if into else (scene.start_pose, state)
            assert cost / UNIT == pytest.approx(curves.reeds_shepp(*ends, 2.5).length, abs=1e-5)


@pytest.mark.parametrize("planner", [LatticePlanner, PadPlanner])
@pytest.mark.parametrize("drive", DRIVES)
def test_a_session_begins_where_the_robot_is(drive: str, planner: type[LatticePlanner | PadPlanner]) -> None:
    grid = Grid(np.pad(np.zeros((38, 58), dtype=bool), 1, constant_values=True), resolution=0.1)
    box = ((0.3, 0.15), (-0.1, 0.15), (-0.1, -0.15), (0.3, -0.15))
    robot = Robot(footprint=box, drive=drive, turn_radius=0.4)
    goal = (5.013, 3.027, 1.234)
    session = session_of(Scene(grid, start_pose=(0.55, 0.55, 0.0), goal_pose=goal, robot=robot), planner)
    for pose in ((0.613, 0.871, 0.3), (2.31, 2.04, -2.9), (4.77, 1.02, 1.5)):
        plan = session.plan(Change(pose=pose))
        assert max(misses(plan, Scene(grid, start_pose=pose, goal_pose=goal, robot=robot))) < BESIDE
        assert not plan.notes
        assert plan.attributes["end_error"] == pytest.approx(1e-4)


@pytest.mark.parametrize("aside", [0.0, 2e-9, 3e-6, 4e-4, 2e-3])
@pytest.mark.parametrize("drive", DRIVES)
def test_a_session_begins_where_the_robot_is_however_near_a_state_that_is(drive: str, aside: float) -> None:
    """A drive follows the path exactly, and so refuses one that begins a thousandth of a cell beside the robot."""
    robot = Robot(footprint=FOOTPRINTS["square"], drive=drive, turn_radius=2.5)
    pose = (5.5 + aside, 5.5, 0.0)
    scene = Scene(Grid(np.zeros((20, 20), bool)), start_pose=pose, goal_pose=(15.3, 4.2, 2.4), robot=robot)
    session = LatticePlanner().open(scene, np.random.default_rng(0))
    plan = session.plan(Change(pose=pose))
    assert plan.poses is not None
    assert np.abs(plan.poses[0] - pose).max() < 1e-6
    assert check_plan(plan, scene) is None


def test_ends_within_the_tolerances_and_at_states_are_those_of_the_lattice() -> None:
    grid = Grid(np.zeros((30, 40), dtype=bool), resolution=0.1)
    robot = Robot(radius=0.1, drive="differential")
    start, goal = (0.55, 0.55, 0.0), (3.03, 2.02, 0.4)
    scene = Scene(grid, start_pose=start, goal_pose=goal, robot=robot)
    assert max(misses(lampyris.plan(scene, "lattice"), scene)) < BESIDE
    near = lampyris.plan(scene, "lattice", goal_tolerance=0.1, goal_yaw_tolerance=0.3)
    assert near.pose_path is not None
    x, y = grid.frame.to_points(*near.pose_path.poses[-1, :2].tolist()).tolist()
    assert max(abs(x - round(x)), abs(y - round(y))) < BESIDE
    plain = lampyris.plan(scene, "lattice", shortcut=False)
    assert any("nearest pose of the lattice" in note for note in plain.notes)


def test_a_pose_in_a_wall_is_not_joined() -> None:
    """The nearest state is taken, and a note says so; where there is none, the start is occupied."""
    walls = np.zeros((30, 30), dtype=bool)
    walls[:, 10:13] = True
    robot = Robot(footprint=((0.4, 0.4), (-0.4, 0.4), (-0.4, -0.4), (0.4, -0.4)), drive="differential")
    goal = (25.3, 20.2, 0.3)
    scene = Scene(Grid(walls), start_pose=(13.3, 15.5, 0.1), goal_pose=goal, robot=robot)
    plan = lampyris.plan(scene, "lattice")
    assert check_plan(plan, scene) is None
    assert plan.notes
    assert "start" in plan.notes[0]
    assert misses(plan, scene)[1] < BESIDE
    inside = Scene(Grid(walls), start_pose=(11.4, 15.5, 0.1), goal_pose=goal, robot=robot)
    assert lampyris.plan(inside, "lattice").status is Status.START_OCCUPIED


@pytest.mark.parametrize("planner", ["lattice", "pad"])
@pytest.mark.parametrize("settings", [{}, {"goal_tolerance": 0.25, "goal_yaw_tolerance": 0.5}])
def test_ends_at_states_are_held_to_the_poses_that_are_asked_for(
    planner: str, settings: dict[str, float]
) -> None:
    """No end is joined here; the referee takes no path of another start for one of this all the same."""
    grid = Grid(np.zeros((30, 40), dtype=bool), resolution=0.1)
    robot = Robot(footprint=((0.2, 0.1), (-0.1, 0.1), (-0.1, -0.1), (0.2, -0.1)), drive="differential")
    goal = (3.05, 2.05, math.pi / 2) if not settings else (3.08, 2.03, 1.4)
    scene = Scene(grid, start_pose=(0.55, 0.55, 0.0), goal_pose=goal, robot=robot)
    plan = lampyris.plan(scene, planner, **settings)
    assert check_plan(plan, scene) is None
    assert plan.attributes["end_error"] == pytest.approx(1e-4)
    for aside in ((0.002, 0.0, 0.0), (0.0, 0.0, 0.01)):
        start = (0.55 + aside[0], 0.55 + aside[1], aside[2])
        found = check_plan(plan, Scene(grid, start_pose=start, goal_pose=goal, robot=robot))
        assert found is not None
        assert found.rule == "start"


def test_states_on_both_sides_of_a_wall_count_as_goals() -> None:
    """The cheapest state may lie in a part of the map that the start is not connected to."""
    walls = np.zeros((20, 30), dtype=bool)
    walls[:, 15] = True
    robot = Robot(footprint=((0.3, 0.3), (-0.3, 0.3), (-0.3, -0.3), (0.3, -0.3)), drive="differential")
    scene = Scene(Grid(walls), start_pose=(5.5, 10.5, 0.0), goal_pose=(13.3, 9.7, 0.3), robot=robot)
    lattice_map = session_of(scene).lattice_map
    index = [lattice_map.index(cell) for cell in ((20, 10), (13, 9), (18, 12))]
    end = JoinedEnd((13.0, 9.8, -0.3), [(one, 0) for one in index], [1, 5, 2], [np.zeros((1, 3))] * 3)
    found = heuristic_of(end, lattice_map, GoalField())
    assert [int(found[one]) >= 0 for one in index] == [True, True, True]
    assert int(found[lattice_map.index((5, 9))]) > 5 * UNIT
    for one, cost in zip(index, end.costs, strict=True):
        assert int(found[one]) <= cost


def test_a_fall_back_works_out_each_heuristic_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A start and a goal whose curves lead nowhere: four searches, two goals."""
    walls = np.zeros((30, 40), dtype=bool)
    walls[:, 20] = True
    robot = Robot(footprint=FOOTPRINTS["square"], drive="differential")
    scene = Scene(Grid(walls), start_pose=(5.3, 5.2, 0.4), goal_pose=(30.2, 20.4, 0.7), robot=robot)
    made: list[int] = []
    heuristic = LatticeMap.heuristic

    def noted(self, *arguments):  # type: ignore[no-untyped-def]
        made.append(1)
        return heuristic(self, *arguments)

    monkeypatch.setattr(LatticeMap, "heuristic", noted)
    assert session_of(scene).plan().status is Status.NO_PATH
    assert len(made) == 2


@pytest.mark.parametrize("drive", DRIVES)
def test_curves_that_are_left_out_at_first_cost_more(drive: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same states, in the same order, as if the curves to all of them were worked out."""
    rng = np.random.default_rng(3)
    walls = rng.random((60, 60)) < 0.02
    robot = Robot(footprint=FOOTPRINTS["car"], drive=drive, turn_radius=9.0)
    scene = Scene(Grid(walls), (1, 1), (50, 50), robot=robot)
    session = session_of(scene)
    found = 0
    for pose in rng.uniform((3.0, 3.0, -3.1), (56.0, 56.0, 3.1), (12, 3)).tolist():
        for into in (False, True):
            ends = []
            for some in (40, 100_000):
                monkeypatch.setattr("lampyris.planning.lattice.ends.joined_end._SOME", some)
                ends.append(joined_end(tuple(pose), session.curves(), session.lattice_map, into=into))
            few, every = ends
            assert (few is None) is (every is None)
            if few is not None and every is not None:
                found += 1
                assert few.states == every.states
                assert few.costs == every.costs
    assert found > 5
