"""From a scenario file of a fleet to the scenario: every mistake is reported with its place."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

from lampyris.errors import FileError, LampyrisError, SceneError, SettingError
from lampyris.io.fleet_files import FleetFile, read_agents, read_scen_fleet
from lampyris.io.fleet_scenario import schema as form
from lampyris.io.fleet_scenario.scenario import (
    LIFELONG_PLANNER,
    MOVES,
    PLANNER,
    FleetExecution,
    FleetScenario,
    Lifelong,
)
from lampyris.io.maps.coarse import coarse_cell, coarse_fleet, coarse_grid, coarse_note, coarse_tasks
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.maps.map_hash import map_hash
from lampyris.io.scenario.map_source import Files, Mistakes, placed, setting_path
from lampyris.io.scenario.robot_table import robot_of
from lampyris.io.scenario.scenario import MapSource
from lampyris.io.scenario.schema import Point
from lampyris.io.scenario.validation_errors import Document, faults_of, raise_all, spot
from lampyris.io.task_files import read_tasks
from lampyris.io.text.strict_yaml import KeyPath, shown
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.fleet.lifelong import FleetTask
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.typing import Cell

FAR = 2**31
"""Cells, or metres, that no map reaches."""
T = TypeVar("T")
Draw = Callable[[Grid, int, int, float], Fleet]
"""Draws a fleet: map, robots, seed, and the radius in metres that they need room for."""
MakePlanner = Callable[[str, Mapping[str, Any], bool], object]
"""Whether there is such a planner with such settings, of windows if the last argument says so."""


def fleet_scenario_of(parsed: Document, planner: MakePlanner, draw: Draw, files: Files) -> FleetScenario:
    """The scenario that a file says.

    Parameters
    ----------
    parsed : the file.
    planner : knows planners of fleets by name; asked, not imported.
    draw : draws random fleets.
    files : where files are that it names.

    Raises
    ------
    LampyrisError : the first mistake in the file; the others are its notes.
    """
    from pydantic import ValidationError

    try:
        file = form.FleetScenarioFile.model_validate(parsed.data)
    except ValidationError as problem:
        raise_all(faults_of(parsed, problem, form.FleetScenarioFile), problem.error_count())
    return _Build(parsed, file, planner, draw, files).scenario()


def robot_for(common: Robot | None, own: Robot | None) -> Robot | None:
    """An agent's robot: with its own radius and the limits that are common to all."""
    if own is None or common is None:
        return common if own is None else own
    return replace(common, footprint=None, radius=own.radius)


def with_robot(fleet: Fleet, robot: Robot | None) -> Fleet:
    """The fleet with a robot for all; agents that have a radius of their own keep it."""
    if robot is None:
        return fleet
    return Fleet(fleet.grid, [replace(one, robot=robot_for(robot, one.robot)) for one in fleet.robots])


def without_goals(fleet: Fleet) -> Fleet:
    """The robots, each at its start until it has a task."""
    return Fleet(fleet.grid, [Agent(one.start, one.start, one.robot) for one in fleet.robots])


