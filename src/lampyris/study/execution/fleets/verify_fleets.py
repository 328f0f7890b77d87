"""Verification of plans of fleets: the claim is put on the parent's own fleet and judged by the referee.

What cannot be seen: iterations and states, a lower bound of ``cbs`` or ``eecbs`` between the sum of the shortest paths and
the cost, whether ``no-path`` is true, and at which iteration a plan became cheaper. Of drives: which moves were delayed, for how
long, and where moving obstacles walked; of lifelong fleets: which cells their tasks are and how often PIBT helped out.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from lampyris import fleets, referee
from lampyris.fleet_drives import OBSTACLE_RADIUS, longest_step, robots_of
from lampyris.model.fleet.delays import Delays
from lampyris.model.fleet.fleet import Fleet
from lampyris.model.fleet.fleet_plan import FleetPlan
from lampyris.model.plan import Status
from lampyris.model.settings.fleet_drive import FleetDriveSettings
from lampyris.planning.fleet import registry
from lampyris.report.data.fleets.drive_measures import fleet_drive_metrics, lifelong_metrics
from lampyris.report.data.fleets.measures import fleet_metrics
from lampyris.report.data.measures import Metrics
from lampyris.sim.fleet.lifelong import WINDOWS
from lampyris.study.design.study import FleetQuery, StudyMap
from lampyris.study.execution.fleets.drive_evidence import drive_of, lifelong_of
from lampyris.study.execution.fleets.fleet_evidence import fleet_plan_of
from lampyris.study.execution.fleets.fleet_runs import fleet_of, usual_robot
from lampyris.study.execution.rejected import demand, refuse

_ENDINGS = (Status.FOUND, Status.NO_PATH, Status.ITERATION_LIMIT, Status.LIMIT)


def verified_fleet(plain: Mapping[str, Any], evidence: Any, ground: StudyMap, query: FleetQuery) -> Metrics:
    """The measures of the plan of a fleet that a worker claims.

    Raises
    ------
    RejectedResult, LampyrisError, ArithmeticError, LookupError, TypeError, ValueError : it does not stand.
    """
    fleet = fleet_of(plain, ground.grid, query)
    if "lifelong" in plain:
        return _lifelong(plain, evidence, fleet)
    if "execute" in plain and isinstance(evidence, Mapping) and evidence.get("kind") == "fleet-drive":
        return _drive(plain, evidence, fleet)
    plan = _plan(plain, evidence, fleet)
    if "execute" in plain and plan:
        refuse("a plan that nobody has driven")
    return fleet_metrics(plan)


def _drive(plain: Mapping[str, Any], evidence: Mapping[str, Any], fleet: Fleet) -> Metrics:
    """The measures of a drive."""
    ask = plain["execute"]
    settings = FleetDriveSettings.of(ask["settings"])
    plan = None
    if settings.policy != "orca":
        plan = _plan(plain, evidence.get("plan"), fleet)
        if not plan:
            refuse("a drive of no plan")
    robots = robots_of(fleet, usual_robot(plain, fleet.grid), plain["moves"])
    trace = drive_of(evidence, fleet, robots, settings, Delays(**ask["delays"]), plain["seed"], plan)
    if trace.status not in (Status.FOUND, Status.LIMIT):
        refuse(f"{trace.status.value} of a drive without faults")
    radius = settings.obstacle_radius
    size = OBSTACLE_RADIUS * fleet.grid.resolution if radius is None else radius
    if len(trace.obstacles) > settings.obstacles:
        refuse(f"{len(trace.obstacles)} moving obstacles; asked for were {settings.obstacles}")
    if any(
        one.radius != size or one.top_speed > settings.obstacle_speed * (1 + 1e-9) for one in trace.obstacles
    ):
        refuse("a moving obstacle of another size or speed than asked for")
    if not ask["delays"]["probability"] and trace.delayed:
        refuse(f"{trace.delayed} delayed moves, without delays")
    if plan is not None:
        tick = fleet.grid.resolution * longest_step(plan.paths) / min(one.v_max for one in robots)
        planned = np.array([(len(path) - 1) * tick for path in plan.paths])
        if trace.tick != tick or not np.array_equal(trace.planned, planned):
            refuse("other times of the plan than its ticks at full speed")
    demand(referee.check_fleet_trace(trace))
    return fleet_drive_metrics(trace, plan)


def _lifelong(plain: Mapping[str, Any], evidence: Any, fleet: Fleet) -> Metrics:
    """The measures of a lifelong fleet."""
    ask, who = plain["lifelong"], plain["planner"]["name"]
    window = WINDOWS[who] if ask["window"] is None else ask["window"]
    trace = lifelong_of(evidence, fleet, who, window, plain["seed"])
    if [tuple(cell) for cell in trace.xy[0].tolist()] != list(fleet.starts):
        refuse("robots that begin elsewhere")
    limited = trace.status is Status.LIMIT and plain["budget"]["seconds"] is not None
    if not limited and (trace.status is not Status.FOUND or trace.ticks != ask["ticks"]):
        refuse(f"{trace.status.value} after {trace.ticks} ticks; asked for were {ask['ticks']}")
    if trace.ticks > ask["ticks"] or trace.fallbacks > trace.windows or trace.windows > trace.ticks + 1:
        refuse(f"{trace.ticks} ticks, {trace.windows} windows and {trace.fallbacks} fallbacks")
    if any(
        at >= 0 and at != one.release for at, one in zip(trace.assigned.tolist(), trace.tasks, strict=True)
    ):
        refuse("a drawn task that is given later than it is drawn")
    demand(referee.check_lifelong(trace))
    return lifelong_metrics(trace)


def _plan(plain: Mapping[str, Any], evidence: Any, fleet: Fleet) -> FleetPlan:
    """The plan of a job, judged."""
    who = plain["planner"]
    planner = registry.make(who["name"], who["settings"])
    plan = fleet_plan_of(evidence, who["name"], plain["seed"], plain["moves"])
    if plan.status not in _ENDINGS:
        refuse(f"{plan.status.value} of a plan of a fleet")
    limits = plain["budget"]
    no_limits = limits["expansions"] is None and limits["seconds"] is None
    if plan.status is Status.LIMIT and no_limits:
        refuse("limit without a budget")
    demand(referee.check_fleet_plan(plan, fleet, factor=fleets.promised_factor(planner)))
    return plan
