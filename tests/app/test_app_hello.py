"""Hello: every planner and law has a form, and what it says of a setting is what the planner says."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import Any

import pytest

from lampyris.app.engine.bootstrap import _allowed, _setting, hello
from lampyris.errors import LampyrisError, SettingError
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry


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
            registry.make(name, {one["name"]: value})
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


@pytest.mark.parametrize(
    ("text", "kind", "told"),
    [
        ("a whole number, 1 to 10,000", "any", {"type": "whole", "least": 1.0, "most": 10000.0}),
        ("1e-06 to 1", "number", {"type": "number", "least": 1e-6, "most": 1.0}),
        ("0, or 1e-6 to 1e6", "number", {"type": "number", "least": 1e-6, "most": 1e6}),
        ("0 < rho <= 1", "number", {"type": "number", "least": 0.0, "most": 1.0}),
        ("true or false", "any", {"type": "flag"}),
        ("all or ahead", "word", {"type": "word", "choices": ["all", "ahead"]}),
        ("on, off; its settings are a.b, a.c", "any", {"type": "word", "choices": ["on", "off"]}),
        ("a finite number > 0", "number", {}),
        ("", "any", {}),
    ],
)
def test_words_of_a_refusal(text: str, kind: str, told: dict[str, Any]) -> None:
    assert _allowed(text, kind) == {**told, "allowed": text}


def test_a_guest_that_does_not_check_has_a_form_all_the_same() -> None:
    @dataclass
    class Rude:
        speed: float = 1.0

        def __post_init__(self) -> None:
            self.speed += 1  # TypeError for what is no number

    made = _setting("speed", 1.0, lambda key, value: Rude(**{key: value}), "how fast")
    assert (made["type"], made["default"], made["least"], made["about"]) == ("number", 1.0, None, "how fast")


def test_the_least_is_never_above_the_default() -> None:
    def picky(key: str, value: object) -> None:
        raise SettingError("N", "no", allowed="a whole number, 1 to 50")

    assert _setting("n", 0, picky, "")["least"] == 0
    assert _setting("n", 7, picky, "")["least"] == 1
