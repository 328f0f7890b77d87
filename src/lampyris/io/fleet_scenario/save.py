"""From a scenario of a fleet to a file that says all of it, in YAML or JSON."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from lampyris.errors import SettingError
from lampyris.io.fleet_scenario.scenario import FleetScenario, Lifelong
from lampyris.io.fleet_scenario.schema import FleetScenarioFile
from lampyris.io.scenario.save import (
    check_ending,
    plain_map,
    plain_robot,
    plain_settings,
    write_plain,
)
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.typing import Cell


def write_fleet_scenario(scenario: FleetScenario, path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Write a scenario of a fleet, complete, its robots listed; an existing file is replaced.

    Returns
    -------
    Notes for the user: what running the file will need.

    Raises
    ------
    UsageError : another ending than .yaml, .yml and .json.
    SettingError : robots that differ in more than their radius; a map that is in no file and cannot be written as rows.
    LimitError : longer than such a file may be.
    FileError : it cannot be written.
    """
    target = check_ending(path)
    return write_plain(target, plain(scenario, target.parent), FleetScenarioFile)


def plain(scenario: FleetScenario, folder: Path) -> dict[str, Any]:
    """Everything that decides the run as plain data, nothing left to a default.

    Parameters
    ----------
    scenario : its settings should be complete: see :func:`lampyris.scenarios.completed_fleet`.
    folder : what the map's path is relative to.
    """
    fleet, coarse = scenario.fleet, scenario.ground is not None
    robot = _common(fleet)
    data: dict[str, Any] = {"version": 1}
    if scenario.name:
        data["name"] = scenario.name
    data |= plain_map(scenario.drawn, scenario.map, folder)
    if coarse:
        data["cell"] = fleet.grid.resolution
    data["fleet"] = {"agents": [_agent(one, robot, fleet.grid, coarse) for one in fleet.robots]}
    if robot is not None:
        data["robot"] = plain_robot(robot)
    data["moves"] = scenario.moves
    name, settings = scenario.planner, plain_settings(scenario.planner, scenario.settings)
    data["planner"] = name if scenario.lifelong is not None else {"name": name, "settings": settings}
    data["budget"] = {"iterations": scenario.iterations, "seconds": scenario.seconds}
    data["seed"] = scenario.seed
    if scenario.execution is not None:
        one = scenario.execution
        data["execute"] = {**plain_settings("execute", one.settings), "delays": asdict(one.delays)}
    if scenario.lifelong is not None:
        data["lifelong"] = _lifelong(scenario.lifelong, fleet.grid, coarse)
    if scenario.faults:
        data["faults"] = [{"robot": robot, "time": float(time)} for robot, time in scenario.faults]
    return data


def _common(fleet: Fleet) -> Robot | None:
    """What the robots have in common, with the radius of the first; None: no robot says anything.

    Raises
    ------
    SettingError : they differ in more than their radius.
    """
    robots = [one.robot for one in fleet.robots]
    first = next((one for one in robots if one is not None), None)
    if first is None:
        return None
    for k, one in enumerate(robots):
        if one is None or replace(one, footprint=None, radius=0.0) != replace(
            first, footprint=None, radius=0.0
        ):
            raise SettingError(
                "FLEET_ROBOT", "differs from the first robot in more than its radius", where=f"robots[{k}].robot",
                allowed="robots with the same limits and drive", todo="a scenario file has one `robot` for all",
            )  # fmt: skip
    return replace(first, footprint=None, radius=first.radius)


def _agent(one: Any, robot: Robot | None, grid: Grid, coarse: bool) -> dict[str, Any]:
    ends = {"start": _place(one.start, grid, coarse), "goal": _place(one.goal, grid, coarse)}
    if robot is not None and one.robot.radius != robot.radius:
        ends["radius"] = one.robot.radius
    if one.tasks:
        ends["tasks"] = [_place(stop, grid, coarse) for stop in one.tasks]
    return ends


def _place(cell: Cell, grid: Grid, coarse: bool) -> Any:
    """A cell; of a coarse map its centre in metres, since pairs are cells of the map as it was drawn."""
    return {"m": grid.to_metres(cell).tolist()} if coarse else list(cell)


def _lifelong(one: Lifelong, grid: Grid, coarse: bool) -> Mapping[str, Any]:
    tasks = one.tasks
    listed = None
    if tasks is not None:
        listed = [
            {"stops": [_place(stop, grid, coarse) for stop in task.stops], "release": task.release, "robot": task.robot}
            for task in tasks
        ]  # fmt: skip
    return {"ticks": one.ticks, "window": one.window, "tasks": listed}
