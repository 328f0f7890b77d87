"""``lampyris chain``: bundled scenes and files, text, JSON, a picture, refusals and exit codes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from in_process import call
from lampyris.cli.verbs.chain.command import PLANNERS
from lampyris.cli.verbs.chain.scenes import BUNDLED, scene_of
from lampyris.planning.chain import rrt

SCENE = """map: arm.txt
resolution: 0.5
base: [1.0, 1.0]
links: [0.6, 0.5]
widths: 0.1
joint_limits: [-2.6, 2.6]
start: [0.0, 0.0]
goal: [0.6, 0.3]
"""


def test_the_planners_are_those_there_are() -> None:
    assert PLANNERS == rrt.PLANNERS


def test_a_bundled_scene_as_text_json_and_picture(tmp_path: Path) -> None:
    picture = tmp_path / "chain.png"
    shown = call("chain", "open", "--links", "3", "--picture", str(picture))
    assert shown.returncode == 0, shown.stderr
    assert "joints sampled: 0 of 3" in shown.stdout
    assert picture.stat().st_size > 1000
    record = json.loads(call("chain", "open", "--links", "3", "--json").stdout)
    assert record["status"] == "found"
    assert record["chain"]["links"] == [4.0 / 3] * 3
    assert record["configurations"][0] == record["start"]
    assert record["configurations"][-1] == record["goal"]
    assert record["released"] == []


def test_bundled_scenes_have_ends_that_are_free() -> None:
    for name in BUNDLED:
        scene = scene_of(name, None)
        search = rrt.ChainSearch(scene.grid, scene.chain, rrt.RrtSettings())
        assert scene.chain.joints == len(scene.start) == len(scene.goal)
        assert not any(search.collides(np.array(q)) for q in (scene.start, scene.goal)), name
    for links in (1, 2, 4, 8, 20, 64):
        assert scene_of("tip", links).chain.reach == pytest.approx(4.0)


def test_a_scene_file_with_its_map_beside_it(tmp_path: Path) -> None:
    (tmp_path / "arm.txt").write_text("......\n......\n......\n......\n")
    path = tmp_path / "arm.yaml"
    path.write_text(SCENE)
    record = json.loads(call("chain", str(path), "--json").stdout)
    assert record["status"] == "found"
    assert record["map"]["resolution"] == 0.5
    none = call("chain", str(path), "--samples", "1", "--planner", "rrt")
    assert none.returncode in (0, 5)
    path.write_text(SCENE.replace("[0.0, 0.0]", "[3.0, 0.0]"))
    assert call("chain", str(path)).returncode == 3
    path.write_text(SCENE.replace("base: [1.0, 1.0]", "base: [0.0, 0.0]"))
    assert call("chain", str(path)).returncode == 4  # half of the first link is off the map


@pytest.mark.parametrize(
    ("change", "place", "words"),
    [
        (("links: [0.6, 0.5]", "links: [0.6, x]"), 4, "links is not a list of numbers"),
        (("widths: 0.1", "width: 0.1"), 5, "unknown key 'width'"),
        (("goal: [0.6, 0.3]", "goal: [0.6]"), 8, "2 finite angles"),
        (("links: [0.6, 0.5]", "links: [0.6, -0.5]"), 4, "error[CHAIN]"),
        (("map: arm.txt\n", ""), 1, "no map"),
    ],
)
def test_a_wrong_scene_file_names_the_line(
    change: tuple[str, str], place: int, words: str, tmp_path: Path
) -> None:
    (tmp_path / "arm.txt").write_text("....\n" * 4)
    path = tmp_path / "arm.yaml"
    path.write_text(SCENE.replace(*change))
    refused = call("chain", str(path))
    assert refused.returncode == 3
    assert f"{path}:{place}:" in refused.stderr
    assert words in refused.stderr


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        (("chain", "nix"), 3, "no such scene"),
        (("chain", "gap", "--links", "3"), 2, "--links: 3 links; allowed: 8"),
        (("chain", "open", "--links", "65"), 2, "--links"),
        (("chain", "open", "--planner", "prm"), 2, "--planner"),
        (("chain", "post", "--samples", "1", "--planner", "rrt"), 5, ""),
    ],
)
def test_refusals(words: tuple[str, ...], code: int, said: str) -> None:
    made = call(*words)
    assert made.returncode == code, made.stderr
    assert said in made.stderr
