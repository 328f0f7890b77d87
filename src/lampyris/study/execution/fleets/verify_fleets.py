"""Verification of plans of fleets: the claim is put on the parent's own fleet and judged by the referee.

What cannot be seen: iterations and states, a lower bound of ``cbs`` or ``eecbs`` between the sum of the shortest paths and
the cost, whether ``no-path`` is true, and at which iteration a plan became cheaper.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from lampyris import fleets, referee
from lampyris.model.plan import Status
from lampyris.planning.fleet import registry
from lampyris.report.data.fleet_measures import fleet_metrics
from lampyris.report.data.measures import Metrics
from lampyris.study.design.study import FleetQuery, StudyMap
from lampyris.study.execution.fleets.fleet_evidence import fleet_plan_of
from lampyris.study.execution.fleets.fleet_runs import fleet_of
from lampyris.study.execution.rejected import demand, refuse

_ENDINGS = (Status.FOUND, Status.NO_PATH, Status.ITERATION_LIMIT, Status.LIMIT)


def verified_fleet(plain: Mapping[str, Any], evidence: Any, ground: StudyMap, query: FleetQuery) -> Metrics:
    """The measures of the plan of a fleet that a worker claims.

    Raises
    ------
    RejectedResult, LampyrisError, ArithmeticError, LookupError, TypeError, ValueError : it does not stand.
    """
    fleet = fleet_of(plain, ground.grid, query)
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
    return fleet_metrics(plan)
