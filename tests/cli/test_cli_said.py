"""Settings that a verb accepts have their effect, or it says that they have none, or less."""

from __future__ import annotations

import json
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest

import lampyris
from in_process import call
from lampyris.cli.verbs.plan import print_plan
from lampyris.planning.base import Budget
from lampyris.planning.sampling.rrt_star import BitStar


def said(*words: str) -> tuple[dict[str, Any], str]:
    """What a call answers in JSON, and its remarks."""
    done = run(*words, "--json", "--no-timing")
    found = json.loads(done.stdout)
    assert isinstance(found, dict)
    return found, done.stderr


def run(*words: str) -> CompletedProcess[str]:
    done = call(*words)
    assert done.returncode == 0, done.stderr
    return done


def test_plan_keeps_turn_radius_and_a_lat_max() -> None:
    usual, quiet = said("plan", "env-1")
    assert usual["corners"] == {"turns": 21, "stops": 0}
    assert quiet == ""
    asked, _ = said("plan", "env-1", "--turn-radius", "5", "--a-lat-max", "0.01")
    assert asked["cells"] == usual["cells"]
    assert asked["corners"] == {"turns": 21, "stops": 21}
    assert asked["speed"]["duration"] > usual["speed"]["duration"] + 21
    slow, _ = said("plan", "env-1", "--a-lat-max", "0.01")
    assert slow["speed"]["duration"] > 5 * usual["speed"]["duration"]
    assert (
        "0 rounded within half a step, 21 stops to turn" in run("plan", "env-1", "--turn-radius", "5").stdout
    )


def test_limits_without_effect_are_named() -> None:
    found, err = said("plan", "guide", "--preset", "dissertation", "--turn-radius", "5")
    assert "turn_radius without effect: the law dissertation speaks of velocity units" in err
    assert found["corners"] is None
    crowd = ("--obstacles", "0")
    _, err = said("simulate", "guide", "--a-lat-max", "0.5", "--turn-radius", "5", *crowd)
    assert "a_lat_max, turn_radius without effect: a simulation goes from cell to cell" in err
    _, err = said("simulate", "guide", *crowd)
    assert "without effect" not in err
    _, err = said("plan", "guide", "--cost-scaling-factor", "3")
    assert "cost_scaling_factor without effect: the inflation_radius is 0" in err
    _, err = said("plan", "guide", "--cost-scaling-factor", "3", "--inflation-radius", "1")
    assert "without effect" not in err


def test_attributes_that_are_weakened_are_said_by_every_verb() -> None:
    told = "min_clearance 10 was weakened to 0 cells: no path to the goal keeps more"
    asked = ("env-1", "--set", "min_clearance=10", "--set", "choice=exact")
    found, _ = said("plan", *asked)
    assert found["notes"] == [told]
    assert found["attributes"]["min_clearance"] == 0
    assert "min_clearance 10 was weakened to 0" in " ".join(run("plan", *asked).stdout.split())
    found, err = said("speed", *asked, "--laws", "physical")
    assert found["path"]["notes"] == [told]
    assert f"note: {told}" in err
    shaped = ("--set", "obstacle_density_weight=2", "--laws", "physical", "--smooth", "straight")
    kept = "--smooth straight without effect: the path was planned with obstacle_density_weight, so only its corners are rounded"
    found, err = said("speed", "env-1", *shaped)
    assert found["path"]["notes"] == [kept]
    assert f"note: {kept}" in err
    for verb in ("simulate", "drive"):
        found, err = said(verb, *asked, "--obstacles", "0")
        assert found["notes"] == [told]
        assert f"note: {told}" in err


def test_a_drive_says_that_its_way_is_not_drawn_taut() -> None:
    told = "the path is not pulled straight: the path was planned with obstacle_density_weight, so only its corners are rounded"
    shaped = ("env-1", "--set", "obstacle_density_weight=2", "--obstacles", "0")
    found, err = said("drive", *shaped)
    assert found["notes"] == [told]
    assert f"note: {told}" in err
    for quiet in ((*shaped, "--smooth", "none"), ("env-1", "--obstacles", "0")):
        assert said("drive", *quiet)[0]["notes"] == []


def test_a_plan_without_time_to_judge_it_is_printed_without_what_is_not_known(
    capsys: pytest.CaptureFixture[str],
) -> None:
    scene = lampyris.Scene(lampyris.load_grid("rooms-20"), start=(1, 1), goal=(18, 18))
    rng = np.random.default_rng(0)
    # As of a session: nothing has compared it with the optimum, or looked for gates.
    found = BitStar(samples=500).open(scene, rng, record=False).plan(None)
    assert found.status.value == "found"
    print_plan(found, scene, None, explain=False)
    out = capsys.readouterr().out
    assert "; best not known, no time was left to find it\n" in out
    assert "gates:" not in out
    stopped = BitStar(seed_after=None).open(scene, rng, record=False).plan(None, Budget(expansions=1))
    assert stopped.status.value == "limit"
    print_plan(stopped, scene, None, explain=False)
    assert "gates:" not in capsys.readouterr().out
    judged = lampyris.plan(scene, "bit-star", samples=500)
    print_plan(judged, scene, None, explain=False)
    out = capsys.readouterr().out
    assert f"; best {judged.optimal_cost:.6g}, gap 1.67%" in out
    assert "gates: on the path:" in out
