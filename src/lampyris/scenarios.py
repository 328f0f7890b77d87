"""Scenarios at the front door: load_scenario, run, save_scenario.

The maps room reads and writes the files; who plans and by which speed law is known here.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from lampyris import api
from lampyris._core.limits import MAX_CELLS
from lampyris.errors import LampyrisError, SettingError, callable_or_none, file_name, of_kind
from lampyris.io.maps.formats.document import MapDocument
from lampyris.io.scenario.scenario import Made, MapSource, Scenario
from lampyris.model.plan import Plan
from lampyris.model.profile import Profile
from lampyris.model.robot import Robot
from lampyris.model.settings.inflation import Inflation
from lampyris.motion.laws import registry as laws
from lampyris.planning import registry
from lampyris.planning.base import Budget

if TYPE_CHECKING:
    from lampyris.io.fleet_scenario.scenario import FleetScenario
    from lampyris.model.drive import Drive
    from lampyris.model.fleet.fleet_plan import FleetPlan
    from lampyris.model.fleet.fleet_trace import FleetTrace
    from lampyris.model.fleet.lifelong import LifelongTrace
    from lampyris.model.settings.sensor import Sensor
    from lampyris.model.trace import Trace


class PlanWithSpeeds(NamedTuple):
    """A plan and the speeds along it; no speeds where no path was found."""

    plan: Plan
    profile: Profile | None


class _Names:
    """The planners and laws known by name."""

    def planner(self, name: str, settings: Mapping[str, Any]) -> object:
        """The planner itself."""
        return registry.make(name, settings)

    def files(self, name: str) -> tuple[str, ...]:
        """The planner's settings that are names of files."""
        return files_of(name)

    def law(self, name: str, settings: Mapping[str, Any]) -> object:
        """The law itself."""
        return speed_law(name, settings)

    def drive(self, settings: Mapping[str, Any]) -> object:
        """The settings themselves."""
        from lampyris.model.settings.drive import DriveSettings

        return DriveSettings.of(settings)


def load_scenario(
    path: str | os.PathLike[str], *, allow_outside: bool = False, max_cells: int = MAX_CELLS
) -> Scenario | FleetScenario:
    """Read a scenario file (YAML; JSON if its name ends in ``.json``) and everything it names.

    One with the key ``fleet`` is a :class:`lampyris.FleetScenario`.

    Parameters
    ----------
    path : the file. The files it names are relative to its folder.
    allow_outside : whether it may name files outside its folder; only for scenarios you trust.
    max_cells : maps of more cells are refused.

    Raises
    ------
    LampyrisError : the first mistake in the file, with its place; the others are its ``__notes__``.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> notes = lampyris.save_scenario(lampyris.Scenario(scene, planner="astar"), "guide.yaml")
    >>> lampyris.load_scenario("guide.yaml").planner
    'astar'
    """
    from lampyris.io.scenario import read as reading

    parsed, files = reading.open_scenario(path, allow_outside=allow_outside, max_cells=max_cells)
    if "fleet" in parsed.data:
        from lampyris.fleet_scenarios import read_fleet_scenario

        return read_fleet_scenario(parsed, files)
    return reading.scenario_in(parsed, _Names(), files)


def scenario_of(
    data: dict[str, Any],
    *,
    where: str = "scenario",
    given: MapDocument | None = None,
    source: MapSource | None = None,
    max_cells: int = MAX_CELLS,
) -> Scenario:
    """A scenario from plain data that is in no file: see :func:`lampyris.io.scenario.read.scenario_of`.

    Raises
    ------
    LampyrisError : the first mistake; the others are its ``__notes__``.
    """
    from lampyris.io.scenario import read as reading

    return reading.scenario_of(data, _Names(), where=where, given=given, source=source, max_cells=max_cells)


