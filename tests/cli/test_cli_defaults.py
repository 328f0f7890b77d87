"""A setting has one default, anyone who tells it: options, their help, Python, scenario files, their schema."""

from __future__ import annotations

import inspect
from dataclasses import fields
from typing import Any

import click
import pytest
import typer

from lampyris import api
from lampyris._core.defaults import DRIVE_SPACING, SAMPLE_SPACING, SIMULATION_PATIENCE
from lampyris._core.settings import defaults_of, settings_of
from lampyris.cli.app import app
from lampyris.io.scenario.run_settings import DriveTable, SimulateTable
from lampyris.io.scenario.schema import RobotTable, ScenarioFile
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.scene import Scene
from lampyris.model.settings.drive import DriveSettings
from lampyris.model.settings.simulation import SimulationSettings
from lampyris.planning.graph.astar import AStar
from lampyris.sim.continuous.replanner import Replanner
from lampyris.sim.grid import loop

GROUP: Any = typer.main.get_command(app)
VERBS = ("plan", "simulate", "drive", "speed", "compare")


def options(verb: str) -> dict[str, click.Option]:
    """The options of a verb by the name that Python knows them by."""
    return {one.opts[0].lstrip("-").replace("-", "_"): one for one in GROUP.commands[verb].params}


@pytest.mark.parametrize("verb", VERBS)
def test_the_robot_of_a_verb_is_the_robot_of_python(verb: str) -> None:
    robot, given = Robot(), options(verb)
    named = [f.name for f in fields(Robot) if f.name in given]
    assert len(named) >= 6
    for name in named:
        assert given[name].default == getattr(robot, name), name


def test_the_robot_of_a_scenario_is_the_robot_of_python() -> None:
    robot = Robot()
    assert set(RobotTable.model_fields) - {f.name for f in fields(Robot)} == {
        "rectangle"
    }  # a footprint in short
    for name, field in RobotTable.model_fields.items():
        if name == "rectangle":
            continue
        assert field.default == getattr(robot, name), name


@pytest.mark.parametrize("verb", VERBS)
def test_an_option_that_has_a_default_has_the_same_everywhere(verb: str) -> None:
    given, first = options(verb), options("plan")
    python = {"plan": api.plan, "simulate": api.simulate, "drive": api.drive, "speed": api.speed_profile}
    signature = inspect.signature(python.get(verb, api.plan)).parameters
    for name in ("planner", "seed", "law", "v0"):
        if name in given and given[name].default is not None and name in signature:
            assert given[name].default == signature[name].default, name
    for name, one in given.items():
        if name in first and one.default is not None and first[name].default is not None:
            assert one.default == first[name].default, name
    for name in ("planner", "seed"):
        if name in given and given[name].default is not None:
            assert given[name].default == ScenarioFile.model_fields[name].default, name


@pytest.mark.parametrize(
    ("verb", "kind", "table"),
    [("drive", DriveSettings, DriveTable), ("simulate", SimulationSettings, SimulateTable)],
)
def test_options_and_files_have_the_declared_defaults(verb: str, kind: type, table: Any) -> None:
    given = options(verb)
    for name, setting in settings_of(kind).items():
        default = defaults_of(kind)[name]
        assert table.model_fields[name].default == default, name
        assert given[name].default == default, name
        if setting.none:
            assert f"(default: {setting.none})" in (given[name].help or ""), name
            assert f"Null: {setting.none}." in table.model_fields[name].description, name


def test_the_spacing_of_a_drive_is_declared_once() -> None:
    scene = Scene(Grid([[False] * 3] * 3, resolution=2.0), (0, 0), (2, 2))
    planner = AStar()
    assert Replanner(scene, planner, 0, "arcs", None).spacing == 2.0 * DRIVE_SPACING
    for text in (options("drive")["spacing"].help, DriveTable.model_fields["spacing"].description):
        assert f"{DRIVE_SPACING:g} of a cell" in (text or "")
    assert f"{SAMPLE_SPACING:g} of a cell" in (options("speed")["spacing"].help or "")


def test_the_patience_of_a_simulation_is_declared_once() -> None:
    assert loop.PATIENCE == SIMULATION_PATIENCE
    assert settings_of(SimulationSettings)["patience"].none == f"{SIMULATION_PATIENCE}"


def test_a_verb_has_the_options_of_its_groups_by_themselves() -> None:
    for verb in VERBS:
        assert {"resolution", "start", "v_max", "preset"} <= set(options(verb)), verb
        assert not {"ends", "rules", "traffic", "map_options"} & set(options(verb)), verb
