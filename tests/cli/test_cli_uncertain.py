"""``lampyris uncertain``: text, JSON, a picture, refusals and exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from in_process import call

WORDS = ("uncertain", "guide", "--planner", "astar", "--radius", "0.1", "--vary", "v_max=0.8:1.2")


def test_json_has_the_distribution_and_the_shares(tmp_path: Path) -> None:
    picture = tmp_path / "u.png"
    made = call(
        *WORDS, "--vary", "radius=normal(0.1,0.01)", "--json", "--seed", "2", "--picture", str(picture)
    )
    assert made.returncode == 0
    record = json.loads(made.stdout)
    assert record["of"] == "duration"
    assert record["unit"] == "s"
    assert record["method"] == "polynomial-chaos"
    assert record["runs"] <= 300
    assert record["held_out_error"] <= 0.01
    assert list(record["quantiles"]) == ["0.05", "0.25", "0.5", "0.75", "0.95"]
    assert (
        record["sobol"]["v_max"]["total"]
        >= record["sobol"]["v_max"]["first"]
        > record["sobol"]["radius"]["total"]
    )
    assert record["vary"]["radius"] == {"distribution": "normal", "mean": 0.1, "sd": 0.01}
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_text_says_what_carries_the_spread() -> None:
    made = call(*WORDS, "--of", "energy")
    assert made.returncode == 0
    assert "J/kg" in made.stdout
    assert "v_max\t100.0%\t100.0%" in made.stdout


def test_without_a_path_the_keys_stay_and_are_null() -> None:
    made = call(*WORDS, "--json", "--radius", "3")
    assert made.returncode == 4
    record = json.loads(made.stdout)
    assert record["sobol"] is record["mean"] is record["method"] is record["nominal"] is None
    assert record.keys() == json.loads(call(*WORDS, "--json").stdout).keys()


def test_a_monte_carlo_picture_far_from_the_settings_has_room_and_errors(tmp_path: Path) -> None:
    picture = tmp_path / "u.svg"
    made = call(
        "uncertain", "guide", "--planner", "astar", "--vary", "v_max=0.2:0.3", "--vary", "a_lat_max=0.02:0.2",
        "--method", "monte-carlo", "--monte-carlo-runs", "40", "--picture", str(picture),
    )  # fmt: skip
    assert made.returncode == 0, made.stderr
    drawn = picture.read_text()
    assert "as set" in drawn
    assert "standard error" in drawn


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("uncertain", "guide"), 2, "--vary: nothing is uncertain"),
        (("uncertain", "guide", "--vary", "v_max"), 2, "--vary: 'v_max'"),
        (("uncertain", "guide", "--vary", "v_max=0:1"), 2, "--vary: v_max from 0 to 1"),
        (("uncertain", "guide", "--vary", "v_max=x"), 2, "--vary: v_max=x"),
        (("uncertain", "guide", "--vary", "speed=1:2"), 2, "is no setting that can vary"),
        ((*WORDS, "--of", "ticks"), 2, "changes in steps"),
        ((*WORDS, "--runs", "9"), 2, "--runs: 9; allowed: at least 37 for 1 input,"),
        ((*WORDS, "--vary", "radius=0.1:3"), 2, "--vary: no path in the run with v_max="),
        ((*WORDS, "--preset", "dissertation"), 2, "allowed: blind, cloud"),
        ((*WORDS, "--tolerance", "2"), 2, "--tolerance"),
        ((*WORDS, "--vary", "v_max=1:2"), 2, "given twice"),
    ],
)
def test_what_is_wrong_is_named_with_its_option(words: tuple[str, ...], code: int, said: str) -> None:
    made = call(*words)
    assert made.returncode == code
    assert said in made.stderr