def run(
    scenario: Scenario | FleetScenario,
    *,
    record: bool = True,
    progress: Callable[[int], None] | None = None,
    budget: Budget | None = None,
) -> PlanWithSpeeds | Trace | Drive | FleetPlan | FleetTrace | LifelongTrace:
    """Execute a scenario: plan; simulate if it is ``simulated``; drive if it has settings of a ``drive``.

    One of a fleet gives a :class:`FleetPlan`; with ``execution`` a :class:`FleetTrace`, if there is a plan to drive; with
    ``lifelong`` a :class:`LifelongTrace`.

    Parameters
    ----------
    scenario : loaded from a file, or constructed.
    record : keep AD-GSO's per-iteration record in the plan.
    progress : called with each tick of a simulation, or with each second of a drive; of fleets with the iterations of the
        planner, the robots that arrived or the ticks.
    budget : when each call of the planner gives up. It is no part of a scenario, but of one of a fleet: there it takes the
        place of the scenario's own.

    Raises
    ------
    LampyrisError : as :func:`lampyris.plan`, :func:`lampyris.speed_profile` and :func:`lampyris.simulate`.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> result = lampyris.run(lampyris.Scenario(scene, planner="astar"))
    >>> result.plan.status.value
    'found'
    """
    _demand_scenario(scenario)
    of_kind("record", record, bool)
    of_kind("budget", budget, Budget, none=True)
    callable_or_none("progress", progress)
    if not isinstance(scenario, Scenario):
        from lampyris.fleet_scenarios import run_fleet

        return run_fleet(scenario, progress=progress, budget=budget)
    try:
        law: Any = speed_law(scenario.law, scenario.law_settings)
        # An object, not a name with settings: a setting may be called as an argument is (patience).
        planner = registry.make(scenario.planner, scenario.settings)
        if scenario.drive is not None:
            seconds = None if progress is None else lambda t: progress(int(t))
            return api.drive(
                scenario.scene, planner, seed=scenario.seed, law=law, budget=budget, progress=seconds,
                **scenario.drive,
            )  # fmt: skip
        if scenario.simulated:
            return api.simulate(
                scenario.scene,
                planner,
                seed=scenario.seed,
                ticks=scenario.ticks,
                law=law,
                patience=scenario.patience,
                sensor=sensor_of(scenario),
                goal_track=scenario.goal_track,
                budget=budget,
                progress=progress,
            )
        found = api.plan(scenario.scene, planner, seed=scenario.seed, budget=budget, record=record)
        return PlanWithSpeeds(found, api.speed_profile(scenario.scene, found, law) if found else None)
    except LampyrisError as fault:
        fault.where = fault.where or scenario.where
        raise


def _demand_scenario(scenario: object) -> None:
    """See that it is one of either kind; what fleets need is imported for fleets alone."""
    if isinstance(scenario, Scenario):
        return
    from lampyris.io.fleet_scenario.scenario import FleetScenario

    if not isinstance(scenario, FleetScenario):
        of_kind("scenario", scenario, Scenario)


def sensor_of(scenario: Scenario) -> Sensor | None:
    """The sensor of a scenario's robot; None: it knows the map.

    Raises
    ------
    SettingError : ``SENSOR_RANGE``, ``FIELD_OF_VIEW``, ``UNSEEN_COST``; ``SENSOR_INFLATION``: costs near walls that nobody has
        seen.
    """
    from lampyris.model.settings.simulation import SimulationSettings

    sensor = SimulationSettings(
        sensor_range=scenario.sensor_range,
        field_of_view=scenario.field_of_view,
        unseen_cost=scenario.unseen_cost,
    ).sensor
    if sensor is not None and scenario.inflation.inflation_radius > 0:
        raise SettingError.of(
            "SENSOR_INFLATION", "sensor_range", "with inflation, whose costs are those of all walls of the map",
            allowed="a sensor, or inflation; not both",
        )  # fmt: skip
    return sensor


def without_effect(scenario: Scenario) -> tuple[str, ...]:
    """Sentences on settings that a scenario states and its run does not keep."""
    inflation = scenario.inflation
    idle: tuple[str, ...] = ()
    if not inflation.inflation_radius and inflation.cost_scaling_factor != Inflation().cost_scaling_factor:
        idle = ("cost_scaling_factor without effect: the inflation_radius is 0",)
    return (*_idle_limits(scenario), *idle)


