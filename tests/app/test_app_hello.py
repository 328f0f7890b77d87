"""Hello: every planner and law has a form, and what it says of a setting is what the planner says."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import pytest

from lampyris._core.settings import defaults_of, number, settings_of
from lampyris.app.engine.bootstrap import _setting, hello
from lampyris.errors import LampyrisError
from lampyris.model.race.race import MOST_RACERS
from lampyris.model.robot import Robot
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.model.traffic import MAX_OBSTACLES
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry

LARGEST: dict[tuple[str, str], dict[str, Any]] = {
    ("igso", "least"): {"step": 1.0},
    ("diversity-pso", "low"): {"high": 1.0},
}
"""Settings that bound another one, at their greatest."""


def forms() -> list[tuple[str, dict[str, Any]]]:
    return [(row["name"], one) for row in hello()["planners"] for one in row["settings"]]


def test_it_is_plain_data_with_every_planner_and_law() -> None:
    told = hello()
    assert json.loads(json.dumps(told, allow_nan=False))["version"] == told["version"]
    assert [row["name"] for row in told["planners"]] == list(registry.names())
    assert {row["name"] for row in told["laws"]} == set(laws.LAWS)
    assert "guide" in told["maps"]
    assert {"octile", "dissertation"} <= set(told["moves"])
    assert hello() is told


def test_every_setting_of_ours_says_what_it_is_and_what_it_may_be() -> None:
    for name, one in forms():
        assert one["about"], (name, one)
        assert one["allowed"], (name, one)
        assert one["type"] in ("flag", "whole", "number", "word"), (name, one)
    for row in hello()["laws"]:
        for one in row["settings"]:
            assert one["about"] or "." in one["name"], (row["name"], one)
            assert one["allowed"], (row["name"], one)


def test_what_is_said_to_be_allowed_is() -> None:
    tried = 0
    for name, one in forms():
        values = [one["default"], *(one["choices"] or ())]
        if one["type"] == "flag":
            values += [True, False]
        # An end may be left out itself (more than 0): then the middle stands for the range.
        if one["most"] is not None and one["least"] is not None:
            middle = (one["least"] + one["most"]) / 2
            values += [one["most"], middle] if one["type"] == "number" else [int(one["most"]), int(middle)]
        for value in values:
            registry.make(name, {**LARGEST.get((name, one["name"]), {}), one["name"]: value})
            tried += 1
    assert tried > 200


def test_beyond_what_is_said_to_be_allowed_is_refused() -> None:
    for name, one in forms():
        if one["most"] is not None:
            with pytest.raises(LampyrisError):
                registry.make(name, {one["name"]: 2 * int(one["most"]) + 1})
        if one["choices"]:
            with pytest.raises(LampyrisError):
                registry.make(name, {one["name"]: "no-such-word"})


def test_a_guest_that_declares_no_ranges_has_a_form_all_the_same() -> None:
    @dataclass
    class Guest:
        """A planner.

        Parameters
        ----------
        speed : how fast it is.
        """

        speed: float = 1.0

    made = _setting("speed", 1.0, Guest, "speed")
    kept = (made["type"], made["default"], made["least"], made["about"])
    assert kept == ("number", 1.0, None, "how fast it is.")


def test_a_value_that_switches_off_is_in_the_range_of_the_form() -> None:
    @dataclass
    class Owner:
        drop: float = number(6.0, 1.0, 9.0, off=(0.0, "no drop"))

    assert _setting("drop", 6.0, Owner, "drop")["least"] == 0.0


def test_the_robot_s_form_is_the_robot_s_declaration() -> None:
    rows = hello()["robot"]
    assert {row["name"]: row["default"] for row in rows} == defaults_of(Robot)
    assert all(row["about"] and row["allowed"] and (row["unit"] or row["choices"]) for row in rows)
    assert [row["none"] for row in rows if row["default"] is None] == [
        "no limit",
        "v_max at the farthest point, in place",
    ]


def test_the_end_of_a_run_and_the_number_of_obstacles_are_as_declared() -> None:
    declared = settings_of(SimulationSettings)
    rows = {row["name"]: row for row in hello()["simulate"]}
    assert {name: (row["least"], row["most"]) for name, row in rows.items()} == {
        name: (one.low, one.high) for name, one in declared.items()
    }
    assert hello()["limits"]["obstacles"] == MAX_OBSTACLES
    assert hello()["limits"]["racers"] == MOST_RACERS
