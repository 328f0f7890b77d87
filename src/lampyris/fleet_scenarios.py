"""Scenarios of fleets: read, run and saved; :mod:`lampyris.scenarios` opens the door for both kinds.

:mod:`lampyris.io.fleet_scenario` reads and writes the files; who plans for fleets is known here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any, TypeAlias

from lampyris import fleets
from lampyris.errors import LampyrisError, UsageError
from lampyris.io.fleet_scenario.scenario import FleetScenario
from lampyris.io.maps.recipes.make import recipe_named
from lampyris.io.scenario.map_source import Files
from lampyris.io.scenario.scenario import Made
from lampyris.io.scenario.validation_errors import Document
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import LifelongTrace
from lampyris.model.robot import Robot
from lampyris.planning.base import Budget
from lampyris.planning.fleet import registry
from lampyris.planning.registry import settings_of

FleetRun: TypeAlias = FleetPlan | FleetTrace | LifelongTrace
"""What a scenario of a fleet comes to."""


def read_fleet_scenario(parsed: Document, files: Files) -> FleetScenario:
    """The scenario of a fleet that a file says; see :func:`lampyris.io.fleet_scenario.build.fleet_scenario_of`.

    Raises
    ------
    LampyrisError : the first mistake; the others are its ``__notes__``.
    """
    from lampyris.io.fleet_scenario.build import fleet_scenario_of

    return fleet_scenario_of(parsed, _known, fleets.bare_fleet, files)


def _known(name: str, settings: Mapping[str, Any], lifelong: bool) -> object:
    made = registry.make(name, settings)
    if lifelong:
        _check_windows(name)
    return made


def _check_windows(planner: str) -> None:
    """See that a planner plans windows of lifelong fleets."""
    from lampyris.sim.fleet.lifelong import PLANNERS

    if planner not in PLANNERS:
        raise UsageError(
            "PLANNER", f"{planner} plans no windows", allowed=", ".join(PLANNERS), setting="planner"
        )


def run_fleet(
    scenario: FleetScenario,
    *,
    plan: FleetPlan | None = None,
    progress: Callable[[int], None] | None = None,
    budget: Budget | None = None,
) -> FleetRun:
    """Do what a scenario of a fleet says: plan; drive it with ``execution``; drive on and on with ``lifelong``.

    Parameters
    ----------
    scenario : loaded from a file, or constructed.
    plan : of its fleet, where it is made already; it is driven, or is the answer.
    progress : called with the planner's iterations, the robots that arrived, or the ticks.
    budget : in place of the scenario's own limits.

    Returns
    -------
    The plan; a :class:`FleetTrace` of a plan that is driven (the plan itself where there is none to drive); a
    :class:`LifelongTrace`.

    Raises
    ------
    LampyrisError : as :func:`lampyris.plan_fleet`, :func:`lampyris.simulate_fleet` and :func:`lampyris.lifelong_fleet`.
    """
    limits = Budget(scenario.iterations, scenario.seconds) if budget is None else budget
    show = None if progress is None else (lambda done, _most: progress(int(done)))
    with named_in(scenario):
        if scenario.lifelong is not None:
            return _lifelong(scenario, limits, show)
        if plan is None and not scenario.reactive:
            plan = fleets.plan_fleet(
                scenario.fleet, scenario.planner, moves=scenario.moves, seed=scenario.seed, budget=limits, progress=show,
                planner_settings=scenario.settings,
            )  # fmt: skip
        if scenario.execution is None or (plan is not None and not plan):
            assert plan is not None
            return plan
        return _drive(scenario, plan, show)


@contextmanager
def named_in(scenario: FleetScenario) -> Iterator[None]:
    """Have what goes wrong name the scenario's file, if it comes from one."""
    try:
        yield
    except LampyrisError as fault:
        if scenario.where and not fault.where.startswith(scenario.where):
            fault.where = f"{scenario.where}: {fault.where}" if fault.where else scenario.where
        raise


def plan_of(scenario: FleetScenario, progress: Callable[[int], None] | None = None) -> FleetPlan:
    """The plan of a scenario, which nobody drives; see :func:`run_fleet`."""
    made = run_fleet(replace(scenario, execution=None, faults=()), progress=progress)
    assert isinstance(made, FleetPlan)
    return made


def _drive(scenario: FleetScenario, plan: FleetPlan | None, show: Any) -> FleetTrace:
    from lampyris import fleet_drives

    assert scenario.execution is not None
    planner = registry.make(scenario.planner, scenario.settings)
    return fleet_drives.simulate_fleet(
        scenario.fleet, plan, planner=planner, delays=scenario.execution.delays, faults=scenario.faults, seed=scenario.seed,
        progress=show, drive_settings=scenario.execution.settings,
    )  # fmt: skip


def _lifelong(scenario: FleetScenario, limits: Budget, show: Any) -> LifelongTrace:
    from lampyris import lifelong

    one = scenario.lifelong
    assert one is not None
    faults = [(robot, int(time) if time == int(time) else time) for robot, time in scenario.faults]
    return lifelong.lifelong_fleet(
        scenario.fleet, one.ticks, tasks=one.tasks, planner=scenario.planner, window=one.window,
        faults=faults, seed=scenario.seed, budget=limits, progress=show,  # type: ignore[arg-type]
    )  # fmt: skip


def save_fleet_scenario(scenario: FleetScenario, target: Path) -> tuple[str, ...]:
    """Write a scenario of a fleet with everything decided; see :func:`lampyris.save_scenario`."""
    from lampyris.io.fleet_scenario.save import write_fleet_scenario

    return write_fleet_scenario(completed_fleet(scenario), target)


def completed_fleet(scenario: FleetScenario) -> FleetScenario:
    """The same scenario with nothing left to a default."""
    source = scenario.map
    if isinstance(source, Made):
        source = replace(source, settings=recipe_named(source.recipe).complete(source.settings))
    done = replace(scenario, map=source)
    if scenario.lifelong is not None:
        from lampyris.sim.fleet.lifelong import WINDOWS

        _check_windows(scenario.planner)
        one = scenario.lifelong
        wide = WINDOWS[scenario.planner] if one.window is None else one.window
        return replace(done, lifelong=replace(one, window=wide))
    planner = registry.make(scenario.planner, scenario.settings)
    done = replace(done, settings={key: getattr(planner, key) for key in settings_of(type(planner))})
    if scenario.execution is None:
        return done
    from lampyris.fleet_drives import RADIUS
    from lampyris.io.fleet_scenario.build import with_robot
    from lampyris.model.settings.fleet_drive import FleetDriveSettings

    drive = asdict(FleetDriveSettings.of(scenario.execution.settings))
    usual = Robot(radius=RADIUS[scenario.moves] * scenario.fleet.grid.resolution)
    alone = all(one.robot is None for one in scenario.fleet.robots)
    return replace(
        done,
        fleet=with_robot(scenario.fleet, usual) if alone else scenario.fleet,
        execution=replace(scenario.execution, settings=drive),
    )