def _idle_limits(scenario: Scenario) -> tuple[str, ...]:
    robot, usual = scenario.scene.robot, Robot()
    given = [f.name for f in fields(Robot) if getattr(robot, f.name) != getattr(usual, f.name)]
    if registry.plans_poses(scenario.planner):
        given = [
            name
            for name in given
            if name not in ("radius", "footprint", "drive", "turn_radius", "yaw_rate_max")
        ]
    if scenario.drive is not None:
        return ("jerk_max limits profiles, not drives",) if "jerk_max" in given else ()
    if laws.named(scenario.law).units != "m/s":
        idle = [name for name in given if name != "radius"]
        idle += ["zones"] if scenario.scene.zones is not None else []
        why = f"the law {scenario.law} speaks of velocity units and knows no limits of the robot"
    else:
        idle = [name for name in given if name in ("a_lat_max", "turn_radius") and scenario.simulated]
        why = "a simulation goes from cell to cell and knows no bends; plans, profiles and drives do"
    return (f"{', '.join(idle)} without effect: {why}",) if idle else ()


def save_scenario(scenario: Scenario | FleetScenario, path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Write a scenario with every setting, defaults included.

    Running the file gives the same bytes, as long as the map is the same.

    Parameters
    ----------
    scenario : to be written. ``ticks`` None stays open: :func:`completed` with a trace fills it in.
    path : ``.yaml`` or ``.json``; an existing file is replaced. The map is named relative to its folder.

    Returns
    -------
    Notes for the user.

    Raises
    ------
    UsageError : another ending.
    SettingError : no such planner, law or setting; a map that is in no file and cannot be written as rows.
    LimitError : longer than such a file may be.
    FileError : it cannot be written.

    Examples
    --------
    >>> import lampyris
    >>> scene = lampyris.Scene(lampyris.load_grid("guide"), start=(1, 8), goal=(8, 2))
    >>> lampyris.save_scenario(lampyris.Scenario(scene, seed=7), "guide.yaml")
    ()
    >>> lampyris.load_scenario("guide.yaml").seed
    7
    """
    _demand_scenario(scenario)
    if not isinstance(scenario, Scenario):
        from lampyris.fleet_scenarios import save_fleet_scenario

        return save_fleet_scenario(scenario, Path(file_name("path", path)))
    from lampyris.io.scenario.save import named_file, write_scenario

    target, done = Path(file_name("path", path)), completed(scenario)
    names = {key: done.settings[key] for key in files_of(done.planner) if isinstance(done.settings[key], str)}
    named = {key: named_file(name, target.parent) for key, name in names.items()}
    return write_scenario(replace(done, settings={**done.settings, **named}), target)


def files_of(planner: str) -> tuple[str, ...]:
    """The settings of a planner that are names of files; none of one that is not known."""
    try:
        return tuple(getattr(registry.planner_class(planner), "files", ()))
    except LampyrisError:
        return ()


def completed(scenario: Scenario, trace: Trace | None = None) -> Scenario:
    """The same scenario with nothing left to a default.

    Parameters
    ----------
    scenario : any.
    trace : of its simulation, which says when it would have ended.
    """
    planner = registry.make(scenario.planner, scenario.settings)
    source = scenario.map
    if isinstance(source, Made):
        from lampyris.io.maps.recipes.make import recipe_named

        source = replace(source, settings=recipe_named(source.recipe).complete(source.settings))
    from lampyris.model.settings.drive import DriveSettings

    done = replace(
        scenario,
        settings={key: getattr(planner, key) for key in registry.settings_of(type(planner))},
        law_settings=_law_settings(scenario.law, scenario.law_settings),
        map=source,
        drive=None if scenario.drive is None else asdict(DriveSettings.of(scenario.drive)),
    )
    if not scenario.simulated:
        return done
    from lampyris.sim.grid.loop import PATIENCE

    ticks = scenario.ticks if scenario.ticks is not None or trace is None else trace.last_tick
    return replace(done, ticks=ticks, patience=PATIENCE if scenario.patience is None else scenario.patience)


def speed_law(name: str, settings: Mapping[str, Any]) -> Any:
    """A speed law by name with settings: its name alone where they are its defaults.

    Raises
    ------
    UsageError : no such law.
    SettingError : a setting it does not have, or a value out of its range.
    """
    made = laws.with_settings(name, settings)
    return name if made == laws.named(name).settings else made


def _law_settings(name: str, settings: Mapping[str, Any]) -> dict[str, Any]:
    return laws.settings_of(speed_law(name, settings))
