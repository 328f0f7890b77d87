"""A plan's schedule as the robot drives it."""

from __future__ import annotations

import numpy as np
import pytest

from lampyris import api
from lampyris.errors import SettingError, UsageError
from lampyris.model.grid import Grid
from lampyris.model.plan import Plan, Status
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.traffic import Patrol, Recorded
from lampyris.motion.timing.obstacle_tracks import tracks_from_recorded
from lampyris.motion.timing.scheduled import divided, scheduled_profile
from lampyris_selfcheck.reference.motion.path_time import least_gap


def corridor() -> Scene:
    """A corridor with a crossing street; somebody comes down the street when the robot would be there."""
    blocked = np.ones((11, 16), dtype=bool)
    blocked[5, :] = False
    blocked[:, 8] = False
    down = Recorded((*(((8, 0),) * 6), *((8, y) for y in range(11))))
    parked = Patrol(((0, 5),))
    return Scene(
        Grid(blocked, resolution=0.5), (0, 5), (15, 5), robot=Robot(radius=0.1), traffic=(parked, down)
    )


@pytest.mark.parametrize("planner", ["sipp", "space-time-astar"])
def test_it_meets_nobody_and_says_for_whom_it_waits(planner: str) -> None:
    scene = corridor()
    scene = Scene(scene.grid, scene.start, scene.goal, robot=scene.robot, traffic=scene.traffic[1:])
    plan = api.plan(scene, planner=planner)
    both = corridor()
    waits = 0
    for tick in (0.25, 0.4, 0.5, 0.75, 1.0):
        p = scheduled_profile(plan, both, tick)
        course = divided(plan.path, 0.5, scene.robot)
        tracks = tracks_from_recorded(both.traffic, tick, 0.5)
        assert len(tracks) == 1
        assert least_gap(p, course, tracks, 0.1, dense=20001) > -1e-7
        assert p.s[-1] == pytest.approx(7.5)
        assert p.v[-1] == 0.0
        for k, word in enumerate(p.cause):
            if word in ("wait", "moving obstacle"):
                assert p.why(k) == f"{word} 1"
                waits += 1
    assert waits > 0


def test_no_path_no_profile() -> None:
    with pytest.raises(SettingError) as error:
        scheduled_profile(Plan(Status.NO_PATH, "sipp"), corridor(), 0.5)
    assert error.value.code == "NO_PATH"


def test_the_front_door_knows_the_way_in() -> None:
    both = corridor()
    scene = Scene(both.grid, both.start, both.goal, robot=both.robot, traffic=both.traffic[1:])
    plan = api.plan(scene, planner="sipp")
    waits = 0
    for tick in (0.25, 0.4, 0.5, 0.75, 1.0):
        made = api.speed_profile(scene, plan, tick_seconds=tick)
        assert made.t.tolist() == scheduled_profile(plan, scene, tick).t.tolist()
        assert made.duration >= api.speed_profile(scene, plan, "optimum").duration
        waits += sum(word in ("wait", "moving obstacle") for word in made.cause)
        # A node at least every quarter of a step, whatever the lattice of the search is.
        assert np.diff(made.s).max() <= 0.125 * (1 + 1e-9)
    assert waits > 0
    for bad in ({"law": "rpp"}, {"smooth": "arcs"}, {"v0": 0.1}, {"spacing": 0.1}):
        with pytest.raises(UsageError, match="SCHEDULE"):
            api.speed_profile(scene, plan, tick_seconds=0.5, **bad)  # type: ignore[arg-type]
    with pytest.raises(UsageError, match="SCHEDULE"):
        api.speed_profile(scene, plan.path, tick_seconds=0.5)  # type: ignore[arg-type]
    with pytest.raises(SettingError, match="TICK"):
        api.speed_profile(scene, plan, tick_seconds=0.0)
