"""Runs of fleets: from a job's plain data to the fleet, and to what its planner and its robots make of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, NamedTuple

from lampyris import fleet_drives, fleets, lifelong
from lampyris.kernels import loading
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.fleet import Agent, Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.fleet.fleet_trace import FleetTrace
from lampyris.model.fleet.lifelong import LifelongTrace
from lampyris.model.grid import Grid
from lampyris.model.robot import Robot
from lampyris.planning.base import Budget
from lampyris.planning.fleet import registry
from lampyris.report.data.fleets.measures import costs_text
from lampyris.study.design.study import FleetQuery


def fleet_of(plain: Mapping[str, Any], grid: Grid, query: FleetQuery) -> Fleet:
    """The fleet of a job: the first robots of a query, on its map.

    Raises
    ------
    ValueError : other robots than the job names, or fewer.
    LampyrisError : robots that cannot be there.
    """
    robots = plain["robots"]
    if query.hash != plain["fleet"] or not 1 <= robots <= len(query.ends):
        raise ValueError(f"the first {robots} robots of a fleet of {len(query.ends)}")
    limits = dict(plain["robot"])
    robot = Robot(**limits) if limits.get("radius") else None
    return Fleet(grid, [Agent((a, b), (c, d), robot) for a, b, c, d in query.ends[:robots].tolist()])


def plan_of_fleet(
    plain: Mapping[str, Any], fleet: Fleet, progress: Callable[[int, int | None], None] | None = None
) -> FleetPlan:
    """What the planner of a job answers, not yet refereed.

    Parameters
    ----------
    progress : as for :func:`lampyris.plan_fleet`.

    Raises
    ------
    LampyrisError : robots or moves that it does not plan for; its tables would take too much memory.
    """
    who, limits = plain["planner"], plain["budget"]
    planner = registry.make(who["name"], who["settings"])
    budget = Budget(limits["expansions"], limits["seconds"])
    return fleets.unchecked_plan(
        fleet, planner, moves=plain["moves"], seed=plain["seed"], budget=budget, progress=progress
    )


class FleetRun(NamedTuple):
    """What a job of fleets came to."""

    noun: FleetPlan | FleetTrace | LifelongTrace
    """A plan; a drive; a lifelong fleet. A plan that is not found is not driven."""
    plan: FleetPlan | None = None
    """That was driven."""
    plan_s: float | None = None
    """CPU seconds of planning; None: not measured apart from the rest."""
    cost_by_s: str = ""
    """How the cost of the plan fell with the CPU seconds; empty: there is none."""


def run_of_fleet(plain: Mapping[str, Any], fleet: Fleet) -> FleetRun:
    """What comes of a job.

    Raises
    ------
    LampyrisError : as :func:`plan_of_fleet`, :func:`lampyris.simulate_fleet` and :func:`lampyris.lifelong_fleet`.
    """
    who = plain["planner"]
    if "lifelong" in plain:
        ask = plain["lifelong"]
        seconds = plain["budget"]["seconds"]
        budget = None if seconds is None else Budget(seconds=seconds)
        made = lifelong.lifelong_fleet(
            fleet, ask["ticks"], planner=who["name"], window=ask["window"], seed=plain["seed"], budget=budget
        )
        return FleetRun(made)
    ask = plain.get("execute")
    if ask is None:
        return FleetRun(*_timed_plan(plain, fleet))
    plan, plan_s, cost_by_s = None, 0.0, ""
    if ask["settings"]["policy"] != "orca":
        plan, _, plan_s, cost_by_s = _timed_plan(plain, fleet)
        if not plan:
            return FleetRun(plan, None, plan_s)
    trace = fleet_drives.simulate_fleet(
        fleet, plan, planner=who["name"], robot=usual_robot(plain, fleet.grid), delays=Delays(**ask["delays"]),
        seed=plain["seed"], drive_settings=ask["settings"],
    )  # fmt: skip
    return FleetRun(trace, plan, plan_s, cost_by_s)


def _timed_plan(plain: Mapping[str, Any], fleet: Fleet) -> tuple[FleetPlan, None, float, str]:
    """The plan, None, the CPU seconds that it took, and how its cost fell with them, as far as the planner reported it."""
    fell: list[tuple[float, int]] = []
    began = loading.cpu()

    def note(_: int, cost: int | None) -> None:
        if cost is not None and (not fell or cost < fell[-1][1]):
            fell.append((loading.cpu() - began, cost))

    found = plan_of_fleet(plain, fleet, note)
    seconds = loading.cpu() - began
    if found:
        note(0, found.sum_of_costs)
    return found, None, seconds, costs_text(fell) if found else ""


def usual_robot(plain: Mapping[str, Any], grid: Grid) -> Robot:
    """The robot of a job that drives; where no size is stated, as large as its moves allow."""
    limits = dict(plain["robot"])
    if not limits["radius"]:
        limits["radius"] = fleet_drives.RADIUS[plain["moves"]] * grid.resolution
    return Robot(**limits)


def load_planner(plain: Mapping[str, Any]) -> None:
    """Load or compile what a planner runs: a limit in seconds is for planning."""
    _load(plain["planner"]["name"], plain["moves"])


@cache
def _load(name: str, moves: str) -> None:
    small = Fleet(Grid([[False] * 3] * 2), [Agent((0, 0), (2, 1)), Agent((2, 0), (0, 1))])
    fleets.unchecked_plan(small, registry.make(name, {}), moves=moves, seed=0, budget=None)
