"""Foresight looks at pieces of the way that end beside a stop, or between stops."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from lampyris import Robot, Scene, api
from lampyris.cli.option_groups import TrafficOptions
from lampyris.cli.request import traffic_of
from lampyris.errors import LampyrisError
from lampyris.io.maps.load import load_map
from lampyris.model.drive import Drive
from lampyris.model.trace import Outcome
from lampyris.sim.continuous import lookahead
from sizes import some

pytestmark = pytest.mark.nightly


def driven(seed: int) -> Drive:
    """A robot that turns on the spot again and again among fast obstacles whose velocities it knows."""
    document = load_map("env-1")
    scene = Scene(document.grid, (11, 8), (21, 45), robot=Robot(radius=0.4, turn_radius=2.0))
    traffic = traffic_of(TrafficOptions(16, "mixed"), scene, seed)
    return api.drive(
        replace(scene, traffic=traffic),
        seed=seed,
        obstacle_info="velocities",
        on_hit="go-on",
        obstacle_speed=2.0,
    )


@pytest.mark.parametrize("seed", some([4, 0, 2]))
def test_an_end_beside_a_stop_is_no_bar(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    true, refused, beside = lookahead.through_tracks, [], 0

    def watched(course: Any, cap: Any, *rest: Any, **more: Any) -> Any:
        nonlocal beside
        beside += bool(course.stop[-2])
        try:
            return true(course, cap, *rest, **more)
        except LampyrisError as fault:
            refused.append(str(fault))
            raise

    monkeypatch.setattr(lookahead, "through_tracks", watched)
    assert driven(seed).outcome is Outcome.ARRIVED
    assert beside > 0
    assert not [told for told in refused if "for the cause limit" in told]
