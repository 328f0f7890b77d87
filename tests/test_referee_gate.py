"""Nothing that was run is given out unless the referee agrees: a robot that jumped is stopped at each door.

Plans and profiles have theirs in test_api.py and test_api_speed.py.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import lampyris
from lampyris.app.engine import simulation as watched
from lampyris.errors import InternalFault
from lampyris.io.scenario.scenario import Scenario
from lampyris.model.scene import Scene
from lampyris.sim.grid.loop import Simulation
from lampyris.sim.steering import controller_choice as driving

SCENE = Scene(lampyris.Grid(np.zeros((6, 9), bool)), (0, 0), (8, 5))


@pytest.fixture
def jumped(monkeypatch: pytest.MonkeyPatch) -> None:
    """The robot is told to have been elsewhere for a moment."""
    trace_of, drive_of = Simulation.trace, driving.drive

    def trace(run: Simulation) -> Any:
        found = trace_of(run)
        robot = found.robot.copy()
        robot[2] = (8, 0)
        return replace(found, robot=robot)

    def drive(*given: Any, **more: Any) -> Any:
        found = drive_of(*given, **more)
        s = found.s.copy()
        s[len(s) // 2] += 0.5
        return replace(found, s=s)

    monkeypatch.setattr(Simulation, "trace", trace)
    monkeypatch.setattr(driving, "drive", drive)


def test_what_is_sound_passes() -> None:
    assert lampyris.simulate(SCENE, "astar").arrived
    assert lampyris.drive(SCENE, "astar").arrived


@pytest.mark.usefixtures("jumped")
def test_no_simulation_passes() -> None:
    with pytest.raises(InternalFault):
        lampyris.simulate(SCENE, "astar")


@pytest.mark.usefixtures("jumped")
def test_no_drive_passes() -> None:
    with pytest.raises(InternalFault):
        lampyris.drive(SCENE, "astar")


@pytest.mark.usefixtures("jumped")
def test_no_run_in_the_app_ends_with_it() -> None:
    run = watched.begin(Scenario(SCENE, planner="astar"))
    for _ in watched.watch(run, lambda: None):
        pass
    with pytest.raises(InternalFault):
        watched.finish(run)
