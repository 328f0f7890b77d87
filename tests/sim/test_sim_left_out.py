"""What a drive leaves out because it is too far from the robot to matter changes nothing."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lampyris import api
from lampyris.model.drive import Drive
from lampyris.model.grid import Grid
from lampyris.model.scene import Scene
from lampyris.model.traffic import Crossing, RandomWalk
from lampyris.sim.traffic.continuous_traffic import RunningTraffic
from lampyris.sim.traffic.obstacle_set import ObstacleSet
from sizes import some

SCENE = Scene(Grid(np.zeros((16, 30), dtype=np.bool_)), (1, 8), (28, 8))
TRAFFIC = (RandomWalk(6), RandomWalk(1, radius=1.2), RandomWalk(3, rate=0.3), Crossing(4))


def driven(seed: int, speed: float) -> Drive:
    return api.drive(
        SCENE, traffic=TRAFFIC, seed=seed, obstacle_speed=speed, on_hit="go-on", patience=1.0, time_limit=40.0
    )


@pytest.mark.commit(1)
@pytest.mark.parametrize(
    ("seed", "speed"), some([(1, 1.0), (2, 0.4), (3, 5.0), (4, 25.0), (5, 1.0), (6, 5.0)], 3)
)
def test_a_drive_that_leaves_nothing_out_is_the_same(
    seed: int, speed: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = driven(seed, speed)
    asked = []

    def always_near(traffic: RunningTraffic) -> float:
        asked.append(traffic)
        return -math.inf

    monkeypatch.setattr(RunningTraffic, "_to_robot", always_near)
    monkeypatch.setattr(ObstacleSet, "_in_reach", lambda others, going: others.legs)
    whole = driven(seed, speed)
    assert asked
    assert made.outcome is whole.outcome
    assert made.moments == whole.moments
    for name in ("t", "s", "v", "a"):
        assert getattr(made, name).tobytes() == getattr(whole, name).tobytes()
    for one, other in zip(made.tracks, whole.tracks, strict=True):
        assert one.t.tobytes() == other.t.tobytes()
        assert one.xy.tobytes() == other.xy.tobytes()
