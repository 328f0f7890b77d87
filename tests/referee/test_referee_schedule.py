"""Schedules that the referee must refuse, and those it must not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lampyris import api
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Recorded
from lampyris.referee import check_plan


def scene_of(*tracks: list[tuple[int, int]], radius: float = 0.0) -> Scene:
    traffic = tuple(Recorded(tuple(t)) for t in tracks)
    return Scene(Grid(np.zeros((5, 8), dtype=bool)), (0, 2), (7, 2), traffic=traffic, robot=Robot(radius))


def plan_in(scene: Scene) -> Plan:
    plan = api.plan(scene, "sipp")
    assert check_plan(plan, scene) is None
    return plan


def rule(plan: Plan, scene: Scene) -> str:
    broken = check_plan(plan, scene)
    return "" if broken is None else broken.rule


def test_ticks_must_rise_and_fit_the_cells() -> None:
    scene = scene_of()
    plan = plan_in(scene)
    ticks = plan.schedule
    assert ticks is not None
    assert rule(replace(plan, schedule=ticks[:-1]), scene) == "schedule"
    assert rule(replace(plan, schedule=ticks - 1), scene) == "schedule"
    still = ticks.copy()
    still[3] = still[2]
    assert rule(replace(plan, schedule=still), scene) == "schedule"


@pytest.mark.parametrize(
    ("track", "broken"),
    [
        ([(3, 2)], "together"),
        ([(3, 0), (3, 1), (3, 2), (3, 2)], "together"),
        ([(7, 2), (6, 2), (5, 2), (4, 2), (3, 2)], "swap"),
        ([(4, 1), (4, 1), (4, 1), (4, 1), (4, 0)], ""),
        ([(0, 0), (1, 0), (2, 0)], ""),
    ],
)
def test_known_tracks_are_kept_clear_of(track: list[tuple[int, int]], broken: str) -> None:
    straight = plan_in(scene_of())
    assert rule(straight, scene_of(track)) == broken


def test_a_crossing_in_one_block_is_seen() -> None:
    scene = replace(scene_of(), start=(0, 0), goal=(2, 2))
    plan = plan_in(scene)
    assert plan.cells is not None
    assert plan.cells.tolist() == [[0, 0], [1, 1], [2, 2]]
    crossing = (Recorded(((1, 0), (0, 1))),)
    assert rule(plan, replace(scene, traffic=crossing)) == "cross"


def test_discs_are_judged_by_what_they_cover() -> None:
    wide = scene_of(radius=0.6)
    assert rule(plan_in(wide), scene_of([(3, 1)], radius=0.6)) == "together"
    assert rule(plan_in(wide), scene_of([(3, 0)], radius=0.6)) == ""


def test_plans_that_ask_again_are_not_held_to_tracks() -> None:
    plan = replace(plan_in(scene_of()), commit=1)
    assert rule(plan, scene_of([(3, 2)])) == ""


def test_what_sipp_answers_among_recorded_obstacles_passes() -> None:
    rng = np.random.default_rng(2)
    straight, in_the_way = plan_in(scene_of()), 0
    for _ in range(30):
        tracks = []
        for _ in range(4):
            x, y = int(rng.integers(1, 7)), int(rng.integers(0, 5))
            track = [(x, y)]
            for dx, dy in rng.integers(-1, 2, (12, 2)).tolist():
                x, y = min(max(x + dx, 1), 6), min(max(y + dy, 0), 4)
                track.append((x, y))
            tracks.append(track)
        scene = scene_of(*tracks)
        plan = api.plan(scene, "sipp")  # refereed
        assert plan
        in_the_way += rule(straight, scene) != ""
    assert in_the_way > 3