class _Build:
    """Makes nouns of a checked file, and collects what is wrong with them."""

    def __init__(
        self, parsed: Document, file: form.FleetScenarioFile, planner: MakePlanner, draw: Draw, files: Files
    ) -> None:
        self.parsed, self.file, self.files = parsed, file, files
        self._planner_known, self._draw = planner, draw
        self.faults = Mistakes(parsed)
        self.notes: list[str] = []

    def scenario(self) -> FleetScenario:
        """The scenario, or every mistake."""
        file = self.file
        planner, settings = self._planner()
        robot = None if file.robot is None else self.tried(("robot",), robot_of, file.robot.model_dump())
        found = self.tried(("map",), self._map)
        execution = None if file.execute is None else self.tried(("execute",), self._execution, file.execute)
        coarse = None
        if found is not None:
            coarse = found[0].grid
            if file.cell is not None:
                coarse = self.tried(("cell",), coarse_grid, coarse, file.cell)
        self._together()
        if found is None or coarse is None or self.faults:
            self.faults.give()
        kind = next(key for key in form.FLEET_KEYS if hasattr(file.fleet, key))
        read = self.tried(("fleet", kind), self._fleet, found[0], coarse, robot)
        lifelong = None
        if file.lifelong is not None and read is not None:
            lifelong = self.tried(
                ("lifelong",), self._lifelong, file.lifelong, read.tasks, found[0].grid, coarse
            )
        if read is None or self.faults:
            self.faults.give()
        drawn = isinstance(file.fleet, form.RandomFleet)
        fleet = self.tried(("robot",), with_robot, read.fleet, robot)
        nobody_gave = read.tasks is not None or drawn
        if fleet is not None and lifelong is not None and lifelong.tasks is not None and nobody_gave:
            fleet = without_goals(fleet)  # goals that were drawn, or put in for tasks, would be tasks, too
        if fleet is None:
            self.faults.give()
        self._check_numbers(len(fleet.robots))
        if file.lifelong is None and any(one.tasks for one in fleet.robots):
            self.notes.append("tasks of robots without effect: they are for `lifelong`")
        if self.faults:
            self.faults.give()
        return FleetScenario(
            fleet, planner, settings, file.moves, file.seed, file.budget.iterations, file.budget.seconds, execution,
            lifelong, tuple((one.robot, one.time) for one in file.faults), file.name or "", found[1],
            None if coarse is found[0].grid else found[0].grid, tuple(self.notes), self.parsed.where,
        )  # fmt: skip

    def _check_numbers(self, robots: int) -> None:
        """Keep a mistake for each fault, and each task, of a robot that is not there."""
        file, numbers = self.file, f"0 to {robots - 1}"
        failed: set[int] = set()
        for k, one in enumerate(file.faults):
            if one.robot >= robots:
                fault = SettingError("FAULTS", f"robot {one.robot}", allowed=numbers)
                self.faults.keep(("faults", k, "robot"), fault)
            elif one.robot in failed:
                fault = SettingError("FAULTS", f"robot {one.robot} a second time", allowed="each robot once")
                self.faults.keep(("faults", k, "robot"), fault)
            failed.add(one.robot)
            if file.lifelong is not None and one.time % 1:
                fault = SettingError("FAULTS", f"{one.time:g}", allowed="a whole tick with `lifelong`")
                self.faults.keep(("faults", k, "time"), fault)
        listed = None if file.lifelong is None else file.lifelong.tasks
        for k, task in enumerate(listed or ()):
            if task.robot is not None and task.robot >= robots:
                fault = SettingError("TASK", f"robot {task.robot}", allowed=numbers)
                self.faults.keep(("lifelong", "tasks", k, "robot"), fault)

    def tried(self, key_path: KeyPath, make: Callable[..., T], *given: Any) -> T | None:
        """What ``make(*given)`` makes; None, with the mistake kept, if it cannot."""
        try:
            return make(*given)
        except LampyrisError as fault:
            self.faults.keep(key_path, fault)
        return None

    def _planner(self) -> tuple[str, Mapping[str, Any]]:
        given: Any = self.file.planner
        if given is None:
            return PLANNER if self.file.lifelong is None else LIFELONG_PLANNER, {}
        name, settings = (given, {}) if isinstance(given, str) else (given.name, given.settings)
        try:
            self._planner_known(name, settings, self.file.lifelong is not None)
        except LampyrisError as fault:
            path = setting_path(fault, settings)
            at: KeyPath = ("planner", "settings", *path) if path else ("planner",)
            self.faults.keep(at if path or isinstance(given, str) else ("planner", "name"), fault)
        return name, settings

    def _together(self) -> None:
        """Keys that do not go together."""
        file = self.file
        lifelong: Any = file.lifelong
        if lifelong is not None:
            others = {
                "execute": file.execute is not None,
                "moves": file.moves != MOVES,
                "budget": file.budget.iterations is not None,
            }
            for key in (key for key, there in others.items() if there):
                what = "`iterations`" if key == "budget" else f"`{key}`"
                self.faults.keep((key,), FileError("KEY", f"{what} with `lifelong`", allowed="one of them"))
            if not isinstance(file.planner, str | None) and file.planner.settings:
                fault = FileError("KEY", "settings of the planner with `lifelong`", allowed="a name alone")
                self.faults.keep(("planner", "settings"), fault)
            if lifelong.tasks is not None and lifelong.tasks_file is not None:
                fault = FileError("KEY", "`tasks` and `tasks_file`", allowed="one of them")
                self.faults.keep(("lifelong", "tasks_file"), fault)
        elif file.execute is not None:
            self._reactive(file.execute)
        elif file.faults:
            fault = FileError(
                "KEY", "`faults` of robots that do not drive", allowed="with `execute` or `lifelong`"
            )
            self.faults.keep(("faults",), fault)

    def _reactive(self, table: Any) -> None:
        """Keys that the policy orca does not know."""
        if table.policy != "orca":
            return
        allowed = "policy: order; orca knows no delays and no faults"
        if table.delays.probability:
            self.faults.keep(("execute", "delays"), FileError("KEY", "`delays` with orca", allowed=allowed))
        if self.file.faults:
            self.faults.keep(("faults",), FileError("KEY", "`faults` with orca", allowed=allowed))
        if self.file.budget.iterations is not None or self.file.budget.seconds is not None:
            fault = FileError("KEY", "`budget` with orca", allowed="policy: order; orca makes no plan")
            self.faults.keep(("budget",), fault)

    def _map(self) -> tuple[MapDocument, MapSource | None]:
        found, source = self.files.map_of(self.file.map, ("map",))
        self.notes += found.notes
        if self.file.map_hash is not None and (given := map_hash(found.grid)) != self.file.map_hash:
            raise SettingError(
                "MAP_HASH", f"the map's hash is {given}", allowed=f"{self.file.map_hash}, the scenario's map_hash",
                todo="the map has changed; give the old one back, or take map_hash out",
            )  # fmt: skip
        return found, source

    def _execution(self, table: Any) -> FleetExecution:
        given: dict[str, Any] = table.model_dump()
        delays = Delays(**given.pop("delays"))
        FleetDriveSettings.of(given)
        return FleetExecution(given, delays)

    # ---- robots --------------------

    def _fleet(self, document: MapDocument, coarse: Grid, robot: Robot | None) -> FleetFile:
        spec = self.file.fleet
        if isinstance(spec, form.RandomFleet):
            seed = self.file.seed if spec.seed is None else spec.seed
            read = FleetFile(self._draw(coarse, spec.random, seed, 0.0 if robot is None else robot.radius))
        elif isinstance(spec, form.AgentsFleet):
            read = FleetFile(self._agents(spec.agents, document.grid, coarse))
        else:
            key = "scen" if isinstance(spec, form.ScenFleet) else "file"
            path = self.files.path(getattr(spec, key), ("fleet", key))
            if isinstance(spec, form.ScenFleet):
                read = read_scen_fleet(path, document, spec.robots)
            else:
                read = read_agents(path, document.grid, spec.robots, lifelong=self.file.lifelong is not None)
            if coarse is not document.grid:
                read = replace(read, fleet=coarse_fleet(read.fleet, coarse))
        if coarse is not document.grid:
            self.notes.append(coarse_note(document.grid, coarse))
        self.notes += read.notes
        return read

    def _agents(self, listed: list[form.AgentTable], drawn: Grid, grid: Grid) -> Fleet:
        """The fleet of a list; a mistake names the agent's place in the file."""
        made = []
        for k, one in enumerate(listed):
            radius = None if one.radius is None else Robot(radius=one.radius)
            start = self._near(("fleet", "agents", k, "start"), one.start, drawn, grid)
            goal = self._near(("fleet", "agents", k, "goal"), one.goal, drawn, grid)
            tasks = [
                self._near(("fleet", "agents", k, "tasks", i), stop, drawn, grid)
                for i, stop in enumerate(one.tasks)
            ]
            made.append(Agent(start, goal, radius, tasks))
        try:
            return Fleet(grid, made)
        except LampyrisError as fault:
            index, _, end = fault.where.removeprefix("robots[").partition("]")
            if not index.isdigit():
                raise
            kind = SceneError if isinstance(fault, SceneError) else FileError
            word = end.removeprefix(".").partition("[")[0]
            place: KeyPath = ("fleet", "agents", int(index))
            own = "radius" if word == "robot" else word
            if own in ("start", "goal", "tasks", "radius"):
                place = (*place, own)
            what = f"{end.removeprefix('.')} {fault.what}" if word != "robot" else fault.what
            todo = (
                ""
                if grid is drawn
                else "larger cells are free only if all cells in them are: move it, or make `cell` smaller"
            )
            raise kind(
                fault.code, what, where=spot(self.parsed, place), allowed=fault.allowed, todo=todo
            ) from None

    def _lifelong(
        self, table: Any, listed: tuple[FleetTask, ...] | None, drawn: Grid, grid: Grid
    ) -> Lifelong:
        if table.tasks is not None:
            tasks = []
            for k, one in enumerate(table.tasks):
                at: KeyPath = ("lifelong", "tasks", k)
                stops = [self._near((*at, "stops", i), end, drawn, grid) for i, end in enumerate(one.stops)]
                tasks.append(FleetTask(stops, one.release, one.robot))
                self._free(at, stops, grid)
            return Lifelong(table.ticks, table.window, tuple(tasks))
        key_path: KeyPath = ("fleet", "file")
        if table.tasks_file is not None:
            key_path = ("lifelong", "tasks_file")
            name = self.files.path(table.tasks_file, key_path)
            listed = self.tried(key_path, read_tasks, name, drawn)
        if listed is not None and grid is not drawn:
            listed = coarse_tasks(listed, drawn, grid)
            for one in listed:
                self._free(key_path, one.stops, grid)
        return Lifelong(table.ticks, table.window, listed)

    def _near(self, key_path: KeyPath, end: Any, drawn: Grid, grid: Grid) -> Cell:
        """The cell of a place.

        Raises
        ------
        SceneError, SettingError : one so far from the map that it is no cell, with its place in the file.
        """
        pair = end.m if isinstance(end, Point) else end
        try:
            if max(map(abs, pair)) < FAR:
                cell = _cell(end, drawn, grid)
                if max(map(abs, cell)) < FAR:
                    return cell
        except LampyrisError as fault:
            raise placed(fault, self.parsed, key_path) from None
        code = {"start": "START_OUTSIDE", "goal": "GOAL_OUTSIDE"}.get(str(key_path[-1]), "TASK_OUTSIDE")
        far = SceneError(code, f"{shown(tuple(pair))} is outside the map", allowed="a place on the map")
        raise placed(far, self.parsed, key_path)

    def _free(self, key_path: KeyPath, stops: Sequence[Cell], grid: Grid) -> None:
        """Keep a mistake if a stop of a task is not on a free cell."""
        for x, y in stops:
            if not grid.contains((x, y)) or grid.blocked[y, x]:
                state = "blocked" if grid.contains((x, y)) else "outside the map"
                self.faults.keep(key_path, SceneError("TASK", f"({x}, {y}) is {state}", allowed="free cells"))
                return


def _cell(end: Any, drawn: Grid, grid: Grid) -> Cell:
    """A cell of the fleet's map; a pair is a cell of the map as it was drawn."""
    if not isinstance(end, Point) and grid is drawn:
        return end[0], end[1]
    return grid.to_cell(*end.m) if isinstance(end, Point) else coarse_cell((end[0], end[1]), drawn, grid)
