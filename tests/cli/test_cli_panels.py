"""``--help`` in panels, ``-h``, choices, completion, and robots from files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import typer.main

from in_process import call
from lampyris.cli.app import app
from lampyris.cli.panels import PANELS, REST, panel_of
from lampyris.cli.verb_group import VERBS as SUMMARIES

MAIN = "from lampyris.cli import main; main()"
VERBS = ("plan", "simulate", "drive", "speed", "compare", "ros")
ROBOT = {"radius": 0.3, "v_max": 0.5, "turn_radius": 0.4, "jerk_max": None}


def process(*words: str, **env: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", MAIN, *words],
        env={**os.environ, **env},
        capture_output=True,
        text=True,
        check=False,
    )


def commands() -> dict[str, Any]:
    group: Any = typer.main.get_command(app)
    return group.commands


@pytest.mark.parametrize("verb", VERBS)
def test_every_option_of_a_large_verb_stands_in_a_panel(verb: str) -> None:
    options = [p for p in commands()[verb].params if p.param_type_name == "option"]
    assert len(options) > 20
    rest = {max(p.opts, key=len) for p in options if panel_of(p, verb) == REST}
    assert rest <= {"--help", "--workers", "--live"}, rest
    assert all(p.rich_help_panel == panel_of(p, verb) for p in options)


def test_the_list_of_verbs_says_what_the_help_of_each_begins_with() -> None:
    for name, command in commands().items():
        if name in SUMMARIES:
            first = " ".join(str(command.help).strip().split("\n\n")[0].split())
            assert first == SUMMARIES[name][1], name
    assert set(SUMMARIES) <= set(commands())


def test_panels_name_options_that_exist_and_each_once() -> None:
    listed = [option for options in PANELS.values() for option in options]
    assert len(listed) == len(set(listed))
    every = [commands(), *(one.commands for one in commands().values() if hasattr(one, "commands"))]
    there = {
        word.removeprefix("--")
        for group in every
        for one in group.values()
        for p in one.params
        for word in p.opts
    }
    assert set(listed) <= there, set(listed) - there


def test_help_in_plain_text_has_the_panels_in_order() -> None:
    done = call("drive", "-h")
    assert done.stdout == call("drive", "--help").stdout
    lines = done.stdout.splitlines()
    own = [panel for panel in PANELS if panel != "Execution and tasks"]
    places = [lines.index(f"{panel}:") for panel in ("Arguments", *own, REST)]
    assert places == sorted(places)
    fleet = call("fleet", "-h").stdout.splitlines()
    driving = fleet[fleet.index("Execution and tasks:") : fleet.index("Output:")]
    for option in (
        "--execute",
        "--policy order|orca",
        "--delays",
        "--fault",
        "--lifelong",
        "--window",
        "--tasks",
    ):
        assert any(option in line for line in driving), option
    robot = lines[places[3] : places[4]]
    assert any("--v-max" in line for line in robot)
    assert any("--mobility random-walk|patrol|crossing|mixed" in line for line in lines)


def test_both_help_options_of_study_show_its_actions() -> None:
    short, long = call("study", "-h"), call("study", "--help")
    assert (short.returncode, short.stdout) == (0, long.stdout)
    assert "STUDY [OPTIONS] | ACTION ..." in short.stdout


def test_completion_names_verbs_and_options() -> None:
    env = {"_LAMPYRIS_COMPLETE": "complete_bash", "COMP_CWORD": "1", "COMP_WORDS": "lampyris pl"}
    assert process(**env).stdout.split() == ["plan", "planners"]
    env = {"_LAMPYRIS_COMPLETE": "complete_bash", "COMP_CWORD": "2", "COMP_WORDS": "lampyris plan --rob"}
    assert process(**env).stdout.split() == ["--robot"]


@pytest.mark.parametrize("name", ["robot.yaml", "robot.json"])
def test_a_robot_from_a_file_is_the_same_as_from_options(tmp_path: Path, name: str) -> None:
    file = tmp_path / name
    file.write_text(json.dumps(ROBOT))
    words = ["plan", "env-3", "--json", "--no-timing"]
    from_file = json.loads(call(*words, "--robot", str(file)).stdout)
    by_options = call(*words, "--radius", "0.3", "--v-max", "0.5", "--turn-radius", "0.4")
    assert from_file == json.loads(by_options.stdout)
    assert from_file["robot"]["v_max"] == 0.5
    for order in ([("--v-max", "2"), ("--robot", str(file))], [("--robot", str(file)), ("--v-max", "2")]):
        done = json.loads(call(*words, *(word for pair in order for word in pair)).stdout)
        assert done["robot"] == {**from_file["robot"], "v_max": 2.0}


def test_a_bad_robot_file_is_named_with_every_fault(tmp_path: Path) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text("radius: -1\nspeed: 3\n")
    done = call("plan", "env-3", "--robot", str(file))
    assert done.returncode == 3
    first, second = done.stderr.splitlines()
    assert first.startswith("error[ROBOT_LIMIT]")
    assert "bad.yaml:1:9: /radius: -1; allowed:" in first
    assert "bad.yaml:2:1: /speed: unknown key 'speed'" in second
    assert call("plan", "env-3", "--robot", str(tmp_path / "none.yaml")).returncode == 3
