"""Poses of a path moved by steps: paths of footprints cost less, remain free and end where they shall."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.planning import registry
from lampyris.planning.sampling import pose_star
from lampyris.referee import check_plan
from reference.kernel_forms import use

OUTLINE = ((0.6, 0.25), (-0.6, 0.25), (-0.6, -0.25), (0.6, -0.25))


def with_a_wall(drive: str) -> Scene:
    walls = np.zeros((40, 56), dtype=bool)
    walls[:26, 26:29] = True
    robot = Robot(footprint=OUTLINE, drive=drive, turn_radius=1.25 if drive == "ackermann" else 0.0)
    grid = Grid(walls, resolution=0.25)
    return Scene(grid, start_pose=(2.0, 6.0, 0.4), goal_pose=(11.5, 5.0, 0.0), robot=robot)


@pytest.mark.parametrize(
    ("drive", "saved"), [("ackermann", 0.02), ("differential", 0.02), ("omnidirectional", 0.0)]
)
def test_steps_make_paths_shorter(drive: str, saved: float, monkeypatch: pytest.MonkeyPatch) -> None:
    use(monkeypatch, "compiled")
    scene = with_a_wall(drive)
    lengths: list[list[float]] = []
    for least in (pose_star._LEAST_STEP, 1e9):  # with steps, and without
        monkeypatch.setattr(pose_star, "_LEAST_STEP", least)
        costs: list[float] = []
        for seed in range(2):
            session = registry.make("pose-rrt-star", {"rounds": 12}).open(
                scene, np.random.default_rng(seed), record=True
            )
            plan = session.plan()
            assert check_plan(plan, scene) is None
            assert all(
                a >= b for a, b in zip(plan.best_by_iteration, plan.best_by_iteration[1:], strict=False)
            )
            costs.append(plan.best_by_iteration[-1])
        lengths.append(costs)
    with_steps, without = lengths
    assert sum(with_steps) <= sum(without) - saved


def test_many_rounds_end_at_the_goal() -> None:
    """Steps leave tiny segments out; all together they may not move the end."""
    scene = with_a_wall("ackermann")
    plan = (
        registry.make("pose-rrt-star", {"rounds": 60, "batch": 10})
        .open(scene, np.random.default_rng(5))
        .plan()
    )
    assert check_plan(plan, scene) is None
    assert plan.poses is not None
    assert np.abs(plan.poses[-1, :2] - scene.goal_pose[:2]).max() < 1e-4
    again = replace(scene, goal_pose=(11.5, 5.0, 3.0))
    assert (
        check_plan(
            registry.make("pose-rrt-star", {"rounds": 20}).open(again, np.random.default_rng(5)).plan(), again
        )
        is None
    )
